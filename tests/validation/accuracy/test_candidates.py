"""Candidates of the accuracy table: which models a scene is compared with, and how their forces are held."""

import numpy as np
import pytest

from study_app.evaluation.hand_motions import stir
from study_app.haptics.model.scene import Given, MotionBox
from study_app.validation.accuracy import candidate_sets
from study_app.validation.accuracy.candidates import LinearRung, TickRung
from tests.validation.accuracy.scenes import REAL, TANK, compiled, first_seconds

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(("speed_mps", "expects"), [(1e-3, "no resistance"), (0.6, "+ history")])
def test_the_ladder_has_the_gates_own_choice(speed_mps, expects):
    box = MotionBox(speed_mps=speed_mps, acceleration_mps2=10 * speed_mps)
    rungs, choice = candidate_sets.physical(REAL.model_copy(update={"motion": box}))
    assert choice in rungs
    assert expects in choice.name
    assert isinstance(rungs[0], LinearRung)


@compiled
def test_forces_of_a_slower_rung_are_held_between_its_ticks():
    rung = TickRung("slow", "slow", "rate", TANK.model_copy(update={"rate_hz": 250.0, "velocity": Given()}), every=4)
    forces = rung.forces(first_seconds(stir(10, 1000), 1.0))
    assert len(forces) == 1000
    held = forces.reshape(250, 4, 3)
    assert (held == held[:, :1]).all()
    assert (np.diff(held[:, 0], axis=0) != 0).any()

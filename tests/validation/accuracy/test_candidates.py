"""Candidates of the accuracy table: which models a scene is compared with, and how their forces are held."""

import numpy as np
import pytest

from study_app.evaluation.hand_motions import stir
from study_app.haptics.model.scene import Given, Liquid, MotionBox, Scene
from study_app.validation.accuracy import candidate_sets
from study_app.validation.accuracy.candidates import LinearRung, ListRung, TickRung
from tests.validation.accuracy.scenes import REAL, TANK, compiled, first_seconds

pytestmark = pytest.mark.slow


@compiled
def test_a_liquid_without_wake_has_a_shorter_ladder():
    scene = candidate_sets.drag_and_wake(Scene(liquids=(Liquid(id="honey", density_kg_m3=1400),)))
    rungs, program = candidate_sets.numerical(scene)
    assert program.name == "drag"
    assert not any(isinstance(rung, ListRung) for rung in rungs)


def test_slow_scenes_are_slowed_down_no_further_than_a_scene_may_be():
    rungs, _ = candidate_sets.numerical(candidate_sets.drag_and_wake(TANK.model_copy(update={"rate_hz": 200.0})))
    assert [rung.every for rung in rungs if rung.every > 1] == [2, 4]


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

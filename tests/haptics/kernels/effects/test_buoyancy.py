import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Body, Box
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import examples, liquid, moving, scene, vectors

G = 9.80665


def volume_m3(diameter_m=0.068):
    return math.pi / 6 * diameter_m**3


def floating_liquid(density=1000.0, **fields):
    return liquid(density, effects=("buoyancy",), **fields)


@settings(max_examples=examples(60), deadline=None)
@given(density=st.floats(1, 20_000), own=st.floats(1, 20_000), diameter=st.floats(0.001, 1))
def test_the_displaced_weight_less_the_own(density, own, diameter):
    table = simulate(
        scene(floating_liquid(density), body=Body(diameter_m=diameter, density_kg_m3=own)), moving([(1, -2, 3)])
    )
    expected = [0, (density - own) * volume_m3(diameter) * G, 0]
    assert vectors(table, "force")[0] == pytest.approx(expected, rel=1e-12, abs=1e-12 * (density + own))


def test_where_two_liquids_meet_the_weight_counts_once():
    left = floating_liquid(800, id="left", region=Box(centre_m=(-1, 0, 0), size_m=(2, 2, 2)))
    right = floating_liquid(1200, id="right", region=Box(centre_m=(1, 0, 0), size_m=(2, 2, 2)))
    x_m = np.linspace(-0.05, 0.05, 201)
    motion = Motion(np.arange(201) / 1000, np.column_stack([x_m, 0 * x_m, 0 * x_m]))
    force = simulate(scene(left, right), motion).fy_n / (volume_m3() * G)
    assert force[0] == pytest.approx(-200)
    assert force[-1] == pytest.approx(200)
    assert (np.diff(force) >= -1e-9).all()


def test_a_liquid_that_does_not_ask_for_it_takes_the_weight_off():
    sea = floating_liquid(1500, id="sea", region=Box(size_m=(4, 4, 4)))
    weightless = liquid(id="bubble", region=Box(size_m=(1, 1, 1)), effects=("drag",))
    x_m = np.full(50, 1.5)
    x_m[10:] = 0.0
    force = simulate(scene(sea, weightless), Motion(np.arange(50) / 1000, np.column_stack([x_m, 0 * x_m, 0 * x_m])))
    assert force.fy_n[5] == pytest.approx(500 * volume_m3() * G)
    assert force.fy_n[40] == pytest.approx(0.0, abs=1e-12)

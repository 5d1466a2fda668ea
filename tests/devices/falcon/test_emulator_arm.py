"""The emulator's arms against a slow reference of their own, and against the closed form, which it does not use."""

import math

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.devices.falcon.emulator_arm import ARMS, bend, count, push_of, set_arms
from study_app.devices.falcon.geometry import GEOMETRIES
from study_app.haptics.layout import records

places = st.tuples(st.floats(-0.05, 0.05), st.floats(-0.03, 0.03), st.floats(-0.045, 0.03))
geometries = st.sampled_from(sorted(GEOMETRIES))


def arms_of(name, place=(0.0, 0.0, 0.0), **options):
    arms = records(ARMS, 1)[0]
    set_arms(arms, GEOMETRIES[name], options.get("units_per_nm", 6616.0), options.get("offsets", (0.0, 0.0, 0.0)))
    bend(arms, np.array(place))
    return arms


def closed_form(name, place):
    """Return the angles by the law of cosines, elbow outside."""
    g = GEOMETRIES[name]
    x, y, z = place[0], place[1], place[2] + g.centre_m
    angles = []
    for phi in g.azimuths_rad:
        u = x * math.cos(phi) + y * math.sin(phi) - g.base_m + g.platform_m
        v = -x * math.sin(phi) + y * math.cos(phi) + g.aside_m
        length = g.ends_m + math.sqrt(g.rod_m**2 - v * v)
        distance = math.hypot(u, z)
        beside = math.acos((distance**2 + g.arm_m**2 - length**2) / (2 * g.arm_m * distance))
        angles.append(math.atan2(z, u) - beside)
    return angles


@given(geometries, places)
def test_angles_are_those_of_the_law_of_cosines(name, place):
    assert arms_of(name, place).angle_rad == pytest.approx(closed_form(name, place), abs=1e-12)


@given(geometries, places, places)
def test_where_it_searched_from_does_not_matter(name, place, before):
    arms = arms_of(name, before)
    bend(arms, np.array(place))
    assert arms.angle_rad == pytest.approx(closed_form(name, place), abs=1e-12)


@given(geometries, places, st.tuples(*[st.floats(-4000, 4000)] * 3))
def test_a_small_step_gets_the_work_that_the_torques_do(name, place, torque):
    step_m = np.array([3e-6, -4e-6, 5e-6])
    arms, units = arms_of(name, place), np.array(torque)
    force_n = [push_of(arms, units, np.array(place), axis) for axis in range(3)]
    before, after = closed_form(name, place - step_m / 2), closed_form(name, place + step_m / 2)
    work_j = sum(-t / 6616.0 * (b - a) for t, a, b in zip(torque, before, after, strict=True))
    assert np.dot(force_n, step_m) == pytest.approx(work_j, rel=1e-5, abs=1e-11)


@pytest.mark.parametrize("name", sorted(GEOMETRIES))
def test_pulling_all_three_arms_pushes_straight_out_and_the_top_arm_upward_or_down(name):
    """A motor value is the negative of an arm's torque: negative values push toward the user."""
    arms = arms_of(name)
    straight = [push_of(arms, np.full(3, -1000.0), np.zeros(3), axis) for axis in range(3)]
    assert straight[2] > 3.0
    assert abs(straight[0]) < 0.2
    assert abs(straight[1]) < 0.2


def test_a_count_is_the_nearest_from_the_zero_of_its_own_arm():
    offsets = (0.01, -0.02, 0.0)
    arms, g = arms_of("libnifalcon", offsets=offsets), GEOMETRIES["libnifalcon"]
    for arm, angle in enumerate(closed_form("libnifalcon", (0.0, 0.0, 0.0))):
        exact = (angle - g.zero_rad - offsets[arm]) / (2 * math.pi / 1280 / (110 / 14.25))
        assert count(arms, arm) == round(exact)


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="slow uncompiled")
def test_out_of_reach_it_points_there():
    arms = arms_of("libnifalcon", (0.0, 0.0, 0.3))
    toward = [math.atan2(0.427, -(0.04 - 0.01443))] * 3
    assert arms.angle_rad == pytest.approx(toward, abs=1e-9)
    assert all(math.isfinite(push_of(arms, np.full(3, 500.0), np.array([0.0, 0.0, 0.3]), axis)) for axis in range(3))

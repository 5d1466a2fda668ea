"""The emulator's arms against a slow reference of their own, and against the closed form, which it does not use."""

import math

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.devices.falcon.emulator.arm import ARMS, bend, count, set_arms, strain
from study_app.devices.falcon.mechanics.geometry import GEOMETRIES
from study_app.devices.falcon.mechanics.kinematics import (
    REACHED,
    inverse,
    jacobian,
    motor_units,
    new_mechanism,
    torques,
)
from study_app.haptics.model.layout import records

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


def force_of(arms, torque, place):
    """Return the force (3,) of torques [units] on the grip [N]."""
    strain(arms, np.array(torque, np.float64), np.array(place))
    return arms.force_n.copy()


@pytest.mark.slow
@given(geometries, places)
def test_angles_are_those_of_the_law_of_cosines(name, place):
    assert arms_of(name, place).angle_rad == pytest.approx(closed_form(name, place), abs=1e-12)


@pytest.mark.slow
@given(geometries, places, places)
def test_where_it_searched_from_does_not_matter(name, place, before):
    arms = arms_of(name, before)
    bend(arms, np.array(place))
    assert arms.angle_rad == pytest.approx(closed_form(name, place), abs=1e-12)


@pytest.mark.slow
@given(geometries, places, st.tuples(*[st.floats(-4000, 4000)] * 3))
def test_a_small_step_gets_the_work_that_the_torques_do(name, place, torque):
    step_m = np.array([3e-6, -4e-6, 5e-6])
    force_n = force_of(arms_of(name, place), torque, place)
    before, after = closed_form(name, place - step_m / 2), closed_form(name, place + step_m / 2)
    work_j = sum(-t / 6616.0 * (b - a) for t, a, b in zip(torque, before, after, strict=True))
    assert np.dot(force_n, step_m) == pytest.approx(work_j, rel=1e-5, abs=1e-11)


@pytest.mark.parametrize("name", sorted(GEOMETRIES))
def test_pulling_all_three_arms_pushes_straight_out(name):
    """A motor value is the negative of an arm's torque: negative values push toward the user."""
    straight = force_of(arms_of(name), [-1000] * 3, (0.0, 0.0, 0.0))
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
    assert np.isfinite(force_of(arms, [500] * 3, (0.0, 0.0, 0.3))).all()


@pytest.mark.slow
@given(geometries, places, st.tuples(*[st.floats(-4, 4)] * 3))
def test_what_the_driver_tells_the_motors_makes_the_force_it_wants(name, place, wanted_n):
    """The driver's statics and these are made in different ways: neither knows the other's mistakes."""
    wanted_n = np.array(wanted_n)
    mechanism, theta, rates = new_mechanism(GEOMETRIES[name], 6616.0), np.zeros(3), np.zeros((3, 3))
    at_m = np.add(place, (0.0, 0.0, GEOMETRIES[name].centre_m))
    assert inverse(mechanism, at_m, theta) == REACHED
    arms = arms_of(name, place)
    assert arms.angle_rad == pytest.approx(theta, abs=1e-12)
    jacobian(mechanism, theta, at_m, rates)
    torque_nm, units = np.zeros(3), np.zeros(3, np.int64)
    torques(rates, wanted_n, torque_nm)
    exact = force_of(arms, -6616.0 * torque_nm, place)
    assert exact == pytest.approx(wanted_n, abs=1e-5 * np.linalg.norm(wanted_n) + 1e-12)
    most = np.abs(6616.0 * torque_nm).max()
    motor_units(mechanism, torque_nm, units)
    shortened = max(1.0, most / 4095)
    off_n = np.linalg.norm(force_of(arms, units, place) * shortened - wanted_n)
    rounding_n = 0.5 / 6616.0 * np.linalg.norm(rates, axis=1).sum() * shortened
    assert off_n < rounding_n + 1e-5 * np.linalg.norm(wanted_n) + 1e-12
    assert rounding_n < 0.005 * max(np.linalg.norm(wanted_n), 2.0)

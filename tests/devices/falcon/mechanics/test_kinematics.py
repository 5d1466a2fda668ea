import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from study_app.devices.falcon.constants import MOST_TORQUE
from study_app.devices.falcon.mechanics import (
    GEOMETRIES,
    OUT_STROKE_M,
    OUTSIDE,
    REACHED,
    SAFE_BOX_M,
    START_M,
    WORKSPACE_M,
    angles,
    forward,
    geometry_named,
    inverse,
    jacobian,
    motor_units,
    new_mechanism,
    rounding_at,
    torques,
)
from study_app.errors import DeviceError

UNITS_PER_NM = 6616.0
MECHANISMS = [new_mechanism(geometry, UNITS_PER_NM) for geometry in GEOMETRIES.values()]

every_geometry = pytest.mark.parametrize("mechanism", MECHANISMS, ids=list(GEOMETRIES))
inside = st.tuples(*(st.floats(low, high) for low, high in SAFE_BOX_M)).map(np.array)
forces = st.tuples(*(st.floats(-8, 8) for _ in range(3))).map(np.array)


def angles_at(mechanism, position_m):
    theta = np.zeros(3)
    assert inverse(mechanism, np.array(position_m, float), theta) == REACHED
    return theta


def reachable(mechanism, position_m):
    return inverse(mechanism, position_m, np.zeros(3)) == REACHED


def jacobian_at(mechanism, position_m):
    rates = np.zeros((3, 3))
    jacobian(mechanism, angles_at(mechanism, position_m), position_m, rates)
    return rates


def torques_for(mechanism, position_m, force_n):
    torque_nm = np.zeros(3)
    torques(jacobian_at(mechanism, position_m), force_n, torque_nm)
    return torque_nm


@every_geometry
class TestPositions:
    def test_the_whole_tank_and_the_out_stroke_are_within_reach(self, mechanism):
        half_x, half_y, half_z = WORKSPACE_M
        for x in (-half_x, 0, half_x):
            for y in (-half_y, 0, half_y):
                for z in (0.127 - half_z, 0.127, 0.127 + half_z):
                    counts = (angles_at(mechanism, (x, y, z)) - mechanism.zero_rad) / mechanism.rad_per_count
                    assert np.abs(counts).max() < 1660  # about the range that is known of the encoders
        angles_at(mechanism, (0, 0, OUT_STROKE_M + 0.005))

    @pytest.mark.slow
    @given(position_m=inside, start_m=inside)
    def test_forward_kinematics_inverts_inverse_kinematics_from_any_start(self, mechanism, position_m, start_m):
        assume(reachable(mechanism, position_m))
        found_m = start_m.copy()
        assert forward(mechanism, angles_at(mechanism, position_m), found_m) == REACHED
        assert np.abs(found_m - position_m).max() < 1e-9

    @given(position_m=inside)
    def test_angles_fulfil_the_arms_constraint_in_space(self, mechanism, position_m):
        """The far ends of arm and rod, computed as points in space, are a rod's length apart."""
        assume(reachable(mechanism, position_m))
        theta = angles_at(mechanism, position_m)
        for i in range(3):
            outward = np.array([mechanism.cos[i], mechanism.sin[i], 0.0])
            sideways = np.array([-mechanism.sin[i], mechanism.cos[i], 0.0])
            elbow = mechanism.arm_m * (math.cos(theta[i]) * outward + math.sin(theta[i]) * np.array([0, 0, 1.0]))
            wrist = position_m - mechanism.base_m * outward + mechanism.aside_m * sideways
            link = wrist - elbow
            in_plane = link - (link @ sideways) * sideways
            rod = link - mechanism.ends_m * in_plane / np.linalg.norm(in_plane)
            assert np.linalg.norm(rod) == pytest.approx(mechanism.rod_m, abs=1e-12)

    def test_a_pose_beyond_reach_is_outside_and_moves_nothing(self, mechanism):
        theta, found_m = np.zeros(3), np.array([0.01, 0.02, 0.12])
        assert inverse(mechanism, np.array([0.0, 0.0, 0.25]), theta) == OUTSIDE
        assert inverse(mechanism, np.array([0.15, 0.0, 0.12]), theta) == OUTSIDE
        assert forward(mechanism, np.array([math.nan, 0.5, 0.5]), found_m) == OUTSIDE
        assert found_m.tolist() == [0.01, 0.02, 0.12]

    @given(counts=st.tuples(*(st.integers(-32768, 32767) for _ in range(3))))
    def test_any_counts_give_their_pose_or_none(self, mechanism, counts):
        theta, found_m, again = np.zeros(3), np.array(START_M), np.zeros(3)
        angles(mechanism, np.array(counts), theta)
        if forward(mechanism, theta, found_m) == REACHED:
            assert inverse(mechanism, found_m, again) == REACHED
            assert np.abs(again - theta).max() < 1e-6
        else:
            assert found_m.tolist() == list(START_M)


def test_the_published_height_of_the_encoders_zero_is_met():
    for mechanism, height_m in zip(MECHANISMS, (0.1346, 0.1363, 0.1385), strict=True):
        found_m = np.array(START_M)
        assert forward(mechanism, np.full(3, math.radians(35)), found_m) == REACHED
        assert found_m[2] == pytest.approx(height_m, abs=5e-4)
        assert np.hypot(*found_m[:2]) < 1e-9


@pytest.mark.parametrize(("name", "counts_per_degree"), [("libnifalcon", 27.45), ("martin-hillier", 27.09)])
def test_a_count_is_the_angle_that_was_published(name, counts_per_degree):
    assert 1 / math.degrees(GEOMETRIES[name].rad_per_count) == pytest.approx(counts_per_degree, abs=0.005)


def test_an_unknown_geometry_is_refused_with_the_known_ones():
    with pytest.raises(DeviceError, match=r"'stamper'.*libnifalcon, zm-redux, martin-hillier"):
        geometry_named("stamper")


def test_a_calibrated_offset_turns_every_arm():
    mechanism = new_mechanism(GEOMETRIES["libnifalcon"], UNITS_PER_NM, math.radians(5))
    theta = np.zeros(3)
    angles(mechanism, np.array([0, 0, 100]), theta)
    assert np.degrees(theta) == pytest.approx([40, 40, 40 + math.degrees(100 * mechanism.rad_per_count)])


@every_geometry
class TestForces:
    @pytest.mark.slow
    @given(position_m=inside)
    def test_jacobian_is_the_slope_of_the_angles(self, mechanism, position_m):
        step_m = 1e-6
        slopes = np.zeros((3, 3))
        for axis, along in enumerate(np.eye(3) * step_m):
            assume(reachable(mechanism, position_m + 3 * along) and reachable(mechanism, position_m - 3 * along))
            after, before = angles_at(mechanism, position_m + along), angles_at(mechanism, position_m - along)
            slopes[:, axis] = (after - before) / (2 * step_m)
        rates = jacobian_at(mechanism, position_m)
        # near the end of reach the angles bend so much that a slope over a micrometre is coarser
        assert np.abs(rates - slopes).max() < 1e-6 * max(1.0, np.abs(rates).max() ** 2)

    @pytest.mark.slow
    @given(position_m=inside, force_n=forces, step=forces)
    def test_torques_do_the_work_of_the_force_along_any_step(self, mechanism, position_m, force_n, step):
        assume(reachable(mechanism, position_m))
        rates = jacobian_at(mechanism, position_m)
        assume(np.abs(rates).max() < 1000)
        work_j = torques_for(mechanism, position_m, force_n) @ (rates @ step)
        assert work_j == pytest.approx(force_n @ step, abs=1e-9)

    @pytest.mark.slow
    @given(torque_nm=st.tuples(*(st.floats(-5, 5) for _ in range(3))).map(np.array))
    def test_too_great_a_demand_keeps_its_direction_and_never_wraps(self, mechanism, torque_nm):
        units = np.zeros(3, np.int64)
        shortened = motor_units(mechanism, torque_nm, units)
        wanted = -UNITS_PER_NM * torque_nm
        assert shortened == (np.abs(wanted).max() > MOST_TORQUE)
        assert np.abs(units).max() <= MOST_TORQUE
        share = min(1.0, MOST_TORQUE / max(np.abs(wanted).max(), 1e-9))
        assert np.abs(units - wanted * share).max() <= 0.5 + 1e-9

    @given(position_m=inside, force_n=forces)
    def test_whole_units_exceed_a_force_by_no_more_than_the_stated_error(self, mechanism, position_m, force_n):
        assume(reachable(mechanism, position_m))
        torque_nm = torques_for(mechanism, position_m, force_n)
        assume(np.abs(torque_nm).max() * UNITS_PER_NM < MOST_TORQUE)
        units = np.zeros(3, np.int64)
        motor_units(mechanism, torque_nm, units)
        rates = jacobian_at(mechanism, position_m)
        sent_n = -units / UNITS_PER_NM @ rates
        assert np.linalg.norm(sent_n) <= np.linalg.norm(force_n) + rounding_at(mechanism, rates) + 1e-9

    @pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
    def test_a_torque_that_is_not_finite_stops_all_motors(self, mechanism, bad):
        units = np.full(3, 7)
        assert motor_units(mechanism, np.array([0.1, bad, 0.1]), units) == 1
        assert units.tolist() == [0, 0, 0]

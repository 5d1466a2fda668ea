"""The emulated Falcon at work: packets, homing, and torques that push."""

from random import Random

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

from study_app.devices.falcon.wire import constants
from tests.devices.falcon.emulator.test_arm import closed_form
from tests.devices.falcon.support.emulated_falcon import HOMING, at_work, counts_in, exchanged, home, packet, status_in

pytestmark = pytest.mark.slow


def true_counts(emulator, place=None):
    """Return the counts (3,) at a place, by the law of cosines."""
    g = emulator.geometry
    angles = closed_form(g.name, emulator.position_m if place is None else place)
    return [round((angle - g.zero_rad) / g.rad_per_count) for angle in angles]


# packets


def test_a_packet_is_answered_with_encoders_and_buttons():
    emulator = at_work()
    emulator.press(0b1010)
    reply = exchanged(emulator)
    assert (len(reply), reply[:1], reply[15:]) == (16, b"<", b">")
    assert counts_in(reply) == [0, 0, 0]
    assert status_in(reply) == (0b1010, 0)
    emulator.release()
    assert status_in(exchanged(emulator)) == (0, 0)


@pytest.mark.parametrize("torques", [(1, -1, 4095), (-4095, 0, 15), (0x0FF, -0x100, 0x123)])
def test_it_stores_torques_and_lights(torques):
    emulator = at_work()
    exchanged(emulator, torques, constants.FLAG_RED | constants.FLAG_BLUE)
    assert emulator.torques == torques
    assert emulator.lights == constants.FLAG_RED | constants.FLAG_BLUE
    assert emulator.highest_torque == emulator.highest_unhomed_torque == max(map(abs, torques))
    assert emulator.excessive == 0


def test_torques_beyond_the_range_are_counted_and_cut_off():
    emulator = at_work()
    exchanged(emulator, (-4095, -4095, -4095))
    most = emulator.force_n[2]
    exchanged(emulator, (-4096, -30000, -5000))
    assert emulator.excessive == 1
    assert emulator.highest_torque == 30000
    assert emulator.force_n[2] == pytest.approx(most, rel=1e-3)


@pytest.mark.parametrize("torques", [(-4095, -4095, -4095), (4095, 4095, 4095), (-4095, 4095, 0), (0, 4095, -4095)])
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.03, -0.02, 0.02)])
def test_the_motors_saturate_at_the_force_of_a_real_one_and_keep_its_direction(torques, place):
    emulator = at_work()
    emulator.hold(*place)
    emulator.pause(0.5)
    exchanged(emulator, tuple(torque // 10 for torque in torques))
    weak_n = np.array(emulator.force_n)
    exchanged(emulator, torques)
    strong_n = np.array(emulator.force_n)
    assert 9.0 <= np.linalg.norm(strong_n) <= 10.0 + 1e-9
    assert strong_n / np.linalg.norm(strong_n) == pytest.approx(weak_n / np.linalg.norm(weak_n), abs=0.01)


def test_what_is_no_packet_is_not_answered_and_the_next_one_is():
    emulator = at_work()
    wrong = packet((5, 5, 5))
    for broken in (wrong[1:], wrong[:9], wrong[:15] + b"?", wrong[:3] + b"\x20" + wrong[4:], b"<<<<", bytes(7)):
        emulator.write(broken, 10)
        emulator.pause(1e-3)
        assert emulator.torques == (0, 0, 0)
    assert emulator.packets == 0
    heard = b"".join(exchanged(emulator, patience=2) for _ in range(3))
    assert len(heard) >= 32
    assert emulator.refused > 40


def test_at_another_speed_it_hears_nothing():
    emulator = at_work()
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_142857)
    assert exchanged(emulator) == b""
    assert emulator.packets == 0


def test_the_last_torque_stays_when_packets_stop():
    emulator = at_work()
    exchanged(emulator, (-300, -300, -300))
    emulator.pause(1.0)
    assert emulator.torques == (-300, -300, -300)
    assert emulator.position_m[2] == pytest.approx(emulator.force_n[2] / 500, abs=3e-4)


# homing


def test_homing_finds_the_true_origin_with_a_jump_and_the_hand_comes_back():
    emulator = at_work()
    homed, jumped, deepest, furthest = 0, 0, 0.0, 0.0
    before = np.zeros(3)
    for _ in range(1500):
        reply = exchanged(emulator, flags=HOMING)
        z = emulator.position_m[2] + emulator.geometry.centre_m
        deepest, furthest = min(deepest or z, z), max(furthest, z)
        now = status_in(reply)[1]
        assert now & homed == homed
        jump = np.abs(np.array(counts_in(reply)) - before).max()
        if now != homed:
            jumped = max(jumped, jump)
            assert furthest > 0.170
        else:
            assert jump < 30
        homed, before = now, np.array(counts_in(reply))
        emulator.pause(1.5e-3)
    assert homed == 0b111
    assert jumped > 100
    assert deepest < 0.091
    assert emulator.position_m == pytest.approx((0, 0, 0), abs=1e-3)
    assert counts_in(exchanged(emulator, flags=HOMING)) == pytest.approx(true_counts(emulator), abs=1)


def test_without_the_flag_nothing_homes_and_dropping_it_ends_being_homed():
    emulator = at_work()
    for _ in range(200):
        exchanged(emulator)
        emulator.pause(2e-3)
    assert emulator.homed == 0
    assert emulator.position_m == (0, 0, 0)
    home(emulator)
    assert emulator.homed == 0b111
    assert status_in(exchanged(emulator)) == (0, 0)
    assert counts_in(exchanged(emulator)) == pytest.approx(true_counts(emulator), abs=1)


def test_it_may_forget_its_origin_with_the_flag():
    emulator = at_work()
    home(emulator)
    emulator.faults.on("forgets")
    assert np.abs(counts_in(exchanged(emulator))).max() <= 1


def test_orders_come_before_homing_and_homing_waits_for_them():
    emulator = at_work()
    emulator.reach_to(0.03, 0.0, 0.0, duration_s=0.2)
    exchanged(emulator, flags=HOMING)
    for _ in range(60):
        exchanged(emulator, flags=HOMING)
        emulator.pause(2e-3)
    assert emulator.position_m[2] == pytest.approx(0, abs=1e-3)
    home(emulator)
    assert emulator.homed == 0b111
    emulator.claimed()
    for _ in range(100):
        exchanged(emulator, flags=HOMING)
        emulator.pause(2e-3)
    assert emulator.position_m[2] > 0.01
    emulator.hold(0.0, 0.02, 0.0)
    home(emulator, 1.0)
    assert emulator.position_m == pytest.approx((0, 0.02, 0), abs=1e-3)


def test_pulled_out_far_enough_for_any_gate_by_whoever_claims_it_anew():
    emulator = at_work()
    home(emulator)
    emulator.claimed()
    furthest = 0.0
    for _ in range(600):
        exchanged(emulator, flags=HOMING)
        emulator.pause(2e-3)
        furthest = max(furthest, emulator.position_m[2] + emulator.geometry.centre_m)
    assert furthest > 0.170


def test_a_hand_that_has_stroked_already_pulls_out_again_when_the_blue_light_asks_for_it():
    emulator = at_work()
    home(emulator)
    assert (emulator.homed, emulator.moving) == (0b111, False)
    for _ in range(50):
        exchanged(emulator, flags=HOMING)
        emulator.pause(2e-3)
    assert not emulator.moving
    farthest_m = 0.0
    for _ in range(600):
        exchanged(emulator, flags=HOMING | constants.FLAG_BLUE)
        emulator.pause(2e-3)
        farthest_m = max(farthest_m, emulator.position_m[2])
    assert farthest_m + emulator.geometry.centre_m > 0.170


@pytest.mark.parametrize("fault", ["never_homes", "frozen"])
def test_it_may_never_home(fault):
    emulator = at_work()
    emulator.faults.on(fault)
    home(emulator)
    assert emulator.homed == 0
    emulator.faults.off(fault)
    emulator.claimed()
    home(emulator)
    assert emulator.homed == 0b111


def test_power_off_ends_torque_and_homing_and_the_arms_count_from_where_they_are():
    emulator = at_work()
    home(emulator)
    exchanged(emulator, (100, 100, 100), HOMING)
    emulator.power(False)
    assert (emulator.torques, emulator.homed, emulator.lights) == ((0, 0, 0), 0, 0)
    assert exchanged(emulator) == b""


# the hand and the force


PLACES = [(0.0, 0.0, 0.0), (0.045, 0.025, 0.025), (-0.045, 0.02, -0.025), (0.03, -0.03, 0.02), (-0.02, 0.0, -0.03)]


@pytest.mark.parametrize("place", PLACES)
def test_torques_push_the_handle_against_the_hand_as_virtual_work_says(place):
    """The reference: the same small step taken by the law of cosines, here in plain Python."""
    emulator = at_work()
    emulator.hold(*place)
    for _ in range(400):
        exchanged(emulator, torques := (-400, 250, -600))
        emulator.pause(1e-3)
    at = np.array(emulator.position_m)
    name, step_m = emulator.geometry.name, 1e-5
    for axis in range(3):
        step = np.eye(3)[axis] * step_m
        ticks = np.subtract(closed_form(name, at + step), closed_form(name, at - step)) / (2 * step_m)
        force = float(np.dot(-np.array(torques) / 6616.0, ticks))
        assert emulator.force_n[axis] == pytest.approx(force, abs=2e-4)
        assert (at[axis] - place[axis]) * 500 == pytest.approx(force, abs=0.11)  # spring of the hand, Coulomb friction


def test_encoders_say_where_the_handle_is():
    emulator = at_work()
    home(emulator)
    for place in PLACES:
        emulator.reach_to(*place, duration_s=0.1)
        for _ in range(300):
            reply = exchanged(emulator, flags=HOMING)
        assert counts_in(reply) == pytest.approx(true_counts(emulator), abs=1)


def test_a_weight_pulls_down_and_without_a_hand_it_falls_to_the_stop():
    emulator = at_work()
    emulator.weight_n = 1.0
    emulator.pause(1.0)
    assert emulator.position_m[1] == pytest.approx(-1 / 500, abs=2.5e-4)
    emulator.held = False
    emulator.pause(1.0)
    assert emulator.position_m[1] == pytest.approx(-0.055)


def test_more_units_per_newton_metre_are_less_force():
    strong, weak = at_work(), at_work(units_per_nm=10_000.0)
    for emulator in (strong, weak):
        exchanged(emulator, (-500, -500, -500))
    assert strong.force_n[2] == pytest.approx(weak.force_n[2] * 10_000 / 6616, rel=1e-3)


def test_an_arm_assembled_off_its_zero_counts_from_there():
    offset_rad = 0.02
    plain, off = at_work(), at_work(arm_offset_rad=(offset_rad, 0.0, 0.0))
    home(plain)
    home(off)
    difference = np.subtract(counts_in(exchanged(off, flags=HOMING)), counts_in(exchanged(plain, flags=HOMING)))
    assert difference == pytest.approx([-offset_rad / plain.geometry.rad_per_count, 0, 0], abs=1.01)


def test_who_was_not_looked_at_for_long_has_not_moved_for_long():
    emulator = at_work()
    clock = np.array([0], np.int64)
    emulator.follow_clock(int(clock.ctypes.data))
    exchanged(emulator)
    emulator.weight_n, emulator.held = 0.3, False
    clock[0] = 10 * 10**9
    exchanged(emulator)
    fallen_m = 0.5 * (0.3 - 0.1) / 0.2 * 0.05**2
    assert emulator.position_m[1] == pytest.approx(-fallen_m, rel=0.15)


def test_the_same_random_is_the_same_falcon_to_the_bit():
    def run(seed):
        emulator = at_work(random=Random(seed), tremor_m=5e-5)  # noqa: S311
        emulator.faults.chance("drop", 0.2)
        emulator.reach_to(0.03, 0.01, 0.0)
        heard = [exchanged(emulator, (10 * k, 0, -k), HOMING, patience=2) for k in range(200)]
        return heard, emulator.position_m

    assert run(4) == run(4)
    assert run(4) != run(5)

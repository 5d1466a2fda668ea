import math
from random import Random

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.scripted import QUANTUM_M, TREMOR_M, ScriptedDevice
from study_app.devices.simulated.hand import wave
from study_app.errors import DeviceError
from tests.devices.test_devices import Readings


def steady(**options):
    """Return a scripted device without tremor."""
    return ScriptedDevice(tremor_m=0.0, **options)


def aims(device, ticks, readings=None):
    """Return (ticks, 3) aims of the hand after each tick of 1 ms."""
    readings = readings or Readings(device)
    rows = []
    for _ in range(ticks):
        readings.after(1)
        rows.append(device.aim_m)
    return np.array(rows)


# motions


def test_a_motion_is_followed_along_straight_lines_on_the_devices_clock():
    device = steady()
    t_s = [5.0, 5.1, 5.25, 5.6]  # wherever it begins
    places = np.array([[0, 0, 0], [0.02, 0, -0.01], [0.02, 0.03, 0], [-0.01, 0, 0.01]])
    device.follow(t_s, places)
    seen = aims(device, 700)
    t = np.minimum(5.0 + np.arange(700) * 1e-3, 5.6)
    assert seen == pytest.approx(np.column_stack([np.interp(t, t_s, places[:, axis]) for axis in range(3)]), abs=1e-12)
    assert not device.moving


def test_the_handle_follows_where_the_hand_goes():
    device = steady()
    t = np.arange(0, 2, 1e-3)
    places = np.column_stack((0.03 * np.sin(2 * math.pi * t), np.zeros_like(t), 0.02 * np.sin(3 * math.pi * t)))
    device.follow(t, places)
    readings = Readings(device)
    readings.after(1501)
    assert readings.position_m == pytest.approx(places[1500], abs=1e-3)


def test_a_motion_of_one_place_is_a_place():
    device = steady()
    device.follow([0.0], [[0.01, 0.02, 0.03]])
    assert aims(device, 3)[-1].tolist() == [0.01, 0.02, 0.03]


def test_a_new_motion_replaces_the_one_before():
    device = steady()
    readings = Readings(device)
    device.follow([0.0, 0.02, 0.04, 0.06, 1.0], [[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0], [0.03, 0, 0], [0.05, 0, 0]])
    aims(device, 100, readings)
    device.follow([7.0, 8.0], [[0, 0.01, 0], [0, 0.05, 0]])
    assert aims(device, 101, readings)[-1] == pytest.approx([0, 0.014, 0])


def test_an_order_that_is_half_written_is_left_for_later():
    device = steady()
    readings = Readings(device)
    device.hold(0.01, 0, 0)
    readings.after(1)
    hand = device.state.hand
    hand.serial += 1
    hand.posted.target_m = (0.02, 0.0, 0.0)
    readings.after(1)
    assert device.aim_m == (0.01, 0, 0)
    assert device.moving
    hand.serial += 1
    readings.after(1)
    assert device.aim_m == (0.02, 0, 0)
    assert not device.moving


@pytest.mark.parametrize(
    ("t_s", "position_m", "message"),
    [
        ([], np.zeros((0, 3)), "n > 0"),
        ([0, 1], np.zeros((3, 3)), r"\(2,\) and \(3, 3\)"),
        ([0, 1], np.zeros((2, 2)), r"\(2, 2\)"),
        ([0, 1, 1], np.zeros((3, 3)), "row 2 is at 1.0 s, after 1.0 s"),
        ([0, np.nan], np.zeros((2, 3)), "finite"),
        ([0, 1], np.full((2, 3), np.inf), "finite"),
    ],
)
def test_a_motion_that_is_none_is_refused(t_s, position_m, message):
    with pytest.raises(DeviceError, match=message):
        ScriptedDevice().follow(t_s, position_m)


# reaches


def minimum_jerk(share):
    return 10 * share**3 - 15 * share**4 + 6 * share**5


def test_a_reach_is_of_minimum_jerk():
    device = steady()
    readings = Readings(device)
    device.hold(-0.03, 0.0, 0.01)
    readings.after(1)
    device.reach_to(0.03, 0.02, 0.01, duration_s=0.5)
    seen = aims(device, 700, readings)
    done = minimum_jerk(np.minimum(np.arange(700) / 500, 1))[:, None]
    start, end = np.array([-0.03, 0, 0.01]), np.array([0.03, 0.02, 0.01])
    assert seen == pytest.approx(start + done * (end - start), abs=1e-12)
    speed = np.linalg.norm(np.diff(seen, axis=0), axis=1).max() * 1e3
    assert speed == pytest.approx(1.875 * np.linalg.norm(end - start) / 0.5, rel=1e-3)
    assert not device.moving


def test_a_reach_takes_longer_the_further_it_goes():
    def duration_s(distance_m):
        device = steady()
        device.reach_to(distance_m, 0, 0)
        return np.argmax(aims(device, 1000)[:, 0] >= distance_m * (1 - 1e-12)) * 1e-3

    assert duration_s(0.02) == pytest.approx(0.38, abs=2e-3)
    assert duration_s(0.04) == pytest.approx(0.46, abs=2e-3)


def test_a_reach_begins_where_the_hand_is_then():
    device = steady()
    readings = Readings(device)
    device.reach_to(0.04, 0, 0, duration_s=0.4)
    halfway = aims(device, 201, readings)[-1]
    assert halfway == pytest.approx([0.02, 0, 0])
    device.reach_to(0.02, 0.03, 0, duration_s=0.4)
    assert aims(device, 1, readings)[-1] == pytest.approx(halfway)
    assert device.moving
    assert aims(device, 400, readings)[-1] == pytest.approx([0.02, 0.03, 0])


def test_the_handle_arrives_at_the_target():
    device = ScriptedDevice()
    device.reach_to(0.04, -0.02, 0.01)
    readings = Readings(device)
    readings.after(900)
    assert readings.position_m == pytest.approx([0.04, -0.02, 0.01], abs=3e-4)


def test_resting_is_staying_where_the_hand_is():
    device = steady()
    readings = Readings(device)
    device.reach_to(0.04, 0, 0, duration_s=0.4)
    before = aims(device, 200, readings)[-1]
    device.rest()
    assert (aims(device, 50, readings) == before).all()
    assert not device.moving


def test_a_target_outside_the_workspace_counts_as_its_border():
    device = steady()
    device.reach_to(1.0, 0, 0, duration_s=0.2)
    assert aims(device, 300)[-1].tolist() == [0.05, 0, 0]


def test_a_reach_in_no_time_is_refused():
    with pytest.raises(DeviceError, match="longer than 0 s, got 0"):
        ScriptedDevice().reach_to(0, 0, 0, duration_s=0)


# tremor and encoders


def test_encoders_count():
    device = ScriptedDevice()
    device.reach_to(0.03, 0.02, 0.01)
    readings = Readings(device)
    for _ in range(300):
        readings.after(1)
        counts = readings.position_m / QUANTUM_M
        assert counts == pytest.approx(np.rint(counts), abs=1e-6)


def test_tremor_is_below_a_millimetre_and_between_8_and_12_hz():
    device = ScriptedDevice(Random(3), quantum_m=0.0)  # noqa: S311
    readings = Readings(device)
    rows = []
    for _ in range(8000):
        readings.after(1)
        rows.append(readings.position_m)
    x = np.array(rows)[1000:, 0]
    assert 2e-5 < x.std() < 2e-4
    assert np.abs(x).max() < 5e-4
    power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(x.size))) ** 2
    hertz = np.fft.rfftfreq(x.size, 1e-3)
    assert power[(hertz > 7.5) & (hertz < 12.5)].sum() > 0.95 * power.sum()


def trembling(random):
    device = ScriptedDevice(random)
    device.reach_to(0.03, 0.02, 0.01)
    readings = Readings(device)
    rows = []
    for _ in range(500):
        readings.after(1)
        rows.append(readings.position_m)
    return np.array(rows)


def test_the_same_seed_is_the_same_hand_to_the_bit_and_another_is_not():
    assert np.array_equal(trembling(Random(7)), trembling(Random(7)))  # noqa: S311
    assert not np.array_equal(trembling(Random(7)), trembling(Random(8)))  # noqa: S311
    assert np.array_equal(trembling(None), trembling(None))


def plain_wave(turn):
    phase = 2.0 * (turn - math.floor(turn)) - 1.0
    arch = 4.0 * phase * (1.0 - abs(phase))
    return -(0.225 * (arch * abs(arch) - arch) + arch)


def test_the_hand_moves_to_the_same_bits_as_plain_ieee_arithmetic():
    """So no machine's fused multiplication or sine can make it another hand."""
    target = (0.03, 0.02, 0.01)
    device = ScriptedDevice(Random(7))  # noqa: S311
    hand = device.state.hand
    device.reach_to(*target)
    readings = Readings(device)
    readings.after(1)
    began_ns = readings.now_ns
    x, y, z = target
    duration_ns = int(1e9 * (0.3 + math.sqrt(x * x + y * y + z * z) / 0.25))
    for _ in range(600):
        readings.after(1)
        share = min((readings.now_ns - began_ns) * 1e-9 * 1e9 / duration_ns, 1.0)
        done = share * share * share * (10.0 + share * (6.0 * share - 15.0))
        for axis in range(3):
            offset = 0.0
            for hertz, turn in zip(hand.tremor_hz[axis], hand.tremor_turn[axis], strict=True):
                offset += plain_wave(hertz * (readings.now_ns * 1e-9) + turn)
            assert hand.place_m[axis] == 0.0 + done * (target[axis] - 0.0) + TREMOR_M * offset


@settings(deadline=None)
@given(st.floats(-1e6, 1e6))
def test_the_wave_is_nearly_a_sine(turn):
    assert wave(turn) == pytest.approx(math.sin(2 * math.pi * math.fmod(turn, 1.0)), abs=1.2e-3)

"""The scripted hand: paths, reaches, tremor and encoders, the same to the bit on every machine."""

import math
from random import Random

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.hand import wave
from study_app.devices.simulated import QUANTUM_M, TREMOR_M, ScriptedDevice
from study_app.errors import DeviceError
from tests.devices.subjects import Ticks


class Hand(Ticks):
    """A scripted device, read by a servo that commands no force."""

    def __init__(self, device=None):
        super().__init__(device or ScriptedDevice(tremor_m=0.0))

    def aims(self, ticks):
        """Return (ticks, 3) aims of the hand after each tick of 1 ms."""
        return self.record(ticks, lambda: self.device.aim_m)

    def places(self, ticks):
        """Return (ticks, 3) positions as measured."""
        return self.record(ticks, lambda: self.position_m)

    def record(self, ticks, read_value):
        rows = []
        for _ in range(ticks):
            self.read()
            rows.append(read_value())
        return np.array(rows)


def test_a_motion_is_followed_along_straight_lines_on_the_devices_clock():
    hand = Hand()
    t_s = [5.0, 5.1, 5.25, 5.6]  # wherever it begins
    places = np.array([[0, 0, 0], [0.02, 0, -0.01], [0.02, 0.03, 0], [-0.01, 0, 0.01]])
    hand.device.follow(t_s, places)
    aims = hand.aims(700)
    t = np.minimum(5.0 + np.arange(700) * 1e-3, 5.6)
    assert aims == pytest.approx(np.column_stack([np.interp(t, t_s, places[:, axis]) for axis in range(3)]), abs=1e-12)
    assert not hand.device.moving
    hand.device.follow([0.0], [[0.01, 0.02, 0.03]])
    assert hand.aims(3)[-1].tolist() == [0.01, 0.02, 0.03]


def test_a_new_motion_replaces_the_one_before():
    hand = Hand()
    line = [[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0], [0.03, 0, 0], [0.05, 0, 0]]
    hand.device.follow([0.0, 0.02, 0.04, 0.06, 1.0], line)
    hand.aims(100)
    hand.device.follow([7.0, 8.0], [[0, 0.01, 0], [0, 0.05, 0]])
    assert hand.aims(101)[-1] == pytest.approx([0, 0.014, 0])


def test_an_order_that_is_half_written_is_left_for_later():
    hand = Hand()
    device, state = hand.device, hand.device.state.hand
    device.hold(0.01, 0, 0)
    hand.read()
    state.serial += 1
    state.posted.target_m = (0.02, 0.0, 0.0)
    hand.read()
    assert (device.aim_m, device.moving) == ((0.01, 0, 0), True)
    state.serial += 1
    hand.read()
    assert (device.aim_m, device.moving) == ((0.02, 0, 0), False)


@pytest.mark.parametrize(
    ("t_s", "position_m", "message"),
    [
        ([], np.zeros((0, 3)), "n > 0"),
        ([0, 1], np.zeros((3, 3)), r"\(2,\) and \(3, 3\)"),
        ([0, 1], np.zeros((2, 2)), r"\(2, 2\)"),
        ([0, 1, 1], np.zeros((3, 3)), "row 2 is at 1.0 s, but the row before is at 1.0 s"),
        ([0, np.nan], np.zeros((2, 3)), "finite"),
        ([0, 1], np.full((2, 3), np.inf), "finite"),
    ],
)
def test_an_invalid_motion_is_refused(t_s, position_m, message):
    with pytest.raises(DeviceError, match=message):
        ScriptedDevice().follow(t_s, position_m)


def test_a_reach_is_of_minimum_jerk():
    hand = Hand()
    hand.device.hold(-0.03, 0.0, 0.01)
    hand.read()
    hand.device.reach_to(0.03, 0.02, 0.01, duration_s=0.5)
    aims = hand.aims(700)
    share = np.minimum(np.arange(700) / 500, 1)[:, None]
    progress = 10 * share**3 - 15 * share**4 + 6 * share**5
    start, end = np.array([-0.03, 0, 0.01]), np.array([0.03, 0.02, 0.01])
    assert aims == pytest.approx(start + progress * (end - start), abs=1e-12)
    speed = np.linalg.norm(np.diff(aims, axis=0), axis=1).max() * 1e3
    assert speed == pytest.approx(1.875 * np.linalg.norm(end - start) / 0.5, rel=1e-3)
    assert not hand.device.moving
    with pytest.raises(DeviceError, match="longer than 0 s, not 0"):
        hand.device.reach_to(0, 0, 0, duration_s=0)


def test_a_reach_begins_where_the_hand_is_then_and_ends_within_the_workspace_or_at_rest():
    hand = Hand()
    hand.device.reach_to(0.04, 0, 0, duration_s=0.4)
    halfway = hand.aims(201)[-1]
    assert halfway == pytest.approx([0.02, 0, 0])
    hand.device.reach_to(0.02, 0.03, 0, duration_s=0.4)
    assert hand.aims(1)[-1] == pytest.approx(halfway)
    assert hand.device.moving
    assert hand.aims(400)[-1] == pytest.approx([0.02, 0.03, 0])
    hand.device.reach_to(1.0, 0.03, 0, duration_s=0.2)
    assert hand.aims(300)[-1].tolist() == [0.05, 0.03, 0]
    hand.device.reach_to(0, 0, 0, duration_s=0.4)
    before = hand.aims(200)[-1]
    hand.device.rest()
    assert (hand.aims(50) == before).all()
    assert not hand.device.moving


def test_the_handle_arrives_at_the_target_and_encoders_count():
    hand = Hand(ScriptedDevice())
    hand.device.reach_to(0.04, -0.02, 0.01)
    places = hand.places(900)
    assert places[-1] == pytest.approx([0.04, -0.02, 0.01], abs=3e-4)
    assert places / QUANTUM_M == pytest.approx(np.rint(places / QUANTUM_M), abs=1e-6)


def test_tremor_is_below_a_millimetre_and_between_8_and_12_hz():
    x = Hand(ScriptedDevice(Random(3), quantum_m=0.0)).places(8000)[1000:, 0]  # noqa: S311
    assert 2e-5 < x.std() < 2e-4
    assert np.abs(x).max() < 5e-4
    power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(x.size))) ** 2
    hertz = np.fft.rfftfreq(x.size, 1e-3)
    assert power[(hertz > 7.5) & (hertz < 12.5)].sum() > 0.95 * power.sum()


def trembling_hand(random):
    hand = Hand(ScriptedDevice(random))
    hand.device.reach_to(0.03, 0.02, 0.01)
    return hand.places(500)


def test_the_same_seed_is_the_same_hand_to_the_bit_and_another_is_not():
    assert np.array_equal(trembling_hand(Random(7)), trembling_hand(Random(7)))  # noqa: S311
    assert not np.array_equal(trembling_hand(Random(7)), trembling_hand(Random(8)))  # noqa: S311
    assert np.array_equal(trembling_hand(None), trembling_hand(None))


def plain_wave(turn):
    phase = 2.0 * (turn - math.floor(turn)) - 1.0
    arch = 4.0 * phase * (1.0 - abs(phase))
    return -(0.225 * (arch * abs(arch) - arch) + arch)


def test_the_hand_moves_to_the_same_bits_as_plain_ieee_arithmetic():
    """Otherwise a machine's fused multiplication or sine could change the hand."""
    target = (0.03, 0.02, 0.01)
    hand = Hand(ScriptedDevice(Random(7)))  # noqa: S311
    state = hand.device.state.hand
    hand.device.reach_to(*target)
    hand.read()
    began_ns = hand.now_ns
    x, y, z = target
    duration_ns = int(1e9 * (0.3 + math.sqrt(x * x + y * y + z * z) / 0.25))
    for _ in range(600):
        hand.read()
        share = min((hand.now_ns - began_ns) * 1e-9 * 1e9 / duration_ns, 1.0)
        progress = share * share * share * (10.0 + share * (6.0 * share - 15.0))
        for axis in range(3):
            offset = 0.0
            for hertz, turn in zip(state.tremor_hz[axis], state.tremor_turn[axis], strict=True):
                offset += plain_wave(hertz * (hand.now_ns * 1e-9) + turn)
            assert state.place_m[axis] == 0.0 + progress * (target[axis] - 0.0) + TREMOR_M * offset


@settings(deadline=None)
@given(st.floats(-1e6, 1e6))
def test_the_wave_is_nearly_a_sine(turn):
    assert wave(turn) == pytest.approx(math.sin(2 * math.pi * math.fmod(turn, 1.0)), abs=1.2e-3)

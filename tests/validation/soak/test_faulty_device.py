"""The device that goes wrong on purpose, and the hand that never does the same for long."""

import math
from random import Random

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.haptics.model.layout import LIMITER_GLITCH, LIMITER_STOP, STATUS_DEVICE_LOST
from study_app.haptics.model.scene import Liquid, Scene
from study_app.haptics.runtime.clocks.clock import SystemClock, VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.validation.soak import faulty_device as faulty
from study_app.validation.soak.faulty_device import KINDS, FaultyDevice
from study_app.validation.soak.restless_hand import REACH_M, RestlessHand
from tests.haptics.recording_device import Probe


def turned(kind, readings, *, seed=1, ticks=2000, gap=(20, 60)):
    """Return a device that only goes wrong in one way, and the telemetry of a servo that has it."""
    clock = VirtualClock()
    probe = Probe(velocity_mps=(0.0, 0.0, 0.0))
    device = FaultyDevice(probe, clock, seed)
    device.allow({kind: (1.0, *readings)}, gap)
    servo = Servo(device, clock=clock)
    reader = servo.telemetry.reader()
    while servo.telemetry.written[0] < ticks:
        servo.advance(ticks - int(servo.telemetry.written[0]))
        if servo.fault:
            servo.stop()
    servo.stop()
    return device, reader.read()


def test_readings_that_are_no_numbers():
    device, seen = turned(faulty.NON_FINITE, (1, 8))
    bad = ~np.isfinite(seen.position_m).all(axis=1)
    assert bad.sum() == device.state.injected[faulty.NON_FINITE] > 50
    assert np.isnan(seen.position_m).any()
    assert {math.inf, -math.inf} <= set(seen.position_m[bad].ravel().tolist())
    assert (seen.limiters[bad] & LIMITER_GLITCH).all()


def test_glitches_of_100_m_a_second():
    device, seen = turned(faulty.GLITCH, (1, 8))
    steps = np.linalg.norm(np.diff(seen.position_m, axis=0), axis=1) / 1e-3
    assert (steps > 99).sum() == 2 * device.state.episodes[faulty.GLITCH]


def test_silence():
    device, seen = turned(faulty.SILENCE, (3, 60))
    assert (seen.fresh == 0).sum() == device.state.injected[faulty.SILENCE] > 100
    assert (seen.status != 0).any(), "60 ms are a fault"


def test_a_clock_that_jumps_and_one_that_cannot():
    device, seen = turned(faulty.JUMP, (1, 1))
    assert seen.busy_ns.sum() == device.state.jumped_ns > 10**9
    assert (seen.busy_ns > 0).sum() == device.state.injected[faulty.JUMP]
    real = FaultyDevice(Probe(), SystemClock(), 1)
    real.allow({faulty.JUMP: (1.0, 1, 1)}, (20, 60))
    assert not real.state.share.any()


@pytest.mark.parametrize("kind", [faulty.LOST, faulty.LOST_AT_WRITE])
def test_a_device_that_is_lost_and_comes_back(kind):
    device, seen = turned(kind, (1, 1))
    assert (seen.status == STATUS_DEVICE_LOST).sum() == device.state.injected[kind] > 20


def test_a_stop_button_that_is_held():
    device, seen = turned(faulty.BUTTON, (1, 50))
    assert (seen.buttons != 0).sum() == device.state.injected[faulty.BUTTON] > 100
    assert (seen.limiters[np.argmax(seen.buttons != 0) :] & LIMITER_STOP).all()


def test_nothing_goes_wrong_where_nothing_is_allowed():
    device, seen = turned(faulty.GLITCH, (1, 8), gap=(10**6, 10**6))
    assert device.state.injected.sum() == 0
    assert (seen.limiters & LIMITER_GLITCH == 0).all()
    assert len(KINDS) == len(device.state.share)


def test_the_device_bears_witness_to_what_was_written():
    clock = VirtualClock()
    probe = Probe(velocity_mps=(0.2, 0.0, 0.0))
    device = FaultyDevice(probe, clock, 1)
    servo = Servo(device, clock=clock)
    servo.load(Scene(liquids=(Liquid(id="honey", density_kg_m3=1400),)))
    servo.advance(1000)
    assert device.state.most_n == np.linalg.norm(probe.forces_n, axis=1).max() > 1
    assert device.state.last_n.tolist() == probe.forces_n[-1].tolist()
    assert device.state.writes == len(probe.forces_n)
    servo.stop()
    assert not device.state.last_n.any()


def test_the_hand_stays_within_reach_and_keeps_still_when_asked():
    hand, clock = RestlessHand(Random(1)), VirtualClock()  # noqa: S311
    servo = Servo(hand, clock=clock)
    reader = servo.telemetry.reader()
    for _ in range(40):
        servo.advance(max(1, round(1000 * hand.go_on())))
        places_m = reader.read().position_m
        assert abs(places_m).max() < 1.3 * REACH_M
        assert np.ptp(places_m) > 0
    hand.keep_still()
    servo.advance(2000)
    assert not np.ptp(reader.read().position_m[1000:], axis=0).any()

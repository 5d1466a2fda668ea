"""The servo's loop on a virtual clock: deterministic, without allocation, one scene at a time."""

import math
from random import Random

import numpy as np
import pytest

from study_app.devices.simulated import ScriptedDevice
from study_app.errors import StudyError
from study_app.haptics.model.layout import LIMITER_FADE
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.haptics.runtime.telemetry import HISTORY, timing
from tests.compiled import needs_servo
from tests.haptics.running import is_zero
from tests.haptics.scenes import HONEY, WATER

pytestmark = needs_servo


# the loop is one deterministic function


def scripted_session(*pieces):
    device = ScriptedDevice(Random(5))  # noqa: S311
    servo = Servo(device, clock=VirtualClock())
    reader = servo.telemetry.reader()
    servo.load(WATER)
    device.reach_to(0.03, 0.01, -0.02)
    for ticks in pieces:
        assert servo.advance(ticks) == ticks
    samples = reader.read()
    servo.stop()
    return samples


def test_two_runs_on_a_virtual_clock_are_identical_to_the_bit():
    first, second = scripted_session(3000), scripted_session(3000)
    assert np.abs(first.device_force_n).max() > 0.5
    assert first.tobytes() == second.tobytes()


# scenes


def test_a_servo_begins_at_rest(servo, probe):
    servo.advance(100)
    assert servo.telemetry.latest().scene == 0
    assert is_zero(probe.forces_n)


def test_a_loaded_scene_is_presented_and_echoed_on_the_next_tick(servo):
    reader = servo.telemetry.reader()
    servo.advance(10)
    serial = servo.load(HONEY)
    servo.advance(5)
    assert reader.read().scene.tolist() == [0] * 10 + [serial] * 5


def test_a_change_of_scene_fades_and_never_steps(servo):
    reader = servo.telemetry.reader()
    servo.load(HONEY)
    servo.advance(1000)
    before = reader.read()
    assert before[-1].limiters & LIMITER_FADE == 0
    drag_n = 0.5 * 1400 * 0.47 * math.pi * 0.034**2 * 2.0**2
    assert np.linalg.norm(before[-1].device_force_n) == pytest.approx(drag_n, rel=0.01)
    servo.load(WATER)
    servo.advance(200)
    after = reader.read()
    faded = after.limiters & LIMITER_FADE != 0
    assert faded[:49].all()
    assert not faded[51:].any()
    forces = np.vstack((before.device_force_n[-1:], after.device_force_n))
    assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() <= 0.5 + 1e-12


def test_rest_takes_the_force_to_zero_without_a_step(servo, probe):
    servo.load(HONEY)
    servo.advance(1000)
    servo.rest()
    servo.advance(100)
    forces = probe.forces_n
    assert np.linalg.norm(forces[999]) > 4
    assert is_zero(forces[-1])
    assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() <= 0.5 + 1e-12


def test_a_scene_of_another_rate_is_refused_by_name(servo):
    with pytest.raises(StudyError, match="500 Hz, but the servo runs at 1000 Hz"):
        servo.load(Scene(rate_hz=500))


def test_a_wake_longer_than_the_servo_has_room_for_is_refused(probe):
    servo = Servo(probe, clock=VirtualClock(), elements=1699)
    with pytest.raises(StudyError, match="1700 wake elements, but the servo has room for 1699"):
        servo.load(WATER)


def test_the_force_stays_within_the_limit_of_the_device(probe):
    probe.force_limit_n = 1.5
    servo = Servo(probe, clock=VirtualClock())
    servo.load(HONEY)
    servo.advance(1000)
    sizes = np.linalg.norm(probe.forces_n, axis=1)
    assert sizes.max() == pytest.approx(1.5)


# time


def test_a_gap_is_passed_over_and_not_made_up_for(probe):
    clock = VirtualClock()
    servo = Servo(probe, clock=clock)
    reader = servo.telemetry.reader()
    probe.stall(clock, at_read=10, stall_ns=5_400_000)
    servo.advance(20)
    samples = reader.read()
    assert samples.busy_ns[9] == 5_400_000
    assert samples.lateness_ns[10] == 400_000
    assert samples.lateness_ns[11:].tolist() == [0] * 9
    assert servo.overruns == 4
    assert timing(samples, 1000).overruns == 4
    assert (np.diff(samples.time_ns) >= 600_000).all()


def test_a_late_reader_counts_the_samples_that_it_missed(servo):
    reader = servo.telemetry.reader()
    ticks = HISTORY + 5000
    servo.advance(ticks)
    samples = reader.read()
    assert reader.dropped == ticks - samples.size > 0
    assert samples.tick[-1] == ticks - 1
    assert (np.diff(samples.tick) == 1).all()
    servo.advance(7)
    assert reader.read().size == 7
    assert reader.dropped == ticks - samples.size

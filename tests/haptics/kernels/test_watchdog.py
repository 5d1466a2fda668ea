"""The watchdog: late and missing ticks, and a program that freezes beside the servo."""

import ctypes
import sys
from random import Random

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.devices.simulated import ScriptedDevice
from study_app.errors import ServoFault
from study_app.haptics.kernels.safety import begin_scene, new_safety
from study_app.haptics.model.layout import LIMITER_STALE, LIMITER_STOP, STATUS_OK
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.offline import take_sample
from study_app.haptics.runtime.pack import pack
from study_app.haptics.runtime.servo import Servo
from tests.haptics.recording_device import Probe
from tests.haptics.running import bring_to_force, force_n, is_zero, wait_until
from tests.haptics.scenes import HONEY, WATER

MS = 1_000_000


class Bench:
    """A servo on a virtual clock whose ticks can be withheld, with a moving probe."""

    def __init__(self):
        self.probe, self.clock = Probe(), VirtualClock()
        self.servo = Servo(self.probe, clock=self.clock)
        self.reader = self.servo.telemetry.reader()

    def be_late(self, late_ms):
        """Take a tick that comes late by this time."""
        self.clock.memory[0].now_ns += round((1 + late_ms) * MS)
        return self.servo.advance(1)

    @property
    def fade(self):
        return float(self.servo.loop.safety[0].fade)


@pytest.fixture
def bench():
    return Bench()


@pytest.mark.parametrize("late_ms", [0.5, 4.9])
def test_a_tick_that_is_a_little_late_costs_nothing(bench, late_ms):
    bring_to_force(bench.servo)
    bench.be_late(late_ms)
    assert bench.fade == 1.0
    assert bench.servo.telemetry.latest().limiters & LIMITER_STALE == 0


@pytest.mark.parametrize("late_ms", [6.0, 14.0, 27.5, 49.0])
def test_a_late_tick_finds_the_force_fading_as_without_samples(bench, late_ms):
    bring_to_force(bench.servo)
    bench.reader.read()
    bench.be_late(late_ms)
    share = max(1 - (late_ms - 5) / 10, 0)
    assert bench.fade == pytest.approx(share, abs=1e-6)
    assert bench.servo.telemetry.latest().limiters & LIMITER_STALE
    assert bench.servo.telemetry.latest().status == STATUS_OK
    bench.servo.advance(15)
    forces = bench.reader.read().device_force_n
    assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() <= 0.5 + 1e-12
    assert np.linalg.norm(forces, axis=1).min() <= 8 * share + 8 * 15 / 50
    bench.servo.advance(50)
    assert bench.fade == 1.0


def test_the_slew_limit_does_not_prolong_the_fade_out(bench):
    bench.probe.state.velocity_mps *= 2.0
    bring_to_force(bench.servo)
    assert force_n(bench.servo.telemetry) > 7.0
    bench.probe.state.silent_from_read = bench.probe.state.reads + 1
    bench.servo.advance(16)
    assert is_zero(bench.servo.telemetry.latest().device_force_n)


@pytest.mark.parametrize("late_ms", [50.0, 300.0])
def test_after_fifty_milliseconds_without_a_tick_the_force_is_zero_and_returns_as_at_a_start(bench, late_ms):
    bring_to_force(bench.servo)
    bench.reader.read()
    bench.be_late(late_ms)
    assert bench.fade == 0.0
    bench.servo.advance(250)
    assert bench.fade == pytest.approx(0.5, abs=0.01)
    forces = np.linalg.norm(bench.reader.read().device_force_n, axis=1)
    assert forces[:17].min() <= 8 * 16 / 500, "0.5 N a tick, from 8 N at most"
    assert bench.servo.fault is None


@pytest.mark.parametrize(("hang_ms", "sent"), [(49, True), (50, False), (300, False)])
def test_a_tick_of_50_ms_or_more_ends_with_zero_force(bench, hang_ms, sent):
    bring_to_force(bench.servo)
    assert np.linalg.norm(bench.probe.forces_n[-1]) > 1.0
    bench.probe.stall(bench.clock, int(bench.probe.state.reads) + 1, hang_ms * MS)
    bench.reader.read()
    bench.servo.advance(1)
    assert (np.linalg.norm(bench.probe.forces_n[-1]) > 1.0) == sent
    assert is_zero(bench.reader.read().device_force_n) != sent  # a recording says what was sent last
    if not sent:
        bench.servo.advance(250)
        assert bench.servo.fault is None
        forces_n = np.linalg.norm(bench.probe.forces_n[-251:], axis=1)
        assert (forces_n <= 8 * np.maximum(np.arange(251) - 1, 0) / 500 + 1e-9).all()  # it returns as at a start
        assert forces_n[-1] > 1.0


def test_a_tick_that_hung_in_its_device_is_replayed_to_the_bit(bench):
    bring_to_force(bench.servo)
    bench.probe.stall(bench.clock, int(bench.probe.state.reads) + 1, 80 * MS)
    bench.servo.advance(300)
    samples = bench.reader.read()
    assert np.flatnonzero(samples.limiters & LIMITER_STOP).tolist() == [1001]
    assert np.array_equal(replayed_forces(samples, HONEY), samples.device_force_n)


@pytest.mark.slow
def test_a_servo_hanging_in_its_device_is_reported_and_releases_the_force():
    probe = Probe()
    servo = Servo(probe)
    try:
        servo.start()
        servo.load(HONEY)
        wait_until(lambda: probe.state.reads > 20)
        assert servo.fault is None
        probe.state.hangs = 1
        wait_until(lambda: servo.fault is not None)
        writes = int(probe.state.writes)
        assert "has not run for 75 ms" in servo.fault
        assert not servo.force_is_on
        with pytest.raises(ServoFault, match="has not run for 75 ms"):
            servo.check()
        probe.state.hangs = 0
        wait_until(lambda: probe.state.writes >= writes + 5)
        after_n = np.linalg.norm(
            probe.forces_n[writes + 1 : writes + 5], axis=1
        )  # after the force of the tick that hung
        assert (after_n <= 8 * np.array([0, 0, 1, 2]) / 500).all(), "0.5 s from zero to the whole force, of at most 8 N"
    finally:
        probe.state.hangs = 0
        servo.stop()


def replayed_forces(samples, scene):
    """Return the forces (n, 3) [N] of readings at their times, as a replay computes them: no thread, no clock."""
    again = samples.copy()
    rest, model, safety = pack(scene.model_copy(update={"liquids": ()})), pack(scene), new_safety(8.0)
    for i in range(len(again)):
        if i > 0 and again[i].scene != again[i - 1].scene:
            begin_scene(safety[0])
        safety[0].delay_ticks = again[i].delay_ticks
        take_sample(model if again[i].scene else rest, safety[0], again[i], True)
    return again.device_force_n


@pytest.mark.slow
@pytest.mark.realtime
@pytest.mark.skipif(sys.platform == "win32", reason="a sleep of POSIX")
def test_five_seconds_in_which_python_stands_still_change_no_force():
    """One call of the windows' thread holds the interpreter; each force still equals that of its reading exactly."""
    freeze = ctypes.PyDLL(None).usleep  # a PyDLL does not let the interpreter go: every thread of Python stands still
    device = ScriptedDevice(Random(5))  # noqa: S311
    t_s = np.arange(0, 20, 0.005)
    device.follow(t_s, np.column_stack((0.03 * np.sin(6 * t_s), 0.01 * np.cos(5 * t_s), 0.03 * np.cos(6 * t_s))))
    servo = Servo(device)
    reader = servo.telemetry.reader()  # before the first tick: a replay begins there
    with device, servo:
        servo.load(WATER)
        wait_until(lambda: force_n(servo.telemetry) > 0.5)
        frozen_ns = servo.now_ns()
        freeze(5_000_000)
        thawed_ns = servo.now_ns()
        samples, overruns = reader.read(), servo.overruns
        assert not (samples.status != STATUS_OK).any()
    assert reader.dropped == 0
    assert samples.tick[-1] - samples.tick[0] == len(samples) - 1
    deadlines_ns = samples.time_ns - samples.lateness_ns
    assert (np.diff(deadlines_ns) % MS == 0).all()
    assert int((np.diff(deadlines_ns) // MS - 1).sum()) <= overruns, "a deadline every millisecond, kept or counted"
    frozen = (samples.time_ns > frozen_ns) & (samples.time_ns < thawed_ns)
    seconds = (samples.time_ns[frozen] - frozen_ns) // 1_000_000_000
    assert set(seconds.tolist()) == {0, 1, 2, 3, 4} | ({5} if 5 in seconds else set())
    assert np.linalg.norm(samples.device_force_n[frozen], axis=1).max() > 0.5
    first = int(np.flatnonzero(samples.scene)[0])
    assert is_zero(samples.device_force_n[:first])
    assert np.array_equal(replayed_forces(samples, WATER), samples.device_force_n)

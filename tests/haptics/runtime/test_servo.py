import gc
import math
import signal
import subprocess
import sys
import threading
import time
import weakref
from random import Random

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from numba.core.runtime import _nrt_python, rtsys

from study_app.devices.scripted import ScriptedDevice
from study_app.errors import DeviceLost, ServoFault, StudyError
from study_app.haptics.kernels.loop import run
from study_app.haptics.model.layout import (
    BUTTON_STOP,
    LIMITER_FADE,
    LIMITER_STOP,
    STATUS_DEVICE_LOST,
    STATUS_NON_FINITE,
    STATUS_OK,
    STATUS_STALE_FAULT,
)
from study_app.haptics.model.scene import Liquid, Scene, Wake
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.haptics.runtime.telemetry import HISTORY, timing
from tests.haptics.probe import PROBE, Probe

WATER = Scene(
    liquids=(
        Liquid(
            id="water",
            density_kg_m3=1000,
            effects=("drag", "wake"),
            wake=Wake(length=1700, scaling=1700, exponent=0.75),
        ),
    )
)
HONEY = Scene(liquids=(Liquid(id="honey", density_kg_m3=1400),))


@pytest.fixture
def probe():
    return Probe()


@pytest.fixture
def servo(probe):
    return Servo(probe, clock=VirtualClock())


def wait_until(condition, limit_s=30.0):
    """Wait for another thread; a test that needs it fails rather than hangs."""
    waiting, end = threading.Event(), time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        waiting.wait(0.001)


def force_n(telemetry):
    """Return the size of the force sent last [N]."""
    latest = telemetry.latest()
    return 0.0 if latest is None else np.linalg.norm(latest.device_force_n)


def scene_of(telemetry):
    latest = telemetry.latest()
    return None if latest is None else latest.scene


def is_zero(force):
    return not np.any(force)


# the loop is one deterministic function


def scripted_session(*pieces):
    device = ScriptedDevice(Random(5))  # noqa: S311
    servo = Servo(device, clock=VirtualClock())
    reader = servo.telemetry.reader()
    servo.load(WATER)
    device.reach_to(0.03, 0.01, -0.02)
    for turns in pieces:
        assert servo.advance(turns) == turns
    samples = reader.read()
    servo.stop()
    return samples


def test_two_runs_on_a_virtual_clock_are_identical_to_the_bit():
    first, second = scripted_session(3000), scripted_session(3000)
    assert np.abs(first.device_force_n).max() > 0.5
    assert first.tobytes() == second.tobytes()


def test_advancing_in_pieces_is_advancing_at_once():
    assert scripted_session(1, 16, 17, 966).tobytes() == scripted_session(1000).tobytes()


def test_a_turn_comes_every_period_of_its_clock(servo):
    reader = servo.telemetry.reader()
    servo.advance(50)
    samples = reader.read()
    assert (np.diff(samples.time_ns) == 1_000_000).all()
    assert (samples.lateness_ns == 0).all()
    assert samples.tick.tolist() == list(range(50))


def test_what_is_written_is_what_telemetry_says(servo, probe):
    reader = servo.telemetry.reader()
    servo.load(HONEY)
    servo.advance(700)
    assert np.array_equal(probe.forces_n[-700:], reader.read().device_force_n)


@pytest.fixture
def counted_allocations():
    _nrt_python.memsys_enable_stats()
    yield
    _nrt_python.memsys_disable_stats()


@pytest.mark.usefixtures("counted_allocations")
def test_a_thousand_turns_allocate_nothing(servo):
    servo.load(WATER)
    servo.advance(1)

    def allocations(turns):
        before = rtsys.get_allocation_stats()
        servo.advance(turns)
        return rtsys.get_allocation_stats().alloc - before.alloc

    assert allocations(1001) == allocations(1)


def test_one_compilation_serves_every_device_and_clock(servo):
    servo.advance(1)
    before = list(run.signatures)
    Servo(ScriptedDevice(), clock=VirtualClock()).advance(1)
    assert run.signatures == before


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


def test_every_scene_gets_a_serial_of_its_own_and_rest_is_scene_0(servo):
    assert [servo.load(scene) for scene in (WATER, HONEY, WATER)] == [1, 2, 3]
    servo.advance(1)
    assert servo.telemetry.latest().scene == 3
    servo.rest()
    servo.advance(1)
    assert servo.telemetry.latest().scene == 0
    assert servo.load(HONEY) == 4


def test_rest_takes_the_force_to_zero_without_a_step(servo, probe):
    servo.load(HONEY)
    servo.advance(1000)
    servo.rest()
    servo.advance(100)
    forces = probe.forces_n
    assert np.linalg.norm(forces[999]) > 4
    assert is_zero(forces[-1])
    assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() <= 0.5 + 1e-12


def test_a_reloaded_scene_begins_afresh():
    def first_second(servo, turns_before):
        servo.advance(turns_before)
        servo.load(WATER)
        reader = servo.telemetry.reader()
        servo.advance(1000)
        return reader.read()

    still = Probe(velocity_mps=(0.0, 0.0, 0.0))
    servo = Servo(still, clock=VirtualClock())
    first_second(servo, 600)
    still.state.velocity_mps = (0.1, 0.0, 0.0)
    moved = first_second(servo, 1)
    again = first_second(servo, 1)
    assert is_zero(again.wake_mps[0])
    assert np.abs(moved.wake_mps[-1]).max() > 0.1
    assert again.wake_mps == pytest.approx(moved.wake_mps, abs=1e-6)


def test_a_scene_of_another_rate_is_refused_by_name(servo):
    with pytest.raises(StudyError, match="500 Hz but the servo runs at 1000 Hz"):
        servo.load(Scene(rate_hz=500))


def test_a_wake_longer_than_the_servo_has_room_for_is_refused(probe):
    servo = Servo(probe, clock=VirtualClock(), elements=1699)
    with pytest.raises(StudyError, match="1700 wake elements but the servo has room for 1699"):
        servo.load(WATER)


def test_the_force_stays_within_what_the_device_bears(probe):
    probe.force_limit_n = 1.5
    servo = Servo(probe, clock=VirtualClock())
    servo.load(HONEY)
    servo.advance(1000)
    sizes = np.linalg.norm(probe.forces_n, axis=1)
    assert sizes.max() == pytest.approx(1.5)


# the force ends


def felt(servo, scene=HONEY):
    """Bring the servo to where a force is felt."""
    servo.load(scene)
    servo.advance(1000)
    assert force_n(servo.telemetry) > 1


def test_a_force_stop_is_zero_on_the_next_tick(servo, probe):
    felt(servo)
    servo.stop_force()
    assert not servo.force_is_on
    servo.advance(1)
    assert is_zero(probe.forces_n[-1])
    assert servo.telemetry.latest().limiters & LIMITER_STOP
    servo.advance(1000)
    assert is_zero(probe.forces_n[-1000:])


def test_the_stop_button_of_the_device_is_heard_by_the_servo_itself(servo, probe):
    felt(servo)
    probe.state.buttons = BUTTON_STOP
    servo.advance(1)
    assert is_zero(probe.forces_n[-1])
    assert not servo.force_is_on
    probe.state.buttons = 0
    servo.advance(1000)
    assert is_zero(probe.forces_n[-1000:])


def test_after_a_force_stop_the_force_fades_in_as_at_the_start(servo, probe):
    felt(servo)
    full = np.linalg.norm(probe.forces_n[-1])
    servo.stop_force()
    servo.advance(100)
    servo.fade_in()
    assert servo.force_is_on
    servo.advance(600)
    sizes = np.linalg.norm(probe.forces_n[-600:], axis=1)
    assert sizes[249] == pytest.approx(full / 2, rel=0.02)
    assert sizes[-1] == pytest.approx(full, rel=0.01)


def test_a_force_stop_outlasts_a_change_of_scene(servo, probe):
    felt(servo)
    servo.stop_force()
    servo.load(WATER)
    servo.advance(200)
    assert is_zero(probe.forces_n[-200:])


def test_stopping_writes_zero(servo, probe):
    felt(servo)
    servo.stop()
    assert is_zero(probe.forces_n[-1])


def test_an_exception_in_the_host_ends_in_zero_force(probe):
    def host():
        with Servo(probe, clock=VirtualClock()) as servo:
            felt(servo)
            raise RuntimeError("host")

    with pytest.raises(RuntimeError, match="host"):
        host()
    assert is_zero(probe.forces_n[-1])


def test_a_servo_nobody_holds_ends_in_zero_force(probe):
    servo = Servo(probe, clock=VirtualClock())
    felt(servo)
    gone = weakref.ref(servo)
    del servo
    gc.collect()
    assert gone() is None
    assert is_zero(probe.forces_n[-1])


def test_a_stopped_servo_starts_again_at_rest_and_fades_in(servo, probe):
    felt(servo)
    servo.stop()
    written = len(probe.forces_n)
    servo.advance(100)
    assert servo.telemetry.latest().scene == 0
    assert is_zero(probe.forces_n[written:])
    servo.load(HONEY)
    servo.advance(250)
    assert 0.2 < np.linalg.norm(probe.forces_n[-1]) < 4


def test_stopping_twice_writes_nothing_more(servo, probe):
    felt(servo)
    servo.stop()
    written = len(probe.forces_n)
    servo.stop()
    assert len(probe.forces_n) == written


# faults


@pytest.mark.parametrize("way", ["lost_at_read", "lost_at_write"])
def test_a_lost_device_ends_the_loop_in_zero_force(servo, probe, way):
    felt(servo)
    probe.state[way] = probe.state.reads + 11
    assert servo.advance(100) == 11
    assert is_zero(probe.forces_n[-1])
    assert servo.telemetry.latest().status == STATUS_DEVICE_LOST
    assert servo.advance(100) == 0
    assert not servo.force_is_on
    assert "'probe' stopped answering" in servo.fault
    with pytest.raises(DeviceLost, match="plug it in again"):
        servo.check()
    with pytest.raises(DeviceLost):
        servo.load(WATER)
    servo.rest()


def test_after_a_loss_the_servo_can_be_started_anew(servo, probe):
    felt(servo)
    probe.state.lost_at_read = probe.state.reads + 1
    servo.advance(10)
    probe.state.lost_at_read = 1 << 60
    servo.stop()
    assert servo.advance(10) == 10
    assert servo.fault is None
    felt(servo)


def test_a_device_without_news_for_50_ms_is_a_fault(servo, probe):
    felt(servo)
    probe.state.silent_from_read = probe.state.reads + 1
    assert servo.advance(1000) == 50
    assert servo.telemetry.latest().status == STATUS_STALE_FAULT
    assert is_zero(probe.forces_n[-1])
    with pytest.raises(ServoFault, match="nothing usable for 50 ms"):
        servo.check()


def test_a_force_that_is_no_number_is_never_written(servo, probe):
    felt(servo)
    for model in servo._loop._slots:
        model.liquids.drag.factor_kg_m = np.nan
    assert servo.advance(100) == 1
    assert servo.telemetry.latest().status == STATUS_NON_FINITE
    assert is_zero(probe.forces_n[-1])
    assert np.isfinite(probe.forces_n).all()
    with pytest.raises(ServoFault, match="not a finite number"):
        servo.check()


def test_one_position_that_is_no_number_is_passed_over(servo, probe):
    felt(servo)
    probe.state.bad_at_read = probe.state.reads + 5
    assert servo.advance(100) == 100
    assert servo.telemetry.latest().status == STATUS_OK
    assert np.isfinite(probe.forces_n).all()


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


def test_a_turn_that_is_only_a_little_late_costs_no_deadline(probe):
    clock = VirtualClock()
    servo = Servo(probe, clock=clock)
    reader = servo.telemetry.reader()
    probe.stall(clock, at_read=10, stall_ns=1_700_000)
    servo.advance(20)
    assert reader.read().lateness_ns[10] == 700_000
    assert servo.overruns == 0


def test_a_reader_that_comes_too_late_counts_what_it_missed(servo):
    reader = servo.telemetry.reader()
    turns = HISTORY + 5000
    servo.advance(turns)
    samples = reader.read()
    assert reader.dropped == turns - samples.size > 0
    assert samples.tick[-1] == turns - 1
    assert (np.diff(samples.tick) == 1).all()
    servo.advance(7)
    assert reader.read().size == 7
    assert reader.dropped == turns - samples.size


# in a thread of its own


def test_the_thread_turns_while_python_computes_and_ends_when_told(probe):
    with Servo(probe) as servo:
        reader = servo.telemetry.reader()
        assert servo.load(HONEY) == 1
        wait_until(lambda: scene_of(servo.telemetry) == 1)
        wait_until(lambda: force_n(servo.telemetry) > 0.1)
        assert servo.now_ns() >= servo.telemetry.latest().time_ns
        assert servo.describe()["priority"].split()[0] in {"real-time", "raised", "normal"}
        assert servo.describe()["delay_ticks"] == servo.delay_ticks == servo.dynamics.delay_ticks(servo.rate_hz)
        samples = reader.read()
    assert (samples.lateness_ns >= 0).all()
    assert is_zero(probe.forces_n[-1])
    assert not any(thread.name == "servo" for thread in threading.enumerate())


def test_scenes_loaded_faster_than_ticks_all_arrive_whole(probe):
    with Servo(probe) as servo:
        reader = servo.telemetry.reader()
        serials = [servo.load(scene) for scene in (WATER, HONEY) * 10]
        wait_until(lambda: scene_of(servo.telemetry) == serials[-1])
        assert set(serials) <= set(reader.read().scene.tolist())


def test_a_thread_can_be_stopped_and_started_again(probe):
    servo = Servo(probe)
    for _ in range(2):
        turns = int(servo.telemetry.written[0])
        servo.start()
        servo.load(HONEY)
        wait_until(lambda turns=turns: servo.telemetry.written[0] > turns + 20)
        servo.stop()
        assert is_zero(probe.forces_n[-1])
    assert servo.fault is None


def test_a_lost_device_is_told_to_the_host(probe):
    probe.state.lost_at_read = 20
    with Servo(probe) as servo:
        wait_until(lambda: servo.fault is not None)
        with pytest.raises(DeviceLost):
            servo.check()
    assert is_zero(probe.forces_n[-1])


def test_a_thread_nobody_holds_ends_in_zero_force(probe):
    servo = Servo(probe)
    servo.start()
    servo.load(HONEY)
    telemetry = servo.telemetry
    wait_until(lambda: force_n(telemetry) > 0.1)
    del servo
    gc.collect()
    assert is_zero(probe.forces_n[-1])
    assert not any(thread.name == "servo" for thread in threading.enumerate())


def test_a_servo_does_one_thing_at_a_time(probe):
    virtual = Servo(probe, clock=VirtualClock())
    with pytest.raises(StudyError, match="advance"):
        virtual.start()
    with Servo(probe) as running:
        with pytest.raises(StudyError, match="stop it first"):
            running.start()
        with pytest.raises(StudyError, match="stop it before"):
            running.advance(1)


def test_a_program_keeps_the_signal_handlers_it_has_set(probe):
    def own(_number, _frame):
        pass

    before = signal.signal(signal.SIGTERM, own)
    try:
        with Servo(probe):
            assert signal.getsignal(signal.SIGTERM) is own
    finally:
        signal.signal(signal.SIGTERM, before)


# however the process ends

SCRIPT = """
import os, signal, sys, threading
import numpy as np
from study_app.haptics.runtime.servo import Servo
from tests.haptics.probe import PROBE, Probe
from tests.haptics.runtime.test_servo import HONEY, force_n, wait_until

signal.signal(signal.SIGINT, signal.default_int_handler)  # who runs the tests may have switched signals off
signal.signal(signal.SIGHUP, signal.SIG_DFL)
memory = np.memmap(sys.argv[1], dtype=PROBE, mode="r+", shape=(1,)).view(np.recarray)
servo = Servo(Probe(memory=memory))
servo.start()
servo.load(HONEY)
wait_until(lambda: force_n(servo.telemetry) > 0.1)
memory[0].clock = 1  # from here on the test may look
ways = {
    "SIGTERM": lambda: os.kill(os.getpid(), signal.SIGTERM),
    "SIGINT": lambda: os.kill(os.getpid(), signal.SIGINT),
    "SIGHUP": lambda: os.kill(os.getpid(), signal.SIGHUP),
    "exception": lambda: 1 / 0,
    "exit": lambda: sys.exit(3),
    "end": lambda: None,
}
ways[sys.argv[2]]()
if sys.argv[2].startswith("SIG"):
    threading.Event().wait(30)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(
    ("way", "code"),
    [("SIGTERM", 143), ("SIGINT", -signal.SIGINT), ("SIGHUP", 129), ("exception", 1), ("exit", 3), ("end", 0)],
)
def test_however_the_process_ends_the_last_force_is_zero(tmp_path, way, code):
    Servo(Probe()).prepare()  # compile here, where the time limit is the test's
    shared = tmp_path / "probe"
    shared.write_bytes(bytes(PROBE.itemsize))
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(shared), way], capture_output=True, text=True, timeout=120, check=False
    )
    probe = np.memmap(shared, dtype=PROBE, mode="r", shape=(1,)).view(np.recarray)[0]
    assert probe.clock == 1, ended.stderr
    assert ended.returncode == code, ended.stderr
    forces = probe.forces_n[: probe.writes]
    assert np.linalg.norm(forces, axis=1).max() > 0.1
    assert is_zero(forces[-1])

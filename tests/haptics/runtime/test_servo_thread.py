"""The servo in its own thread, and zero force however its process ends."""

import gc
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from tests.compiled import needs_servo
from tests.haptics.recording_device import PROBE, Probe
from tests.haptics.running import force_n, is_zero, scene_of, wait_until
from tests.haptics.scenes import HONEY, WATER

pytestmark = needs_servo


def test_the_thread_ticks_while_python_computes_and_ends_on_request(probe):
    with Servo(probe) as servo:
        reader = servo.telemetry.reader()
        assert servo.load(HONEY) == 1
        wait_until(lambda: scene_of(servo.telemetry) == 1)
        wait_until(lambda: force_n(servo.telemetry) > 0.1)
        assert servo.telemetry.latest().time_ns <= servo.now_ns()  # in this order: a tick may come between
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


@pytest.mark.slow
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


SCRIPT = """
import os, signal, sys, threading
import numpy as np
from study_app.haptics.runtime.servo import Servo
from tests.haptics.recording_device import PROBE, Probe
from tests.haptics.running import force_n, wait_until
from tests.haptics.scenes import HONEY

signal.signal(signal.SIGINT, signal.default_int_handler)  # who runs the tests may have switched signals off
signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGQUIT, signal.SIG_DFL)
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
    "SIGQUIT": lambda: os.kill(os.getpid(), signal.SIGQUIT),
    "exception": lambda: 1 / 0,
    "exit": lambda: sys.exit(3),
    "end": lambda: None,
}
ways[sys.argv[2]]()
if sys.argv[2].startswith("SIG"):
    threading.Event().wait(30)
"""


@pytest.mark.variants(3)
@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(
    ("way", "code"),
    [
        ("SIGTERM", 143),
        ("SIGINT", -signal.SIGINT),
        ("SIGHUP", 129),
        ("SIGQUIT", 131),
        ("exception", 1),
        ("exit", 3),
        ("end", 0),
    ],
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

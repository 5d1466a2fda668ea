"""Ctrl-Z while a device may push: the program continues, since otherwise its last force would stay."""

import os
import signal
import subprocess
import sys

import numba
import numpy as np
import pytest

if sys.platform == "win32":
    pytest.skip("signals of POSIX", allow_module_level=True)

from study_app.haptics.runtime.grants import SUSPENDING, allow_suspension, refuse_suspension
from tests.haptics.recording_device import PROBE

NUMBERS = [getattr(signal, name) for name in SUSPENDING]

SCRIPT = """
import os, signal, sys
import numpy as np
from study_app.haptics.runtime.servo import Servo
from tests.haptics.recording_device import PROBE, Probe
from tests.haptics.running import force_n, wait_until
from tests.haptics.scenes import HONEY

for name in ("SIGTSTP", "SIGTTIN", "SIGTTOU"):
    signal.signal(getattr(signal, name), signal.SIG_DFL)
memory = np.memmap(sys.argv[1], dtype=PROBE, mode="r+", shape=(1,)).view(np.recarray)
servo = Servo(Probe(memory=memory))
servo.start()
servo.load(HONEY)
wait_until(lambda: force_n(servo.telemetry) > 0.1)
print("pushing", flush=True)
sys.stdin.readline()
ticks = memory[0].writes
wait_until(lambda: memory[0].writes > ticks + 10)
servo.stop()
print("allowed" if signal.getsignal(signal.SIGTSTP) is signal.SIG_DFL else "refused", flush=True)
"""


@pytest.fixture(autouse=True)
def as_a_shell_starts_programs():
    before = {number: signal.signal(number, signal.SIG_DFL) for number in NUMBERS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def handlers():
    return {signal.getsignal(number) for number in NUMBERS}


def test_it_is_refused_until_the_last_one_allows_it():
    first, second = object(), object()
    refuse_suspension(first)
    refuse_suspension(second)
    refuse_suspension(first)
    allow_suspension(first)
    assert handlers() == {signal.SIG_IGN}
    allow_suspension(second)
    allow_suspension(second)
    assert handlers() == {signal.SIG_DFL}


def test_a_handler_that_a_program_has_set_stays():
    own = lambda _number, _frame: None  # noqa: E731
    signal.signal(signal.SIGTSTP, own)
    refuse_suspension(own)
    assert signal.getsignal(signal.SIGTSTP) is own
    allow_suspension(own)
    assert signal.getsignal(signal.SIGTSTP) is own


@pytest.mark.variants(2)
@pytest.mark.slow
@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="devices are C functions")
@pytest.mark.parametrize("name", SUSPENDING)
def test_a_servo_that_pushes_goes_on(tmp_path, name):
    shared = tmp_path / "probe"
    shared.write_bytes(bytes(PROBE.itemsize))
    # In a group of its own whose leader's parent is in the same session: an orphaned group is never stopped.
    pushing = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(shared)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        process_group=0,
    )
    try:
        assert pushing.stdout.readline() == "pushing\n"
        pushing.send_signal(getattr(signal, name))
        pushing.stdin.write("go on\n")
        pushing.stdin.flush()
        waited = os.waitpid(pushing.pid, os.WUNTRACED)
        assert not os.WIFSTOPPED(waited[1])
        assert os.waitstatus_to_exitcode(waited[1]) == 0
        assert pushing.stdout.read() == "allowed\n"
    finally:
        pushing.kill()
        pushing.communicate()
    probe = np.memmap(shared, dtype=PROBE, mode="r", shape=(1,)).view(np.recarray)[0]
    assert np.all(probe.forces_n[probe.writes - 1] == 0.0)

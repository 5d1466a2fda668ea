"""A program that freezes in a trial: the trial is interrupted with a reason and presented again."""

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.whole_study import verify_study
from tests.benchmarks.devices import ends
from tests.compiled import needs_servo
from tests.journal_lines import raw

FROZEN_S = 1.5

pytestmark = [
    pytest.mark.slow,
    needs_servo,
    pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="needs a system that stops processes"),
]


def held_with_a_freeze(folder: Path) -> tuple[dict[str, str], dict[str, str]]:
    """Hold a session that freezes in its first trial; return the rows of the interrupted and the next attempt."""
    program = subprocess.Popen(
        [sys.executable, "-m", "tests.faults.support.frozen", str(folder)],
        cwd=Path(__file__).parents[2],
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
    )
    try:
        _, status = os.waitpid(program.pid, os.WUNTRACED)
        assert os.WIFSTOPPED(status), status
        time.sleep(FROZEN_S)
        program.send_signal(signal.SIGCONT)
        assert program.wait(150) == 0
    finally:
        program.kill()
        program.wait()
    (session,) = StudyFolder(folder / "results").sessions()
    lines = raw(journal.read(session.journal))
    assert [line["by"] for line in lines if line["event"] == "paused"] == ["program"]
    assert not any(line["event"] == "broke" for line in lines)
    assert verify_study(folder / "results").errors == ()
    with session.table("demo", "trials").open(newline="", encoding="utf-8") as file:
        frozen, again = csv.DictReader(file)
    assert (frozen["trial"], frozen["attempt"], frozen["outcome"]) == ("1", "1", "interrupted")
    assert (again["trial"], again["attempt"], again["outcome"]) == ("1", "2", "complete")
    assert float(again["worst_gap_ms"]) < 1000
    return frozen, again


@pytest.mark.nightly
def test_a_process_that_is_stopped_in_a_trial_has_it_interrupted_and_presents_it_again(tmp_path: Path) -> None:
    frozen, _ = held_with_a_freeze(tmp_path)
    assert float(frozen["worst_gap_ms"]) > 1000 * FROZEN_S
    assert frozen["valid"] == "false"


CONTINUED = """
with opened() as loop:
    stroke(loop)
    loop.read()
    os.kill(os.getpid(), signal.SIGSTOP)
    time.sleep(0.8)
    try:
        samples = loop.read()
    except api.StudyError as error:
        samples = None
np.save(sys.argv[2], at_device() if samples is None else samples)
"""


@pytest.mark.parametrize("device", ends.DEVICES)
def test_the_force_of_a_process_that_was_stopped_fades_in_when_it_goes_on(device: str, tmp_path: Path) -> None:
    """It falls to zero at once, and returns within 500 ms; if the device was lost meanwhile, the last force is zero."""
    words = [sys.executable, "-c", ends.PREAMBLE + CONTINUED, device, str(tmp_path / "samples.npy")]
    program = subprocess.Popen(words, cwd=Path(__file__).parents[2], stdout=subprocess.DEVNULL)
    try:
        _, status = os.waitpid(program.pid, os.WUNTRACED)
        assert os.WIFSTOPPED(status), status
        time.sleep(0.3)
        program.send_signal(signal.SIGCONT)
        assert program.wait(60) == 0
    finally:
        program.kill()
        program.wait()
    samples = np.load(tmp_path / "samples.npy")
    if samples.dtype.names is None:  # the servo has stopped itself
        assert not samples.any()
        return
    first = int(np.argmax(samples["lateness_ns"]))
    assert samples["lateness_ns"][first] > 200e6
    since_s = (samples["time_ns"] - samples["time_ns"][first]) / 1e9
    sent_n, requested_n = (np.linalg.norm(samples[name], axis=1) for name in ("device_force_n", "force_n"))
    fades = (since_s > 0.02) & (since_s < 0.5)
    assert sent_n[fades].size > 100
    assert (sent_n[fades] <= requested_n.max() * since_s[fades] / 0.5 + 0.05).all()
    assert sent_n[since_s > 0.6].max() > 0.5

"""The real program in a real window, ended in a trial, with six busy programs: zero force, and it can be resumed."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import pytest

from study_app.protocol.load import parse
from study_app.protocol.source.files import source_bytes
from study_app.store.files.folders import StudyFolder
from study_app.store.sessions.recovery import check_resumable
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.end_to_end.real_windows import COMPILED_S, Program, needs_display, virtual_display, wait_for
from tests.faults.support import short

pytestmark = [
    pytest.mark.slow,
    pytest.mark.nightly,
    needs_servo,
    needs_display,
    pytest.mark.xvfb,
    pytest.mark.timeout(300),
]


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as number:
        yield number


BUSY = 6


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_in_a_trial_leaves_a_session_that_can_be_resumed(
    number: signal.Signals, display: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    protocol = short.write(tmp_path)
    protocol.write_text(
        protocol.read_text(encoding="utf-8").replace("min_s = 0.2", "min_s = 20"), encoding="utf-8", newline="\n"
    )
    words = ["run", str(protocol), "--participant", "P001", "--operator", "AK", "--device", "scripted", "--windowed"]
    program, busy = Program(display, tmp_path, *words), []
    try:
        wait_for(lambda: program.windows("^Study$"), "the study's window", COMPILED_S)
        (study,) = program.windows("^Study$")
        program.wait_for_event("page_shown")
        program.key(study, "Return")  # agrees
        while not program.events("trial_started"):
            program.key(study, "space")
        busy = [subprocess.Popen([sys.executable, "-S", "-c", "while True: pass"]) for _ in range(BUSY)]
        time.sleep(1)
        sent_s = time.time()
        program.process.send_signal(number)
        assert program.process.wait(30) == 128 + number
        ended_s = time.time() - sent_s
    finally:
        for process in busy:
            process.kill()
            process.wait()
        program.close()
    (session,) = StudyFolder(tmp_path / "results" / "demo-scripted").sessions()
    assert [event["outcome"] for event in program.events("trial_ended")] == ["interrupted"]
    assert [event["by"] for event in program.events("paused")] == ["program"]
    assert program.events("session_ended") == []
    zero_s = datetime.fromisoformat(program.events("trial_ended")[0]["at"]).timestamp() - sent_s
    sys.stdout.write(f"{number.name}: zero force after {zero_s:.2f} s, the end after {ended_s:.2f} s\n")
    assert zero_s < 1
    assert ended_s < 2
    assert verify_study(tmp_path / "results" / "demo-scripted").errors == ()
    source = source_bytes(str(protocol))
    check_resumable(session.path, parse(source, "demo"), source)

"""Programs that resume a session at the same time, or are killed while they write one."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.load import load, source_bytes
from study_app.store.journals import journal
from study_app.store.recording_files import read_samples
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.rebuild import rebuild
from study_app.store.sessions.reopen import reopen
from study_app.store.verification.verify_study import verify
from tests.store.conftest import SOURCE

pytestmark = pytest.mark.slow

RACER = """
import json, sys
from pathlib import Path
from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store.sessions.reopen import reopen
protocol = Protocol.model_validate(json.loads(sys.argv[1]))
print("ready", flush=True)
held = None
for line in sys.stdin:
    if held:
        held.close()
        held = None
    try:
        held = reopen(Path(line.strip()), protocol, sys.argv[2].encode(), operator="", device={}, screens={})
    except StoreError as error:
        print("refused", error, flush=True)
    else:
        print("open", flush=True)
"""


def test_of_two_programs_that_resume_at_once_never_both_do(
    tmp_path: Path, start: Callable[..., SessionStore], tables_of_study: Callable[..., dict[str, Any]]
) -> None:
    folders = []
    for number in range(20):
        with start(f"P{number:03d}") as store:
            folders.append(store.folder)
    command = [sys.executable, "-c", RACER, json.dumps(tables_of_study()), SOURCE.decode()]
    racers = [subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    try:
        assert [racer.stdout.readline() for racer in racers if racer.stdout] == ["ready\n"] * 2
        for folder in folders:
            for racer in racers:
                assert racer.stdin
                racer.stdin.write(f"{folder.path}\n")
                racer.stdin.flush()
            answers = sorted(racer.stdout.readline() for racer in racers if racer.stdout)
            resumed = [line for line in journal.read(folder.journal) if line["event"] == "session_resumed"]
            assert len(resumed) == answers.count("open\n") <= 1
            assert all("is open in another program" in told for told in answers if told.startswith("refused"))
    finally:
        for racer in racers:
            racer.communicate()


KILLED = """
import sys
from pathlib import Path
import numpy as np
from study_app.haptics.model.layout import SAMPLE
from study_app.protocol.load import load, source_bytes
from study_app.store.sessions.begin import SessionStart, begin
start = SessionStart(
    "P001", seed=1, operator="", language="en", device={"name": "mouse"}, screens={}, simulated=True, recordings=True
)
store = begin(Path(sys.argv[1]), load("demo"), source_bytes("demo"), start)
samples = np.zeros(35_000, SAMPLE)
samples["position_m"] = np.random.default_rng(1).random((35_000, 3))
for trial in range(1, 1000):
    told = {"block": "b", "phase": "main", "part": 1, "index": trial, "of": 1000, "code": "L1"}
    store.append("trial_started", trial=trial, attempt=1, **told)
    store.recorder.start(trial, 1, 1000.0)
    for _ in range(3):
        store.recorder.append(samples)
    store.recorder.stop()
    store.append("trial_ended", trial=trial, attempt=1, outcome="complete")
    item = {"item": "wet", "number": 1, "value": 4, "onset_s": 1.0, "first_s": 2.0, "last_s": 2.0, "changes": 0}
    store.append("item_shown", t_s=1.0, trial=trial, item="wet")
    store.append("choice", t_s=2.0, trial=trial, item="wet", value=4)
    store.append("responses", trial=trial, attempt=1, items=[item])
    print(trial, flush=True)
    store.write_tables()
"""


@pytest.mark.parametrize("moment", [0, 3, *(pytest.param(other, marks=pytest.mark.nightly) for other in (1, 2, 4, 5))])
def test_a_killed_program_leaves_all_acknowledged_answers_and_a_session_that_goes_on(
    tmp_path: Path, moment: int
) -> None:
    """Killed at some moment after so many answers: in the middle of journal, tables and recordings."""
    study = tmp_path / "study"
    with subprocess.Popen([sys.executable, "-c", KILLED, str(study)], stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout
        acknowledged = [int(program.stdout.readline()) for _ in range(1 + 2 * moment)]
        program.kill()
        acknowledged += [int(line) for line in program.stdout if line.endswith("\n")]
    folder = study / "data" / "sub-P001" / "ses-01"
    rebuild(folder)
    with reopen(folder, load("demo"), source_bytes("demo"), operator="", device={}, screens={}) as store:
        answered = [line["trial"] for line in store.lines if line["event"] == "responses"]
        store.finish("aborted")
    assert answered[: len(acknowledged)] == acknowledged
    assert not list(study.rglob("*.tmp"))
    findings = verify(study)
    assert [str(error) for error in findings.errors] == []
    assert [str(warning) for warning in findings.warnings if "ended before it was complete" not in str(warning)] == []
    for path in (folder / "recordings").glob("trial-???.parquet"):
        assert len(read_samples(path)) == 105_000

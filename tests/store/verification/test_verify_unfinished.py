"""Sessions that run, stopped or crashed: what is a warning, and what an error all the same."""

from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.integrity.folder_lock import is_open
from study_app.store.journals import journal_events
from study_app.store.sessions import recovery
from study_app.store.verification import verify_session
from study_app.store.verification.whole_study import verify_study
from tests.journal_lines import event_of
from tests.store.conftest import SOURCE, Start
from tests.store.verification.played_studies import NAMES, P007, told, warned
from tests.transcripts import Files

PARTICIPANTS = NAMES["PARTICIPANTS"]


def test_irregularities_of_a_running_session_are_warnings(study: Path, start: Start) -> None:
    with start("P009", recordings=True) as store:
        fields = {"block": "b", "phase": "main", "part": 1, "index": 1, "of": 1, "code": "L1"}
        for trial in (1, 2):
            store.append(journal_events.TrialStarted(trial=trial, attempt=1, **fields))
        store.append(journal_events.RecordingLost(trial=1, attempt=1, reason="No space left on device"))
        later = {"operator": "AB", "device": "mouse", "version": "99.0"}
        store.append(journal_events.SessionResumed(gap_s=None, torn_bytes=0, **later))
        store.append(event_of("weather", sky="blue"))
        store.write_tables()
    with store.folder.journal.open("ab") as file:
        file.write(b'{"n":')
    (responses,) = store.folder.path.glob("*responses_data.csv")
    with responses.open("ab") as file:
        file.write(b"P009,1")
    (store.folder.path / ".receipt.json.0123abcd.tmp").write_bytes(b"{")
    (study / "data" / ".x.csv.0123abcd.tmp").write_bytes(b"{")
    store.folder.recordings.mkdir()
    (store.folder.recordings / "trial-002.parquet").write_bytes(b"PAR1")
    (study / "data" / "sub-P010" / "ses-01").mkdir(parents=True)
    open_one = start("P011")
    (study / P007 / "crash.txt").touch()
    assert "crash" not in warned(verify_study(study))
    (study / P007 / "crash.txt").write_text("Fatal Python error: Segmentation fault", encoding="utf-8", newline="\n")
    findings = verify_study(study)
    open_one.close()
    for sentence in (
        "sub-P009/ses-01: is unfinished but can be resumed",
        "sub-P009/ses-01/journal.jsonl: it ends with an incomplete line of 5 bytes",
        f"sub-P009/ses-01/{responses.name}: differs from the journal",
        "sub-P009/ses-01/journal.jsonl: contains 'weather' events, which this version does not recognise",
        "sub-P009/ses-01/.receipt.json.0123abcd.tmp: is an incomplete file",
        "sub-P009/ses-01/recordings: trial 1, attempt 1 does not have a recording: No space left on device",
        "sub-P009/ses-01/recordings/trial-002.parquet: does not appear in the journal",
        "sub-P007/ses-01/crash.txt: shows how the program crashed",
        "sub-P010/ses-01: was created, but the program ended before it wrote a journal",
        "sub-P011/ses-01: is open in another program",
        "data/.x.csv.0123abcd.tmp: is being written, or is an incomplete file left by a program that was killed",
    ):
        assert sentence in warned(findings)
    assert "does not state why" not in warned(findings), "trial 1 was lost, and trial 2 may still be recorded"
    assert told(findings) == ""


@pytest.mark.slow
def test_a_recording_in_progress_is_not_reported_as_left_behind(study: Path, start: Start) -> None:
    fields = {"block": "b", "phase": "main", "part": 1, "index": 1, "of": 1, "code": "L1"}
    store = start("P009", recordings=True)
    store.folder.recordings.mkdir()
    for trial in (1, 2):
        store.append(journal_events.TrialStarted(trial=trial, attempt=1, **fields))
    (store.folder.recordings / ".trial-002.parquet.0123abcd.tmp").touch()
    (store.folder.recordings / "trial-001.parquet").write_bytes(b"PAR1")
    place = "data/sub-P009/ses-01"
    running = [line for line in warned(verify_study(study)).splitlines() if place in line]
    assert [line for line in running if "differs from the journal" not in line] == [
        (f"{place}: is open in another program")
    ]
    store.close()
    left = warned(verify_study(study))
    assert ".trial-002.parquet.0123abcd.tmp: is an incomplete file" in left
    assert "trial-001.parquet: does not appear in the journal; resuming the session adds it" in left
    assert "recordings: trial 1, attempt 1 was not recorded, and the journal does not state why" in left
    with store.folder.journal.open("ab") as file:
        file.write(b"damage\n")
    left = warned(verify_study(study)).splitlines()
    assert f"{place}/recordings/trial-001.parquet: does not appear in the journal" in "\n".join(left)
    assert not any("resuming the session" in line for line in left), "a damaged session cannot be resumed"


def test_a_session_that_a_program_opens_while_it_is_checked_is_checked_again_as_running(
    study: Path, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    store, paths = start("P009"), list[Path]()
    store.folder.table("brackish", "responses").write_text("a,b\n1,2\n", encoding="utf-8", newline="\n")
    monkeypatch.setattr(
        verify_session, "is_open", lambda path: is_open(path) and (paths.append(path) or len(paths) > 1)
    )
    findings = verify_study(study)
    assert (told(findings), "sub-P009/ses-01: is open in another program" in warned(findings)) == ("", True)
    monkeypatch.setattr(verify_session, "is_open", lambda _: False)
    assert "responses_data.csv: has 1 rows, but the journal contains 0" in told(verify_study(study))
    store.close()


@pytest.mark.slow
def test_tables_of_a_session_that_has_not_ended_may_be_behind_its_journal(
    study: Path, start: Start, summary: dict[str, Any]
) -> None:
    """Its program was killed before writing them; tables of other sessions must exist."""
    fields = {"block": "b", "phase": "main", "part": 1, "index": 1, "of": 1, "code": "L1"}
    with start("P000") as store:
        store.append(journal_events.TrialStarted(trial=1, attempt=1, **fields))
        store.append(event_of("trial_ended", trial=1, attempt=1, outcome="complete", **summary))
    findings = verify_study(study)
    assert findings.errors == ()
    for path in (PARTICIPANTS, "sub-P000/ses-01/subject-P000_session-01_task-brackish_description-trials_data.csv"):
        assert f"{path}: differs from the journal, starting at line 2; the rebuild command recreates it" in warned(
            findings
        )
    Files(study).replace(PARTICIPANTS, "withdrawn", "completed")
    assert f"{PARTICIPANTS}: differs from the journal" in told(verify_study(study))


def test_every_change_to_the_receipt_of_a_session_that_has_not_ended_is_an_error(
    study: Path, start: Start, protocol: Protocol
) -> None:
    start("P009").close()
    path = study / "data/sub-P009/ses-01/receipt.json"
    recovery.reopen_store(
        path.parent, protocol, SOURCE, operator="AB", device={"name": "mouse", "rate_hz": 9}, screens={}
    ).close()
    assert told(verify_study(study)) == ""
    session_receipt = receipt.read(path)
    (again,) = session_receipt["resumed"]
    changes = [{name: value | {"rate_hz": 5}} for name, value in session_receipt.items() if isinstance(value, dict)]
    changes += [{name: f"{value}x"} for name, value in session_receipt.items() if isinstance(value, str)]
    changes += [{"resumed": [again | {"device": {"name": "mouse"}}]}, {"resumed": [again | {"at": [3]}]}, {"new": 1}]
    for change in changes:
        receipt.write(path, session_receipt | change)
        assert "sub-P009/ses-01/receipt.json: " in told(verify_study(study)), change
    receipt.write(path, session_receipt | {"resumed": []})  # so does a program leave it that is killed while it resumes
    assert "sub-P009/ses-01/receipt.json: does not contain the settings used when the session was resumed" in warned(
        verify_study(study)
    )

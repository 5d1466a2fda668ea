"""What is rebuilt, what is refused and why; a session that was lost, forged or finished, told file by file."""

import json
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.store import receipt
from study_app.store.journals import journal, journal_events
from study_app.store.merged import MANIFEST
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import check_resumable, rebuild_session
from tests.store.conftest import SOURCE, Attend, Start, study_tables
from tests.store.forging import forge
from tests.store.sessions.conftest import Again, every_byte
from tests.store.sessions.test_reopen import begin_trial


def with_receipt(store: SessionStore, **changes: Any) -> None:
    receipt.write(store.folder.receipt, receipt.read(store.folder.receipt) | changes)


def without_end(store: SessionStore) -> None:
    """Reset the receipt to its state before the end of a session."""
    fields = receipt.read(store.folder.receipt)
    del fields["reason"], fields["ended_at"]
    receipt.write(store.folder.receipt, fields | {"status": receipt.UNFINISHED})


def test_only_missing_or_wrong_derived_files_are_rewritten(finished: Start) -> None:
    store = finished()
    study, folder = store.place.study_folder, store.folder
    before = every_byte(study.path)
    assert rebuild_session(folder.path).rewritten == (), "everything is right"
    trials, participants = folder.table("brackish", "trials"), study.participants("brackish")
    untouched = {path: path.stat().st_ino for path in (folder.table("brackish", "responses"), folder.journal)}
    trials.unlink()
    participants.write_bytes(b"x")
    without_end(store)
    rebuild = rebuild_session(folder.path)
    assert rebuild.rewritten == (trials, folder.receipt, participants, folder.checksums, folder.rebuilt)
    assert (rebuild.swept, rebuild.torn_bytes) == ((), 0)
    assert {path: path.stat().st_ino for path in untouched} == untouched, "not even written anew"
    after = every_byte(study.path)
    noted = {path.relative_to(study.path).as_posix() for path in (folder.checksums, folder.rebuilt)}
    assert {name for name in after if after[name] != before.get(name)} <= noted | {
        folder.receipt.relative_to(study.path).as_posix()
    }
    assert receipt.read(folder.receipt) == json.loads(before[folder.receipt.relative_to(study.path).as_posix()] or b"")
    assert rebuild_session(folder.path).rewritten == ()


def test_the_end_is_copied_to_the_receipt_and_the_rest_of_the_receipt_kept(finished: Start) -> None:
    store = finished()
    end = store.lines[-1]
    whole = receipt.read(store.folder.receipt)
    assert (whole["status"], whole["reason"], whole["ended_at"]) == ("completed", end.reason, end.at)
    for wrong in ({"status": "withdrawn"}, {"reason": "otherwise"}, {"ended_at": "2026-03-01T10:00:00.000+01:00"}):
        with_receipt(store, **wrong)
        assert store.folder.receipt in rebuild_session(store.folder.path).rewritten
        assert receipt.read(store.folder.receipt) == whole
    store.folder.receipt.unlink()
    rebuilt = rebuild_session(store.folder.path)
    assert (store.folder.receipt in rebuilt.rewritten, rebuilt.lost) == (False, (store.folder.receipt,))
    assert not store.folder.receipt.exists(), "a missing receipt cannot be known"


def test_a_missing_fingerprint_is_listed_again_and_noted(finished: Start) -> None:
    store = finished()
    fingerprints, folder = store.place.study_folder.fingerprints, store.folder
    fingerprints_before = fingerprints.read_bytes()
    fingerprints.unlink()
    assert rebuild_session(folder.path).rewritten == (folder.checksums, folder.rebuilt, fingerprints)
    assert "did not contain the session's fingerprint" in folder.rebuilt.read_text(encoding="utf-8")
    assert fingerprints.read_bytes().count(b"\n") == fingerprints_before.count(b"\n")


def test_rebuilding_an_unfinished_session_keeps_its_receipt_and_writes_no_checksums(start: Start) -> None:
    with start() as store:
        store.append(journal_events.PageShown(page="consent"), t_s=40.0)
    before = store.folder.receipt.read_bytes()
    trials = store.folder.table("brackish", "trials")
    content = trials.read_bytes()
    trials.write_bytes(b"x")
    assert rebuild_session(store.folder.path).rewritten == (trials,)
    assert trials.read_bytes() == content
    assert store.folder.receipt.read_bytes() == before
    assert not store.folder.checksums.exists()


@pytest.mark.parametrize(
    ("has_checksums", "expected"),
    [
        (True, r"is finished \(completed\) and cannot be resumed; use a new session number for another visit$"),
        (False, r"is finished \(completed\), but its receipt, .*: run liquid-study rebuild .*ses-01 to write them$"),
    ],
)
def test_a_finished_session_cannot_be_resumed(
    finished: Start, again: Again, protocol: Protocol, has_checksums: bool, expected: str
) -> None:
    store = finished()
    if not has_checksums:
        store.folder.checksums.unlink()
    before = every_byte(store.folder.path)
    with pytest.raises(StoreError, match=expected):
        again()
    with pytest.raises(StoreError, match=expected):
        check_resumable(store.folder.path, protocol, SOURCE)
    assert every_byte(store.folder.path) == before


def refusal_message(resume: Again, session: Path) -> str:
    """Return the error message with which resuming and rebuilding both refuse to replace files.

    Check that neither changes a file.
    """
    before = every_byte(session)
    with pytest.raises(StoreError) as resume_error:
        resume()
    with pytest.raises(StoreError) as rebuild_error:
        rebuild_session(session)
    assert str(resume_error.value) == str(rebuild_error.value)
    assert every_byte(session) == before
    return str(rebuild_error.value)


def test_files_that_say_more_than_the_journal_are_not_replaced(start: Start, again: Again) -> None:
    with start() as store:
        pass
    again().close()
    folder, restore = store.folder, "restore the journal from a backup"
    entries = receipt.read(folder.receipt)["resumed"]
    assert len(entries) == 1
    with_receipt(store, resumed=2 * entries)
    assert refusal_message(again, folder.path) == (
        f"{folder.receipt} records more resumptions of the session than the journal does: {restore}"
    )
    with_receipt(store, resumed=entries, status="completed")
    assert refusal_message(again, folder.path) == (
        f"{folder.receipt} has the status 'completed', but the journal 'unfinished': {restore}"
    )
    with_receipt(store, status=receipt.UNFINISHED)
    folder.checksums.write_bytes(b"")
    assert refusal_message(again, folder.path) == (
        f"{folder.checksums} was written after the session ended, but the journal does not record the end: {restore}"
    )
    folder.checksums.unlink()
    rebuild_session(folder.path)


def test_fingerprints_and_recordings_without_a_journal_line_stop_the_rebuild(
    finished: Start, again: Again, protocol: Protocol
) -> None:
    store = finished()
    folder, study = store.folder, store.place.study_folder
    forge(folder.journal, lambda lines: lines.__delitem__(slice(1, None)))
    folder.checksums.unlink()
    for name in ("trials", "responses"):
        folder.table("brackish", name).unlink()
    without_end(store)
    place = folder.path.relative_to(study.path).as_posix()
    assert refusal_message(again, folder.path).startswith(
        f"{study.fingerprints} lists {place} as ended, but its journal does not record the end: "
    )
    study.fingerprints.unlink()
    folder.recordings.mkdir(exist_ok=True)
    number = build_schedule(protocol, "P007", 11).trials[0].number
    stray = folder.recordings / f"trial-{number:03}.parquet"
    stray.write_bytes(b"x")
    assert refusal_message(again, folder.path).startswith(
        f"{stray} belongs to a trial that never started, according to the journal: "
    )
    stray.unlink()
    rebuild_session(folder.path)


def test_a_line_from_a_later_version_is_left_to_that_version(start: Start, again: Again) -> None:
    with start() as store:
        store.append(journal_events.PageShown(page="consent"), t_s=40.0)
    forge(store.folder.journal, lambda lines: (lines[0].update(version="99.0"), lines[1].update(event="tide_turned")))
    assert refusal_message(again, store.folder.path) == (
        f"{store.folder.journal} contains 'tide_turned' events, which this version does not recognise: "
        "use the version that wrote them"
    )


def test_a_recording_is_given_up_once(start: Start, again: Again, protocol: Protocol) -> None:
    store = start(recordings=True)
    begin_trial(store, build_schedule(protocol, "P007", 11).trials[0])
    store.journal.close()
    store.lock.release()
    for _ in range(2):
        with again() as resumed:
            assert [line.event for line in resumed.lines].count("recording_lost") == 1
    assert journal.read(store.folder.journal)[-1].event == "session_resumed"


def test_trials_without_recordings_are_not_reported_as_lost(start: Start, again: Again, attend: Attend) -> None:
    with start() as store:
        attend(store)
    with again() as resumed:
        assert "recording_lost" not in {line.event for line in resumed.lines}


def changed_protocol(**study: str) -> Protocol:
    tables = study_tables()
    return Protocol.model_validate(tables | {"study": tables["study"] | study})


def with_conditions(**conditions: dict[str, Any]) -> Protocol:
    tables = study_tables()
    return Protocol.model_validate(tables | {"conditions": tables["conditions"] | conditions})


def reported_differences(again: Again, protocol: Protocol) -> list[str]:
    """Return the differences that are reported when a session is resumed with another protocol file."""
    with pytest.raises(StoreError) as error:
        again(protocol=protocol, source=SOURCE + b"#")
    before, _, differences = str(error.value).partition(" Differences: ")
    assert before.endswith(
        "ses-01 began with a different protocol file and can be resumed only with that file: restore it, "
        "or use a new session number."
    )
    return differences.split("; ")


def test_differences_from_the_original_study_file_are_reported_except_blinded_conditions(
    start: Start, again: Again, protocol: Protocol
) -> None:
    start().close()
    assert reported_differences(again, protocol) == ["only in comments, order or notation"]
    assert reported_differences(again, with_conditions(see_tardy={"liquid": "quagmire", "delay_ms": 138})) == [
        "conditions differ"
    ]
    (title,) = reported_differences(again, changed_protocol(title="Briny"))
    assert ("Brackish" in title, "Briny" in title) == (True, True)
    tables = study_tables()
    for number, block in enumerate(tables["blocks"].values()):
        block |= {"title": f"New {number}", "setting_label": f"Other {number}"}
    tables["study"]["title"] = "Briny"
    many = reported_differences(again, Protocol.model_validate(tables))
    assert len(many) == 7
    assert many[-1] == "and 1 more"
    with again() as resumed:
        assert resumed.lines[-1].event == "session_resumed"


def test_sessions_in_a_copy_are_not_resumed(start: Start, again: Again) -> None:
    with start() as store:
        pass
    study = store.place.study_folder.path
    (study / MANIFEST).write_text("{}", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match="is a merged study, which contains only copies"):
        again()

"""An open session: journal, tables, recordings, a disk that refuses, and the end."""

import csv
import hashlib
import io
import os
import sys
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.journals import journal, journal_events
from study_app.store.recordings import read_facts
from study_app.store.sessions.open_session import SessionStore
from study_app.store.verification.whole_study import verify_study
from tests.journal_lines import event_of
from tests.store.conftest import Make, Start


def test_a_table_or_receipt_that_cannot_be_written_at_the_end_is_reported_and_the_rest_written(start: Start) -> None:
    for participant, of, status in (("P007", "trials", "completed"), ("P008", None, "unfinished")):
        store = start(participant)
        path = store.folder.table("brackish", of) if of else store.folder.receipt
        path.unlink()
        path.mkdir()
        with pytest.raises(
            StoreError, match=rf"{path.name} cannot be written .*: run liquid-study rebuild .* to write what"
        ):
            store.finish("completed")
        assert journal.read(store.folder.journal)[-1].event == "session_ended"
        assert of is None or receipt.read(store.folder.receipt)["status"] == status
        assert b"completed" in store.place.study_folder.participants("brackish").read_bytes()


def test_an_ended_session_refuses_events(start: Start) -> None:
    store = start()
    store.finish("completed")
    for late in (lambda: store.append(journal_events.Note(kind="note", text="late")), lambda: store.finish("aborted")):
        with pytest.raises(StoreError, match="occurred after the end of the session"):
            late()
    assert receipt.read(store.folder.receipt)["status"] == "completed"
    (left := start("P008")).close()
    with pytest.raises(StoreError, match="occurred after the end of the session"):
        left.append(journal_events.Note(kind="note", text="late"))


def test_the_session_reports_a_failed_flush(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    with start() as store:
        monkeypatch.setattr(store.journal, "check_flushed", mock.Mock(side_effect=StoreError("not flushed")))
        with pytest.raises(StoreError, match="not flushed"):
            store.check_flushed()
        monkeypatch.undo()


def trial_of(number: int, **changes: Any) -> dict[str, Any]:
    fields = {"block": "liquids", "phase": "main", "part": 1, "index": number, "of": 9, "code": "L1"}
    return {"trial": number, "attempt": 1, **fields, **changes}


def rows_of(store: SessionStore, table: str) -> list[dict[str, str]]:
    text = store.folder.table("brackish", table).read_text(encoding="utf-8")
    return list(csv.DictReader(io.StringIO(text, newline="")))


@pytest.mark.slow
def test_recordings_are_kept_beside_the_journal_and_linked_from_the_trials_row(
    start: Start, samples_of: Make, summary: dict[str, Any]
) -> None:
    store = start(recordings=True)
    recorder = store.recorder
    assert recorder is not None
    for attempt, rows in ((1, 300), (2, 70_000)):
        store.append(journal_events.TrialStarted(**trial_of(3, attempt=attempt)))
        recorder.start(3, attempt, 1000.0)
        recorder.append(samples_of(rows))
        recorder.frame(20, 3)
        recorder.stop()
        store.append(event_of("trial_ended", trial=3, attempt=attempt, outcome="complete", **summary))
        store.write_tables()
    store.finish("completed")
    rows_written = rows_of(store, "trials")
    links = [(row["recording"], row["recording_frames"], row["samples_recorded"]) for row in rows_written]
    assert links == [
        ("recordings/trial-003.parquet", "recordings/trial-003_frames.parquet", "n/a"),
        ("recordings/trial-003_attempt-2.parquet", "recordings/trial-003_attempt-2_frames.parquet", "n/a"),
    ]
    assert [row["samples_unrecorded"] for row in rows_written] == ["0", "0"]
    lines = [line for line in journal.read(store.folder.journal) if line.event == "recorded"]
    for line in lines:
        for name, digest in (("recording", "sha256"), ("recording_frames", "frames_sha256")):
            assert hashlib.sha256((store.folder.path / getattr(line, name)).read_bytes()).hexdigest() == getattr(
                line, digest
            )
    facts = read_facts(store.folder.path / lines[0].recording, store.key.nonce)
    assert (facts["participant"], facts["origin_ns"]) == ("P007", 5_000_000_000)


def test_a_recording_that_is_lost_is_said_to_be(start: Start, samples_of: Make) -> None:
    store = start(recordings=True)
    store.folder.recordings.write_text("in the way", encoding="utf-8", newline="\n")
    store.append(journal_events.TrialStarted(**trial_of(1)))
    assert store.recorder is not None
    store.recorder.start(1, 1, 1000.0)
    store.recorder.append(samples_of(10))
    full = mock.Mock(side_effect=StoreError("no space left"))
    with mock.patch.object(SessionStore, "append", full), pytest.raises(StoreError, match="no space"):
        store.finish("completed")
    store.finish("completed")
    (lost,) = [line for line in journal.read(store.folder.journal) if line.event == "recording_lost"]
    assert (lost.trial, lost.attempt) == (1, 1)
    assert lost.reason
    assert rows_of(store, "trials")[0]["recording"] == "n/a"


@pytest.mark.parametrize("written", ["update_participants", "write_file", "receipt.write", "write_checksums"])
def test_an_end_that_was_half_written_is_finished_by_another_call(
    start: Start, monkeypatch: pytest.MonkeyPatch, written: str
) -> None:
    store = start()
    with monkeypatch.context() as patched:
        full = mock.Mock(side_effect=StoreError("no space left"))
        patched.setattr(f"study_app.store.sessions.open_session.{written}", full)
        with pytest.raises(StoreError, match="no space"):
            store.finish("completed")
    store.finish("completed")
    assert [line.event for line in store.lines].count("session_ended") == 1
    assert verify_study(store.place.study_folder.path).errors == ()


@pytest.mark.skipif(sys.platform != "linux", reason="the system does not name open files")
def test_while_it_runs_only_the_journal_is_waited_for_and_at_its_end_every_table(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = start()
    flushed: list[Path] = []
    fsync = os.fsync

    def watch(descriptor: int) -> None:
        flushed.append(Path(f"/proc/self/fd/{descriptor}").readlink())
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", watch)
    store.append(journal_events.Note(kind="note", text="a note"))
    store.write_tables()
    assert flushed == [store.folder.journal]
    store.finish("withdrawn")
    for name in ("responses", "trials"):
        assert any(store.folder.table(store.place.study, name).name in path.name for path in flushed)

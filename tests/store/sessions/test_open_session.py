"""An open session: journal, tables, recordings, a disk that refuses, and the end."""

import csv
import errno
import hashlib
import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.checksums import read_checksums
from study_app.store.journals import journal
from study_app.store.recording_files import read_facts
from study_app.store.sessions.folder_lock import is_open
from study_app.store.sessions.open_session import SessionStore
from tests.store.conftest import FullDisk


def test_a_table_that_is_held_stops_nothing_and_is_caught_up(
    start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    store = start()
    path = store.folder.table("brackish", "responses")
    path.unlink()
    path.mkdir()
    (path / "held").touch()
    attend(store)
    assert "responses_data.csv cannot be written (Is a directory)" in str(store.behind)
    (path / "held").unlink()
    path.rmdir()
    store.append("note", kind="note", text="closed the spreadsheet")
    store.write_tables()
    assert store.behind is None
    assert path.read_bytes().count(b"\n") == 13
    store.close()


def test_a_table_held_to_the_end_is_reported_and_the_rest_written(start: Callable[..., SessionStore]) -> None:
    store = start()
    path = store.folder.table("brackish", "trials")
    path.unlink()
    path.mkdir()
    store.append("trial_started", trial=1, attempt=1, block="b", phase="main", part=1, index=1, of=1, code="L1")
    with pytest.raises(StoreError, match=r"trials_data\.csv cannot be written"):
        store.finish("completed")
    assert receipt.read(store.folder.receipt)["status"] == "completed"
    assert b"completed" in store.place.study_folder.participants("brackish").read_bytes()


def test_a_receipt_that_cannot_be_written_at_the_end_is_reported(start: Callable[..., SessionStore]) -> None:
    store = start()
    store.folder.receipt.unlink()
    store.folder.receipt.mkdir()
    with pytest.raises(StoreError, match=r"receipt\.json cannot be written"):
        store.finish("completed")
    assert journal.read(store.folder.journal)[-1]["event"] == "session_ended"


def test_after_its_end_a_session_takes_nothing(start: Callable[..., SessionStore]) -> None:
    store = start()
    store.finish("completed")
    for late in (lambda: store.append("note", kind="note", text="late"), lambda: store.finish("aborted")):
        with pytest.raises(StoreError, match="came after the session's end"):
            late()
    assert receipt.read(store.folder.receipt)["status"] == "completed"


def trial_of(number: int, **changes: Any) -> dict[str, Any]:
    told = {"block": "liquids", "phase": "main", "part": 1, "index": number, "of": 9, "code": "L1"}
    return {"trial": number, "attempt": 1, **told, **changes}


def rows_of(store: SessionStore, table: str) -> list[dict[str, str]]:
    text = store.folder.table("brackish", table).read_text(encoding="utf-8")
    return list(csv.DictReader(io.StringIO(text, newline="")))


@pytest.mark.slow
def test_recordings_are_kept_beside_the_journal_and_linked_from_the_trials_row(
    start: Callable[..., SessionStore], samples_of: Callable[..., Any], summary: dict[str, Any]
) -> None:
    store = start(recordings=True)
    recorder = store.recorder
    assert recorder is not None
    for attempt, rows in ((1, 300), (2, 70_000)):
        store.append("trial_started", **trial_of(3, attempt=attempt))
        recorder.start(3, attempt, 1000.0)
        recorder.append(samples_of(rows))
        recorder.frame(20, 3)
        recorder.stop()
        store.append("trial_ended", trial=3, attempt=attempt, outcome="complete", **summary)
        store.write_tables()
    store.finish("completed")
    rows_written = rows_of(store, "trials")
    links = [(row["recording"], row["recording_frames"], row["samples_recorded"]) for row in rows_written]
    assert links == [
        ("recordings/trial-003.parquet", "recordings/trial-003_frames.parquet", "300"),
        ("recordings/trial-003_attempt-2.parquet", "recordings/trial-003_attempt-2_frames.parquet", "70000"),
    ]
    assert [row["samples_unrecorded"] for row in rows_written] == ["0", "0"]
    lines = [line for line in journal.read(store.folder.journal) if line["event"] == "recorded"]
    for line in lines:
        for name, digest in (("recording", "sha256"), ("recording_frames", "frames_sha256")):
            assert hashlib.sha256((store.folder.path / line[name]).read_bytes()).hexdigest() == line[digest]
    facts = read_facts(store.folder.path / lines[0]["recording"])
    assert (facts["participant"], facts["origin_ns"]) == ("P007", 5_000_000_000)


def test_a_recording_that_is_lost_is_said_to_be(
    start: Callable[..., SessionStore], samples_of: Callable[..., Any]
) -> None:
    store = start(recordings=True)
    store.folder.recordings.write_text("in the way")
    store.append("trial_started", **trial_of(1))
    assert store.recorder is not None
    store.recorder.start(1, 1, 1000.0)
    store.recorder.append(samples_of(10))
    store.finish("completed")
    (lost,) = [line for line in journal.read(store.folder.journal) if line["event"] == "recording_lost"]
    assert (lost["trial"], lost["attempt"], lost["reason"]) == (1, 1, "File exists")
    assert rows_of(store, "trials")[0]["recording"] == "n/a"


def test_a_session_that_is_left_has_its_recordings_linked_too(
    start: Callable[..., SessionStore], samples_of: Callable[..., Any]
) -> None:
    with start(recordings=True) as store:
        assert store.recorder is not None
        store.append("trial_started", **trial_of(1))
        store.recorder.start(1, 1, 1000.0)
        store.recorder.append(samples_of(10))
    assert [line["event"] for line in journal.read(store.folder.journal)][-1] == "recorded"


def test_checksums_of_a_finished_session_are_those_of_its_files(
    start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    store = start()
    attend(store)
    store.finish("completed")
    listed = read_checksums(store.folder)
    assert sorted(listed) == sorted(
        path.name for path in store.folder.path.iterdir() if path.name != "checksums.sha256"
    )
    for name, digest in listed.items():
        assert hashlib.sha256((store.folder.path / name).read_bytes()).hexdigest() == digest


def test_a_session_is_open_in_one_program_until_its_end(start: Callable[..., SessionStore]) -> None:
    store = start()
    assert is_open(store.folder.path)
    store.finish("completed")
    assert not is_open(store.folder.path)
    left = start("P008")
    left.close()
    assert not is_open(left.folder.path)


def test_a_disk_that_fills_during_a_session_costs_nothing_that_was_acknowledged(
    start: Callable[..., SessionStore],
    attend: Callable[[SessionStore], None],
    files_up_to: FullDisk,
    summary: dict[str, Any],
) -> None:
    """What does not fit is told with the reason, and the session goes on where it was when space returns."""
    store = start()
    attend(store)
    tables = {table: store.folder.table("brackish", table).read_bytes() for table in ("responses", "trials")}
    store.append("trial_started", **trial_of(6))
    acknowledged = store.folder.journal.read_bytes()
    with files_up_to(len(acknowledged) + 20):
        with pytest.raises(StoreError, match=r"journal\.jsonl cannot be written \(File too large\): free disk space"):
            store.append("trial_ended", trial=6, attempt=1, outcome="complete", **summary)
        with pytest.raises(StoreError, match="File too large"):
            store.finish("aborted")
    with files_up_to(100):
        store.write_tables()
    assert "_data.csv cannot be written (File too large)" in str(store.behind)
    assert {table: store.folder.table("brackish", table).read_bytes() for table in tables} == tables
    assert store.folder.journal.read_bytes() == acknowledged
    assert is_open(store.folder.path)

    store.append("trial_ended", trial=6, attempt=1, outcome="complete", **summary)
    store.write_tables()
    assert store.behind is None
    store.finish("completed")
    lines = journal.read(store.folder.journal)
    assert [line["event"] for line in lines][-3:] == ["trial_started", "trial_ended", "session_ended"]
    assert [line["n"] for line in lines] == list(range(1, len(lines) + 1))
    assert rows_of(store, "trials")[-1]["outcome"] == "complete"


class Refusing:
    """A journal's file on a disk that refuses at a step, after so many bytes of the line."""

    def __init__(self, file: Any, step: str, kept: int) -> None:
        self._file, self._step, self._kept = file, step, kept
        self.refuses = True

    def write(self, content: Any) -> int:
        if not (self.refuses and self._step in ("write", "truncate")):
            return self._file.write(content)
        if self._kept:
            written = self._file.write(bytes(content[: self._kept]))
            self._kept = 0
            return written
        raise OSError(errno.EROFS, "Read-only file system")

    def truncate(self, size: int) -> int:
        if self.refuses and self._step == "truncate":
            raise OSError(errno.EROFS, "Read-only file system")
        return self._file.truncate(size)

    def fileno(self) -> int:
        if self.refuses and self._step == "fsync":
            raise OSError(errno.EIO, "Input/output error")
        return self._file.fileno()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


@pytest.mark.parametrize("kept", [0, 1, 40])
@pytest.mark.parametrize("step", ["write", "truncate", "fsync"])
def test_a_disk_that_becomes_read_only_leaves_whole_lines_and_is_tried_again(
    start: Callable[..., SessionStore], step: str, kept: int
) -> None:
    store = start()
    store.append("note", kind="note", text="before")
    before = journal.read(store.folder.journal)
    disk = Refusing(store.journal.file, step, kept)
    store.journal.file = disk  # type: ignore[assignment]
    for _ in range(2):
        with pytest.raises(StoreError, match=r"journal\.jsonl cannot be written"):
            store.append("note", kind="note", text="never acknowledged")
        assert journal.read(store.folder.journal) == before
    disk.refuses = False
    store.append("note", kind="note", text="after")
    store.finish("completed")
    texts = [line.get("text") for line in journal.read(store.folder.journal)]
    assert texts == [None, "before", "after", None]


def test_an_end_that_was_half_written_is_finished_by_another_call(
    start: Callable[..., SessionStore], monkeypatch: pytest.MonkeyPatch
) -> None:
    store = start()

    def full(*_: object) -> None:
        raise StoreError("no space left")

    with monkeypatch.context() as patched:
        patched.setattr("study_app.store.sessions.open_session.write_participants", full)
        with pytest.raises(StoreError, match="no space"):
            store.finish("completed")
    store.finish("completed")
    assert [line["event"] for line in store.lines].count("session_ended") == 1
    assert store.folder.checksums.exists()


def test_while_it_runs_only_the_journal_is_waited_for_and_at_its_end_every_table(
    start: Callable[..., SessionStore], monkeypatch: pytest.MonkeyPatch
) -> None:
    store = start()
    flushed: list[Path] = []
    fsync = os.fsync

    def watch(descriptor: int) -> None:
        flushed.append(Path(f"/proc/self/fd/{descriptor}").readlink())
        fsync(descriptor)

    if not Path("/proc/self/fd").exists():
        pytest.skip("the system does not name open files")
    monkeypatch.setattr(os, "fsync", watch)
    store.append("note", kind="note", text="a note")
    store.write_tables()
    assert flushed == [store.folder.journal]
    store.finish("withdrawn")
    for name in ("responses", "trials"):
        assert any(store.folder.table(store.place.study, name).name in path.name for path in flushed)

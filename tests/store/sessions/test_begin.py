from __future__ import annotations

import csv
import errno
import hashlib
import io
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from study_app import __version__
from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.atomic import sync_folder
from study_app.store.checksums import read_checksums
from study_app.store.journals import journal
from study_app.store.recording_files import read_facts
from study_app.store.sessions.begin import SessionStore
from study_app.store.sessions.folder_lock import is_open

SOURCE_HASH = hashlib.sha256(b"[study]\nname = 'brackish'\n").hexdigest()


FullDisk = Callable[[int], AbstractContextManager[None]]


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def every_byte(folder: Path) -> dict[str, bytes | None]:
    """Everything under ``folder``: files with their bytes, folders with None."""
    paths = sorted(folder.rglob("*"))
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None for path in paths}


def test_everything_is_there_before_the_first_trial(tmp_path: Path, start: Callable[..., SessionStore]) -> None:
    store = start()
    files = {name for name, content in every_byte(tmp_path / "study").items() if content is not None}
    (marker,) = {name for name in files if "/.open-" in name}
    assert marker.startswith("data/sub-P007/ses-01/.open-")
    assert files - {marker} == {
        ".psychds-ignore",
        "dataset_description.json",
        "blinding/key.sealed",
        "data/study-brackish_description-participants_data.csv",
        "data/sub-P007/ses-01/journal.jsonl",
        "data/sub-P007/ses-01/receipt.json",
        "data/sub-P007/ses-01/subject-P007_session-01_task-brackish_description-responses_data.csv",
        "data/sub-P007/ses-01/subject-P007_session-01_task-brackish_description-trials_data.csv",
    }
    store.close()


def test_the_entry_of_every_folder_that_is_created_is_flushed(
    tmp_path: Path, start: Callable[..., SessionStore], monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[Path] = []

    def sync(path: Path) -> None:
        flushed.append(path)
        sync_folder(path)

    monkeypatch.setattr("study_app.store.sessions.begin.sync_folder", sync)
    results = tmp_path / "results" / "study"
    start(results=results).close()
    created = [results.parent, results, results / "data", results / "data/sub-P007", results / "data/sub-P007/ses-01"]
    assert [folder for folder in created if folder.parent not in flushed] == []
    flushed.clear()
    start("P008", results=results).close()
    assert tmp_path not in flushed
    assert results.parent not in flushed


def test_the_first_line_says_what_is_run(start: Callable[..., SessionStore]) -> None:
    store = start(session=2, pilot=True)
    store.close()
    (line,) = journal.read(store.folder.journal)
    assert line == {
        "n": 1,
        "event": "session_started",
        "format": 2,
        "t_s": 0.0,
        "at": "2026-03-01T10:00:00.000+01:00",
        "participant": "P007",
        "session": 2,
        "study": "brackish",
        "seed": 11,
        "language": "en",
        "operator": "AB",
        "simulated": False,
        "pilot": True,
        "recordings": False,
        "key_hash": store.key.hash,
        "protocol_hash": SOURCE_HASH,
        "version": __version__,
        "device": "scripted",
        "limits": {
            "lateness_ms": 2.0,
            "worst_gap_ms": 20.0,
            "delay_error_ms": 25.0,
            "frame_gap_ms": 250.0,
            "withheld_percent": 5.0,
        },
        "previous": hashlib.sha256(b"").hexdigest(),
        "measures_sealed": True,
    }


def test_the_receipt_holds_what_reproduces_the_session(start: Callable[..., SessionStore]) -> None:
    store = start()
    before = receipt.read(store.folder.receipt)
    assert before["status"] == "unfinished"
    assert (before["seed"], before["participant"], before["session"]) == (11, "P007", 1)
    assert (before["key_hash"], before["protocol_hash"]) == (store.key.hash, SOURCE_HASH)
    assert before["clock"] == {"origin_ns": 5_000_000_000, "origin_at": "2026-03-01T10:00:00.000+01:00"}
    assert before["device"] == {"name": "scripted", "rate_hz": 1000}
    assert before["screens"]["participant"]["refresh_hz"] == 60.0
    assert "SHA-256 of (seed, name)" in before["generator"]
    assert before["versions"]["liquid-study"] == __version__
    store.finish("withdrawn", "tired, went home")
    after = receipt.read(store.folder.receipt)
    ended = journal.read(store.folder.journal)[-1]
    assert {key for key in after if after[key] != before[key]} == {"status", "reason", "ended_at"}
    assert (after["status"], after["reason"], after["ended_at"]) == ("withdrawn", "tired, went home", ended["at"])
    assert (ended["event"], ended["status"], ended["reason"]) == ("session_ended", "withdrawn", "tired, went home")


@pytest.mark.parametrize(
    "again",
    [
        {},
        {"participant": "p007"},
        {"participant": "P-007"},
        {"participant": "test"},
        {"participant": "P008", "session": 0},
        {"participant": "P008", "simulated": True},
    ],
    ids=["used", "used but for capitals", "a dash", "reserved", "no session", "a rehearsal among real ones"],
)
def test_a_refusal_touches_nothing(
    tmp_path: Path,
    start: Callable[..., SessionStore],
    attend: Callable[[SessionStore], None],
    again: dict[str, Any],
) -> None:
    store = start()
    attend(store)
    store.finish("completed")
    before = every_byte(tmp_path / "study")
    with pytest.raises(StoreError) as refusal:
        start(**again)
    assert "\n" not in str(refusal.value)
    assert every_byte(tmp_path / "study") == before


def test_the_folder_of_another_study_is_refused_untouched(
    tmp_path: Path, start: Callable[..., SessionStore], tables_of_study: Callable[..., dict[str, Any]]
) -> None:
    start().finish("completed")
    before = every_byte(tmp_path / "study")
    tables = tables_of_study()
    tables["study"]["name"] = "other"
    with pytest.raises(StoreError, match="holds the study 'brackish', not 'other'"):
        start("P008", protocol=Protocol.model_validate(tables))
    assert every_byte(tmp_path / "study") == before


def test_a_session_under_way_is_used_too(start: Callable[..., SessionStore]) -> None:
    with start(), pytest.raises(StoreError, match="participant P007 already has session 1"):
        start()


def test_a_new_session_number_and_another_id_are_welcome(start: Callable[..., SessionStore]) -> None:
    key_hashes = set()
    for name, number in [("P007", 1), ("P007", 2), ("P008", 1)]:
        with start(name, session=number) as store:
            key_hashes.add(store.key.hash)
    assert len(key_hashes) == 1


def test_an_unwritable_results_folder_is_one_line(tmp_path: Path, start: Callable[..., SessionStore]) -> None:
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(StoreError) as refusal:
        start(results=tmp_path / "file" / "study")
    assert "file/study cannot be written (Not a directory)" in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert names_in(tmp_path) == ["file"]


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="the administrator may write everywhere")
def test_a_read_only_results_folder_is_one_line(tmp_path: Path, start: Callable[..., SessionStore]) -> None:
    (tmp_path / "study").mkdir(mode=0o555)
    with pytest.raises(StoreError, match=r"cannot be written \(Permission denied\)"):
        start()
    assert names_in(tmp_path / "study") == []


def test_a_disk_that_fills_while_beginning_leaves_no_session(
    tmp_path: Path, start: Callable[..., SessionStore], files_up_to: FullDisk
) -> None:
    start("P001").finish("completed")
    before = every_byte(tmp_path / "study")
    with files_up_to(1000), pytest.raises(StoreError, match=r"receipt\.json cannot be written \(File too large\)"):
        start("P002")
    assert every_byte(tmp_path / "study") == before


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


def test_an_answer_is_in_the_table_after_every_page(
    start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    with start() as store:
        attend(store)
        content = store.folder.table("brackish", "responses").read_text(encoding="utf-8")
    assert content.count("\n") == 1 + 4 * 3


def test_a_rehearsal_says_so_in_every_row(
    tmp_path: Path, start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    store = start(simulated=True)
    attend(store)
    store.finish("completed")
    for path in (tmp_path / "study" / "data").rglob("*.csv"):
        _, *rows = path.read_text(encoding="utf-8").splitlines()
        assert rows
        assert all(",true,false," in row for row in rows)


def test_the_same_rehearsal_writes_the_same_tables(
    tmp_path: Path, start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    hashes = set()
    for name in ("one", "two"):
        store = start(results=tmp_path / name, simulated=True, clock=None)
        attend(store)
        hashes.add(store.key.hash)
        store.finish("completed")
    assert len(hashes) == 1
    name = "subject-P007_session-01_task-brackish_description-responses_data.csv"
    one, two = (
        (tmp_path / results / "data" / "sub-P007" / "ses-01" / name).read_text(encoding="utf-8").splitlines()
        for results in ("one", "two")
    )
    assert len(one) == 13
    assert [row.rsplit(",", 1)[0] for row in one] == [row.rsplit(",", 1)[0] for row in two]


RACER = """
import json, sys
from pathlib import Path
from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store.sessions.begin import begin
protocol = Protocol.model_validate(json.loads(sys.argv[1]))
given = dict(seed=1, operator="AB", language="en", device={"name": "mouse"}, screens={}, simulated=False)
print("ready", flush=True)
for line in sys.stdin:
    folder, participant = line.split()
    try:
        store = begin(Path(folder), protocol, b"", participant, **given)
    except StoreError as error:
        print("refused", error, flush=True)
    else:
        print("begun", store.key.hash, flush=True)
        store.close()
"""


def test_halves_of_a_killed_program_go_when_the_next_session_begins(start: Callable[..., SessionStore]) -> None:
    with start("P007") as store:
        study = store.place.study_folder
    halves = [folder / ".table.csv.0123abcd.tmp" for folder in (study.path, study.data)]
    for half in halves:
        half.touch()
        os.utime(half, (0, 0))
    start("P008").close()
    assert not any(half.exists() for half in halves)


def test_of_two_programs_racing_for_one_id_one_gets_it_and_both_share_the_key(
    tmp_path: Path, tables_of_study: Callable[..., dict[str, Any]]
) -> None:
    """Every round in a new folder, so that the key is raced for too; then both take free ids and compare keys."""
    command = [sys.executable, "-c", RACER, json.dumps(tables_of_study())]
    racers = [subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for _ in range(2)]

    def ask(*orders: str) -> list[str]:
        for racer, order in zip(racers, orders, strict=True):
            assert racer.stdin
            racer.stdin.write(f"{order}\n")
            racer.stdin.flush()
        return [racer.stdout.readline() for racer in racers if racer.stdout]

    try:
        assert [racer.stdout.readline() for racer in racers if racer.stdout] == ["ready\n"] * 2
        for number in range(25):
            folder = tmp_path / f"study{number}"
            won, lost = sorted(ask(f"{folder} P001", f"{folder} P001"))
            assert won.startswith("begun ")
            assert lost.startswith("refused participant P001 already has session 1")
            lines = journal.read(folder / "data" / "sub-P001" / "ses-01" / "journal.jsonl")
            assert [line["event"] for line in lines] == ["session_started"]
            assert set(ask(f"{folder} P002", f"{folder} P003")) == {won}
            table = (folder / "data" / "study-brackish_description-participants_data.csv").read_text()
            assert [row.split(",")[1] for row in table.splitlines()[1:]] == ["P001", "P002", "P003"]
            assert not list(folder.rglob("*.tmp"))
    finally:
        for racer in racers:
            racer.communicate()


def trial_of(number: int, **changes: Any) -> dict[str, Any]:
    told = {"block": "liquids", "phase": "main", "part": 1, "index": number, "of": 9, "code": "L1"}
    return {"trial": number, "attempt": 1, **told, **changes}


def rows_of(store: SessionStore, table: str) -> list[dict[str, str]]:
    text = store.folder.table("brackish", table).read_text(encoding="utf-8")
    return list(csv.DictReader(io.StringIO(text, newline="")))


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


def test_a_session_without_recordings_has_no_recorder(start: Callable[..., SessionStore]) -> None:
    with start() as store:
        assert store.recorder is None


def test_checksums_of_a_finished_session_are_those_of_its_files(
    start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    store = start()
    attend(store)
    store.finish("completed")
    listed = read_checksums(store.folder)
    assert sorted(listed) == [name for name in names_in(store.folder.path) if name != "checksums.sha256"]
    for name, digest in listed.items():
        assert hashlib.sha256((store.folder.path / name).read_bytes()).hexdigest() == digest


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="sha256sum is not on this machine")
def test_any_tool_can_check_the_checksums(start: Callable[..., SessionStore]) -> None:
    store = start()
    store.finish("completed")
    command = ["sha256sum", "--check", "--strict", "--quiet", store.folder.checksums.name]
    subprocess.run(command, cwd=store.folder.path, check=True)


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
        with pytest.raises(StoreError, match=r"journal\.jsonl cannot be written \(File too large\): free space"):
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
    disk = Refusing(store._journal._file, step, kept)
    store._journal._file = disk  # type: ignore[assignment]
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

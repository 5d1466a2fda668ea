"""A session begins: what is on disk before its first trial, and what refuses it."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app import __version__
from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.atomic import sync_folder
from study_app.store.journals import journal
from study_app.store.sessions.open_session import SessionStore
from tests.store.conftest import FullDisk
from tests.store.sessions.conftest import every_byte

SOURCE_HASH = hashlib.sha256(b"[study]\nname = 'brackish'\n").hexdigest()


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


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
    tmp_path: Path, start: Callable[..., SessionStore], attend: Callable[[SessionStore], None], again: dict[str, Any]
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


def test_an_unwritable_results_folder_is_one_line(tmp_path: Path, start: Callable[..., SessionStore]) -> None:
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(StoreError) as refusal:
        start(results=tmp_path / "file" / "study")
    assert "file/study cannot be written (a file is where a folder is needed)" in str(refusal.value)
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


RACER = """
import json, sys
from pathlib import Path
from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store.sessions.begin import SessionStart, begin
protocol = Protocol.model_validate(json.loads(sys.argv[1]))
given = dict(seed=1, operator="AB", language="en", device={"name": "mouse"}, screens={}, simulated=False)
print("ready", flush=True)
for line in sys.stdin:
    folder, participant = line.split()
    try:
        store = begin(Path(folder), protocol, b"", SessionStart(participant, **given))
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


@pytest.mark.slow
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


@pytest.mark.parametrize("answer", [None, {"means": "noise", "noise_db": 60}])
def test_the_receipt_has_how_motors_were_masked_where_that_was_asked(
    start: Callable[..., SessionStore], answer: dict[str, Any] | None
) -> None:
    with start(motors_masked=answer) as store:
        held = receipt.read(store.folder.receipt)
    assert held.get("motors_masked") == answer
    assert ("motors_masked" in held) == (answer is not None)

"""A journal that was lost or cut is found by whatever else is left."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.store.folders import StudyFolder
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.rebuild import rebuild
from study_app.store.sessions.unstarted_sessions import never_begun
from study_app.store.tables.participants import write_participants
from study_app.store.verification.verify_study import verify
from tests.store.verification.findings import PARTICIPANTS, SESSION, of_receipt, only_the_journals_lines, told

pytestmark = pytest.mark.slow


def test_damaged_lines_at_the_end_are_an_error(study: Path, start: Callable[..., SessionStore]) -> None:
    with start("P009") as store:
        for text in ("one", "two"):
            store.append("note", kind="note", text=text)
    lines = store.folder.journal.read_bytes().split(b"\n")
    store.folder.journal.write_bytes(b"\n".join([lines[0], *(b"#" + line[1:] for line in lines[1:3]), b""]))
    assert "sub-P009/ses-01/journal.jsonl: line 2: damaged; restore it from a copy" in told(verify(study))


@pytest.mark.parametrize(
    ("damage", "sentence"),
    [
        (Path.unlink, "journal.jsonl: is missing, but receipt"),
        (only_the_journals_lines(0), "journal.jsonl: has no complete line, but receipt"),
        (lambda path: path.write_bytes(bytes(path.stat().st_size)), "journal.jsonl: has no complete line, but"),
    ],
)
@pytest.mark.parametrize("left", ["receipt.json", "checksums.sha256", "*_data.csv", "recordings/*"])
def test_a_lost_journal_is_an_error_by_whatever_else_is_left(
    study: Path, damage: Callable[[Path], Any], sentence: str, left: str
) -> None:
    folder = study / SESSION
    damage(folder / "journal.jsonl")
    kept = {folder / "journal.jsonl", folder / "receipt.json", *folder.glob(left)}
    for path in folder.rglob("*"):
        if path.is_file() and path not in kept:
            path.unlink()
    if left != "receipt.json":
        of_receipt(status="unfinished")(folder / "receipt.json")
    assert sentence in told(verify(study))
    assert not never_begun(folder)
    write_participants(StudyFolder(study), "brackish")
    rows = list(csv.DictReader((study / PARTICIPANTS).read_text(encoding="utf-8").splitlines()))
    assert [(row["participant"], row["study"], row["status"]) for row in rows] == [
        ("P007", "brackish", "damaged"),
        ("P008", "brackish", "withdrawn"),
    ]


@pytest.mark.parametrize(
    ("left", "sentence"),
    [
        ("checksums.sha256", "checksums.sha256: was written after the session ended, but the journal has no end"),
        ("*responses_data.csv", "responses_data.csv: has 12 rows, and the journal gives 0: restore the journal"),
        ("*trials_data.csv", "trials_data.csv: has 6 rows, and the journal gives 2: restore the journal"),
        ("recordings/trial-004.parquet", "trial-004.parquet: is of a trial that the journal never started"),
    ],
)
def test_a_journal_cut_in_half_says_less_than_what_is_left(study: Path, left: str, sentence: str) -> None:
    folder = study / SESSION
    only_the_journals_lines(5)(folder / "journal.jsonl")
    of_receipt(status="unfinished", reason="", ended_at=None)(folder / "receipt.json")
    kept = {folder / "journal.jsonl", folder / "receipt.json", *folder.glob(left)}
    for path in folder.rglob("*"):
        if path.is_file() and path not in kept:
            path.unlink()
    assert sentence in told(verify(study))


def test_a_receipt_of_a_session_resumed_more_often_than_the_journal_tells_is_an_error(study: Path) -> None:
    of_receipt(resumed=[{"at": "now"}])(study / SESSION / "receipt.json")
    assert "says that the session was resumed more often than the journal does" in told(verify(study))


def test_a_session_killed_between_its_last_line_and_its_checksums_is_finished_by_rebuild(
    study: Path, start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    store = start("P009")
    attend(store)
    store.append("session_ended", status="completed", reason="")
    store.close()
    found = told(verify(study))
    for name in ("receipt.json: its status is 'unfinished'", "checksums.sha256: is missing"):
        (line,) = (line for line in found.splitlines() if f"sub-P009/ses-01/{name}" in line)
        assert "rebuild" in line
    rebuild(store.folder.path)
    assert told(verify(study)) == ""

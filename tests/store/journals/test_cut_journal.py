"""A journal that lost lines: what `verify` contradicts is neither resumed nor rebuilt from."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.journals.journal import scan
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.rebuild import rebuild
from study_app.store.sessions.reopen import check_can_go_on
from study_app.store.verification.verify_study import verify
from tests.store.conftest import SOURCE
from tests.store.forging import Lines, forge

Attend = Callable[[SessionStore], None]


@pytest.fixture
def folder(start: Callable[..., SessionStore], attend: Attend) -> Path:
    """Return the folder of a session with 12 answers that ended."""
    store = start()
    attend(store)
    store.finish("completed")
    return store.folder.path


def cut(folder: Path, lines: int) -> None:
    path = folder / "journal.jsonl"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:lines]))


def every_byte(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def never_ended(folder: Path) -> None:
    """Take away whatever tells that the session had ended."""
    path = folder / "receipt.json"
    receipt.write(path, receipt.read(path) | {"status": "unfinished", "reason": "", "ended_at": None})
    (folder / "checksums.sha256").unlink()
    (folder.parents[2] / "fingerprints.txt").unlink()


def refused(folder: Path, protocol: Protocol, sentence: str) -> None:
    before = every_byte(folder.parents[2])
    for act in (lambda: rebuild(folder), lambda: check_can_go_on(folder, protocol, SOURCE)):
        with pytest.raises(StoreError, match=f"{sentence}.*: restore the journal from a copy"):
            act()
    assert every_byte(folder.parents[2]) == before


def test_a_finished_session_whose_journal_lost_its_end_is_left_alone(folder: Path, protocol: Protocol) -> None:
    cut(folder, 20)
    refused(folder, protocol, "its status is 'completed', the journal's 'unfinished'")
    assert not [error for error in verify(folder.parents[2]).errors if "rebuild renews" in str(error)]


@pytest.mark.parametrize(
    ("left", "sentence"),
    [
        ("checksums.sha256", "was written after the session ended"),
        ("fingerprints.txt", "lists data/sub-P007/ses-01 as ended"),
        ("*responses_data.csv", "responses_data.csv has 12 rows, and the journal gives 0"),
        ("*trials_data.csv", "trials_data.csv has 5 rows, and the journal gives 2"),
    ],
)
def test_whatever_tells_more_than_the_journal_stops_both(
    folder: Path, protocol: Protocol, left: str, sentence: str
) -> None:
    cut(folder, 5)
    study = folder.parents[2]
    kept = {path: path.read_bytes() for path in (*folder.glob(left), *study.glob(left))}
    never_ended(folder)
    for path in folder.glob("*_data.csv"):
        path.unlink()
    for path, content in kept.items():
        path.write_bytes(content)
    refused(folder, protocol, sentence)


def test_a_receipt_that_was_resumed_more_often_stops_both(folder: Path, protocol: Protocol) -> None:
    never_ended(folder)
    cut(folder, 5)
    path = folder / "receipt.json"
    path.write_text(json.dumps(receipt.read(path) | {"resumed": [{"at": "now"}]}))
    refused(folder, protocol, "was resumed more often than the journal")


def test_a_recording_of_a_trial_that_never_started_stops_both(folder: Path, protocol: Protocol) -> None:
    never_ended(folder)
    for path in folder.glob("*_data.csv"):
        path.unlink()
    cut(folder, 5)
    (folder / "recordings").mkdir()
    (folder / "recordings" / "trial-004.parquet").write_bytes(b"x")
    refused(folder, protocol, "trial-004.parquet is of a trial that the journal never started")


def test_a_table_with_a_trial_more_or_that_is_no_table_stops_neither(folder: Path, protocol: Protocol) -> None:
    """A power cut may take the line of a trial's start, which nobody waits for, and leave the table."""
    whole = next(folder.glob("*trials_data.csv")).read_bytes()
    never_ended(folder)
    cut(folder, 3)
    for path in folder.glob("*_data.csv"):
        path.unlink()
    table = folder / "subject-P007_session-01_task-brackish_description-trials_data.csv"
    for content in (b"".join(whole.splitlines(keepends=True)[:3]), b"\xff\0\r", b"a\nb\nc\nd\n"):
        table.write_bytes(content)
        check_can_go_on(folder, protocol, SOURCE)
        assert table in rebuild(folder).rewritten


def renamed(folder: Path, **of_start: str) -> None:
    """Rename the event of the last answers; the session's first line is another version's, where that is given."""

    def change(lines: Lines) -> None:
        last = max(index for index, line in enumerate(lines) if line["event"] == "responses")
        lines[last]["event"] = "sesponses"
        lines[0].update(of_start)
        if lines[-1]["event"] == "session_ended":
            del lines[-1]

    forge(folder / "journal.jsonl", change)


def test_an_event_that_the_writing_version_did_not_have_is_damage(folder: Path, protocol: Protocol) -> None:
    renamed(folder)
    assert "has an event 'sesponses', which version" in str(scan(folder / "journal.jsonl").damage)
    assert not verify(folder.parents[2]).sound
    for act in (lambda: rebuild(folder), lambda: check_can_go_on(folder, protocol, SOURCE)):
        with pytest.raises(StoreError, match="was changed; restore it from a copy"):
            act()


def test_a_session_with_events_of_another_version_is_left_alone_by_this_one(folder: Path, protocol: Protocol) -> None:
    renamed(folder, version="99.0")
    path = folder / "receipt.json"
    receipt.write(path, receipt.read(path) | {"version": "99.0"})
    never_ended(folder)
    assert scan(folder / "journal.jsonl").damage is None
    before = every_byte(folder)
    for act in (lambda: rebuild(folder), lambda: check_can_go_on(folder, protocol, SOURCE)):
        with pytest.raises(
            StoreError, match="has events 'sesponses', which this version does not know: use the version"
        ):
            act()
    assert every_byte(folder) == before

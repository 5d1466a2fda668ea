"""Tables of a running session: each page brings them up to date; a table that was cut off is completed."""

from collections.abc import Callable
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.store.blinded.blinding import reveal
from study_app.store.journals import journal_events
from study_app.store.sessions.open_session import SessionStore, table_files
from study_app.store.sessions.recovery import check_resumable, rebuild_session
from study_app.store.verification.whole_study import verify_study
from tests.journal_lines import event_of
from tests.platforms import files_up_to
from tests.store.conftest import SOURCE, Start

PAGES = 5_000
NOTES = ("first, of two lines\nand a comma", "=1+2", '"quoted"')


def start_trial(store: SessionStore, number: int, attempt: int = 1) -> None:
    fields = {"block": "b", "phase": "main", "part": 1, "index": number, "of": PAGES, "code": "L1"}
    store.append(journal_events.TrialStarted(trial=number, attempt=attempt, **fields), waits=False)


def end_trial(store: SessionStore, number: int, summary: dict[str, Any], attempt: int = 1) -> None:
    store.append(event_of("trial_ended", trial=number, attempt=attempt, outcome="complete", **summary), waits=False)


def answer(store: SessionStore, number: int, attempt: int = 1) -> None:
    answer_fields = {"number": 1, "value": 4, "onset_s": 1.5, "first_s": 2.25, "last_s": 2.25, "changes": 0}
    store.append(journal_events.ItemShown(trial=number, item="wet"), t_s=1.5, waits=False)
    store.append(journal_events.Choice(trial=number, item="wet", value=4), t_s=2.25, waits=False)
    store.append(
        event_of("responses", trial=number, attempt=attempt, items=[{"item": "wet", **answer_fields}]), waits=False
    )


def record_trial(store: SessionStore, number: int, attempt: int = 1) -> None:
    names = {
        "recording": f"recordings/trial-{number:03d}.parquet",
        "recording_frames": f"recordings/trial-{number:03d}_frames.parquet",
    }
    counts = {"samples_recorded": 10, "samples_unrecorded": 0, "frames_recorded": 2}
    hashes = {"sha256": "0" * 64, "frames_sha256": "0" * 64}
    store.append(journal_events.Recorded(trial=number, attempt=attempt, **names, **counts, **hashes), waits=False)


def pages(store: SessionStore, summary: dict[str, Any]) -> list[Callable[[], None]]:
    """Return the events between two writes of the tables: every change of a row, also late and early ones."""
    return [
        lambda: start_trial(store, 1),
        lambda: end_trial(store, 1, summary),
        lambda: answer(store, 1),
        lambda: start_trial(store, 2),
        lambda: record_trial(store, 1),
        lambda: store.append(journal_events.Note(kind="mark", text=NOTES[0])),
        lambda: None,
        lambda: store.append(journal_events.Note(kind="note", text=NOTES[1])),
        lambda: store.append(journal_events.Repeat(trial=2, reason=NOTES[2])),
        lambda: start_trial(store, 2, 2),
        lambda: end_trial(store, 2, summary, 2),
        lambda: answer(store, 2, 2),
        lambda: start_trial(store, 3),
        lambda: record_trial(store, 2, 2),
    ]


def test_the_tables_match_the_journal_after_every_page(start: Start, summary: dict[str, Any]) -> None:
    with start() as store:
        for page in pages(store, summary):
            page()
            store.write_tables()
            assert store.behind is None
            for path, content in table_files(store.place, store.lines, None):
                assert path.read_bytes() == content


def test_sealed_columns_come_in_when_the_key_is_opened_meanwhile(start: Start, summary: dict[str, Any]) -> None:
    with start() as store:
        start_trial(store, 1)
        end_trial(store, 1, summary)
        store.write_tables()
        before = store.folder.table("brackish", "trials").read_bytes()
        reveal(store.place.study_folder.path, "me", "a test")
        start_trial(store, 2)
        store.write_tables()
        for path, content in table_files(store.place, store.lines, store.key):
            assert path.read_bytes() == content
        assert b"force_mean_n" not in before
        assert b"force_mean_n" in store.folder.table("brackish", "trials").read_bytes()


def test_a_table_that_somebody_changed_is_written_whole(start: Start, summary: dict[str, Any]) -> None:
    with start() as store:
        for number, page in enumerate(pages(store, summary)):
            page()
            for path, _ in table_files(store.place, store.lines, None):
                if number % 2:
                    path.unlink()
                else:
                    path.write_bytes(b"saved by a spreadsheet")
            start_trial(store, 100 + number)
            answer(store, 100 + number)
            store.write_tables()
            for path, content in table_files(store.place, store.lines, None):
                assert path.read_bytes() == content


@pytest.mark.slow
def test_a_table_that_was_cut_off_is_accepted_and_completed(
    start: Start, protocol: Protocol, summary: dict[str, Any]
) -> None:
    """Earlier versions, killed while they wrote, left such tables; a note of two lines is cut in its quotes, too."""
    with start() as store:
        start_trial(store, 1)
        end_trial(store, 1, summary)
        store.append(journal_events.Note(kind="mark", text=NOTES[0]))
        store.write_tables()
        path = store.folder.table("brackish", "trials")
        whole = path.read_bytes()
    for size in range(whole.index(b"\n") + 1, len(whole), 7):
        path.write_bytes(whole[:size])
        verification = verify_study(store.place.study_folder.path)
        assert verification.errors == ()
        assert any("differs from the journal" in warning.message for warning in verification.warnings)
        check_resumable(store.folder.path, protocol, SOURCE)
        assert path in rebuild_session(store.folder.path).rewritten
        assert path.read_bytes() == whole


def test_on_a_disk_that_fills_a_table_keeps_its_rows(start: Start, summary: dict[str, Any]) -> None:
    with start() as store:
        start_trial(store, 1)
        store.write_tables()
        path = store.folder.table("brackish", "trials")
        before = path.read_bytes()
        end_trial(store, 1, summary)
        with files_up_to(len(before) + 3):
            store.write_tables()
        assert "cannot be written (File too large)" in str(store.behind)
        assert path.read_bytes() == before
        store.write_tables()
        assert store.behind is None
        assert path.read_bytes() == dict(table_files(store.place, store.lines, None))[path]

import pytest

from study_app.errors import StoreError
from study_app.store.journals import journal, journal_events
from study_app.store.sessions.open_session import SessionStore, table_files
from study_app.store.sessions.recovery import rebuild_session
from study_app.store.verification.verify_session import session_discrepancies
from tests.journal_lines import event_of
from tests.store.conftest import Attend, Start
from tests.store.sessions.conftest import every_byte


@pytest.fixture
def ended_session(start: Start, attend: Attend) -> SessionStore:
    store = start()
    attend(store)
    store.append(journal_events.Note(kind="note", text='comma, "quote"\nnew line, =SUM(A1) 🌊'))
    store.finish("completed")
    return store


def test_rebuilding_removes_only_half_written_files(ended_session: SessionStore) -> None:
    here, below = ended_session.folder.path, ended_session.folder.recordings
    below.mkdir()
    half = [here / ".folder.0123abcd.tmp", here / ".trials.csv.0123abcd.tmp", below / ".trial-001.parquet.0123abcd.tmp"]
    names = ("notes.tmp", ".mine.tmp", ".open-0123abcd.bak", "..open-01234567.json.0123abcd.tmp")
    other_files = [*(here / name for name in names), below / "own.parquet"]
    half[0].mkdir()
    for path in (half[0] / "inside", *half[1:], *other_files):
        path.write_bytes(b"x")
    assert rebuild_session(here).swept == tuple(half)
    assert [path.exists() for path in (*half, *other_files)] == [False] * 3 + [True] * 5


def three_answers(store: SessionStore) -> None:
    """Journal the shortest session with three answers, so that it can be cut at every byte."""
    fields = {"block": "b", "phase": "main", "part": 1, "of": 3, "code": "L1"}
    times = {"onset_s": 1.5, "first_s": 2.25, "last_s": 2.25, "changes": 0}
    for number in (1, 2, 3):
        store.append(journal_events.TrialStarted(trial=number, attempt=1, index=number, **fields))
        store.append(event_of("trial_ended", trial=number, attempt=1, outcome="complete"))
        item = {"item": "wet", "number": 1, "value": number, **times}
        store.append(event_of("responses", trial=number, attempt=1, items=[item]))


@pytest.mark.nightly
@pytest.mark.slow
def test_a_journal_cut_at_any_byte_is_rebuilt_from_its_whole_lines_and_left_unchanged(start: Start) -> None:
    """The tables contain the whole lines; the incomplete last line is counted; without lines there is no table."""
    with start() as store:
        three_answers(store)
    path = store.folder.journal
    content, lines = path.read_bytes(), journal.read(path)
    ends = [end + 1 for end, byte in enumerate(content) if byte == ord("\n")]
    assert len(ends) == 10
    expected = [table_files(store.place, lines[:count], None) for count in range(1, 11)]
    receipt_bytes = store.folder.receipt.read_bytes()
    for size in range(len(content) + 1):
        path.write_bytes(content[:size])
        whole = sum(end <= size for end in ends)
        if whole == 0:
            with pytest.raises(StoreError, match="does not begin with session_started"):
                rebuild_session(store.folder.path)
            continue
        rebuild = rebuild_session(store.folder.path)
        assert rebuild.torn_bytes == size - ends[whole - 1]
        assert [(file, file.read_bytes()) for file, _ in expected[whole - 1]] == list(expected[whole - 1])
        assert path.read_bytes() == content[:size]
    assert store.folder.receipt.read_bytes() == receipt_bytes
    assert sum(table.count(b"\n") for _, table in expected[-1]) == 2 * (1 + 3)


def test_an_open_session_is_not_rebuilt(start: Start) -> None:
    with start() as store:
        before = every_byte(store.folder.path)
        with pytest.raises(StoreError, match="is open in another program"):
            rebuild_session(store.folder.path)
        assert every_byte(store.folder.path) == before


def test_a_folder_under_a_tables_name_is_a_doubt(ended_session: SessionStore) -> None:
    path = ended_session.folder.table("brackish", "trials")
    path.unlink()
    path.mkdir()
    (doubt,) = session_discrepancies(ended_session.place)
    assert doubt.path == path
    assert "cannot be read" in str(doubt)

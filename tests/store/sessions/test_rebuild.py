import hashlib
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.journals import journal, journal_events
from study_app.store.sessions.folder_lock import is_open
from study_app.store.sessions.open_session import SessionStore, table_files
from study_app.store.sessions.recovery import Rebuilt, rebuild
from study_app.store.verification.verify_session import doubts
from study_app.store.verification.verify_study import verify
from tests.journal_lines import event_of
from tests.store.conftest import Attend, Start
from tests.store.forging import forge
from tests.store.sessions.conftest import every_byte


@pytest.fixture
def ended(start: Start, attend: Attend) -> SessionStore:
    store = start()
    attend(store)
    store.append(journal_events.Note(kind="note", text='comma, "quote"\nnew line, =SUM(A1) 🌊'))
    store.finish("completed")
    return store


@pytest.mark.parametrize(
    "spoilt", [None, b"", b"study,participant\n", b"\xff\0"], ids=["gone", "empty", "cut", "noise"]
)
def test_everything_comes_back_to_the_byte(tmp_path: Path, ended: SessionStore, spoilt: bytes | None) -> None:
    before = every_byte(tmp_path)
    assert rebuild(ended.folder.path) == Rebuilt(rewritten=(), swept=(), torn_bytes=0)
    assert every_byte(tmp_path) == before
    derived = [
        ended.folder.table("brackish", "responses"),
        ended.folder.table("brackish", "trials"),
        ended.place.study_folder.participants("brackish"),
        ended.folder.checksums,
    ]
    for path in derived:
        if spoilt is None:
            path.unlink()
        else:
            path.write_bytes(spoilt)
    done = rebuild(ended.folder.path)
    assert set(done.rewritten) == {*derived, ended.folder.rebuilt}
    after = every_byte(tmp_path)
    (noted,) = (after.pop(name) for name in set(after) - set(before))
    assert (b"was missing" if spoilt is None else b"was damaged") in noted
    name = str(ended.folder.checksums.relative_to(tmp_path))
    listed = {*before.pop(name).splitlines(), f"{hashlib.sha256(noted).hexdigest()}  rebuilt.txt".encode()}
    assert set(after.pop(name).splitlines()) == listed
    assert after == before


def test_a_note_of_rebuild_lasts(tmp_path: Path, ended: SessionStore) -> None:
    """The list of checksums vouches for it, the fingerprint does not change with it, and everybody is told."""
    table = ended.folder.table("brackish", "trials")
    table.unlink()
    assert rebuild(ended.folder.path).rewritten == (table,)
    assert not ended.folder.rebuilt.exists()  # the list is as it was
    ended.folder.checksums.unlink()
    rebuild(ended.folder.path)
    rebuild(ended.folder.path)
    findings = verify(tmp_path / "study")
    assert findings.sound
    (told,) = [str(one) for one in findings.warnings if "rebuilt.txt" in str(one)]
    assert "the list of checksums was missing" in told
    assert [doubt.path for doubt in doubts(ended.place)] == [ended.folder.rebuilt]
    ended.folder.rebuilt.unlink()
    assert "rebuilt.txt: is missing" in "\n".join(map(str, verify(tmp_path / "study").errors))


def test_a_session_without_a_fingerprint_gets_it_with_a_note(tmp_path: Path, ended: SessionStore) -> None:
    path = ended.place.study_folder.fingerprints
    before = path.read_bytes()
    path.unlink()
    (error,) = verify(tmp_path / "study").errors
    assert str(error) == "fingerprints.txt: lacks data/sub-P007/ses-01, which has ended; rebuild adds it"
    assert set(rebuild(ended.folder.path).rewritten) == {ended.folder.checksums, ended.folder.rebuilt, path}
    assert path.read_bytes() == before
    assert "fingerprints.txt had no fingerprint of the session" in ended.folder.rebuilt.read_text()
    assert verify(tmp_path / "study").sound
    assert rebuild(ended.folder.path).rewritten == ()


@pytest.mark.parametrize("name", ["journal.jsonl", "receipt.json", "mood.txt"])
def test_a_changed_or_added_file_is_never_vouched_for(tmp_path: Path, ended: SessionStore, name: str) -> None:
    """Making tables again must not hide that something else has changed since the session ended."""
    path = ended.folder.path / name
    if name == "journal.jsonl":
        forge(path, lambda lines: lines[0].update(operator="XY"))
    else:
        path.write_bytes((path.read_bytes() if path.exists() else b"").replace(b'"AB"', b'"XY"') + b" ")
    ended.folder.table("brackish", "trials").unlink()
    rebuild(ended.folder.path)
    findings = verify(tmp_path / "study")
    assert [name in str(error) for error in findings.errors].count(True) >= 1


def test_half_written_files_are_taken_away_and_nothing_else(ended: SessionStore) -> None:
    here, below = ended.folder.path, ended.folder.recordings
    below.mkdir()
    half = [here / ".folder.0123abcd.tmp", here / ".trials.csv.0123abcd.tmp", below / ".trial-001.parquet.0123abcd.tmp"]
    names = ("notes.tmp", ".mine.tmp", ".open-0123abcd.bak", "..open-01234567.json.0123abcd.tmp")
    kept = [*(here / name for name in names), below / "own.parquet"]
    half[0].mkdir()
    for path in (half[0] / "inside", *half[1:], *kept):
        path.write_bytes(b"x")
    assert rebuild(here).swept == tuple(half)
    assert [path.exists() for path in (*half, *kept)] == [False] * 3 + [True] * 5


def three_answers(store: SessionStore) -> None:
    """As short as a session with three answers can be, so that it can be cut everywhere."""
    told = {"block": "b", "phase": "main", "part": 1, "of": 3, "code": "L1"}
    times = {"onset_s": 1.5, "first_s": 2.25, "last_s": 2.25, "changes": 0}
    for number in (1, 2, 3):
        store.append(journal_events.TrialStarted(trial=number, attempt=1, index=number, **told))
        store.append(event_of("trial_ended", trial=number, attempt=1, outcome="complete"))
        item = {"item": "wet", "number": 1, "value": number, **times}
        store.append(event_of("responses", trial=number, attempt=1, items=[item]))


@pytest.mark.nightly
@pytest.mark.slow
def test_of_a_journal_cut_at_any_byte_everything_whole_is_rebuilt_and_the_journal_left_alone(start: Start) -> None:
    """The tables are those of the whole lines; the torn tail is counted; without a whole line there is nothing."""
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
                rebuild(store.folder.path)
            continue
        done = rebuild(store.folder.path)
        assert done.torn_bytes == size - ends[whole - 1]
        assert [(file, file.read_bytes()) for file, _ in expected[whole - 1]] == list(expected[whole - 1])
        assert path.read_bytes() == content[:size]
    assert store.folder.receipt.read_bytes() == receipt_bytes
    assert sum(table.count(b"\n") for _, table in expected[-1]) == 2 * (1 + 3)


def test_an_end_that_the_receipt_never_heard_of_is_brought_into_it(tmp_path: Path, ended: SessionStore) -> None:
    """The program was killed between the journal's last line and the receipt."""
    whole = ended.folder.receipt.read_bytes()
    held = receipt.read(ended.folder.receipt)
    receipt.write(ended.folder.receipt, held | {"status": "unfinished", "ended_at": None})
    ended.folder.checksums.unlink()
    done = rebuild(ended.folder.path)
    assert set(done.rewritten) == {ended.folder.receipt, ended.folder.checksums, ended.folder.rebuilt}
    assert ended.folder.receipt.read_bytes() == whole
    assert verify(tmp_path / "study").sound


def test_a_session_that_is_open_is_left_alone(start: Start) -> None:
    with start() as store:
        before = every_byte(store.folder.path)
        with pytest.raises(StoreError, match="is open in another program"):
            rebuild(store.folder.path)
        assert every_byte(store.folder.path) == before


def test_a_damaged_journal_is_refused_untouched(tmp_path: Path, ended: SessionStore) -> None:
    lines = ended.folder.journal.read_bytes().split(b"\n")
    ended.folder.journal.write_bytes(b"\n".join([lines[0], lines[1][:20], *lines[2:]]))
    before = every_byte(tmp_path)
    with pytest.raises(StoreError, match="line 2: damaged; restore it from a copy"):
        rebuild(ended.folder.path)
    assert every_byte(tmp_path) == before
    assert not is_open(ended.folder.path)


def test_a_folder_under_a_tables_name_is_a_doubt(ended: SessionStore) -> None:
    path = ended.folder.table("brackish", "trials")
    path.unlink()
    path.mkdir()
    (doubt,) = doubts(ended.place)
    assert doubt.path == path
    assert "cannot be read" in str(doubt)

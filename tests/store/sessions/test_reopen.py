"""A session goes on: times, receipt, tables, torn lines and recordings without a line."""

import itertools
import time
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pytest

from study_app import __version__
from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Trial, build_schedule
from study_app.store import receipt
from study_app.store.blinded.blinding import open_events
from study_app.store.integrity.folder_lock import is_open
from study_app.store.journals import journal, journal_events
from study_app.store.recorder import recording_files
from study_app.store.recordings import read_samples, write_frames
from study_app.store.sessions.open_session import SessionStore
from tests.journal_lines import event_of
from tests.platforms import files_up_to
from tests.store.conftest import Make, Start
from tests.store.sessions.conftest import Again
from tests.store.test_recorder import Disk


def begin_trial(store: SessionStore, trial: Trial) -> None:
    trial_fields = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
    store.append(journal_events.TrialStarted(trial=trial.number, attempt=1, **trial_fields))


def present(store: SessionStore, trial: Trial, summary: dict[str, Any]) -> None:
    begin_trial(store, trial)
    store.append(event_of("trial_ended", trial=trial.number, attempt=1, outcome="complete", **summary))
    store.write_tables()


def test_a_session_whose_recordings_cannot_be_written_closes_promptly_and_resumes(
    start: Start, again: Again, samples_of: Make, protocol: Protocol, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("study_app.store.sessions.open_session.LEAVING_S", 0.05, raising=False)
    trial = next(step for step in build_schedule(protocol, "P007", 11).steps if isinstance(step, Trial))
    store, disk = start(recordings=True), Disk(monkeypatch)
    assert store.recorder is not None
    store.recorder.start(trial.number, 1, 1000.0)
    store.recorder.append(samples_of(10))
    present(store, trial, {})
    before = time.perf_counter()
    store.close()
    assert time.perf_counter() - before < 10.0, "and not the half minute that the end of a session waits"
    assert not is_open(store.folder.path)
    with again() as resumed:
        assert resumed.lines[-1].event == "session_resumed"
        assert resumed.lines[-2].event == "recording_lost"
    disk.works.set()


def test_a_resumed_session_continues_after_the_last_line_and_records_it(start: Start, again: Again) -> None:
    with start() as store:
        store.append(journal_events.PageShown(page="consent"), t_s=40.0)
    last_at = datetime.fromisoformat(store.lines[-1].at)
    resumed = again(now=last_at + timedelta(hours=20, seconds=0.25))
    line = resumed.lines[-1]
    resumed.append(journal_events.PageLeft(page="consent"))
    resumed.close()
    assert journal.read(store.folder.journal) == list(resumed.lines)
    assert [line.n for line in resumed.lines] == [1, 2, 3, 4]
    assert {name: value for name, value in line.line().items() if name not in ("t_s", "at", "previous")} == {
        "n": 3,
        "event": "session_resumed",
        "gap_s": 72_000.25,
        "torn_bytes": 0,
        "operator": "CD",
        "device": "mouse",
        "version": __version__,
        "receipt_hash": receipt.digest(receipt.read(store.folder.receipt)["resumed"][0]),
    }
    assert line.t_s == pytest.approx(40 + 72_000.25, abs=0.01)
    since = datetime.fromisoformat(line.at) - last_at
    assert since == pytest.approx(timedelta(seconds=72_000.25), abs=timedelta(seconds=0.01))


@pytest.mark.parametrize(("table", "spare"), [("responses", 0), ("trials", 1), ("intervals", 1)])
def test_tables_may_exceed_the_journal_by_one_trial_and_interval_but_not_by_an_answer(
    start: Start, again: Again, table: str, spare: int
) -> None:
    with start() as store:
        path = store.folder.table("brackish", table)
    path.write_text("a,b\n" + (spare + 1) * "1,2\n", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match=rf"{table}_data\.csv has {spare + 1} rows, but the journal contains 0"):
        again()
    path.write_text("a,b\n" + spare * "1,2\n", encoding="utf-8", newline="\n")
    again().close()
    store.folder.journal.write_bytes(b"")
    with pytest.raises(StoreError, match=r"journal\.jsonl is empty: .*; use a new session number$"):
        again()


def test_times_never_go_back(start: Start, again: Again) -> None:
    """The wall clock was set back an hour, and the machine was started anew: its own clock begins at nought."""
    with start() as store:
        store.append(journal_events.PageShown(page="consent"), t_s=40.0)
    set_back = datetime.fromisoformat(store.lines[-1].at) - timedelta(hours=1)
    with again(now=set_back, now_ns=itertools.count(0, 1_000_000).__next__) as resumed:
        resumed.append(journal_events.PageLeft(page="consent"))
    line, after = resumed.lines[-2:]
    assert line.gap_s is None
    assert 40.0 <= line.t_s < after.t_s < 40.1
    assert datetime.fromisoformat(line.at) - set_back < timedelta(seconds=1)


def test_an_impossible_gap_is_recorded_as_unknown(start: Start, again: Again) -> None:
    """The wall clock was at 1970 before, or is decades ahead now; or a moment was changed."""
    with start() as store:
        store.append(journal_events.PageShown(page="consent"), t_s=40.0)
    at, path = store.lines[-1].at, store.folder.journal
    whole = path.read_bytes()
    for wrong in (b"0001-01-01T00:00:00.000+01:00", b"9999-12-31T23:59:59.000-01:00"):
        path.write_bytes(whole.replace(at.encode(), wrong))
        with pytest.raises(StoreError, match=r"has at .*; expected: time"):
            again()
    path.write_bytes(whole)
    now = datetime.fromisoformat(at)
    for _ in range(2):
        now += timedelta(days=40 * 365)
        with again(now=now) as resumed:
            resumed.append(journal_events.PageLeft(page="consent"))
        assert (resumed.lines[-2].gap_s, resumed.lines[-2].t_s < 41) == (None, True)


def test_the_receipt_records_the_equipment_of_each_resumption(start: Start, again: Again) -> None:
    with start() as store:
        before = receipt.read(store.folder.receipt)
    optional = {"motors_masked": {"by": "noise"}, "outlets": {"port": "COM3"}, "video": {"camera": "desk"}}
    for count, resumption_fields in enumerate(({"screens": {"width": 1280}}, optional), start=1):
        with again(**resumption_fields) as resumed:
            assert len(receipt.read(store.folder.receipt)["resumed"]) == count
    after = receipt.read(store.folder.receipt)
    assert before["resumed"] == []
    assert {name for name in after if after[name] != before[name]} == {"resumed"}
    assert [resumption["at"] for resumption in after["resumed"]] == [line.at for line in resumed.lines[1:]]
    assert after["resumed"][0]["device"] == {"name": "mouse"}
    assert after["resumed"][0]["operator"] == "CD"
    assert after["resumed"][0]["screens"] == {"width": 1280}
    assert after["resumed"][0].keys().isdisjoint(optional)
    assert {name: after["resumed"][1][name] for name in optional} == optional
    assert after["resumed"][0]["versions"] == before["versions"]
    assert after["resumed"][1]["clock"] == {"origin_ns": resumed.clock.origin_ns, "origin_at": resumed.clock.at(0)}


def test_resuming_on_a_full_disk_changes_no_file_and_can_be_repeated(start: Start, again: Again) -> None:
    with start() as store:
        store.append(journal_events.Note(kind="note", text="x" * 3000))
    before = store.folder.journal.read_bytes()
    with files_up_to(len(before) + 10), pytest.raises(StoreError, match=r"journal\.jsonl cannot be written"):
        again()
    assert store.folder.journal.read_bytes() == before
    assert not is_open(store.folder.path)
    with again() as resumed:
        assert resumed.lines[-1].event == "session_resumed"


def test_recordings_without_a_line_are_taken_up_if_whole_and_lost_if_not(
    start: Start, again: Again, samples_of: Make, protocol: Protocol
) -> None:
    """The program was killed before the journal heard of the second, and between frames and samples of the third."""
    store = start(recordings=True)
    trials = build_schedule(protocol, "P007", 11).trials[:3]
    assert store.recorder is not None
    for trial in trials:
        begin_trial(store, trial)
    for trial in trials[:2]:
        store.recorder.start(trial.number, 1, 1000.0)
        store.recorder.append(samples_of(100 * trial.number))
        store.recorder.stop()
    store.recorder.close()
    store.append(store.recorder.collect_results()[0])
    store.journal.close()
    store.lock.release()
    torn = store.folder.recordings / ".trial-003.parquet.0123abcd.tmp"
    torn.write_bytes(b"PAR1")
    frames = recording_files(store.folder.recordings, 3, 1)[1]
    write_frames(frames, np.zeros((2, 5), np.int64), {"trial": 3, "attempt": 1})
    table = store.folder.path / ".receipt.json.89abcdef.tmp"
    table.write_bytes(b"{")

    with again() as resumed:
        interrupted = resumed.folder.table("brackish", "trials").read_text(encoding="utf-8")
        assert ",interrupted," in interrupted.splitlines()[1]
        assert not torn.exists()
        assert not frames.exists()
        assert not table.exists()
        recording_lines = [line for line in resumed.lines if line.event in ("recorded", "recording_lost")]
        assert [(line.event, line.trial) for line in recording_lines] == [
            ("recorded", 1),
            ("recorded", 2),
            ("recording_lost", 3),
        ]
        assert open_events(resumed.lines, resumed.key)[recording_lines[1].n - 1].samples_recorded == 200
        assert len(read_samples(resumed.folder.path / recording_lines[1].recording, resumed.key.nonce)) == 200
        assert recording_lines[2].reason == "the program ended before the recording was complete"
        recorder = resumed.recorder
        assert recorder is not None
        recorder.start(3, 2, 1000.0)
        recorder.append(samples_of(50))
    assert (resumed.lines[-1].event, resumed.lines[-1].attempt) == ("recorded", 2)

"""A session's outlets get its events once, before the disk; one that fails is journalled once."""

import json
from collections.abc import Iterator
from functools import partial
from typing import Any
from unittest import mock

import pytest

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.journals import journal, journal_events
from study_app.store.session_progress.progress import progress_of
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import reopen_store
from tests.outlets.collector import Collector
from tests.store.conftest import SOURCE, Start

TRIAL = {"trial": 1, "attempt": 1, "block": "liquids", "phase": "main", "part": 1, "index": 1, "of": 2, "code": "L2"}


@pytest.fixture
def outlets() -> Collector:
    return Collector()


@pytest.fixture
def store(start: Start, outlets: Collector) -> Iterator[SessionStore]:
    with start() as new_store:
        new_store.attach(outlets)
        yield new_store


def test_markers_have_the_times_of_the_journal_on_the_servos_clock(store: SessionStore, outlets: Collector) -> None:
    store.append(journal_events.TrialStarted(**TRIAL), t_s=1.25)
    store.append(journal_events.Note(kind="mark", text=""))
    store.finish("completed")
    assert outlets.events == ["session_started", "trial_started", "note", "session_ended"]
    lines = journal.read(store.folder.journal)
    assert [line.event for line in lines] == outlets.events
    for marker, line in zip(outlets.markers, lines, strict=True):
        assert round(marker.t_s, 6) == line.t_s
        assert marker.time_ns == pytest.approx(store.clock.origin_ns + 1e9 * line.t_s, abs=1000)


def test_a_marker_does_not_wait_for_the_disk_and_is_not_sent_again(
    store: SessionStore, outlets: Collector, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = mock.Mock(side_effect=StoreError("the disk is full"))
    append_start = partial(store.append, journal_events.TrialStarted(**TRIAL), t_s=1.25)
    for act in (append_start, partial(store.finish, "completed")):
        with monkeypatch.context() as patch:
            patch.setattr(store.journal, "append", full)
            for _ in range(3):
                with pytest.raises(StoreError):
                    act()
        act()
    assert outlets.events == ["session_started", "trial_started", "session_ended"]
    assert journal.read(store.folder.journal)[-1].t_s == round(outlets.markers[-1].t_s, 6)


def test_an_outlet_that_fails_is_journalled_once_and_its_last_count_is_in_the_receipt(
    store: SessionStore, outlets: Collector
) -> None:
    store.write_tables()
    serial, samples = "serial:/dev/ttyUSB0 failed: it was unplugged", "{} samples were not sent in time"
    for count in (12, 12, 3400):
        outlets.lost = {"Serial port": serial, "LSL samples": samples.format(count)}
        store.write_tables()
    store.finish("completed")
    lines = journal.read(store.folder.journal)
    lost = [(line.outlet, line.reason) for line in lines if line.event == "outlet_lost"]
    assert sorted(lost) == [("LSL samples", samples.format(12)), ("Serial port", serial)]
    assert progress_of(lines).outlets_lost == dict(lost)
    assert receipt.read(store.folder.receipt)["outlets_lost"] == outlets.lost


def test_a_resumed_session_begins_with_its_resumption_and_its_own_outlets(
    start: Start, protocol: Protocol, outlets: Collector
) -> None:
    with start() as store:
        store.attach(outlets)
        outlets.lost = {"LSL samples": "12 samples were not sent in time"}
        store.write_tables()
        assert progress_of(store.lines).outlets_lost == outlets.lost
    path, later = store.folder.path, Collector()
    sent: dict[str, Any] = {"device": {"name": "scripted"}, "screens": {}, "outlets": {"a": {}}}
    with reopen_store(path, protocol, SOURCE, operator="AB", **sent) as again:
        assert progress_of(again.lines).outlets_lost == {}
        again.attach(later)
        assert later.events == ["session_resumed"]
        later.lost = {"Serial port": "it was unplugged"}
        again.finish("completed")
    session_receipt = receipt.read(store.folder.receipt)
    assert session_receipt["outlets_lost"] == {"LSL samples": "12 samples were not sent in time"}
    assert session_receipt["resumed"][-1]["outlets_lost"] == {"Serial port": "it was unplugged"}
    assert session_receipt["resumed"][-1]["outlets"] == {"a": {}}


def test_the_receipt_records_the_outlets(start: Start) -> None:
    sent = {"Serial port": {"address": "serial:/dev/ttyUSB0", "codes": {"trial_started": 10}}}
    with start(outlets=sent) as store:
        assert json.loads(store.folder.receipt.read_text(encoding="utf-8"))["outlets"] == sent
    with start("P008") as store:
        assert "outlets" not in json.loads(store.folder.receipt.read_text(encoding="utf-8"))

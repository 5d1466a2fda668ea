"""A session's outlets get its events once, before the disk; one that fails is journalled once."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.journals import journal
from study_app.store.progress import progress_of
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.reopen import reopen
from tests.outlets.collector import Collector
from tests.store.conftest import SOURCE

TRIAL = {"trial": 1, "attempt": 1, "block": "liquids", "phase": "main", "part": 1, "index": 1, "of": 2, "code": "L2"}

Start = Callable[..., SessionStore]


@pytest.fixture
def outlets() -> Collector:
    return Collector()


@pytest.fixture
def store(start: Start, outlets: Collector) -> Iterator[SessionStore]:
    with start() as made:
        made.attach(outlets)
        yield made


def test_markers_have_the_times_of_the_journal_on_the_servos_clock(store: SessionStore, outlets: Collector) -> None:
    store.append("trial_started", t_s=1.25, **TRIAL)
    store.append("note", kind="mark", text="")
    store.finish("completed")
    assert outlets.events == ["session_started", "trial_started", "note", "session_ended"]
    lines = journal.read(store.folder.journal)
    assert [line["event"] for line in lines] == outlets.events
    for marker, line in zip(outlets.markers, lines, strict=True):
        assert round(marker.t_s, 6) == line["t_s"]
        assert marker.time_ns == pytest.approx(store.clock.origin_ns + 1e9 * line["t_s"], abs=1000)


def test_a_marker_does_not_wait_for_the_disk_and_is_not_sent_again(
    store: SessionStore, outlets: Collector, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(store.journal, "append", lambda *_given, **_named: _refuse())
        for _ in range(3):
            with pytest.raises(StoreError):
                store.append("trial_started", t_s=1.25, **TRIAL)
    assert outlets.events == ["session_started", "trial_started"]
    store.append("trial_started", t_s=1.25, **TRIAL)
    assert outlets.events == ["session_started", "trial_started"]
    store.append("trial_started", t_s=1.25, **TRIAL)  # the same again, once the line is written
    assert outlets.events == ["session_started", "trial_started", "trial_started"]


def test_an_end_that_the_disk_does_not_accept_is_marked_once(
    store: SessionStore, outlets: Collector, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(store.journal, "append", lambda *_given, **_named: _refuse())
        for _ in range(3):
            with pytest.raises(StoreError):
                store.finish("completed")
    store.finish("completed")
    assert outlets.events == ["session_started", "session_ended"]
    assert journal.read(store.folder.journal)[-1]["t_s"] == round(outlets.markers[-1].t_s, 6)


def _refuse() -> None:
    raise StoreError("the disk is full")


def test_an_outlet_that_fails_is_journalled_once(store: SessionStore, outlets: Collector) -> None:
    store.write_tables()
    outlets.lost = {"Serial port": "serial:/dev/ttyUSB0 failed: it was unplugged"}
    for _ in range(3):
        store.write_tables()
    store.finish("completed")
    lines = journal.read(store.folder.journal)
    lost = [(line["outlet"], line["reason"]) for line in lines if line["event"] == "outlet_lost"]
    assert lost == [("Serial port", "serial:/dev/ttyUSB0 failed: it was unplugged")]
    assert progress_of(lines).outlets_lost == dict(lost)


def test_the_receipt_has_the_last_count_of_lost_samples(store: SessionStore, outlets: Collector) -> None:
    outlets.lost = {"LSL samples": "12 samples were not sent in time"}
    store.write_tables()
    outlets.lost = {"LSL samples": "3400 samples were not sent in time"}
    store.finish("completed")
    assert receipt.read(store.folder.receipt)["outlets_lost"] == outlets.lost
    lost = [line["reason"] for line in journal.read(store.folder.journal) if line["event"] == "outlet_lost"]
    assert lost == ["12 samples were not sent in time"]


def test_the_receipt_of_a_resumed_session_has_the_lost_samples_of_each_part(
    start: Start, protocol: Protocol, outlets: Collector
) -> None:
    with start() as store:
        store.attach(outlets)
        outlets.lost = {"LSL samples": "12 samples were not sent in time"}
    with reopen(store.folder.path, protocol, SOURCE, operator="AB", device={"name": "scripted"}, screens={}) as again:
        again.attach(Collector())
        again.outlets.lost = {"Serial port": "it was unplugged"}
        again.finish("completed")
    found = receipt.read(store.folder.receipt)
    assert found["outlets_lost"] == {"LSL samples": "12 samples were not sent in time"}
    assert found["resumed"][-1]["outlets_lost"] == {"Serial port": "it was unplugged"}


def test_the_receipt_says_what_was_sent_where(start: Start) -> None:
    sent = {"Serial port": {"address": "serial:/dev/ttyUSB0", "codes": {"trial_started": 10}}}
    with start(outlets=sent) as store:
        assert json.loads(store.folder.receipt.read_text(encoding="utf-8"))["outlets"] == sent
    with start("P008") as store:
        assert "outlets" not in json.loads(store.folder.receipt.read_text(encoding="utf-8"))


def test_a_resumed_session_begins_with_its_resumption(start: Start, protocol: Protocol, outlets: Collector) -> None:
    with start() as store:
        path: Path = store.folder.path
    again = reopen(path, protocol, SOURCE, operator="AB", device={"name": "scripted"}, screens={}, outlets={"a": {}})
    with again:
        again.attach(outlets)
        assert outlets.events == ["session_resumed"]
        assert receipt.read(again.folder.receipt)["resumed"][-1]["outlets"] == {"a": {}}


def test_an_outlet_that_failed_before_a_session_was_resumed_is_lost_no_more(
    start: Start, protocol: Protocol, outlets: Collector
) -> None:
    outlets.lost = {"Serial port": "it was unplugged"}
    with start() as store:
        store.attach(outlets)
        store.write_tables()
        assert progress_of(store.lines).outlets_lost == outlets.lost
        path = store.folder.path
    with reopen(path, protocol, SOURCE, operator="AB", device={"name": "scripted"}, screens={}) as again:
        assert progress_of(again.lines).outlets_lost == {}

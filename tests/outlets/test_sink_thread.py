"""A sink that fails or hangs gets no more markers, and holds up whoever hands one over for no moment."""

from __future__ import annotations

import time

import pytest

from study_app.outlets import sink as module
from study_app.outlets.sink import SinkThread
from tests.outlets.sinks import Sink, marker


def test_markers_are_sent_in_order_and_the_rest_at_the_end() -> None:
    sink = Sink()
    thread = SinkThread(sink)
    given = [marker(trial) for trial in range(1, 50)]
    for one in given:
        thread.mark(one)
    thread.close(5)
    assert sink.sent == given
    assert sink.closed.is_set()
    assert thread.lost == ""
    thread.mark(marker(50))
    assert sink.sent == given


def test_a_failure_is_kept_and_later_markers_are_dropped() -> None:
    sink = Sink(fails_at=2)
    thread = SinkThread(sink)
    for trial in (1, 2, 3):
        thread.mark(marker(trial))
    assert sink.closed.wait(5)
    thread.mark(marker(4))
    assert thread.lost == "test:port failed: it was unplugged"
    assert sink.sent == [marker(1)]
    thread.close(5)


def test_another_exception_ends_the_sink_alone() -> None:
    sink = Sink()
    sink.send = lambda _marker: 1 / 0  # type: ignore[method-assign]
    thread = SinkThread(sink)
    thread.mark(marker())
    assert sink.closed.wait(5)
    assert thread.lost == "ZeroDivisionError: division by zero"


def test_a_sink_that_hangs_is_lost_at_the_next_marker(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "HANGS_S", 0.05)
    sink = Sink(hangs_at=1)
    thread = SinkThread(sink)
    thread.mark(marker(1))
    assert sink.hanging.wait(5)
    time.sleep(0.1)
    assert thread.lost == ""
    thread.mark(marker(2))
    assert thread.lost == "it accepts no more markers"
    sink.go_on.set()
    assert sink.closed.wait(5)
    assert sink.sent == [marker(1)]
    thread.close(5)


def test_a_sink_that_is_idle_for_long_hangs_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "HANGS_S", 0.05)
    sink = Sink()
    thread = SinkThread(sink)
    for trial in (1, 2):
        thread.mark(marker(trial))
        time.sleep(0.1)
    thread.mark(marker(3))
    thread.close(5)
    assert (len(sink.sent), thread.lost) == (3, "")


def test_a_sink_that_hangs_delays_neither_markers_nor_the_end(monkeypatch) -> None:
    monkeypatch.setattr(module, "ROOM", 3)
    sink = Sink(hangs_at=1)
    thread = SinkThread(sink)
    thread.mark(marker(1))
    assert sink.hanging.wait(5)
    for trial in range(2, 7):
        thread.mark(marker(trial))
    assert thread.lost == "it accepts no more markers"
    thread.close(0.01)
    assert not sink.closed.is_set()
    sink.go_on.set()
    assert sink.closed.wait(5)
    assert sink.sent == [marker(1)]

"""A sink that fails or hangs gets no more markers, and holds up whoever hands one over for no moment."""

import threading
from collections.abc import Callable

import pytest

from study_app.outlets import sink as module
from study_app.outlets.sink import HANGS_S, SinkThread
from tests.haptics.running import wait_until
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


class Clock:
    """Stands in for ``monotonic``; `read` is called when a test's own thread reads it."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.read: Callable[[], object] = lambda: None
        self._reader = threading.current_thread()

    def __call__(self) -> float:
        if threading.current_thread() is self._reader:
            self.read()
        return self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Replace the clock of sinks."""
    made = Clock()
    monkeypatch.setattr(module, "monotonic", made)
    return made


def test_a_sink_that_hangs_is_lost_at_the_first_marker_after_the_limit(clock: Clock) -> None:
    sink = Sink(hangs_at=1)
    thread = SinkThread(sink)
    thread.mark(marker(1))
    assert sink.hanging.wait(5)
    clock.now_s += HANGS_S
    thread.mark(marker(2))
    assert thread.lost == ""
    clock.now_s += 0.2
    assert thread.lost == ""
    thread.mark(marker(3))
    assert thread.lost == (
        "a marker was not sent in 5.2 s (limit 5 s): no more are sent; check the connection, "
        "then end and resume the session"
    )
    sink.go_on.set()
    assert sink.closed.wait(5)
    assert sink.sent == [marker(1)]
    thread.close(5)


def test_a_sink_that_is_idle_for_long_hangs_not(clock: Clock) -> None:
    sink = Sink()
    thread = SinkThread(sink)
    for trial in (1, 2, 3):
        thread.mark(marker(trial))
        wait_until(lambda: not thread._waiting and thread._since_s is None)
        clock.now_s += 2 * HANGS_S
    thread.close(5)
    assert (len(sink.sent), thread.lost) == (3, "")


def test_a_marker_may_be_sent_while_the_next_one_is_handed_over(clock: Clock) -> None:
    sink = Sink(hangs_at=1)
    thread = SinkThread(sink)
    thread.mark(marker(1))
    assert sink.hanging.wait(5)

    def finish() -> None:
        sink.go_on.set()
        wait_until(lambda: thread._since_s is None)

    clock.read = finish
    thread.mark(marker(2))
    thread.close(5)
    assert (sink.sent, thread.lost) == ([marker(1), marker(2)], "")


def test_a_sink_that_hangs_delays_neither_markers_nor_the_end(monkeypatch) -> None:
    monkeypatch.setattr(module, "ROOM", 3)
    sink = Sink(hangs_at=1)
    thread = SinkThread(sink)
    thread.mark(marker(1))
    assert sink.hanging.wait(5)
    for trial in range(2, 7):
        thread.mark(marker(trial))
    assert thread.lost.startswith("3 markers wait to be sent (limit): no more are sent; check")
    thread.close(0.01)
    assert not sink.closed.is_set()
    sink.go_on.set()
    assert sink.closed.wait(5)
    assert sink.sent == [marker(1)]

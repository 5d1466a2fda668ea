"""Markers carry codes and counts by a list, and nothing else that an event says."""

import itertools
import json
import platform
import threading
from collections.abc import Callable
from types import SimpleNamespace

import pytest

import study_app
from study_app.outlets import markers as module
from study_app.outlets.markers import CODES, HANGS_S, SinkThread, marker_of
from study_app.outlets.session_outlets import open_sink
from study_app.outlets.streams import ClockMapping, SampleStream
from study_app.store.journals.journal_events import EVENTS
from tests.haptics.running import wait_until
from tests.outlets.sinks import Sink, marker

ORIGIN_NS = 5_000_000_000
TRIAL = {"trial": 3, "attempt": 1, "block": "liquids", "phase": "main", "part": 1, "index": 2, "of": 4, "code": "L2"}


def test_a_marker_states_the_event_its_trial_and_its_time() -> None:
    marker = marker_of("trial_started", 12.3456789, ORIGIN_NS, TRIAL)
    assert marker is not None
    assert marker.time_ns == ORIGIN_NS + 12_345_678_900
    fields = {"trial": 3, "attempt": 1, "block": "liquids", "phase": "main", "code": "L2"}
    assert json.loads(marker.text) == {"event": "trial_started", **fields, "t_s": 12.345679, "trigger": 10}
    assert "\n" not in marker.text


@pytest.mark.parametrize(
    ("event", "fields"),
    [
        (
            "trial_started",
            TRIAL | {"sealed": "gAAAAB", "level": 1.7, "standard": 2, "arrangement": "AB", "catch": True},
        ),
        ("trial_ended", {"trial": 3, "attempt": 1, "outcome": "complete", "force_peak_n": 4.2, "sealed": "gAAAAB"}),
        ("interval_ended", {"trial": 3, "attempt": 1, "interval": 2, "invalid": ["level_error"], "outcome": "timeout"}),
        ("choice", {"trial": 3, "item": "wet", "value": 6}),
        ("note", {"kind": "note", "text": "this must be honey"}),
        ("broke", {"what": "the device 'falcon' stopped"}),
        ("session_started", {"participant": "P007", "seed": 7, "operator": "AK", "limits": {"lateness_ms": 2.0}}),
    ],
)
def test_a_marker_contains_neither_answers_measures_texts_nor_sealed_fields(
    event: str, fields: dict[str, object]
) -> None:
    marker = marker_of(event, 1.0, 0, fields)
    assert marker is not None
    assert set(json.loads(marker.text)) <= {"event", "t_s", "trigger", *TRIAL, "interval", "item"} - {"part", "of"}


def test_codes_are_bytes_of_events_of_the_journal_and_differ() -> None:
    assert set(CODES) <= set(EVENTS)
    assert len(set(CODES.values())) == len(CODES)
    assert all(1 <= code <= 255 for code in CODES.values())
    for event, fields in (("recorded", {"trial": 1}), ("preflight", {"checks": []})):
        assert marker_of(event, 1.0, 0, fields) is None  # it concerns the results folder alone


def test_markers_are_sent_in_order_and_the_rest_at_the_end() -> None:
    sink = Sink()
    thread = SinkThread(sink)
    markers = [marker(trial) for trial in range(1, 50)]
    for sent_marker in markers:
        thread.mark(sent_marker)
    thread.close(5)
    assert sink.sent == markers
    assert sink.closed.is_set()
    assert thread.lost == ""
    thread.mark(marker(50))
    assert sink.sent == markers


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
    mistaken = Sink()
    mistaken.send = lambda _marker: 1 / 0  # type: ignore[method-assign]
    thread = SinkThread(mistaken)
    thread.mark(marker())
    assert mistaken.closed.wait(5)
    assert thread.lost == "ZeroDivisionError: division by zero"


class Clock:
    """A stand-in for ``perf_counter``; `read` is called when the test's thread reads it."""

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
    fake_clock = Clock()
    monkeypatch.setattr(module, "perf_counter", fake_clock)
    return fake_clock


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
        "a marker had still not been sent after 5.2 s (limit 5 s): sending has stopped; check the connection, then "
        "end and "
        "resume the session"
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
        wait_until(lambda: not thread._waiting and thread._send_began_s is None)
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
        wait_until(lambda: thread._send_began_s is None)

    clock.read = finish
    thread.mark(marker(2))
    thread.close(5)
    assert (sink.sent, thread.lost) == ([marker(1), marker(2)], "")


def test_a_sink_that_hangs_delays_neither_markers_nor_the_end(monkeypatch) -> None:
    monkeypatch.setattr(module, "MAX_WAITING", 3)
    sink = Sink(hangs_at=1)
    thread = SinkThread(sink)
    thread.mark(marker(1))
    assert sink.hanging.wait(5)
    for trial in range(2, 7):
        thread.mark(marker(trial))
    assert thread.lost.startswith("the queue of unsent markers is full (3): sending has stopped; check")
    thread.close(0.01)
    assert not sink.closed.is_set()
    sink.go_on.set()
    assert sink.closed.wait(5)
    assert sink.sent == [marker(1)]


class Clocks:
    """Two clocks whose readings take time: each call moves both."""

    def __init__(self, offset_s: float, steps_ns: Callable[[], int]) -> None:
        self.ns, self.offset_s, self._steps_ns = 10**9, offset_s, steps_ns

    def now_ns(self) -> int:
        self.ns += self._steps_ns()
        return self.ns

    def other_s(self) -> float:
        self.ns += self._steps_ns()
        return 1e-9 * self.ns + self.offset_s


def test_the_offset_is_within_its_uncertainty_and_better_with_quick_readings() -> None:
    slow = itertools.cycle((9_000, 400_000, 3_000, 70_000, 2_000, 1_000, 150_000))
    clocks = Clocks(1234.5, lambda: next(slow))
    mapping = ClockMapping(clocks.now_ns, clocks.other_s)
    assert mapping.offset_s == pytest.approx(1234.5, abs=mapping.uncertainty_s)
    assert mapping.uncertainty_s < 20e-6


def test_readings_that_take_long_on_one_side_do_not_bias_beyond_the_bound() -> None:
    turns = itertools.cycle((1_000, 1_000, 5_000_000))  # the other clock is read 1 µs after ours, ours 5 ms after it
    clocks = Clocks(0.0, lambda: next(turns))
    mapping = ClockMapping(clocks.now_ns, clocks.other_s)
    assert abs(mapping.offset_s) <= mapping.uncertainty_s


class Node:
    """An element of a stream's description."""

    def __init__(self) -> None:
        self.children: list[tuple[str, object]] = []

    def append_child_value(self, name: str, value: str) -> None:
        self.children.append((name, value))

    def append_child(self, name: str) -> "Node":
        child = Node()
        self.children.append((name, child.children))
        return child


class Library:
    """A stand-in for pylsl that keeps stream descriptions and pushed samples; its clock reads 50 s."""

    def __init__(self) -> None:
        self.created: list[tuple[object, ...]] = []
        self.nodes: list[Node] = []
        self.pushed: list[tuple[object, ...]] = []
        self.consumers = False

    def local_clock(self) -> float:
        return 50.0

    def StreamInfo(self, *properties: object) -> SimpleNamespace:  # noqa: N802 - pylsl's name
        self.created.append(properties)
        self.nodes.append(node := Node())
        return SimpleNamespace(desc=lambda: node)

    def StreamOutlet(self, _info: object) -> SimpleNamespace:  # noqa: N802 - pylsl's name
        return SimpleNamespace(
            push_sample=lambda *sample: self.pushed.append(sample), have_consumers=lambda: self.consumers
        )


def test_both_streams_describe_their_content_and_map_times_to_the_librarys_clock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The servo's clock reads 0, 4, 8, … 60 µs at the start, so the last of 8 readings of 50 s was at 58 ± 2 µs."""
    library = Library()
    for user in ("streams", "sinks"):
        monkeypatch.setattr(f"study_app.outlets.{user}.import_pylsl", lambda: library)
    empty = SimpleNamespace(read=lambda: (), dropped=0)
    telemetry = SimpleNamespace(reader=lambda: empty)
    samples = SampleStream(telemetry, 1234.0, itertools.count(0, 4000).__next__)
    sink = open_sink("lsl", itertools.count(0, 4000).__next__)
    assert samples.described == {"stream": "liquid-study samples", "clock_uncertainty_us": 2.0}
    assert sink.described == {"stream": "liquid-study markers", "clock_uncertainty_us": 2.0}
    computer = platform.node()
    assert library.created == [
        ("liquid-study samples", "Haptics", 11, 1234.0, "float32", f"liquid-study samples of {computer}"),
        ("liquid-study markers", "Markers", 1, 0.0, "string", f"liquid-study markers of {computer}"),
    ]
    units = {"position": "m", "velocity": "m/s", "force": "N"}
    measured = [[("label", f"{name}_{axis}"), ("unit", unit)] for name, unit in units.items() for axis in "xyz"]
    head = [("manufacturer", "liquid-study"), ("version", study_app.__version__)]
    labels = [*measured, [("label", "limiters")], [("label", "tick")]]
    assert library.nodes[0].children == [*head, ("channels", [("channel", label) for label in labels])]
    assert library.nodes[1].children == [
        *head,
        ("channels", [("channel", [("label", "marker")])]),
        ("triggers", [(event, str(code)) for event, code in CODES.items()]),
    ]
    sink.send(marker(3, time_s=2.0))
    assert library.pushed == [([marker(3, time_s=2.0).text], pytest.approx(2 + 50 - 58e-6, abs=1e-9))]
    for consumers in (True, False):
        library.consumers = consumers
        assert (samples.listens, sink.listens) == (consumers, consumers)
    sink.close()
    samples.close()
    assert (samples.listens, sink.listens, samples.lost) == (False, False, "")


def test_it_is_measured_again_when_it_is_due(monkeypatch: pytest.MonkeyPatch) -> None:
    clocks = Clocks(2.0, lambda: 1_000)
    mapping = ClockMapping(clocks.now_ns, clocks.other_s)
    clocks.offset_s = 3.0
    mapping.measure_if_due()
    assert mapping.offset_s == pytest.approx(2.0, abs=1e-5)
    monkeypatch.setattr("study_app.outlets.streams.time.perf_counter", lambda: float("inf"))
    mapping.measure_if_due()
    assert mapping.offset_s == pytest.approx(3.0, abs=mapping.uncertainty_s)
    assert mapping.uncertainty_s < 2e-6

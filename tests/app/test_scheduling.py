"""Scheduling: work between frames, garbage collection in the windows' thread only, and its priority."""

import gc
import os
import sys
import threading
from collections.abc import Iterator
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.app import timing
from study_app.app.timing import (
    MOST_PERIODS,
    MOST_SHARE,
    FrameBudget,
    ThreadPriority,
    collecting_in_this_thread,
    freeze_garbage,
    unfreeze_garbage,
)
from study_app.haptics.runtime import clocks

MS = 1_000_000


class Frame:
    """A manual clock, and tasks with given durations."""

    def __init__(self, **works_ms: tuple[int, int]) -> None:
        """Take name = (how often, how long it takes) [ms]."""
        self.now_ns = 0
        self.done: list[tuple[str, int]] = []
        self.takes_ms = {name: takes for name, (_, takes) in works_ms.items()}
        works = [(lambda name=name: self.do(name), every / 1000) for name, (every, _) in works_ms.items()]
        self.slack = FrameBudget(works, lambda: self.now_ns)

    def do(self, name: str) -> None:
        self.done.append((name, self.now_ns // MS))
        self.now_ns += self.takes_ms[name] * MS

    def run(self, frames: int, every_ms: int, tank_ms: int = 2) -> list[float]:
        """Paint frames of a given duration; return how far tasks ran past the next frame [ms]."""
        past = []
        start_ns = self.now_ns
        for number in range(frames):
            due_ns = start_ns + number * every_ms * MS
            self.now_ns = max(self.now_ns, due_ns) + tank_ms * MS
            self.slack.run_due_tasks(due_ns + every_ms * MS)
            past.append(max(0, self.now_ns - due_ns - every_ms * MS) / MS)
        return past

    def times(self, name: str) -> list[int]:
        return [at for task, at in self.done if task == name]


def test_works_are_done_as_often_as_asked_where_there_is_room_and_else_wait_their_turn() -> None:
    frame = Frame(plot=(30, 2), table=(500, 1))
    assert max(frame.run(120, 16)) == 0
    assert (len(frame.times("plot")), len(frame.times("table"))) == (60, 4)
    frame = Frame(plot=(30, 1))
    frame.run(9, 15)
    assert frame.times("plot") == [2, 32, 62, 92, 122], "as soon as its period is over"
    frame = Frame(one=(30, 3), other=(30, 3))
    assert max(frame.run(100, 7)[2:]) == 0, "how long they take is known after the first time"
    frames = [at // 7 for _, at in frame.done[2:]]
    assert len(frames) == len(set(frames))
    assert min(len(frame.times(name)) for name in ("one", "other")) >= 18


def test_work_that_never_fits_is_done_in_single_steps_within_its_share() -> None:
    frame = Frame(slow=(30, 9))
    frame.run(400, 7)
    assert (
        max(late - early for early, late in pairwise(frame.times("slow"))) <= (MOST_PERIODS + 1) * 30 + 9 / MOST_SHARE
    )
    assert 9 * len(frame.done) <= 1.1 * MOST_SHARE * 400 * 7
    gaps = [late - early for early, late in pairwise(frame.times("slow"))]
    assert min(gaps[1:]) >= 9 / MOST_SHARE + MOST_PERIODS * 30
    frame = Frame(one=(30, 9), other=(30, 9))
    assert max(frame.run(400, 7)[2:]) <= 9
    assert min(len(frame.times(name)) for name in ("one", "other")) > 10


def test_a_work_that_took_long_once_comes_back_to_its_pace() -> None:
    frame = Frame(plot=(30, 40))
    frame.run(10, 16)
    frame.takes_ms["plot"] = 1
    frame.run(600, 16)
    assert max(late - early for early, late in pairwise(frame.times("plot")[-10:])) == 32


@pytest.fixture
def automatic_collection(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Collect as the interpreter does; the other tests collect between tests alone.

    What those left goes first: while another thread frees it, nobody else can collect. However much it is, it is less
    than the bound. What is left of other tests is looked at once only, not in each collection.
    """
    monkeypatch.setattr(timing, "MOST_FROZEN", 10**9)
    gc.collect()
    gc.freeze()
    gc.enable()
    yield
    gc.disable()
    gc.freeze()


class Cycle:
    """An object that only the collector can free, and that remembers which thread freed it."""

    def __init__(self, freed_in: list[int]) -> None:
        self.itself, self.freed_in = self, freed_in

    def __del__(self) -> None:
        self.freed_in.append(threading.get_ident())


def allocate_elsewhere() -> list[list[int]]:
    """Let another thread allocate enough objects for a collection; return them."""
    kept: list[list[int]] = []
    worker = threading.Thread(target=lambda: kept.extend([] for _ in range(20_000)))
    worker.start()
    worker.join()
    return kept


@pytest.mark.parametrize("before", [True, False])
def test_the_interpreter_collects_again_afterwards_if_it_did_before(qtbot: Any, *, before: bool) -> None:
    (gc.enable if before else gc.disable)()
    try:
        with collecting_in_this_thread():
            assert not gc.isenabled()
        assert gc.isenabled() == before
    finally:
        gc.disable()


@pytest.mark.slow
@pytest.mark.usefixtures("automatic_collection")
def test_no_other_thread_frees_objects_of_windows(qtbot: Any) -> None:
    open_, closed = [], []
    with collecting_in_this_thread():
        Cycle(open_)
        kept = allocate_elsewhere()
        assert open_ == []
        qtbot.waitUntil(lambda: bool(open_))
        Cycle(closed)
    allocate_elsewhere()
    assert open_ == closed == [threading.get_ident()]
    assert len(kept) == 20_000


@pytest.mark.slow
@pytest.mark.usefixtures("automatic_collection")
def test_frozen_objects_are_not_collected_until_unfrozen() -> None:
    freed_in: list[int] = []
    Cycle(freed_in)
    freeze_garbage()
    try:
        assert freed_in, "what nobody holds goes first"
        held = Cycle(freed_in)
        freeze_garbage()
        del held
        gc.collect()
        assert len(freed_in) == 1
        Cycle(freed_in)
        gc.collect()
        assert len(freed_in) == 2, "what came since is looked at"
    finally:
        unfreeze_garbage()
    gc.collect()
    assert len(freed_in) == 3


class Collector:
    """A replacement of the ``gc`` module with given counts, which records its calls."""

    def __init__(self, counts: tuple[int, ...] = (0, 0, 0), thresholds: tuple[int, ...] = (700, 10, 10)) -> None:
        self.counts, self.thresholds, self.frozen = counts, thresholds, 0
        self.enabled = True
        self.asked: list[Any] = []

    def get_count(self) -> tuple[int, ...]:
        return self.counts

    def get_threshold(self) -> tuple[int, ...]:
        return self.thresholds

    def get_freeze_count(self) -> int:
        return self.frozen

    def isenabled(self) -> bool:
        return self.enabled

    def collect(self, generation: int | None = None) -> None:
        self.asked.append(generation)

    def __getattr__(self, name: str) -> Any:
        return lambda: self.asked.append(name)


@pytest.fixture
def collector(monkeypatch: pytest.MonkeyPatch) -> Iterator[Collector]:
    fake_collector = Collector()
    monkeypatch.setattr(timing, "gc", fake_collector)
    yield fake_collector
    unfreeze_garbage()


@pytest.mark.parametrize(
    ("counts", "thresholds", "oldest"),
    [
        ((700, 10, 10), (700, 10, 10), None), ((701, 10, 10), (700, 10, 10), 0), ((701, 11, 2), (700, 10, 10), 1),
        ((3, 2, 11), (700, 10, 10), 2), ((701, 11, 11), (700, 10, 10), 2), ((701, 2, 50), (700, 10, 0), 0),
        ((5, 2, 50), (700, 10, 0), None),
    ],
)  # fmt: skip
def test_the_oldest_generation_that_is_due_is_collected(
    collector: Collector, counts: tuple[int, ...], thresholds: tuple[int, ...], oldest: int | None
) -> None:
    collector.counts, collector.thresholds = counts, thresholds
    assert timing.collect_if_due() == oldest
    assert collector.asked == ([] if oldest is None else [oldest])


@pytest.mark.parametrize(
    ("counts", "took_s", "frozen", "in_session", "expected"),
    [
        ((0, 0, 11), 0.021, 400_000, False, [2, "freeze"]),
        ((0, 0, 11), 0.021, 500_001, False, [2, "freeze", "unfreeze"]),
        ((0, 0, 11), 0.021, 500_001, True, [2, "freeze"]),
        ((0, 0, 11), 0.019, 500_001, False, [2]),
        ((0, 11, 0), 0.021, 500_001, False, [1]),
    ],
)
def test_objects_of_a_long_collection_are_frozen_unless_there_are_too_many(
    collector: Collector, monkeypatch: pytest.MonkeyPatch, counts: Any, took_s: float, frozen: int,
    in_session: bool, expected: list[Any],
) -> None:  # fmt: skip
    now_s = iter([5.0, 5.0 + took_s])
    monkeypatch.setattr(timing, "time", SimpleNamespace(thread_time=lambda: next(now_s)))
    collector.counts, collector.frozen = counts, frozen
    if in_session:
        freeze_garbage()
        assert collector.asked == [timing.YOUNG, "freeze"]
        collector.asked.clear()
    timing._collect()
    assert collector.asked == expected


@pytest.mark.slow
@pytest.mark.parametrize(("enabled", "at_the_end"), [(True, [None, "enable"]), (False, [])])
def test_this_thread_collects_until_the_windows_are_closed(
    qtbot: Any, collector: Collector, enabled: bool, at_the_end: list[Any]
) -> None:
    collector.enabled, collector.counts = enabled, (701, 0, 0)
    with collecting_in_this_thread():
        assert collector.asked == ["disable"]
        qtbot.waitUntil(lambda: collector.asked == ["disable", 0, 0])
        collector.counts = (0, 0, 0)
    assert collector.asked[3:] == ["unfreeze", *at_the_end]
    collector.asked.clear()
    with collecting_in_this_thread():
        timing.disable_collection()
    assert collector.asked == ["disable", "unfreeze", *at_the_end[1:]]
    collector.counts = (701, 0, 0)
    qtbot.wait(250)
    assert 0 not in collector.asked[3:], "its timer has stopped"


def test_windows_and_macos_have_levels_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    levels: list[tuple[Any, int]] = []

    def set_priority(thread: Any, level: int) -> int:
        levels.append((thread.value, level))
        return 1

    current = type("Call", (), {"__call__": lambda _self: 77})()
    kernel = SimpleNamespace(GetCurrentThread=current, SetThreadPriority=set_priority)
    priority = ThreadPriority()
    monkeypatch.setattr(timing, "sys", SimpleNamespace(platform="win32"))
    monkeypatch.setattr(timing, "ctypes", SimpleNamespace(c_void_p=lambda value: SimpleNamespace(value=value)))
    assert priority.raise_priority() is False
    monkeypatch.setattr(timing.ctypes, "windll", SimpleNamespace(kernel32=kernel), raising=False)
    assert priority.raise_priority() is True
    priority.restore()
    assert levels == [(77, timing.ABOVE_NORMAL), (77, timing.NORMAL)]
    monkeypatch.setattr(timing, "sys", SimpleNamespace(platform="darwin"))
    assert priority.raise_priority() is True
    priority.restore()
    assert len(levels) == 2


def level() -> int:
    return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())


@pytest.mark.skipif(sys.platform != "linux", reason="levels of Linux")
@pytest.mark.parametrize("granted_by", ["the system", "the desktop's service", "nobody"])
def test_the_windows_thread_goes_before_other_programs_where_that_is_granted(
    granted_by: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept, requests = level(), []
    if kept < 0:
        pytest.skip("this thread goes before others already")

    def refuse(*_given: object) -> None:
        raise PermissionError

    priority = ThreadPriority()
    if granted_by == "the system":
        if not priority.raise_priority():
            pytest.skip("this user may not")
        assert level() == timing.NICE
    else:
        monkeypatch.setattr(os, "setpriority", refuse)
        grant = refuse if granted_by == "nobody" else lambda *arguments: requests.append(arguments)
        monkeypatch.setattr(clocks, "make_high_priority", grant)
        assert priority.raise_priority() == (granted_by != "nobody")
        assert requests == ([] if granted_by == "nobody" else [(threading.get_native_id(), timing.NICE)])
        monkeypatch.undo()
    for _ in range(2):
        priority.restore()
        assert level() == kept

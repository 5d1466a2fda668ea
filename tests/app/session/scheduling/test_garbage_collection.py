"""Where cyclic garbage is collected."""

import gc
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtCore import QObject

from study_app.app.session import garbage_collection
from study_app.app.session.garbage_collection import (
    OLDEST,
    PERIOD_MS,
    collect_if_due,
    collecting_here,
    freeze_garbage,
    unfreeze_garbage,
)

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def automatic_collection(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Collect as the interpreter does; the other tests collect between tests alone.

    What those left goes first: while another thread frees it, nobody else can collect. However much it is, it is less
    than the bound. What is left of other tests is looked at once only, not in each collection.
    """
    monkeypatch.setattr(garbage_collection, "MOST_FROZEN", 10**9)
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
    """Let another thread make objects enough for a collection to be due; return them."""
    kept: list[list[int]] = []
    worker = threading.Thread(target=lambda: kept.extend([] for _ in range(20_000)))
    worker.start()
    worker.join()
    return kept


def test_a_thread_that_allocates_frees_nothing_of_the_windows(qtbot: Any) -> None:
    freed_in: list[int] = []
    with collecting_here():
        Cycle(freed_in)
        kept = allocate_elsewhere()
        assert freed_in == []
        qtbot.waitUntil(lambda: bool(freed_in))
    assert freed_in == [threading.get_ident()]
    assert len(kept) == 20_000


def test_garbage_of_closed_windows_is_freed_before_another_thread_may(qapp: QObject) -> None:
    freed_in: list[int] = []
    with collecting_here():
        Cycle(freed_in)
    allocate_elsewhere()
    assert freed_in == [threading.get_ident()]


def test_collection_is_as_it_was_afterwards(qapp: QObject) -> None:
    with collecting_here():
        assert not gc.isenabled()
    assert gc.isenabled()


def test_nothing_is_collected_before_it_is_due() -> None:
    gc.disable()
    gc.collect()
    assert collect_if_due() is None
    kept = [[] for _ in range(5_000)]
    assert collect_if_due() == 0
    assert len(kept) == 5_000


def test_what_has_settled_is_looked_at_no_more_until_it_is_again() -> None:
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


@pytest.mark.nightly
def test_what_made_a_collection_take_long_is_passed_over_until_a_session_has_ended(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(garbage_collection, "LONG_S", -1.0)
    monkeypatch.setattr(garbage_collection, "collect_if_due", lambda: OLDEST)
    freed_in: list[int] = []
    held = [Cycle(freed_in)]
    with collecting_here():
        qtbot.wait(2 * PERIOD_MS + 100)
        held.clear()
        gc.collect()
        assert freed_in == []
        unfreeze_garbage()
        gc.collect()
        assert freed_in == [threading.get_ident()]
        held.append(Cycle(freed_in))
        qtbot.wait(2 * PERIOD_MS + 100)
        held.clear()
    gc.collect()
    assert len(freed_in) == 2, "where no windows are open all is looked at"


def test_what_is_passed_over_is_bounded_between_sessions_alone(qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(garbage_collection, "PERIOD_MS", 5)
    monkeypatch.setattr(garbage_collection, "LONG_S", -1.0)
    monkeypatch.setattr(garbage_collection, "collect_if_due", lambda: OLDEST)
    unfreeze_garbage()
    with collecting_here():
        qtbot.waitUntil(lambda: gc.get_freeze_count() > 0)
        count = gc.get_freeze_count()
        monkeypatch.setattr(garbage_collection, "MOST_FROZEN", count // 2)
        freeze_garbage()
        qtbot.wait(50)
        assert gc.get_freeze_count() > count // 2, "no collection of everything while a session runs"
        unfreeze_garbage()
        qtbot.wait(50)
        assert gc.get_freeze_count() == 0

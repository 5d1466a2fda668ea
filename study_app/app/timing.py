"""Timeliness of frames: deferred tasks, garbage collection in one thread, and the thread's priority."""

import ctypes
import gc
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from PySide6.QtCore import QTimer

MOST_PERIODS: Final = 4  # maximum wait of a task for free time, in periods
MOST_SHARE: Final = 0.15  # maximum fraction of the time that a task may use; slower tasks run less often
_DECAY: Final = 0.9  # decay of a task's longest duration per run


@dataclass(slots=True, kw_only=True)
class _DeferredTask:
    """A recurring task; ``took_ns`` is its longest recent duration."""

    do: Callable[[], object]
    period_ns: int
    done_ns: int | None = None
    took_ns: int = 0

    def overdue_ns(self, now_ns: int) -> int:
        """Return the time since the task was due [ns]; negative before."""
        if self.done_ns is None:
            return self.period_ns
        return now_ns - self.done_ns - max(self.period_ns, round(self.took_ns / MOST_SHARE))


class FrameBudget:
    """Runs recurring tasks when they are due and time permits.

    Parameters
    ----------
    tasks : the tasks with their periods [s], the most urgent first
    """

    def __init__(
        self, tasks: Sequence[tuple[Callable[[], object], float]], now_ns: Callable[[], int] = time.perf_counter_ns
    ) -> None:
        self.tasks = [_DeferredTask(do=do, period_ns=round(period_s * 1e9)) for do, period_s in tasks]
        self._now_ns = now_ns

    def run_due_tasks(self, until_ns: int) -> None:
        """Run due tasks that will probably end by ``until_ns``, and at most one other that is long overdue."""
        has_run_overdue = False
        for task in self.tasks:
            now_ns = self._now_ns()
            waited_ns = task.overdue_ns(now_ns)
            if waited_ns < 0:
                continue
            if now_ns + task.took_ns > until_ns:
                if has_run_overdue or waited_ns < MOST_PERIODS * task.period_ns:
                    continue
                has_run_overdue = True
            self._run_task(task, now_ns)

    def _run_task(self, task: _DeferredTask, started_ns: int) -> None:
        task.done_ns = started_ns
        task.do()
        task.took_ns = max(self._now_ns() - started_ns, round(_DECAY * task.took_ns))


_PERIOD_MS = 200
YOUNG, OLDEST = 1, 2  # generations; only the young one is collected quickly
_LONG_S = 0.02
MOST_FROZEN = 500_000  # objects; the program's modules have 170 000
_session_runs = threading.Event()


def collect_if_due() -> int | None:
    """Collect the oldest generation that is due according to the interpreter's thresholds; return it, or None."""
    due = [count > limit > 0 for count, limit in zip(gc.get_count(), gc.get_threshold(), strict=True)]
    if not any(due):
        return None
    oldest = max(generation for generation, is_due in enumerate(due) if is_due)
    gc.collect(oldest)
    return oldest


def _collect() -> None:
    """Collect what is due. After a long full collection freeze all objects, or unfreeze them if there are too many."""
    began_s = time.thread_time()
    if collect_if_due() == OLDEST and time.thread_time() - began_s > _LONG_S:
        gc.freeze()
        if not _session_runs.is_set() and gc.get_freeze_count() > MOST_FROZEN:
            gc.unfreeze()


def freeze_garbage() -> None:
    """Exclude all current objects from collection until `unfreeze_garbage`, after collecting the youngest ones.

    Collecting all objects of a session takes as long as several frames; collecting only later ones takes hardly any
    time.
    """
    _session_runs.set()
    gc.collect(YOUNG)
    gc.freeze()


def unfreeze_garbage() -> None:
    """Include all objects in later collections again."""
    _session_runs.clear()
    gc.unfreeze()


_collection_disabled = threading.Event()


def disable_collection() -> None:
    """Disable the collection at the end of the program, which takes seconds under load."""
    _collection_disabled.set()


@contextmanager
def collecting_in_this_thread() -> Iterator[None]:
    """Run collections only in this thread, which runs Qt's event loop."""
    was_enabled = gc.isenabled()
    _collection_disabled.clear()
    gc.disable()
    timer = QTimer()
    timer.timeout.connect(_collect)
    timer.start(_PERIOD_MS)
    try:
        yield
    finally:
        timer.stop()
        unfreeze_garbage()
        if was_enabled:
            if not _collection_disabled.is_set():
                gc.collect()
            gc.enable()


NICE: Final = -10
ABOVE_NORMAL, NORMAL = 1, 0  # thread priorities on Windows


class ThreadPriority:
    """Raises the priority of the calling thread, and restores it."""

    def __init__(self) -> None:
        self._previous: int | None = None

    def raise_priority(self) -> bool:
        """Raise this thread's priority above other programs'; return whether the system permitted it."""
        if sys.platform == "win32":
            return _set_windows_priority(ABOVE_NORMAL)
        if sys.platform == "darwin":
            return True  # the GUI thread already has interactive priority
        thread = threading.get_native_id()
        previous = os.getpriority(os.PRIO_PROCESS, thread)
        try:
            os.setpriority(os.PRIO_PROCESS, thread, NICE)
        except PermissionError:
            from study_app.haptics.runtime.clocks import make_high_priority  # noqa: PLC0415 - a session has imported the compiler

            try:
                make_high_priority(thread, NICE)
            except OSError:
                return False
        self._previous = previous
        return True

    def restore(self) -> None:
        if sys.platform == "win32":
            _set_windows_priority(NORMAL)
        elif sys.platform != "darwin" and self._previous is not None:
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), self._previous)
            self._previous = None


def _set_windows_priority(level: int) -> bool:
    """Set the priority of this thread on Windows."""
    windows = getattr(ctypes, "windll", None)
    if windows is None:
        return False
    kernel = windows.kernel32
    kernel.GetCurrentThread.restype = ctypes.c_void_p
    return bool(kernel.SetThreadPriority(ctypes.c_void_p(kernel.GetCurrentThread()), level))

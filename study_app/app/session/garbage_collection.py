"""Cyclic garbage is collected in the windows' thread alone.

Python collects in whichever thread allocates. A widget caught in a cycle would then be destroyed outside Qt's thread,
by the one that opens a device or writes a recording, and the program would crash. While windows are open automatic
collection is therefore off, and a timer of their own thread collects as often as it would have.

A collection of everything takes as long as ten frames. Collections therefore pass over (``gc.freeze``) what a thread
has loaded, all there was when a session began, until its end, and what made a collection of everything take long, until
the next session has ended, or was cancelled. Between sessions, objects that were passed over and became garbage since
are bounded: beyond ``MOST_FROZEN`` objects, the next collection looks at everything.
"""

import gc
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from PySide6.QtCore import QTimer

PERIOD_MS = 200
YOUNG, OLDEST = 1, 2  # generations; collecting up to the first takes no time
LONG_S = 0.02
MOST_FROZEN = 500_000  # objects; the modules of home, designer, lab and session have 170 000
_session_runs = threading.Event()


def collect_if_due() -> int | None:
    """Collect the oldest generation that is due by the interpreter's own thresholds; return it, or None."""
    due = [count > limit > 0 for count, limit in zip(gc.get_count(), gc.get_threshold(), strict=True)]
    if not any(due):
        return None
    oldest = max(generation for generation, is_due in enumerate(due) if is_due)
    gc.collect(oldest)
    return oldest


def _collect() -> None:
    """Collect what is due; pass over all there is once that took long, up to a bound between sessions."""
    began_s = time.thread_time()
    if collect_if_due() == OLDEST and time.thread_time() - began_s > LONG_S:
        gc.freeze()
        if not _session_runs.is_set() and gc.get_freeze_count() > MOST_FROZEN:
            gc.unfreeze()


def freeze_garbage() -> None:
    """Skip all present objects until `unfreeze_garbage`, after collecting the youngest garbage.

    A collection of all objects of a session takes as long as several frames; one of later objects hardly any time.
    """
    _session_runs.set()
    gc.collect(YOUNG)
    gc.freeze()


def unfreeze_garbage() -> None:
    """Look at everything again when a collection is due."""
    _session_runs.clear()
    gc.unfreeze()


@contextmanager
def collecting_here() -> Iterator[None]:
    """Collect in this thread, which runs Qt's event loop, and in no other."""
    before = gc.isenabled()
    gc.disable()
    timer = QTimer()
    timer.timeout.connect(_collect)
    timer.start(PERIOD_MS)
    try:
        yield
    finally:
        timer.stop()
        unfreeze_garbage()
        if before:
            gc.collect()
            gc.enable()

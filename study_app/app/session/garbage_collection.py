"""Cyclic garbage is collected in the windows' thread alone.

Python collects in whichever thread allocates. A widget caught in a cycle would then be destroyed outside Qt's thread,
by the one that opens a device or writes a recording, and the program would crash. While windows are open automatic
collection is therefore off, and a timer of their own thread collects as often as it would have.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

from PySide6.QtCore import QTimer

PERIOD_MS = 200
YOUNG = 1  # the older of the two generations that take no time to collect


def collect_if_due() -> int | None:
    """Collect the oldest generation that is due by the interpreter's own thresholds; return it, or None."""
    due = [count > limit > 0 for count, limit in zip(gc.get_count(), gc.get_threshold(), strict=True)]
    if not any(due):
        return None
    oldest = max(generation for generation, is_due in enumerate(due) if is_due)
    gc.collect(oldest)
    return oldest


def freeze_garbage() -> None:
    """Skip all there is until `unfreeze_garbage`, but for what came last and is garbage already.

    A collection of all that a session is made of takes as long as several frames; of what comes later, next to nothing.
    """
    gc.collect(YOUNG)
    gc.freeze()


def unfreeze_garbage() -> None:
    """Look at everything again when a collection is due."""
    gc.unfreeze()


@contextmanager
def collecting_here() -> Iterator[None]:
    """Collect in this thread, which runs Qt's event loop, and in no other."""
    before = gc.isenabled()
    gc.disable()
    timer = QTimer()
    timer.timeout.connect(collect_if_due)
    timer.start(PERIOD_MS)
    try:
        yield
    finally:
        timer.stop()
        if before:
            gc.collect()
            gc.enable()

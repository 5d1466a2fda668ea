"""Time for the servo: monotonic nanoseconds and a sleep to an absolute deadline, as C functions.

``SystemClock`` is the machine's own clock, ``VirtualClock`` a number that a sleep sets forward, so that the same loop
runs as fast as it computes. Both have what the loop takes: ``now``, ``sleep`` (see ``cfunctions``) and ``context``.
"""

from __future__ import annotations

import sys
from functools import cache
from typing import Any, Protocol

import numpy as np

from study_app.haptics.cfunctions import NOW, SLEEP, c_function, record_at
from study_app.haptics.layout import records

if sys.platform == "win32":
    from study_app.haptics import clock_windows as platform
elif sys.platform == "darwin":
    from study_app.haptics import clock_macos as platform
else:
    from study_app.haptics import clock_linux as platform

VIRTUAL = np.dtype([("now_ns", np.int64)], align=True)
_virtual_at = record_at(VIRTUAL)


class Clock(Protocol):
    """What the servo asks of a clock.

    ``now`` and ``sleep`` are C functions, ``context`` is the address of the clock's own memory, handed to both, and
    ``runs`` tells whether time passes by itself.
    """

    now: Any
    sleep: Any
    context: int
    runs: bool

    def now_ns(self) -> int:
        """Return the time [ns]."""
        ...


class SystemClock:
    """The monotonic clock of the machine, whose origin is the machine's own (often its start)."""

    runs = True

    def __init__(self) -> None:
        self._memory = platform.open_clock()
        self.now, self.sleep = _system_functions()
        self.context = int(self._memory.ctypes.data)

    def now_ns(self) -> int:
        """Return the time [ns]."""
        return int(self.now.ctypes(self.context))


class VirtualClock:
    """A clock that stands still but for sleeps: each sets it to its deadline at once."""

    runs = False

    def __init__(self, start_ns: int = 0) -> None:
        self._memory = records(VIRTUAL, 1)
        self._memory[0].now_ns = start_ns
        self.now, self.sleep = _virtual_functions()
        self.context = int(self._memory.ctypes.data)

    def now_ns(self) -> int:
        """Return the time [ns]."""
        return int(self._memory[0].now_ns)


def raise_priority() -> str:
    """Ask the system to run the calling thread before others; return in words what it granted."""
    return platform.raise_priority()


@cache
def _system_functions() -> tuple[Any, Any]:
    return c_function(NOW, platform.now), c_function(SLEEP, platform.sleep)


@cache
def _virtual_functions() -> tuple[Any, Any]:
    return c_function(NOW, _virtual_now), c_function(SLEEP, _virtual_sleep)


def _virtual_now(context: int) -> Any:
    return _virtual_at(context).now_ns


def _virtual_sleep(context: int, deadline_ns: int) -> Any:
    clock = _virtual_at(context)
    clock.now_ns = max(clock.now_ns, deadline_ns)
    return clock.now_ns

"""Time for the servo: monotonic nanoseconds and a sleep to an absolute deadline, as C functions.

``SystemClock`` is the machine's clock, ``VirtualClock`` a number that a sleep advances, so that the same loop runs as
fast as it computes. Both have the interface of the loop: ``now``, ``sleep`` (see ``c_functions``) and ``context``.
"""

import sys
import time
from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from study_app.errors import StudyError
from study_app.haptics.kernels.c_functions import NOW, SLEEP, c_function, call_at, record_at
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.layout import records
from study_app.haptics.runtime.grants import Blocks, Grant

if sys.platform == "win32":
    from study_app.haptics.runtime.clocks import windows as platform
elif sys.platform == "darwin":
    from study_app.haptics.runtime.clocks import macos as platform
else:
    from study_app.haptics.runtime.clocks import linux as platform

_MOST_SPIN_US = 1000.0
VIRTUAL = np.dtype([("now_ns", np.int64)], align=True)
_virtual_at = record_at(VIRTUAL)
_sleep = call_at(SLEEP)


class Clock(Protocol):
    """The interface of a clock for the servo.

    ``now`` and ``sleep`` are C functions, ``context`` is the address of the clock's memory, passed to both, and
    ``runs`` tells whether time passes by itself.
    """

    now: Any
    sleep: Any
    context: int
    runs: bool

    def now_ns(self) -> int: ...

    def suspended_ns(self) -> int:
        """Return how long this clock stopped during suspensions of the machine since its start [ns]."""


class SystemClock:
    """The monotonic clock of the machine, whose origin is the machine's own (often its start).

    Parameters
    ----------
    spin_us : float, optional
        Time before a deadline at which a sleep ends, to poll the clock until the deadline [µs]; by default as this
        system's timer needs. It takes up to ``spin_us`` of a core's time every period, which `spun_ns` counts.

    Raises
    ------
    StudyError
        The spin is below 0 or above 1000 µs.
    """

    runs = True

    def __init__(self, spin_us: float | None = None) -> None:
        self.spin_us = platform.SPIN_US if spin_us is None else spin_us
        if not 0.0 <= self.spin_us <= _MOST_SPIN_US:
            raise StudyError(f"a spin before a deadline must last from 0 to {_MOST_SPIN_US:g} µs, not {spin_us:g}")
        self.memory = platform.open_clock(round(1000 * self.spin_us))
        self.now, self.sleep = _system_functions()
        self.context = int(self.memory.ctypes.data)

    def now_ns(self) -> int:
        return int(self.now.ctypes(self.context))

    def suspended_ns(self) -> int:
        """Return how long the machine was suspended since its start [ns], with a small error upward.

        The loop sleeps on CLOCK_MONOTONIC of Linux and ``mach_absolute_time`` of macOS, which stop during a suspension:
        no tick is late after it. CLOCK_BOOTTIME and ``mach_continuous_time`` continue, so the difference is the
        suspension. The counter of Windows continues: there a suspension is a late tick, and this is 0.
        """
        if sys.platform == "linux":
            return _ahead_ns(time.CLOCK_BOOTTIME, time.CLOCK_MONOTONIC)
        elif sys.platform == "darwin":
            return _ahead_ns(time.CLOCK_MONOTONIC_RAW, time.CLOCK_UPTIME_RAW)
        else:
            return 0

    @property
    def spun_ns(self) -> int:
        """The total time in which sleeps polled the clock [ns]."""
        return int(self.memory[0].spun_ns)


class VirtualClock:
    """A clock that advances only by sleeps: each sets it to its deadline at once.

    ``suspension_ns`` is the simulated duration of suspensions.
    """

    runs = False

    def __init__(self, start_ns: int = 0) -> None:
        self.suspension_ns = 0
        self.memory = records(VIRTUAL, 1)
        self.memory[0].now_ns = start_ns
        self._now_ns = self.memory.view(np.ndarray)["now_ns"]  # access to a field of a record takes ten times as long
        self.now, self.sleep = _virtual_functions()
        self.context = int(self.memory.ctypes.data)

    def now_ns(self) -> int:
        return int(self._now_ns[0])

    def suspended_ns(self) -> int:
        """Return ``suspension_ns``."""
        return self.suspension_ns


def raise_priority(blocks: Blocks = (), *, real_time: bool = True) -> Grant:
    """Ask the system for a higher priority of the calling thread and for locked memory; return what it granted.

    Parameters
    ----------
    blocks : Blocks
        The thread's memory; if empty, none is locked.
    real_time : bool
        False: keep the ordinary priority; timers are still exact.
    """
    grant = platform.raise_priority(real_time=real_time)
    if not (blocks and real_time):
        return grant
    return grant.with_memory(locked=platform.lock_memory(blocks), advice=platform.MEMORY)


def sleep_repeatedly(clock: Clock, period_ns: int, ticks: int) -> NDArray[np.int64]:
    """Sleep from deadline to deadline in a compiled loop that does nothing else; return the lateness of each [ns].

    Deadlines are a period apart; those that have passed are skipped.
    """
    lateness_ns = np.zeros(ticks, np.int64)
    _sleep_on(clock.sleep.address, clock.context, clock.now_ns(), period_ns, lateness_ns)
    return lateness_ns


@kernel
def _sleep_on(sleep: int, context: int, start_ns: int, period_ns: int, lateness_ns: Any) -> None:
    deadline_ns = start_ns + period_ns
    for i in range(lateness_ns.shape[0]):
        lateness_ns[i] = _sleep(sleep, context, deadline_ns) - deadline_ns
        deadline_ns += max(lateness_ns[i] // period_ns, 1) * period_ns


if sys.platform != "win32":

    def _ahead_ns(clock: int, of: int) -> int:
        """Return how far a clock is ahead of another [ns]: the least of several readings, as one may be interrupted."""
        return min(-time.clock_gettime_ns(of) + time.clock_gettime_ns(clock) for _ in range(3))


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

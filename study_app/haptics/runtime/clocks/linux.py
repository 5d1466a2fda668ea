"""Linux: ``clock_gettime`` and ``clock_nanosleep`` on CLOCK_MONOTONIC; SCHED_FIFO if permitted.

A limit (``rtprio``) permits it to an ordinary user; the desktop's real-time service grants SCHED_RR.
"""

import ctypes
import os
import sys
import threading
from contextlib import suppress
from typing import Any

import numpy as np
from numba import types

from study_app.haptics.kernels.c_functions import external, record_at, stack_memory
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.layout import records
from study_app.haptics.runtime.clocks.grants import NOT_ASKED, REFUSED, Blocks, Grant
from study_app.haptics.runtime.clocks.rtkit import make_real_time

SPIN_US = 0.0  # by default the timer is trusted

_CLOCK = np.dtype([("spin_ns", np.int64), ("spun_ns", np.int64)], align=True)
_TIMESPEC = np.dtype([("seconds", np.int64), ("nanoseconds", np.int64)], align=True)  # 64-bit systems
_clock_at = record_at(_CLOCK)
_timespec_at = record_at(_TIMESPEC)
_timespec_on_stack = stack_memory(2)

_CLOCK_MONOTONIC = 1
_TIMER_ABSTIME = 1
_EINTR = 4
_clock_gettime = external("clock_gettime", types.int32(types.int32, types.intp))
_clock_nanosleep = external("clock_nanosleep", types.int32(types.int32, types.int32, types.intp, types.intp))

_PR_SET_TIMERSLACK = 29
_PRIORITY = 60  # of 1 to 99: above ordinary real-time audio, below the kernel's own threads
_NICE = -15
_LOCK_ALL = 1 | 2 | 4  # present and future pages, each when it is used: unused pages are not loaded

RIGHTS = (
    'for real-time priority write "USER - rtprio 70" and "USER - memlock unlimited", with your user\'s name, into '
    "/etc/security/limits.d/liquid-study.conf and log in again, or install rtkit"
)
MEMORY = 'to lock it write "USER - memlock unlimited" into /etc/security/limits.d/liquid-study.conf and log in anew'


def open_clock(spin_ns: int) -> Any:
    """Return the memory of a clock."""
    memory = records(_CLOCK, 1)
    memory[0].spin_ns = spin_ns
    return memory


@kernel
def _monotonic_ns() -> Any:
    address = _timespec_on_stack()
    _clock_gettime(_CLOCK_MONOTONIC, address)
    time = _timespec_at(address)
    return time.seconds * 1_000_000_000 + time.nanoseconds


def now(_context: int) -> Any:
    """``NOW``: CLOCK_MONOTONIC, as Python's ``time.monotonic_ns``."""
    return _monotonic_ns()


def sleep(context: int, deadline_ns: int) -> Any:
    """``SLEEP``: to an absolute deadline despite signals; at the end by polling the clock."""
    clock = _clock_at(context)
    address = _timespec_on_stack()
    deadline = _timespec_at(address)
    until_ns = deadline_ns - clock.spin_ns
    deadline.seconds = until_ns // 1_000_000_000
    deadline.nanoseconds = until_ns % 1_000_000_000
    while _clock_nanosleep(_CLOCK_MONOTONIC, _TIMER_ABSTIME, address, 0) == _EINTR:
        pass
    woken_ns = _monotonic_ns()
    time_ns = woken_ns
    while time_ns < deadline_ns:
        time_ns = _monotonic_ns()
    clock.spun_ns += time_ns - woken_ns
    return time_ns


def raise_priority(*, real_time: bool = True) -> Grant:
    """Make the calling thread real-time, or lower its nice level; request timers without slack in any case."""
    if sys.platform != "linux":
        return Grant("normal", REFUSED)
    ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, ctypes.c_ulong(1), 0, 0, 0)
    if not real_time:
        return NOT_ASKED
    for priority in _priorities():
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
            return Grant("real-time", f"SCHED_FIFO {priority}")
    thread = threading.get_native_id()
    with suppress(OSError, ValueError):
        return Grant("real-time", f"SCHED_RR {make_real_time(thread)}, by the desktop's service")
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, thread, _NICE)
        return Grant("raised", f"nice {_NICE}", advice=(RIGHTS,))
    return Grant("normal", REFUSED, advice=(RIGHTS,))


def _priorities() -> tuple[int, ...]:
    """Return the real-time priorities to request: the preferred one, and the highest that a limit allows."""
    if sys.platform != "linux":
        return ()
    import resource  # noqa: PLC0415 - of POSIX; this file is read on every system

    allowed = resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
    return (_PRIORITY, allowed) if 0 < allowed < _PRIORITY else (_PRIORITY,)


def lock_memory(blocks: Blocks) -> bool:
    """Lock memory: that of the process if there is no limit, else ``blocks``; return whether it is locked.

    With a limit the process must not be locked as a whole: later allocations beyond the limit would fail.
    """
    if sys.platform != "linux":
        return False
    import resource  # noqa: PLC0415

    library = ctypes.CDLL(None)
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_MEMLOCK, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    if resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY and library.mlockall(_LOCK_ALL) == 0:
        return True
    return all(library.mlock(ctypes.c_void_p(address), ctypes.c_size_t(size)) == 0 for address, size in blocks)

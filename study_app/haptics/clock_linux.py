"""Linux: ``clock_gettime`` and ``clock_nanosleep`` on CLOCK_MONOTONIC; SCHED_FIFO where it is granted."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from typing import Any

import numpy as np
from numba import types

from study_app.haptics.cfunctions import external, record_at, stack_memory
from study_app.haptics.compiled import kernel
from study_app.haptics.layout import records

_TIMESPEC = np.dtype([("seconds", np.int64), ("nanoseconds", np.int64)], align=True)  # 64-bit systems
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


def open_clock() -> Any:
    """Return the memory of a clock; this one needs none."""
    return records(_TIMESPEC, 1)


@kernel
def _monotonic_ns() -> Any:
    address = _timespec_on_stack()
    _clock_gettime(_CLOCK_MONOTONIC, address)
    time = _timespec_at(address)
    return time.seconds * 1_000_000_000 + time.nanoseconds


def now(_context: int) -> Any:
    """``NOW``: CLOCK_MONOTONIC, as Python's ``time.monotonic_ns``."""
    return _monotonic_ns()


def sleep(_context: int, deadline_ns: int) -> Any:
    """``SLEEP``: to an absolute deadline, whatever signals arrive meanwhile."""
    address = _timespec_on_stack()
    deadline = _timespec_at(address)
    deadline.seconds = deadline_ns // 1_000_000_000
    deadline.nanoseconds = deadline_ns % 1_000_000_000
    while _clock_nanosleep(_CLOCK_MONOTONIC, _TIMER_ABSTIME, address, 0) == _EINTR:
        pass
    return _monotonic_ns()


def raise_priority() -> str:
    """Make the calling thread real-time, or at least nicer to itself; ask for timers without slack."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, ctypes.c_ulong(1), 0, 0, 0)
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        except OSError:
            pass
        else:
            return f"real-time (SCHED_FIFO {_PRIORITY})"
        try:
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
        except OSError:
            pass
        else:
            return f"raised (nice {_NICE})"
    return "normal (the system grants no more)"

"""macOS: ``mach_absolute_time`` and ``mach_wait_until``; the time-constraint policy of audio threads."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numba import types

from study_app.haptics.cfunctions import external, record_at
from study_app.haptics.layout import records

_TIMEBASE = np.dtype([("numerator", np.int64), ("denominator", np.int64)], align=True)
_timebase_at = record_at(_TIMEBASE)

_mach_absolute_time = external("mach_absolute_time", types.int64())
_mach_wait_until = external("mach_wait_until", types.int32(types.int64))

_THREAD_TIME_CONSTRAINT_POLICY = 2
_COMPUTATION_NS = 150_000
_CONSTRAINT_NS = 500_000
_PERIOD_NS = 1_000_000


class _TimebaseInfo(ctypes.Structure):
    _fields_ = (("numerator", ctypes.c_uint32), ("denominator", ctypes.c_uint32))


class _TimeConstraint(ctypes.Structure):
    _fields_ = (
        ("period", ctypes.c_uint32),
        ("computation", ctypes.c_uint32),
        ("constraint", ctypes.c_uint32),
        ("preemptible", ctypes.c_uint32),
    )


def open_clock() -> Any:
    """Return the memory of a clock: nanoseconds = ticks · numerator / denominator."""
    info = _TimebaseInfo()
    ctypes.CDLL(None).mach_timebase_info(ctypes.byref(info))
    memory = records(_TIMEBASE, 1)
    memory[0].numerator = info.numerator
    memory[0].denominator = info.denominator
    return memory


def now(context: int) -> Any:
    """``NOW``: mach absolute time (125/3 ns a tick on Apple silicon: no overflow within two years of uptime)."""
    base = _timebase_at(context)
    return _mach_absolute_time() * base.numerator // base.denominator


def sleep(context: int, deadline_ns: int) -> Any:
    """``SLEEP``: to an absolute deadline, rounded up to a tick."""
    base = _timebase_at(context)
    deadline = -(-deadline_ns * base.denominator // base.numerator)
    while _mach_absolute_time() < deadline:
        _mach_wait_until(deadline)
    return _mach_absolute_time() * base.numerator // base.denominator


def raise_priority() -> str:
    """Promise the scheduler short turns in return for starting them on time."""
    base = open_clock()[0]

    def ticks(nanoseconds: int) -> int:
        return int(nanoseconds * base.denominator // base.numerator)

    policy = _TimeConstraint(ticks(_PERIOD_NS), ticks(_COMPUTATION_NS), ticks(_CONSTRAINT_NS), 1)
    library = ctypes.CDLL(None)
    library.mach_thread_self.restype = ctypes.c_uint32
    library.thread_policy_set.argtypes = [ctypes.c_uint32, ctypes.c_int, ctypes.c_void_p, ctypes.c_uint32]
    thread = library.mach_thread_self()
    refused = library.thread_policy_set(thread, _THREAD_TIME_CONSTRAINT_POLICY, ctypes.byref(policy), 4)
    return "normal (the system grants no more)" if refused else "real-time (time constraint)"

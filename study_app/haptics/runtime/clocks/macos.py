"""macOS: ``mach_absolute_time`` and ``mach_wait_until``; the time-constraint policy of audio threads."""

import ctypes
from typing import Any

import numpy as np
from numba import types

from study_app.haptics.kernels.c_functions import external, record_at
from study_app.haptics.model.layout import records
from study_app.haptics.runtime.grants import NOT_ASKED, REFUSED, Blocks, Grant

SPIN_US = 0.0  # by default the timer is trusted

TIMEBASE = np.dtype(
    [("numerator", np.int64), ("denominator", np.int64), ("spin_ns", np.int64), ("spun_ns", np.int64)], align=True
)
_timebase_at = record_at(TIMEBASE)

_mach_absolute_time = external("mach_absolute_time", types.int64())
_mach_wait_until = external("mach_wait_until", types.int32(types.int64))

_THREAD_TIME_CONSTRAINT_POLICY = 2
_COMPUTATION_NS = 150_000
_CONSTRAINT_NS = 500_000
_PERIOD_NS = 1_000_000

_RIGHTS = "this system grants real-time priority to any program: close other audio and video programs"
MEMORY = "to lock the memory, raise the limit: ulimit -l unlimited"


class _TimebaseInfo(ctypes.Structure):
    _fields_ = (("numerator", ctypes.c_uint32), ("denominator", ctypes.c_uint32))


class _TimeConstraint(ctypes.Structure):
    _fields_ = (
        ("period", ctypes.c_uint32),
        ("computation", ctypes.c_uint32),
        ("constraint", ctypes.c_uint32),
        ("preemptible", ctypes.c_uint32),
    )


def open_clock(spin_ns: int) -> Any:
    """Return the memory of a clock: nanoseconds = ticks · numerator / denominator."""
    info = _TimebaseInfo()
    ctypes.CDLL(None).mach_timebase_info(ctypes.byref(info))
    memory = records(TIMEBASE, 1)
    memory[0].numerator = info.numerator
    memory[0].denominator = info.denominator
    memory[0].spin_ns = spin_ns
    return memory


def now(context: int) -> Any:
    """``NOW``: mach absolute time (125/3 ns per tick on Apple silicon: no overflow within two years of uptime)."""
    base = _timebase_at(context)
    return _mach_absolute_time() * base.numerator // base.denominator


def sleep(context: int, deadline_ns: int) -> Any:
    """``SLEEP``: to an absolute deadline, rounded up to a tick; at the end by polling the clock."""
    base = _timebase_at(context)
    deadline = -(-deadline_ns * base.denominator // base.numerator)
    until = -(-(deadline_ns - base.spin_ns) * base.denominator // base.numerator)
    while _mach_absolute_time() < until:
        _mach_wait_until(until)
    woken = _mach_absolute_time()
    time = woken
    while time < deadline:
        time = _mach_absolute_time()
    base.spun_ns += (time - woken) * base.numerator // base.denominator
    return time * base.numerator // base.denominator


def raise_priority(*, real_time: bool = True) -> Grant:
    """Declare short ticks to the scheduler (time-constraint policy), so that they start on time."""
    if not real_time:
        return NOT_ASKED
    base = open_clock(0)[0]

    def ticks(nanoseconds: int) -> int:
        return int(nanoseconds * base.denominator // base.numerator)

    policy = _TimeConstraint(ticks(_PERIOD_NS), ticks(_COMPUTATION_NS), ticks(_CONSTRAINT_NS), 1)
    library = ctypes.CDLL(None)
    library.mach_thread_self.restype = ctypes.c_uint32
    library.thread_policy_set.argtypes = [ctypes.c_uint32, ctypes.c_int, ctypes.c_void_p, ctypes.c_uint32]
    thread = library.mach_thread_self()
    refused = library.thread_policy_set(thread, _THREAD_TIME_CONSTRAINT_POLICY, ctypes.byref(policy), 4)
    return Grant("normal", REFUSED, advice=(_RIGHTS,)) if refused else Grant("real-time", "time constraint")


def lock_memory(blocks: Blocks) -> bool:
    """Lock ``blocks`` in memory; return whether they are locked."""
    library = ctypes.CDLL(None)
    return all(library.mlock(ctypes.c_void_p(address), ctypes.c_size_t(size)) == 0 for address, size in blocks)

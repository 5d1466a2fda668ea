"""Windows: the performance counter, and a high-resolution waitable timer except for the last half millisecond.

The thread belongs to the multimedia class scheduler if that service runs, else it is time-critical in its process.
"""

import ctypes
import sys
import weakref
from typing import Any

import numpy as np
from llvmlite import binding
from numba import types

from study_app.haptics.kernels.c_functions import external, record_at, stack_memory
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.layout import records
from study_app.haptics.runtime.grants import NOT_ASKED, REFUSED, Blocks, Grant

SPIN_US = 500.0  # greatest lateness of the timer; the rest is waited by polling the counter

COUNTER = np.dtype(
    [("frequency_hz", np.int64), ("timer", np.intp), ("spin_ns", np.int64), ("spun_ns", np.int64)], align=True
)
_INT64 = np.dtype([("value", np.int64)], align=True)
_counter_at = record_at(COUNTER)
_int64_at = record_at(_INT64)
_int64_on_stack = stack_memory(1)

_query = external("QueryPerformanceCounter", types.int32(types.intp))
_set_timer = external(
    "SetWaitableTimer", types.int32(types.intp, types.intp, types.int32, types.intp, types.intp, types.int32)
)
_wait = external("WaitForSingleObject", types.int32(types.intp, types.int32))

_INFINITE = -1
_HIGH_RESOLUTION = 0x2
_ALL_ACCESS = 0x1F0003
_TIME_CRITICAL = 15
_MMCSS_CRITICAL = 2
_TIMER_PERIOD_MS = 1

_RIGHTS = "for real-time priority, start the service Multimedia Class Scheduler (services.msc: MMCSS)"
MEMORY = "to lock the memory, close other programs: the working set is too small"


def open_clock(spin_ns: int) -> Any:
    """Return the memory of a clock: the counter's frequency and a timer, closed with the memory."""
    memory = records(COUNTER, 1)
    memory[0].spin_ns = spin_ns
    if sys.platform == "win32":
        kernel32 = ctypes.WinDLL("kernel32")
        for name in ("QueryPerformanceCounter", "SetWaitableTimer", "WaitForSingleObject"):
            binding.add_symbol(name, ctypes.cast(getattr(kernel32, name), ctypes.c_void_p).value)
        kernel32.CreateWaitableTimerExW.restype = ctypes.c_void_p
        kernel32.CloseHandle.argtypes = [ctypes.c_void_p]
        frequency = ctypes.c_int64()
        kernel32.QueryPerformanceFrequency(ctypes.byref(frequency))
        memory[0].frequency_hz = frequency.value
        winmm = ctypes.WinDLL("winmm")
        winmm.timeBeginPeriod(_TIMER_PERIOD_MS)
        weakref.finalize(memory, winmm.timeEndPeriod, _TIMER_PERIOD_MS)
        timer = kernel32.CreateWaitableTimerExW(None, None, _HIGH_RESOLUTION, _ALL_ACCESS)
        if not timer:  # before Windows 10, version 1803
            timer = kernel32.CreateWaitableTimerExW(None, None, 0, _ALL_ACCESS)
        memory[0].timer = timer
        weakref.finalize(memory, kernel32.CloseHandle, timer)
    return memory


@kernel
def _counter_ns(frequency_hz: int) -> Any:
    address = _int64_on_stack()
    _query(address)
    ticks = _int64_at(address).value
    whole = ticks // frequency_hz
    return whole * 1_000_000_000 + (ticks - whole * frequency_hz) * 1_000_000_000 // frequency_hz


def now(context: int) -> Any:
    """``NOW``: the performance counter, in nanoseconds without overflow."""
    return _counter_ns(_counter_at(context).frequency_hz)


def sleep(context: int, deadline_ns: int) -> Any:
    """``SLEEP``: on the timer until shortly before the deadline, then by polling the counter."""
    clock = _counter_at(context)
    time_ns = _counter_ns(clock.frequency_hz)
    if deadline_ns - time_ns > clock.spin_ns:
        address = _int64_on_stack()
        due = _int64_at(address)
        due.value = -((deadline_ns - time_ns - clock.spin_ns) // 100)  # negative: from now, in units of 100 ns
        if due.value < 0 and _set_timer(clock.timer, address, 0, 0, 0, 0) != 0:
            _wait(clock.timer, _INFINITE)
    woken_ns = _counter_ns(clock.frequency_hz)
    time_ns = woken_ns
    while time_ns < deadline_ns:
        time_ns = _counter_ns(clock.frequency_hz)
    clock.spun_ns += time_ns - woken_ns
    return time_ns


def raise_priority(*, real_time: bool = True) -> Grant:
    """Make the calling thread one of the multimedia scheduler's, or time-critical within its process."""
    if not real_time:
        return NOT_ASKED
    if sys.platform == "win32":
        return request_priority(ctypes.WinDLL("avrt"), ctypes.WinDLL("kernel32"))
    return Grant("normal", REFUSED)


def request_priority(avrt: Any, kernel32: Any) -> Grant:
    """Raise the priority as `raise_priority` specifies, by these libraries of Windows."""
    avrt.AvSetMmThreadCharacteristicsW.restype = ctypes.c_void_p
    avrt.AvSetMmThreadPriority.argtypes = [ctypes.c_void_p, ctypes.c_int]
    task = avrt.AvSetMmThreadCharacteristicsW(ctypes.c_wchar_p("Pro Audio"), ctypes.byref(ctypes.c_uint32(0)))
    if task:
        avrt.AvSetMmThreadPriority(task, _MMCSS_CRITICAL)
        return Grant("real-time", "MMCSS Pro Audio")
    kernel32.GetCurrentThread.restype = ctypes.c_void_p
    kernel32.SetThreadPriority.argtypes = [ctypes.c_void_p, ctypes.c_int]
    if kernel32.SetThreadPriority(kernel32.GetCurrentThread(), _TIME_CRITICAL):
        return Grant("raised", "time critical", advice=(_RIGHTS,))
    return Grant("normal", REFUSED, advice=(_RIGHTS,))


def lock_memory(blocks: Blocks) -> bool:
    """Lock ``blocks`` in memory; return whether they are locked."""
    if sys.platform == "win32":
        kernel32 = ctypes.WinDLL("kernel32")
        kernel32.VirtualLock.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
        return all(kernel32.VirtualLock(address, size) for address, size in blocks)
    return False

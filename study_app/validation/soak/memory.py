"""How much memory this process holds now, as each system tells it."""

from __future__ import annotations

import ctypes
import os
import sys
from pathlib import Path


def resident_bytes() -> int:
    """Return the resident memory of this process [bytes]; 0 where the system does not tell."""
    if sys.platform == "win32":
        return _windows()
    elif sys.platform == "darwin":
        return _macos()
    else:
        return _linux()


class _Counters(ctypes.Structure):
    """PROCESS_MEMORY_COUNTERS of Windows."""

    _fields_ = (
        ("size", ctypes.c_uint32),
        ("page_faults", ctypes.c_uint32),
        ("peak_working_set", ctypes.c_size_t),
        ("working_set", ctypes.c_size_t),
        ("quotas", ctypes.c_size_t * 4),
        ("page_file", ctypes.c_size_t),
        ("peak_page_file", ctypes.c_size_t),
    )


class _TaskNumbers(ctypes.Structure):
    """mach_task_basic_info of macOS."""

    _fields_ = (
        ("virtual", ctypes.c_uint64),
        ("resident", ctypes.c_uint64),
        ("most_resident", ctypes.c_uint64),
        ("times", ctypes.c_int32 * 4),
        ("policy", ctypes.c_int32),
        ("suspended", ctypes.c_int32),
    )


_TASK_BASIC = 20  # MACH_TASK_BASIC_INFO


def _linux() -> int:
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return 0
    return int(pages * os.sysconf("SC_PAGE_SIZE"))


def _windows() -> int:
    counters = _Counters(size=ctypes.sizeof(_Counters))
    if sys.platform == "win32":
        kernel32 = ctypes.WinDLL("kernel32")
        process = kernel32.GetCurrentProcess
        process.restype = ctypes.c_void_p
        tell = kernel32.K32GetProcessMemoryInfo
        tell.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32]
        tell(process(), ctypes.byref(counters), ctypes.sizeof(counters))
    return int(counters.working_set)


def _macos() -> int:
    system = ctypes.CDLL(None)
    task = ctypes.c_uint32.in_dll(system, "mach_task_self_")
    numbers = _TaskNumbers()
    count = ctypes.c_uint32(ctypes.sizeof(numbers) // 4)
    refused = system.task_info(task, _TASK_BASIC, ctypes.byref(numbers), ctypes.byref(count))
    return 0 if refused else int(numbers.resident)

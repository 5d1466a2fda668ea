"""Linux: ``clock_gettime`` and ``clock_nanosleep`` on CLOCK_MONOTONIC; SCHED_FIFO if permitted.

A limit (``rtprio``) permits it to an ordinary user; the desktop's real-time service grants SCHED_RR.
"""

import ctypes
import os
import socket
import struct
import sys
import threading
from contextlib import suppress
from typing import Any, Final, Self

import numpy as np
from numba import types

from study_app.haptics.kernels.c_functions import external, record_at, stack_memory
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.layout import records
from study_app.haptics.runtime.grants import NOT_ASKED, REFUSED, Blocks, Grant

_SERVICE: Final = "org.freedesktop.RealtimeKit1"
_OBJECT: Final = "/org/freedesktop/RealtimeKit1"
_BUS: Final = "org.freedesktop.DBus"
PATIENCE_S: Final = 2.0  # the service may have to be started first
PRIORITY: Final = 20  # highest level granted if the service reports none

_CALL, _RETURN, _ERROR = 1, 2, 3
_PATH, _INTERFACE, _MEMBER, _DESTINATION, _SIGNATURE = 1, 2, 3, 6, 8
_LONGEST = 1 << 20  # longest message of a real bus [bytes]


def make_real_time(thread: int, address: str | None = None) -> int:
    """Make a thread of this process real-time by the service at a bus' ``address``; return its new priority."""
    import resource  # noqa: PLC0415 - of POSIX; this file is read on every system

    with _Bus(address or _system_bus()) as bus:
        priority = min(PRIORITY, bus.number("MaxRealtimePriority"))
        longest_us = bus.number("RTTimeUSecMax")
        hard = resource.getrlimit(resource.RLIMIT_RTTIME)[1]
        if hard == resource.RLIM_INFINITY or hard > longest_us:
            resource.setrlimit(resource.RLIMIT_RTTIME, (longest_us, longest_us))
        body = struct.pack("<QI", thread, priority)
        bus.call(_SERVICE, _OBJECT, _SERVICE, "MakeThreadRealtime", "tu", body)
        return priority


def make_high_priority(thread: int, nice: int, address: str | None = None) -> int:
    """Raise a thread of this process above ordinary ones without real-time priority; return its new nice level.

    ``nice``, below 0, is the requested level; ``address`` the path of the bus' socket, by default the system bus.

    Raises
    ------
    OSError
        There is no bus or no such service, or the service refuses the request.
    """
    with _Bus(address or _system_bus()) as bus:
        level = max(nice, bus.number("MinNiceLevel"))
        bus.call(_SERVICE, _OBJECT, _SERVICE, "MakeThreadHighPriority", "ti", struct.pack("<Qi", thread, level))
        return level


def _system_bus() -> str:
    named = os.environ.get("DBUS_SYSTEM_BUS_ADDRESS", "")
    kind, _, rest = named.partition("=")
    return rest.partition(",")[0] if kind == "unix:path" else "/run/dbus/system_bus_socket"


class _Bus:
    """One connection to a bus, on which calls are answered one after the other."""

    def __init__(self, address: str) -> None:
        self._socket = socket.socket(socket.AF_UNIX)
        self._serial = 0
        try:
            self._socket.settimeout(PATIENCE_S)
            self._socket.connect(address)
            self._introduce()
        except BaseException:
            self._socket.close()
            raise

    def _introduce(self) -> None:
        self._socket.sendall(b"\0AUTH EXTERNAL " + str(os.getuid()).encode().hex().encode() + b"\r\n")
        said = b""
        while not said.endswith(b"\r\n"):
            said += self._receive(1)
        if not said.startswith(b"OK "):
            raise PermissionError(f"D-Bus denied access to this user: {said.decode(errors='replace').strip()}")
        self._socket.sendall(b"BEGIN\r\n")
        self.call(_BUS, "/org/freedesktop/DBus", _BUS, "Hello")

    def number(self, name: str) -> int:
        """Return one of the service's properties, a whole number."""
        body = _string(_SERVICE)
        body += bytes(-len(body) % 4) + _string(name)
        answer = self.call(_SERVICE, _OBJECT, f"{_BUS}.Properties", "Get", "ss", body)
        kind = answer[1:2]  # a variant: length of its signature, signature, 0, value
        if kind == b"x":
            return int(struct.unpack_from("<q", answer, 8)[0])
        if kind == b"i":
            return int(struct.unpack_from("<i", answer, 4)[0])
        raise OSError(f"the real-time service sent {name} in an unknown format")

    def call(
        self, service: str, path: str, interface: str, member: str, signature: str = "", body: bytes = b""
    ) -> bytes:
        """Call a method and return the body of the answer."""
        self._serial += 1
        fields = b""
        named = ((_PATH, "o", path), (_INTERFACE, "s", interface), (_MEMBER, "s", member), (_DESTINATION, "s", service))
        for code, kind, text in named:
            fields += bytes(-len(fields) % 8) + struct.pack("<BB2s", code, 1, kind.encode()) + _string(text)
        if signature:
            fields += bytes(-len(fields) % 8) + struct.pack("<BB2sB", _SIGNATURE, 1, b"g", len(signature))
            fields += signature.encode() + b"\0"
        head = struct.pack("<cBBBIII", b"l", _CALL, 0, 1, len(body), self._serial, len(fields))
        self._socket.sendall(head + fields + bytes(-len(fields) % 8) + body)
        while True:
            kind_of_answer, answer = self._next()
            if kind_of_answer == _ERROR:
                raise PermissionError(f"the real-time service rejected {member}")
            if kind_of_answer == _RETURN:
                return answer

    def _next(self) -> tuple[int, bytes]:
        """Return kind and body of the next message; signals are among them."""
        head = self._receive(16)
        if head[:1] != b"l":
            raise OSError("the bus uses big-endian byte order, unlike this machine")
        _, kind, _, _, length, _, fields = struct.unpack("<cBBBIII", head)
        if length + fields > _LONGEST:
            raise OSError("the reply does not come from a message bus")
        return kind, self._receive(fields + -fields % 8 + length)[fields + -fields % 8 :]

    def _receive(self, count: int) -> bytes:
        received = b""
        while len(received) < count:
            part = self._socket.recv(count - len(received))
            if not part:
                raise ConnectionResetError("the bus has closed the connection")
            received += part
        return received

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()


def _string(text: str) -> bytes:
    return struct.pack("<I", len(text)) + text.encode() + b"\0"


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

_RIGHTS = (
    'for real-time priority, add the lines "USER - rtprio 70" and "USER - memlock unlimited" (USER is your user name) '
    "to /etc/security/limits.d/liquid-study.conf and log in again, or install rtkit"
)
MEMORY = (
    'to lock the memory, add the line "USER - memlock unlimited" to /etc/security/limits.d/liquid-study.conf and log '
    "in again"
)


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
    """``NOW``: CLOCK_MONOTONIC, as Python's ``time.perf_counter_ns``."""
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
        return Grant("real-time", f"SCHED_RR {make_real_time(thread)}, granted by the desktop's real-time service")
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, thread, _NICE)
        return Grant("raised", f"nice {_NICE}", advice=(_RIGHTS,))
    return Grant("normal", REFUSED, advice=(_RIGHTS,))


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

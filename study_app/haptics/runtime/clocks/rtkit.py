"""The desktop's real-time service (rtkit), asked over D-Bus to make a thread real-time for an ordinary user.

It grants SCHED_RR to the threads of a caller whose real-time threads may not compute for longer than 200 ms on end.
Three calls of four strings need no library: a message is a header of typed fields, everything aligned to its own size
(D-Bus specification, "Message protocol" and "Authentication protocol").
"""

import os
import socket
import struct
from typing import Final, Self

SERVICE: Final = "org.freedesktop.RealtimeKit1"
OBJECT: Final = "/org/freedesktop/RealtimeKit1"
BUS: Final = "org.freedesktop.DBus"
PATIENCE_S: Final = 2.0  # the service may have to be started first
PRIORITY: Final = 20  # highest level granted if it reports none

_CALL, _RETURN, _ERROR = 1, 2, 3
_PATH, _INTERFACE, _MEMBER, _DESTINATION, _SIGNATURE = 1, 2, 3, 6, 8
_LONGEST = 1 << 20  # longest message of a real bus [bytes]


def make_real_time(thread: int, address: str | None = None) -> int:
    """Make a thread of this process real-time; return its new priority.

    Parameters
    ----------
    thread : int
        The system's id of the thread.
    address : str, optional
        Path of the bus' socket; by default the system bus.
    """
    import resource  # noqa: PLC0415 - of POSIX; this file is read on every system

    with _Bus(address or _system_bus()) as bus:
        priority = min(PRIORITY, bus.number("MaxRealtimePriority"))
        longest_us = bus.number("RTTimeUSecMax")
        hard = resource.getrlimit(resource.RLIMIT_RTTIME)[1]
        if hard == resource.RLIM_INFINITY or hard > longest_us:
            resource.setrlimit(resource.RLIMIT_RTTIME, (longest_us, longest_us))
        body = struct.pack("<QI", thread, priority)
        bus.call(SERVICE, OBJECT, SERVICE, "MakeThreadRealtime", "tu", body)
        return priority


def make_high_priority(thread: int, nice: int, address: str | None = None) -> int:
    """Raise a thread of this process above ordinary ones without real-time priority; return its new nice level.

    Parameters
    ----------
    thread : int
        The system's id of the thread.
    nice : int
        The requested level, below 0.
    address : str, optional
        Path of the bus' socket; by default the system bus.

    Raises
    ------
    OSError
        There is no bus or no such service here, or it refuses.
    """
    with _Bus(address or _system_bus()) as bus:
        level = max(nice, bus.number("MinNiceLevel"))
        bus.call(SERVICE, OBJECT, SERVICE, "MakeThreadHighPriority", "ti", struct.pack("<Qi", thread, level))
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
            raise PermissionError(f"the bus refuses this user: {said.decode(errors='replace').strip()}")
        self._socket.sendall(b"BEGIN\r\n")
        self.call(BUS, "/org/freedesktop/DBus", BUS, "Hello")

    def number(self, name: str) -> int:
        """Return one of the service's properties, a whole number."""
        body = _string(SERVICE)
        body += bytes(-len(body) % 4) + _string(name)
        answer = self.call(SERVICE, OBJECT, f"{BUS}.Properties", "Get", "ss", body)
        kind = answer[1:2]  # a variant: length of its signature, signature, 0, value
        if kind == b"x":
            return int(struct.unpack_from("<q", answer, 8)[0])
        if kind == b"i":
            return int(struct.unpack_from("<i", answer, 4)[0])
        raise OSError(f"the real-time service sent {name} in an unknown form")

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
                raise PermissionError(f"the real-time service refuses {member}")
            if kind_of_answer == _RETURN:
                return answer

    def _next(self) -> tuple[int, bytes]:
        """Return kind and body of the next message; signals are among them."""
        head = self._receive(16)
        if head[:1] != b"l":
            raise OSError("the bus uses big-endian byte order, unlike this machine")
        _, kind, _, _, length, _, fields = struct.unpack("<cBBBIII", head)
        if length + fields > _LONGEST:
            raise OSError("the reply is not from a bus")
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

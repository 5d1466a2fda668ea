"""The Inverse Service: the byte stream to it, and the devices that it lists. Importing it loads no compiler."""

import ctypes
import io
import json
import re
import reprlib
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from http import HTTPStatus
from http.client import HTTPException, HTTPResponse
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.devices.doctor import DeviceFailure, read_failures

FAILURES: Final = read_failures(Path(__file__).with_name("failures.toml"))

HOST: Final = "127.0.0.1"
PORT: Final = 10001
"""Port of the simulation channel: docs.haply.co 3.5.x, "WebSocket Protocol" and "Settings Reference"."""
OPENS_S: Final = 2.0
"""Time limit for opening a session, from the connection to the last reply [s]. [choice]"""
ANSWER_S: Final = 0.5
"""Time limit for an answer over HTTP, from the connection to its last byte [s]. [choice]"""
_CLOSE_TIMEOUT_S: Final = 0.2
LONGEST: Final = 1 << 16
"""Greatest length of a message, of an answer, and of unread data [bytes]."""


class TransferCalls(NamedTuple):
    """A byte stream for compiled code: the handle, and the addresses of its functions (``exchange._TRANSFER``)."""

    handle: int
    send: int
    receive: int


class Link(Protocol):
    """A byte stream."""

    def calls(self) -> TransferCalls:
        """Return handle and function addresses for compiled code; from then on the functions do not wait."""

    def send(self, data: bytes) -> None:
        """Send all data; raise a ``DeviceFailure`` at the time-out."""

    def receive(self, most: int = LONGEST) -> bytes:
        """Return received data, b"" at the end of the stream; raise a ``DeviceFailure`` at the time-out."""

    def now_s(self) -> float: ...

    def close(self) -> None:
        """Close it; a second call does nothing."""


class SocketLink(io.RawIOBase):
    """A TCP connection to ``host:port`` without Nagle's algorithm; `send` and `receive` fail after ``within_s``."""

    def __init__(self, host: str = HOST, port: int = PORT, within_s: float = OPENS_S) -> None:
        self._within_s, self._until_s = within_s, time.perf_counter() + within_s
        try:
            self._socket = socket.create_connection((host, port), within_s)
        except OSError as error:
            super().close()  # without a connection there is nothing to close
            raise FAILURES.failure("no-service", f"{host}:{port}: {error.strerror or error}") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def calls(self) -> TransferCalls:
        self._socket.setblocking(False)
        send, receive = _socket_function_addresses()
        return TransferCalls(handle=self._socket.fileno(), send=send, receive=receive)

    @contextmanager
    def _in_time(self) -> Iterator[None]:
        """Limit a call to the remaining time, and convert its errors to ``DeviceFailure``."""
        remaining_s = self._until_s - time.perf_counter()
        timeout = FAILURES.failure("no-reply", f"it did not finish within {self._within_s:g} s")
        if remaining_s <= 0.0:
            raise timeout
        try:
            self._socket.settimeout(remaining_s)
            yield
        except TimeoutError as error:
            raise timeout from error
        except OSError as error:
            raise FAILURES.failure("closed", str(error.strerror or error)) from error

    def send(self, data: bytes) -> None:
        with self._in_time():
            self._socket.sendall(data)

    def receive(self, most: int = LONGEST) -> bytes:
        with self._in_time():
            return self._socket.recv(most)

    def makefile(self, _mode: str) -> io.BufferedReader:
        """Return received data as a file, as the HTTP parser requires of a socket."""
        return io.BufferedReader(self)

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        data = self.receive(len(buffer))
        buffer[: len(data)] = data
        return len(data)

    def now_s(self) -> float:
        return time.perf_counter()

    def close(self) -> None:
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
            self._socket.settimeout(_CLOSE_TIMEOUT_S)
            deadline_s = time.perf_counter() + _CLOSE_TIMEOUT_S
            while self._socket.recv(1 << 16) and time.perf_counter() < deadline_s:
                pass
        self._socket.close()


def _socket_function_addresses() -> tuple[int, int]:
    library = ctypes.CDLL("ws2_32" if sys.platform == "win32" else None)
    send, receive = (ctypes.cast(function, ctypes.c_void_p).value or 0 for function in (library.send, library.recv))
    return send, receive


PORTS: Final = (10001, 10000)
"""Ports of HTTP: docs.haply.co 3.5.x, "Device Configuration" uses the first, "Settings Reference" names the second."""
ID: Final = re.compile(r"[!#-\[\]-~]{1,64}")
"""Permitted ids, which are inserted unescaped: printable ASCII without spaces, quotes and backslashes."""
_CAN: Final = "force through Inverse Service 3.5 or later (Haply Hub); not yet tested on hardware"


def probe(host: str = "127.0.0.1", ports: tuple[int, ...] = PORTS) -> Backend:
    """Return the state of the service at ``host`` with its devices (docs.haply.co 3.4.x, "HTTP", GET /devices)."""
    answer = _get_json(host, "/devices", ports)
    by = "Inverse Service"
    if not isinstance(answer, dict):
        return Backend("inverse3", by, state=NOT_AVAILABLE, can=_CAN, why=FAILURES.sentence("no-service"))
    devices = answer.get("inverse3")
    ids = [entry.get("device_id") for entry in devices if isinstance(entry, dict)] if isinstance(devices, list) else []
    if names := [name for name in ids if isinstance(name, str) and ID.fullmatch(name)]:
        return Backend("inverse3", by, state=f"connected: {', '.join(names)}", can=_CAN)
    return Backend("inverse3", by, state=NONE, can=_CAN, why=FAILURES.sentence("no-device"))


def shortened(value: Any) -> str:
    """Return data of a service for a message, shortened to one line."""
    return reprlib.repr(value)[:80]


def request_force_scale(host: str, ports: tuple[int, ...] = PORTS) -> Any:
    """Return the service's reply about the setting devices/force_scale, or None if it does not reply.

    The setting is the multiplier of all forces.

    Documented: "Filters" 3.5.x (the key), "Settings Reference" 3.5.x (GET /settings/KEY).
    """
    return _get_json(host, "/settings/devices/force_scale", ports)


def check_force_scale(answer: Any) -> float:
    """Return the multiplier of all forces in an answer; raise an error unless it is 1.

    The format of the answer is not documented. A bare number, or an object that contains the number under ``value`` or
    ``devices/force_scale``, is accepted.
    """
    scale = answer.get("value", answer.get("devices/force_scale")) if isinstance(answer, dict) else answer
    if type(scale) not in {int, float}:  # a bool is not a number
        where = f"within {ANSWER_S:g} s" if answer is None else f"in {shortened(answer)}"
        raise FAILURES.failure("unknown-scale", f"no number {where}")
    if scale != 1:
        raise FAILURES.failure("settings", f"devices/force_scale is {shortened(scale)}, but must be 1")
    return 1.0


def _get_json(host: str, path: str, ports: tuple[int, ...] = PORTS) -> Any:
    """Return the service's JSON answer to a GET request; None if no port answers within `ANSWER_S`.

    The system's proxy is not used, since the service is in the local network.
    """
    deadline_s = time.perf_counter() + ANSWER_S
    for port in ports:
        with (
            suppress(DeviceFailure, HTTPException, ValueError, RecursionError),
            closing(SocketLink(host, port, max(deadline_s - time.perf_counter(), 0.01))) as link,
        ):
            link.send(f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\nConnection: close\r\n\r\n".encode())
            answer = HTTPResponse(link)  # type: ignore[arg-type] # only the file of a socket is needed
            answer.begin()
            if answer.status == HTTPStatus.OK:
                return json.loads(answer.read(LONGEST))
    return None

"""The Inverse Service: the byte stream to it, and which devices it lists. Loads no compiler."""

import contextlib
import ctypes
import json
import reprlib
import socket
import sys
import time
import urllib.request
from contextlib import suppress
from http.client import HTTPException
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.devices.doctor import read_failures

FAILURES: Final = read_failures(Path(__file__).with_name("failures.toml"))

HOST: Final = "127.0.0.1"
PORT: Final = 10001
"""Of the simulation channel: docs.haply.co 3.5.x, "WebSocket Protocol" and "Settings Reference"."""
CONNECT_S: Final = 2.0
CLOSE_S: Final = 0.2


class TransferCalls(NamedTuple):
    """A byte stream as compiled code sees it: the handle to pass, and the addresses of its functions (``TRANSFER``)."""

    handle: int
    send: int
    receive: int


class Link(Protocol):
    """A byte stream; ``emulated``: it is not a socket, and its time is the emulator's."""

    emulated: bool

    def calls(self) -> TransferCalls:
        """Return it as compiled code sees it; from then on nothing waits."""
        ...

    def send(self, data: bytes) -> None:
        """Send all of it; raise an ``DeviceFailure`` where it does not go."""
        ...

    def receive(self, timeout_s: float) -> bytes:
        """Return what came, at least a byte; raise an ``DeviceFailure`` where nothing comes in time."""
        ...

    def now_s(self) -> float: ...

    def close(self) -> None:
        """Close it; a second call does nothing."""
        ...


class SocketLink:
    """A TCP connection to ``host:port``, without Nagle's algorithm."""

    emulated = False

    def __init__(self, host: str = HOST, port: int = PORT) -> None:
        try:
            self._socket = socket.create_connection((host, port), CONNECT_S)
        except OSError as error:
            raise FAILURES.failure("no-service", f"{host}:{port}: {error.strerror or error}") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def calls(self) -> TransferCalls:
        self._socket.setblocking(False)
        return TransferCalls(self._socket.fileno(), *_addresses())

    def send(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise FAILURES.failure("closed", str(error.strerror or error)) from error

    def receive(self, timeout_s: float) -> bytes:
        self._socket.settimeout(timeout_s)
        try:
            data = self._socket.recv(1 << 16)
        except TimeoutError as error:
            raise FAILURES.failure("no-reply", f"nothing within {timeout_s:g} s") from error
        except OSError as error:
            raise FAILURES.failure("closed", str(error.strerror or error)) from error
        if not data:
            raise FAILURES.failure("closed", "while it was opened")
        return data

    def now_s(self) -> float:
        return time.monotonic()

    def close(self) -> None:
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
            self._socket.settimeout(CLOSE_S)
            until_s = time.monotonic() + CLOSE_S
            while self._socket.recv(1 << 16) and time.monotonic() < until_s:
                pass
        self._socket.close()


def _addresses() -> tuple[int, int]:
    library = ctypes.CDLL("ws2_32" if sys.platform == "win32" else None)
    send, receive = (ctypes.cast(function, ctypes.c_void_p).value or 0 for function in (library.send, library.recv))
    return send, receive


PORTS: Final = (10001, 10000)
"""Of HTTP: docs.haply.co 3.5.x, "Device Configuration" uses the first, "Settings Reference" names the second."""
ANSWER_S: Final = 0.5
LONGEST: Final = 80
_DIRECT: Final = urllib.request.build_opener(urllib.request.ProxyHandler({}))
"""Opens without a proxy of the system: the service is in the local network."""
CAN: Final = "force as commanded by the Inverse Service 3.5 or later (Haply Hub); not proved on hardware"


def probe(host: str = "127.0.0.1", ports: tuple[int, ...] = PORTS) -> Backend:
    """Return what the service at ``host`` lists (docs.haply.co 3.4.x, "HTTP", Devices: GET /devices)."""
    found = ask(host, "/devices", ports)
    by = "Inverse Service"
    if not isinstance(found, dict):
        return Backend("inverse3", by, NOT_AVAILABLE, CAN, FAILURES.sentence("no-service"))
    listed = found.get("inverse3", [])
    names = [str(entry.get("device_id")) for entry in listed if isinstance(entry, dict)]
    if not names:
        return Backend("inverse3", by, NONE, CAN, FAILURES.sentence("no-device"))
    return Backend("inverse3", by, "connected: " + ", ".join(names), CAN)


def force_scale(host: str, ports: tuple[int, ...] = PORTS) -> Any:
    """Return the service's answer about the setting devices/force_scale, the multiplier of all forces; None without.

    Documented: "Filters" 3.5.x (the key), "Settings Reference" 3.5.x (GET /settings/KEY).
    """
    return ask(host, "/settings/devices/force_scale", ports)


def check_force_scale(answer: Any) -> float:
    """Return the multiplier of all forces in an answer, which is 1.

    The shape of the answer is not documented: a bare number, or an object with the number as ``value`` or under the
    key, are understood.
    """
    scale = answer.get("value", answer.get("devices/force_scale")) if isinstance(answer, dict) else answer
    if type(scale) not in {int, float}:  # a bool is none
        where = f"within {ANSWER_S:g} s" if answer is None else f"in {reprlib.repr(answer)[:LONGEST]}"
        raise FAILURES.failure("unknown-scale", f"no number {where}")
    if scale != 1:
        raise FAILURES.failure("settings", f"devices/force_scale is {reprlib.repr(scale)}, and 1 is required")
    return 1.0


def ask(host: str, path: str, ports: tuple[int, ...] = PORTS) -> Any:
    """Return what the service answers to a GET as JSON; None where nothing at these ports does."""
    for port in ports:
        with contextlib.suppress(OSError, HTTPException, ValueError, RecursionError):
            request = f"http://{host}:{port}{path}"
            with _DIRECT.open(request, timeout=ANSWER_S) as answer:
                return json.loads(answer.read(1 << 20))
    return None

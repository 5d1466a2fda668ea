"""The Inverse Service: what can go wrong with it, the byte stream to it, and which devices it lists. Loads no compiler.

Causes follow from docs.haply.co, versions 3.4.x and 3.5.x; none was seen by us on a device.
"""

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
from typing import Any, Final, NamedTuple, Protocol

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.devices.doctor import FailureMode, FailureTable

_MODES: Final = (
    FailureMode(
        "no-service",
        "the Inverse Service answers",
        "the Inverse Service does not answer",
        "Haply Hub is not running, or its service uses another port",
        "start Haply Hub (or the service haply-inverse-service), or name its address: --device inverse3:HOST:PORT",
        "the TCP connection is refused or times out",
    ),
    FailureMode(
        "not-websocket",
        "the address is that of the simulation channel",
        "something else answers at the address of the Inverse Service",
        "another program uses the port",
        "name the port of the simulation channel (10001 unless changed in Haply Hub): --device inverse3:HOST:PORT",
        "the answer to the WebSocket handshake is not that of RFC 6455",
    ),
    FailureMode(
        "version",
        "the service is version 3.5 or later",
        "the Inverse Service speaks an older format",
        "the service is older than 3.5",
        "update it with Haply Hub",
        "its first message has no filters in the device's configuration",
    ),
    FailureMode(
        "no-device",
        "an Inverse3 is connected",
        "the Inverse Service lists no such Inverse3",
        "no Inverse3 is connected, or another one than was named",
        "connect its USB cable and its power supply, wait until Haply Hub shows it, and check its id",
        "the list 'inverse3' of the first message",
    ),
    FailureMode(
        "not-ready",
        "the device has power and is ready",
        "the Inverse3 is not ready",
        "its power supply is off, or it is still starting",
        "connect its power supply and wait until its light is steady",
        "status.ready and status.power_supply",
    ),
    FailureMode(
        "uncalibrated",
        "the device is calibrated",
        "the Inverse3 is not calibrated",
        "it was not calibrated since it was turned on",
        "put the handle onto its rest (inkwell) and wait until Haply Hub shows that the device is calibrated",
        "status.calibrated",
    ),
    FailureMode(
        "in-use",
        "no other program uses the device",
        "another program uses the Inverse3",
        "forces of several programs add up in the service",
        "close the other program, demos of Haply Hub included",
        "status.in_use",
    ),
    FailureMode(
        "settings",
        "the service's own settings are neutral",
        "a setting of the service changes the force",
        "gravity compensation, torque scaling or force scale was changed for the device, or the service refused ours",
        "reset the setting in Haply Hub to its factory value",
        "config of a full state, and the setting devices/force_scale",
    ),
    FailureMode(
        "unknown-scale",
        "the service reports its force scale",
        "the multiplier of all forces is not known",
        "the service does not report its setting devices/force_scale, or in a form that this program does not know",
        "restart Haply Hub; if it stays, use version 3.5 of the service, or update this program",
        "the answer to GET /settings/devices/force_scale",
    ),
    FailureMode(
        "no-reply",
        "every command is answered",
        "the Inverse Service stopped answering",
        "the service hangs, or the computer is overloaded",
        "restart Haply Hub, and close other programs",
        "no state for 50 ms",
    ),
    FailureMode(
        "closed",
        "the connection stays open",
        "the Inverse Service closed the connection",
        "the service was stopped or restarted",
        "start Haply Hub and connect the device again",
        "a close frame, or the end of the stream",
    ),
    FailureMode(
        "protocol",
        "the service keeps to RFC 6455",
        "the Inverse Service sent something that is not a WebSocket text message",
        "the service is of a version that this program does not know",
        "update this program, or use version 3.5 of the service",
        "the header of a frame",
    ),
    FailureMode(
        "not-json",
        "every state is JSON",
        "the Inverse Service sent a state that is not valid JSON",
        "the service is faulty, or of a version that this program does not know",
        "restart Haply Hub; if it stays, use version 3.5 of the service",
        "the grammar of RFC 8259",
    ),
    FailureMode(
        "no-position",
        "every state has a position",
        "the Inverse Service sent a state without the device's position",
        "the service is of a version that this program does not know",
        "update this program, or use version 3.5 of the service",
        "inverse3[].state.cursor_position",
    ),
    FailureMode(
        "not-finite",
        "every position is a finite number",
        "the Inverse Service sent a position that is not a finite number",
        "the device lost its calibration, or an encoder failed",
        "turn the device off and on, and calibrate it",
        "null or a number beyond what a float64 holds",
    ),
    FailureMode(
        "rate",
        "the device keeps up with 1 kHz",
        "the Inverse3 gives fewer than 900 new positions per second",
        "the service or the computer is too slow",
        "close other programs, and set the service's streaming mode to USB",
        "new positions per second while it runs",
    ),
)
FAILURES: Final = FailureTable("the Inverse3", _MODES, frozenset({"no-service", "no-device"}))


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

    def now_s(self) -> float:
        """Return the time [s]."""
        ...

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
    """Return the addresses of the system's ``send`` and ``recv``."""
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

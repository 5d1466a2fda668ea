"""The byte stream to the service: a TCP socket, for Python while the device is opened, for compiled code afterwards."""

import ctypes
import socket
import sys
import time
from contextlib import suppress
from typing import Final, NamedTuple, Protocol

from study_app.devices.inverse3.failures import FAILURES

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
        """Return it as compiled code sees it; from then on nothing waits."""
        self._socket.setblocking(False)
        return TransferCalls(self._socket.fileno(), *_addresses())

    def send(self, data: bytes) -> None:
        """Send all of it."""
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise FAILURES.failure("closed", str(error.strerror or error)) from error

    def receive(self, timeout_s: float) -> bytes:
        """Return what came, at least a byte."""
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
        """Return the monotonic time [s]."""
        return time.monotonic()

    def close(self) -> None:
        """Close it once the service has read all, or after `CLOSE_S`; a second call does nothing.

        A socket that is closed with bytes unread resets the connection, and some systems (Windows) then throw away what
        the service has not read yet: zero force and the close frame.
        """
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

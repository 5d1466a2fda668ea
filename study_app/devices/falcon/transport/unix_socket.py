"""A Falcon's bridge behind a Unix socket: an emulator in another process, or whatever speaks ``framing``."""

from __future__ import annotations

import socket
import struct
import time
from typing import TYPE_CHECKING, Any, Final

from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure, usb_failure
from study_app.devices.falcon.transport.socket_frames import (
    ANSWER,
    BULK_IN,
    BULK_OUT,
    CONTROL,
    DESCRIPTOR,
    IDENTITY,
    LONGEST_TIMEOUT_MS,
    REQUEST,
)
from study_app.devices.falcon.wire import constants
from study_app.devices.falcon.wire.constants import milliseconds

if TYPE_CHECKING:
    from study_app.devices.falcon.transport.bulk_calls import BulkCalls

_GRACE_S: Final = 30  # how much longer than a time-out an answer may take before the server counts as gone
_SERVO_S: Final = 2  # the same for the servo, whose time-outs are a few milliseconds


class SocketTransport:
    """The bridge that a server offers at the Unix socket ``path``."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._socket: socket.socket | None = None
        self._memory: Any = None
        self.serial: str | None = None
        self.reopen()

    @property
    def name(self) -> str:
        """The word by which ``open_transport`` opens it again."""
        return f"falcon-socket:{self._path}"

    def reopen(self) -> None:
        """Close it and open it again, as new."""
        self.close()
        family = getattr(socket, "AF_UNIX", None)
        if family is None:
            raise UsbFailure("not-supported", "opening a Unix socket")
        connection = socket.socket(family, socket.SOCK_STREAM)
        try:
            connection.connect(self._path)
        except OSError as error:
            connection.close()
            raise FalconNotFound("not-found", f"connecting to {self._path}: {error.strerror}") from error
        _limit_waiting(connection, LONGEST_TIMEOUT_MS // 1000 + _GRACE_S)
        self._socket = connection
        try:
            identity = self._ask("opening it", DESCRIPTOR, 0)
            if identity[: IDENTITY.size] != IDENTITY.pack(constants.VENDOR_ID, constants.PRODUCT_ID):
                raise FalconNotFound("not-found", f"asking who serves {self._path}")
        except UsbFailure:
            self.close()
            raise
        self.serial = identity[IDENTITY.size :].decode("utf-8", "replace") or None

    def control(self, request: int, value: int) -> None:
        """Send a control request with its value."""
        self._ask("setting the bridge", CONTROL, request, value)

    def write(self, data: bytes, timeout_s: float) -> None:
        """Send all of ``data``."""
        self._ask("sending", BULK_OUT, constants.ENDPOINT_OUT, 0, len(data), _timeout_ms(timeout_s), data)

    def read(self, size: int, timeout_s: float) -> bytes:
        """Return what one read gives; nothing when the time is out."""
        if size <= 0 or size % constants.USB_PACKET:
            raise ValueError(f"a read asks for a multiple of {constants.USB_PACKET} bytes, not {size}")
        try:
            return self._ask("receiving", BULK_IN, constants.ENDPOINT_IN, 0, size, _timeout_ms(timeout_s))
        except UsbFailure as failure:
            if failure.kind == "timeout":
                return b""
            raise

    def calls(self) -> BulkCalls:
        """Return the bridge as compiled code sees it; good until `close` or `reopen`."""
        from study_app.devices.falcon.transport.bulk_calls import BulkCalls  # noqa: PLC0415 - loads the compiler
        from study_app.devices.falcon.transport.socket_bulk import connection_record, transfer  # noqa: PLC0415 - likewise

        connection = self._open_socket()
        _limit_waiting(connection, _SERVO_S)
        self._memory = connection_record(connection.fileno())
        return BulkCalls(handle=int(self._memory.ctypes.data), transfer=int(transfer().address))

    def now_s(self) -> float:
        """Return the time on the machine's clock [s]."""
        return time.monotonic()

    def pause(self, seconds: float) -> None:
        """Let that clock pass."""
        time.sleep(seconds)

    def close(self) -> None:
        """Let go of it; a second call does nothing."""
        connection, self._socket = self._socket, None
        if connection is not None:
            connection.close()

    def _open_socket(self) -> socket.socket:
        if self._socket is None:
            raise FalconLost("no-device", "using it after it was closed")
        return self._socket

    def _ask(
        self, where: str, kind: int, at: int, value: int = 0, length: int = 0, timeout_ms: int = 0, data: bytes = b""
    ) -> bytes:
        connection = self._open_socket()
        try:
            connection.sendall(REQUEST.pack(kind, at, value, length, timeout_ms) + data)
            code, size = ANSWER.unpack(_receive(connection, ANSWER.size))
            answer = _receive(connection, size)
        except OSError as error:
            self.close()  # half an answer, or a late one, must not be taken for the next
            raise usb_failure(constants.ERROR_NO_DEVICE, where) from error
        if code < 0 and not (code == constants.ERROR_TIMEOUT and answer):
            raise usb_failure(code, where)
        return answer


def _receive(connection: socket.socket, size: int) -> bytes:
    """Return the next ``size`` bytes; raise OSError where they do not come."""
    received = b""
    while len(received) < size:
        more = connection.recv(size - len(received))
        if not more:
            raise ConnectionResetError("the server has ended")
        received += more
    return received


def _timeout_ms(seconds: float) -> int:
    return min(milliseconds(seconds), LONGEST_TIMEOUT_MS)


def _limit_waiting(connection: socket.socket, seconds: int) -> None:
    """Let no call wait for ever, and leave the socket blocking: compiled code calls the system's own ``recv``."""
    limit = struct.pack("@ll", seconds, 0)  # struct timeval
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, limit)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)

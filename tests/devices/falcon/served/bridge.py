"""A Falcon's bridge through a Unix socket.

A stream; all numbers little endian. A request is 8 bytes, and ``length`` bytes more for bulk out:

====  ===================  ===========================================================================
u8    kind                 1 control, 2 bulk out, 3 bulk in, 4 descriptor
u8    endpoint or request  control: ``wire.REQUEST_*``; bulk: the endpoint; descriptor: 0
u16   value                control: the value; else 0
u16   length               bulk out: how many bytes follow; bulk in: the most to return; else 0
u16   timeout_ms           bulk: how long to wait at most; else 0
====  ===================  ===========================================================================

Every request has one answer: i32 return code (0 or libusb's error), u32 length, and ``length`` bytes: of bulk in what
came, status bytes and all; of descriptor u16 vendor, u16 product, the serial number in UTF-8; else none.

A client need not wait for an answer before its next request: as on USB, bulk in, bulk out and control are carried out
together, and requests of one kind in their order. Answers come in the order of the requests. With ``TAGGED`` added to
``kind``, the answer comes as soon as the request is done, and begins with that u8 kind.

The bridge has one interface: while one client has it, any other's first request is answered with ``ERROR_BUSY``. When a
client goes, nothing changes: the last torque persists.
"""

from __future__ import annotations

import socket
import struct
import time
from typing import TYPE_CHECKING, Any, Final

from study_app.devices.falcon import constants
from study_app.devices.falcon.constants import milliseconds
from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure, usb_failure
from study_app.devices.falcon.transport import quiet
from study_app.errors import DeviceError

if TYPE_CHECKING:
    from study_app.devices.falcon.bulk import BulkCalls


CONTROL, BULK_OUT, BULK_IN, DESCRIPTOR = 1, 2, 3, 4
TAGGED: Final = 0x80
REQUEST: Final = struct.Struct("<BBHHH")
ANSWER: Final = struct.Struct("<iI")
IDENTITY: Final = struct.Struct("<HH")
LONGEST_TIMEOUT_MS: Final = 10_000

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
        return self._path

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
        from study_app.devices.falcon.bulk import BulkCalls
        from tests.devices.falcon.served.bulk import connection_record, transfer

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


def end_torque(path: str) -> None:
    """Do what the Falcon's guard does."""
    transport = SocketTransport(path)
    try:
        if not quiet(transport):
            raise DeviceError("it takes no packet")
    finally:
        transport.close()

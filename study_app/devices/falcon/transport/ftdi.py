"""The bridge over FTDI's own driver (D2XX): on Windows, where Novint's driver keeps libusb out.

The library is loaded by name with ctypes; nothing of FTDI's is needed to import this. It takes the status bytes off the
stream itself, so they are put back as zeros: readers see what a bridge sends. Written from FTDI's "D2XX Programmer's
Guide"; tested against a stand-in of the library, never on a Falcon.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure, usb_failure
from study_app.devices.falcon.wire import constants
from study_app.devices.falcon.wire.constants import milliseconds

if TYPE_CHECKING:
    from study_app.devices.falcon.transport.bulk_calls import BulkCalls

LIBRARIES: Final = ("ftd2xx64.dll", "ftd2xx.dll")
_SERIAL_SIZE, _DESCRIPTION_SIZE = 16, 64
_DATA_BYTES = constants.USB_PACKET - constants.STATUS_BYTES
_CODES: Final = {
    1: constants.ERROR_NO_DEVICE,  # FT_INVALID_HANDLE
    2: constants.ERROR_NOT_FOUND,  # FT_DEVICE_NOT_FOUND
    3: constants.ERROR_BUSY,  # FT_DEVICE_NOT_OPENED: somebody else has opened it
    4: constants.ERROR_NO_DEVICE,  # FT_IO_ERROR: what an unplugged bridge gives
}
_PURGE_RX, _PURGE_TX = 1, 2
_EIGHT_BITS = 8

Setter = Callable[[Any, Any, int], int]
"""(library, handle, value of the control request) -> FT_STATUS."""


def _reset(library: Any, handle: Any, value: int) -> int:
    masks = {constants.PURGE_RX: _PURGE_RX, constants.PURGE_TX: _PURGE_TX}
    return int(library.FT_Purge(handle, masks[value]) if value in masks else library.FT_ResetDevice(handle))


def _modem(library: Any, handle: Any, value: int) -> int:
    names = {
        constants.DTR_HIGH: "FT_SetDtr",
        constants.DTR_LOW: "FT_ClrDtr",
        constants.RTS_HIGH: "FT_SetRts",
        constants.RTS_LOW: "FT_ClrRts",
    }
    return int(getattr(library, names[value])(handle))


def _event_character(library: Any, handle: Any, value: int) -> int:
    return int(library.FT_SetChars(handle, value & 0xFF, 1 if value & constants.EVENT_ENABLED else 0, 0, 0))


_SETTERS: Final[dict[int, Setter]] = {
    constants.REQUEST_RESET: _reset,
    constants.REQUEST_MODEM: _modem,
    constants.REQUEST_FLOW: lambda library, handle, _: int(library.FT_SetFlowControl(handle, 0, 0, 0)),
    constants.REQUEST_BAUD: lambda library, handle, value: int(library.FT_SetDivisor(handle, value)),
    constants.REQUEST_LINE: lambda library, handle, _: int(
        library.FT_SetDataCharacteristics(handle, _EIGHT_BITS, 0, 0)
    ),
    constants.REQUEST_EVENT_CHARACTER: _event_character,
    constants.REQUEST_LATENCY: lambda library, handle, value: int(library.FT_SetLatencyTimer(handle, value)),
}


class FtdiTransport:
    """The bridge over D2XX.

    Parameters
    ----------
    library : D2XX as ctypes loads it; None: it is loaded by name
    serial : number of the Falcon that is meant; None: the first
    """

    def __init__(self, library: Any = None, *, serial: str | None = None) -> None:
        self._library = load_d2xx() if library is None else library
        self._handle: Any = None
        self._timeout_ms = 0
        self._memory: Any = None
        self.serial = serial
        self.reopen()

    @property
    def name(self) -> str:
        """The word by which ``open_transport`` opens it again."""
        return "falcon" if self.serial is None else f"falcon:{self.serial}"

    def reopen(self) -> None:
        """Close it and open it again, as new."""
        self.close()
        self._timeout_ms = 0
        for index, (serial, description) in enumerate(self._listed()):
            if constants.PRODUCT in description and self.serial in {None, serial}:
                handle = ctypes.c_void_p()
                self._check(self._library.FT_Open(index, ctypes.byref(handle)), "opening it")
                self._handle, self.serial = handle, serial or None
                return
        raise FalconNotFound("not-found", "looking for it with FTDI's driver")

    def control(self, request: int, value: int) -> None:
        """Do what a control request with this value would do."""
        self._check(_SETTERS[request](self._library, self._opened(), value), "setting the bridge")

    def write(self, data: bytes, timeout_s: float) -> None:
        """Send all of ``data``."""
        handle, sent = self._opened(), ctypes.c_uint32()
        self._set_timeout(milliseconds(timeout_s))
        self._check(self._library.FT_Write(handle, data, len(data), ctypes.byref(sent)), "sending")
        if sent.value < len(data):
            raise usb_failure(constants.ERROR_TIMEOUT, "sending")

    def read(self, size: int, timeout_s: float) -> bytes:
        """Return what there is, as one packet of the bridge; wait for a first byte; nothing when the time is out."""
        if size <= 0 or size % constants.USB_PACKET:
            raise ValueError(f"a read asks for a multiple of {constants.USB_PACKET} bytes, not {size}")
        self._set_timeout(milliseconds(timeout_s))
        data = self._receive(min(max(self._waiting(), 1), _DATA_BYTES))
        if len(data) == 1:  # perhaps it was waited for, and more came with it
            data += self._receive(min(self._waiting(), _DATA_BYTES - 1))
        return bytes(constants.STATUS_BYTES) + data if data else b""

    def calls(self) -> BulkCalls:
        """Return the bridge as compiled code sees it; good until `close` or `reopen`."""
        from study_app.devices.falcon.transport.bulk_calls import BulkCalls  # noqa: PLC0415 - loads the compiler
        from study_app.devices.falcon.transport.ftdi_bulk import bridge_record, transfer  # noqa: PLC0415 - likewise

        self._memory = bridge_record(self._library, self._opened())
        self._timeout_ms = 0  # the C function sets its own
        return BulkCalls(handle=int(self._memory.ctypes.data), transfer=int(transfer().address))

    def now_s(self) -> float:
        """Return the time on the machine's clock [s]."""
        return time.monotonic()

    def pause(self, seconds: float) -> None:
        """Let that clock pass."""
        time.sleep(seconds)

    def close(self) -> None:
        """Let go of it; a second call does nothing."""
        handle, self._handle = self._handle, None
        if handle is not None:
            self._library.FT_Close(handle)

    def _listed(self) -> list[tuple[str, str]]:
        """Return serial number and description of each bridge that the driver has."""
        count = ctypes.c_uint32()
        self._check(self._library.FT_CreateDeviceInfoList(ctypes.byref(count)), "looking for it")
        return [self._detail(index) for index in range(count.value)]

    def _detail(self, index: int) -> tuple[str, str]:
        numbers = [ctypes.c_uint32() for _ in range(4)]  # flags, type, ids, place: not needed
        serial = ctypes.create_string_buffer(_SERIAL_SIZE)
        description = ctypes.create_string_buffer(_DESCRIPTION_SIZE)
        references = [ctypes.byref(number) for number in numbers]
        status = self._library.FT_GetDeviceInfoDetail(
            index, *references, serial, description, ctypes.byref(ctypes.c_void_p())
        )
        self._check(status, "looking for it")
        return serial.value.decode("latin-1"), description.value.decode("latin-1")

    def _waiting(self) -> int:
        count = ctypes.c_uint32()
        self._check(self._library.FT_GetQueueStatus(self._opened(), ctypes.byref(count)), "receiving")
        return count.value

    def _receive(self, size: int) -> bytes:
        if size == 0:
            return b""
        buffer, received = ctypes.create_string_buffer(size), ctypes.c_uint32()
        self._check(self._library.FT_Read(self._opened(), buffer, size, ctypes.byref(received)), "receiving")
        return buffer.raw[: received.value]

    def _set_timeout(self, timeout_ms: int) -> None:
        if timeout_ms != self._timeout_ms:
            self._check(self._library.FT_SetTimeouts(self._opened(), timeout_ms, timeout_ms), "setting the bridge")
            self._timeout_ms = timeout_ms

    def _opened(self) -> Any:
        if self._handle is None:
            raise FalconLost("no-device", "using it after it was closed")
        return self._handle

    @staticmethod
    def _check(status: int, where: str) -> None:
        if status != 0:
            raise usb_failure(_CODES.get(status, constants.ERROR_IO), where)


def load_d2xx() -> Any:
    """Return FTDI's library; raise `UsbFailure` of kind "no-ftd2xx" where there is none."""
    loader = getattr(ctypes, "WinDLL", ctypes.CDLL)
    for name in LIBRARIES:
        try:
            return loader(name)
        except OSError:
            continue
    raise UsbFailure("no-ftd2xx", "loading FTDI's driver library")

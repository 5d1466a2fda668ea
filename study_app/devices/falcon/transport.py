"""Access to the Falcon's USB bridge, and which Falcons are connected.

`PyUsbTransport` uses pyusb, with libusb or another backend, such as the emulator's. `FtdiTransport` uses FTDI's own
driver (D2XX) on Windows, where Novint's driver blocks libusb. D2XX removes the status bytes from the stream, so they
are put back as zeros. It was written from FTDI's "D2XX Programmer's Guide" and tested only against a stand-in of the
library. No compiler is loaded before `calls` is used, since the guard process must be small.
"""

from __future__ import annotations

import ctypes
import errno
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any, Final, Protocol

import libusb_package
import usb.core  # type: ignore[import-untyped]
import usb.util  # type: ignore[import-untyped]

from study_app.devices.descriptor import DRIVER_READY, NONE, NOT_AVAILABLE, Backend
from study_app.devices.falcon import constants
from study_app.devices.falcon.constants import FLAG_HOMING, milliseconds, quiet_packet
from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure, failures_on, usb_failure
from study_app.errors import DeviceError

if TYPE_CHECKING:
    from study_app.devices.falcon.bulk import BulkCalls

PACKETS: Final = 10
_PACKET_INTERVAL_S: Final = 0.002
_WRITE_TIMEOUT_S: Final = 0.1


class Transport(Protocol):
    """An open bridge; all methods raise `UsbFailure`. ``serial`` is its serial number, if it reports one."""

    serial: str | None

    @property
    def name(self) -> str:
        """The argument with which `open_transport` opens it again."""
        return self.serial or ""

    def control(self, request: int, value: int) -> None:
        """Send a control request (``constants.REQUEST_*``) with its value."""

    def write(self, data: bytes, timeout_s: float) -> None: ...

    def read(self, size: int, timeout_s: float) -> bytes:
        """Read at most ``size`` bytes, a multiple of 64, including status bytes; return ``b""`` at the time-out."""

    def calls(self) -> BulkCalls:
        """Return handle and function address for compiled code, valid until `close` or `reopen`."""

    def now_s(self) -> float:
        return time.perf_counter()

    def pause(self, seconds: float) -> None:
        time.sleep(seconds)

    def reopen(self) -> None:
        """Close the bridge and open it again."""

    def close(self) -> None:
        """Release the bridge; a second call does nothing."""


def open_transport(name: str = "") -> Transport:
    """Return the bridge with this serial number, open; "": the first one."""
    serial = name or None
    try:
        return PyUsbTransport(serial=serial)
    except UsbFailure as failure:
        if os.name != "nt" or failure.kind not in {"not-supported", "not-found"}:
            raise
        try:
            return FtdiTransport(serial=serial)
        except UsbFailure as ftdi_failure:
            if ftdi_failure.kind == "not-found" and _find_falcons(libusb_package.get_libusb1_backend()):
                raise UsbFailure("two-drivers", "opening it") from None
            raise failure from None


def send_zero_torque(transport: Transport) -> int:
    """Send ``PACKETS`` packets of zero torque; return the number sent.

    The packets keep the homing flag, and the bridge's settings are unchanged, so the Falcon stays loaded and homed.
    """
    sent = 0
    for _ in range(PACKETS):
        with suppress(DeviceError):
            transport.write(quiet_packet(FLAG_HOMING), _WRITE_TIMEOUT_S)
            sent += 1
        transport.pause(_PACKET_INTERVAL_S)
    return sent


def end_torque(name: str) -> None:
    """Open the bridge ``name`` and send packets of zero torque; called by the guard."""
    transport = open_transport(name)
    try:
        if not send_zero_torque(transport):
            raise DeviceError("the device does not accept packets")
    finally:
        transport.close()


_INTERFACE = 0
_CONTROL_TIMEOUT_MS = 1000
_CODES: Final = {
    errno.EACCES: constants.ERROR_ACCESS,
    errno.EPERM: constants.ERROR_ACCESS,
    errno.ENODEV: constants.ERROR_NO_DEVICE,
    errno.ENOENT: constants.ERROR_NOT_FOUND,
    errno.EBUSY: constants.ERROR_BUSY,
    errno.ETIMEDOUT: constants.ERROR_TIMEOUT,
    errno.EOVERFLOW: constants.ERROR_OVERFLOW,
    errno.EPIPE: constants.ERROR_PIPE,
    errno.ENOSYS: constants.ERROR_NOT_SUPPORTED,
}


class PyUsbTransport(Transport):
    """The bridge over pyusb.

    Parameters
    ----------
    backend : pyusb's; None: libusb. Another backend may have its own clock and C functions: ``now_s()``,
        ``pause(seconds)``, ``c_calls(handle) -> BulkCalls`` with the handle returned by its ``open_device``.
    index : index of the Falcon if there are several
    serial : its serial number, which overrides ``index``
    """

    def __init__(self, backend: Any = None, *, index: int = 0, serial: str | None = None) -> None:
        self._backend: Any = backend if backend is not None else libusb_package.get_libusb1_backend()
        if self._backend is None:
            raise UsbFailure("no-libusb", "loading libusb")
        self._index = index
        self._device: Any = None
        self.serial = serial
        self.reopen()

    def reopen(self) -> None:
        self.close()
        with _converted_errors("looking for it"):
            devices = _find_falcons(self._backend)
        if self.serial is None:
            devices = devices[self._index :]
        else:  # a device with an unreadable number may be the right one; opening it then shows the error
            devices = [device for device in devices if _serial_of(device) in {self.serial, None}]
            devices.sort(key=lambda device: _serial_of(device) is None)
        if not devices:
            raise FalconNotFound("not-found", "looking for it")
        self._open(devices[0])

    def _open(self, device: Any) -> None:
        try:
            with _converted_errors("opening it"):
                _claim_interface(device)
            serial = _serial_of(device)
            if self.serial not in {None, serial}:
                raise FalconNotFound("not-found", f"looking for serial number {self.serial}")
        except UsbFailure:
            usb.util.dispose_resources(device)
            raise
        self._device, self.serial = device, serial

    def control(self, request: int, value: int) -> None:
        with _converted_errors("configuring the USB bridge"):
            self._open_device().ctrl_transfer(constants.REQUEST_TYPE, request, value, 0, None, _CONTROL_TIMEOUT_MS)

    def write(self, data: bytes, timeout_s: float) -> None:
        with _converted_errors("sending"):
            sent = self._open_device().write(constants.ENDPOINT_OUT, data, constants.milliseconds(timeout_s))
        if sent < len(data):
            raise usb_failure(constants.ERROR_TIMEOUT, "sending")

    def read(self, size: int, timeout_s: float) -> bytes:
        """Return the bytes of one read, b"" at the time-out."""
        if size <= 0 or size % constants.USB_PACKET:
            raise ValueError(f"the size of a read must be a multiple of {constants.USB_PACKET} bytes, not {size}")
        try:
            with _converted_errors("receiving"):
                return bytes(self._open_device().read(constants.ENDPOINT_IN, size, constants.milliseconds(timeout_s)))
        except UsbFailure as failure:
            if failure.kind == "timeout":
                return b""
            raise

    def calls(self) -> BulkCalls:
        handle = self._open_device()._ctx.handle  # noqa: SLF001 - pyusb has no public way to it
        backend_calls = getattr(self._backend, "c_calls", None)
        if backend_calls is not None:
            return backend_calls(handle)  # type: ignore[no-any-return]
        return libusb_calls(self._backend.lib, handle.handle)

    def now_s(self) -> float:
        backend_now_s = getattr(self._backend, "now_s", None)
        return time.perf_counter() if backend_now_s is None else float(backend_now_s())

    def pause(self, seconds: float) -> None:
        getattr(self._backend, "pause", time.sleep)(seconds)

    def close(self) -> None:
        device, self._device = self._device, None
        if device is not None:
            with suppress(usb.core.USBError, NotImplementedError):  # it may be unplugged
                usb.util.dispose_resources(device)

    def _open_device(self) -> Any:
        if self._device is None:
            raise FalconLost("no-device", "using it after it had been closed")
        return self._device


def _find_falcons(backend: Any) -> list[Any]:
    """Return pyusb's device of each Falcon on ``backend``, opened or not."""
    devices = usb.core.find(
        find_all=True, backend=backend, idVendor=constants.VENDOR_ID, idProduct=constants.PRODUCT_ID
    )
    return list(devices)


def _serial_of(device: Any) -> str | None:
    """Return the serial number of pyusb's ``device``; None if it has none or cannot be read."""
    with suppress(usb.core.USBError, ValueError, NotImplementedError):
        return device.serial_number or None
    return None


def libusb_calls(library: Any, handle: Any) -> BulkCalls:
    """Return ``libusb_bulk_transfer`` of a ctypes ``library``, and the ctypes pointer ``handle``, as addresses."""
    from study_app.devices.falcon.bulk import BulkCalls  # noqa: PLC0415 - loads the compiler

    transfer = ctypes.cast(library.libusb_bulk_transfer, ctypes.c_void_p)
    return BulkCalls(handle=handle.value or 0, transfer=transfer.value or 0)


def _claim_interface(device: Any) -> None:
    """Open and claim pyusb's ``device`` without a reset, so that a running Falcon continues."""
    try:
        device.get_active_configuration()
    except usb.core.USBError as error:
        if error.backend_error_code is not None or error.errno is not None:
            raise
        device.set_configuration()  # pyusb's own error: the device has no configuration yet
    try:
        is_active = device.is_kernel_driver_active(_INTERFACE)
    except NotImplementedError:
        is_active = False  # not available on this system
    if is_active:
        try:
            device.detach_kernel_driver(_INTERFACE)
        except (usb.core.USBError, NotImplementedError) as error:
            raise UsbFailure("kernel-driver", "opening it", _error_code(error)) from error
    usb.util.claim_interface(device, _INTERFACE)


@contextmanager
def _converted_errors(where: str) -> Iterator[None]:
    """Convert pyusb's errors into `UsbFailure`."""
    try:
        yield
    except (usb.core.USBError, NotImplementedError) as error:
        raise usb_failure(_error_code(error), where) from error


def _error_code(error: Exception) -> int:
    """Return libusb's code of an error of pyusb, which has a separate class for "not supported"."""
    if isinstance(error, NotImplementedError):
        return constants.ERROR_NOT_SUPPORTED
    code = getattr(error, "backend_error_code", None)
    if code is not None and code < 0:
        return int(code)
    return _CODES.get(getattr(error, "errno", None) or 0, constants.ERROR_IO)


LIBRARIES: Final = ("ftd2xx64.dll", "ftd2xx.dll")
_SERIAL_SIZE, _DESCRIPTION_SIZE = 16, 64
_DATA_BYTES = constants.USB_PACKET - constants.STATUS_BYTES
_D2XX_CODES: Final = {
    1: constants.ERROR_NO_DEVICE,  # FT_INVALID_HANDLE
    2: constants.ERROR_NOT_FOUND,  # FT_DEVICE_NOT_FOUND
    3: constants.ERROR_BUSY,  # FT_DEVICE_NOT_OPENED: another program has opened it
    4: constants.ERROR_NO_DEVICE,  # FT_IO_ERROR: the bridge was unplugged
}
_PURGE_RX, _PURGE_TX = 1, 2
_EIGHT_BITS = 8

_Setter = Callable[[Any, Any, int], int]
"""(library, handle, value of the control request) -> FT_STATUS."""


def _reset_or_purge(library: Any, handle: Any, value: int) -> int:
    masks = {constants.PURGE_RX: _PURGE_RX, constants.PURGE_TX: _PURGE_TX}
    return int(library.FT_Purge(handle, masks[value]) if value in masks else library.FT_ResetDevice(handle))


def _set_modem_line(library: Any, handle: Any, value: int) -> int:
    names = {
        constants.DTR_HIGH: "FT_SetDtr",
        constants.DTR_LOW: "FT_ClrDtr",
        constants.RTS_HIGH: "FT_SetRts",
        constants.RTS_LOW: "FT_ClrRts",
    }
    return int(getattr(library, names[value])(handle))


def _set_event_character(library: Any, handle: Any, value: int) -> int:
    return int(library.FT_SetChars(handle, value & 0xFF, 1 if value & constants.EVENT_ENABLED else 0, 0, 0))


_SETTERS: Final[dict[int, _Setter]] = {
    constants.REQUEST_RESET: _reset_or_purge,
    constants.REQUEST_MODEM: _set_modem_line,
    constants.REQUEST_FLOW: lambda library, handle, _: int(library.FT_SetFlowControl(handle, 0, 0, 0)),
    constants.REQUEST_BAUD: lambda library, handle, value: int(library.FT_SetDivisor(handle, value)),
    constants.REQUEST_LINE: lambda library, handle, _: int(
        library.FT_SetDataCharacteristics(handle, _EIGHT_BITS, 0, 0)
    ),
    constants.REQUEST_EVENT_CHARACTER: _set_event_character,
    constants.REQUEST_LATENCY: lambda library, handle, value: int(library.FT_SetLatencyTimer(handle, value)),
}


class FtdiTransport(Transport):
    """The bridge over D2XX.

    Parameters
    ----------
    library : D2XX as loaded by ctypes; None: it is loaded by its name
    serial : serial number of the Falcon; None: the first
    """

    def __init__(self, library: Any = None, *, serial: str | None = None) -> None:
        self._library = load_d2xx() if library is None else library
        self._handle: Any = None
        self._timeout_ms = 0
        self._memory: Any = None
        self.serial = serial
        self.reopen()

    def reopen(self) -> None:
        self.close()
        self._timeout_ms = 0
        for index, (serial, description) in enumerate(self._list_bridges()):
            if constants.PRODUCT in description and self.serial in {None, serial}:
                handle = ctypes.c_void_p()
                self._raise_for_status(self._library.FT_Open(index, ctypes.byref(handle)), "opening it")
                self._handle, self.serial = handle, serial or None
                return
        raise FalconNotFound("not-found", "looking for it with FTDI's driver")

    def control(self, request: int, value: int) -> None:
        self._raise_for_status(
            _SETTERS[request](self._library, self._open_handle(), value), "configuring the USB bridge"
        )

    def write(self, data: bytes, timeout_s: float) -> None:
        handle, sent = self._open_handle(), ctypes.c_uint32()
        self._set_timeout(milliseconds(timeout_s))
        self._raise_for_status(self._library.FT_Write(handle, data, len(data), ctypes.byref(sent)), "sending")
        if sent.value < len(data):
            raise usb_failure(constants.ERROR_TIMEOUT, "sending")

    def read(self, size: int, timeout_s: float) -> bytes:
        """Wait for a first byte and return the available bytes as one packet of the bridge; b"" at the time-out."""
        if size <= 0 or size % constants.USB_PACKET:
            raise ValueError(f"the size of a read must be a multiple of {constants.USB_PACKET} bytes, not {size}")
        self._set_timeout(milliseconds(timeout_s))
        data = self._receive(min(max(self._waiting_bytes(), 1), _DATA_BYTES))
        if len(data) == 1:  # more bytes may have arrived while waiting
            data += self._receive(min(self._waiting_bytes(), _DATA_BYTES - 1))
        return bytes(constants.STATUS_BYTES) + data if data else b""

    def calls(self) -> BulkCalls:
        from study_app.devices.falcon.bulk import BulkCalls, bridge_record, transfer  # noqa: PLC0415 - likewise

        self._memory = bridge_record(self._library, self._open_handle())
        self._timeout_ms = 0  # the C function sets its own time-out
        return BulkCalls(handle=int(self._memory.ctypes.data), transfer=int(transfer().address))

    def close(self) -> None:
        handle, self._handle = self._handle, None
        if handle is not None:
            self._library.FT_Close(handle)

    def _list_bridges(self) -> list[tuple[str, str]]:
        """Return serial number and description of each bridge that the driver lists."""
        count = ctypes.c_uint32()
        self._raise_for_status(self._library.FT_CreateDeviceInfoList(ctypes.byref(count)), "looking for it")
        return [self._bridge_info(index) for index in range(count.value)]

    def _bridge_info(self, index: int) -> tuple[str, str]:
        numbers = [ctypes.c_uint32() for _ in range(4)]  # flags, type, ids, location: not needed
        serial = ctypes.create_string_buffer(_SERIAL_SIZE)
        description = ctypes.create_string_buffer(_DESCRIPTION_SIZE)
        references = [ctypes.byref(number) for number in numbers]
        status = self._library.FT_GetDeviceInfoDetail(
            index, *references, serial, description, ctypes.byref(ctypes.c_void_p())
        )
        self._raise_for_status(status, "looking for it")
        return serial.value.decode("latin-1"), description.value.decode("latin-1")

    def _waiting_bytes(self) -> int:
        count = ctypes.c_uint32()
        self._raise_for_status(self._library.FT_GetQueueStatus(self._open_handle(), ctypes.byref(count)), "receiving")
        return count.value

    def _receive(self, size: int) -> bytes:
        if size == 0:
            return b""
        buffer, received = ctypes.create_string_buffer(size), ctypes.c_uint32()
        self._raise_for_status(
            self._library.FT_Read(self._open_handle(), buffer, size, ctypes.byref(received)), "receiving"
        )
        return buffer.raw[: received.value]

    def _set_timeout(self, timeout_ms: int) -> None:
        if timeout_ms != self._timeout_ms:
            self._raise_for_status(
                self._library.FT_SetTimeouts(self._open_handle(), timeout_ms, timeout_ms), "configuring the USB bridge"
            )
            self._timeout_ms = timeout_ms

    def _open_handle(self) -> Any:
        if self._handle is None:
            raise FalconLost("no-device", "using it after it had been closed")
        return self._handle

    @staticmethod
    def _raise_for_status(status: int, where: str) -> None:
        if status != 0:
            raise usb_failure(_D2XX_CODES.get(status, constants.ERROR_IO), where)


def load_d2xx() -> Any:
    """Return FTDI's library; raise `UsbFailure` of kind "no-ftd2xx" if it is not installed."""
    loader = getattr(ctypes, "WinDLL", ctypes.CDLL)
    for name in LIBRARIES:
        try:
            return loader(name)
        except OSError:
            continue
    raise UsbFailure("no-ftd2xx", "loading FTDI's driver library")


def probe(usb: Any = None, platform: str = sys.platform) -> Backend:
    """Return the state of libusb, or another backend of pyusb, on a platform."""
    can = "force up to 8 N; load its firmware and home it each time it is turned on"
    by = f"libusb {_package_version()}"
    usb = usb if usb is not None else libusb_package.get_libusb1_backend()
    if usb is None:
        return Backend("falcon", by, state=NOT_AVAILABLE, can=can, why=failures_on(platform).mode("no-libusb").cure)
    falcons = _find_falcons(usb)
    if not falcons:
        return Backend("falcon", by, state=NONE, can=can, why=failures_on(platform).mode("not-connected").cure)
    serials = [_serial_of(falcon) for falcon in falcons]
    why = ""
    if None in serials:
        cause = failures_on(platform).mode("driver" if platform == "win32" else "permission").cause
        why = f"one Falcon does not report its serial number, perhaps because {cause}: run liquid-study devices doctor"
    return Backend(
        "falcon", by, state="connected: " + ", ".join(serial or "unnamed" for serial in serials), can=can, why=why
    )


def probe_ftdi(d2xx: Any = None, platform: str = sys.platform) -> Backend:
    """Return whether FTDI's driver can be used on a platform, with its library or the one that loads."""
    can = "the same device through FTDI's or Novint's driver; used automatically if libusb cannot open the device"
    if platform != "win32":
        return Backend(
            "falcon", "ftd2xx", state=NOT_AVAILABLE, can=can, why="only on Windows, where drivers may block libusb"
        )
    try:
        load_d2xx() if d2xx is None else d2xx
    except UsbFailure as failure:
        return Backend("falcon", "ftd2xx", state=NOT_AVAILABLE, can=can, why=str(failure))
    return Backend("falcon", "ftd2xx", state=DRIVER_READY, can=can)


def _package_version() -> str:
    try:
        return version("libusb-package")
    except PackageNotFoundError:
        return "(not installed)"

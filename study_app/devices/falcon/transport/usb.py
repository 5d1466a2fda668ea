"""A Falcon through libusb."""

from __future__ import annotations

import ctypes
import errno
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final

import libusb_package
import usb.core  # type: ignore[import-untyped]
import usb.util  # type: ignore[import-untyped]

from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure, usb_failure
from study_app.devices.falcon.wire import constants

if TYPE_CHECKING:
    from study_app.devices.falcon.transport.bulk_calls import BulkCalls


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


class PyUsbTransport:
    """The bridge over pyusb.

    Parameters
    ----------
    backend : pyusb's; None: libusb. One that is not libusb may bring its own clock and C functions: ``now_s()``,
        ``pause(seconds)``, ``c_calls(handle) -> BulkCalls`` with the handle that its ``open_device`` gave.
    index : which Falcon, of several
    serial : its serial number; then ``index`` does not count
    """

    def __init__(self, backend: Any = None, *, index: int = 0, serial: str | None = None) -> None:
        self._backend: Any = backend if backend is not None else libusb_package.get_libusb1_backend()
        if self._backend is None:
            raise UsbFailure("no-backend", "loading libusb")
        self._index = index
        self._device: Any = None
        self.serial = serial
        self.reopen()

    @property
    def name(self) -> str:
        """The word by which ``open_transport`` opens it again."""
        return "falcon" if self.serial is None else f"falcon:{self.serial}"

    def reopen(self) -> None:
        """Close it and open it again, as new."""
        self.close()
        with _failures("looking for it"):
            found = find_falcons(self._backend)
        if self.serial is None:
            found = found[self._index :]
        else:  # one that does not tell its number may be the one, and say why when it is opened
            found = [device for device in found if serial_of(device) in {self.serial, None}]
            found.sort(key=lambda device: serial_of(device) is None)
        if not found:
            raise FalconNotFound("not-found", "looking for it")
        self._open(found[0])

    def _open(self, device: Any) -> None:
        try:
            with _failures("opening it"):
                _claim(device)
            serial = serial_of(device)
            if self.serial not in {None, serial}:
                raise FalconNotFound("not-found", f"looking for number {self.serial}")
        except UsbFailure:
            usb.util.dispose_resources(device)
            raise
        self._device, self.serial = device, serial

    def control(self, request: int, value: int) -> None:
        """Send a control request with its value."""
        with _failures("setting the bridge"):
            self._open_device().ctrl_transfer(constants.REQUEST_TYPE, request, value, 0, None, _CONTROL_TIMEOUT_MS)

    def write(self, data: bytes, timeout_s: float) -> None:
        """Send all of ``data``."""
        with _failures("sending"):
            sent = self._open_device().write(constants.ENDPOINT_OUT, data, constants.milliseconds(timeout_s))
        if sent < len(data):
            raise usb_failure(constants.ERROR_TIMEOUT, "sending")

    def read(self, size: int, timeout_s: float) -> bytes:
        """Return what one read gives; nothing when the time is out."""
        if size <= 0 or size % constants.USB_PACKET:
            raise ValueError(f"a read asks for a multiple of {constants.USB_PACKET} bytes, not {size}")
        try:
            with _failures("receiving"):
                return bytes(self._open_device().read(constants.ENDPOINT_IN, size, constants.milliseconds(timeout_s)))
        except UsbFailure as failure:
            if failure.kind == "timeout":
                return b""
            raise

    def calls(self) -> BulkCalls:
        """Return the bridge as compiled code sees it; good until `close` or `reopen`."""
        handle = self._open_device()._ctx.handle  # noqa: SLF001 - pyusb has no public way to it
        own = getattr(self._backend, "c_calls", None)
        if own is not None:
            return own(handle)  # type: ignore[no-any-return]
        return libusb_calls(self._backend.lib, handle.handle)

    def now_s(self) -> float:
        """Return the time on the backend's clock, or the machine's [s]."""
        own = getattr(self._backend, "now_s", None)
        return time.monotonic() if own is None else float(own())

    def pause(self, seconds: float) -> None:
        """Let that clock pass."""
        getattr(self._backend, "pause", time.sleep)(seconds)

    def close(self) -> None:
        """Let go of it; a second call does nothing."""
        device, self._device = self._device, None
        if device is not None:
            with suppress(usb.core.USBError, NotImplementedError):  # it may be gone
                usb.util.dispose_resources(device)

    def _open_device(self) -> Any:
        if self._device is None:
            raise FalconLost("no-device", "using it after it was closed")
        return self._device


def find_falcons(backend: Any) -> list[Any]:
    """Return pyusb's device of each Falcon that ``backend`` sees, opened or not."""
    found = usb.core.find(find_all=True, backend=backend, idVendor=constants.VENDOR_ID, idProduct=constants.PRODUCT_ID)
    return list(found)


def serial_of(device: Any) -> str | None:
    """Return the serial number of pyusb's ``device``; None where it has none, or does not let itself be asked."""
    with suppress(usb.core.USBError, ValueError, NotImplementedError):
        return device.serial_number or None
    return None


def libusb_calls(library: Any, handle: Any) -> BulkCalls:
    """Return ``libusb_bulk_transfer`` of a ctypes ``library``, and the ctypes pointer ``handle``, as addresses."""
    from study_app.devices.falcon.transport.bulk_calls import BulkCalls  # noqa: PLC0415 - loads the compiler

    transfer = ctypes.cast(library.libusb_bulk_transfer, ctypes.c_void_p)
    return BulkCalls(handle=handle.value or 0, transfer=transfer.value or 0)


def _claim(device: Any) -> None:
    """Open and claim pyusb's ``device``, without a reset: a Falcon that runs shall run on."""
    try:
        device.get_active_configuration()
    except usb.core.USBError as error:
        if error.backend_error_code is not None or error.errno is not None:
            raise
        device.set_configuration()  # pyusb's own word that there is none yet
    try:
        held = device.is_kernel_driver_active(_INTERFACE)
    except NotImplementedError:
        held = False  # only Linux knows
    if held:
        try:
            device.detach_kernel_driver(_INTERFACE)
        except (usb.core.USBError, NotImplementedError) as error:
            raise UsbFailure("kernel-driver", "opening it", _code(error)) from error
    usb.util.claim_interface(device, _INTERFACE)


@contextmanager
def _failures(where: str) -> Iterator[None]:
    """Turn pyusb's errors into ours."""
    try:
        yield
    except (usb.core.USBError, NotImplementedError) as error:
        raise usb_failure(_code(error), where) from error


def _code(error: Exception) -> int:
    """Return libusb's code of an error of pyusb, which says "not supported" with a class of its own."""
    if isinstance(error, NotImplementedError):
        return constants.ERROR_NOT_SUPPORTED
    code = getattr(error, "backend_error_code", None)
    if code is not None and code < 0:
        return int(code)
    return _CODES.get(getattr(error, "errno", None) or 0, constants.ERROR_IO)

"""What can go wrong on the way to the Falcon: a kind, libusb's code for it, and a sentence."""

from __future__ import annotations

from typing import Final

from study_app.devices.falcon import wire
from study_app.errors import DeviceError, DeviceLost, DeviceNotFound

KINDS: Final = {
    wire.ERROR_IO: "io",
    wire.ERROR_ACCESS: "access",
    wire.ERROR_NO_DEVICE: "no-device",
    wire.ERROR_NOT_FOUND: "not-found",
    wire.ERROR_BUSY: "busy",
    wire.ERROR_TIMEOUT: "timeout",
    wire.ERROR_OVERFLOW: "overflow",
    wire.ERROR_PIPE: "pipe",
    wire.ERROR_NOT_SUPPORTED: "not-supported",
}
MEANINGS: Final = {
    "io": "the transfer failed: check cable and port",
    "access": "this account may not open it: give it the permission, then plug the Falcon in again",
    "no-device": "it is no longer there: check the cable and plug it in again",
    "not-found": "none is connected: plug it in, and its mains adapter",
    "busy": "another program holds it: close that program",
    "timeout": "it did not answer in time: check its mains adapter and cable",
    "overflow": "it sent more than was asked for: plug it in again",
    "pipe": "it refused the transfer: plug it in again",
    "not-supported": "its present driver does not let programs open it: install WinUSB or FTDI's own driver for it",
    "kernel-driver": "a driver of the system holds it and does not let go: unload ftdi_sio",
    "no-backend": "libusb cannot be loaded: install libusb-package again",
    "no-ftd2xx": "FTDI's driver library (ftd2xx) cannot be loaded: install FTDI's D2XX driver",
}


class UsbFailure(DeviceError):
    """A transfer, or the way to it, failed.

    ``kind`` is the word by which diagnosis knows it (a key of ``MEANINGS``), ``where`` what was being done, ``code``
    libusb's error, None where no transfer was tried.
    """

    def __init__(self, kind: str, where: str, code: int | None = None) -> None:
        self.kind = kind
        self.where = where
        self.code = code
        libusb = "" if code is None else f", libusb error {code}"
        super().__init__(f"the Falcon cannot be used ({where}{libusb}): {MEANINGS[kind]}")


class FalconNotFound(UsbFailure, DeviceNotFound):
    """There is none."""


class FalconLost(UsbFailure, DeviceLost):
    """It was there."""


def usb_failure(code: int, where: str) -> UsbFailure:
    """Return the error to raise for libusb's ``code``, which came while doing ``where``."""
    kind = KINDS.get(code, "io")
    classes: dict[str, type[UsbFailure]] = {"no-device": FalconLost, "not-found": FalconNotFound}
    return classes.get(kind, UsbFailure)(kind, where, code)

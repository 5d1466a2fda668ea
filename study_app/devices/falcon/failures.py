"""What can go wrong on the way to the Falcon: a kind, libusb's code for it, and a sentence."""

from typing import Final

from study_app.devices.falcon.facts import Facts
from study_app.devices.falcon.failure_modes import sentence
from study_app.devices.falcon.wire import constants
from study_app.errors import DeviceError, DeviceLost, DeviceNotFound

KINDS: Final = {
    constants.ERROR_IO: "io",
    constants.ERROR_ACCESS: "access",
    constants.ERROR_NO_DEVICE: "no-device",
    constants.ERROR_NOT_FOUND: "not-found",
    constants.ERROR_BUSY: "busy",
    constants.ERROR_TIMEOUT: "timeout",
    constants.ERROR_OVERFLOW: "overflow",
    constants.ERROR_PIPE: "pipe",
    constants.ERROR_NOT_SUPPORTED: "not-supported",
}
FURTHER_KINDS: Final = ("kernel-driver", "no-backend", "no-ftd2xx")
"""What keeps it from being opened before libusb has a code for it."""


class FalconFailure(DeviceError):
    """Something keeps the Falcon from being used; ``facts`` are what was seen of it."""

    def __init__(self, message: str, facts: Facts) -> None:
        self.facts = facts
        super().__init__(message)


class ProgramMissing(FalconFailure):
    """It needs its firmware, and none was given, or what was given is none."""


class UsbFailure(FalconFailure):
    """A transfer, or the way to it, failed.

    ``kind`` is the word by which `failure_modes` knows it (of ``KINDS`` or ``FURTHER_KINDS``), ``where`` what was being
    done, ``code`` libusb's error, None where no transfer was tried.
    """

    def __init__(self, kind: str, where: str, code: int | None = None) -> None:
        self.kind = kind
        self.where = where
        self.code = code
        libusb = "" if code is None else f", libusb error {code}"
        facts = Facts(usb=kind)
        super().__init__(f"the Falcon cannot be used ({where}{libusb}): {sentence(facts)}", facts)


class FalconNotFound(UsbFailure, DeviceNotFound):
    """There is none."""


class FalconLost(UsbFailure, DeviceLost):
    """It was there."""


def usb_failure(code: int, where: str) -> UsbFailure:
    """Return the error to raise for libusb's ``code``, which came while doing ``where``."""
    kind = KINDS.get(code, "io")
    classes: dict[str, type[UsbFailure]] = {"no-device": FalconLost, "not-found": FalconNotFound}
    return classes.get(kind, UsbFailure)(kind, where, code)

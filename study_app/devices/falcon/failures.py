"""The failure modes of a Falcon on each system.

They were collected from reports of owners of Falcons about other drivers, and from the documentation of FTDI, libusb
and systemd; none was observed by us on a Falcon. Importing this module loads neither the compiler nor a driver.
"""

import sys
from pathlib import Path
from typing import Final

from study_app.devices.doctor import DeviceFailure, FailureTable, read_failures
from study_app.devices.falcon import constants
from study_app.devices.falcon.constants import PRODUCT_ID, VENDOR_ID
from study_app.errors import DeviceLost, DeviceNotFound

_RULES_FILE: Final = "/etc/udev/rules.d/60-falcon.rules"
UDEV_RULE: Final = (
    f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{VENDOR_ID:04x}", ATTR{{idProduct}}=="{PRODUCT_ID:04x}", TAG+="uaccess"'
)
MOST_BROKEN: Final = 0.005
LONGEST_ROUND_TRIP_S: Final = 0.002
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
FURTHER_KINDS: Final = ("kernel-driver", "no-libusb", "no-ftd2xx", "two-drivers")
"""Failures of opening without a libusb error code."""


def failures_on(platform: str) -> FailureTable:
    """Return the failure modes on a system, named as in ``sys.platform``."""
    phrases = {
        "rule": UDEV_RULE,
        "rules_file": _RULES_FILE,
        "MOST_BROKEN": MOST_BROKEN,
        "slow_ms": 1000 * LONGEST_ROUND_TRIP_S,
    }
    return read_failures(Path(__file__).with_name("failures.toml"), platform, **phrases)


FAILURES: Final = failures_on(sys.platform)


class UsbFailure(DeviceFailure):
    """A transfer, or its preparation, failed.

    ``kind`` is one of ``KINDS`` or ``FURTHER_KINDS``, ``where`` the operation, ``code`` libusb's error, None before any
    transfer.
    """

    def __init__(self, kind: str, where: str, code: int | None = None) -> None:
        self.kind, self.code = kind, code
        modes = {
            "access": "busy" if sys.platform == "win32" else "permission",
            "no-device": "unplugged",
            "not-found": "not-connected",
            "not-supported": "driver",
        }
        mode = modes.get(kind, "transfer" if kind in KINDS.values() and kind != "busy" else kind)
        libusb = "" if code is None else f", libusb error {code}"
        tables = FAILURES, failures_on("win32"), failures_on("linux")
        table = next(table for table in tables if mode in {entry.id for entry in table.modes})
        super().__init__(mode, str(table.failure(mode, f"while {where}{libusb}")))


class FalconNotFound(UsbFailure, DeviceNotFound):
    """No Falcon is connected."""


class FalconLost(UsbFailure, DeviceLost):
    """The connection to the Falcon was lost."""


def usb_failure(code: int, where: str) -> UsbFailure:
    """Return the error to raise for libusb's ``code`` in the operation ``where``."""
    kind = KINDS.get(code, "io")
    classes: dict[str, type[UsbFailure]] = {"no-device": FalconLost, "not-found": FalconNotFound}
    return classes.get(kind, UsbFailure)(kind, where, code)

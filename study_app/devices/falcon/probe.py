"""Which Falcons are connected, and why one cannot be used. Looks, and opens nothing; loads no compiler."""

import sys
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from study_app.devices.descriptor import DRIVER_READY, NONE, NOT_AVAILABLE, Backend
from study_app.devices.falcon.failures import BY_ID, UsbFailure


def probe(usb: Any = None, platform: str = sys.platform) -> Backend:
    """Return what libusb finds.

    Parameters
    ----------
    usb : pyusb's backend; None: libusb
    platform : as ``sys.platform`` says it
    """
    can = "force up to 8 N; needs firmware after it was turned on, and homing"
    import libusb_package  # noqa: PLC0415 - loads libusb

    from study_app.devices.falcon.transport.usb import find_falcons, serial_of  # noqa: PLC0415 - likewise

    by = f"libusb {_version()}"
    usb = usb if usb is not None else libusb_package.get_libusb1_backend()
    if usb is None:
        return Backend("falcon", by, NOT_AVAILABLE, can, BY_ID["no-libusb"].cure(platform))
    found = find_falcons(usb)
    if not found:
        return Backend("falcon", by, NONE, can, BY_ID["not-connected"].cure(platform))
    serials = [serial_of(one) for one in found]
    why = ""
    if None in serials:
        mode = {"win32": "windows-driver", "darwin": "mac-driver"}.get(platform, "permission")
        why = (
            f"one does not report its serial number; perhaps {BY_ID[mode].cause}: liquid-study devices doctor finds out"
        )
    return Backend("falcon", by, "connected: " + ", ".join(serial or "unnamed" for serial in serials), can, why)


def probe_ftdi(d2xx: Any = None, platform: str = sys.platform) -> Backend:
    """Return whether FTDI's driver can be used.

    Parameters
    ----------
    d2xx : FTDI's library; None: it is loaded
    platform : as ``sys.platform`` says it
    """
    can = "the same, where FTDI's or Novint's driver is bound to it; taken by itself where libusb may not open it"
    if platform != "win32":
        return Backend("falcon", "ftd2xx", NOT_AVAILABLE, can, "for Windows alone, where drivers keep libusb out")
    from study_app.devices.falcon.transport.ftdi import load_d2xx  # noqa: PLC0415 - not needed elsewhere

    try:
        load_d2xx() if d2xx is None else d2xx
    except UsbFailure as failure:
        return Backend("falcon", "ftd2xx", NOT_AVAILABLE, can, str(failure))
    return Backend("falcon", "ftd2xx", DRIVER_READY, can)


def _version() -> str:
    try:
        return version("libusb-package")
    except PackageNotFoundError:
        return "(not installed)"

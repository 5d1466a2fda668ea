"""What can be felt with on this machine: every backend, what of it is connected, and why it cannot be used.

Looks, and opens nothing. Loads neither the compiler nor, before they are asked for, the drivers.
"""

from __future__ import annotations

import socket
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

from study_app.devices.falcon.diagnosis import BY_ID
from study_app.errors import DeviceError

READY: Final = "ready"
NONE: Final = "none connected"
NOT_HERE: Final = "not here"


@dataclass(frozen=True, slots=True)
class Backend:
    """``name`` is for ``--device``, ``by`` the library, ``state`` one of the words or what was found.

    ``can`` says what it can and cannot do, ``why`` why it cannot be used now ("" where it can).
    """

    name: str
    by: str
    state: str
    can: str
    why: str = ""


def backends(*, usb: Any = None, hid: Any = None, d2xx: Any = None, platform: str = sys.platform) -> list[Backend]:
    """Return every backend, the default first.

    Parameters
    ----------
    usb : pyusb's backend; None: libusb
    hid : hidapi's module; None: it is loaded
    d2xx : FTDI's library; None: it is loaded
    platform : as ``sys.platform`` says it
    """
    return [
        Backend("mouse", "the window", READY, "seen, not felt: the ball lags and coasts as the liquid commands"),
        _spacemouse(hid),
        _falcon(usb, platform),
        _falcon_by_ftdi(d2xx, platform),
        Backend("scripted", "the program", READY, "moves by itself; nothing is felt; every row says simulated"),
        Backend(
            "falcon-emulated", "the program", READY, "moves by itself; the Falcon's own driver before an emulated one"
        ),
        _socket(),
    ]


def _falcon(usb: Any, platform: str) -> Backend:
    can = "felt, up to 8 N; needs its firmware after it was switched on, and homing"
    import libusb_package  # noqa: PLC0415 - loads libusb

    from study_app.devices.falcon.transport.usb import find_falcons, serial_of  # noqa: PLC0415 - likewise

    by = f"libusb {_version('libusb-package')}"
    usb = usb if usb is not None else libusb_package.get_libusb1_backend()
    if usb is None:
        return Backend("falcon", by, NOT_HERE, can, BY_ID["no-libusb"].cure(platform))
    found = find_falcons(usb)
    if not found:
        return Backend("falcon", by, NONE, can, BY_ID["not-connected"].cure(platform))
    serials = [serial_of(one) for one in found]
    why = ""
    if None in serials:
        mode = {"win32": "windows-driver", "darwin": "mac-driver"}.get(platform, "permission")
        why = f"one does not tell its serial number; perhaps {BY_ID[mode].cause}: liquid-study devices doctor finds out"
    return Backend("falcon", by, _found([serial or "unnamed" for serial in serials]), can, why)


def _falcon_by_ftdi(d2xx: Any, platform: str) -> Backend:
    can = "the same, where FTDI's or Novint's driver is bound to it; taken by itself where libusb may not open it"
    if platform != "win32":
        return Backend("falcon", "ftd2xx", NOT_HERE, can, "for Windows alone, where drivers keep libusb out")
    from study_app.devices.falcon.failures import UsbFailure  # noqa: PLC0415 - not needed elsewhere
    from study_app.devices.falcon.transport.ftdi import load_d2xx  # noqa: PLC0415 - likewise

    try:
        load_d2xx() if d2xx is None else d2xx
    except UsbFailure as failure:
        return Backend("falcon", "ftd2xx", NOT_HERE, can, str(failure))
    return Backend("falcon", "ftd2xx", READY, can)


def _spacemouse(hid: Any) -> Backend:
    can = "seen, not felt: how far its cap is pushed is how fast the ball is drawn along"
    from study_app.devices.spacemouse.hid import find_space_mice, load_hid  # noqa: PLC0415 - loads numpy

    by = f"hidapi {_version('hidapi')}"
    try:
        found = find_space_mice(load_hid() if hid is None else hid)
    except (DeviceError, OSError) as error:
        return Backend("spacemouse", by, NOT_HERE, can, str(error))
    if not found:
        return Backend("spacemouse", by, NONE, can, "plug one of 3Dconnexion's in, or switch it on")
    return Backend("spacemouse", by, _found(sorted({model.name for model, _ in found})), can)


def _socket() -> Backend:
    can = "a Falcon that another program emulates: liquid-study emulate-falcon --socket PATH"
    if getattr(socket, "AF_UNIX", None) is None:
        return Backend("falcon-socket:PATH", "a Unix socket", NOT_HERE, can, "this system's Python has no Unix sockets")
    return Backend("falcon-socket:PATH", "a Unix socket", READY, can)


def _found(names: list[str]) -> str:
    return "connected: " + ", ".join(names)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"

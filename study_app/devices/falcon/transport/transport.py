"""The way to the Falcon's USB bridge, and what can go wrong on it.

`PyUsbTransport` goes over pyusb, with libusb or with any other backend of it, such as the emulator's;
``transport_ftdi`` over FTDI's own driver on Windows; ``transport_socket`` over a socket, to an emulator in another
process. None of them loads the compiler before its `calls` are asked for: the guard must be small.
"""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING, Final, Protocol

from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure, usb_failure
from study_app.devices.falcon.wire.constants import FLAG_HOMING, quiet_packet
from study_app.errors import DeviceError, DeviceNotFound

if TYPE_CHECKING:
    from study_app.devices.falcon.transport.bulk_calls import BulkCalls
from study_app.devices.falcon.transport.usb import PyUsbTransport

__all__ = ["FalconLost", "FalconNotFound", "PyUsbTransport", "Transport", "UsbFailure", "open_transport", "usb_failure"]

PACKETS: Final = 10
_BETWEEN_S: Final = 0.002
_WRITE_S: Final = 0.1


class Transport(Protocol):
    """An open bridge; all methods raise `UsbFailure`."""

    @property
    def name(self) -> str:
        """The word by which `open_transport` opens it again."""
        ...

    @property
    def serial(self) -> str | None:
        """Its serial number, if it reports one."""
        ...

    def control(self, request: int, value: int) -> None:
        """Send a control request (``wire.REQUEST_*``) with its value."""
        ...

    def write(self, data: bytes, timeout_s: float) -> None:
        """Send all of ``data``."""
        ...

    def read(self, size: int, timeout_s: float) -> bytes:
        """Return what one read of at most ``size`` bytes, a multiple of 64, gives, status bytes and all.

        Nothing at all (``b""``) when the time is out.
        """
        ...

    def calls(self) -> BulkCalls:
        """Return the bridge as compiled code sees it; good until `close` or `reopen`."""
        ...

    def now_s(self) -> float:
        """Return the time on the clock that its time-outs run on [s]."""
        ...

    def pause(self, seconds: float) -> None:
        """Let that clock pass."""
        ...

    def reopen(self) -> None:
        """Close it and open it again, as new."""
        ...

    def close(self) -> None:
        """Let go of it; a second call does nothing."""
        ...


def open_transport(name: str) -> Transport:
    """Return the bridge called ``name``, open: "falcon", "falcon:SERIAL" or "falcon-socket:PATH"."""
    kind, _, argument = name.partition(":")
    if kind == "falcon-socket" and argument:
        from study_app.devices.falcon.transport.unix_socket import SocketTransport  # noqa: PLC0415 - not needed by most

        return SocketTransport(argument)
    if kind != "falcon":
        raise DeviceNotFound(
            f"'{name}' is not a connection to a Falcon; use falcon, falcon:SERIAL or falcon-socket:PATH"
        )
    serial = argument or None
    try:
        return PyUsbTransport(serial=serial)
    except UsbFailure as failure:
        if os.name != "nt" or failure.kind not in {"not-supported", "not-found"}:
            raise
        from study_app.devices.falcon.transport.ftdi import FtdiTransport  # noqa: PLC0415 - for Windows alone

        try:
            return FtdiTransport(serial=serial)
        except UsbFailure:
            raise failure from None


def quiet(transport: Transport) -> int:
    """Send ``PACKETS`` packets of zero torque; return the number sent.

    They keep the homing flag, and the bridge's settings are unchanged, so that the Falcon stays loaded and homed.
    """
    sent = 0
    for _ in range(PACKETS):
        with suppress(DeviceError):
            transport.write(quiet_packet(FLAG_HOMING), _WRITE_S)
            sent += 1
        transport.pause(_BETWEEN_S)
    return sent


def end_torque(name: str) -> None:
    """Open the bridge called ``name`` and send packets of zero torque: what a guard does."""
    transport = open_transport(name)
    try:
        if not quiet(transport):
            raise DeviceError("it takes no packet")
    finally:
        transport.close()

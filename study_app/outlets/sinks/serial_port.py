"""Trigger codes on a serial port, by pyserial (extra ``triggers``): one byte, 8N1, without flow control."""

import os
from collections.abc import Callable
from typing import Any, Final

from study_app.errors import OutletError
from study_app.outlets.sink import SinkKind
from study_app.outlets.trigger_pulse import TriggerSink

BAUD: Final = 115_200
TIMEOUT_S: Final = 0.5


class SerialPort:
    """An open serial port.

    Parameters
    ----------
    place : str
        Its name, such as ``/dev/ttyUSB0`` or ``COM3``, and after an ``@`` its bits per second.

    Raises
    ------
    OutletError
        It cannot be opened.
    """

    title = "Serial port"

    def __init__(self, place: str) -> None:
        try:
            import serial  # noqa: PLC0415 - an extra
        except ImportError as error:
            raise OutletError("triggers need pyserial: pip install 'liquid-study[triggers]'") from error
        name, _, baud = place.partition("@")
        if not name or not (baud or str(BAUD)).isdecimal():
            raise OutletError(f"serial:{place} is not a serial port: write serial:NAME or serial:NAME@BAUD")
        self.address = f"serial:{place}"
        self._failures: tuple[type[Exception], ...] = (serial.SerialException, OSError)
        try:
            self._port: Any = serial.Serial(name, int(baud or BAUD), write_timeout=TIMEOUT_S)
        except (*self._failures, ValueError) as error:
            raise OutletError(f"{self.address} cannot be opened: {_cause(error)}") from error

    def write(self, byte: int) -> None:
        """Send a byte; returns when the driver has sent it.

        Raises
        ------
        OutletError
            The port does not accept it: an adapter was unplugged.
        """
        try:
            self._port.write(bytes((byte,)))
            self._port.flush()
        except self._failures as error:
            raise OutletError(f"{self.address} failed: {_cause(error)}") from error

    def close(self) -> None:
        """Close the port."""
        self._port.close()


def _cause(error: Exception) -> str:
    """Return the system's message for an error with a number, else its own message."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if isinstance(number, int) else str(error)


def _open(place: str, now_ns: Callable[[], int]) -> TriggerSink:
    return TriggerSink(SerialPort(place), now_ns)


SINK = SinkKind("serial", "Serial port", "serial:/dev/ttyUSB0", _open)

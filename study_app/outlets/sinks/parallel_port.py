"""Trigger codes on a parallel port of Linux, by the ioctl calls of ``ppdev``: eight data lines and a strobe.

The code is written to the data lines before the strobe is pulsed, so that a receiver that latches on the strobe reads
settled lines; one that polls the lines reads them while the code is held.
"""

import os
from collections.abc import Callable
from typing import Any, Final

from study_app.errors import OutletError
from study_app.outlets.sink import SinkKind
from study_app.outlets.trigger_pulse import TriggerSink

# linux/ppdev.h
PPCLAIM: Final = 0x708B
PPRELEASE: Final = 0x708C
PPEXCL: Final = 0x708F
PPWDATA: Final = 0x40017086
PPWCONTROL: Final = 0x40017084
STROBE: Final = 0x01  # of linux/parport.h; the connector's line is inverted: low while it is set

Ioctl = Callable[..., Any]


class ParallelPort:
    """An open parallel port.

    Parameters
    ----------
    place : str
        Its device file, such as ``/dev/parport0``.

    Raises
    ------
    OutletError
        It cannot be opened or claimed, or the system has none.
    """

    title = "Parallel port"

    def __init__(self, place: str, ioctl: Ioctl | None = None) -> None:
        self.address = f"parallel:{place}"
        self._ioctl = _system_ioctl() if ioctl is None else ioctl
        try:
            self._file = os.open(place, os.O_RDWR)
        except OSError as error:
            raise OutletError(f"{self.address} cannot be opened: {error.strerror}") from error
        try:
            self._call(PPEXCL)
            self._call(PPCLAIM)
        except OutletError:
            os.close(self._file)
            raise

    def write(self, byte: int) -> None:
        """Put a byte on the data lines; a code other than 0 is followed by a pulse of the strobe.

        Raises
        ------
        OutletError
            The port does not accept it.
        """
        self._call(PPWDATA, bytes((byte,)))
        if byte:
            self._call(PPWCONTROL, bytes((STROBE,)))
            self._call(PPWCONTROL, bytes((0,)))

    def close(self) -> None:
        """Release the port and close it."""
        try:
            self._call(PPRELEASE)
        finally:
            os.close(self._file)

    def _call(self, request: int, *value: bytes) -> None:
        try:
            self._ioctl(self._file, request, *value)
        except OSError as error:
            raise OutletError(f"{self.address} failed: {error.strerror}; is another program using it?") from error


def _system_ioctl() -> Ioctl:
    try:
        import fcntl  # noqa: PLC0415 - not on Windows
    except ImportError as error:
        raise OutletError("parallel ports are supported on Linux only: use a serial port") from error
    return fcntl.ioctl


def _open(place: str, now_ns: Callable[[], int]) -> TriggerSink:
    return TriggerSink(ParallelPort(place), now_ns)


SINK = SinkKind("parallel", "Parallel port", "parallel:/dev/parport0", _open)

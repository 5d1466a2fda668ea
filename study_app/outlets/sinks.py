"""Sinks of markers: a stream of the Lab Streaming Layer, and trigger codes on a parallel or serial port.

The parallel port needs Linux and its ``ppdev`` driver; it has eight data lines and a strobe. The code is written to the
data lines before the strobe is pulsed, so that a receiver that latches on the strobe reads settled lines; one that
polls the lines reads them while the code is held. The serial port (pyserial, extra ``triggers``) gets one byte,
8N1, without flow control.
"""

import os
import re
from collections.abc import Callable, Mapping
from typing import Any, Final

from study_app.errors import OutletError
from study_app.outlets.markers import CODES, Marker, SinkKind, TriggerPort, TriggerSink
from study_app.outlets.streams import MARKERS, ClockMapping, close_outlet, import_pylsl, stream_info

# linux/ppdev.h
PPCLAIM: Final = 0x708B
PPRELEASE: Final = 0x708C
PPEXCL: Final = 0x708F
PPWDATA: Final = 0x40017086
PPWCONTROL: Final = 0x40017084
_STROBE: Final = 0x01  # of linux/parport.h; the connector's line is inverted: low while it is set
_Ioctl = Callable[..., Any]
_BAUD: Final = 115_200
_TIMEOUT_S: Final = 0.5


class _MarkerStream:
    """An outlet of markers, timed by the servo's clock."""

    title = "LSL markers"

    def __init__(self, now_ns: Callable[[], int]) -> None:
        lsl = import_pylsl()
        info = stream_info(lsl, MARKERS, "Markers", ("marker",), 0.0, "string")
        codes = info.desc().append_child("triggers")
        for event, byte in CODES.items():
            codes.append_child_value(event, str(byte))
        self.mapping = ClockMapping(now_ns, lsl.local_clock)
        self._outlet: Any = lsl.StreamOutlet(info)

    @property
    def described(self) -> Mapping[str, Any]:
        return {"stream": MARKERS, "clock_uncertainty_us": round(1e6 * self.mapping.uncertainty_s, 3)}

    @property
    def listens(self) -> bool:
        outlet = self._outlet  # its thread may release it at any time
        return bool(outlet is not None and outlet.have_consumers())

    def send(self, marker: Marker) -> None:
        self.mapping.measure_if_due()
        self._outlet.push_sample([marker.text], 1e-9 * marker.time_ns + self.mapping.offset_s)

    def close(self) -> None:
        outlet, self._outlet = self._outlet, None
        close_outlet(outlet)


class ParallelPort:
    """An open parallel port."""

    title = "Parallel port"

    def __init__(self, place: str, ioctl: _Ioctl | None = None) -> None:
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
            self._call(PPWCONTROL, bytes((_STROBE,)))
            self._call(PPWCONTROL, bytes((0,)))

    def close(self) -> None:
        try:
            self._call(PPRELEASE)
        finally:
            os.close(self._file)

    def _call(self, request: int, *value: bytes) -> None:
        try:
            self._ioctl(self._file, request, *value)
        except OSError as error:
            raise OutletError(f"{self.address} failed: {error.strerror}; is another program using it?") from error


def _system_ioctl() -> _Ioctl:
    try:
        import fcntl  # noqa: PLC0415 - not on Windows
    except ImportError as error:
        raise OutletError("parallel ports are supported only on Linux: use a serial port") from error
    return fcntl.ioctl


class _SerialPort:
    """An open serial port."""

    title = "Serial port"

    def __init__(self, place: str) -> None:
        try:
            import serial  # noqa: PLC0415 - an extra
        except ImportError as error:
            raise OutletError("triggers need pyserial: pip install 'liquid-study[triggers]'") from error
        name, _, baud = place.partition("@")
        if not name or not (baud or str(_BAUD)).isdecimal():
            raise OutletError(f"serial:{place} is not a serial port: write serial:NAME or serial:NAME@BAUD")
        self.address = f"serial:{place}"
        self._failures: tuple[type[Exception], ...] = (serial.SerialException, OSError)
        try:
            self._port: Any = serial.Serial(name, int(baud or _BAUD), write_timeout=_TIMEOUT_S)
        except (*self._failures, ValueError, OverflowError) as error:
            raise OutletError(f"{self.address} cannot be opened: {_error_text(error)}") from error

    def write(self, byte: int) -> None:
        """Send a byte; returns when the driver has sent it.

        Raises
        ------
        OutletError
            The port does not accept it, for example because an adapter was unplugged.
        """
        try:
            self._port.write(bytes((byte,)))
            self._port.flush()
        except self._failures as error:
            raise OutletError(f"{self.address} failed: {_error_text(error)}") from error

    def close(self) -> None:
        self._port.close()


def _error_text(error: Exception) -> str:
    """Return the system's message by the error's number, or as quoted by pyserial on Windows; else the error's text."""
    number = getattr(error, "errno", None)
    if isinstance(number, int):
        return os.strerror(number)
    quoted = re.search(r"Error\(\d+, (['\"])(.+?)\.?\1", str(error))
    return str(error) if quoted is None else quoted[2]


def _port_opener(kind: Callable[[str], TriggerPort]) -> Callable[[str, Callable[[], int]], TriggerSink]:
    """Return a function that opens a sink on a port of this kind."""
    return lambda place, now_ns: TriggerSink(kind(place), now_ns)


SINKS: Final = (
    SinkKind("lsl", _MarkerStream.title, example="lsl", open=lambda _place, now_ns: _MarkerStream(now_ns)),
    SinkKind("parallel", ParallelPort.title, example="parallel:/dev/parport0", open=_port_opener(ParallelPort)),
    SinkKind("serial", _SerialPort.title, example="serial:/dev/ttyUSB0", open=_port_opener(_SerialPort)),
)
"""The kinds of sinks."""

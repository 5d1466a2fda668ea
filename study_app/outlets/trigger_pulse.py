"""Trigger codes on the lines of a port: the byte of an event, then 0.

Two simultaneous events are sent as two successive pulses.
"""

import time
from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from study_app.errors import OutletError
from study_app.outlets.marker import CODES, Marker

HIGH_S: Final = 0.010
LOW_S: Final = 0.004
"""Least time at 0 between two codes, so that an amplifier at 500 Hz samples it."""


class TriggerPort(Protocol):
    """A port of eight lines that are written together."""

    @property
    def title(self) -> str:
        """Its name for the operator."""
        ...

    @property
    def address(self) -> str:
        """Its address, such as ``serial:/dev/ttyUSB0``."""
        ...

    def write(self, byte: int) -> None:
        """Write a byte to the lines; returns when the port has it (OutletError: it does not accept it)."""
        ...

    def close(self) -> None:
        """Close the port."""
        ...


class TriggerSink:
    """Sends the codes of events to a port.

    Parameters
    ----------
    port : TriggerPort
        An open port; it is set to 0.
    now_ns : callable
        The servo's clock [ns].

    Raises
    ------
    OutletError
        The port does not accept a byte; it is closed then.

    Attributes
    ----------
    delays_ns : list of int
        Time from each event to the writing of its byte [ns].
    """

    listens = None

    def __init__(self, port: TriggerPort, now_ns: Callable[[], int]) -> None:
        self._port = port
        self._now_ns = now_ns
        self.delays_ns: list[int] = []
        self._clear = 0.0
        try:
            port.write(0)
        except OutletError:
            port.close()
            raise

    @property
    def title(self) -> str:
        """What the operator calls it."""
        return self._port.title

    @property
    def described(self) -> Mapping[str, Any]:
        """Its record in the receipt."""
        return {"address": self._port.address, "high_ms": 1e3 * HIGH_S, "codes": dict(CODES)}

    def send(self, marker: Marker) -> None:
        """Send the code of an event, and 0 after `HIGH_S`; an event without a code sends nothing."""
        if marker.byte is None:
            return
        time.sleep(max(0.0, self._clear - time.monotonic()))
        self._port.write(marker.byte)
        self.delays_ns.append(self._now_ns() - marker.time_ns)
        time.sleep(HIGH_S)
        self._port.write(0)
        self._clear = time.monotonic() + LOW_S

    def close(self) -> None:
        """Let go of the port."""
        self._port.close()

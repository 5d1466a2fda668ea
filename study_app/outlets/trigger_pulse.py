"""Trigger codes on the lines of a port: the byte of an event, then 0.

Two events of one moment come one after the other, each as a pulse of its own.
"""

import time
from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from study_app.errors import OutletError
from study_app.outlets.marker import CODES, Marker

HIGH_S: Final = 0.010
LOW_S: Final = 0.004
"""How long a port is 0 at least between two codes: an amplifier of 500 Hz sees it."""


class TriggerPort(Protocol):
    """Eight lines that are written at once."""

    @property
    def title(self) -> str:
        """What the operator calls it."""
        ...

    @property
    def address(self) -> str:
        """How it is asked for, such as ``serial:/dev/ttyUSB0``."""
        ...

    def write(self, byte: int) -> None:
        """Put a byte on the lines; returns when the port has it (OutletError: it does not take it)."""
        ...

    def close(self) -> None:
        """Let go of the port."""
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
        From each event that was sent to its byte being written [ns].
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
        """What the receipt says of it."""
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

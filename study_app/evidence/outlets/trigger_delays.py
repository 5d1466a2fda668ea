"""The delay from an event to its byte on a port."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from study_app.errors import OutletError, StudyError, WorkerError
from study_app.evidence.outlets.streams import paced
from study_app.haptics.runtime.clocks.clock import SystemClock
from study_app.outlets.markers import CODES, SinkThread, TriggerSink, marker_of
from study_app.outlets.session_outlets import open_sink

VIRTUAL: Final = "virtual"
EVERY_S: Final = 0.05
PATIENCE_S: Final = 30.0


@dataclass(frozen=True, slots=True)
class TriggerDelays:
    """How long events took to a byte.

    ``written_us`` is from each event to its byte being handed to the port [µs], ``read_us`` to its being read by
    another process [µs], ``high_ms`` how long each code stayed before 0 came [ms]; all (n,), the last two None where
    nothing reads the port. ``wrong`` counts bytes that differ from what was sent.
    """

    port: str
    written_us: NDArray[np.float64]
    read_us: NDArray[np.float64] | None = None
    high_ms: NDArray[np.float64] | None = None
    wrong: int = 0


class VirtualPort:
    """A pair of virtual ports: one with an ``address`` to send to, and another whose bytes another process reads.

    Raises
    ------
    StudyError
        This system has none.
    """

    def __init__(self) -> None:
        if not hasattr(os, "openpty"):
            raise StudyError("this system has no virtual ports: give the address of a real one, such as serial:COM3")
        import tty  # noqa: PLC0415 - not on Windows

        ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        self.address = f"serial:{os.ttyname(self._theirs)}"
        self._process = subprocess.Popen(  # noqa: S603 - our own words
            [sys.executable, "-m", "study_app.evidence.outlets.byte_reader", str(ours)],
            pass_fds=(ours,),
            stdout=subprocess.PIPE,
            text=True,
        )
        os.close(ours)
        assert self._process.stdout is not None  # noqa: S101 - asked for above
        if self._process.stdout.readline() != "ready\n":
            raise WorkerError("the reader of the virtual port ended")

    def unplug(self) -> list[tuple[int, int]]:
        """End the reader, as if an adapter were unplugged; return the bytes, each with when it was read [ns]."""
        self.close()
        said = self._process.communicate(timeout=PATIENCE_S)[0]
        return [(byte, at_ns) for byte, at_ns in json.loads(said)]

    def close(self) -> None:
        """Close this end; the reader ends once the port is closed, too."""
        with suppress(OSError):
            os.close(self._theirs)

    def __enter__(self) -> VirtualPort:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        self._process.kill()
        self._process.communicate()


def measure(
    port: str, seconds: float, *, ending: threading.Event, progress: Callable[[str], object] = lambda _line: None
) -> TriggerDelays:
    """Send twenty events per second to a port, or to a virtual one, and return their delays.

    Parameters
    ----------
    port : address of a port; "virtual" for a pair of virtual ones, whose other end another process reads
    ending : is set by whoever wants no more

    Raises
    ------
    OutletError
        The port cannot be opened, or failed.
    """
    if port != VIRTUAL:
        return TriggerDelays(port, _written_us(_send(port, seconds, ending, progress)[1]))
    with VirtualPort() as virtual:
        sent, sink = _send(virtual.address, seconds, ending, progress)
        came = virtual.unplug()
    codes = [one for one in came if one[0]]
    idle_ns = [at_ns for byte, at_ns in came[1:] if not byte]  # the first 0 is from opening the port
    pairs = list(zip(codes, sent, strict=False))
    return TriggerDelays(
        f"{virtual.address} (virtual)",
        _written_us(sink),
        np.array([at_ns - event_ns for (_, at_ns), (_, event_ns) in pairs]) * 1e-3,
        np.array([off_ns - on_ns for (_, on_ns), off_ns in zip(codes, idle_ns, strict=False)]) * 1e-6,
        sum(byte != code for (byte, _), (code, _) in pairs) + abs(len(codes) - len(sent)),
    )


def _written_us(sink: TriggerSink) -> NDArray[np.float64]:
    return np.array(sink.delays_ns, np.float64) * 1e-3


def _send(
    address: str, seconds: float, ending: threading.Event, progress: Callable[[str], object]
) -> tuple[list[tuple[int, int]], TriggerSink]:
    """Send the codes in turn; return each with the time of its event [ns], and the sink."""
    now_ns = SystemClock().now_ns
    sink = open_sink(address, now_ns)
    if not isinstance(sink, TriggerSink):
        raise OutletError(f"'{address}' is not the address of a port")
    thread = SinkThread(sink)
    sent: list[tuple[int, int]] = []
    events = list(CODES)
    for number in paced(seconds, EVERY_S, ending=ending, progress=progress):
        if thread.lost:
            break
        marker = marker_of(events[number % len(events)], 1e-9 * now_ns(), 0, {})
        assert marker is not None  # noqa: S101 - each has a code
        assert marker.byte is not None  # noqa: S101
        thread.mark(marker)
        sent.append((marker.byte, marker.time_ns))
    thread.close()
    if thread.lost:
        raise OutletError(thread.lost)
    return sent, sink

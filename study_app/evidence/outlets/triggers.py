"""The delay from an event to its trigger byte on a port."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from study_app.errors import OutletError, StudyError
from study_app.evidence.outlets.streams import Listener
from study_app.evidence.table import Evidence, paced_steps
from study_app.haptics.runtime.clocks import SystemClock
from study_app.outlets.markers import CODES, HIGH_S, SinkThread, TriggerSink, marker_of
from study_app.outlets.session_outlets import open_sink

VIRTUAL: Final = "virtual"
_EVENT_PERIOD_S: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class TriggerDelays:
    """The delays from events to their trigger bytes.

    ``written_us`` is from each event until its byte is handed to the port [µs], ``read_us`` until another process reads
    it [µs], ``high_ms`` how long each code stayed before the reset to 0 [ms]; all (n,), the last two None if no process
    reads the port. ``wrong`` counts bytes that differ from those sent.
    """

    port: str
    written_us: NDArray[np.float64]
    read_us: NDArray[np.float64] | None = None
    high_ms: NDArray[np.float64] | None = None
    wrong: int = 0


class _VirtualPort:
    """A pair of virtual ports: codes are sent to the ``address`` of one, and another process reads the other."""

    def __init__(self) -> None:
        if not hasattr(os, "openpty"):
            raise StudyError(
                "this system does not provide virtual ports: specify the address of a real one, such as serial:COM3"
            )
        import tty  # noqa: PLC0415 - not on Windows

        reading_end, self._sending_end = os.openpty()
        tty.setraw(self._sending_end)
        self.address = f"serial:{os.ttyname(self._sending_end)}"
        self._listener = Listener(str(reading_end), pass_fds=(reading_end,))
        os.close(reading_end)
        self._listener.wait_until_ready()

    def unplug(self) -> list[tuple[int, int]]:
        """End the reader as if an adapter were unplugged; return the bytes, each with its reading time [ns]."""
        self.close()
        return [(byte, at_ns) for byte, at_ns in self._listener.collect()]

    def close(self) -> None:
        """Close this end of the port, which also ends the reader."""
        with suppress(OSError):
            os.close(self._sending_end)

    def __enter__(self) -> _VirtualPort:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        self._listener.__exit__()


def measure_triggers(
    port: str, seconds: float, *, ending: threading.Event, progress: Callable[[str], object] = lambda _line: None
) -> TriggerDelays:
    """Send twenty events per second to the address of a port, or to a virtual one, and return their delays.

    The ``port`` "virtual" is a pair of virtual ports whose other end is read by another process.

    Raises
    ------
    OutletError
        The port cannot be opened, or failed.
    """
    if port != VIRTUAL:
        return TriggerDelays(port=port, written_us=_written_us(_send_codes(port, seconds, ending, progress)[1]))
    with _VirtualPort() as virtual:
        sent, sink = _send_codes(virtual.address, seconds, ending, progress)
        received = virtual.unplug()
    codes = [(byte, at_ns) for byte, at_ns in received if byte]
    idle_ns = [at_ns for byte, at_ns in received[1:] if not byte]  # the first 0 is from opening the port
    pairs = list(zip(codes, sent, strict=False))
    return TriggerDelays(
        port=f"{virtual.address} (virtual)",
        written_us=_written_us(sink),
        read_us=np.array([at_ns - event_ns for (_, at_ns), (_, event_ns) in pairs]) * 1e-3,
        high_ms=np.array([off_ns - on_ns for (_, on_ns), off_ns in zip(codes, idle_ns, strict=False)]) * 1e-6,
        wrong=sum(byte != code for (byte, _), (code, _) in pairs) + abs(len(codes) - len(sent)),
    )


def _written_us(sink: TriggerSink) -> NDArray[np.float64]:
    return np.array(sink.delays_ns, np.float64) * 1e-3


def _send_codes(
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
    for number in paced_steps(seconds, _EVENT_PERIOD_S, ending=ending, progress=progress):
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


def triggers_evidence(delays: TriggerDelays) -> Evidence:
    """Return the results as text."""
    lines = [
        f"{len(delays.written_us)} events, 20 per second, on {delays.port}",
        f"  from the event until the byte is written: {_spread(delays.written_us)} us",
    ]
    if delays.read_us is not None and delays.high_ms is not None:
        lines += [
            f"  from the event until another process reads the byte: {_spread(delays.read_us)} us",
            f"  from the code to 0: {_spread(delays.high_ms)} ms, nominal {1e3 * HIGH_S:g} ms",
            f"  wrong or missing bytes: {delays.wrong}",
        ]
    text = "\n".join(lines) + "\n"
    return Evidence(text, {"triggers.txt": text}, missed=bool(delays.wrong))


def _spread(values: NDArray[np.float64]) -> str:
    p50, p99, most = np.percentile(values, [50, 99, 100]) if len(values) else (np.nan,) * 3
    return f"p50 {p50:.3g}, p99 {p99:.3g}, most {most:.3g}"

"""Markers: events of the journal for other programs, as text and as a trigger code, and the threads that send them.

A marker contains only codes and counts from a list of permitted fields: no condition, answer, measure or entered text,
and nothing that the journal seals. A session queues a marker and continues at once. A sink that fails or hangs delays
neither the session nor the servo: it gets no more markers, and `SinkThread.lost` gives the reason. On a port a trigger
code is the byte of an event, then 0; two simultaneous events are sent as two successive pulses.
"""

import json
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass
from time import perf_counter
from typing import Any, Final, Protocol

from study_app.errors import OutletError

CODES: Final[Mapping[str, int]] = {
    "session_started": 1,
    "session_resumed": 2,
    "session_ended": 3,
    "trial_started": 10,
    "trial_ended": 11,
    "interval_started": 20,
    "interval_ended": 21,
    "choice": 30,
    "responses": 31,
    "form_answered": 32,
    "force_stopped": 40,
    "force_restored": 41,
    "paused": 42,
    "resumed": 43,
    "broke": 44,
}
"""The trigger codes of events. A code is a byte; 0 is the idle state of a port."""
_UNCODED: Final = frozenset(
    (
        "page_shown",
        "page_left",
        "feedback_shown",
        "stepped",
        "target_reached",
        "form_shown",
        "item_shown",
        "answer_removed",
        "note",
        "repeat",
        "device_reconnected",
    )
)
"""Events whose markers have no trigger code."""
_MARKER_FIELDS: Final = (
    "trial",
    "attempt",
    "interval",
    "block",
    "phase",
    "code",
    "item",
    "form",
    "page",
    "target",
    "by",
)
"""The fields of an event that a marker contains; ``code`` is the blinded one, such as L2."""
MAX_WAITING: Final = 1000
"""Maximum number of queued markers."""
HANGS_S: Final = 5.0
"""Time limit for sending a marker: a sink that exceeds it counts as lost when the next one is queued. [choice]"""
_ADVICE: Final = "sending has stopped; check the connection, then end and resume the session"
PATIENCE_S: Final = 1.0
"""Time limit for sending the queued markers when a sink is closed."""
HIGH_S: Final = 0.010
"""Duration of a code on a port."""
LOW_S: Final = 0.004
"""Minimum time at 0 between two codes, so that an amplifier at 500 Hz samples it."""


@dataclass(frozen=True, slots=True)
class Marker:
    """An event for other programs.

    ``time_ns`` is the event's time on the servo's clock, ``t_s`` that on the session's clock, as in the journal.
    ``fields`` has the permitted fields of the journal's line. ``byte`` is the trigger code, None if the event has none.
    """

    event: str
    time_ns: int
    t_s: float
    fields: tuple[tuple[str, Any], ...] = ()

    @property
    def byte(self) -> int | None:
        return CODES.get(self.event)

    @property
    def text(self) -> str:
        line = {"event": self.event, **dict(self.fields), "t_s": round(self.t_s, 6)}
        if self.byte is not None:
            line["trigger"] = self.byte
        return json.dumps(line, ensure_ascii=False, separators=(",", ":"))


def marker_of(event: str, t_s: float, origin_ns: int, fields: Mapping[str, Any]) -> Marker | None:
    """Return the marker of an event of the journal, None if the event has no marker.

    Parameters
    ----------
    t_s : float
        Time of the event on the session's clock [s].
    origin_ns : int
        The servo's clock at the origin of the session's clock [ns].
    fields : mapping
        The other fields of the journal's line.
    """
    if event not in CODES and event not in _UNCODED:
        return None
    permitted = tuple((name, fields[name]) for name in _MARKER_FIELDS if fields.get(name) is not None)
    return Marker(event, origin_ns + round(t_s * 1e9), t_s, permitted)


class Sink(Protocol):
    """A sink of markers. One thread calls `send` and `close`, which may block; others read the properties."""

    @property
    def title(self) -> str: ...

    @property
    def described(self) -> Mapping[str, Any]: ...

    @property
    def listens(self) -> bool | None: ...

    def send(self, marker: Marker) -> None:
        """Send a marker.

        Raises
        ------
        OutletError
            Neither this marker nor later ones are sent.
        """

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class SinkKind:
    """The descriptor of a kind of sink.

    ``name`` is the part of an address before the colon, ``example`` an example address; ``open`` takes the part after
    the colon and the servo's clock [ns].
    """

    name: str
    title: str
    _: KW_ONLY
    example: str
    open: Callable[[str, Callable[[], int]], Sink]


class SinkThread:
    """Sends markers to a sink in a separate thread.

    Attributes
    ----------
    lost : str
        The reason why the sink no longer gets markers; empty while it works.
    """

    def __init__(self, sink: Sink) -> None:
        self.sink = sink
        self.lost = ""
        self._waiting: deque[Marker] = deque()
        self._changed = threading.Condition()
        self._closing = False
        self._send_began_s: float | None = None  # for the marker that is being sent
        self._thread = threading.Thread(target=self._send_markers, name=f"outlet {sink.title}", daemon=True)
        self._thread.start()

    def mark(self, marker: Marker) -> None:
        """Queue a marker; returns at once."""
        with self._changed:
            if self.lost or self._closing:
                return
            began_s = self._send_began_s  # read once, since the thread may clear it at any time
            taken_s = 0.0 if began_s is None else perf_counter() - began_s
            if taken_s > HANGS_S:
                self._give_up(
                    f"a marker had still not been sent after {taken_s:.1f} s (limit {HANGS_S:g} s): {_ADVICE}"
                )
            elif len(self._waiting) >= MAX_WAITING:
                self._give_up(f"the queue of unsent markers is full ({MAX_WAITING:,}): {_ADVICE}")
            else:
                self._waiting.append(marker)
                self._changed.notify_all()

    def close(self, patience_s: float = PATIENCE_S) -> None:
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(patience_s)

    def _send_markers(self) -> None:
        try:
            while (marker := self._next_marker()) is not None:
                self.sink.send(marker)
                self._send_began_s = None
        except OutletError as error:
            with self._changed:
                self._give_up(str(error))
        except Exception as error:  # noqa: BLE001 - any error of a driver: the session continues without it
            with self._changed:
                self._give_up(f"{type(error).__name__}: {error}")
        try:
            self.sink.close()
        except Exception as error:  # noqa: BLE001
            self.lost = self.lost or f"the marker output could not be closed: {error}"

    def _give_up(self, reason: str) -> None:
        self.lost = self.lost or reason
        self._waiting.clear()
        self._changed.notify_all()

    def _next_marker(self) -> Marker | None:
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closing or self.lost)
            if not self._waiting:
                return None
            self._send_began_s = perf_counter()
            return self._waiting.popleft()


class TriggerPort(Protocol):
    """A port of eight lines that are written together."""

    @property
    def title(self) -> str: ...

    @property
    def address(self) -> str: ...

    def write(self, byte: int) -> None:
        """Write a byte to the lines; returns when the port has it (OutletError: it does not accept it)."""

    def close(self) -> None: ...


class TriggerSink:
    """Sends the codes of events to a port.

    Parameters
    ----------
    port : TriggerPort
        An open port; it is set to 0 at the start.
    now_ns : callable
        The servo's clock [ns].

    Raises
    ------
    OutletError
        The port does not accept a byte; the port has been closed.

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
        self._ready_s = 0.0  # when the port has been at 0 for long enough
        try:
            port.write(0)
        except OutletError:
            port.close()
            raise

    @property
    def title(self) -> str:
        return self._port.title

    @property
    def described(self) -> Mapping[str, Any]:
        return {"address": self._port.address, "high_ms": 1e3 * HIGH_S, "codes": dict(CODES)}

    def send(self, marker: Marker) -> None:
        """Send the code of an event, and 0 after `HIGH_S`; do nothing for an event without a code."""
        if marker.byte is None:
            return
        time.sleep(max(0.0, self._ready_s - time.perf_counter()))
        self._port.write(marker.byte)
        self.delays_ns.append(self._now_ns() - marker.time_ns)
        time.sleep(HIGH_S)
        self._port.write(0)
        self._ready_s = time.perf_counter() + LOW_S

    def close(self) -> None:
        self._port.close()

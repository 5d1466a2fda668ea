"""Sinks of markers: the descriptor of a kind, an open sink, and the thread that serves it.

A session queues a marker and continues at once. A sink that fails or hangs delays neither the session nor the servo: it
gets no more markers, and `SinkThread.lost` gives the reason.
"""

import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import monotonic
from typing import Any, Final, Protocol

from study_app.errors import OutletError
from study_app.outlets.marker import Marker

ROOM: Final = 1000
"""Greatest number of waiting markers."""
HANGS_S: Final = 5.0
"""A sink that takes longer over one marker counts as lost at the next. [choice]"""
ADVICE: Final = "no more are sent; check the connection, then end and resume the session"

PATIENCE_S: Final = 1.0


class Sink(Protocol):
    """A sink of markers. One thread calls `send` and `close`, which may block; others read the properties."""

    @property
    def title(self) -> str:
        """Its name for the operator."""
        ...

    @property
    def described(self) -> Mapping[str, Any]:
        """Its record in the receipt."""
        ...

    @property
    def listens(self) -> bool | None:
        """Whether a program receives the markers; None if unknown."""
        ...

    def send(self, marker: Marker) -> None:
        """Send a marker.

        Raises
        ------
        OutletError
            Neither this marker nor later ones are sent.
        """
        ...

    def close(self) -> None:
        """Close it."""
        ...


@dataclass(frozen=True, slots=True)
class SinkKind:
    """The descriptor of a kind of sink.

    ``name`` is the part of an address before the colon, ``example`` an address; ``open`` receives the part after the
    colon and the servo's clock [ns].
    """

    name: str
    title: str
    example: str
    open: Callable[[str, Callable[[], int]], Sink]


class SinkThread:
    """Sends markers to a sink in a separate thread.

    Attributes
    ----------
    lost : str
        Why the sink gets no more markers; empty while it works.
    """

    def __init__(self, sink: Sink) -> None:
        self.sink = sink
        self.lost = ""
        self._waiting: deque[Marker] = deque()
        self._changed = threading.Condition()
        self._closing = False
        self._since_s: float | None = None  # of the marker that is being sent
        self._thread = threading.Thread(target=self._work, name=f"outlet {sink.title}", daemon=True)
        self._thread.start()

    def mark(self, marker: Marker) -> None:
        """Queue a marker; returns at once."""
        with self._changed:
            if self.lost or self._closing:
                return
            since_s = self._since_s  # read once: the thread clears it at any time
            taken_s = 0.0 if since_s is None else monotonic() - since_s
            if taken_s > HANGS_S:
                self._give_up(f"a marker was not sent in {taken_s:.1f} s (limit {HANGS_S:g} s): {ADVICE}")
            elif len(self._waiting) >= ROOM:
                self._give_up(f"{ROOM:,} markers wait to be sent (limit): {ADVICE}")
            else:
                self._waiting.append(marker)
                self._changed.notify_all()

    def close(self, patience_s: float = PATIENCE_S) -> None:
        """Send waiting markers within the time limit, and close the sink; a hanging one is left to its thread."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(patience_s)

    def _work(self) -> None:
        try:
            while (marker := self._next()) is not None:
                self.sink.send(marker)
                self._since_s = None
        except OutletError as error:
            with self._changed:
                self._give_up(str(error))
        except Exception as error:  # noqa: BLE001 - any error of a driver: the session goes on without it
            with self._changed:
                self._give_up(f"{type(error).__name__}: {error}")
        try:
            self.sink.close()
        except Exception as error:  # noqa: BLE001
            self.lost = self.lost or f"it was not closed: {error}"

    def _give_up(self, reason: str) -> None:
        self.lost = self.lost or reason
        self._waiting.clear()
        self._changed.notify_all()

    def _next(self) -> Marker | None:
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closing or self.lost)
            if not self._waiting:
                return None
            self._since_s = monotonic()
            return self._waiting.popleft()

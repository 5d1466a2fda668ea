"""The interfaces for the runner's side effects: servo, journal, recorder, screen and clock."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from study_app.haptics.model.scene import Scene
from study_app.session.pages import Page
from study_app.store.blinded import Key
from study_app.store.journals.journal import SessionClock
from study_app.store.journals.journal_events import Event
from study_app.video.frames import VideoFrame, VideoSource


class ServoPort(Protocol):
    """The interface of the servo (``haptics.runtime.servo.Servo``)."""

    rate_hz: float
    telemetry: Any

    @property
    def fault(self) -> str | None: ...
    @property
    def worst_gap_s(self) -> float: ...
    def load(self, scene: Scene) -> int: ...
    def adjust(self, scene: Scene) -> int: ...
    def rest(self) -> None: ...
    def stop_force(self) -> None: ...
    def fade_in(self) -> None: ...
    def now_ns(self) -> int: ...


class JournalPort(Protocol):
    """The interface of the store (``store.sessions.open_session.SessionStore``)."""

    @property
    def fingerprint(self) -> str: ...

    def append(self, event: Event, *, t_s: float | None = None, waits: bool = True) -> None: ...
    def check_flushed(self) -> None: ...
    def write_tables(self) -> None: ...
    def finish(self, status: str, reason: str = "") -> None: ...


class RecorderPort(Protocol):
    """The interface of the recorder (``store.recorder.Recorder``); no method waits for the disk."""

    def start(self, trial: int, attempt: int, rate_hz: float, interval: int | None = None) -> None: ...
    def append(self, samples: Any) -> None: ...
    def frame(self, painted_ns: int, sample_ns: int, video: VideoFrame | None = None) -> None: ...
    def stop(self) -> None: ...


class KeptSession(JournalPort, Protocol):
    """The interface of the store that a rehearsed session requires (``store.sessions.open_session.SessionStore``)."""

    clock: SessionClock
    recorder: Any
    key: Key


@dataclass(frozen=True, slots=True)
class Ports:
    """The side effects of a session: ``present`` shows a page, ``clock`` gives seconds since the session's origin.

    ``recorder`` is None in a session without recordings. Without ``paints`` there is no window: the first frame of a
    trial is reported, and later ones are optional. ``settled`` tells whether all recordings are on the disk; until then
    the session's end is postponed. ``video`` returns the source of a condition's view, None if videos are not shown.
    """

    servo: ServoPort
    journal: JournalPort
    present: Callable[[Page], None]
    clock: Callable[[], float]
    recorder: RecorderPort | None = None
    paints: bool = True
    settled: Callable[[], bool] = lambda: True
    video: Callable[[str], VideoSource] | None = None

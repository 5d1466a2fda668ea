"""The operator's side of a session: what is shown, what is asked for, and the device connected again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject, Signal

from study_app.errors import StudyError
from study_app.gui.operator.operator_view import OperatorView, Session, operator_view
from study_app.gui.operator.servo_health import Forces, ServoHealth
from study_app.gui.widgets.background import Background
from study_app.session.pages import Page
from study_app.session.ports import JournalPort
from study_app.session.resume import FIRST, Start
from study_app.store.journals.journal_events import Event, SessionEnded
from study_app.store.progress import Progress
from study_app.video.sources import Videos

if TYPE_CHECKING:
    from study_app.haptics.runtime.servo import Servo
    from study_app.outlets.session_outlets import Outlets
    from study_app.session.simulated.observers import Hand
    from study_app.store.recorder import Recorder


class WatchedJournal:
    """Passes everything on to the store, and folds what it has kept into ``progress``."""

    def __init__(self, store: JournalPort, progress: Progress, clock: Callable[[], float]) -> None:
        self.progress = progress
        self._store = store
        self._clock = clock

    def append(self, event: Event, *, t_s: float | None = None, waits: bool = True) -> None:
        """Put an event into the journal (StoreError: nothing has changed)."""
        self._store.append(event, t_s=t_s, waits=waits)
        self.progress.take(replace(event, t_s=self._clock() if t_s is None else t_s))

    @property
    def fingerprint(self) -> str:
        return self._store.fingerprint

    def check_flushed(self) -> None:
        """Raise StoreError if lines that were not waited for could not be flushed."""
        self._store.check_flushed()

    def write_tables(self) -> None:
        self._store.write_tables()

    def finish(self, status: str, reason: str = "") -> None:
        """Close the session (StoreError: the last table or line could not be written; it counts as ended here)."""
        try:
            self._store.finish(status, reason)
        finally:
            proof = {"fingerprint": self._store.fingerprint}
            self.progress.take(SessionEnded(status=status, reason=reason, t_s=self._clock(), others=proof))


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts of a session, except its windows.

    ``session`` is what the operator sees of it throughout; ``key`` is block → code → condition or track and ``secret``
    the sealed key's nonce, never shown; ``start`` is where a resumed session goes on. ``aim_m`` gives where hand or
    pointer mean to be [m, hand frame]; ``point_to`` and ``press`` pass the mouse on, None where the device is not the
    mouse; ``hand_for`` makes the simulated hand for a page, None with a real hand.
    ``outlets`` send its events to other programs; ``videos`` are those of the study, None where it shows none.
    ``reconnect`` opens a device or video that failed again, with the servo at zero force; it may take minutes.
    """

    session: Session
    key: Mapping[str, Mapping[str, str]] = field(repr=False)
    language: str
    servo: Servo
    journal: WatchedJournal
    clock: Callable[[], float]
    aim_m: Callable[[], tuple[float, float, float]]
    recorder: Recorder | None = None
    outlets: Outlets | None = None
    start: Start = FIRST
    secret: bytes = field(default=b"", repr=False)
    point_to: Callable[[float, float, float], None] | None = None
    press: Callable[[int], None] | None = None
    hand_for: Callable[[Page], Hand | None] | None = None
    reconnect: Callable[[], dict[str, Any]] | None = None
    videos: Videos | None = None


class OperatorMonitor:
    """Looks at servo and hand once a frame; ``forces`` is None, and no force is looked at, in a double-blind study.

    Parameters
    ----------
    refresh_hz : frames a second of the participant's screen
    """

    def __init__(self, parts: Parts, refresh_hz: float) -> None:
        self._parts = parts
        self._reader = parts.servo.telemetry.reader()
        self._faulty = False
        self._faults = 0
        self.health = ServoHealth(parts.servo.rate_hz, refresh_hz)
        study = parts.session.protocol
        self.forces = Forces(study.device.force_limit_n) if study.study.blinding == "single" else None

    def look(self) -> None:
        self._count_faults()
        samples = self._reader.read()
        self.health.take(samples)
        if self.forces is not None:
            self.forces.take(samples)
        self.health.hand(self._parts.clock(), self._parts.aim_m())

    def view(self, trouble: str, stalled: str | None) -> OperatorView:
        """Return what the operator is to see now; ``stalled`` is why the disk takes nothing, None while it does."""
        parts = self._parts
        self._count_faults()
        return operator_view(
            parts.session,
            parts.journal.progress,
            self.health.vitals(),
            now_s=parts.clock(),
            force_on=parts.servo.force_is_on,
            trouble=trouble or parts.servo.fault or stalled or "",
            waits=stalled is not None and not trouble,
            device_ready=not self._faulty,
            faults=self._faults,
            rate_hz=parts.servo.rate_hz,
            forces=None if self.forces is None else self.forces.figures(),
            lost={one.trial: one.reason for one in parts.recorder.lost} if parts.recorder is not None else {},
            dropped=parts.recorder.dropped if parts.recorder is not None else 0,
            outlets_lost=None if parts.outlets is None else parts.outlets.lost,
        )

    def _count_faults(self) -> None:
        faulty = self._parts.servo.fault is not None
        self._faults += faulty and not self._faulty
        self._faulty = faulty


PATIENCE_S = 20.0


class Reconnection(QObject):
    """Runs ``reconnect`` in a thread, once at a time.

    ``connected(described)`` or ``failed(error)`` comes in the thread of this object; ``line`` is what to show: what is
    being done, or why it failed.

    Parameters
    ----------
    reconnect : opens and homes the device and starts its servo at zero force; returns what describes it
    """

    connected = Signal(object)
    failed = Signal(object)

    def __init__(self, reconnect: Callable[[], dict[str, Any]]) -> None:
        super().__init__()
        self._reconnect = reconnect
        self._job = Background(self)
        self._job.done.connect(self._end)
        self.line = ""

    @property
    def under_way(self) -> bool:
        return self._job.busy

    def begin(self) -> None:
        if not self._job.busy:
            self.line = "Connecting the device …"
            self._job.run(self._run)

    def wait(self, patience_s: float = PATIENCE_S) -> bool:
        """Wait until the device is left alone, for whoever closes it must be its only user; return whether it is."""
        return self._job.wait(patience_s)

    def _run(self) -> dict[str, Any] | Exception:
        try:
            return self._reconnect()
        except Exception as error:  # noqa: BLE001 - a bug, too, is shown to the operator, and the force stays off
            return error

    def _end(self, made: dict[str, Any] | Exception) -> None:
        self.line = ""
        if not isinstance(made, Exception):
            self.connected.emit(made)
            return
        why = str(made) if isinstance(made, StudyError) else f"{type(made).__name__}: {made}"
        self.line = f"Not connected: {why}."
        self.failed.emit(made)

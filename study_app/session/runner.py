"""The shell around the machine: carries out its commands, and looks at the device for it.

Everything that touches something goes through ``Ports``. Events come from windows (``post``) and from the device
(``poll``, once a frame); what the participant sees comes from ``view``, what was seen goes into ``frame_shown``. All of
it in one thread; a window that answers a page while it is being presented is heard after the commands under way.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from study_app.errors import SessionError, StoreError, StudyError
from study_app.haptics.scene import Scene
from study_app.protocol.model import Protocol as Study
from study_app.protocol.schedule import Schedule
from study_app.session import compose
from study_app.session.commands import (
    Command,
    FadeIn,
    Finish,
    Rest,
    ShowPage,
    StartTrial,
    StopForce,
    StopTrial,
    Write,
    WriteTables,
)
from study_app.session.events import Broke, Continue, Event, ForceStopped, TaskDone
from study_app.session.machine import advance, open_session
from study_app.session.pages import Page
from study_app.session.state import FINAL, Phase, SessionState
from study_app.session.statistics import TrialStatistics
from study_app.session.tasks import TaskView, Tracker, track

BUTTON_CONTINUE = 1 << 0
BUTTON_STOP = 1 << 3


class ServoPort(Protocol):
    """What is asked of the servo (``haptics.servo.Servo``)."""

    rate_hz: float
    telemetry: Any

    @property
    def fault(self) -> str | None: ...  # noqa: D102
    def load(self, scene: Scene) -> int: ...  # noqa: D102
    def rest(self) -> None: ...  # noqa: D102
    def stop_force(self) -> None: ...  # noqa: D102
    def fade_in(self) -> None: ...  # noqa: D102
    def now_ns(self) -> int: ...  # noqa: D102


class JournalPort(Protocol):
    """What is asked of the store (``store.session.SessionStore``)."""

    def append(self, event: str, *, t_s: float | None = None, **fields: Any) -> None: ...  # noqa: D102
    def write_tables(self) -> None: ...  # noqa: D102
    def finish(self, status: str, reason: str = "") -> None: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Ports:
    """The world: ``present`` shows a page, ``clock`` gives seconds since the session's origin."""

    servo: ServoPort
    journal: JournalPort
    present: Callable[[Page], None]
    clock: Callable[[], float]


@dataclass(frozen=True, slots=True)
class TankView:
    """What is drawn in the tank: the proxy's place [m, hand frame] (3,), the task, and the time all this is of [ns]."""

    position_m: NDArray[np.float64]
    task: TaskView
    sample_time_ns: int


@dataclass(slots=True)
class _Running:
    """The trial under way: which scene's samples belong to it, and what is made of them."""

    trial: int
    serial: int
    delay_ns: int
    linger_ns: int
    tracker: Tracker
    statistics: TrialStatistics
    dropped_before: int


class Runner:
    """Runs one session.

    Parameters
    ----------
    protocol, schedule, language : what is run, in what order, in which language
    key : block → code → condition
    ports : the world
    """

    def __init__(
        self,
        protocol: Study,
        schedule: Schedule,
        key: Mapping[str, Mapping[str, str]],
        ports: Ports,
        language: str,
    ) -> None:
        self._protocol = protocol
        self._ports = ports
        self._state = open_session(protocol, schedule, key, language)
        self._reader = ports.servo.telemetry.reader()
        self._running: _Running | None = None
        self._measured: dict[str, Any] = {}
        self._buttons = 0
        self._page_since_ns = 0
        self._waiting: deque[Event] = deque()
        self._busy = False
        self._listeners: list[Callable[[SessionState], None]] = []

    @property
    def state(self) -> SessionState:
        """Where the session is."""
        return self._state

    @property
    def finished(self) -> bool:
        """Whether the session is over."""
        return self._state.phase in FINAL

    @property
    def task(self) -> TaskView | None:
        """The task on the device's clock, for the operator; None while no trial runs."""
        return None if self._running is None else self._running.tracker.now()

    def on_change(self, listener: Callable[[SessionState], None]) -> None:
        """Call ``listener`` with the new state after every event that was taken."""
        self._listeners.append(listener)

    def post(self, event: Event) -> None:
        """Let something have happened.

        Raises
        ------
        SessionError
            It cannot happen now; nothing was changed.
        StoreError
            It could not be kept. The force is off and the operator is called for; what was kept before is safe.
        """
        if isinstance(event, ForceStopped):
            self._ports.servo.stop_force()
        self._waiting.append(event)
        if self._busy:
            return
        self._busy = True
        refused: SessionError | None = None
        try:
            while self._waiting:
                try:
                    self._take(self._waiting.popleft())
                except SessionError as error:
                    refused = refused or error
        finally:
            self._busy = False
        if refused is not None:
            raise refused

    def poll(self) -> None:
        """Look at the device: follow the task, hear its buttons, notice a fault. Call it once a frame.

        Raises
        ------
        StoreError
            As ``post``.
        """
        samples = np.asarray(self._reader.read())  # fields of a plain array are found faster
        fault = self._ports.servo.fault
        if fault is not None and self._state.phase not in {Phase.TROUBLE, *FINAL}:
            self.post(Broke(self._ports.clock(), fault))
        if len(samples) and self._state.phase is not Phase.OPENING:
            self._hear_buttons(samples)
            self._follow(samples)
        running = self._running
        if running is not None and running.tracker.end_ns is not None:
            self._end_when_seen(running, running.tracker.end_ns)

    def view(self, now_ns: int) -> TankView | None:
        """Return what is to be drawn at ``now_ns`` (servo's clock), as late as the trial asks; None without a trial."""
        running = self._running
        if running is None:
            return None
        position_m, shown_ns = self._ports.servo.telemetry.position_at(now_ns - running.delay_ns)
        return TankView(position_m, running.tracker.at(shown_ns), shown_ns)

    def frame_shown(self, painted_ns: int, sample_ns: int) -> None:
        """Keep the age of what a frame showed: painted at one time, true of another [ns, servo's clock]."""
        if self._running is not None:
            self._running.statistics.frame(painted_ns, sample_ns)

    def _take(self, event: Event) -> None:
        if isinstance(event, Continue) and self._state.phase is Phase.TASK:
            self._leave_task()
            return
        self._state, commands = advance(self._state, event)
        try:
            for command in commands:
                self._carry_out(command, event.at_s)
        except StudyError as error:
            self._give_up(error)
        for listener in self._listeners:
            listener(self._state)

    def _carry_out(self, command: Command, at_s: float) -> None:
        servo, journal = self._ports.servo, self._ports.journal
        match command:
            case StopForce():
                servo.stop_force()
            case StopTrial():
                self._stop_trial()
            case Rest():
                servo.rest()
            case FadeIn():
                servo.fade_in()
            case Write(event, fields, measured):
                journal.append(event, t_s=at_s, **({**self._measured, **fields} if measured else fields))
            case WriteTables():
                journal.write_tables()
            case StartTrial():
                self._start_trial(command)
            case ShowPage(page):
                self._page_since_ns = servo.now_ns()
                self._ports.present(page)
            case Finish(status, reason):
                journal.finish(status, reason)

    def _give_up(self, error: StudyError) -> None:
        """Call for the operator: the servo refused, which the journal can still say, or the journal itself failed."""
        self._ports.servo.stop_force()
        if not isinstance(error, StoreError):
            self._waiting.append(Broke(self._ports.clock(), str(error)))
            return
        self._stop_trial()
        self._ports.servo.rest()
        if self._state.phase not in FINAL:
            self._state, _ = advance(self._state, Broke(self._ports.clock(), str(error)))
        self._ports.present(compose.page(self._state))
        for listener in self._listeners:
            listener(self._state)
        raise error

    def _start_trial(self, command: StartTrial) -> None:
        servo = self._ports.servo
        serial = servo.load(self._protocol.scene_for(command.condition))
        statistics = TrialStatistics(
            rate_hz=servo.rate_hz, delay_s=command.delay_s, late_s=self._protocol.limits.delay_error_ms / 1000
        )
        self._running = _Running(
            trial=command.trial,
            serial=serial,
            delay_ns=round(command.delay_s * 1e9),
            linger_ns=round(command.linger_s * 1e9),
            tracker=track(command.task),
            statistics=statistics,
            dropped_before=self._reader.dropped,
        )

    def _stop_trial(self) -> None:
        if self._running is not None:
            self._measured = self._summary(self._running)
            self._running = None

    def _summary(self, running: _Running) -> dict[str, Any]:
        dropped = self._reader.dropped - running.dropped_before
        return running.tracker.summary() | running.statistics.summary(dropped)

    def _follow(self, samples: Any) -> None:
        running = self._running
        if running is None or running.tracker.done:
            return
        mine = samples[samples["scene"] == running.serial]
        for reached in running.tracker.feed(mine):
            self._keep("target_reached", trial=running.trial, target=reached.target, t_task_s=reached.t_task_s)
        end_ns = running.tracker.end_ns
        running.statistics.feed(mine if end_ns is None else mine[mine["time_ns"] <= end_ns])

    def _end_when_seen(self, running: _Running, end_ns: int) -> None:
        """Leave the tank when what ended the task has been drawn, as late as it may be in this block."""
        outcome = running.tracker.outcome
        if outcome is not None and self._ports.servo.now_ns() - end_ns >= running.linger_ns:
            self.post(TaskDone(self._ports.clock(), outcome, self._summary(running)))

    def _leave_task(self) -> None:
        if self._running is not None:
            self._running.tracker.leave()

    def _hear_buttons(self, samples: Any) -> None:
        """Post what a button going down means; a press from before the present page is no answer to it."""
        down = np.concatenate(([self._buttons], samples["buttons"]))
        self._buttons = int(down[-1])
        pressed = down[1:] & ~down[:-1]
        if not pressed.any():
            return
        if (pressed & BUTTON_STOP).any():
            self.post(ForceStopped(self._ports.clock(), "device"))
        pressed_since = pressed[samples["time_ns"] >= self._page_since_ns]
        if (pressed_since & BUTTON_CONTINUE).any() and self._state.phase is Phase.READING:
            self.post(Continue(self._ports.clock()))

    def _keep(self, event: str, **fields: Any) -> None:
        try:
            self._ports.journal.append(event, t_s=self._ports.clock(), **fields)
        except StoreError as error:
            self._give_up(error)

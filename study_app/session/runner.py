"""The shell around the machine: carries out its commands, and looks at the device for it.

Everything that touches something goes through ``Ports``. Events come from windows (``post``) and from the device
(``poll``, once a frame); what the participant sees comes from ``view``, what was seen goes into ``frame_shown``. All of
it in one thread; a window that answers a page while it is being presented is heard after the commands under way.

A trial begins with the first ``frame_shown`` after its page was presented: then its force fades in, its task's clock
starts and its recording begins (see ``trial``).

Where the program or the machine stood still within a trial, the session pauses, and the trial comes again.

Where the disk takes nothing, the session stalls: zero force, a calm page, and what was to be done is kept and tried
again until it is done, in order and once. Then the session is paused, and goes on when somebody asks for it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from study_app.errors import SessionError, StoreError, StudyError
from study_app.haptics.model.layout import BUTTON_STOP
from study_app.protocol.model import Protocol as Study
from study_app.protocol.orders.schedule import Schedule
from study_app.session.ports import Ports
from study_app.session.resume import FIRST, Start
from study_app.session.tasks import TaskView
from study_app.session.transitions import page_builder
from study_app.session.transitions.commands import (
    CheckFlushed,
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
from study_app.session.transitions.events import (
    Broke,
    Continue,
    EndAsked,
    Event,
    ForceStopped,
    PauseAsked,
    Reconnected,
    TaskDone,
    broken,
)
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, open_session
from study_app.session.trial import RunningTrial, TankView
from study_app.session.trial_recording import Recording

BUTTON_CONTINUE = 1 << 0
RETRY_S = 1.0  # a disk that took nothing is tried again so often


@dataclass(frozen=True, slots=True)
class _Stall:
    """What the disk did not take: why, and the commands that are still to be carried out."""

    reason: str
    commands: tuple[Command, ...]
    at_s: float
    retry_s: float


class Runner:
    """Runs one session.

    Parameters
    ----------
    protocol, schedule, language : what is run, in what order, in which language
    key : block → code → condition
    ports : the world
    start : where a resumed session goes on
    """

    def __init__(
        self,
        protocol: Study,
        schedule: Schedule,
        key: Mapping[str, Mapping[str, str]],
        ports: Ports,
        language: str,
        start: Start = FIRST,
    ) -> None:
        self._protocol = protocol
        self._ports = ports
        self._state = open_session(protocol, schedule, key, language, start)
        self._reader = ports.servo.telemetry.reader()
        self._recording = Recording(ports.recorder, ports.servo.rate_hz)
        self._running: RunningTrial | None = None
        self._measured: dict[str, Any] = {}
        self._buttons = 0
        self._page_since_ns = 0
        self._waiting: deque[Event] = deque()
        self._busy = False
        self._stall: _Stall | None = None
        self._ending: tuple[Finish, float] | None = None
        self._stopped_by: Literal["operator", "program"] = "program"  # who stops the force of a session that stalls
        self._listeners: list[Callable[[SessionState], None]] = []

    @property
    def state(self) -> SessionState:
        """Where the session is."""
        return self._state

    @property
    def finished(self) -> bool:
        """Whether the session is over."""
        return self._state.phase in FINAL and self._ending is None

    @property
    def ending(self) -> bool:
        """Whether the session's end is put off until its recordings are on the disk."""
        return self._ending is not None

    @property
    def stalled(self) -> str | None:
        """Why the disk takes nothing, for the operator; None while it does."""
        return None if self._stall is None else self._stall.reason

    @property
    def task(self) -> TaskView | None:
        """The task on the device's clock, for the operator; None while no trial runs."""
        return None if self._running is None else self._running.task

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
            The session was to end while it stalled, and its end could not be written: it stays unfinished.
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
        """Look at the device: follow the task, hear its buttons, notice a fault. Call it once a frame."""
        samples = np.asarray(self._reader.read())  # fields of a plain array are found faster
        self._recording.take(samples)
        if self._ending is not None:
            if self._ports.settled():
                (finish, at_s), self._ending = self._ending, None
                self._carry_out_all((finish,), at_s)
                self._tell()
            return
        if self._stall is not None:
            if self._ports.clock() >= self._stall.retry_s:
                self._try_again(self._stall)
            return
        self._carry_out_all((CheckFlushed(),), self._ports.clock())
        if self._stalls:
            return
        fault = self._ports.servo.fault
        if fault is not None and self._state.phase not in {Phase.TROUBLE, *FINAL}:
            self.post(Broke(self._ports.clock(), fault, "device"))
        if len(samples) and self._state.phase is not Phase.OPENING:
            self._hear_buttons(samples)
            self._follow(samples)
        running = self._running
        if running is not None and running.frozen:
            self.post(PauseAsked(self._ports.clock(), "program"))
        elif running is not None and (outcome := running.outcome()) is not None:
            self.post(TaskDone(self._ports.clock(), outcome, running.summary()))

    def view(self, now_ns: int) -> TankView | None:
        """Return what is to be drawn at ``now_ns`` (servo's clock), as late as the trial asks; None without a trial."""
        return None if self._running is None else self._running.view(now_ns)

    def frame_shown(self, painted_ns: int, sample_ns: int) -> None:
        """Take a frame of the trial's tank: painted at one time, true of another [ns, servo's clock]."""
        if self._running is None:
            return
        try:
            self._running.frame(painted_ns, sample_ns)
        except StudyError as error:
            self._fail(error)

    def _take(self, event: Event) -> None:
        if self._stall is not None and not self._take_while_stalled(event, self._stall):
            return
        if isinstance(event, Continue) and self._state.phase is Phase.TASK:
            if self._running is not None:
                self._running.leave()
            return
        self._state, commands = advance(self._state, event)
        if isinstance(event, Reconnected):
            self._recording.forget()
        self._carry_out_all(commands, event.at_s)
        if self._stall is None:
            self._tell()

    @property
    def _stalls(self) -> bool:
        return self._stall is not None

    def _tell(self) -> None:
        for listener in self._listeners:
            listener(self._state)

    def _carry_out_all(self, commands: Sequence[Command], at_s: float) -> None:
        for index, command in enumerate(commands):
            if isinstance(command, Finish) and not self._ports.settled():
                self._ending = command, at_s
                continue
            try:
                self._carry_out(command, at_s)
            except StoreError as error:
                self._hold(commands[index:], at_s, error)
                return
            except StudyError as error:
                self._fail(error)
                return

    def _fail(self, error: StudyError) -> None:
        """Stop the force, and call the operator."""
        self._ports.servo.stop_force()
        self.post(broken(self._ports.clock(), error))

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
            case Write(event, fields, measured, waits):
                journal.append(event, t_s=at_s, waits=waits, **({**self._measured, **fields} if measured else fields))
            case CheckFlushed():
                journal.check_flushed()
            case WriteTables():
                journal.write_tables()
            case StartTrial():
                self._running = self._prepared(command)
            case ShowPage(page):
                self._page_since_ns = servo.now_ns()
                self._ports.present(page)
            case Finish(status, reason):
                journal.finish(status, reason)

    def _hold(self, commands: Sequence[Command], at_s: float, error: StoreError) -> None:
        """Stop the force and keep what is still to be done; the participant sees a calm page until it is."""
        servo = self._ports.servo
        servo.stop_force()
        self._stop_trial()
        servo.rest()
        self._stall = _Stall(str(error), tuple(commands), at_s, self._ports.clock() + RETRY_S)
        over = self._state.phase in FINAL
        self._ports.present(page_builder.page(self._state if over else replace(self._state, phase=Phase.TROUBLE)))
        self._tell()

    def _try_again(self, stall: _Stall) -> bool:
        """Do what was left to do; if the disk takes it, pause. Return whether it did."""
        waiting, busy = tuple(self._waiting), self._busy
        self._stall, self._busy = None, True
        self._carry_out_all(stall.commands, stall.at_s)
        self._busy = busy
        if self._stalls:  # again, by what was just carried out
            return False
        self._waiting = deque(waiting)  # what a page said that is covered again at once is said again later
        if self._state.phase in {Phase.READING, Phase.TASK, Phase.ANSWERING, Phase.PAUSED}:
            self._waiting.appendleft(ForceStopped(self._ports.clock(), self._stopped_by))
        self._stopped_by = "program"
        if self._waiting and not busy:
            self.post(self._waiting.popleft())
        elif not busy:
            self._tell()
        return True

    def _take_while_stalled(self, event: Event, stall: _Stall) -> bool:
        """Return whether the event can be taken after all: an end is, if need be without being written."""
        if isinstance(event, ForceStopped):
            if event.by == "operator":
                self._stopped_by = "operator"
            return False
        if not isinstance(event, EndAsked):
            raise SessionError(f"{stall.reason}; until then the session waits")
        if not self._try_again(stall):
            self._state, _ = advance(self._state, event)
            self._ports.present(page_builder.page(self._state))
            self._tell()
            raise StoreError(
                f"{stall.reason}; the session's end is not written either: resume it later, or end it then"
            )
        if self._waiting:
            self._waiting.append(event)
            return False
        return True

    def _prepared(self, command: StartTrial) -> RunningTrial:
        return RunningTrial(
            command,
            self._protocol.scene_for(command.condition),
            late_s=self._protocol.limits.delay_error_ms / 1000,
            servo=self._ports.servo,
            reader=self._reader,
            recording=self._recording,
            paints=self._ports.paints,
        )

    def _stop_trial(self) -> None:
        self._recording.stop()
        if self._running is not None:
            self._measured = self._running.summary()
            self._running = None

    def _follow(self, samples: Any) -> None:
        if (running := self._running) is None:
            return
        self._carry_out_all(
            [
                Write("target_reached", {"trial": running.trial, "target": one.target, "t_task_s": one.t_task_s})
                for one in running.follow(samples)
            ],
            self._ports.clock(),
        )

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
        if (pressed_since & BUTTON_CONTINUE).any() and self._button_goes_on and not self._stalls:
            self.post(Continue(self._ports.clock()))

    @property
    def _button_goes_on(self) -> bool:
        """Whether the device's button goes on: from a page to read, but a squeeze gives no consent."""
        state = self._state
        return state.phase is Phase.READING and self._protocol.pages[state.page_id].kind != "consent"

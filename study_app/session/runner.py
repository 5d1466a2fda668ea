"""Run one session: feed events to the state machine, execute its commands, and poll the device.

All side effects go through ``Ports``. Events come from windows (``post``) and from the device (``poll``, once a frame).
``view`` returns the tank to draw, and ``frame_shown`` records what was drawn. Everything runs in one thread. Events
posted while a command runs are queued.

A trial begins with the first ``frame_shown`` after its page was presented: then its force fades in, its task's clock
starts and its recording begins (see ``trial``). If the program or the computer is suspended during a trial, the session
pauses and the trial is repeated.

If a write fails, the session stalls: zero force, a waiting page, and the pending writes are retried in order, each
exactly once. Afterwards the session is paused until the operator resumes it.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from study_app.errors import SessionError, StoreError, StudyError
from study_app.protocol.model import Protocol as Study
from study_app.protocol.orders import Schedule
from study_app.protocol.presented import link_seed
from study_app.protocol.trials import DELAY
from study_app.session.device_buttons import DeviceButtons
from study_app.session.ports import Ports
from study_app.session.resume import FIRST, Start
from study_app.session.tasks import Outcome, TankView, TaskView
from study_app.session.transitions import events
from study_app.session.transitions.state import FINAL, Phase, SessionState, Stall
from study_app.session.transitions.table import advance, initial_state
from study_app.session.trial import Recording, RunningTrial, is_ball_at_start, resting_view
from study_app.store.journals.journal_events import TargetReached
from study_app.store.session_progress import broken_interval_limits, broken_limits, delivered_values

_MAX_STANDSTILL_S = 3.0  # a longer gap between two trials is noted; in a trial see `trial.FROZEN_S` [choice]
RETRY_S = 1.0  # interval between attempts to write after a failure [s]


class Runner:
    """Run one session; ``key`` maps block and code to the condition, ``start`` is the point of resumption.

    ``secret`` is the sealed key's nonce, from which levels are drawn; it is not needed in a study without designs.
    """

    def __init__(
        self,
        protocol: Study,
        schedule: Schedule,
        key: Mapping[str, Mapping[str, str]],
        ports: Ports,
        language: str,
        start: Start = FIRST,
        secret: bytes = b"",
    ) -> None:
        self._protocol = protocol
        self._ports = ports
        self._state = initial_state(protocol, schedule, key, language, start, secret)
        self._reader = ports.servo.telemetry.reader()
        self._recording = Recording(ports.recorder, ports.servo.rate_hz)
        self._running: RunningTrial | None = None
        self._measured: dict[str, Any] = {}
        self._buttons = DeviceButtons()
        self._page_since_ns = 0
        self._waiting: deque[events.Event] = deque()
        self._busy = False
        self._retry_s = 0.0  # time of the next attempt to write after a failure
        self._polled_s = math.inf
        self._ending: tuple[events.Finish, float] | None = None
        self._cause = ""
        self._listeners: list[Callable[[SessionState], None]] = []

    @property
    def state(self) -> SessionState:
        return self._state

    @property
    def finished(self) -> bool:
        return self._state.over and self._ending is None

    @property
    def ending(self) -> bool:
        """Whether the session's end is waiting for its recordings to be on the disk."""
        return self._ending is not None

    @property
    def stalled(self) -> str | None:
        """The reason why writing fails, for the operator; None if it does not."""
        return None if self._state.stall is None else self._state.stall.reason

    @property
    def cause(self) -> str:
        """The last failure, for the operator and the log; "" if there was none since the device was reconnected."""
        return self._cause

    @property
    def task(self) -> TaskView | None:
        """The task on the device's clock, for the operator; None while no trial runs."""
        return None if self._running is None else self._running.task

    def on_change(self, listener: Callable[[SessionState], None]) -> None:
        """Call ``listener`` with the new state after every accepted event."""
        self._listeners.append(listener)

    def post(self, event: events.Event) -> None:
        """Apply an event. Raise SessionError, leaving the state unchanged, if it is not allowed now.

        StoreError means that the session ended while it was stalled: its end was not written, so it stays unfinished.
        """
        if isinstance(event, events.ForceStopped):
            self._ports.servo.stop_force()
        self._waiting.append(event)
        if self._busy:
            return
        self._busy = True
        first_error: SessionError | None = None
        try:
            while self._waiting:
                try:
                    self._apply_event(self._waiting.popleft())
                except SessionError as error:
                    first_error = first_error or error
        finally:
            self._busy = False
        if first_error is not None:
            raise first_error

    def poll(self) -> None:
        """Poll the device: update the task, handle buttons, detect faults. Call it once per frame."""
        samples = np.asarray(self._reader.read())  # field access is faster on a plain array
        self._recording.add_samples(samples)
        if self._ending is not None:
            if self._ports.settled():
                (finish, at_s), self._ending = self._ending, None
                self._execute_all((finish,), at_s)
                self._notify_listeners()
            return
        now_s = self._ports.clock()
        standstill_s, self._polled_s = now_s - self._polled_s, now_s
        if self._state.stall is not None:
            if now_s >= self._retry_s:
                self.post(events.WriteRetried(now_s))
            return
        if not self._execute_all((events.CheckFlushed(),), now_s):
            return
        fault = self._ports.servo.fault
        if fault is not None and self._state.phase not in {Phase.TROUBLE, *FINAL}:
            self.post(events.Broke(self._ports.clock(), fault, "device"))
        if len(samples) and self._state.phase is not Phase.OPENING:
            for event in self._buttons.events(samples, self._page_since_ns, self._ports.clock(), self._button_state):
                self.post(event)
            self._follow_samples(samples)
        running = self._running
        if running is None and standstill_s > _MAX_STANDSTILL_S and self._state.phase not in {Phase.OPENING, *FINAL}:
            self.post(events.Note(now_s, "note", f"the program stalled for {standstill_s:.1f} s"))
        if running is not None and running.frozen:
            self.post(events.PauseRequested(self._ports.clock(), "program"))
        elif running is not None and (outcome := running.outcome()) is not None:
            self.post(self._task_done_event(running, outcome))
        elif self._state.phase in {Phase.RESTING, Phase.FEEDBACK} and now_s >= (self._state.until_s or 0.0):
            rest = self.view(self._ports.servo.now_ns())
            if rest is None or is_ball_at_start(rest, self._state.task):
                self.post(events.TimeUp(now_s))

    def _button_state(self) -> tuple[SessionState, bool]:
        return self._state, self._running is not None and self._running.adjustable

    def view(self, now_ns: int) -> TankView | None:
        """Return the view to draw at ``now_ns`` (servo's clock) with the trial's delay, in a rest without one.

        Return None if there is neither a trial nor a rest.
        """
        if self._running is not None:
            return self._running.view(now_ns)
        if self._state.phase is not Phase.RESTING:
            return None
        return resting_view(self._ports.servo, self._state.task, now_ns)

    def frame_shown(self, painted_ns: int, sample_ns: int) -> None:
        """Record the time of a painted frame, and of the sample that it shows [ns, servo's clock]."""
        if self._running is None:
            return
        try:
            self._running.frame(painted_ns, sample_ns)
        except StudyError as error:
            self._report_failure(error)

    def _apply_event(self, event: events.Event) -> None:
        if isinstance(event, events.Stepped) and not self._button_state()[1]:
            return  # an interval can be adjusted only from its first frame until its end
        if isinstance(event, events.WriteRetried | events.EndRequested) and self._state.stall is not None:
            self._retry_writes(self._state.stall)
            if isinstance(event, events.WriteRetried):
                return
        stall = self._state.stall
        self._state, commands = advance(self._state, event)
        if isinstance(event, events.Broke):
            self._cause = event.what
        elif isinstance(event, events.Reconnected):
            self._cause = ""
            self._recording.forget()
        if self._execute_all(commands, event.at_s):
            self._notify_listeners()
        if isinstance(event, events.EndRequested) and stall is not None:
            raise StoreError(
                f"{stall.reason}; the end of the session could not be recorded either, so resume or end the session "
                "later"
            )

    def _retry_writes(self, stall: Stall) -> None:
        """Retry the pending writes; continue the session if they succeed."""
        waiting = tuple(self._waiting)
        self._state, commands = advance(self._state, events.WriteRetried(stall.at_s))
        succeeded = self._execute_all(commands, stall.at_s)
        failures = [event for event in self._waiting if isinstance(event, events.Broke) and event not in waiting]
        self._waiting = deque((*waiting, *failures))  # other events belong to a page that is covered again
        if succeeded:
            self._apply_event(events.WriteCompleted(self._ports.clock()))

    def _notify_listeners(self) -> None:
        for listener in self._listeners:
            listener(self._state)

    def _execute_all(self, commands: Sequence[events.Command], at_s: float) -> bool:
        """Execute commands in order; return whether all writes succeeded. Other failures are reported as events."""
        for index, command in enumerate(commands):
            if isinstance(command, events.Finish) and not self._ports.settled():
                self._ending = command, at_s
                continue
            try:
                self._execute(command, at_s)
            except StoreError as error:
                self._retry_s = self._ports.clock() + RETRY_S
                self._apply_event(events.WriteFailed(at_s, str(error), tuple(commands[index:])))
                return False
            except StudyError as error:
                self._report_failure(error)
                return True
        return True

    def _report_failure(self, error: StudyError) -> None:
        self._ports.servo.stop_force()
        self.post(events.broken(self._ports.clock(), error))

    def _execute(self, command: events.Command, at_s: float) -> None:
        servo, journal = self._ports.servo, self._ports.journal
        match command:
            case events.StopForce():
                servo.stop_force()
            case events.LeaveTask():
                if self._running is not None:
                    self._running.leave()
            case events.StopTrial():
                self._recording.stop()
                if self._running is not None:
                    self._measured, self._running = self._running.summary(), None
            case events.Rest():
                servo.rest()
            case events.FadeIn():
                servo.fade_in()
            case events.Write(line, measured, waits):
                journal.append(replace(line, others=self._measured) if measured else line, t_s=at_s, waits=waits)
            case events.CheckFlushed():
                journal.check_flushed()
            case events.WriteTables():
                journal.write_tables()
            case events.StartTrial():
                self._running = self._prepare_trial(command)
            case events.Adjust(presented, delay_s, stepped):
                changed_scene = None if presented.vary == DELAY else self._protocol.presented_scene(presented)
                scene = None if self._running is None else self._running.adjust(changed_scene, delay_s)
                journal.append(replace(stepped, scene=scene), t_s=at_s, waits=False)
            case events.ShowPage(page):
                self._page_since_ns = servo.now_ns()
                self._ports.present(page)
            case events.Finish(status, reason):
                journal.finish(status, reason)

    def _prepare_trial(self, command: events.StartTrial) -> RunningTrial:
        schedule = self._state.plan.schedule
        condition = self._protocol.conditions[command.presented.condition]
        seed = link_seed(schedule.seed, schedule.participant, command.trial, command.attempt, command.interval)
        return RunningTrial(
            command,
            self._protocol.presented_scene(command.presented, seed),
            late_s=self._protocol.limits.delay_error_ms / 1000,
            servo=self._ports.servo,
            reader=self._reader,
            recording=self._recording,
            paints=self._ports.paints,
            hides_ball=condition.ball == "hidden",
            video=self._ports.video(condition.view) if self._ports.video and condition.shows_video else None,
            videos=any(condition.shows_video for condition in self._protocol.conditions.values()),
        )

    def _task_done_event(self, running: RunningTrial, outcome: Outcome) -> events.TaskDone:
        """Return the event of a completed task; for an interval, with delivered values and violated limits."""
        summary, limits, command = running.summary(), self._protocol.limits, running.command
        reasons: tuple[str, ...] = ()
        if command.interval is not None and limits.attempts is not None:
            interval_arguments = command.presented, command.task
            delivery = delivered_values(self._protocol, *interval_arguments, running.samples, adjusted=command.adjusts)
            summary |= delivery.columns
            reasons = (
                *broken_interval_limits(limits, *interval_arguments, delivery, adjusted=command.adjusts),
                *broken_limits(summary, limits.model_dump()),
            )
        return events.TaskDone(self._ports.clock(), outcome, summary, reasons)

    def _follow_samples(self, samples: Any) -> None:
        if (running := self._running) is None:
            return
        self._execute_all(
            [
                events.Write(TargetReached(trial=running.trial, target=reached.target, t_task_s=reached.t_task_s))
                for reached in running.follow(samples)
            ],
            self._ports.clock(),
        )

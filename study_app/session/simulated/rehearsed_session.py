"""A session in virtual time with a simulated participant, who reads, does the tasks and answers by what was felt.

What the participant does and answers in a trial is drawn from streams of that trial.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from study_app.devices.rig import Rig, open_rig, study_settings
from study_app.devices.simulated.hand_commands import hand_of
from study_app.errors import SessionError, StoreError
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, stream
from study_app.protocol.simulated_observer import NO_FEATURES, TrialFeatures
from study_app.protocol.trials.presentation import delays_force
from study_app.session.pages import (
    DesignPage,
    FeedbackPage,
    Interval,
    Page,
    PausePage,
    QuestionnairePage,
    TaskPage,
    TextPage,
)
from study_app.session.ports import KeptSession, Ports
from study_app.session.resume import FIRST, Start
from study_app.session.runner import Runner
from study_app.session.simulated.adjusting_observer import LOOK_S as LOOK_AT_SETTING_S
from study_app.session.simulated.adjusting_observer import AdjustingObserver
from study_app.session.simulated.design_observer import OBSERVER, Comparison, Observer
from study_app.session.simulated.observers import Draw, SensedTrial, hand_for, reading_s, rest
from study_app.session.simulated.participant import SimulatedParticipant
from study_app.session.transitions.events import Begin, Continue, Event, ResumeAsked, Stepped, Submitted
from study_app.session.trial import TankView

LOOK_S = 0.05  # the session looks at the device so often
IDLE_S = 0.5  # and while reading and answering
FRAME_S = 1 / 60
PAINT_S = (0.002, 0.006)  # from looking at the clock to the frame being on the screen


def rehearsal_rig(study: Protocol, person: str, seed: int, device: str) -> Rig:
    """Return a device with a simulated hand, and its servo on a virtual clock that only the servo advances."""
    settings = study_settings(study, stream(seed, f"rehearsal/{person}/hand"))
    rig = open_rig(device, settings, clock=VirtualClock())
    if hand_of(rig.device) is None:
        rig.stop()
        raise SessionError(f"device '{device}' has no hand that takes orders, so that it cannot be rehearsed on")
    return rig


@dataclass(slots=True)
class _Setting:
    """A level that is being set: by whom, what was sensed since the last steps, and when they were made [s]."""

    observer: AdjustingObserver
    scale: float
    judged_s: float = 0.0
    done: bool = False
    senses: SensedTrial = field(init=False)

    def __post_init__(self) -> None:
        self.senses = SensedTrial(self.scale)


class RehearsedSession(SimulatedParticipant):
    """One session and its simulated participant.

    Parameters
    ----------
    study : Protocol
        What is run.
    schedule : Schedule
        In what order.
    rig : Rig
        Servo, device and clock.
    store : KeptSession
        Where it is kept.
    start : Start
        Where a resumed session goes on.
    felt : callable, optional
        Called after every trial or interval with the trial's number and what was felt in it until then, by interval.
    known : mapping of int to tuple of TrialFeatures, optional
        What is answered by instead, by trial number.
    observer : Observer, optional
        Discriminates the intervals of a trial.
    """

    def __init__(
        self,
        study: Protocol,
        schedule: Schedule,
        rig: Rig,
        store: KeptSession,
        start: Start = FIRST,
        felt: Callable[[int, tuple[TrialFeatures, ...]], object] | None = None,
        known: Mapping[int, tuple[TrialFeatures, ...]] | None = None,
        observer: Observer = OBSERVER,
    ) -> None:
        super().__init__(study, schedule, observer)
        self._known = known or {}
        self._tell_felt = felt
        self.rig = rig
        hand = hand_of(rig.device)
        assert hand is not None  # noqa: S101 - `rehearsal_rig` has looked
        self._hand = hand
        self._now_s = store.clock.seconds
        self._felt_in: dict[int, tuple[TrialFeatures, ...]] = {}
        self._touch = rig.servo.telemetry.reader()
        self._next_frame_ns = 0
        self._period_s = 1 / study.device.rate_hz if delays_force(study) else None
        self._paint: Draw = self._stream("screen")
        ports = Ports(rig.servo, store, self._present, self._now_s, store.recorder)
        self._runner = Runner(study, schedule, store.key.codes, ports, study.study.languages[0], start, store.key.nonce)

    def _seconds(self) -> float:
        return self._now_s()

    def _post(self, event: Event) -> None:
        self._runner.post(event)
        self._notice()

    def _poll(self) -> None:
        self._runner.poll()
        self._notice()

    def _notice(self) -> None:
        """End where a person would wait for the disk."""
        if self._runner.stalled is not None:
            raise StoreError(self._runner.stalled)

    def run(self) -> None:
        """Go from the first page to the last."""
        self._post(Begin(self._now_s()))
        if isinstance(self.page, PausePage):  # before the trial that a resumed session goes on with
            self._post(ResumeAsked(self._now_s(), "participant"))
        while not self._runner.finished:
            match self.page:
                case TextPage() as page:
                    self._pass(reading_s(page))
                    if page is self.page:
                        self._post(Continue(self._now_s()))
                case FeedbackPage() | TaskPage(interval=Interval(resting=True)):
                    self._pass(LOOK_S)
                case TaskPage() as page:
                    self._do(page)
                case QuestionnairePage() | DesignPage() as page:
                    self._fill_in(page)
                case _:
                    raise SessionError(f"the rehearsal failed: {self.rig.servo.fault or self.page}")

    def _present(self, page: Page) -> None:
        self.page = page

    def _pass(self, seconds: float) -> None:
        """Let time pass while nothing is done."""
        end_s = self._now_s() + seconds
        page = self.page
        while self._now_s() < end_s and page is self.page:
            self._advance(min(IDLE_S, end_s - self._now_s()))
            self._poll()

    def _advance(self, seconds: float) -> None:
        """Let the servo take its ticks; who ends the program ends them, and without them no time passes."""
        servo = self.rig.servo
        if servo.advance(max(1, round(seconds * servo.rate_hz))) == 0 and servo.fault is None:
            raise SessionError("the rehearsal was stopped from outside")

    def _do(self, page: TaskPage) -> None:
        """Do a task until its page is left, seeing every frame and feeling every tick."""
        interval = page.interval
        named = str(page.trial) if interval is None else f"{page.trial}/{interval.number}"
        arm, draw = self._hand, self._stream(f"{named}/behaviour")
        self._paint = self._stream(f"{named}/screen")
        senses = SensedTrial(self._study.scene.scale, self._period_s)
        self._touch.read()
        self._next_frame_ns = self.rig.servo.now_ns()
        hand = hand_for(page.task, arm, draw, self._now_s())
        setting = _Setting(self._adjusting(page.trial), self._study.scene.scale) if page.adjusts else None
        self.look(senses)  # the first frame, with which the trial begins, is painted at once
        while page is self.page:
            self._advance(LOOK_S)
            view = self.look(senses)
            wants_to_go_on = view is not None and hand.act(self._now_s(), view)
            samples = np.asarray(self._touch.read())
            senses.feel(samples)
            self._poll()
            if setting is not None and view is not None and page is self.page:
                self._set(page, setting, view, samples)
            if wants_to_go_on and page is self.page:
                self._post(Continue(self._now_s()))
        rest(page.task, arm)
        earlier = () if interval is None or interval.number == 1 else self._felt_in.get(page.trial, ())
        self._felt_in[page.trial] = (*earlier, senses.features())
        if self._tell_felt is not None:
            self._tell_felt(page.trial, self._felt_in[page.trial])

    def _set(self, page: TaskPage, setting: _Setting, view: TankView, samples: Any) -> None:
        """Adjust what is felt by what was sensed since the last steps, and confirm where that is done."""
        setting.senses.feel(samples)
        setting.senses.see(self.rig.servo.now_ns(), view)
        since_s = view.task.elapsed_s - setting.judged_s
        if setting.done or since_s < LOOK_AT_SETTING_S or view.task.elapsed_s < page.task.lead_s + LOOK_AT_SETTING_S:
            return
        sensed = self._attended(page.trial).sensed(setting.senses.features())
        steps = setting.observer.steps(sensed, self._remembered(page.trial, sensed))
        setting.senses.clear()
        setting.judged_s = view.task.elapsed_s
        if steps:
            self._post(Stepped(self._now_s(), steps))
        else:
            setting.done = True
            self.answers += 1
            self._post(Submitted(self._now_s()))

    def look(self, senses: SensedTrial) -> TankView | None:
        """Show the frames that are due since the last look; return what the newest showed, None where none was due."""
        view = None
        while self._next_frame_ns <= self.rig.servo.now_ns():
            view = self._runner.view(self._next_frame_ns)
            if view is not None:
                low, high = PAINT_S
                painted_ns = self._next_frame_ns + round(1e9 * (low + (high - low) * self._paint()))
                self._runner.frame_shown(painted_ns, view.sample_time_ns)
                senses.see(painted_ns, view)
            self._next_frame_ns += round(1e9 * FRAME_S)
        return view

    def _felt(self, trial: int | None) -> TrialFeatures:
        return NO_FEATURES if trial is None else {**self._felt_in, **self._known}[trial][-1]

    def _sensed(self, block: Block) -> Mapping[int, Sequence[float]]:
        sensed = Comparison.of(self._study, block, self.observer).sensed
        felt_in = {**self._felt_in, **self._known}
        return {
            number: [*map(sensed, felt)] for number, felt in felt_in.items() if self._trials[number].block == block.id
        }

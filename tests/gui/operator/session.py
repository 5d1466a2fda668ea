"""A demo session that is built event by event, as its journal would report it."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from study_app.gui.operator.operator_view import OperatorView, Session, stages, view_session
from study_app.gui.operator.servo_health import ServoHealth
from study_app.haptics.model.layout import SAMPLE, records
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.schedule import Schedule, Trial, build_schedule
from study_app.store.session_progress.progress import Progress
from tests.journal_lines import event_of


@dataclass
class Told:
    """The progress of a session; ``now_s`` advances with every event."""

    protocol: Protocol
    schedule: Schedule
    session: Session
    progress: Progress = field(default_factory=Progress)
    now_s: float = 0.0

    def tell(self, event: str, after_s: float = 0.0, **fields: Any) -> None:
        self.now_s += after_s
        self.progress.process_line(event_of(event, t_s=self.now_s, **fields))

    def welcome(self) -> None:
        self.tell("session_started", limits=self.protocol.limits.model_dump())
        self.tell("page_shown", 1.0, page="welcome")

    def make_single_blind(self) -> None:
        """Make the session single-blind, so that the operator sees forces."""
        study = self.protocol.study.model_copy(update={"blinding": "single"})
        self.session = replace(self.session, protocol=self.protocol.model_copy(update={"study": study}))

    def start(self, number: int, attempt: int = 1) -> None:
        """Start a trial; earlier steps are skipped."""
        trial = self.schedule.trials[number - 1]
        for step in self.schedule.steps[self.progress.here + 1 : self.schedule.steps.index(trial)]:
            self.tell("passed_over", **({"trial": step.number} if isinstance(step, Trial) else {"page": step.page_id}))
        self.tell("trial_started", 10.0, trial=number, attempt=attempt)

    def end(self, number: int, outcome: str = "complete", **measured: float) -> None:
        self.tell("trial_ended", 20.0, trial=number, attempt=1, outcome=outcome, **measured)

    def answer(self, number: int) -> None:
        items = self.schedule.trials[number - 1].items
        self.tell("responses", 5.0, trial=number, attempt=1, items=[{"item": item} for item in items])

    def view(self, health: ServoHealth | None = None, *, force_on: bool = True, **said: Any) -> OperatorView:
        vitals = (health or ServoHealth(1000.0)).vitals()
        return view_session(self.session, self.progress, vitals, now_s=self.now_s, force_on=force_on, **said)


def new_session() -> Told:
    """Return a session of the demo before its first event."""
    protocol = load("demo")
    schedule = build_schedule(protocol, "P007", 357711)
    session = Session(
        protocol=protocol,
        schedule=schedule,
        stages=stages(protocol, schedule),
        who="Participant P007  ·  session 1  ·  seed 357711",
        expected_s=180.0,
        answers_of=orders_of(protocol).answers,
        lateness_limit_s=protocol.limits.lateness_ms / 1000,
        device_name="Mouse",
        device_icon="mouse",
        device_rows=(("Priority", "normal"),),
    )
    return Told(protocol, schedule, session)


def ticks(count: int, *, first: int = 0, lateness_ns: int = 15_000) -> Any:
    """Return samples of a servo at 1 kHz."""
    samples = records(SAMPLE, count)
    samples.tick = np.arange(first, first + count)
    samples.time_ns = samples.tick * 1_000_000
    samples.lateness_ns = lateness_ns
    return samples


def measured_health() -> ServoHealth:
    """Return three seconds of a servo with frames and a moving hand."""
    measured = ServoHealth(1000.0)
    measured.add_samples(ticks(3000))
    for frame in range(120):
        measured.add_frame(1 + frame * 16_666_667)
    for step in range(200):
        at = step * 0.02
        measured.add_hand_position(at, (0.02 * np.sin(at), 0.01 * np.cos(at), 0.005))
    return measured

"""The state of a session as a frozen value, changed only by `table.advance`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal, TypeAlias

from study_app.errors import SessionError
from study_app.protocol.model import Protocol, Questionnaire
from study_app.protocol.orders import FormStep, PageStep, Schedule, Step, Trial
from study_app.protocol.presented import Presentation, next_level
from study_app.protocol.questions import Context, Question, shown_questions
from study_app.protocol.randomization import Key
from study_app.protocol.trials import Adjusting, Adjustment, AnyTask, Design, TrialResult
from study_app.session.resume import FIRST, Start
from study_app.session.transitions.events import Command
from study_app.store.journals.journal_events import Answer


class Phase(Enum):
    """The phase of a session: the participant's current activity."""

    OPENING = "opening"
    READING = "reading"
    TASK = "task"
    RESTING = "resting"
    ANSWERING = "answering"
    FEEDBACK = "feedback"
    PAUSED = "paused"
    TROUBLE = "trouble"
    STALLED = "stalled"
    COMPLETE = "complete"
    ENDED = "ended"


Hold: TypeAlias = Literal["pause", "force"]

FINAL = frozenset({Phase.COMPLETE, Phase.ENDED})


@dataclass(frozen=True, slots=True)
class Plan:
    """The data of a session that do not change, except the language, which the participant may choose at the start.

    ``key`` (block → code → condition or track) and ``secret``, from which levels are drawn, are blinded and never
    printed. ``start`` is the point at which the session starts or was resumed.
    """

    protocol: Protocol = field(repr=False)
    schedule: Schedule
    key: Mapping[str, Mapping[str, str]] = field(repr=False)
    language: str
    start: Start = FIRST
    secret: bytes = field(default=b"", repr=False)

    def due(self, trial: Trial, heard: Sequence[TrialResult]) -> Presentation | None:
        """Return the presentation of a trial of a block with a design; None if it is skipped."""
        return next_level(self.protocol, Key(self.key, self.secret), self.schedule, trial, heard)

    def condition(self, trial: Trial) -> str:
        """Return the condition behind a trial's code."""
        return self.key[trial.block][trial.code]


@dataclass(frozen=True, slots=True)
class Stall:
    """A failed write: its reason, and the ``pending`` commands of time ``at_s``.

    ``before`` is the phase to which the session returns, ``by`` the person who stopped its force during the stall.
    """

    reason: str
    pending: tuple[Command, ...] = field(repr=False)
    at_s: float
    before: Phase
    by: Literal["participant", "operator", "device", "program"] = "program"


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionState:
    """The state of a session at one time.

    ``index`` counts the schedule's steps (−1 before the first, their number after the last), ``attempt`` the
    presentations of the current trial from 1. ``answers`` holds the shown or answered statements of the current
    questionnaire. ``interrupted`` is the phase to which the session returns after a pause or a device failure.
    ``force_off`` means that the force was stopped and has not been faded in again, ``held`` that only the operator can
    end the pause. ``stall`` is set while writes fail. ``since_s`` is the start time of the current step [s, session's
    clock]. For trials with a design, ``heard`` holds the results so far, ``due`` the content of the current trial,
    ``interval`` its current interval (from 1), and ``until_s`` the end of a rest or a feedback [s, session's clock].
    ``errors_ms`` is the mean error of the delay in each of its intervals so far, ``invalid`` the number of its attempts
    that were not delivered as requested. ``steps`` is the sum of the requested steps of the current adjustment, and
    ``place`` the resulting position on the scale of levels, which depends on the start.
    """

    plan: Plan = field(repr=False)
    phase: Phase = Phase.OPENING
    index: int = -1
    attempt: int = 1
    answers: Mapping[str, Answer] = field(default_factory=dict)
    interrupted: Phase | None = None
    force_off: bool = False
    held: Hold | None = None
    stall: Stall | None = None
    since_s: float = 0.0
    heard: tuple[TrialResult, ...] = field(default=(), repr=False)
    due: Presentation | None = field(default=None, repr=False)
    interval: int = 1
    until_s: float | None = None
    errors_ms: tuple[float | None, ...] = ()
    invalid: int = 0
    steps: int = 0
    place: int = field(default=0, repr=False)

    @property
    def step(self) -> Step | None:
        """The current step; None before the first and after the last."""
        steps = self.plan.schedule.steps
        return steps[self.index] if 0 <= self.index < len(steps) else None

    @property
    def over(self) -> bool:
        """Whether the session has ended, except for pending writes."""
        return (self.phase if self.stall is None else self.stall.before) in FINAL

    @property
    def lost_device(self) -> bool:
        """Whether the session stopped because of its device and can continue after reconnection."""
        return self.phase is Phase.TROUBLE and self.interrupted is not None

    @property
    def page_id(self) -> str:
        """The id of the current text page; raises SessionError if there is none."""
        if isinstance(step := self.step, PageStep):
            return step.page_id
        raise SessionError("no page is currently being read: wait for the next page")

    @property
    def stays_until_s(self) -> float | None:
        """The earliest time at which the text page can be left [s, session's clock]; None if it can be left at once."""
        least_s = self.plan.protocol.pages[self.page_id].min_s
        return None if least_s is None else self.since_s + least_s

    @property
    def languages(self) -> tuple[str, ...]:
        """The languages that can be chosen now: those of the study until consent is given, then none."""
        languages, pages = self.plan.protocol.study.languages, self.plan.protocol.pages
        earlier_steps = self.plan.schedule.steps[: self.index]
        is_before_consent = all(
            isinstance(step, PageStep) and pages[step.page_id].kind != "consent" for step in earlier_steps
        )
        return languages if len(languages) > 1 and is_before_consent and isinstance(self.step, PageStep) else ()

    @property
    def trial(self) -> Trial:
        """The current trial; raises SessionError if there is none."""
        if isinstance(step := self.step, Trial):
            return step
        raise SessionError("no trial is currently running: wait for the next trial")

    @property
    def task(self) -> AnyTask:
        """The task of the current trial; while its level is set, with the duration of a setting."""
        block = self.plan.protocol.blocks[self.trial.block]
        task = self.plan.protocol.tasks[block.task]
        method = self.plan.protocol.method_of(block) if self.adjusts else None
        return task.lasting(method.most_s) if isinstance(method, Adjustment) else task

    @property
    def adjusts(self) -> bool:
        """Whether the participant sets the level of the current interval, or of the one after the rest."""
        design = self.design
        return design is not None and design.adjusts and self.interval == design.intervals

    @property
    def adjusting(self) -> Adjusting | None:
        """The current setting, with its start; None if nothing is set."""
        if not self.adjusts or self.due is None or self.due.level is None:
            return None
        block = self.plan.protocol.blocks[self.trial.block]
        return self.plan.protocol.adjusting(block, self.due.standard, self.due.level)

    @property
    def asks(self) -> bool:
        """Whether questions follow the current trial."""
        return self.plan.protocol.questionnaire_of(self.trial.block) is not None

    @property
    def design(self) -> Design | None:
        """The design of the current trial; None if it is a single task."""
        block = self.plan.protocol.blocks[self.trial.block]
        return None if block.design is None else self.plan.protocol.design_of(block)

    @property
    def items(self) -> tuple[str, ...]:
        """The ids of the questions of the current page, or of those after the current task, in the order shown."""
        return self.step.items if isinstance(self.step, FormStep) else self.trial.items

    @property
    def questions(self) -> tuple[Question, ...]:
        """The questions of the current page, in the order shown."""
        return tuple(map(self.questionnaire.item, self.items))

    @property
    def shown(self) -> tuple[str, ...]:
        """The ids of the questions that are visible with the answers so far."""
        return shown_questions(
            self.questions, {item: answer.value for item, answer in self.answers.items() if answer.given}
        )

    @property
    def context(self) -> Context:
        """The context of the questions of the current page."""
        return self.questionnaire.context(self.plan.protocol.scales, self.plan.language)

    @property
    def questionnaire(self) -> Questionnaire:
        """The questionnaire after the current trial, or the form; raises SessionError if there is none."""
        if isinstance(self.step, FormStep):
            return self.plan.protocol.questionnaires[self.step.form]
        if (questionnaire := self.plan.protocol.questionnaire_of(self.trial.block)) is None:
            raise SessionError(
                f"block {self.trial.block!r} does not have a questionnaire, so there is nothing to answer"
            )
        return questionnaire

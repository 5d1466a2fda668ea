"""Where a session is: one frozen value, changed only by ``machine.advance``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal, TypeAlias

from study_app.errors import SessionError
from study_app.protocol.model import Protocol, Questionnaire
from study_app.protocol.orders.schedule import PageStep, Schedule, Step, Trial
from study_app.session.resume import FIRST, Start


class Phase(Enum):
    """What the participant is doing."""

    OPENING = "opening"
    READING = "reading"
    TASK = "task"
    ANSWERING = "answering"
    PAUSED = "paused"
    TROUBLE = "trouble"
    COMPLETE = "complete"
    ENDED = "ended"


Hold: TypeAlias = Literal["pause", "force"]

FINAL = frozenset({Phase.COMPLETE, Phase.ENDED})


@dataclass(frozen=True, slots=True)
class Plan:
    """What stays the same through a session, but for the language, which a participant may choose at its beginning.

    ``key`` (block → code → condition) is blinded and never printed.
    ``start`` is where it begins: not at the first step where it was interrupted before.
    """

    protocol: Protocol = field(repr=False)
    schedule: Schedule
    key: Mapping[str, Mapping[str, str]] = field(repr=False)
    language: str
    start: Start = FIRST

    def condition(self, trial: Trial) -> str:
        """Return the condition behind a trial's code."""
        return self.key[trial.block][trial.code]


@dataclass(frozen=True, slots=True)
class Answer:
    """How one statement was answered; times are seconds on the session's clock.

    ``first_s`` is None until the first choice; ``value`` None then means "cannot judge". ``last_s`` is the last time
    the value changed, ``changes`` how often it did after the first choice.
    """

    onset_s: float | None = None
    first_s: float | None = None
    last_s: float | None = None
    changes: int = 0
    value: int | None = None

    @property
    def given(self) -> bool:
        """Whether anything was chosen."""
        return self.first_s is not None


@dataclass(frozen=True, slots=True)
class SessionState:
    """The session at one moment.

    ``index`` counts the schedule's steps (−1 before the first, their number after the last), ``attempt`` the
    presentations of the present trial from 1. ``answers`` holds the statements of the present questionnaire that were
    shown or answered. ``interrupted`` is the phase that a pause, or the failure of a device, goes back to.
    ``force_off`` says that the force was stopped and has not been faded in again, ``held`` what the operator stopped,
    so that the operator alone resumes. ``since_s`` is when the present step was entered [s, session's clock].
    """

    plan: Plan = field(repr=False)
    phase: Phase = Phase.OPENING
    index: int = -1
    attempt: int = 1
    answers: Mapping[str, Answer] = field(default_factory=dict)
    interrupted: Phase | None = None
    force_off: bool = False
    held: Hold | None = None
    since_s: float = 0.0

    @property
    def step(self) -> Step | None:
        """The step under way; None before the first and after the last."""
        steps = self.plan.schedule.steps
        return steps[self.index] if 0 <= self.index < len(steps) else None

    @property
    def lost_device(self) -> bool:
        """Whether the session stopped because of its device, so that it goes on once that is connected again."""
        return self.phase is Phase.TROUBLE and self.interrupted is not None

    @property
    def page_id(self) -> str:
        """The id of the page that is read.

        Raises
        ------
        SessionError
            None is.
        """
        if isinstance(step := self.step, PageStep):
            return step.page_id
        raise SessionError("no page is being read: wait for the next one")

    @property
    def stays_until_s(self) -> float | None:
        """When the page that is read may be left at the earliest [s, session's clock]; None: at once."""
        least_s = self.plan.protocol.pages[self.page_id].min_s
        return None if least_s is None else self.since_s + least_s

    @property
    def languages(self) -> tuple[str, ...]:
        """The languages that the participant may choose from now: the study's, until a consent is given."""
        offered, pages = self.plan.protocol.study.languages, self.plan.protocol.pages
        before = self.plan.schedule.steps[: self.index]
        early = all(isinstance(step, PageStep) and pages[step.page_id].kind != "consent" for step in before)
        return offered if len(offered) > 1 and early and isinstance(self.step, PageStep) else ()

    @property
    def trial(self) -> Trial:
        """The trial under way.

        Raises
        ------
        SessionError
            No trial is under way.
        """
        if isinstance(step := self.step, Trial):
            return step
        raise SessionError("no trial is under way: wait for the next one")

    @property
    def asks(self) -> bool:
        """Whether the trial under way has a questionnaire."""
        return self.plan.protocol.blocks[self.trial.block].questionnaire is not None

    @property
    def questionnaire(self) -> Questionnaire:
        """What is answered after the trial under way.

        Raises
        ------
        SessionError
            Nothing is.
        """
        if (questionnaire := self.plan.protocol.questionnaire_of(self.trial.block)) is None:
            raise SessionError(f"block {self.trial.block!r} has no questionnaire: there is nothing to answer")
        return questionnaire

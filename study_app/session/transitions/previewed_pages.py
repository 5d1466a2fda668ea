"""The pages of a session that is not run: what the participant would see at a step of a preview."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from study_app.protocol.orders.schedule import FormStep, PageStep, Trial
from study_app.protocol.questions import Value
from study_app.session.pages import FeedbackPage, Page, TextPage
from study_app.session.simulated.preview import Preview
from study_app.session.transitions import page_builder
from study_app.session.transitions.state import Answer, Phase, Plan, SessionState

Kind: TypeAlias = Literal["text", "tank", "questions", "feedback"]


@dataclass(frozen=True, slots=True)
class Moment:
    """One of the pages of a step: its kind, and in a trial with a design which interval (from 1) a tank presents."""

    kind: Kind
    interval: int = 1


def moments(shown: Preview, index: int) -> tuple[Moment, ...]:
    """Return the pages of a step, in the order in which a session shows them."""
    step = shown.schedule.steps[index]
    if isinstance(step, PageStep):
        return (Moment("text"),)
    if isinstance(step, FormStep):
        return (Moment("questions"),)
    state = _state(shown, index, shown.protocol.study.languages[0])
    design = state.design
    if design is None:
        return (Moment("tank"), *([Moment("questions")] if state.asks else []))
    found = [Moment("tank", number) for number in range(1, design.intervals + 1)]
    if state.asks and not design.adjusts:
        found.append(Moment("questions"))
        if design.has_correct_answer and design.shows_feedback(step.phase == "practice"):
            found.append(Moment("feedback"))
    return tuple(found)


def previewed_page(
    shown: Preview, index: int, moment: Moment, language: str, answers: Mapping[str, Value] | None = None
) -> Page:
    """Return a page of a step, as a session would show it.

    Parameters
    ----------
    shown : Preview
        The session.
    index : int
        The step's index in the schedule.
    moment : Moment
        Which of the step's pages.
    language : str
        One of the study's languages.
    answers : mapping, optional
        Answers that were given before, by the id of the item; what would not be accepted is left out.
    """
    if moment.kind == "feedback":
        return FeedbackPage(right=True)
    state = replace(_state(shown, index, language), interval=moment.interval)
    if moment.kind == "tank":
        return page_builder.page(replace(state, phase=Phase.TASK))
    if moment.kind == "text":
        made = page_builder.page(replace(state, phase=Phase.READING))
        return replace(made, coming=None) if isinstance(made, TextPage) else made
    kept = {} if not answers else dict(_accepted(state, answers))
    return page_builder.page(replace(state, phase=Phase.ANSWERING, answers=kept))


def tested_condition(shown: Preview, index: int) -> str | None:
    """Return the condition that a trial presents; None for other steps, and where a number is varied."""
    step = shown.schedule.steps[index]
    if not isinstance(step, Trial):
        return None
    if shown.protocol.blocks[step.block].design is not None:
        return shown.protocol.conditions_in(step.block)[0]
    return shown.codes[step.block][step.code]


def _state(shown: Preview, index: int, language: str) -> SessionState:
    plan = Plan(shown.protocol, shown.schedule, shown.codes, language, secret=shown.secret)
    return SessionState(plan, index=index)


def _accepted(state: SessionState, answers: Mapping[str, Value]) -> list[tuple[str, Answer]]:
    """Return the answers that the questions of the page accept."""
    asked = {question.id: question for question in state.questions}
    return [
        (item, Answer(onset_s=0.0, first_s=0.0, last_s=0.0, value=value))
        for item, value in answers.items()
        if item in asked and asked[item].problem(value, state.context) is None
    ]

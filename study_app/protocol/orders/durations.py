"""The kinds of sessions of a study, and how long each will take: reading, answering, tasks, breaks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from study_app.protocol.model import Block, Protocol, Questionnaire
from study_app.protocol.orders.block_orders import order_of
from study_app.protocol.trials.methods import Adjustment
from study_app.protocol.trials.tasks import AnyTask


@dataclass(frozen=True, slots=True)
class Variant:
    """One kind of session of a study: of a group (None: all participants), with a number (None: any)."""

    group: str | None
    session: int | None
    protocol: Protocol

    @property
    def name(self) -> str:
        """The group and the session as text; "" if all sessions are alike."""
        named = [f"group {self.group}"] if self.group is not None else []
        return ", ".join([*named, f"session {self.session}"] if self.session is not None else named)


def variants(protocol: Protocol) -> Iterator[Variant]:
    """Yield each kind of session of a study; a single one if all sessions are alike."""
    for group in protocol.groups or (None,):
        count = protocol.session_count(group)
        for session in range(1, (count or 1) + 1):
            own = protocol.for_session(group, session)
            yield Variant(group, session if count is not None else None, own)


_READING_WORDS_PER_S = 3.0
_PAGE_S = 5.0
ANSWER_S = 6.0
CHOICE_S = 2.0
"""How long people take, for the expected duration [choice]: read (180 words a minute) and turn a page, answer one
statement, choose an interval."""


def expected_duration_s(protocol: Protocol) -> float:
    """Return the expected duration of a session [s], between the shortest and the longest."""
    language = protocol.study.languages[0]
    return sum(step_duration_s(protocol, step, language) for step in protocol.steps)


def duration_range_s(protocol: Protocol) -> tuple[float, float]:
    """Return the shortest and the longest duration of a session [s], since tasks may end before their limit."""

    def session_s(own: Protocol, task_s: Callable[[AnyTask], float]) -> float:
        return sum(step_duration_s(own, step, own.study.languages[0], task_s) for step in own.steps)

    kinds = [variant.protocol for variant in variants(protocol)]
    least_s = min(
        session_s(session, lambda task: task.expected_s if task.least_s is None else task.least_s) for session in kinds
    )
    return least_s, max(session_s(session, lambda task: task.limit_s) for session in kinds)


def step_duration_s(
    protocol: Protocol, step: str, language: str, of_task: Callable[[AnyTask], float] | None = None
) -> float:
    """Return the duration of a page, form or block [s], read in one of the study's languages."""
    if step in protocol.pages:
        return _reading_s(protocol, step, language)
    if step in protocol.forms:
        return _answering_s(protocol.forms[step])
    return block_duration_s(protocol, protocol.blocks[step], language, of_task)


def recordings_of(protocol: Protocol) -> Iterator[tuple[int, float]]:
    """Yield the number of a block's recordings in a session and the expected duration of each [s]."""
    for block in (protocol.blocks[step] for step in protocol.steps if step in protocol.blocks):
        method = protocol.method_of(block) if block.stimulus is not None else None
        intervals = 1 if block.design is None else protocol.design_of(block).intervals
        longer_s = method.most_s / 2 if isinstance(method, Adjustment) else 0.0
        yield order_of(protocol, block).trials * intervals, protocol.tasks[block.task].expected_s + longer_s


def _answering_s(questionnaire: Questionnaire) -> float:
    """Return the time to answer a questionnaire once [s]."""
    return _PAGE_S + ANSWER_S * len(questionnaire.items)


def _reading_s(protocol: Protocol, page_id: str, language: str) -> float:
    page = protocol.pages[page_id]
    return max(_PAGE_S + len(protocol.text(page.body, language).split()) / _READING_WORDS_PER_S, page.min_s or 0.0)


def block_duration_s(
    protocol: Protocol, block: Block, language: str, of_task: Callable[[AnyTask], float] | None = None
) -> float:
    """Return the duration of a block [s]; ``of_task`` gives a task's duration if it is not the expected one."""
    questionnaire = protocol.questionnaire_of(block.id)
    answering = 0.0 if questionnaire is None else _answering_s(questionnaire)
    order = order_of(protocol, block)
    resting = 0.0 if block.break_page is None else order.breaks * _reading_s(protocol, block.break_page, language)
    task = protocol.tasks[block.task]
    task_s = task.expected_s if of_task is None else of_task(task)
    if block.design is not None:
        design = protocol.design_of(block)
        answer_s = CHOICE_S if design.reply == "choice" else ANSWER_S
        answering = answer_s + design.between_s + design.feedback_s * design.shows_feedback(block.phase == "practice")
        task_s = design.intervals * task_s + (design.intervals - 1) * design.pause_s
        if isinstance(method := protocol.method_of(block) if block.stimulus else None, Adjustment):
            task_s, answering = task_s + method.most_s / 2, design.between_s
    return order.trials * (task_s + answering) + resting

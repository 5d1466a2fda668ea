"""The kinds of sessions of a study, and their expected durations: reading, answering, tasks, breaks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from study_app.protocol.model import Block, Protocol, Questionnaire
from study_app.protocol.orders.block_orders import order_of
from study_app.protocol.trials.designs import ANSWER_S
from study_app.protocol.trials.tasks import AnyTask


@dataclass(frozen=True, slots=True)
class Variant:
    """One kind of session: its group (None for all participants), its number (None for any), and its protocol."""

    group: str | None
    session: int | None
    protocol: Protocol

    @property
    def name(self) -> str:
        """The group and the session as text; "" if all sessions are alike."""
        parts = [f"group {self.group}"] if self.group is not None else []
        return ", ".join([*parts, f"session {self.session}"] if self.session is not None else parts)


def variants(protocol: Protocol) -> Iterator[Variant]:
    """Yield each kind of session of a study; a single one if all sessions are alike."""
    for group in protocol.groups or (None,):
        count = protocol.session_count(group)
        for session in range(1, (count or 1) + 1):
            session_protocol = protocol.for_session(group, session)
            yield Variant(group, session if count is not None else None, session_protocol)


_READING_WORDS_PER_S = 3.0
_PAGE_S = 5.0
"""Reading speed (180 words a minute) and time to turn a page [s], for the expected duration. [choice]"""


def expected_duration_s(protocol: Protocol, *steps: str) -> float:
    """Return the expected duration of some steps, or of a whole session [s]."""
    return sum(_step_duration_s(protocol, step) for step in steps or protocol.steps)


def duration_range_s(protocol: Protocol) -> tuple[float, float]:
    """Return the shortest and the longest duration of a session [s]; tasks may end before their limit."""

    def session_s(session_protocol: Protocol, task_s: Callable[[AnyTask], float]) -> float:
        return sum(_step_duration_s(session_protocol, step, task_s) for step in session_protocol.steps)

    protocols = [variant.protocol for variant in variants(protocol)]
    least_s = min(
        session_s(session, lambda task: task.expected_s if task.least_s is None else task.least_s)
        for session in protocols
    )
    return least_s, max(session_s(session, lambda task: task.limit_s) for session in protocols)


def _step_duration_s(protocol: Protocol, step: str, task_duration_s: Callable[[AnyTask], float] | None = None) -> float:
    """Return the duration of a page, form or block [s]; ``task_duration_s`` replaces the expected duration of tasks."""
    if step in protocol.pages:
        return _reading_s(protocol, step)
    if step in protocol.forms:
        return _answering_s(protocol.forms[step])
    return _block_duration_s(protocol, protocol.blocks[step], task_duration_s)


def recordings_of(protocol: Protocol) -> Iterator[tuple[int, float]]:
    """Yield for each block the number of its recordings in a session, and the expected duration of each [s]."""
    for block in (protocol.blocks[step] for step in protocol.steps if step in protocol.blocks):
        intervals = 1 if block.design is None else protocol.design_of(block).intervals
        setting_s = 0.0 if block.stimulus is None else protocol.method_of(block).setting_s
        yield order_of(protocol, block).trials * intervals, protocol.tasks[block.task].expected_s + setting_s


def _answering_s(questionnaire: Questionnaire) -> float:
    """Return the time to answer a questionnaire once [s]."""
    return _PAGE_S + ANSWER_S * len(questionnaire.items)


def _reading_s(protocol: Protocol, page_id: str) -> float:
    """Return the time to read a page in the study's first language [s]."""
    page = protocol.pages[page_id]
    words = protocol.text(page.body, protocol.study.languages[0]).split()
    return max(_PAGE_S + len(words) / _READING_WORDS_PER_S, page.min_s or 0.0)


def _block_duration_s(protocol: Protocol, block: Block, task_duration_s: Callable[[AnyTask], float] | None) -> float:
    questionnaire = protocol.questionnaire_of(block.id)
    answering_s = 0.0 if questionnaire is None else _answering_s(questionnaire)
    order = order_of(protocol, block)
    breaks_s = 0.0 if block.break_page is None else order.breaks * _reading_s(protocol, block.break_page)
    task = protocol.tasks[block.task]
    task_s = task.expected_s if task_duration_s is None else task_duration_s(task)
    if block.design is not None:
        design = protocol.design_of(block)
        feedback_s = design.feedback_s * design.shows_feedback(block.phase == "practice")
        answering_s = design.answer_s + design.between_s + feedback_s
        task_s = design.intervals * task_s + (design.intervals - 1) * design.pause_s
        if block.stimulus is not None and (setting_s := protocol.method_of(block).setting_s):
            task_s, answering_s = task_s + setting_s, design.between_s
    return order.trials * (task_s + answering_s) + breaks_s

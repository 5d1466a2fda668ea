"""Transitions into the steps of the schedule, and the handling of answers, as pure functions."""

from dataclasses import asdict, replace
from typing import Any, Final, TypeAlias

from study_app.errors import SessionError
from study_app.protocol.blocks import Block
from study_app.protocol.orders import FormStep, PageStep, Step, Trial
from study_app.protocol.presented import Presentation, is_criterion_met, longest_delay_s, trial_result
from study_app.protocol.questions import answer_problem
from study_app.protocol.trials import Stimulated
from study_app.session.transitions import page_builder
from study_app.session.transitions.events import (
    Chosen,
    Command,
    Finish,
    ItemShown,
    Rest,
    Retracted,
    ShowPage,
    StartTrial,
    StopTrial,
    Submitted,
    Write,
    WriteTables,
)
from study_app.session.transitions.state import Phase, SessionState
from study_app.store.journals import journal_events as journal
from study_app.store.journals.journal_events import UNDELIVERED, Answer, Response

Commands: TypeAlias = tuple[Command, ...]
Result: TypeAlias = tuple[SessionState, Commands]
_END_SHOWN_S: Final = 0.1
"""Time for which a closed ring is shown before the next page [s]."""
_REPEAT_REST_S: Final = 1.5
"""Rest before a trial that was not delivered as requested is presented again [s]."""
FADE_OUT_S: Final = 0.05
"""Time in which the force fades to zero before a rest begins [s]."""


def enter_step(state: SessionState, index: int, done: Commands = (), *, at_s: float) -> Result:
    """Go to the step at ``index``, or to the next that is not skipped; ``done`` ends the previous step."""
    reached, skip_commands = find_due_step(state, index, at_s=at_s)
    return enter_reached(reached, (*done, *skip_commands))


def find_due_step(state: SessionState, index: int, *, at_s: float) -> Result:
    """Return the state at the first step from ``index`` that is not skipped, with an event for each skipped one.

    The phase is unchanged, or ENDED if a criterion that ends the session was missed.
    """
    steps = state.plan.schedule.steps
    start = state.plan.start
    skip_commands: list[Write] = []
    while True:
        step = steps[index] if index < len(steps) else None
        previous = steps[index - 1] if index else None
        if (missed := _missed_criterion(state, previous, step)) is not None:
            state = replace(state, phase=Phase.ENDED, index=index - 1, interrupted=None)
            reason = f"the criterion of block {missed.id} was not met"
            return state, (*skip_commands, Finish("aborted", reason))
        due = state.plan.due(step, state.heard) if isinstance(step, Trial) and _block(state, step).design else None
        skipped = _skip_event(state, previous, step, due)
        if skipped is None:
            break
        skip_commands.append(Write(skipped))
        index += 1
    state = replace(state, index=index, attempt=1, answers={}, since_s=at_s, due=due, interval=1, until_s=None)
    state = replace(state, invalid=start.invalid if index == start.step else 0)
    if isinstance(step, Trial):
        state = replace(state, attempt=start.presented.get(step.number, 0) + 1)
    return state, tuple(skip_commands)


def enter_reached(state: SessionState, done: Commands) -> Result:
    """Begin the current step after the commands ``done``."""
    if state.phase is Phase.ENDED:
        return state, (*done, show_page(state))
    if state.step is None:
        state = replace(state, phase=Phase.COMPLETE)
        return state, (*done, Finish("completed"), show_page(state))
    if isinstance(step := state.step, Trial):
        previous = state.plan.schedule.steps[state.index - 1] if state.index else None
        continues_block = state.design is not None and isinstance(previous, Trial) and previous.block == step.block
        pause_s = state.design.between_s if state.design is not None and continues_block else 0.0
        rest_until_s = state.since_s + pause_s if pause_s else None
        return start_trial(state, done, state.since_s, rest_until_s=rest_until_s)
    if isinstance(step, FormStep):
        state = replace(state, phase=Phase.ANSWERING)
        return state, (
            *done,
            Write(journal.FormShown(form=step.form, after=step.after)),
            WriteTables(),
            show_page(state),
        )
    state = replace(state, phase=Phase.READING)
    return state, (*done, Write(journal.PageShown(page=state.page_id)), WriteTables(), show_page(state))


def start_trial(state: SessionState, done: Commands, at_s: float, *, rest_until_s: float | None = None) -> Result:
    """Present a trial, or its first interval, after a rest if there is one."""
    state = replace(state, phase=Phase.TASK, answers={}, interval=1, until_s=None, errors_ms=())
    trial = state.trial
    fields: dict[str, Any] = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
    if state.due is not None and state.design is not None:
        fields |= {name: getattr(state.due, name) for name in ("level", "standard", "catch")}
        fields["arrangement"] = state.design.arrangement_text(state.due.arrangement)
    begun = (*done, Write(journal.TrialStarted(**attempt_fields(state), **fields)), WriteTables())
    return (
        start_interval(state, begun, at_s) if rest_until_s is None else rest_before_interval(state, begun, rest_until_s)
    )


def present_again(state: SessionState, done: Commands, at_s: float) -> Result:
    """Present an undelivered trial again if the study's limits permit another attempt; otherwise continue."""
    done = (*done, Write(journal.TrialEnded(**attempt_fields(state), outcome=UNDELIVERED)))
    state = replace(state, invalid=state.invalid + 1)
    if state.invalid >= (state.plan.protocol.limits.attempts or 1):
        return enter_step(state, state.index + 1, done, at_s=at_s)
    repeated = replace(state, attempt=state.attempt + 1)
    return start_trial(repeated, done, at_s, rest_until_s=at_s + FADE_OUT_S + _REPEAT_REST_S)


def start_interval(state: SessionState, done: Commands, at_s: float) -> Result:
    """Present the trial, or its current interval."""
    state = replace(state, phase=Phase.TASK, until_s=None, steps=0, place=0)
    protocol, block = state.plan.protocol, _block(state, state.trial)
    if state.due is None:
        presented = Stimulated(state.plan.condition(state.trial))
    else:
        presented = state.due.intervals[state.interval - 1]
        done = (*done, Write(journal.IntervalStarted(**attempt_fields(state), interval=state.interval)))
    if state.adjusts:
        item = state.items[0]
        state = replace(state, answers={item: Answer(onset_s=at_s)})
        done = (*done, Write(journal.ItemShown(trial=state.trial.number, item=item)))
    start = StartTrial(
        trial=state.trial.number,
        attempt=state.attempt,
        task=state.task,
        presented=presented,
        delay_s=protocol.presented_delay_s(presented),
        linger_s=longest_delay_s(protocol, block) + _END_SHOWN_S,
        interval=None if state.due is None else state.interval,
        adjusts=state.adjusts,
    )
    return state, (*done, start, show_page(state))


def rest_before_interval(state: SessionState, done: Commands, until_s: float) -> Result:
    """Rest at zero force before the current interval."""
    state = replace(state, phase=Phase.RESTING, until_s=until_s)
    return state, (*done, show_page(state))


def is_before_end(state: SessionState, at_s: float) -> bool:
    """Return whether a rest or feedback has not ended at ``at_s``."""
    return state.until_s is not None and at_s < state.until_s


def interrupt_trial(state: SessionState) -> Commands:
    """Interrupt the current trial, in its task or a rest, and write its measures so far."""
    if state.phase not in {Phase.TASK, Phase.RESTING}:
        return ()
    ended = Write(journal.TrialEnded(**attempt_fields(state), outcome="interrupted"), measured=state.due is None)
    if state.due is None or state.phase is Phase.RESTING:
        return (StopTrial(), Rest(), ended)
    interval_ended = journal.IntervalEnded(**attempt_fields(state), interval=state.interval, outcome="interrupted")
    return (StopTrial(), Rest(), Write(interval_ended, measured=True), ended)


def attempt_fields(state: SessionState) -> dict[str, Any]:
    """Return the event fields for trial and attempt."""
    return {"trial": state.trial.number, "attempt": state.attempt}


def show_page(state: SessionState) -> ShowPage:
    """Return the command that shows the current page."""
    return ShowPage(page_builder.build_page(state))


def _block(state: SessionState, trial: Trial) -> Block:
    return state.plan.protocol.blocks[trial.block]


def _skip_event(
    state: SessionState, previous: Step | None, step: Step | None, due: Presentation | None
) -> journal.PassedOver | None:
    """Return the event for a skipped step (a trial that is not due, or a break after one), else None."""
    if isinstance(step, Trial):
        block = _block(state, step)
        if block.design is None or due is not None:
            return None
        return journal.PassedOver(trial=step.number, reason=_skip_reason(state, block))
    if isinstance(step, PageStep) and isinstance(previous, Trial):
        block = _block(state, previous)
        if block.design is not None and step.page_id == block.break_page and not _has_presented_trial(state, previous):
            return journal.PassedOver(page=step.page_id, reason=_skip_reason(state, block))
    return None


def _has_presented_trial(state: SessionState, last: Trial) -> bool:
    """Return whether a trial was answered or given up between the previous text page and trial ``last``."""
    steps = state.plan.schedule.steps
    answered = {*state.plan.start.presented, *(result.trial for result in state.heard)}
    if state.invalid:
        answered.add(state.trial.number)
    for step in reversed(steps[: steps.index(last) + 1]):
        if not isinstance(step, Trial):
            return False
        if step.number in answered:
            return True
    return False


def _skip_reason(state: SessionState, block: Block) -> str:
    return "criterion_met" if is_criterion_met(block, state.plan.schedule, state.heard) else "track_ended"


def _missed_criterion(state: SessionState, previous: Step | None, step: Step | None) -> Block | None:
    """Return the ended block whose unmet criterion ends the session, or None."""
    if not isinstance(previous, Trial):
        return None
    block = _block(state, previous)
    continues = isinstance(step, Trial) and step.block == block.id
    continues = continues or (isinstance(step, PageStep) and step.page_id == block.break_page)
    if continues or block.until is None or block.until.missed != "end":
        return None
    if is_criterion_met(block, state.plan.schedule, state.heard):
        return None
    return block


def show_item(state: SessionState, event: ItemShown) -> Result:
    """Record when a question was shown."""
    _check_item(state, event.item)
    answer = state.answers.get(event.item, Answer()).shown(event.at_s)
    written = Write(journal.ItemShown(**_page_fields(state), item=event.item))
    return _set_answer(state, event.item, answer), (written,)


def record_choice(state: SessionState, event: Chosen) -> Result:
    """Record a choice; the last one counts. Answers to questions that it hides are removed."""
    _check_shown(state, event.item)
    if (problem := answer_problem(state.questionnaire.item(event.item), event.value, state.context)) is not None:
        raise SessionError(problem)
    answer = state.answers.get(event.item, Answer()).chosen(event.at_s, event.value)
    line = journal.Choice(
        **_page_fields(state), item=event.item, kind=state.questionnaire.item(event.item).kind_id, value=event.value
    )
    return _remove_hidden_answers(_set_answer(state, event.item, answer), (Write(line, waits=True),))


def retract_answer(state: SessionState, event: Retracted) -> Result:
    """Remove an answer, and the answers to questions that are hidden without it."""
    _check_shown(state, event.item)
    return _remove_hidden_answers(*_remove_answer(state, event.item))


def submit_answers(state: SessionState, event: Submitted) -> Result:
    """Write the responses and continue, if every required question is answered."""
    shown = state.shown
    answers = {item: state.answers.get(item, Answer()) for item in state.items}
    numbered = [(number, item) for number, item in enumerate(state.items, start=1) if item in shown]
    missing = [n for n, item in numbered if state.questionnaire.item(item).required and not answers[item].given]
    if missing:
        listed = ", ".join(map(str, missing))
        raise SessionError(f"some required statements have not been answered: answer {listed} first")
    items = tuple(
        Response(item=item, number=number, kind=state.questionnaire.item(item).kind_id, **asdict(answers[item]))
        for number, item in numbered
    )
    line: journal.Event = (
        journal.FormAnswered(form=state.step.form, after=state.step.after, items=items)
        if isinstance(state.step, FormStep)
        else journal.Responses(**attempt_fields(state), items=items)
    )
    written = Write(line, waits=True)
    if state.due is not None:
        return _store_result(state, written, event.at_s)
    return enter_step(state, state.index + 1, (written,), at_s=event.at_s)


def keep_setting(state: SessionState, done: Commands, at_s: float) -> Result:
    """Write the steps of a setting as the answer, and continue; ``done`` ends its interval."""
    state, chosen = record_choice(state, Chosen(at_s, state.items[0], state.steps))
    state, submitted = submit_answers(state, Submitted(at_s))
    return state, (*done, *chosen, *submitted)


def _store_result(state: SessionState, written: Write, at_s: float) -> Result:
    """Store the answer for later levels, and show feedback if it is due."""
    trial, due, design = state.trial, state.due, state.design
    assert due is not None and design is not None  # noqa: S101, PT018 - checked by the caller
    protocol, answer = state.plan.protocol, str(state.answers[design.name].value)
    block = protocol.blocks[trial.block]
    result = trial_result(
        protocol, block, trial.number, trial.code, due.level, due.arrangement, answer, catch=due.catch
    )
    state = replace(state, heard=(*state.heard, result))
    if result.correct is None or not design.shows_feedback(trial.phase == "practice"):
        return enter_step(state, state.index + 1, (written,), at_s=at_s)
    shown = replace(state, phase=Phase.FEEDBACK, until_s=at_s + design.feedback_s)
    return shown, (written, Write(journal.FeedbackShown(**attempt_fields(shown))), show_page(shown))


def _set_answer(state: SessionState, item: str, answer: Answer) -> SessionState:
    return replace(state, answers={**state.answers, item: answer})


def _page_fields(state: SessionState) -> dict[str, Any]:
    """Return the event fields for the page: those of a trial, or the form."""
    return {"form": state.step.form} if isinstance(state.step, FormStep) else {"trial": state.trial.number}


def _check_item(state: SessionState, item: str) -> None:
    if item not in state.items:
        listed = ", ".join(state.items)
        raise SessionError(f"item {item!r} is not on this page, which contains the items {listed}")


def _check_shown(state: SessionState, item: str) -> None:
    _check_item(state, item)
    if item not in state.shown:
        raise SessionError(f"item {item!r} is not shown, because an earlier answer hides it")


def _remove_answer(state: SessionState, item: str) -> Result:
    answer = state.answers.get(item, Answer())
    if not answer.given:
        return state, ()
    written = Write(journal.AnswerRemoved(**_page_fields(state), item=item), waits=True)
    return _set_answer(state, item, answer.removed()), (written,)


def _remove_hidden_answers(state: SessionState, done: Commands) -> Result:
    """Remove the answers to questions that are no longer shown."""
    shown = set(state.shown)
    for item in [item for item in state.items if item not in shown]:
        state, written = _remove_answer(state, item)
        done = (*done, *written)
    return state, done

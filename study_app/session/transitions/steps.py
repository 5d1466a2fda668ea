"""How a step of the schedule is entered: pages, forms, and trials with their intervals and rests. Pure."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, TypeAlias

from study_app.protocol.blocks import Block
from study_app.protocol.orders.schedule import FormStep, PageStep, Step, Trial
from study_app.protocol.trials.presentation import Due, arrangement_text, criterion_met, delay_s_of, longest_delay_s
from study_app.protocol.trials.stimuli import Stimulated
from study_app.session.transitions import page_builder
from study_app.session.transitions.commands import (
    Command,
    Finish,
    Rest,
    ShowPage,
    StartTrial,
    StopTrial,
    Write,
    WriteTables,
)
from study_app.session.transitions.state import Answer, Phase, SessionState

Commands: TypeAlias = tuple[Command, ...]
Result: TypeAlias = tuple[SessionState, Commands]

END_SHOWN_S: Final = 0.1
"""A closed ring is seen for so long before the next page."""
AGAIN_S: Final = 1.5
"""A trial that was not delivered as requested comes again after a rest of so long."""
FADE_OUT_S: Final = 0.05
"""The force has faded to zero after so long; from then on a rest counts."""


def enter(state: SessionState, index: int, done: Commands = (), *, at_s: float) -> Result:
    """Go to the step at ``index``, or to the next that is not passed over; ``done`` finishes the step before."""
    reached, passed = reach(state, index, at_s=at_s)
    return enter_reached(reached, (*done, *passed))


def reach(state: SessionState, index: int, *, at_s: float) -> Result:
    """Return the state at the first step from ``index`` on that is not passed over, with a line on each that is.

    The phase is that of the step before, or ENDED where a criterion that ends the session was missed.
    """
    steps = state.plan.schedule.steps
    start = state.plan.start
    passed: list[Write] = []
    while True:
        step = steps[index] if index < len(steps) else None
        before = steps[index - 1] if index else None
        if (missed := _missed_criterion(state, before, step)) is not None:
            state = replace(state, phase=Phase.ENDED, index=index - 1, interrupted=None)
            reason = f"the criterion of block {missed.id} was not met"
            return state, (*passed, Finish("aborted", reason))
        due = state.plan.due(step, state.heard) if isinstance(step, Trial) and _block(state, step).design else None
        skipped = _passed_over(state, before, step, due)
        if skipped is None:
            break
        passed.append(Write("passed_over", skipped))
        index += 1
    state = replace(state, index=index, attempt=1, answers={}, since_s=at_s, due=due, interval=1, until_s=None)
    state = replace(state, invalid=start.invalid if index == start.step else 0)
    if isinstance(step, Trial):
        state = replace(state, attempt=start.presented.get(step.number, 0) + 1)
    return state, tuple(passed)


def enter_reached(state: SessionState, done: Commands) -> Result:
    """Begin the step that was reached; ``done`` comes first."""
    if state.phase is Phase.ENDED:
        return state, (*done, show(state))
    if state.step is None:
        state = replace(state, phase=Phase.COMPLETE)
        return state, (*done, Finish("completed"), show(state))
    if isinstance(step := state.step, Trial):
        before = state.plan.schedule.steps[state.index - 1] if state.index else None
        follows = state.design is not None and isinstance(before, Trial) and before.block == step.block
        between_s = state.design.between_s if state.design is not None and follows else 0.0
        rest_until_s = state.since_s + between_s if between_s else None
        return start_trial(state, done, state.since_s, rest_until_s=rest_until_s)
    if isinstance(step, FormStep):
        state = replace(state, phase=Phase.ANSWERING)
        return state, (*done, Write("form_shown", {"form": step.form}), WriteTables(), show(state))
    state = replace(state, phase=Phase.READING)
    return state, (*done, Write("page_shown", {"page": state.page_id}), WriteTables(), show(state))


def start_trial(state: SessionState, done: Commands, at_s: float, *, rest_until_s: float | None = None) -> Result:
    """Present a trial, where it has intervals the first of them, after a rest if there is one."""
    state = replace(state, phase=Phase.TASK, answers={}, interval=1, until_s=None, errors_ms=())
    trial = state.trial
    fields: dict[str, Any] = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
    if state.due is not None and state.design is not None:
        fields |= {
            "level": state.due.level,
            "standard": state.due.standard,
            "arrangement": arrangement_text(state.design, state.due.arrangement),
            "catch": state.due.catch,
        }
    begun = (*done, Write("trial_started", {**which(state), **fields}), WriteTables())
    return start_interval(state, begun, at_s) if rest_until_s is None else rest(state, begun, rest_until_s)


def present_again(state: SessionState, done: Commands, at_s: float) -> Result:
    """Present a trial again that was not delivered as requested, as often as the study's limits permit; else go on."""
    done = (*done, Write("trial_ended", {**which(state), "outcome": "invalid"}))
    state = replace(state, invalid=state.invalid + 1)
    if state.invalid >= (state.plan.protocol.limits.attempts or 1):
        return enter(state, state.index + 1, done, at_s=at_s)
    again = replace(state, attempt=state.attempt + 1)
    return start_trial(again, done, at_s, rest_until_s=at_s + FADE_OUT_S + AGAIN_S)


def start_interval(state: SessionState, done: Commands, at_s: float) -> Result:
    """Present what the trial presents, or its present interval."""
    state = replace(state, phase=Phase.TASK, until_s=None, steps=0, place=0)
    protocol, block = state.plan.protocol, _block(state, state.trial)
    if state.due is None:
        presented = Stimulated(state.plan.condition(state.trial))
    else:
        presented = state.due.intervals[state.interval - 1]
        done = (*done, Write("interval_started", {**which(state), "interval": state.interval}))
    if state.adjusts:
        item = state.items[0]
        state = replace(state, answers={item: Answer(onset_s=at_s)})
        done = (*done, Write("item_shown", {"trial": state.trial.number, "item": item}))
    start = StartTrial(
        trial=state.trial.number,
        attempt=state.attempt,
        task=state.task,
        presented=presented,
        delay_s=delay_s_of(protocol, presented),
        linger_s=longest_delay_s(protocol, block) + END_SHOWN_S,
        interval=None if state.due is None else state.interval,
        adjusts=state.adjusts,
    )
    return state, (*done, start, show(state))


def rest(state: SessionState, done: Commands, until_s: float) -> Result:
    """Rest at zero force before the present interval."""
    state = replace(state, phase=Phase.RESTING, until_s=until_s)
    return state, (*done, show(state))


def before_end(state: SessionState, at_s: float) -> bool:
    """Return whether a rest or a feedback must last longer."""
    return state.until_s is not None and at_s < state.until_s


def break_off(state: SessionState) -> Commands:
    """End a trial that is under way, in its task or in a rest, with what was measured of it until now."""
    if state.phase not in {Phase.TASK, Phase.RESTING}:
        return ()
    ended: Mapping[str, Any] = {**which(state), "outcome": "interrupted"}
    if state.due is None:
        return (StopTrial(), Rest(), Write("trial_ended", ended, measured=True))
    of_interval = Write("interval_ended", {**ended, "interval": state.interval}, measured=True)
    lines = (of_interval,) if state.phase is Phase.TASK else ()
    return (StopTrial(), Rest(), *lines, Write("trial_ended", ended))


def which(state: SessionState) -> dict[str, Any]:
    """Return the fields that say which attempt of which trial a line is about."""
    return {"trial": state.trial.number, "attempt": state.attempt}


def show(state: SessionState) -> ShowPage:
    """Return the command that shows the present page."""
    return ShowPage(page_builder.page(state))


def _block(state: SessionState, trial: Trial) -> Block:
    return state.plan.protocol.blocks[trial.block]


def _passed_over(state: SessionState, before: Step | None, step: Step | None, due: Due | None) -> dict[str, Any] | None:
    """Return the fields of the line on a step that is passed over: a trial that is not due, a break after one."""
    if isinstance(step, Trial):
        block = _block(state, step)
        if block.design is None or due is not None:
            return None
        return {"trial": step.number, "reason": _reason(state, block)}
    if isinstance(step, PageStep) and isinstance(before, Trial):
        block = _block(state, before)
        if block.design is not None and step.page_id == block.break_page and not _presented(state, before):
            return {"page": step.page_id, "reason": _reason(state, block)}
    return None


def _presented(state: SessionState, last: Trial) -> bool:
    """Return whether any trial was answered, or given up, from the page before trial ``last`` on."""
    steps = state.plan.schedule.steps
    answered = {*state.plan.start.presented, *(one.trial for one in state.heard)}
    if state.invalid:
        answered.add(state.trial.number)
    for step in reversed(steps[: steps.index(last) + 1]):
        if not isinstance(step, Trial):
            return False
        if step.number in answered:
            return True
    return False


def _reason(state: SessionState, block: Block) -> str:
    return "criterion_met" if criterion_met(block, state.plan.schedule, state.heard) else "track_ended"


def _missed_criterion(state: SessionState, before: Step | None, step: Step | None) -> Block | None:
    """Return the block that has ended without its criterion, where that ends the session."""
    if not isinstance(before, Trial):
        return None
    block = _block(state, before)
    goes_on = isinstance(step, Trial) and step.block == block.id
    goes_on = goes_on or (isinstance(step, PageStep) and step.page_id == block.break_page)
    if goes_on or block.until is None or block.until.missed != "end":
        return None
    if criterion_met(block, state.plan.schedule, state.heard):
        return None
    return block

"""What the machine does with answers: a question is shown, answered, taken back, and all are confirmed. Pure."""

from dataclasses import replace
from typing import Any

from study_app.errors import SessionError
from study_app.protocol.orders.schedule import FormStep
from study_app.protocol.trials.presentation import heard_of
from study_app.session.transitions.commands import Write
from study_app.session.transitions.events import Chosen, ItemShown, Retracted, Submitted
from study_app.session.transitions.state import Answer, Phase, SessionState
from study_app.session.transitions.steps import Commands, Result, enter, show, which


def show_item(state: SessionState, event: ItemShown) -> Result:
    """Keep when a statement was first shown."""
    _check_item(state, event.item)
    answer = state.answers.get(event.item, Answer())
    if answer.onset_s is None:
        answer = replace(answer, onset_s=event.at_s)
    written = Write("item_shown", {**_page(state), "item": event.item})
    return _with_answer(state, event.item, answer), (written,)


def choose(state: SessionState, event: Chosen) -> Result:
    """Keep a choice; the last one counts. Answers to questions that it hides are removed."""
    _check_shown(state, event.item)
    if (problem := state.questionnaire.item(event.item).problem(event.value, state.context)) is not None:
        raise SessionError(problem)
    answer = state.answers.get(event.item, Answer())
    if not answer.given:
        answer = replace(answer, first_s=event.at_s, last_s=event.at_s, value=event.value)
    elif answer.value != event.value:
        answer = replace(answer, last_s=event.at_s, value=event.value, changes=answer.changes + 1)
    fields = {"item": event.item, **_kind(state, event.item), "value": event.value}
    written = Write("choice", {**_page(state), **fields}, waits=True)
    return _without_hidden(_with_answer(state, event.item, answer), (written,))


def retract(state: SessionState, event: Retracted) -> Result:
    """Remove an answer, and those to questions that are hidden without it."""
    _check_shown(state, event.item)
    return _without_hidden(*_removed(state, event.item))


def submit(state: SessionState, event: Submitted) -> Result:
    """Keep the responses and go on, if every required statement has its answer."""
    if missing := _missing(state):
        listed = ", ".join(map(str, missing))
        raise SessionError(f"not every required statement is answered: answer {listed} first")
    about = {"form": state.step.form} if isinstance(state.step, FormStep) else which(state)
    answered = "form_answered" if "form" in about else "responses"
    written = Write(answered, {**about, "items": _responses(state)}, waits=True)
    if state.due is not None:
        return _heard(state, written, event.at_s)
    return enter(state, state.index + 1, (written,), at_s=event.at_s)


def keep_setting(state: SessionState, done: Commands, at_s: float) -> Result:
    """Keep the steps of a setting as the answer, and go on; ``done`` ends its interval."""
    state, chosen = choose(state, Chosen(at_s, state.items[0], state.steps))
    state, kept = submit(state, Submitted(at_s))
    return state, (*done, *chosen, *kept)


def _heard(state: SessionState, written: Write, at_s: float) -> Result:
    """Keep the answer for the levels to come, and say whether it was correct, where that is due."""
    trial, due, design = state.trial, state.due, state.design
    assert due is not None and design is not None  # noqa: S101, PT018 - the caller has looked
    protocol, answer = state.plan.protocol, str(state.answers[design.name].value)
    block = protocol.blocks[trial.block]
    heard = heard_of(protocol, block, trial.number, trial.code, due.level, due.arrangement, answer, catch=due.catch)
    state = replace(state, heard=(*state.heard, heard))
    if heard.correct is None or not design.shows_feedback(trial.phase == "practice"):
        return enter(state, state.index + 1, (written,), at_s=at_s)
    shown = replace(state, phase=Phase.FEEDBACK, until_s=at_s + design.feedback_s)
    return shown, (written, Write("feedback_shown", which(shown)), show(shown))


def _with_answer(state: SessionState, item: str, answer: Answer) -> SessionState:
    return replace(state, answers={**state.answers, item: answer})


def _page(state: SessionState) -> dict[str, Any]:
    """Return the field that says which page a line is about: a trial's, or a form."""
    return {"form": state.step.form} if isinstance(state.step, FormStep) else {"trial": state.trial.number}


def _kind(state: SessionState, item: str) -> dict[str, str]:
    """Return the field that says of which kind a question is; format 1 has one kind and no such field."""
    return {"kind": state.questionnaire.item(item).kind_id} if state.plan.protocol.format > 1 else {}


def _check_item(state: SessionState, item: str) -> None:
    if item not in state.items:
        listed = ", ".join(state.items)
        raise SessionError(f"item {item!r} is not on this page: its items are {listed}")


def _check_shown(state: SessionState, item: str) -> None:
    _check_item(state, item)
    if item not in state.shown:
        raise SessionError(f"item {item!r} is not shown: an earlier answer hides it")


def _removed(state: SessionState, item: str) -> Result:
    """Remove an answer, if there is one."""
    answer = state.answers.get(item, Answer())
    if not answer.given:
        return state, ()
    written = Write("answer_removed", {**_page(state), "item": item}, waits=True)
    return _with_answer(state, item, Answer(onset_s=answer.onset_s)), (written,)


def _without_hidden(state: SessionState, done: Commands) -> Result:
    """Remove the answers to questions that are no longer shown."""
    hidden = [item for item in state.items if item not in state.shown]
    for item in hidden:
        state, written = _removed(state, item)
        done = (*done, *written)
    return state, done


def _missing(state: SessionState) -> list[int]:
    """Return the numbers of the required questions without an answer."""
    shown = state.shown
    return [
        number
        for number, item in enumerate(state.items, start=1)
        if item in shown and state.questionnaire.item(item).required and not state.answers.get(item, Answer()).given
    ]


def _responses(state: SessionState) -> list[dict[str, Any]]:
    """Return every question that is shown, in its order; one that was left out has no ``first_s``."""
    rows = []
    shown = state.shown
    for number, item in enumerate(state.items, start=1):
        if item not in shown:
            continue
        answer = state.answers.get(item, Answer())
        times = {"onset_s": answer.onset_s, "first_s": answer.first_s, "last_s": answer.last_s}
        rows.append(
            {
                "item": item,
                "number": number,
                **_kind(state, item),
                "value": answer.value,
                **times,
                "changes": answer.changes,
            }
        )
    return rows

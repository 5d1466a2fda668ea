"""What each row of the machine's table does: a state and an event in, the next state and the commands out. Pure."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeAlias

from study_app.errors import SessionError
from study_app.protocol.orders.schedule import Trial
from study_app.session.resume import FIRST
from study_app.session.transitions import page_builder
from study_app.session.transitions.commands import (
    Command,
    FadeIn,
    Finish,
    Rest,
    ShowPage,
    StartTrial,
    StopForce,
    StopTrial,
    Write,
    WriteTables,
)
from study_app.session.transitions.events import (
    Begin,
    Broke,
    Chosen,
    Continue,
    EndAsked,
    ForceStopped,
    ItemShown,
    LanguageChosen,
    Note,
    PauseAsked,
    Reconnected,
    RepeatAsked,
    ResumeAsked,
    Submitted,
    TaskDone,
)
from study_app.session.transitions.state import Answer, Hold, Phase, SessionState

END_SHOWN_S = 0.1  # a closed ring is seen for so long before the next page

Commands: TypeAlias = tuple[Command, ...]
Result: TypeAlias = tuple[SessionState, Commands]


def begin(state: SessionState, event: Begin) -> Result:
    """Go to the first step, or to where an interrupted session goes on; a trial waits there until somebody is ready."""
    entered, done = _enter(state, state.plan.start.step, at_s=event.at_s)
    if state.plan.start == FIRST or entered.phase is not Phase.TASK:
        return entered, done
    waiting = replace(entered, phase=Phase.PAUSED, interrupted=Phase.TASK, attempt=entered.attempt - 1)
    return waiting, (Write("paused", {"by": "program"}), WriteTables(), _show(waiting))


def read_on(state: SessionState, event: Continue) -> Result:
    """Leave a page that was read; one that lasts some time stays until then, whoever presses what."""
    if state.stays_until_s is not None and event.at_s < state.stays_until_s:
        return state, ()
    consents = state.plan.protocol.pages[state.page_id].kind == "consent"
    left = Write("page_left", {"page": state.page_id}, waits=consents)
    return _enter(state, state.index + 1, (left,), at_s=event.at_s)


def choose_language(state: SessionState, event: LanguageChosen) -> Result:
    """Show the page in another language, and all that come."""
    if event.language == state.plan.language:
        return state, ()
    if event.language not in state.languages:
        offered = f"choose {' or '.join(state.languages)}" if state.languages else "it is chosen before the consent"
        raise SessionError(f"language {event.language!r} cannot be chosen now: {offered}")
    chosen = replace(state, plan=replace(state.plan, language=event.language))
    return chosen, (Write("language_chosen", {"language": event.language}), WriteTables(), _show(chosen))


def end_task(state: SessionState, event: TaskDone) -> Result:
    """Take the liquid away, keep what was measured, and ask or go on."""
    ended = Write("trial_ended", {**_which(state), "outcome": event.outcome, **event.summary})
    done: Commands = (StopTrial(), Rest(), ended)
    if not state.asks:
        return _enter(state, state.index + 1, done, at_s=event.at_s)
    asking = replace(state, phase=Phase.ANSWERING, answers={})
    return asking, (*done, WriteTables(), _show(asking))


def show_item(state: SessionState, event: ItemShown) -> Result:
    """Keep when a statement was first shown."""
    _check_item(state, event.item)
    answer = state.answers.get(event.item, Answer())
    if answer.onset_s is None:
        answer = replace(answer, onset_s=event.at_s)
    written = Write("item_shown", {"trial": state.trial.number, "item": event.item})
    return _with_answer(state, event.item, answer), (written,)


def choose(state: SessionState, event: Chosen) -> Result:
    """Keep a choice; the last one counts."""
    _check_item(state, event.item)
    _check_value(state, event.value)
    answer = state.answers.get(event.item, Answer())
    if not answer.given:
        answer = replace(answer, first_s=event.at_s, last_s=event.at_s, value=event.value)
    elif answer.value != event.value:
        answer = replace(answer, last_s=event.at_s, value=event.value, changes=answer.changes + 1)
    written = Write("choice", {"trial": state.trial.number, "item": event.item, "value": event.value}, waits=True)
    return _with_answer(state, event.item, answer), (written,)


def submit(state: SessionState, event: Submitted) -> Result:
    """Keep the responses and go on, if every required statement has its answer."""
    if missing := _missing(state):
        listed = ", ".join(map(str, missing))
        raise SessionError(f"not every required statement is answered: answer {listed} first")
    written = Write("responses", {**_which(state), "items": _responses(state)}, waits=True)
    return _enter(state, state.index + 1, (written,), at_s=event.at_s)


def pause(state: SessionState, event: PauseAsked) -> Result:
    """Show the pause; a task under way is over as an attempt."""
    held: Hold | None = "pause" if event.by == "operator" else None
    paused = replace(state, phase=Phase.PAUSED, interrupted=state.phase, held=held)
    return paused, (*_break_off(state), Write("paused", {"by": event.by}), WriteTables(), _show(paused))


def pause_again(state: SessionState, event: PauseAsked) -> Result:
    """Let the operator take over the participant's pause; else do nothing."""
    if event.by != "operator" or state.held is not None:
        return state, ()
    paused = replace(state, held="pause")
    return paused, (Write("paused", {"by": event.by}), WriteTables(), _show(paused))


def resume(state: SessionState, event: ResumeAsked) -> Result:
    """Go back to what was interrupted, with the force if it was off; the operator's stop is the operator's to end."""
    if state.held is not None and event.by != "operator":
        what = "switched the force off" if state.held == "force" else "paused the session"
        raise SessionError(f"the operator {what}: the operator resumes it, not the {event.by}")
    back: Commands = (Write("resumed", {"by": event.by}),)
    if state.force_off:
        back = (*back, Write("force_restored", {"by": event.by}), FadeIn())
    state = replace(state, phase=state.interrupted or Phase.READING, interrupted=None, force_off=False, held=None)
    if state.phase is Phase.TASK:
        return _start_trial(replace(state, attempt=state.attempt + 1), back)
    return state, (*back, _show(state))


def stop_force(state: SessionState, event: ForceStopped) -> Result:
    """Switch the force off and pause."""
    stopped = Write("force_stopped", {"by": event.by})
    held: Hold | None = "force" if event.by == "operator" else state.held
    if state.phase is Phase.PAUSED:
        paused = replace(state, force_off=True, held=held)
        return paused, (StopForce(), stopped, _show(paused))
    paused = replace(state, phase=Phase.PAUSED, interrupted=state.phase, force_off=True, held=held)
    pausing = (Write("paused", {"by": event.by}), WriteTables(), _show(paused))
    return paused, (StopForce(), *_break_off(state), stopped, *pausing)


def stop_force_again(state: SessionState, event: ForceStopped) -> Result:
    """Switch off a force that is off already, and say who wanted so."""
    return state, (StopForce(), Write("force_stopped", {"by": event.by}))


def stop_force_after_end(state: SessionState, _event: ForceStopped) -> Result:
    """Switch the force off; the journal is closed."""
    return state, (StopForce(),)


def repeat(state: SessionState, event: RepeatAsked) -> Result:
    """Present the trial again, keeping the attempt that was."""
    if not event.reason.strip():
        raise SessionError("a trial is repeated for a reason: write one")
    asked = Write("repeat", {"trial": state.trial.number, "reason": event.reason}, waits=True)
    return _start_trial(replace(state, attempt=state.attempt + 1), (*_break_off(state), asked))


def note(state: SessionState, event: Note) -> Result:
    """Keep what the operator noted; what was typed is on the disk first."""
    written = Write("note", {"kind": event.kind, "text": event.text}, waits=event.kind == "note")
    return state, (written, WriteTables())


def end(state: SessionState, event: EndAsked) -> Result:
    """End early; a session in trouble that nobody withdrew from counts as broken."""
    broken = state.phase is Phase.TROUBLE and event.status == "aborted"
    ended = replace(state, phase=Phase.ENDED, interrupted=None)
    finish = Finish("broken" if broken else event.status, event.reason)
    return ended, (*_break_off(state), finish, _show(ended))


def call_operator(state: SessionState, event: Broke) -> Result:
    """Keep the force off and everything on the disk, and wait for the operator.

    Where the device failed, ``interrupted`` keeps what the session goes back to once it is connected again.
    """
    waits = state.phase in {Phase.OPENING, Phase.PAUSED, Phase.TROUBLE}
    before = state.interrupted if waits else state.phase
    interrupted = before if event.by == "device" else None
    trouble = replace(state, phase=Phase.TROUBLE, interrupted=interrupted, force_off=True)
    written = (Write("broke", {"what": event.what}), WriteTables())
    return trouble, (StopForce(), *_break_off(state), *written, _show(trouble))


def reconnect(state: SessionState, event: Reconnected) -> Result:
    """Pause at zero force until the operator resumes; a trial that the failure interrupted is then presented again."""
    if not state.lost_device:
        raise SessionError("the session did not stop because of its device: end it now, and resume it later")
    paused = replace(state, phase=Phase.PAUSED, held="force")
    facts = {"device": event.described.get("name"), "described": event.described}
    told = Write("device_reconnected", facts, waits=True)
    return paused, (StopForce(), told, Write("paused", {"by": "program"}), WriteTables(), _show(paused))


def _enter(state: SessionState, index: int, done: Commands = (), *, at_s: float) -> Result:
    """Go to the step at ``index`` at a moment; ``done`` comes first and finishes the step before."""
    state = replace(state, index=index, attempt=1, answers={}, since_s=at_s)
    if state.step is None:
        state = replace(state, phase=Phase.COMPLETE)
        return state, (*done, Finish("completed"), _show(state))
    if isinstance(state.step, Trial):
        before = state.plan.start.presented.get(state.step.number, 0)
        return _start_trial(replace(state, attempt=before + 1), done)
    state = replace(state, phase=Phase.READING)
    return state, (*done, Write("page_shown", {"page": state.page_id}), WriteTables(), _show(state))


def _start_trial(state: SessionState, done: Commands) -> Result:
    state = replace(state, phase=Phase.TASK, answers={})
    trial, protocol = state.trial, state.plan.protocol
    block = protocol.blocks[trial.block]
    condition = state.plan.condition(trial)
    told = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
    start = StartTrial(
        trial=trial.number,
        attempt=state.attempt,
        task=protocol.tasks[block.task],
        condition=condition,
        delay_s=protocol.delay_s(condition),
        linger_s=max(protocol.delay_s(name) for name in block.conditions) + END_SHOWN_S,
    )
    written = Write("trial_started", {**_which(state), **told})
    return state, (*done, written, WriteTables(), start, _show(state))


def _break_off(state: SessionState) -> Commands:
    """End a task that is under way, with what was measured of it until now."""
    if state.phase is not Phase.TASK:
        return ()
    return (StopTrial(), Rest(), Write("trial_ended", {**_which(state), "outcome": "interrupted"}, measured=True))


def _which(state: SessionState) -> dict[str, Any]:
    return {"trial": state.trial.number, "attempt": state.attempt}


def _show(state: SessionState) -> ShowPage:
    return ShowPage(page_builder.page(state))


def _with_answer(state: SessionState, item: str, answer: Answer) -> SessionState:
    return replace(state, answers={**state.answers, item: answer})


def _check_item(state: SessionState, item: str) -> None:
    if item not in state.trial.items:
        listed = ", ".join(state.trial.items)
        raise SessionError(f"item {item!r} is not on this page: its items are {listed}")


def _check_value(state: SessionState, value: int | None) -> None:
    scale = state.plan.protocol.scales[state.questionnaire.scale]
    points = len(scale.labels[state.plan.language])
    if value is None and scale.cannot_judge is None:
        raise SessionError("this questionnaire has no answer off the scale: choose one of its points")
    if value is not None and not 1 <= value <= points:
        raise SessionError(f"answer {value} is not on the scale: choose 1 to {points}")


def _missing(state: SessionState) -> list[int]:
    """Return the numbers of the required statements without an answer."""
    return [
        number
        for number, item in enumerate(state.trial.items, start=1)
        if state.questionnaire.item(item).required and not state.answers.get(item, Answer()).given
    ]


def _responses(state: SessionState) -> list[dict[str, Any]]:
    """Return every statement in the order shown; one that was left out has no ``first_s``."""
    rows = []
    for number, item in enumerate(state.trial.items, start=1):
        answer = state.answers.get(item, Answer())
        times = {"onset_s": answer.onset_s, "first_s": answer.first_s, "last_s": answer.last_s}
        rows.append({"item": item, "number": number, "value": answer.value, **times, "changes": answer.changes})
    return rows

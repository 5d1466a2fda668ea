"""The machine that runs a session: it decides, and does nothing.

Rules of this file:

1. ``advance(state, event)`` is pure. It gives the next state and the commands that the runner carries out in order.
2. Every legal pair of phase and event is a row of ``TRANSITIONS``. Any other pair raises ``SessionError`` and nothing
   has changed. Nothing but an event moves the machine.
3. A ``Write`` comes before the ``ShowPage`` it leads to, and one of an answer, a consent, a note or the reason for a
   repetition ``waits``: what a person gave is on the disk before its consequence is visible. Nothing else waits for the
   disk.
4. The safety of the hand comes before everything: ``StopForce``, ``StopTrial`` and ``Rest`` lead every list.

A session is the steps of its schedule: pages to read, and trials. A trial is a task, then a questionnaire if its block
has one. A pause during a task (asked for, or after a force stop) ends the attempt, and the trial starts again as the
next attempt; a pause while reading or answering goes back to the same page with every choice kept. Whatever breaks
leaves the force off and all answers on the disk, and waits for the operator: to end the session, or, where the device
failed, to connect it again. Then the session is paused, and the operator resumes it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from study_app.errors import SessionError
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule
from study_app.session.resume import FIRST, Start
from study_app.session.transitions import moves
from study_app.session.transitions.commands import Command
from study_app.session.transitions.events import (
    Begin,
    Broke,
    Chosen,
    Continue,
    EndAsked,
    Event,
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
from study_app.session.transitions.state import Phase, Plan, SessionState

Move: TypeAlias = Callable[[SessionState, Any], tuple[SessionState, tuple[Command, ...]]]

TRANSITIONS: dict[tuple[Phase, type[Event]], Move] = {
    # phase           event           what happens              next phase
    (Phase.OPENING, Begin): moves.begin,  # → reading, task; paused before a trial of a session that goes on
    (Phase.READING, Continue): moves.read_on,  # → reading, task, complete
    (Phase.READING, LanguageChosen): moves.choose_language,  # stays
    (Phase.TASK, TaskDone): moves.end_task,  # → answering; reading, task, complete without a questionnaire
    (Phase.ANSWERING, ItemShown): moves.show_item,  # stays
    (Phase.ANSWERING, Chosen): moves.choose,  # stays
    (Phase.ANSWERING, Submitted): moves.submit,  # → reading, task, complete
    # Pausing: esc, the operator, or a force stop.
    (Phase.READING, PauseAsked): moves.pause,  # → paused
    (Phase.TASK, PauseAsked): moves.pause,  # → paused; the attempt is over
    (Phase.ANSWERING, PauseAsked): moves.pause,  # → paused
    (Phase.PAUSED, PauseAsked): moves.pause_again,  # stays
    (Phase.PAUSED, ResumeAsked): moves.resume,  # → reading, answering; task as the next attempt
    # The force: off at once, wherever we are.
    (Phase.READING, ForceStopped): moves.stop_force,  # → paused
    (Phase.TASK, ForceStopped): moves.stop_force,  # → paused; the attempt is over
    (Phase.ANSWERING, ForceStopped): moves.stop_force,  # → paused
    (Phase.PAUSED, ForceStopped): moves.stop_force,  # stays
    (Phase.TROUBLE, ForceStopped): moves.stop_force_again,  # stays
    (Phase.COMPLETE, ForceStopped): moves.stop_force_after_end,  # stays
    (Phase.ENDED, ForceStopped): moves.stop_force_after_end,  # stays
    # The operator.
    (Phase.TASK, RepeatAsked): moves.repeat,  # → task, as the next attempt
    (Phase.ANSWERING, RepeatAsked): moves.repeat,  # → task, as the next attempt
    (Phase.READING, Note): moves.note,  # stays
    (Phase.TASK, Note): moves.note,
    (Phase.ANSWERING, Note): moves.note,
    (Phase.PAUSED, Note): moves.note,
    (Phase.TROUBLE, Note): moves.note,
    (Phase.OPENING, EndAsked): moves.end,  # → ended
    (Phase.READING, EndAsked): moves.end,
    (Phase.TASK, EndAsked): moves.end,
    (Phase.ANSWERING, EndAsked): moves.end,
    (Phase.PAUSED, EndAsked): moves.end,
    (Phase.TROUBLE, EndAsked): moves.end,
    # What breaks.
    (Phase.OPENING, Broke): moves.call_operator,  # → trouble
    (Phase.READING, Broke): moves.call_operator,
    (Phase.TASK, Broke): moves.call_operator,
    (Phase.ANSWERING, Broke): moves.call_operator,
    (Phase.PAUSED, Broke): moves.call_operator,
    (Phase.TROUBLE, Broke): moves.call_operator,
    (Phase.TROUBLE, Reconnected): moves.reconnect,  # → paused, without force; only after a failure of the device
}


def open_session(
    protocol: Protocol,
    schedule: Schedule,
    key: Mapping[str, Mapping[str, str]],
    language: str,
    start: Start = FIRST,
) -> SessionState:
    """Return the state before ``Begin``; ``key`` is block → code → condition, ``start`` where a resumed one goes on.

    Raises
    ------
    SessionError
        The study has no texts in that language.
    """
    if language not in protocol.study.languages:
        known = ", ".join(protocol.study.languages)
        raise SessionError(f"language {language!r}: {protocol.study.name} is written in {known}; choose one of these")
    return SessionState(Plan(protocol, schedule, key, language, start))


def advance(state: SessionState, event: Event) -> tuple[SessionState, tuple[Command, ...]]:
    """Return the next state and what is to be done, in order.

    Raises
    ------
    SessionError
        The event cannot be taken in this phase, or says something impossible; the state is what it was.
    """
    move = TRANSITIONS.get((state.phase, type(event)))
    if move is None:
        taken = ", ".join(sorted(kind.__name__ for phase, kind in TRANSITIONS if phase is state.phase))
        raise SessionError(f"{type(event).__name__} cannot happen while {state.phase.value}: possible are {taken}")
    return move(state, event)

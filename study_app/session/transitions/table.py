"""The state machine of a session, which decides without side effects.

Rules of this file:

1. ``advance(state, event)`` is pure. It returns the next state and the commands that the runner executes in order.
2. Every permitted pair of phase and event is a row of ``_TRANSITIONS``. Any other pair raises ``SessionError`` and
   changes nothing. Only events change the state.
3. A ``Write`` precedes the ``ShowPage`` that follows from it. A ``Write`` of an answer, a consent, a note or the reason
   for a repetition ``waits``, so that a person's input is on the disk before its effect is visible. Nothing else waits
   for the disk.
4. The safety of the hand comes first: ``StopForce``, ``StopTrial`` and ``Rest`` are at the beginning of every list.

A session consists of the steps of its schedule: pages to read, forms to fill in, and trials. A trial is a task,
followed by a questionnaire if its block has one. If its block has a design, a trial consists of several intervals with
rests between them, one question, and feedback if it is due. If the participant sets the level of the last interval,
that setting is the answer. The presented content is determined when the trial is entered, and a trial that is not due
is skipped.

A rest belongs to the trial's attempt. A pause during a task or a rest (requested, or after the force was stopped) ends
the attempt, and the trial starts again as the next attempt. A pause while reading or answering returns to the same page
with all choices; a pause during feedback continues with the next step. After a failure the force stays off, all answers
are on the disk, and the session waits for the operator, who can end it or, if the device failed, reconnect it. Then the
session is paused until the operator resumes it. If the disk accepts no data, the session stalls until it does, and is
then paused.
"""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from study_app.errors import SessionError
from study_app.protocol.model import Protocol
from study_app.protocol.orders import Schedule
from study_app.session.resume import FIRST, Start
from study_app.session.transitions import moves, steps
from study_app.session.transitions.events import (
    Begin,
    Broke,
    Chosen,
    Command,
    Continue,
    EndRequested,
    Event,
    ForceStopped,
    ItemShown,
    LanguageChosen,
    Note,
    PauseRequested,
    Reconnected,
    RepeatRequested,
    ResumeRequested,
    Retracted,
    Stepped,
    Submitted,
    TaskDone,
    TimeUp,
    WriteCompleted,
    WriteFailed,
    WriteRetried,
)
from study_app.session.transitions.state import Phase, Plan, SessionState

Move: TypeAlias = Callable[[SessionState, Any], tuple[SessionState, tuple[Command, ...]]]

_RUNNING = (Phase.READING, Phase.TASK, Phase.RESTING, Phase.ANSWERING, Phase.FEEDBACK)
_OPEN = (Phase.OPENING, *_RUNNING, Phase.PAUSED, Phase.TROUBLE)

_TRANSITIONS: dict[tuple[Phase, type[Event]], Move] = {
    # phase           event           what happens              next phase
    (Phase.OPENING, Begin): moves.begin_session,  # → reading, task; paused before a trial of a resumed session
    (Phase.READING, Continue): moves.continue_reading,  # → reading, task, answering (a form), complete
    (Phase.READING, LanguageChosen): moves.choose_language,  # stays
    (Phase.TASK, Continue): moves.leave_task,  # stays until the task is done
    (Phase.TASK, Stepped): moves.adjust_level,  # stays
    (Phase.TASK, Submitted): moves.confirm_setting,  # stays until the task is done
    (Phase.TASK, TaskDone): moves.end_task,  # → answering; resting; without questions or after a setting the next step
    # Trials of intervals: rests and feedback end by time alone.
    (Phase.RESTING, TimeUp): moves.end_rest,  # → task of the next interval
    (Phase.FEEDBACK, TimeUp): moves.end_feedback,  # → reading, task, resting, answering (a form), complete, ended
    (Phase.ANSWERING, ItemShown): steps.show_item,  # stays
    (Phase.ANSWERING, Chosen): steps.record_choice,  # stays
    (Phase.ANSWERING, Retracted): steps.retract_answer,  # stays
    (Phase.ANSWERING, Submitted): steps.submit_answers,  # → reading, task, resting, feedback, complete, ended
    # Pausing: esc, the operator, or a force stop.
    **{(phase, PauseRequested): moves.pause_session for phase in _RUNNING},  # → paused; the attempt at a trial is over
    (Phase.PAUSED, PauseRequested): moves.take_over_pause,  # stays
    (Phase.PAUSED, ResumeRequested): moves.resume_session,  # → reading, answering; task, again; after feedback: next
    # The force is switched off at once in every phase.
    **{(phase, ForceStopped): moves.stop_force for phase in _RUNNING},  # → paused; the attempt at a trial is over
    (Phase.PAUSED, ForceStopped): moves.stop_force,  # stays
    (Phase.TROUBLE, ForceStopped): moves.stop_force_again,  # stays
    (Phase.COMPLETE, ForceStopped): moves.stop_force_after_end,  # stays
    (Phase.ENDED, ForceStopped): moves.stop_force_after_end,  # stays
    # The operator.
    # A repeated trial: → task, again.
    **{(phase, RepeatRequested): moves.repeat_trial for phase in (Phase.TASK, Phase.RESTING, Phase.ANSWERING)},
    **{(phase, Note): moves.write_note for phase in (*_RUNNING, Phase.PAUSED, Phase.TROUBLE)},  # stays
    **{(phase, EndRequested): moves.end_session for phase in _OPEN},  # → ended
    # Failures.
    **{(phase, Broke): moves.call_operator for phase in _OPEN},  # → trouble
    (Phase.TROUBLE, Reconnected): moves.reconnect_device,  # → paused, without force; only after a failure of the device
    # Writing fails: all other events are rejected until it succeeds.
    **{(phase, WriteFailed): moves.stall_session for phase in Phase},  # → stalled
    (Phase.STALLED, WriteRetried): moves.retry_writes,  # stays
    (Phase.STALLED, WriteCompleted): moves.recover_from_stall,  # → paused; trouble and the end stay
    (Phase.STALLED, ForceStopped): moves.stop_force_of_stalled,  # stays
    (Phase.STALLED, EndRequested): moves.end_stalled_session,  # stays, over
}


def initial_state(
    protocol: Protocol,
    schedule: Schedule,
    key: Mapping[str, Mapping[str, str]],
    language: str,
    start: Start = FIRST,
    secret: bytes = b"",
) -> SessionState:
    """Return the state before ``Begin``; ``key`` is block → code → condition, ``start`` the point of resumption.

    ``secret`` is the sealed key's nonce, from which levels are drawn; it is not needed in a study without designs.
    """
    if language not in protocol.study.languages:
        known = ", ".join(protocol.study.languages)
        raise SessionError(
            f"language {language!r}: {protocol.study.name} is available only in {known}; choose one of these languages"
        )
    if not secret and any(block.design is not None for block in protocol.blocks.values()):
        raise SessionError("the levels in this study are generated from the sealed key, so its secret is required")
    return SessionState(plan=Plan(protocol, schedule, key, language, start, secret))


def advance(state: SessionState, event: Event) -> tuple[SessionState, tuple[Command, ...]]:
    """Return the next state and the commands to execute, in order."""
    move = _TRANSITIONS.get((state.phase, type(event)))
    if move is None:
        if state.stall is not None:
            reason = f"{state.stall.reason}; until then, the session waits"
            raise SessionError(f"{type(event).__name__} is not possible while {state.phase.value}: {reason}")
        possible = ", ".join(sorted(kind.__name__ for phase, kind in _TRANSITIONS if phase is state.phase))
        raise SessionError(
            f"{type(event).__name__} is not possible while {state.phase.value}; possible events: {possible}"
        )
    return move(state, event)

"""The transitions of the state machine as pure functions: state and event → next state and commands."""

from dataclasses import replace

from study_app.errors import SessionError
from study_app.protocol.orders import Trial
from study_app.session.resume import FIRST
from study_app.session.transitions.events import (
    Adjust,
    Begin,
    Broke,
    Continue,
    EndRequested,
    FadeIn,
    Finish,
    ForceStopped,
    LanguageChosen,
    LeaveTask,
    Note,
    PauseRequested,
    Reconnected,
    RepeatRequested,
    Rest,
    ResumeRequested,
    Stepped,
    StopForce,
    StopTrial,
    Submitted,
    TaskDone,
    TimeUp,
    Write,
    WriteCompleted,
    WriteFailed,
    WriteRetried,
    WriteTables,
)
from study_app.session.transitions.page_builder import consent_hash
from study_app.session.transitions.state import Hold, Phase, SessionState, Stall
from study_app.session.transitions.steps import (
    FADE_OUT_S,
    Commands,
    Result,
    attempt_fields,
    enter_reached,
    enter_step,
    find_due_step,
    interrupt_trial,
    is_before_end,
    keep_setting,
    present_again,
    rest_before_interval,
    show_page,
    start_interval,
    start_trial,
)
from study_app.store.journals import journal_events as journal
from study_app.store.journals.journal_events import CAUSE_WITHHELD
from study_app.store.session_progress import broken_trial_limits, delay_error_ms

_STOPPABLE = {Phase.READING, Phase.TASK, Phase.RESTING, Phase.ANSWERING, Phase.FEEDBACK, Phase.PAUSED}


def begin_session(state: SessionState, event: Begin) -> Result:
    """Go to the first step, or to that of a resumed session; a trial waits there, paused."""
    start = state.plan.start
    reached, done = find_due_step(replace(state, heard=start.heard), start.step, at_s=event.at_s)
    if start == FIRST or reached.phase is Phase.ENDED or not isinstance(reached.step, Trial):
        return enter_reached(reached, done)
    waiting = replace(reached, phase=Phase.PAUSED, interrupted=Phase.TASK, attempt=reached.attempt - 1)
    return waiting, (*done, Write(journal.Paused(by="program")), WriteTables(), show_page(waiting))


def continue_reading(state: SessionState, event: Continue) -> Result:
    """Leave a text page, but not before its least time."""
    if state.stays_until_s is not None and event.at_s < state.stays_until_s:
        return state, ()
    text = state.plan.protocol.pages[state.page_id]
    left = journal.PageLeft(page=state.page_id)
    if is_consent := text.kind == "consent":
        version = state.plan.protocol.study.version
        left = replace(left, text_sha256=consent_hash(state, text), study_version=version)
    return enter_step(state, state.index + 1, (Write(left, waits=is_consent),), at_s=event.at_s)


def choose_language(state: SessionState, event: LanguageChosen) -> Result:
    """Show this page and all later ones in another language."""
    if event.language == state.plan.language:
        return state, ()
    if event.language not in state.languages:
        raise SessionError(
            f"language {event.language!r} is not available: choose {' or '.join(state.languages)}"
            if state.languages
            else f"language {event.language!r} cannot be chosen now: choose it before the consent page"
        )
    chosen = replace(state, plan=replace(state.plan, language=event.language))
    return chosen, (Write(journal.LanguageChosen(language=event.language)), WriteTables(), show_page(chosen))


def leave_task(state: SessionState, _event: Continue) -> Result:
    """End an exploration at the participant's request after its least time; a `TaskDone` event follows."""
    return state, () if state.adjusts else (LeaveTask(),)


def adjust_level(state: SessionState, event: Stepped) -> Result:
    """Adjust the level within its range; do nothing outside of an adjustable interval."""
    setting, due = state.adjusting, state.due
    if setting is None or due is None:
        return state, ()
    place = setting.moved(state.place, event.steps)
    presented = replace(due.intervals[state.interval - 1], value=setting.comparison(place))
    delay_s = state.plan.protocol.presented_delay_s(presented)
    moved = replace(state, steps=state.steps + event.steps, place=place)
    return moved, (Adjust(presented, delay_s, journal.Stepped(**attempt_fields(state), steps=event.steps, scene=None)),)


def confirm_setting(state: SessionState, _event: Submitted) -> Result:
    """End a setting at the participant's request; a `TaskDone` event follows. Other tasks are not affected."""
    return state, (LeaveTask(),) if state.adjusts else ()


def end_task(state: SessionState, event: TaskDone) -> Result:
    """Remove the liquid, write the measures, and ask or continue; rest between two intervals.

    A trial that was not delivered as requested is presented again without a question.
    """
    done: Commands = (StopTrial(), Rest())
    measures = dict(event.summary)
    if (due := state.due) is not None and (design := state.design) is not None:
        error_ms = delay_error_ms(due.intervals[state.interval - 1], event.summary)
        state = replace(state, errors_ms=(*state.errors_ms, error_ms))
        holds, protocol = design.arrangements[due.arrangement], state.plan.protocol
        reasons = (
            *event.invalid,
            *broken_trial_limits(protocol.limits, due, holds, state.errors_ms, protocol.device.rate_hz),
        )
        if (setting := state.adjusting) is not None:
            measures["setting"] = setting.level(state.place)
        ended = journal.IntervalEnded(
            **attempt_fields(state),
            interval=state.interval,
            outcome=event.outcome,
            invalid=reasons or None,
            others=measures,
        )
        done = (*done, Write(ended))
        if reasons:
            return present_again(state, done, event.at_s)
        measures = {}  # measures are those of the intervals
        if state.interval < design.intervals:
            return rest_before_interval(
                replace(state, interval=state.interval + 1), done, event.at_s + FADE_OUT_S + design.pause_s
            )
    done = (*done, Write(journal.TrialEnded(**attempt_fields(state), outcome=event.outcome, others=measures)))
    if state.adjusts:
        return keep_setting(state, done, event.at_s)
    if not state.asks:
        return enter_step(state, state.index + 1, done, at_s=event.at_s)
    asking = replace(state, phase=Phase.ANSWERING, answers={})
    return asking, (*done, WriteTables(), show_page(asking))


def end_rest(state: SessionState, event: TimeUp) -> Result:
    """Present the next interval after its rest."""
    return (state, ()) if is_before_end(state, event.at_s) else start_interval(state, (), event.at_s)


def end_feedback(state: SessionState, event: TimeUp) -> Result:
    """Continue after the time of the feedback."""
    return (state, ()) if is_before_end(state, event.at_s) else enter_step(state, state.index + 1, at_s=event.at_s)


def pause_session(state: SessionState, event: PauseRequested) -> Result:
    """Show the pause; the current attempt at a task ends."""
    held: Hold | None = "pause" if event.by == "operator" else None
    paused = replace(state, phase=Phase.PAUSED, interrupted=state.phase, held=held)
    return paused, (*interrupt_trial(state), Write(journal.Paused(by=event.by)), WriteTables(), show_page(paused))


def take_over_pause(state: SessionState, event: PauseRequested) -> Result:
    """Convert the participant's pause to the operator's; otherwise do nothing."""
    if event.by != "operator" or state.held is not None:
        return state, ()
    paused = replace(state, held="pause")
    return paused, (Write(journal.Paused(by=event.by)), WriteTables(), show_page(paused))


def resume_session(state: SessionState, event: ResumeRequested) -> Result:
    """Return to the interrupted phase and fade the force in if it was off; only the operator ends a held pause."""
    if state.held is not None and event.by != "operator":
        reason = "the force was stopped" if state.held == "force" else "the operator paused the session"
        raise SessionError(f"{reason}: only the operator can resume it, not the {event.by}")
    commands: Commands = (Write(journal.Resumed(by=event.by)),)
    if state.force_off:
        commands = (*commands, Write(journal.ForceRestored(by=event.by)), FadeIn())
    state = replace(state, phase=state.interrupted or Phase.READING, interrupted=None, force_off=False, held=None)
    if state.phase in {Phase.TASK, Phase.RESTING}:
        return start_trial(replace(state, attempt=state.attempt + 1), commands, event.at_s)
    if state.phase is Phase.FEEDBACK:
        return enter_step(state, state.index + 1, commands, at_s=event.at_s)
    return state, (*commands, show_page(state))


def stop_force(state: SessionState, event: ForceStopped) -> Result:
    """Stop the force and pause; only the operator resumes, unless the program itself stopped the force."""
    stopped = Write(journal.ForceStopped(by=event.by))
    held: Hold | None = state.held if event.by == "program" else "force"
    if state.phase is Phase.PAUSED:
        paused = replace(state, force_off=True, held=held)
        return paused, (StopForce(), stopped, show_page(paused))
    paused = replace(state, phase=Phase.PAUSED, interrupted=state.phase, force_off=True, held=held)
    pausing = (Write(journal.Paused(by=event.by)), WriteTables(), show_page(paused))
    return paused, (StopForce(), *interrupt_trial(state), stopped, *pausing)


def stop_force_again(state: SessionState, event: ForceStopped) -> Result:
    """Record another stop of a force that is already off."""
    return state, (StopForce(), Write(journal.ForceStopped(by=event.by)))


def stop_force_after_end(state: SessionState, _event: ForceStopped) -> Result:
    """Stop the force after the journal was closed."""
    return state, (StopForce(),)


def repeat_trial(state: SessionState, event: RepeatRequested) -> Result:
    """Present the trial again; the earlier attempt stays in the data."""
    if not event.reason.strip():
        raise SessionError("repeating a trial requires a reason")
    repeated = Write(journal.Repeat(trial=state.trial.number, reason=event.reason), waits=True)
    return start_trial(replace(state, attempt=state.attempt + 1), (*interrupt_trial(state), repeated), event.at_s)


def write_note(state: SessionState, event: Note) -> Result:
    """Write the operator's note, waiting for the disk if it has a text."""
    written = Write(journal.Note(kind=event.kind, text=event.text), waits=event.kind == "note")
    return state, (written, WriteTables())


def end_session(state: SessionState, event: EndRequested) -> Result:
    """End the session early; after a failure without a withdrawal its status is broken."""
    broken = state.phase is Phase.TROUBLE and event.status == "aborted"
    ended = replace(state, phase=Phase.ENDED, interrupted=None)
    finish = Finish("broken" if broken else event.status, event.reason)
    return ended, (*interrupt_trial(state), finish, show_page(ended))


def call_operator(state: SessionState, event: Broke) -> Result:
    """Stop the force, write all data, and wait for the operator.

    If the device failed, ``interrupted`` is the phase to which the session returns after reconnection. In a study
    with videos the journal does not say whether a device or a video failed, which would reveal the trial's condition.
    """
    keeps_phase = state.phase in {Phase.OPENING, Phase.PAUSED, Phase.TROUBLE}
    phase = state.interrupted if keeps_phase else state.phase
    interrupted = phase if event.by == "device" else None
    trouble = replace(state, phase=Phase.TROUBLE, interrupted=interrupted, force_off=True)
    videos = any(condition.shows_video for condition in state.plan.protocol.conditions.values())
    cause = CAUSE_WITHHELD if videos and event.by == "device" else event.what
    written = (Write(journal.Broke(what=cause)), WriteTables())
    return trouble, (StopForce(), *interrupt_trial(state), *written, show_page(trouble))


def reconnect_device(state: SessionState, event: Reconnected) -> Result:
    """Pause at zero force until the operator resumes; a trial that the failure interrupted is then presented again."""
    if not state.lost_device:
        raise SessionError("the session was not stopped by a device failure: end it now and resume it later")
    paused = replace(state, phase=Phase.PAUSED, held="force")
    opened = journal.DeviceReconnected(device=event.described.get("name"), described=event.described)
    return paused, (
        StopForce(),
        Write(opened, waits=True),
        Write(journal.Paused(by="program")),
        WriteTables(),
        show_page(paused),
    )


def stall_session(state: SessionState, event: WriteFailed) -> Result:
    """Stop the force and show a waiting page until the pending writes succeed."""
    failure = Stall(event.reason, event.pending, event.at_s, state.phase)
    stall = failure if state.stall is None else replace(failure, before=state.stall.before, by=state.stall.by)
    stalled = replace(state, phase=Phase.STALLED, stall=stall)
    return stalled, (StopForce(), StopTrial(), Rest(), show_page(stalled))


def retry_writes(state: SessionState, _event: WriteRetried) -> Result:
    """Retry the pending commands in order, each once; success is a separate event."""
    return state, _stall_of(state).pending


def recover_from_stall(state: SessionState, event: WriteCompleted) -> Result:
    """Return to the interrupted phase, paused at zero force."""
    stalled = _stall_of(state)
    back = replace(state, phase=stalled.before, stall=None)
    if back.phase in _STOPPABLE:
        return stop_force(back, ForceStopped(event.at_s, stalled.by))
    return back, ()


def stop_force_of_stalled(state: SessionState, event: ForceStopped) -> Result:
    """Record a stop of the force during a stall; afterwards only the operator resumes."""
    if event.by != "program":
        state = replace(state, stall=replace(_stall_of(state), by=event.by))
    return state, (StopForce(),)


def end_stalled_session(state: SessionState, _event: EndRequested) -> Result:
    """End the session without a line in the journal, so that it stays unfinished; pending writes are still retried."""
    if state.over:
        raise SessionError("the session has ended, but its last lines have not yet been written to disk")
    ended = replace(state, stall=replace(_stall_of(state), before=Phase.ENDED))
    return ended, (show_page(ended),)


def _stall_of(state: SessionState) -> Stall:
    assert state.stall is not None  # noqa: S101 - the phase says so
    return state.stall

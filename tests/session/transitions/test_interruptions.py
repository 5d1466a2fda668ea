"""Pauses, force stops, repeats, early ends and what broke."""

from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.session.pages import EndPage, PausePage, TroublePage
from study_app.session.transitions.commands import FadeIn, Finish, Rest, StartTrial, StopForce, StopTrial, Write
from study_app.session.transitions.events import (
    Broke,
    Continue,
    EndAsked,
    ForceStopped,
    PauseAsked,
    RepeatAsked,
    ResumeAsked,
)
from study_app.session.transitions.state import FINAL, Phase
from study_app.session.transitions.table import advance
from tests.session import small
from tests.session.transitions.states import shown, state_in, written


def test_a_pause_during_a_task_ends_the_attempt_and_the_trial_starts_again() -> None:
    paused, commands = advance(state_in(Phase.TASK), PauseAsked(5.0, "participant"))
    assert commands[:2] == (StopTrial(), Rest())
    assert commands[2] == Write("trial_ended", {"trial": 2, "attempt": 1, "outcome": "interrupted"}, measured=True)
    assert shown(commands) == PausePage(force_off=False)
    again, commands = advance(paused, ResumeAsked(9.0, "operator"))
    assert written(commands) == ["resumed", "trial_started"]
    assert (again.phase, again.trial.number, again.attempt) == (Phase.TASK, 2, 2)
    assert not any(isinstance(command, FadeIn) for command in commands)


def test_a_pause_while_answering_goes_back_to_the_same_page_with_every_choice() -> None:
    answering = state_in(Phase.ANSWERING)
    paused, _ = advance(answering, PauseAsked(5.0, "operator"))
    back, commands = advance(paused, ResumeAsked(9.0, "operator"))
    assert back == answering
    assert dict(shown(commands).chosen) == {"liquid": 5, "strong": 5, "spare": 5}


def test_a_second_pause_at_once_changes_nothing() -> None:
    paused = state_in(Phase.PAUSED)
    assert advance(paused, PauseAsked(6.0, "participant")) == (paused, ())


@pytest.mark.parametrize("phase", [Phase.READING, Phase.TASK, Phase.ANSWERING, Phase.PAUSED])
def test_a_force_stop_is_the_first_command_and_resuming_fades_the_force_in(phase: Phase) -> None:
    stopped, commands = advance(state_in(phase), ForceStopped(5.0, "participant"))
    assert commands[0] == StopForce()
    assert stopped.phase is Phase.PAUSED
    assert shown(commands) == PausePage(force_off=True, held="pause" if phase is Phase.PAUSED else None)
    resumed, commands = advance(stopped, ResumeAsked(6.0, "operator"))
    assert FadeIn() in commands
    assert written(commands)[:2] == ["resumed", "force_restored"]
    assert not resumed.force_off


def test_a_force_that_the_operator_stopped_is_the_operators_to_bring_back() -> None:
    stopped, commands = advance(state_in(Phase.TASK), ForceStopped(5.0, "operator"))
    assert shown(commands) == PausePage(force_off=True, held="force")
    with pytest.raises(SessionError, match="the operator switched the force off: the operator resumes it"):
        advance(stopped, ResumeAsked(6.0, "participant"))
    resumed, commands = advance(stopped, ResumeAsked(7.0, "operator"))
    assert commands[:3] == (Write("resumed", {"by": "operator"}), Write("force_restored", {"by": "operator"}), FadeIn())
    assert (resumed.phase, resumed.held, resumed.force_off) == (Phase.TASK, None, False)


@pytest.mark.parametrize("by", ["participant", "device", "program"])
def test_a_force_that_somebody_else_stopped_may_be_brought_back_by_the_participant(by: Any) -> None:
    stopped, commands = advance(state_in(Phase.READING), ForceStopped(5.0, by))
    assert shown(commands) == PausePage(force_off=True)
    _, commands = advance(stopped, ResumeAsked(6.0, "participant"))
    assert commands[1] == Write("force_restored", {"by": "participant"})


@pytest.mark.parametrize("by", ["participant", "device", "program", "operator"])
def test_no_later_stop_takes_the_operators_stop_away(by: Any) -> None:
    stopped, _ = advance(state_in(Phase.READING), ForceStopped(5.0, "operator"))
    again, commands = advance(stopped, ForceStopped(6.0, by))
    assert shown(commands) == PausePage(force_off=True, held="force")
    with pytest.raises(SessionError, match="the operator resumes it"):
        advance(again, ResumeAsked(7.0, "participant"))


def test_the_operators_stop_during_the_participants_pause_holds_it() -> None:
    paused, _ = advance(state_in(Phase.READING), PauseAsked(4.0, "participant"))
    stopped, _ = advance(paused, ForceStopped(5.0, "operator"))
    with pytest.raises(SessionError, match="the operator resumes it"):
        advance(stopped, ResumeAsked(6.0, "participant"))


def test_the_operators_pause_is_the_operators_to_end_whoever_stops_the_force_then() -> None:
    paused, commands = advance(state_in(Phase.ANSWERING), PauseAsked(5.0, "operator"))
    assert shown(commands) == PausePage(force_off=False, held="pause")
    stopped, commands = advance(paused, ForceStopped(6.0, "participant"))
    assert shown(commands) == PausePage(force_off=True, held="pause")
    for state in (paused, stopped):
        with pytest.raises(SessionError, match="the operator paused the session: the operator resumes it"):
            advance(state, ResumeAsked(7.0, "participant"))
        assert advance(state, ResumeAsked(7.0, "operator"))[0].phase is Phase.ANSWERING


def test_the_participants_pause_is_the_participants_to_end_until_the_operator_pauses_too() -> None:
    paused, _ = advance(state_in(Phase.READING), PauseAsked(5.0, "participant"))
    _, commands = advance(paused, ResumeAsked(6.0, "participant"))
    assert commands[0] == Write("resumed", {"by": "participant"})
    taken_over, commands = advance(paused, PauseAsked(5.5, "operator"))
    assert commands[0] == Write("paused", {"by": "operator"})
    assert shown(commands) == PausePage(force_off=False, held="pause")
    assert advance(taken_over, PauseAsked(5.6, "operator")) == (taken_over, ())
    with pytest.raises(SessionError, match="the operator resumes it"):
        advance(taken_over, ResumeAsked(6.0, "participant"))


def test_the_force_fades_in_before_a_trial_starts_again() -> None:
    stopped, _ = advance(state_in(Phase.TASK), ForceStopped(5.0, "device"))
    _, commands = advance(stopped, ResumeAsked(6.0, "operator"))
    order = [type(command) for command in commands]
    assert order.index(FadeIn) < order.index(StartTrial)


@pytest.mark.parametrize("phase", [Phase.TROUBLE, *sorted(FINAL, key=str)])
def test_the_force_can_be_stopped_where_nothing_goes_on(phase: Phase) -> None:
    state = state_in(phase)
    after, commands = advance(state, ForceStopped(5.0, "operator"))
    assert after == state
    assert commands[0] == StopForce()


def test_a_repeat_keeps_the_attempt_that_was_and_its_reason() -> None:
    again, commands = advance(state_in(Phase.TASK), RepeatAsked(5.0, "phone rang"))
    assert written(commands) == ["trial_ended", "repeat", "trial_started"]
    assert commands[3].fields == {"trial": 2, "reason": "phone rang"}
    assert again.attempt == 2


def test_a_repeat_while_answering_forgets_the_choices_but_not_the_measured_attempt() -> None:
    again, commands = advance(state_in(Phase.ANSWERING), RepeatAsked(5.0, "phone rang"))
    assert written(commands) == ["repeat", "trial_started"]
    assert (again.phase, again.answers, again.attempt) == (Phase.TASK, {}, 2)


def test_the_next_trial_begins_with_its_first_attempt() -> None:
    again, _ = advance(state_in(Phase.TASK), RepeatAsked(5.0, "phone rang"))
    assert small.walk(again, Phase.TASK).attempt == 1


def test_a_repeat_without_a_reason_is_refused() -> None:
    with pytest.raises(SessionError, match="enter one"):
        advance(state_in(Phase.TASK), RepeatAsked(5.0, "  "))


@pytest.mark.parametrize("status", ["withdrawn", "aborted"])
def test_an_early_end_closes_the_session_before_it_says_so(status: Any) -> None:
    ended, commands = advance(state_in(Phase.TASK), EndAsked(5.0, status, "tired"))
    assert commands[:2] == (StopTrial(), Rest())
    assert commands[-2] == Finish(status, "tired")
    assert isinstance(shown(commands), EndPage)
    assert ended.phase is Phase.ENDED


def test_an_early_end_and_a_complete_session_do_not_read_alike() -> None:
    early = shown(advance(state_in(Phase.READING), EndAsked(5.0, "aborted", ""))[1])
    last = small.walk(small.opened(), Phase.READING, times=2)
    assert early != shown(advance(last, Continue(9.0))[1])


def test_what_broke_is_for_the_journal_and_not_for_the_participant() -> None:
    trouble, commands = advance(state_in(Phase.TASK), Broke(5.0, "no sample for 50 ms"))
    assert commands[:3] == (StopForce(), StopTrial(), Rest())
    assert written(commands) == ["trial_ended", "broke"]
    page = shown(commands)
    assert isinstance(page, TroublePage)
    assert "50 ms" not in page.title + page.paragraph
    assert trouble.phase is Phase.TROUBLE


def test_a_session_that_broke_and_is_aborted_counts_as_broken() -> None:
    _, commands = advance(state_in(Phase.TROUBLE), EndAsked(9.0, "aborted", "cable"))
    assert Finish("broken", "cable") in commands
    _, commands = advance(state_in(Phase.TROUBLE), EndAsked(9.0, "withdrawn", "enough"))
    assert Finish("withdrawn", "enough") in commands

"""A level that the participant sets: steps, confirmation, the time limit, and what the journal holds of it."""

from dataclasses import replace
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.pages import TaskPage
from study_app.session.transitions.commands import Adjust, LeaveTask, Rest, StartTrial, StopForce, StopTrial, Write
from study_app.session.transitions.events import (
    Begin,
    Continue,
    ForceStopped,
    PauseAsked,
    RepeatAsked,
    ResumeAsked,
    Stepped,
    Submitted,
    TaskDone,
    TimeUp,
)
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance, open_session
from tests.protocol.trials.level_studies import key_of
from tests.protocol.trials.matching import ALONE, matching
from tests.session.transitions.states import shown, written

DONE = TaskDone(30.0, "complete", {"duration_s": 20.0})


def opened(*edits: tuple[str, str]) -> SessionState:
    protocol: Protocol = matching(*edits)
    key = key_of(protocol)
    return open_session(protocol, build_schedule(protocol, "P001", 1), key.codes, "en", secret=key.secret)


def setting(*edits: tuple[str, str]) -> tuple[SessionState, tuple[Any, ...]]:
    """Return a session in its first interval whose level is set, and the commands that began it."""
    state, commands = advance(opened(*edits), Begin(0.0))
    while not (state.adjusts and state.phase is Phase.TASK):
        event = TimeUp(state.until_s or 0.0) if state.phase is Phase.RESTING else TaskDone(5.0, "complete", {})
        state, commands = advance(state, event)
    return state, commands


def adjusted(commands: tuple[Any, ...]) -> Adjust | None:
    return next((one for one in commands if isinstance(one, Adjust)), None)


def line(commands: tuple[Any, ...], event: str) -> dict[str, Any]:
    return next(dict(one.fields) for one in commands if isinstance(one, Write) and one.event == event)


def test_the_standard_comes_first_and_steps_have_no_effect_in_it_nor_in_the_rest() -> None:
    state, commands = advance(opened(), Begin(0.0))
    page = shown(commands)
    assert isinstance(page, TaskPage)
    assert (page.adjusts, page.said, page.task.limit_s) == (False, "Keep the ball on the moving target.", 2.0)
    assert state.due is not None
    assert next(one for one in commands if isinstance(one, StartTrial)).presented.value == 6.0
    assert advance(state, Stepped(1.0, 3)) == (state, ())
    assert advance(state, Submitted(1.0)) == (state, ())
    resting, commands = advance(state, TaskDone(5.0, "complete", {}))
    assert commands[:2] == (StopTrial(), Rest())
    assert resting.phase is Phase.RESTING
    assert not shown(commands).adjusts


def test_the_interval_that_is_set_goes_on_for_long_and_asks_its_question() -> None:
    state, commands = setting()
    begun = next(one for one in commands if isinstance(one, StartTrial))
    page = shown(commands)
    assert (begun.adjusts, begun.interval, begun.task.limit_s, page.task.limit_s) == (True, 2, 60.0, 60.0)
    assert (page.adjusts, page.said) == (True, "Adjust the second one until both are equally strong.")
    assert written(commands) == ["interval_started", "item_shown"]
    assert state.due is not None
    assert begun.presented == state.due.intervals[1]


def test_steps_move_the_number_from_where_it_started_and_are_written_without_it() -> None:
    state, _ = setting()
    assert state.due is not None
    start = state.due.intervals[1].value
    values = [start]
    for steps in (-1, -2, 2):
        state, commands = advance(state, Stepped(6.0, steps))
        command = adjusted(commands)
        assert command is not None
        assert command.fields == {"trial": 1, "attempt": 1, "steps": steps}
        values.append(command.presented.value)
        assert len(commands) == 1
        assert f"{command.presented.value:.4g}" not in repr(command)
    factor = 9 ** (1 / 40)
    assert values == pytest.approx([start, start / factor, start / factor**3, start / factor])
    assert (state.steps, state.phase) == (-1, Phase.TASK)
    assert "place" not in repr(state)


def test_beyond_an_end_steps_count_and_the_number_stays() -> None:
    state, _ = setting()
    state, commands = advance(state, Stepped(6.0, 1000))
    command = adjusted(commands)
    assert command is not None
    assert command.presented.value == 18.0
    state, commands = advance(state, Stepped(6.0, 5))
    command = adjusted(commands)
    assert command is not None  # the servo is given the same numbers: recordings do not tell where the end is
    assert command.presented.value == 18.0
    assert state.steps == 1005


def test_confirming_ends_the_task_and_its_end_is_the_answer() -> None:
    state, _ = setting()
    state, _ = advance(state, Stepped(6.0, 2))
    assert advance(state, Submitted(20.0)) == (state, (LeaveTask(),))
    assert advance(state, Continue(20.0)) == (state, ())
    level = state.adjusting.level(2) if state.adjusting is not None else None
    after, commands = advance(state, DONE)
    assert commands[:2] == (StopTrial(), Rest())
    assert written(commands)[:4] == ["interval_ended", "trial_ended", "choice", "responses"]
    assert line(commands, "interval_ended")["setting"] == level
    (answer,) = line(commands, "responses")["items"]
    assert (answer["item"], answer["value"], answer["kind"]) == ("adjustment", 2, "number")
    assert (answer["onset_s"], answer["first_s"]) == (0.0 + state.answers["adjustment"].onset_s, 30.0)  # type: ignore[operator]
    assert next(one for one in commands if isinstance(one, Write) and one.event == "responses").waits
    assert (after.phase, after.trial.index, after.interval, after.steps) == (Phase.RESTING, 2, 1, 2)
    (heard,) = after.heard
    assert (heard.trial, heard.success, heard.correct) == (1, None, None)


def test_what_was_not_delivered_is_presented_again_from_the_same_start_and_is_no_answer() -> None:
    state, _ = setting()
    state, _ = advance(state, Stepped(6.0, 2))
    again, commands = advance(state, replace(DONE, invalid=("force_limit_n",)))
    assert written(commands) == ["interval_ended", "trial_ended", "trial_started"]
    assert (again.attempt, again.due, again.heard) == (2, state.due, ())
    again, _ = advance(again, TimeUp(again.until_s or 0.0))
    assert again.steps == 0


@pytest.mark.parametrize("event", [PauseAsked(9.0, "participant"), ForceStopped(9.0, "device")])
def test_a_pause_ends_the_attempt_and_the_next_starts_where_it_did(event: Any) -> None:
    state, _ = setting()
    state, _ = advance(state, Stepped(6.0, 2))
    paused, commands = advance(state, event)
    leading = (StopForce(), StopTrial(), Rest()) if isinstance(event, ForceStopped) else (StopTrial(), Rest())
    assert commands[: len(leading)] == leading
    assert advance(paused, ResumeAsked(10.0, "participant"))[0].due == state.due
    back, _ = advance(paused, ResumeAsked(10.0, "participant"))
    assert (back.phase, back.attempt, back.interval, back.steps) == (Phase.TASK, 2, 1, 0)
    repeated, _ = advance(state, RepeatAsked(9.0, "a call"))
    assert (repeated.attempt, repeated.due, repeated.steps) == (2, state.due, 0)


def test_without_the_standard_the_first_interval_is_set() -> None:
    state, commands = advance(opened(ALONE), Begin(0.0))
    assert state.adjusts
    assert shown(commands).said == "Adjust it until it has the strength that you were asked for."

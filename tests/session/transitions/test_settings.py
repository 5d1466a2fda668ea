"""A level that the participant sets: steps, confirmation, the time limit, and what the journal holds of it."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import PageStep, build_schedule
from study_app.session.pages import TaskPage
from study_app.session.resume import resume_at
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
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.steps import AGAIN_S, FADE_OUT_S
from study_app.session.transitions.table import advance, open_session
from tests.protocol.trials.level_studies import key_of
from tests.protocol.trials.matching import ALONE, matching
from tests.session import pairs
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


NO_SEALS: Any = object()
"""A key, where nothing is sealed."""
REASONS = ("level_error_percent", "force_limit_n")
DELAYS = (
    ('condition = "oil"\nvary = "viscosity_pa_s"', 'condition = "oil"\nvary = "delay_ms"'),
    ("standards = [1, 2]\nlevels = [0.1, 0.8]", "standards = [50, 100]\nlevels = [10, 80]"),
    ("levels = [0.2, 0.4, 0.8]", "levels = [10, 40, 80]"),
)


def in_main(state: SessionState, index: int = 2) -> SessionState:
    """Return the session in the first interval of a trial of the main block."""
    while not (state.phase is Phase.TASK and state.trial.block == "viscosity" and state.trial.index == index):
        state, _ = advance(state, pairs.next_event(state, 0.0))
    return state


def done(at_s: float, *invalid: str, **measured: Any) -> TaskDone:
    return TaskDone(at_s, "complete", measured, invalid)


def fields(commands: tuple[object, ...], event: str) -> Any:
    return next(one.fields for one in commands if isinstance(one, Write) and one.event == event)


def test_an_interval_that_was_not_delivered_is_rested_after_and_comes_again_from_the_first() -> None:
    before = in_main(pairs.opened())
    state, _ = advance(before, done(10.0))
    state, _ = advance(state, TimeUp(20.0))
    state, commands = advance(state, done(30.0, *REASONS))
    assert commands[:2] == (StopTrial(), Rest())
    assert written(commands) == ["interval_ended", "trial_ended", "trial_started"]
    assert fields(commands, "interval_ended")["invalid"] == REASONS
    assert fields(commands, "trial_ended") == {"trial": before.trial.number, "attempt": 1, "outcome": "invalid"}
    assert (state.phase, state.interval, state.attempt) == (Phase.RESTING, 1, 2)
    assert state.until_s == pytest.approx(30.0 + FADE_OUT_S + AGAIN_S)
    page = shown(commands)
    assert isinstance(page, TaskPage)
    assert page.interval is not None
    assert page.interval.announced == "Once more"
    assert (state.due, state.heard) == (before.due, before.heard)
    assert advance(state, TimeUp(31.0)) == (state, ())
    state, commands = advance(state, TimeUp(31.6))
    assert (state.phase, state.interval) == (Phase.TASK, 1)
    assert written(commands) == ["interval_started"]
    state, commands = advance(state, done(40.0))
    page = shown(commands)
    assert isinstance(page, TaskPage)
    assert page.interval is not None
    assert (state.phase, page.interval.announced) == (Phase.RESTING, "Next: the second")


def gives_up(state: SessionState) -> tuple[SessionState, list[str]]:
    """Let every attempt at the present trial fail; return the state and the events written."""
    number, events = state.trial.number, []
    for at_s in range(100, 1000, 100):
        state, commands = advance(state, done(at_s, "level_error_percent"))
        events += written(commands)
        if state.phase is not Phase.RESTING or state.trial.number != number:
            break
        state, _ = advance(state, TimeUp(at_s + 50.0))
    return state, events


def test_after_so_many_attempts_the_slot_stays_unanswered_and_the_session_goes_on() -> None:
    before = in_main(pairs.opened())
    state, events = gives_up(before)
    assert events.count("trial_ended") == before.plan.protocol.limits.attempts == 3
    assert (state.trial.number, state.attempt, state.invalid) == (before.trial.number + 1, 1, 0)
    assert state.heard == before.heard
    after, commands = advance(state, TimeUp(2000.0))
    _, commands = advance(after, done(2000.0, "level_error_percent"))
    assert fields(commands, "trial_started")["attempt"] == 2


def test_a_break_after_a_trial_that_was_given_up_is_not_passed_over() -> None:
    def in_training(state: SessionState) -> SessionState:
        while not (state.phase is Phase.TASK and state.trial.index == 2):
            state, _ = advance(state, pairs.next_event(state, 0.0, right=False))
        return state

    state, events = gives_up(in_training(pairs.opened()))
    assert isinstance(state.step, PageStep)
    assert state.page_id == "rest"
    assert "passed_over" not in events


def test_a_break_after_trials_that_were_all_given_up_is_shown_in_a_resumed_session_too() -> None:
    protocol = pairs.protocol()
    fails = frozenset((trial, attempt) for trial in (1, 2) for attempt in range(3))
    lines = [line for _, line in events_of(pairs.opened(protocol), fails)]
    ended = [number for number, line in enumerate(lines) if line["event"] == "trial_ended" and line["trial"] == 2][2]
    assert lines[ended + 1] == {"event": "page_shown", "t_s": lines[ended]["t_s"], "page": "rest"}
    began = {"event": "session_started", "t_s": 0.0, "language": "en"}
    schedule = pairs.opened(protocol).plan.schedule
    start = resume_at(protocol, schedule, [began, *lines[: ended + 1]], NO_SEALS)
    state, commands = advance(pairs.opened(protocol, start=start), Begin(0.0))
    assert (state.phase, written(commands)) == (Phase.READING, ["page_shown"])


def test_an_interruption_is_no_attempt_that_failed() -> None:
    state = in_main(pairs.opened())
    state, _ = advance(state, done(10.0, "pace_error_percent"))
    state, _ = advance(state, PauseAsked(10.5, "operator"))
    state, _ = advance(state, ResumeAsked(20.0, "operator"))
    assert (state.attempt, state.invalid) == (3, 1)
    state, _ = advance(state, done(30.0, "pace_error_percent"))
    assert (state.phase, state.attempt, state.invalid) == (Phase.RESTING, 4, 2)


@pytest.mark.parametrize(
    ("errors_ms", "outcome"),
    [((6.0, 7.9), "complete"), ((6.0, 8.1), "invalid"), ((8.1, 6.0), "invalid"), ((None, 9.0), "complete")],
)
def test_a_pair_whose_delays_do_not_differ_as_requested_comes_again(
    errors_ms: tuple[float | None, float], outcome: str
) -> None:
    state = in_main(pairs.opened(pairs.protocol(*DELAYS, ("standards = [1]", "standards = [50]"))))
    state, _ = advance(state, done(10.0, delay_error_mean_ms=errors_ms[0]))
    state, _ = advance(state, TimeUp(20.0))
    state, commands = advance(state, done(30.0, delay_error_mean_ms=errors_ms[1]))
    assert fields(commands, "trial_ended")["outcome"] == outcome
    assert fields(commands, "interval_ended").get("invalid", ()) == ("level_error_ms",) * (outcome == "invalid")
    assert state.phase is (Phase.ANSWERING if outcome == "complete" else Phase.RESTING)


def events_of(state: SessionState, fails: frozenset[tuple[int, int]]) -> Iterator[tuple[SessionState, dict[str, Any]]]:
    """Yield each state with a line of the journal of a session in which some attempts at trials fail."""
    at_s = 0.0
    while state.phase not in FINAL:
        event = pairs.next_event(state, at_s)
        if isinstance(event, TaskDone) and (state.trial.number, state.invalid) in fails:
            event = done(at_s, "level_error_percent")
        state, commands = advance(state, event)
        for one in commands:
            if isinstance(one, Write):
                yield state, {"event": one.event, "t_s": at_s, **one.fields}
        at_s += 100.0


FAILS = frozenset({(8, 0), (9, 0), (9, 1), (10, 0), (10, 1), (10, 2)})


@pytest.mark.slow
def test_a_session_killed_after_any_line_gives_up_the_same_trials_as_one_that_was_not() -> None:
    protocol = pairs.protocol()
    lines = [line for _, line in events_of(pairs.opened(protocol), FAILS)]
    given_up = {line["trial"] for line in lines if line["event"] == "trial_ended"} - {
        line["trial"] for line in lines if line["event"] == "responses"
    }
    assert given_up == {10}
    schedule = pairs.opened(protocol).plan.schedule
    began = {"event": "session_started", "t_s": 0.0, "language": "en"}
    whole, invalid = answers(lines), undelivered(lines)
    assert invalid == {8: 1, 9: 2, 10: 3}
    for count in range(1, len(lines)):
        start = resume_at(protocol, schedule, [began, *lines[:count]], NO_SEALS)
        state, _ = advance(pairs.opened(protocol, start=start), Begin(0.0))
        if state.phase is Phase.PAUSED:
            state, _ = advance(state, ResumeAsked(0.0, "operator"))
        resumed = [line for _, line in events_of(state, FAILS)]
        assert answers([*lines[:count], *resumed]) == whole, lines[count - 1]
        assert undelivered([*lines[:count], *resumed]) == invalid, lines[count - 1]


def undelivered(lines: list[dict[str, Any]]) -> Counter[int]:
    """Return how many attempts at each trial were not delivered as requested."""
    return Counter(line["trial"] for line in lines if line["event"] == "trial_ended" and line["outcome"] == "invalid")


def answers(lines: list[dict[str, Any]]) -> dict[int, list[Any]]:
    """Return what was answered, by trial."""
    found = {}
    for line in lines:
        if line["event"] == "responses":
            found[line["trial"]] = [item["value"] for item in line["items"]]
    return found

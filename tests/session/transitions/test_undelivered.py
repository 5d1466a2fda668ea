"""Trials that were not delivered as requested: presented again, not asked about, given up after so many attempts."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

from study_app.protocol.orders.schedule import PageStep
from study_app.session.pages import TaskPage
from study_app.session.resume import resume_at
from study_app.session.transitions.commands import Rest, StopTrial, Write
from study_app.session.transitions.events import Begin, PauseAsked, ResumeAsked, TaskDone, TimeUp
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.steps import AGAIN_S, FADE_OUT_S
from study_app.session.transitions.table import advance
from tests.session import pairs
from tests.session.transitions.states import shown, written

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

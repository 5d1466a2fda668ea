"""A level that the participant sets: steps, confirmation, the time limit, and what the journal holds of it."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.resume import resume_at
from study_app.session.transitions.commands import Write
from study_app.session.transitions.events import Begin, ResumeAsked, TaskDone
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, open_session
from tests.protocol.trials.level_studies import key_of
from tests.protocol.trials.matching import matching
from tests.session import pairs
from tests.session.transitions.states import written


def opened(*edits: tuple[str, str]) -> SessionState:
    protocol: Protocol = matching(*edits)
    key = key_of(protocol)
    return open_session(protocol, build_schedule(protocol, "P001", 1), key.codes, "en", secret=key.secret)


def line(commands: tuple[Any, ...], event: str) -> dict[str, Any]:
    return next(dict(one.fields) for one in commands if isinstance(one, Write) and one.event == event)


NO_SEALS: Any = object()
"""A key, where nothing is sealed."""


def done(at_s: float, *invalid: str, **measured: Any) -> TaskDone:
    return TaskDone(at_s, "complete", measured, invalid)


def fields(commands: tuple[object, ...], event: str) -> Any:
    return next(one.fields for one in commands if isinstance(one, Write) and one.event == event)


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

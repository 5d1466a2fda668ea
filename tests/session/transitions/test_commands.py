"""What the transcripts leave open: which measures a line has, which lines wait for the disk, and how long a rest is."""

from contextlib import suppress
from itertools import product
from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.protocol.wording import words
from study_app.session.transitions.events import (
    Adjust,
    Begin,
    Broke,
    Chosen,
    Command,
    Continue,
    EndRequested,
    Event,
    ForceStopped,
    Note,
    PauseRequested,
    RepeatRequested,
    Stepped,
    Submitted,
    TaskDone,
    TimeUp,
    Write,
)
from study_app.session.transitions.page_builder import build_page
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance
from tests.session import pairs, small
from tests.session.transitions.states import EVENTS, LEFT, event_of, state_in
from tests.session.transitions.transcribed import VALUE, replying, to_setting, to_trial


def lines_of(commands: tuple[Command, ...]) -> list[tuple[str, dict[str, Any]]]:
    """Return event and fields of each line that is written."""
    return [(command.line.event, dict(command.line.fields())) for command in commands if isinstance(command, Write)]


def last_page() -> SessionState:
    return small.walk(small.opened(), Phase.READING, times=2)


def second_interval() -> SessionState:
    state = to_trial(pairs.opened(), "viscosity", 2)
    state, _ = advance(state, TaskDone(10.0, "complete", {}))
    return advance(state, TimeUp(state.until_s or 0.0))[0]


@pytest.mark.slow
def test_only_input_of_a_person_waits_for_the_disk() -> None:
    cases: list[tuple[SessionState, Event]] = [
        (last_page(), Continue(90.0)),
        (state_in(Phase.TASK), Note(9.0, "mark", "")),
        *((state_in(phase), event_of(kind)) for phase, kind in product(Phase, EVENTS)),
    ]
    events_by_wait: dict[bool, set[tuple[str, str | None]]] = {True: set(), False: set()}
    for state, event in cases:
        with suppress(SessionError):
            for command in advance(state, event)[1]:
                if isinstance(command, Write) and command is not LEFT:
                    fields = command.line.fields()
                    events_by_wait[command.waits].add((command.line.event, fields.get("page", fields.get("kind"))))
    assert events_by_wait[True] == {
        ("page_left", "welcome"), ("choice", "statement"), ("answer_removed", None), ("responses", None),
        ("note", "note"), ("repeat", None), ("device_reconnected", None),
    }  # fmt: skip
    assert events_by_wait[True].isdisjoint(events_by_wait[False])
    assert events_by_wait[False] >= {("page_left", "thanks"), ("note", "mark")}


INTERRUPTIONS: tuple[Event, ...] = (
    PauseRequested(30.0, "participant"),
    ForceStopped(30.0, "device"),
    Broke(30.0, "the cable", "device"),
    EndRequested(30.0, "withdrawn", ""),
    RepeatRequested(30.0, "a call"),
)


@pytest.mark.parametrize("event", INTERRUPTIONS, ids=lambda event: type(event).__name__)
def test_an_interrupted_attempt_has_the_measures_of_its_running_part(event: Event) -> None:
    """A trial of intervals has no measures itself, and a rest has no running part."""
    for state, expected in (
        (state_in(Phase.TASK), [("trial_ended", None, True)]),
        (second_interval(), [("interval_ended", 2, True), ("trial_ended", None, False)]),
        (state_in(Phase.RESTING), [("trial_ended", None, False)]),
        (state_in(Phase.ANSWERING), []),
    ):
        ends = [
            command
            for command in advance(state, event)[1]
            if isinstance(command, Write) and command.line.event.endswith("_ended")
        ]
        measures = [(end.line.event, end.line.fields().get("interval"), end.measured) for end in ends]
        assert measures == expected
        for end in ends:
            fields = end.line.fields()
            assert (fields["outcome"], fields["trial"], fields["attempt"]) == (
                "interrupted", state.trial.number, state.attempt,
            )  # fmt: skip


def test_measures_are_those_of_the_interval_and_of_a_trial_without_intervals() -> None:
    _, commands = advance(state_in(Phase.TASK), TaskDone(5.0, "timeout", {"duration_s": 2.0}))
    assert lines_of(commands) == [
        ("trial_ended", {"trial": 2, "attempt": 1, "outcome": "timeout", "duration_s": 2.0}),
    ]  # fmt: skip
    state = second_interval()
    which = {"trial": state.trial.number, "attempt": 1, "outcome": "timeout"}
    after, commands = advance(state, TaskDone(20.0, "timeout", {"duration_s": 3.5}))
    assert lines_of(commands) == [
        ("interval_ended", {**which, "interval": 2, "duration_s": 3.5}), ("trial_ended", which),
    ]  # fmt: skip
    assert (after.phase, after.answers) == (Phase.ANSWERING, {})


def test_an_undelivered_trial_is_repeated_after_a_fade_and_a_rest() -> None:
    state = to_trial(pairs.opened(), "viscosity", 2)
    again, commands = advance(state, TaskDone(100.0, "complete", {}, ("pace_error_percent",)))
    assert dict(lines_of(commands))["interval_ended"]["invalid"] == ("pace_error_percent",)
    assert (again.trial, again.phase, again.until_s) == (state.trial, Phase.RESTING, pytest.approx(100 + 0.05 + 1.5))


def test_a_setting_is_answered_by_the_sum_of_its_steps_and_has_the_level_that_was_reached() -> None:
    state, values = to_setting(), list[float | None]()
    for steps in (-1, 1000, -5000, 2):
        state, (adjust,) = advance(state, Stepped(6.0, steps))
        assert isinstance(adjust, Adjust)
        values.append(adjust.presented.value)
        assert adjust.line.steps == steps
    assert values[1:3] == [18.0, 2.0]  # the ends of the range
    assert 2.0 < (values[3] or 0.0) < 18.0
    _, commands = advance(state, TaskDone(30.0, "complete", {"duration_s": 20.0}))
    lines_by_event = dict(lines_of(commands))
    assert (lines_by_event["interval_ended"]["setting"], lines_by_event["interval_ended"]["duration_s"]) == (
        values[3],
        20.0,
    )
    assert lines_by_event["choice"]["value"] == lines_by_event["responses"]["items"][0]["value"] == -1 + 1000 - 5000 + 2


def test_only_the_first_estimation_states_the_number_of_its_modulus() -> None:
    state, texts = advance(replying("number", *VALUE), Begin(0.0))[0], list[str]()
    while len(texts) < 2:
        at_s = max(state.until_s or 0.0, state.since_s + 9.0)
        event: Event = TaskDone(at_s, "complete", {}) if state.phase is Phase.TASK else TimeUp(at_s)
        if state.phase is Phase.ANSWERING:
            texts.append(build_page(state).item.text)  # type: ignore[union-attr]
            state, _ = advance(state, Chosen(at_s, state.items[0], 12))
            event = Submitted(at_s)
        state, _ = advance(state, event)
    assert texts == [words("en").modulus.format(number="10"), "How thick?"]

"""What events of a session write, with which measures, and what waits for the disk."""

import hashlib
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
    FadeIn,
    Finish,
    ForceStopped,
    LeaveTask,
    Note,
    PauseRequested,
    Reconnected,
    RepeatRequested,
    ResumeRequested,
    Stepped,
    Submitted,
    TaskDone,
    TimeUp,
    Write,
    WriteCompleted,
    WriteFailed,
)
from study_app.session.transitions.page_builder import build_page
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance
from tests.session import pairs, small
from tests.session.transitions.states import EVENTS, LEFT, event_of, shown, state_in
from tests.session.transitions.transcribed import VALUE, opened, replying, to_page, to_setting, to_trial, with_break


def lines_of(commands: tuple[Command, ...]) -> list[tuple[str, dict[str, Any]]]:
    """Return event and fields of each line that is written."""
    return [(command.line.event, dict(command.line.fields())) for command in commands if isinstance(command, Write)]


def last_page() -> SessionState:
    return small.walk(small.opened(), Phase.READING, times=2)


def second_interval() -> SessionState:
    state = to_trial(pairs.opened(), "viscosity", 2)
    state, _ = advance(state, TaskDone(10.0, "complete", {}))
    return advance(state, TimeUp(state.until_s or 0.0))[0]


def test_only_what_a_person_gave_waits_for_the_disk() -> None:
    cases: list[tuple[SessionState, Event]] = [
        (last_page(), Continue(90.0)),
        (state_in(Phase.TASK), Note(9.0, "mark", "")),
        *((state_in(phase), event_of(kind)) for phase, kind in product(Phase, EVENTS)),
    ]
    written: dict[bool, set[tuple[str, str | None]]] = {True: set(), False: set()}
    for state, event in cases:
        with suppress(SessionError):
            for command in advance(state, event)[1]:
                if isinstance(command, Write) and command is not LEFT:
                    fields = command.line.fields()
                    written[command.waits].add((command.line.event, fields.get("page", fields.get("kind"))))
    assert written[True] == {
        ("page_left", "welcome"), ("choice", "statement"), ("answer_removed", None), ("responses", None),
        ("note", "note"), ("repeat", None), ("device_reconnected", None),
    }  # fmt: skip
    assert written[True].isdisjoint(written[False])
    assert written[False] >= {("page_left", "thanks"), ("note", "mark")}


def test_consent_is_recorded_with_its_text_and_the_version_of_the_study() -> None:
    _, commands = advance(state_in(Phase.READING), Continue(50.0))
    read = hashlib.sha256(b"Welcome\n\nOne.\n\nTwo.").hexdigest()
    assert lines_of(commands)[0] == ("page_left", {"page": "welcome", "text_sha256": read, "study_version": "1"})
    _, commands = advance(last_page(), Continue(50.0))
    assert lines_of(commands) == [("page_left", {"page": "thanks"})]


def test_a_break_is_not_left_before_its_least_time() -> None:
    state = to_page(opened(with_break(min_s=60)), "rest")
    assert build_page(state).stays_until_s == 100.0 + 60.0  # type: ignore[union-attr]
    assert advance(state, Continue(159.9)) == (state, ())
    assert advance(state, Continue(160.0))[0].phase is Phase.TASK


INTERRUPTIONS: tuple[Event, ...] = (
    PauseRequested(30.0, "participant"),
    ForceStopped(30.0, "device"),
    Broke(30.0, "the cable", "device"),
    EndRequested(30.0, "withdrawn", ""),
    RepeatRequested(30.0, "a call"),
)


@pytest.mark.parametrize("event", INTERRUPTIONS, ids=lambda event: type(event).__name__)
def test_an_interrupted_attempt_has_the_measures_of_what_ran(event: Event) -> None:
    """A trial of intervals has none of its own, and in a rest nothing ran."""
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
        told = [(end.line.event, end.line.fields().get("interval"), end.measured) for end in ends]
        assert told == expected
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


def test_an_undelivered_trial_comes_again_after_a_rest_until_its_attempts_are_used_up() -> None:
    state = to_trial(pairs.opened(), "viscosity", 2)
    number, attempts = state.trial.number, 3
    assert state.plan.protocol.limits.attempts == attempts
    for attempt in range(1, attempts + 1):
        at_s = 100.0 * attempt
        state, commands = advance(state, TaskDone(at_s, "complete", {}, ("pace_error_percent",)))
        interval, trial, begun = lines_of(commands)[:3]
        which = {"trial": number, "attempt": attempt}
        assert interval == ("interval_ended", {**which, "interval": 1, "outcome": "complete",
                                               "invalid": ("pace_error_percent",)})  # fmt: skip
        assert trial == ("trial_ended", {**which, "outcome": "invalid"})
        if attempt < attempts:
            assert (begun[0], begun[1]["trial"], begun[1]["attempt"]) == ("trial_started", number, attempt + 1)
            assert (state.phase, state.interval, state.until_s) == (Phase.RESTING, 1, pytest.approx(at_s + 0.05 + 1.5))
            assert shown(commands).interval.announced == words("en").once_more
            state, _ = advance(state, TimeUp(state.until_s or 0.0))
    assert (state.trial.number, state.attempt, state.invalid) == (number + 1, 1, 0)


def test_a_setting_is_answered_by_the_sum_of_its_steps_and_has_the_level_that_was_reached() -> None:
    state, values = to_setting(), list[float | None]()
    for steps in (-1, 1000, -5000, 2):
        state, (adjust,) = advance(state, Stepped(6.0, steps))
        assert isinstance(adjust, Adjust)
        values.append(adjust.presented.value)
        assert adjust.line.steps == steps
    assert values[1:3] == [18.0, 2.0]  # the ends of the range
    assert 2.0 < (values[3] or 0.0) < 18.0
    assert advance(state, Continue(20.0)) == (state, ())
    assert advance(state, Submitted(20.0)) == (state, (LeaveTask(),))
    _, commands = advance(state, TaskDone(30.0, "complete", {"duration_s": 20.0}))
    told = dict(lines_of(commands))
    assert (told["interval_ended"]["setting"], told["interval_ended"]["duration_s"]) == (values[3], 20.0)
    assert told["choice"]["value"] == told["responses"]["items"][0]["value"] == -1 + 1000 - 5000 + 2
    task = state_in(Phase.TASK)
    assert advance(task, Continue(20.0)) == (task, (LeaveTask(),))
    assert advance(task, Submitted(20.0)) == (task, ())


@pytest.mark.parametrize(
    ("phase", "status", "finished"),
    [
        (Phase.TROUBLE, "aborted", "broken"),
        (Phase.TROUBLE, "withdrawn", "withdrawn"),
        (Phase.TASK, "aborted", "aborted"),
        (Phase.READING, "withdrawn", "withdrawn"),
    ],
)
def test_a_session_that_is_given_up_after_a_failure_is_broken(phase: Phase, status: Any, finished: Any) -> None:
    after, commands = advance(state_in(phase), EndRequested(9.0, status, "a fire"))
    assert [command for command in commands if isinstance(command, Finish)] == [Finish(finished, "a fire")]
    assert after.phase is Phase.ENDED


def test_only_a_device_can_be_reconnected_and_only_the_operator_resumes() -> None:
    broken, _ = advance(state_in(Phase.ANSWERING), Broke(9.0, "a bug"))
    described = {"name": "memory", "force_limit_n": 8.0}
    for state in (broken, advance(broken, Broke(10.0, "the cable", "device"))[0]):
        with pytest.raises(SessionError, match="was not stopped by a device failure"):
            advance(state, Reconnected(11.0, described))
    in_pause, _ = advance(state_in(Phase.PAUSED), Broke(10.0, "the cable", "device"))
    for state in (state_in(Phase.TROUBLE), in_pause):
        paused, commands = advance(state, Reconnected(11.0, described))
        assert lines_of(commands) == [
            ("device_reconnected", {"device": "memory", "described": described}), ("paused", {"by": "program"}),
        ]  # fmt: skip
        assert (paused.phase, paused.held, paused.force_off) == (Phase.PAUSED, "force", True)
        back, commands = advance(paused, ResumeRequested(12.0, "operator"))
        by = {"by": "operator"}
        assert (lines_of(commands), FadeIn() in commands) == ([("resumed", by), ("force_restored", by)], True)
        assert (back.phase, back.answers) == (Phase.ANSWERING, state.answers)


def test_a_stop_by_the_operator_holds_after_the_disk_has_failed_twice() -> None:
    stalled, _ = advance(state_in(Phase.STALLED), ForceStopped(10.0, "operator"))
    stalled, _ = advance(stalled, WriteFailed(11.0, "still full", ()))
    assert stalled.stall is not None
    assert (stalled.stall.before, stalled.stall.reason, stalled.stall.left) == (Phase.ANSWERING, "still full", ())
    after, _ = advance(stalled, WriteCompleted(12.0))
    assert (after.phase, after.interrupted, after.held) == (Phase.PAUSED, Phase.ANSWERING, "force")


def test_a_pause_during_feedback_ends_with_the_next_step() -> None:
    state = state_in(Phase.FEEDBACK)
    paused, _ = advance(state, PauseRequested(90.0, "participant"))
    after, _ = advance(paused, ResumeRequested(95.0, "participant"))
    assert after.index == state.index + 1


def test_a_trial_is_repeated_with_a_reason_and_without_its_answers() -> None:
    state = state_in(Phase.ANSWERING)
    with pytest.raises(SessionError, match="repeating a trial requires a reason"):
        advance(state, RepeatRequested(9.0, "  "))
    again, commands = advance(state, RepeatRequested(9.0, "a call"))
    assert lines_of(commands)[0] == ("repeat", {"trial": 2, "reason": "a call"})
    assert (again.phase, again.trial.number, again.attempt, again.answers) == (Phase.TASK, 2, 2, {})


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

"""Trials of intervals: printed texts, trials passed over or given up, and sessions that were interrupted."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.protocol.load import parse
from study_app.session.pages import FeedbackPage
from study_app.session.resume import Start, resume_at
from study_app.session.transitions.events import Begin, Finish, ResumeRequested, StartTrial, TaskDone, TimeUp, Write
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance
from tests.journal_lines import event_from
from tests.protocol.trials.level_studies import text_of
from tests.session import pairs
from tests.session.transitions.states import shown, written
from tests.session.transitions.transcribed import opened, to_trial

DONE = TaskDone(10.0, "complete", {})


def test_printed_commands_and_states_do_not_contain_the_presented_level() -> None:
    state = to_trial(pairs.opened(), "viscosity", 2)
    assert state.due is not None
    again, commands = advance(advance(state, DONE)[0], TimeUp(20.0))
    values = [f"{interval.value:.6g}"[:6] for interval in state.due.intervals if interval.value not in (1.0, 2.0)]
    assert values
    assert not [value for value in values if value in f"{commands} {state} {again}"]


def test_practice_ends_at_its_criterion_and_skips_the_remaining_trials_and_breaks() -> None:
    lines = pairs.whole(pairs.opened())
    passed = [line for line in lines if line["event"] == "passed_over"]
    assert {line["reason"] for line in passed} == {"criterion_met"}
    assert [line.get("trial", line.get("page")) for line in passed] == [3, 4, "rest", 5, 6]
    assert [line["page"] for line in lines if line["event"] == "page_shown"] == ["rest"]
    assert sum(line["event"] == "responses" for line in lines) == 2 + 12
    assert [line["trial"] for line in lines if line["event"] == "feedback_shown"] == [1, 2], "in practice alone"


def test_a_break_is_skipped_only_where_nothing_was_presented_since_the_page_before() -> None:
    lines = pairs.whole(pairs.opened(pairs.protocol(more=pairs.PRACTICE.replace("break_every = 2", "break_every = 4"))))
    passed = [line.get("trial", line.get("page")) for line in lines if line["event"] == "passed_over"]
    assert passed == [3, 4, 5, 6]  # trials 1 and 2 were presented before the break
    assert [line["page"] for line in lines if line["event"] == "page_shown"] == ["rest"]


@pytest.mark.parametrize(("missed", "status"), [("go_on", "completed"), ("end", "aborted")])
def test_a_missed_criterion_continues_or_ends_the_session(missed: str, status: str) -> None:
    more = pairs.PRACTICE.replace("of = 3 }", f'of = 3, missed = "{missed}" }}')
    state = pairs.opened(pairs.protocol(more=more))
    state = pairs.walk(state, Phase.ANSWERING, times=6, right=False)
    assert state.trial.index == 6
    while state.phase not in {Phase.ENDED, Phase.TASK}:
        state, commands = advance(state, pairs.next_event(state, state.since_s, right=False))
    finish = next((command for command in commands if isinstance(command, Finish)), None)
    assert (finish.status if finish else "completed") == status
    assert finish is None or "training" in finish.reason


def test_a_study_with_levels_needs_the_keys_secret() -> None:
    with pytest.raises(SessionError, match="generated from the sealed key"):
        pairs.opened(secret=b"")


def test_feedback_is_not_shown_if_no_answer_is_correct() -> None:
    edits = (
        ("levels = [0.1, 0.8]", 'levels = [0.1, 0.8]\nlevel = "value"'),
        ("standards = [1, 2]\n", ""),
        ("standards = [1]\n", ""),
        ("until = { right = 2, of = 3 }\n", ""),
    )
    by_weber, by_value = (
        [line["event"] for line in pairs.whole(pairs.opened(study))]
        for study in (pairs.protocol(edits[-1]), pairs.protocol(*edits))
    )
    assert "feedback_shown" in by_weber
    assert "feedback_shown" not in by_value
    assert "responses" in by_value


NO_SEALS: Any = object()
"""A key, where nothing is sealed."""


def task_done(at_s: float, *invalid: str, **measured: Any) -> TaskDone:
    return TaskDone(at_s, "complete", measured, invalid)


def test_a_break_after_trials_that_were_all_given_up_is_shown_in_a_resumed_session_too() -> None:
    protocol = pairs.protocol()
    fails = frozenset((trial, attempt) for trial in (1, 2) for attempt in range(3))
    lines = [line for _, line in events_of(pairs.opened(protocol), fails)]
    ended = [number for number, line in enumerate(lines) if line["event"] == "trial_ended" and line["trial"] == 2][2]
    assert lines[ended + 1] == {"event": "page_shown", "t_s": lines[ended]["t_s"], "page": "rest"}
    began = {"event": "session_started", "t_s": 0.0, "language": "en"}
    schedule = pairs.opened(protocol).plan.schedule
    start = resume_at(protocol, schedule, map(event_from, [began, *lines[: ended + 1]]), NO_SEALS)
    state, commands = advance(pairs.opened(protocol, start=start), Begin(0.0))
    assert (state.phase, written(commands)) == (Phase.READING, ["page_shown"])


def events_of(state: SessionState, fails: frozenset[tuple[int, int]]) -> Iterator[tuple[SessionState, dict[str, Any]]]:
    """Yield each state with a line of the journal of a session in which some attempts at trials fail."""
    at_s = 0.0
    while state.phase not in FINAL:
        event = pairs.next_event(state, at_s)
        if isinstance(event, TaskDone) and (state.trial.number, state.invalid) in fails:
            event = task_done(at_s, "level_error_percent")
        state, commands = advance(state, event)
        for command in commands:
            if isinstance(command, Write):
                yield state, {"event": command.line.event, "t_s": at_s, **command.line.fields()}
        at_s += 100.0


def test_undelivered_attempts_count_only_for_the_interrupted_trial() -> None:
    steps = pairs.opened().plan.schedule.steps
    index = next(number for number, step in enumerate(steps) if getattr(step, "block", "") == "viscosity")
    start = Start(index, presented={steps[index].number: 2}, invalid=2)
    state, _ = advance(pairs.opened(start=start), Begin(0.0))
    assert (state.phase, state.index) == (Phase.PAUSED, index)
    state, _ = advance(state, ResumeRequested(1.0, "operator"))
    assert (state.attempt, state.invalid) == (3, 2)
    state = to_trial(state, "viscosity", 2)
    assert (state.attempt, state.invalid) == (1, 0)


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
        start = resume_at(protocol, schedule, map(event_from, [began, *lines[:count]]), NO_SEALS)
        state, _ = advance(pairs.opened(protocol, start=start), Begin(0.0))
        if state.phase is Phase.PAUSED:
            state, _ = advance(state, ResumeRequested(0.0, "operator"))
        resumed = [line for _, line in events_of(state, FAILS)]
        assert answers([*lines[:count], *resumed]) == whole, lines[count - 1]
        assert undelivered([*lines[:count], *resumed]) == invalid, lines[count - 1]
        assert presented_levels([*resumed, *lines]) == presented_levels(lines), lines[count - 1]


def presented_levels(lines: list[dict[str, Any]]) -> set[tuple[int, float, str]]:
    """Return the level and the arrangement of each trial, which all its attempts share."""
    start_lines = [line for line in lines if line["event"] == "trial_started"]
    return {(line["trial"], line["level"], line["arrangement"]) for line in start_lines}


def undelivered(lines: list[dict[str, Any]]) -> Counter[int]:
    """Return how many attempts at each trial were not delivered as requested."""
    return Counter(line["trial"] for line in lines if line["event"] == "trial_ended" and line["outcome"] == "invalid")


def answers(lines: list[dict[str, Any]]) -> dict[int, list[Any]]:
    """Return the answers by trial."""
    answers_found = {}
    for line in lines:
        if line["event"] == "responses":
            answers_found[line["trial"]] = [item["value"] for item in line["items"]]
    return answers_found


def test_intervals_rests_and_feedback_last_as_long_as_the_design_says() -> None:
    text = text_of(*pairs.EDITS, more=pairs.PRACTICE).replace('design = "2ifc"', 'design = "pairs"')
    text += '\n[designs.pairs]\nkind = "2ifc"\npause_s = 0.75\nbetween_s = 2.5\nfeedback_s = 1.5\n'
    state, at_s, phases = opened(parse(text.encode(), "study.toml")), 1.0, set()
    while state.phase not in FINAL:
        event = pairs.next_event(state, at_s)
        if isinstance(event, TimeUp) and state.until_s is not None:
            assert advance(state, TimeUp(state.until_s - 1e-6))[1] == (), "before its end"
            event = TimeUp(state.until_s)
        state, commands = advance(state, event)
        page = shown(commands)
        if state.phase is Phase.RESTING:
            assert state.until_s == pytest.approx(event.at_s + (2.5 if state.interval == 1 else 0.05 + 0.75))
            assert state.interval == 2 or state.plan.schedule.steps[state.index - 1].block == state.trial.block
        if state.phase is Phase.TASK:
            (start,) = (command for command in commands if isinstance(command, StartTrial))
            assert state.due is not None
            assert start.presented == state.due.intervals[state.interval - 1]
            assert start.task == page.task == state.plan.protocol.tasks["stir"]
        if state.phase in {Phase.RESTING, Phase.TASK}:
            resting = state.phase is Phase.RESTING
            assert (page.interval.number, page.interval.of, page.interval.resting) == (state.interval, 2, resting)
        if isinstance(page, FeedbackPage):
            assert (state.until_s, page.right) == (event.at_s + 1.5, True)
        phases.add(state.phase)
        at_s = event.at_s + 1.25
    assert {Phase.RESTING, Phase.TASK, Phase.FEEDBACK, Phase.ANSWERING} <= phases

"""Trials of intervals: what is presented, rests, answers, feedback, and trials that are passed over."""

from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.protocol.orders.schedule import Trial
from study_app.protocol.trials.answered import heard_in
from study_app.session.resume import Start, resume_at
from study_app.session.transitions.commands import Finish, Write
from study_app.session.transitions.events import Begin, ResumeAsked, TaskDone, TimeUp
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance
from tests.session import pairs
from tests.session.transitions.states import written

DONE = TaskDone(10.0, "complete", {})


def in_main(state: SessionState) -> SessionState:
    """Return the session in the first interval of the main block's second trial."""
    while not (state.phase is Phase.TASK and state.trial.block == "viscosity" and state.trial.index == 2):
        state, _ = advance(state, pairs.next_event(state, 0.0))
    return state


def test_the_first_trial_of_a_block_begins_without_the_rest_between_trials() -> None:
    state = pairs.opened()
    commands: tuple[Any, ...] = ()
    while not (isinstance(state.step, Trial) and state.trial.block == "viscosity"):
        state, commands = advance(state, pairs.next_event(state, state.since_s))
    assert (state.phase, state.trial.index) == (Phase.TASK, 1)
    assert written(commands)[-2:] == ["trial_started", "interval_started"]


def test_a_presented_level_is_in_no_printed_command_or_state() -> None:
    state = in_main(pairs.opened())
    assert state.due is not None
    again, commands = advance(advance(state, DONE)[0], TimeUp(20.0))
    values = [f"{one.value:.6g}"[:6] for one in state.due.intervals if one.value not in (1.0, 2.0)]
    assert values
    assert not [one for one in values if one in f"{commands} {state} {again}"]


def test_practice_ends_with_its_criterion_and_what_is_left_is_passed_over_with_its_breaks() -> None:
    lines = pairs.whole(pairs.opened())
    passed = [line for line in lines if line["event"] == "passed_over"]
    assert {line["reason"] for line in passed} == {"criterion_met"}
    assert [line.get("trial", line.get("page")) for line in passed] == [3, 4, "rest", 5, 6]
    assert [line["page"] for line in lines if line["event"] == "page_shown"] == ["rest"]
    assert sum(line["event"] == "responses" for line in lines) == 2 + 12
    assert [line["trial"] for line in lines if line["event"] == "feedback_shown"] == [1, 2], "in practice alone"


def test_a_break_is_skipped_only_where_nothing_was_presented_since_the_page_before() -> None:
    edits = (("break_every = 2", "break_every = 4"),)
    lines = pairs.whole(pairs.opened(pairs.protocol(more=_edited(pairs.PRACTICE, edits))))
    passed = [line.get("trial", line.get("page")) for line in lines if line["event"] == "passed_over"]
    assert passed == [3, 4, 5, 6]  # trials 1 and 2 were presented before the break
    assert [line["page"] for line in lines if line["event"] == "page_shown"] == ["rest"]


@pytest.mark.parametrize(("missed", "status"), [("go_on", "completed"), ("end", "aborted")])
def test_a_missed_criterion_goes_on_or_ends_the_session(missed: str, status: str) -> None:
    more = pairs.PRACTICE.replace("of = 3 }", f'of = 3, missed = "{missed}" }}')
    state = pairs.opened(pairs.protocol(more=more))
    state = pairs.walk(state, Phase.ANSWERING, times=6, right=False)
    assert state.trial.index == 6
    while state.phase not in {Phase.ENDED, Phase.TASK}:
        state, commands = advance(state, pairs.next_event(state, state.since_s, right=False))
    finish = next((one for one in commands if isinstance(one, Finish)), None)
    assert (finish.status if finish else "completed") == status
    assert finish is None or "training" in finish.reason


@pytest.mark.slow
def test_a_session_goes_on_at_any_line_as_one_that_was_not_interrupted() -> None:
    study = pairs.protocol()
    lines = [{"event": "session_started", "t_s": 0.0}, *pairs.whole(pairs.opened(study))]
    due = {line["trial"]: line["arrangement"] for line in lines if line["event"] == "trial_started"}
    schedule = pairs.opened(study).plan.schedule
    for count in range(1, len(lines)):
        kept = lines[:count]
        start = resume_at(study, schedule, kept)
        heard = heard_in(study, kept)
        rest = pairs.opened(study, start=Start(start.step, start.presented, heard))
        state, commands = advance(rest, Begin(0.0))
        if state.phase is Phase.PAUSED:
            state, _ = advance(state, ResumeAsked(0.0, "participant"))
        assert {one.fields["reason"] for one in commands if isinstance(one, Write) and "reason" in one.fields} <= {
            "criterion_met"
        }
        done = {line["trial"] for line in kept if line["event"] == "responses"}
        more = {line["trial"]: line["arrangement"] for line in _rest(state) if line["event"] == "trial_started"}
        assert {number: due[number] for number in due if number not in done and number in more} == more


def _edited(text: str, edits: tuple[tuple[str, str], ...]) -> str:
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    return text


def _rest(state: SessionState) -> list[dict[str, object]]:
    if state.due is None:
        return pairs.whole(state)
    present = {"event": "trial_started", "trial": state.trial.number, "arrangement": _arranged(state)}
    return [present, *pairs.whole(state)]


def _arranged(state: SessionState) -> str:
    assert state.design is not None
    assert state.due is not None
    return "".join("C" if one else "S" for one in state.design.arrangements[state.due.arrangement])


def test_a_study_with_levels_needs_the_keys_secret() -> None:
    with pytest.raises(SessionError, match="drawn from the sealed key"):
        pairs.opened(secret=b"")


def test_no_feedback_is_shown_where_a_level_is_a_value_so_that_no_answer_is_correct() -> None:
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

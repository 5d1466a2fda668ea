"""Trials of intervals: what is presented, rests, answers, feedback, and trials that are passed over."""

from dataclasses import replace
from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.protocol.orders.schedule import Trial
from study_app.protocol.trials.answered import heard_in
from study_app.protocol.trials.presentation import scene_of
from study_app.session.pages import ChoicePage, FeedbackPage, NumberPage, Progress, QuestionnairePage, TaskPage
from study_app.session.resume import Start, resume_at
from study_app.session.transitions.commands import Finish, Rest, StartTrial, StopForce, StopTrial, Write
from study_app.session.transitions.events import (
    Begin,
    Broke,
    Chosen,
    ForceStopped,
    PauseAsked,
    Reconnected,
    RepeatAsked,
    ResumeAsked,
    Submitted,
    TaskDone,
    TimeUp,
    WriteCompleted,
    WriteFailed,
)
from study_app.session.transitions.page_builder import page
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance
from tests.session import pairs
from tests.session.transitions.states import shown, written

DONE = TaskDone(10.0, "complete", {})


def started(commands: tuple[object, ...]) -> StartTrial | None:
    return next((one for one in commands if isinstance(one, StartTrial)), None)


def in_main(state: SessionState) -> SessionState:
    """Return the session in the first interval of the main block's second trial."""
    while not (state.phase is Phase.TASK and state.trial.block == "viscosity" and state.trial.index == 2):
        state, _ = advance(state, pairs.next_event(state, 0.0))
    return state


def test_intervals_follow_each_other_with_a_rest_at_zero_force_and_then_come_the_answers() -> None:
    state = in_main(pairs.opened())
    assert state.due is not None
    state, commands = advance(state, DONE)
    assert state.phase is Phase.RESTING
    assert commands[:2] == (StopTrial(), Rest())
    assert written(commands) == ["interval_ended"]
    assert started(commands) is None
    page = shown(commands)
    assert isinstance(page, TaskPage)
    assert page.interval is not None
    assert (page.interval.number, page.interval.of, page.interval.resting) == (2, 2, True)
    assert page.interval.announced == "Next: the second"
    early, nothing = advance(state, TimeUp(10.6))
    assert (early, nothing) == (state, ())
    state, commands = advance(state, TimeUp(10.65))
    assert state.phase is Phase.TASK
    begun = started(commands)
    assert begun is not None
    assert (begun.interval, begun.presented) == (2, state.due.intervals[1])
    assert shown(commands).interval.announced == "Second of 2"
    state, commands = advance(state, replace(DONE, at_s=13.0))
    assert written(commands) == ["interval_ended", "trial_ended"]
    page = shown(commands)
    assert isinstance(page, ChoicePage)
    assert [text for _, text in page.item.options] == ["First", "Second"]


def test_the_next_trial_of_the_block_begins_with_a_rest_that_belongs_to_it() -> None:
    state = in_main(pairs.opened())
    state = pairs.walk(state, Phase.RESTING, times=2)
    assert (state.trial.index, state.interval, state.due is not None) == (3, 1, True)
    state, commands = advance(state, PauseAsked(state.since_s, "participant"))
    assert written(commands) == ["trial_ended", "paused"]
    state, commands = advance(state, ResumeAsked(1000.0, "participant"))
    assert (state.phase, state.attempt, state.interval) == (Phase.TASK, 2, 1)
    assert started(commands) is not None


def test_the_first_trial_of_a_block_begins_without_the_rest_between_trials() -> None:
    state = pairs.opened()
    commands: tuple[Any, ...] = ()
    while not (isinstance(state.step, Trial) and state.trial.block == "viscosity"):
        state, commands = advance(state, pairs.next_event(state, state.since_s))
    assert (state.phase, state.trial.index) == (Phase.TASK, 1)
    assert written(commands)[-2:] == ["trial_started", "interval_started"]


def test_every_interval_presents_what_is_due_and_a_trial_presented_again_presents_the_same() -> None:
    state = in_main(pairs.opened())
    due, protocol = state.due, state.plan.protocol
    assert due is not None
    state, _ = advance(state, DONE)
    again, commands = advance(state, RepeatAsked(11.0, "a call"))
    begun = started(commands)
    assert (again.due, again.attempt, again.interval, begun is not None) == (due, 2, 1, True)
    assert written(commands) == ["trial_ended", "repeat", "trial_started", "interval_started"]
    numbers = [scene_of(protocol, one).liquids[0].viscosity_pa_s for one in due.intervals]
    assert sorted(numbers) == sorted(one.value for one in due.intervals)
    assert len(set(numbers)) == 2


def test_a_presented_level_is_in_no_printed_command_or_state() -> None:
    state = in_main(pairs.opened())
    assert state.due is not None
    again, commands = advance(advance(state, DONE)[0], TimeUp(20.0))
    values = [f"{one.value:.6g}"[:6] for one in state.due.intervals if one.value not in (1.0, 2.0)]
    assert values
    assert not [one for one in values if one in f"{commands} {state} {again}"]


@pytest.mark.parametrize("phase", [Phase.RESTING, Phase.FEEDBACK])
def test_force_stop_and_failures_stop_a_rest_and_a_feedback(phase: Phase) -> None:
    state = pairs.walk(pairs.opened(), phase)
    stopped, commands = advance(state, ForceStopped(1.0, "device"))
    assert commands[0] == StopForce()
    assert stopped.phase is Phase.PAUSED
    assert stopped.force_off
    broken, commands = advance(state, Broke(1.0, "cable", "device"))
    assert commands[0] == StopForce()
    assert advance(broken, Reconnected(2.0, {"name": "memory"}))[0].phase is Phase.PAUSED
    stalled, commands = advance(state, WriteFailed(1.0, "disk full", ()))
    assert commands[0] == StopForce()
    assert advance(stalled, WriteCompleted(2.0))[0].phase is Phase.PAUSED


@pytest.mark.parametrize("right", [True, False])
def test_feedback_says_whether_the_answer_was_correct_and_ends_by_time(right: bool) -> None:
    state = pairs.walk(pairs.opened(), Phase.ANSWERING)
    state, _ = advance(state, Chosen(1.0, state.items[0], pairs.answer_of(state, right)))
    state, commands = advance(state, pairs.next_event(state, 2.0))
    assert state.phase is Phase.FEEDBACK
    assert shown(commands) == FeedbackPage(right)
    assert written(commands) == ["responses", "feedback_shown"]
    assert "right" not in str([one.fields for one in commands if isinstance(one, Write)][1])
    assert advance(state, TimeUp(2.5)) == (state, ())
    after, _ = advance(state, TimeUp(2.6))
    paused, _ = advance(state, PauseAsked(2.3, "operator"))
    resumed, _ = advance(paused, ResumeAsked(2.6, "operator"))
    assert (after.phase, after.index) == (Phase.RESTING, state.index + 1)
    assert (resumed.phase, resumed.index, resumed.heard) == (after.phase, after.index, after.heard)


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


def test_progress_in_a_block_that_may_end_early_says_at_most_how_many_and_a_break_how_much_is_done() -> None:
    state, commands = advance(pairs.opened(), Begin(0.0))
    assert shown(commands).progress == Progress(None, 1, "Pair 1", 1, 6, at_most=True)
    while state.phase is not Phase.READING:
        state, commands = advance(state, pairs.next_event(state, state.since_s, right=False))
    assert shown(commands).progress == Progress(None, 1, "Pair 2", 3, 6, at_most=True)
    state = in_main(state)
    assert page(state).progress == Progress(1, 1, "Pair 2", 2, 12)


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


@pytest.mark.parametrize(
    ("design", "page"), [('"estimation"', NumberPage), ('"strength"', QuestionnairePage), ('"yesno"', ChoicePage)]
)
def test_each_reply_has_its_page(design: str, page: type) -> None:
    more = '\n[scales.three]\nlabels.en = ["a", "b", "c"]\n[designs.strength]\nkind = "rating"\nscale = "three"\n'
    edits = (
        ('sequence = ["training", "viscosity"]', 'sequence = ["viscosity"]'),
        ('design = "2ifc"', f"design = {design}"),
    )
    if design != '"yesno"':
        edits = (*edits, ("levels = [0.1, 0.8]", 'levels = [0.1, 0.8]\nlevel = "value"'), ("standards = [1, 2]\n", ""))
    study = pairs.protocol(*edits, more=more)
    state, commands = advance(pairs.opened(study), Begin(0.0))
    state, commands = advance(state, DONE)
    assert isinstance(shown(commands), page)


def test_a_study_with_levels_needs_the_keys_secret() -> None:
    with pytest.raises(SessionError, match="drawn from the sealed key"):
        pairs.opened(secret=b"")


def test_only_the_first_trial_of_an_estimation_names_the_number_of_its_modulus() -> None:
    more = '\n[designs.number]\nkind = "estimation"\nquestion = "How thick?"\nmodulus = { level = 0.5, number = 10 }\n'
    edits = (
        ('sequence = ["training", "viscosity"]', 'sequence = ["viscosity"]'),
        ('design = "2ifc"', 'design = "number"'),
        ("levels = [0.1, 0.8]", 'levels = [0.1, 0.8]\nlevel = "value"'),
        ("standards = [1, 2]\n", ""),
    )
    state, _ = advance(pairs.opened(pairs.protocol(*edits, more=more)), Begin(0.0))
    asked = []
    for _ in range(2):
        state, commands = advance(state, DONE)
        page = shown(commands)
        assert isinstance(page, NumberPage)
        asked.append(page.item.text)
        state, _ = advance(state, Chosen(1.0, page.item.id, 5.0))
        state, _ = advance(state, Submitted(1.0))
        state, _ = advance(state, TimeUp(state.until_s or 0.0))
    assert asked == ["Let the number for this one be 10. How thick?", "How thick?"]


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

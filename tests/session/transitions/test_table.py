"""The transition table, row by row: refused where there is no row."""

import hashlib
from dataclasses import replace
from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.pages import EndPage, PausePage, Progress, QuestionnairePage, TaskPage, TextPage, TroublePage
from study_app.session.transitions.commands import (
    FadeIn,
    Finish,
    LeaveTask,
    Rest,
    ShowPage,
    StartTrial,
    StopForce,
    StopTrial,
    Write,
    WriteTables,
)
from study_app.session.transitions.events import (
    Begin,
    Broke,
    Chosen,
    Continue,
    EndAsked,
    ForceStopped,
    ItemShown,
    PauseAsked,
    RepeatAsked,
    ResumeAsked,
    Submitted,
    TaskDone,
    WriteCompleted,
    WriteFailed,
    WriteRetried,
)
from study_app.session.transitions.moves import STOPPABLE
from study_app.session.transitions.state import FINAL, Phase
from study_app.session.transitions.table import advance, open_session
from tests.session import small
from tests.session.transitions.states import LEFT, event_of, shown, state_in, written


def test_a_session_goes_through_its_schedule_and_ends_complete() -> None:
    state, pages, trials = small.opened(), [], []
    while state.phase not in FINAL:
        state, commands = advance(state, small.next_event(state, 1.0))
        page = shown(commands)
        if page is not None:
            pages.append(page)
        trials += [command.fields for command in commands if isinstance(command, Write) and "of" in command.fields]
    assert state.phase is Phase.COMPLETE
    assert [type(page) for page in pages] == [
        TextPage,
        TaskPage,  # practice: no questionnaire
        *[TaskPage, QuestionnairePage] * 2,
        TaskPage,  # baseline: no questionnaire
        *[TaskPage, QuestionnairePage] * 2,
        TextPage,
        EndPage,
    ]
    schedule = state.plan.schedule
    assert [trial["code"] for trial in trials] == [trial.code for trial in schedule.trials]
    assert [trial["trial"] for trial in trials] == [1, 2, 3, 4, 5, 6]
    assert trials[1] == {
        "trial": 2,
        "attempt": 1,
        "block": "feeling",
        "phase": "main",
        "part": 1,
        "index": 1,
        "of": 2,
        "code": schedule.trials[1].code,
    }


def test_a_page_to_read_holds_the_protocols_texts_and_the_interfaces_word_where_it_has_none() -> None:
    _, commands = advance(small.opened(), Begin(0.0))
    page = shown(commands)
    assert (page.id, page.kind, page.title, page.paragraphs) == ("welcome", "consent", "Welcome", ("One.", "Two."))
    assert page.button == "I agree"
    state = small.walk(small.opened(), Phase.READING, times=2)
    assert (
        shown(advance(advance(state, PauseAsked(1.0, "operator"))[0], ResumeAsked(2.0, "operator"))[1]).button
        == "Continue"
    )


def test_leaving_a_page_is_written_and_so_is_the_next() -> None:
    _, commands = advance(state_in(Phase.READING), Continue(3.0))
    read = hashlib.sha256(b"Welcome\n\nOne.\n\nTwo.").hexdigest()
    agreed = {"text_sha256": read, "study_version": "1"}
    assert commands[0] == Write("page_left", {"page": "welcome", **agreed}, waits=True)  # it is a consent
    assert written(commands) == ["page_left", "trial_started"]


def test_a_trial_starts_its_scene_and_task_before_it_is_shown() -> None:
    state, commands = advance(state_in(Phase.READING), Continue(3.0))
    assert [type(command) for command in commands] == [Write, Write, WriteTables, StartTrial, ShowPage]
    start, page = commands[-2], shown(commands)
    assert (start.trial, start.attempt, start.presented.condition) == (1, 1, "is_thick")
    assert page.task == start.task == state.plan.protocol.tasks["explore"]
    assert page.workspace_m == (0.1, 0.06, 0.06)
    assert page.body_radius_m == pytest.approx(0.0034)
    assert page.progress == Progress(None, 2, "Setting", 1, 1)  # practice is in no part


def test_the_scene_of_a_trial_is_the_one_behind_its_code() -> None:
    state = state_in(Phase.TASK)
    paused, _ = advance(state, PauseAsked(1.0, "operator"))
    _, commands = advance(paused, ResumeAsked(2.0, "operator"))
    (start,) = [command for command in commands if isinstance(command, StartTrial)]
    assert start.presented.condition == state.plan.key["feeling"][state.trial.code]


def test_a_delayed_trial_starts_with_its_delay_and_its_page_says_nothing_of_it() -> None:
    state, delays, pages = small.opened(), {}, []
    while state.phase not in FINAL:
        state, commands = advance(state, small.next_event(state, 1.0))
        if isinstance(shown(commands), TaskPage) and state.trial.block == "seeing":
            (start,) = [command for command in commands if isinstance(command, StartTrial)]
            delays[state.trial.code] = start.delay_s
            pages.append(replace(shown(commands), trial=0, progress=None))
    key = small.opened().plan.key["seeing"]
    late = small.ODD_DELAY_MS / 1000
    assert delays == {code: late if condition == "is_late" else 0.0 for code, condition in key.items()}
    assert pages == pages[:1] * 2


def test_progress_names_part_setting_and_place_by_neutral_words() -> None:
    _, commands = advance(small.walk(small.opened(), Phase.TASK, times=2), event_of(TaskDone))
    progress = shown(commands).progress
    assert (progress.part, progress.parts, progress.label, progress.index, progress.of) == (1, 2, "Setting 1", 1, 2)


def test_the_end_of_a_task_takes_the_liquid_away_first_and_keeps_what_was_measured() -> None:
    state, commands = advance(state_in(Phase.TASK), TaskDone(9.0, "timeout", {"duration_s": 3.0}))
    assert commands[:2] == (StopTrial(), Rest())
    assert commands[2].fields == {"trial": 2, "attempt": 1, "outcome": "timeout", "duration_s": 3.0}
    assert state.phase is Phase.ANSWERING


def test_a_questionnaire_holds_the_statements_in_the_order_of_the_trial() -> None:
    _, commands = advance(state_in(Phase.TASK), event_of(TaskDone))
    page = shown(commands)
    assert [(item.id, item.number, item.required) for item in page.items] == [
        ("liquid", 1, True),
        ("strong", 2, True),
        ("spare", 3, False),
    ]
    assert (page.title, page.labels, page.cannot_judge) == ("Setting 1", tuple(small.SCALE), "Cannot judge")


def test_times_and_changes_of_an_answer_are_kept() -> None:
    state = small.walk(small.opened(), Phase.ANSWERING)
    for event in (
        ItemShown(10.0, "liquid"),
        ItemShown(11.0, "liquid"),  # again after a pause: the first counts
        Chosen(12.0, "liquid", 3),
        Chosen(13.0, "liquid", 3),  # the same again is no change
        Chosen(14.0, "liquid", None),
        Chosen(15.0, "liquid", 6),
        Chosen(16.0, "strong", None),
    ):
        state, commands = advance(state, event)
        assert len(commands) == 1
        assert isinstance(commands[0], Write)
    _, commands = advance(state, Submitted(20.0))
    first, second, third = commands[0].fields["items"]
    assert first == {
        "item": "liquid",
        "number": 1,
        "value": 6,
        "onset_s": 10.0,
        "first_s": 12.0,
        "last_s": 15.0,
        "changes": 2,
    }
    assert (second["value"], second["first_s"], second["onset_s"]) == (None, 16.0, None)  # cannot judge
    assert (third["value"], third["first_s"], third["changes"]) == (None, None, 0)  # left out


def test_a_questionnaire_with_a_required_statement_open_is_refused_by_its_number() -> None:
    state, _ = advance(small.walk(small.opened(), Phase.ANSWERING), Chosen(1.0, "liquid", 1))
    with pytest.raises(SessionError, match="answer 2 first"):
        advance(state, Submitted(2.0))


@pytest.mark.parametrize("value", [0, 8, -1])
def test_a_value_off_the_scale_is_refused(value: int) -> None:
    with pytest.raises(SessionError, match="choose 1 to 7"):
        advance(state_in(Phase.ANSWERING), Chosen(1.0, "liquid", value))


def test_cannot_judge_is_refused_where_the_scale_has_no_such_answer() -> None:
    state = small.walk(small.opened(), Phase.ANSWERING, times=3)
    assert state.trial.block == "seeing"
    with pytest.raises(SessionError, match="no answer off the scale"):
        advance(state, Chosen(1.0, "different", None))


@pytest.mark.parametrize("event", [ItemShown(1.0, "different"), Chosen(1.0, "different", 1)])
def test_an_item_of_another_page_is_refused(event: Any) -> None:
    with pytest.raises(SessionError, match="its items are liquid, strong, spare"):
        advance(state_in(Phase.ANSWERING), event)


def test_going_on_during_a_task_leaves_it_and_stays_until_it_is_done() -> None:
    state = state_in(Phase.TASK)
    assert advance(state, Continue(5.0)) == (state, (LeaveTask(),))


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.STALLED])
def test_a_disk_that_takes_nothing_stops_the_force_and_keeps_what_is_left_from_every_phase(phase: Phase) -> None:
    before = state_in(phase)
    stalled, commands = advance(before, WriteFailed(9.0, "disk full", (LEFT,)))
    assert commands[:3] == (StopForce(), StopTrial(), Rest())
    assert isinstance(shown(commands), EndPage if phase in FINAL else TroublePage)
    assert (stalled.phase, stalled.over) == (Phase.STALLED, phase in FINAL)
    assert advance(stalled, WriteRetried(9.0)) == (stalled, (LEFT,))
    after, commands = advance(stalled, WriteCompleted(10.0))
    if phase in STOPPABLE:
        assert (after, commands) == advance(before, ForceStopped(10.0, "program"))
    else:
        assert (after, commands) == (before, ())


def test_the_operators_stop_while_the_disk_takes_nothing_is_kept_through_retries() -> None:
    stopped, commands = advance(state_in(Phase.STALLED), ForceStopped(10.0, "operator"))
    assert commands == (StopForce(),)
    again, _ = advance(stopped, WriteFailed(9.0, "still full", (LEFT,)))
    assert shown(advance(again, WriteCompleted(11.0))[1]) == PausePage(force_off=True, held="force")


def test_an_end_while_the_disk_takes_nothing_is_over_and_not_written() -> None:
    ended, commands = advance(state_in(Phase.STALLED), EndAsked(10.0, "withdrawn", ""))
    assert [type(command) for command in commands] == [ShowPage]
    assert isinstance(shown(commands), EndPage)
    assert ended.over
    with pytest.raises(SessionError, match="over"):
        advance(ended, EndAsked(11.0, "withdrawn", ""))
    assert advance(ended, WriteCompleted(12.0))[0].phase is Phase.ENDED


def test_a_language_that_the_study_is_not_written_in_is_refused(protocol: Protocol) -> None:
    with pytest.raises(SessionError, match="written in en"):
        open_session(protocol, build_schedule(protocol, "P001", 1), {}, "nl")


def test_nothing_that_is_printed_names_a_condition_a_liquid_or_a_delay() -> None:
    state, printed = small.opened(), []
    while state.phase not in FINAL:
        state, commands = advance(state, small.next_event(state, 1.0))
        page = shown(commands)
        printed.append(f"{state!r} {commands!r} {page!r} {page}")
        printed += [str(command.fields) for command in commands if isinstance(command, Write)]
    text = " ".join(printed)
    words = ["is_thin", "is_thick", "on_time", "is_late", "0.137", "137", "1013", "1450"]
    assert [word for word in words if word in text] == []


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

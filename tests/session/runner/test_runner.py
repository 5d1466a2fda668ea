"""The runner in a world of fakes: what it asks of whom, in which order, and what it makes of samples and buttons."""

from collections import Counter
from typing import Any

import pytest

from study_app.errors import ServoFault, SessionError, StoreError
from study_app.haptics.model.layout import BUTTON_STOP
from study_app.session.device_buttons import CONTINUE
from study_app.session.pages import EndPage, PausePage, QuestionnairePage, TaskPage, TroublePage
from study_app.session.runner import RETRY_S
from study_app.session.transitions.events import (
    Begin,
    Chosen,
    Continue,
    EndRequested,
    ForceStopped,
    ItemShown,
    Note,
    PauseRequested,
    RepeatRequested,
    ResumeRequested,
    Submitted,
)
from study_app.session.transitions.state import Phase
from study_app.session.transitions.steps import END_SHOWN_S
from study_app.session.trial import SETTLED_S
from tests.session.fakes import AWAY, LEFT, RIGHT, World, at_block, step


def test_a_whole_session_runs_from_device_samples_and_answers_to_its_end(world: World) -> None:
    world.runner.post(Begin(0.0))
    for _ in range(400):
        if world.runner.finished:
            break
        step(world)
    assert world.journal.status == "completed"
    assert isinstance(world.pages[-1], EndPage)
    assert len(world.journal.of("trial_ended")) == 6
    assert sum(len(line["items"]) for line in world.journal.of("responses")) == 8


def test_an_answer_is_kept_before_the_page_it_leads_to_and_tables_follow_every_page(world: World) -> None:
    world = at_block("feeling")
    world.run(3.2)
    assert world.state.phase is Phase.ANSWERING
    for item in world.state.trial.items:
        world.runner.post(Chosen(9.0, item, 2))
    world.log.clear()
    tables = world.journal.tables_written
    world.runner.post(Submitted(9.5))
    assert world.log == ["responses", "trial_started", "TaskPage", "load"]
    assert world.journal.tables_written == tables + 1


def test_nothing_but_what_a_person_gave_waits_for_the_disk() -> None:
    world = at_block("seeing")
    world.runner.post(Note(world.clock(), "mark", ""))
    world.runner.post(Note(world.clock(), "note", "tired"))
    world.runner.post(PauseRequested(world.clock(), "operator"))
    world.runner.post(ResumeRequested(world.clock(), "operator"))
    world.runner.post(RepeatRequested(world.clock(), "a sneeze"))
    while not world.runner.finished:
        for item in world.state.trial.items if world.state.phase is Phase.ANSWERING else ():
            world.runner.post(ItemShown(world.clock(), item))
        step(world)
    waited = Counter(world.journal.waited)
    assert waited == Counter(
        line["event"]
        for line in world.journal.lines
        if line["event"] in {"choice", "responses", "repeat"}
        or (line["event"], line.get("page", line.get("kind"))) in {("page_left", "welcome"), ("note", "note")}
    )
    assert waited["choice"] > 0
    assert len(world.journal.of("target_reached")) > 0


def test_a_page_that_answers_while_it_is_presented_is_heard_after_the_commands_under_way(world: World) -> None:
    kept_at_once: list[Any] = []

    def answer(page: Any) -> None:
        if isinstance(page, QuestionnairePage):
            for item in page.items:
                world.runner.post(ItemShown(1.0, item.id))
            kept_at_once.extend(world.journal.of("item_shown"))

    world = at_block("feeling")
    world.on_page = answer
    world.run(3.2)
    assert kept_at_once == []
    assert [line["item"] for line in world.journal.of("item_shown")] == ["liquid", "strong", "spare"]


def test_what_cannot_happen_is_refused_and_the_session_goes_on(world: World) -> None:
    world.runner.post(Begin(0.0))
    before = world.state
    with pytest.raises(SessionError):
        world.runner.post(Submitted(1.0))
    assert world.state == before
    world.runner.post(Continue(2.0))
    assert world.state.phase is Phase.TASK


def test_an_exploration_goes_on_until_its_longest_time_and_not_by_the_space_bar_before_its_least(
    practising: World,
) -> None:
    practising.run(0.9)
    practising.runner.post(Continue(0.9))
    practising.run(0.5)
    assert practising.state.phase is Phase.TASK
    practising.runner.post(Continue(1.4))
    practising.run(END_SHOWN_S + SETTLED_S)
    assert practising.log[:3] == ["rest", "trial_ended", "trial_started"]
    (ended,) = practising.journal.of("trial_ended")
    assert ended["outcome"] == "complete"
    assert ended["duration_s"] == pytest.approx(1.399)


def test_samples_from_before_the_scene_was_in_force_do_not_count(practising: World) -> None:
    practising.servo.scene = 0
    practising.run(5.0)
    assert practising.runner.task.elapsed_s == 0.0
    practising.servo.scene = 1
    practising.run(3.2)
    assert practising.journal.of("trial_ended")[0]["duration_s"] == pytest.approx(3.0)


def test_every_target_that_is_reached_is_kept_at_once() -> None:
    world = at_block("seeing")
    before = len(world.journal.of("target_reached"))
    world.run(0.3, LEFT)
    reached = world.journal.of("target_reached")[before:]
    assert [(line["trial"], line["target"], line["t_task_s"]) for line in reached] == [
        (world.state.trial.number, 0, pytest.approx(0.25))
    ]


def test_what_is_drawn_is_as_old_as_the_trial_asks() -> None:
    world = at_block("seeing", delayed=True)
    world.run(0.2, AWAY)
    world.run(0.1, LEFT)
    now = world.servo.now_ns()
    late = world.runner.view(now)
    assert late.sample_time_ns == now - 139_000_000
    assert tuple(late.position_m) == AWAY
    assert late.task.dwell == 0.0
    assert world.runner.task.dwell == pytest.approx(0.099 / 0.25)
    world.run(0.139, LEFT)
    seen = world.runner.view(world.servo.now_ns())
    assert tuple(seen.position_m) == LEFT
    assert seen.task.dwell == pytest.approx(0.099 / 0.25)


def test_without_a_trial_nothing_is_to_be_drawn(world: World) -> None:
    world.runner.post(Begin(0.0))
    assert world.runner.view(0) is None
    assert world.runner.task is None
    world.runner.frame_shown(1, 0)  # a last frame may still be on its way


@pytest.mark.parametrize("seed", range(4))
def test_a_task_is_left_when_its_end_was_drawn_as_late_as_it_may_be_in_its_block(seed: int) -> None:
    """Whatever the delay of the trial: else the time between task and questionnaire would tell it."""
    world = at_block("seeing", seed=seed)
    world.run(0.3, LEFT)
    world.run(0.251, RIGHT)
    assert world.runner.task.reached == 2
    world.run(0.136 + SETTLED_S + END_SHOWN_S, RIGHT)
    assert world.state.phase is Phase.TASK
    world.run(0.001, RIGHT)
    assert world.state.phase is Phase.ANSWERING
    assert world.journal.of("trial_ended")[-1]["duration_s"] == pytest.approx(0.55, abs=0.002)


def test_button_four_stops_the_force_before_anything_is_written(practising: World) -> None:
    practising.run(0.5, buttons=BUTTON_STOP)
    assert practising.log[0] == "stop_force"
    assert practising.log.index("rest") < practising.log.index("force_stopped") < practising.log.index("PausePage")
    assert not practising.servo.force_is_on
    assert practising.journal.of("force_stopped")[0]["by"] == "device"
    assert practising.pages[-1] == PausePage(force_off=True)


def test_a_force_stop_reaches_the_servo_even_where_the_session_cannot_take_it(world: World) -> None:
    with pytest.raises(SessionError):
        world.runner.post(ForceStopped(0.0, "operator"))
    assert world.log == ["stop_force"]


def test_the_first_button_goes_on_neither_from_a_consent_nor_from_a_task(world: World) -> None:
    world.runner.post(Begin(0.0))
    world.run(0.1, buttons=CONTINUE)
    assert world.state.phase is Phase.READING  # a squeeze of the grip is no consent
    world.run(0.1)
    world.runner.post(Continue(0.2))
    world.run(0.1)
    world.run(1.5, buttons=CONTINUE)
    assert world.state.phase is Phase.TASK  # the least time is over, but a squeeze is not a key


@pytest.mark.slow
def test_a_button_held_down_is_one_press(world: World) -> None:
    world = at_block("seeing")
    for _ in range(30):
        if world.state.phase is Phase.READING:
            break
        step(world)
    assert world.state.phase is Phase.READING
    world.run(0.1, buttons=CONTINUE)
    assert world.runner.finished
    again = at_block("seeing")
    for _ in range(30):
        if again.state.phase is Phase.READING:
            break
        step(again)
        again.servo.run(0.01, buttons=CONTINUE)
    again.run(0.1, buttons=CONTINUE)  # pressed before the page was there
    assert again.state.phase is Phase.READING


def test_a_fault_of_the_servo_is_kept_once_and_calls_the_operator(practising: World) -> None:
    practising.run(0.5)
    practising.servo.fault = "the device 'scripted' stopped responding"
    practising.run(0.1)
    practising.run(0.1)
    assert practising.journal.of("broke") == [
        {"event": "broke", "t_s": pytest.approx(0.6), "what": "the device 'scripted' stopped responding"}
    ]
    assert isinstance(practising.pages[-1], TroublePage)
    assert practising.log[0] == "stop_force"
    practising.runner.post(EndRequested(2.0, "aborted", "cable"))
    assert practising.journal.status == "broken"


def test_a_servo_that_refuses_a_scene_calls_the_operator(world: World) -> None:
    world.runner.post(Begin(0.0))
    world.servo.refuses = ServoFault("the device is gone")
    world.runner.post(Continue(1.0))
    assert world.state.phase is Phase.TROUBLE
    assert world.journal.of("broke")[0]["what"] == "the device is gone"
    assert not world.servo.force_is_on


def test_listeners_hear_every_event_that_was_taken(world: World) -> None:
    phases: list[Phase] = []
    world.runner.on_change(lambda state: phases.append(state.phase))
    world.runner.post(Begin(0.0))
    world.runner.post(Note(0.5, "mark", ""))
    with pytest.raises(SessionError):
        world.runner.post(Submitted(0.6))
    world.runner.post(Continue(1.0))
    assert phases == [Phase.READING, Phase.READING, Phase.TASK]


def stall(world: World) -> None:
    """Let the disk take nothing from now on."""
    world.journal.fails_after = len(world.journal.lines)


def wait_for_the_disk(world: World) -> None:
    world.journal.fails_after = None
    world.run(RETRY_S + 0.01)


def test_a_full_disk_stops_the_force_shows_a_calm_page_and_tells_the_operator(practising: World) -> None:
    stall(practising)
    told: list[str | None] = []
    practising.runner.on_change(lambda _state: told.append(practising.runner.stalled))
    practising.run(3.2)
    assert practising.runner.stalled == "disk full"
    assert told == ["disk full"]
    assert not practising.servo.force_is_on
    assert practising.servo.scene == 0
    assert isinstance(practising.pages[-1], TroublePage)
    assert "disk" not in practising.pages[-1].paragraph
    assert not any(isinstance(page, TaskPage) and page.trial == 2 for page in practising.pages)


def test_lines_that_cannot_be_flushed_in_the_background_stall_the_session_until_they_are(practising: World) -> None:
    practising.run(0.1)
    practising.journal.unflushed = "no flush"
    practising.run(0.1)
    assert practising.runner.stalled == "no flush"
    assert not practising.servo.force_is_on
    assert isinstance(practising.pages[-1], TroublePage)
    practising.run(RETRY_S + 0.01)
    assert practising.runner.stalled == "no flush"
    practising.journal.unflushed = None
    practising.run(RETRY_S + 0.01)
    assert practising.runner.stalled is None
    assert practising.pages[-1] == PausePage(force_off=True)
    assert practising.journal.of("trial_ended")[-1]["outcome"] == "interrupted"


def test_a_program_that_stands_still_between_two_trials_says_so() -> None:
    world = at_block("feeling")
    world.run(3.2)
    assert world.state.phase is Phase.ANSWERING
    for seconds in (0.02, 2.9, 0.02, 5.0, 0.02):
        world.run(seconds)
    (note,) = world.journal.of("note")
    assert (note["kind"], note["text"]) == ("note", "the program stood still for 5.0 s")


def test_when_the_disk_takes_data_again_all_is_kept_in_order_and_once_and_the_session_is_paused() -> None:
    undisturbed, world = at_block("feeling"), at_block("feeling")
    for each in (undisturbed, world):
        each.run(3.2)
        for item in each.state.trial.items:
            each.runner.post(Chosen(9.0, item, 2))
    stall(world)
    for each in (undisturbed, world):
        each.runner.post(Submitted(9.5))
    world.run(RETRY_S + 0.01)
    assert world.runner.stalled == "disk full"
    wait_for_the_disk(world)
    assert world.runner.stalled is None
    assert world.state.phase is Phase.PAUSED
    assert world.pages[-1] == PausePage(force_off=True)
    before = len(undisturbed.journal.lines)
    assert world.journal.lines[:before] == undisturbed.journal.lines
    after = [(line["event"], line.get("by", line.get("outcome"))) for line in world.journal.lines[before:]]
    assert after == [("trial_ended", "interrupted"), ("force_stopped", "program"), ("paused", "program")]
    world.runner.post(ResumeRequested(20.0, "operator"))
    assert world.servo.force_is_on
    assert world.state.phase is Phase.TASK
    assert world.state.attempt == 2


def test_a_choice_that_met_a_full_disk_is_there_after_the_pause() -> None:
    world = at_block("feeling")
    world.run(3.2)
    stall(world)
    item = world.state.trial.items[0]
    world.runner.post(Chosen(9.0, item, 6))
    with pytest.raises(SessionError, match="disk full"):
        world.runner.post(Submitted(9.1))
    wait_for_the_disk(world)
    world.runner.post(ResumeRequested(20.0, "operator"))
    assert world.pages[-1].chosen == ((item, 6),)
    assert [line["value"] for line in world.journal.of("choice")] == [6]


def test_what_a_page_says_that_is_covered_again_at_once_is_not_taken() -> None:
    world = at_block("feeling")
    world.run(3.2)
    for item in world.state.trial.items:
        world.runner.post(Chosen(9.0, item, 2))
    stall(world)
    world.runner.post(Submitted(9.5))
    world.on_page = lambda page: world.runner.post(Note(10.0, "mark", type(page).__name__))
    wait_for_the_disk(world)
    assert [type(page) for page in world.pages[-2:]] == [TaskPage, PausePage]
    assert [line["text"] for line in world.journal.of("note")] == ["PausePage"]


def test_every_target_of_a_look_is_kept_however_long_the_disk_was_full() -> None:
    world = at_block("seeing")
    before = len(world.journal.of("target_reached"))
    stall(world)
    world.servo.run(0.3, LEFT)
    world.run(0.3, RIGHT)
    assert isinstance(world.pages[-1], TroublePage)
    wait_for_the_disk(world)
    assert [line["target"] for line in world.journal.of("target_reached")[before:]] == [0, 1]
    assert world.journal.of("trial_ended")[-1]["targets_reached"] == 2


def test_the_operators_stop_while_the_disk_is_full_is_not_the_participants_to_undo(practising: World) -> None:
    stall(practising)
    practising.runner.post(Note(1.0, "mark", ""))
    practising.runner.post(ForceStopped(1.1, "operator"))
    practising.run(RETRY_S + 0.01)  # in vain once
    assert practising.runner.stalled == "disk full"
    wait_for_the_disk(practising)
    assert practising.pages[-1] == PausePage(force_off=True, held="force")
    with pytest.raises(SessionError, match="the operator resumes it"):
        practising.runner.post(ResumeRequested(9.0, "participant"))
    assert not practising.servo.force_is_on
    practising.runner.post(ResumeRequested(9.1, "operator"))
    assert practising.servo.force_is_on


def test_the_force_can_be_stopped_while_the_disk_is_full(practising: World) -> None:
    stall(practising)
    practising.runner.post(Note(1.0, "mark", ""))
    practising.servo.force_is_on = True
    practising.runner.post(ForceStopped(1.1, "participant"))
    assert not practising.servo.force_is_on


def test_buttons_answer_nothing_while_the_disk_is_full(world: World) -> None:
    world.runner.post(Begin(0.0))
    stall(world)
    world.runner.post(Note(1.0, "mark", ""))
    world.run(0.1)
    world.run(0.1, buttons=CONTINUE)
    assert world.state.stall is not None
    assert world.state.stall.before is Phase.READING


def test_a_session_that_is_ended_with_a_full_disk_ends_and_stays_unfinished(practising: World) -> None:
    stall(practising)
    practising.runner.post(Note(1.0, "mark", ""))
    with pytest.raises(StoreError, match="resume it later"):
        practising.runner.post(EndRequested(2.0, "aborted", ""))
    assert practising.runner.finished
    assert isinstance(practising.pages[-1], EndPage)
    assert practising.journal.status is None


def test_a_session_that_is_ended_when_there_is_space_again_is_finished(practising: World) -> None:
    stall(practising)
    practising.runner.post(Note(1.0, "mark", ""))
    practising.journal.fails_after = None
    practising.runner.post(EndRequested(2.0, "withdrawn", ""))
    assert practising.journal.status == "withdrawn"
    assert [line["event"] for line in practising.journal.lines[-4:]] == [
        "note",
        "trial_ended",
        "force_stopped",
        "paused",
    ]


def test_an_end_whose_receipt_fails_is_an_end_and_is_tried_again(practising: World) -> None:
    practising.journal.finish_fails = True
    practising.runner.post(EndRequested(1.0, "withdrawn", ""))
    assert practising.runner.finished
    assert practising.runner.stalled == "no room for the receipt"
    assert isinstance(practising.pages[-1], EndPage)
    practising.journal.finish_fails = False
    practising.run(RETRY_S + 0.01)
    assert practising.runner.stalled is None
    assert isinstance(practising.pages[-1], EndPage)

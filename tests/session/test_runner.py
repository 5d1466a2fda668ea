"""The runner in a world of fakes: what it asks of whom, in which order, and what it makes of samples and buttons."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest

from study_app.errors import ServoFault, SessionError, StoreError
from study_app.haptics.layout import LIMITER_GLITCH
from study_app.session.events import (
    Begin,
    Chosen,
    Continue,
    EndAsked,
    ForceStopped,
    ItemShown,
    Note,
    PauseAsked,
    RepeatAsked,
    ResumeAsked,
    Submitted,
)
from study_app.session.moves import END_SHOWN_S
from study_app.session.pages import EndPage, PausePage, QuestionnairePage, TaskPage, TroublePage
from study_app.session.runner import BUTTON_CONTINUE, BUTTON_STOP, RETRY_S
from study_app.session.state import Phase
from study_app.session.trial import SETTLED_S
from tests.session.fakes import World

LEFT, RIGHT, AWAY = (-0.02, 0.0, 0.0), (0.02, 0.0, 0.0), (0.0, 0.01, 0.0)


@pytest.fixture
def world() -> World:
    return World()


@pytest.fixture
def practising(world: World) -> World:
    """Return a world in the practice: an exploration of 1 to 3 s without a questionnaire."""
    world.runner.post(Begin(0.0))
    world.runner.post(Continue(0.0))
    world.log.clear()
    return world


def at_block(block: str, *, delayed: bool = False, seed: int = 1) -> World:
    """Return a world at the beginning of a trial of ``block``."""
    world = World(seed)
    world.runner.post(Begin(0.0))
    for _ in range(200):
        state = world.state
        there = state.phase is Phase.TASK and state.trial.block == block
        if there and (not delayed or state.plan.protocol.delay_s(state.plan.condition(state.trial)) > 0):
            return world
        step(world)
    raise AssertionError(block)


def step(world: World) -> None:
    state = world.state
    if state.phase is Phase.READING:
        world.runner.post(Continue(world.clock()))
    elif state.phase is Phase.ANSWERING:
        for item in state.trial.items:
            world.runner.post(Chosen(world.clock(), item, 4))
        world.runner.post(Submitted(world.clock()))
    else:
        world.run(0.3, LEFT)
        if (world.state.phase, world.state.index) == (state.phase, state.index):
            world.run(0.3, RIGHT)


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
    world.runner.post(PauseAsked(world.clock(), "operator"))
    world.runner.post(ResumeAsked(world.clock(), "operator"))
    world.runner.post(RepeatAsked(world.clock(), "a sneeze"))
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


def test_lines_carry_the_time_of_the_event_they_tell(world: World) -> None:
    world.runner.post(Begin(12.5))
    assert world.journal.lines[-1]["t_s"] == 12.5


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


def unpainted(recorder: Any = None) -> World:
    """Return a world whose practice was asked for two seconds ago, and no frame of its tank was painted."""
    world = World(recorder=recorder)
    world.paints = False
    world.runner.post(Begin(0.0))
    world.runner.post(Continue(0.0))
    world.run(2.0)
    return world


def test_force_task_and_recording_begin_with_the_first_painted_frame_of_the_tank() -> None:
    tape = Tape()
    world = unpainted(tape)
    assert "load" not in world.log
    assert tape.told == []
    assert world.runner.task.elapsed_s == 0.0
    assert world.runner.view(world.servo.now_ns()).task.elapsed_s == 0.0
    world.runner.post(Continue(2.0))  # there is nothing to leave yet, though the exploration lasts 1 s at least
    world.runner.frame_shown(world.servo.now_ns(), world.servo.now_ns())
    assert world.log[-1] == "load"
    world.run(1.4)
    assert world.runner.task.elapsed_s == pytest.approx(1.399)
    world.run(1.8)
    (row,) = world.journal.of("trial_ended")
    assert row["duration_s"] == pytest.approx(3.0)
    assert row["ticks"] == 3001
    assert row["first_frame_gap_ms"] == pytest.approx(2000)
    assert recorded(tape)[0][0] == 2000 - 600 + 1


def test_a_trial_that_is_paused_before_its_first_frame_was_neither_felt_nor_recorded() -> None:
    tape = Tape()
    world = unpainted(tape)
    world.runner.post(PauseAsked(2.0, "operator"))
    (row,) = world.journal.of("trial_ended")
    assert (row["outcome"], row["duration_s"], row["ticks"], row["first_frame_gap_ms"]) == ("interrupted", 0, 0, None)
    assert row["samples_dropped"] == 0
    assert tape.told == []
    world.runner.frame_shown(1, 0)  # the last frame of a tank that is gone
    world.runner.post(ResumeAsked(3.0, "operator"))
    assert "load" not in world.log


def test_every_target_that_is_reached_is_kept_at_once() -> None:
    world = at_block("seeing")
    before = len(world.journal.of("target_reached"))
    world.run(0.3, LEFT)
    reached = world.journal.of("target_reached")[before:]
    assert [(line["trial"], line["target"], line["t_task_s"]) for line in reached] == [
        (world.state.trial.number, 0, pytest.approx(0.25))
    ]


def test_a_sample_that_was_refused_at_the_door_changes_nothing_but_its_own_count() -> None:
    worlds = at_block("seeing"), at_block("seeing")
    for world, position_m, limiters in zip(worlds, (LEFT, (1.0, 1.0, 1.0)), (0, LIMITER_GLITCH), strict=True):
        world.servo.run(0.1, LEFT)
        world.servo.run(0.001, position_m, limiters=limiters)
        world.run(0.199, LEFT)
        world.run(0.5, RIGHT)
    spared, glitched = worlds
    assert [line["t_task_s"] for line in glitched.journal.of("target_reached")] == [
        line["t_task_s"] for line in spared.journal.of("target_reached")
    ]
    spared_row, row = (world.journal.of("trial_ended")[-1] for world in worlds)
    assert row["path_length_m"] == pytest.approx(0.04)
    assert row == spared_row | {"limiter_glitch": 1}


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


def test_the_end_of_a_delayed_task_is_drawn_before_it_is_left() -> None:
    world = at_block("seeing", delayed=True)
    world.run(0.3, LEFT)
    world.run(0.251, RIGHT)
    end_ns = world.servo.now_ns()
    assert world.runner.view(end_ns).task.reached == 1
    world.run(0.138, RIGHT)
    assert world.runner.view(end_ns + 139_000_000).task.reached == 2


def test_the_row_of_a_trial_holds_the_error_of_the_delay_and_never_the_delay() -> None:
    world = at_block("seeing", delayed=True)
    for error_ms in (0, 5, 10, 40):
        world.servo.run(0.05, LEFT)
        now = world.servo.now_ns()
        world.runner.frame_shown(now + error_ms * 1_000_000, world.runner.view(now).sample_time_ns)
    world.run(0.1, LEFT)
    world.run(0.5, RIGHT)
    row = world.journal.of("trial_ended")[-1]
    assert (row["frames"], row["frames_late"]) == (5, 1)  # the study allows 25 ms
    assert row["delay_error_mean_ms"] == pytest.approx((4 * (13.75 + 1000 * SETTLED_S) - 137) / 5)
    assert row["delay_error_max_ms"] == pytest.approx(40 + 1000 * SETTLED_S)
    assert 137 not in [round(value) for value in row.values() if isinstance(value, float)]


def test_no_line_of_a_delayed_trial_names_condition_liquid_or_delay(world: World) -> None:
    world.runner.post(Begin(0.0))
    while not world.runner.finished:
        step(world)
    text = repr(world.journal.lines) + repr(world.pages) + repr(world.state)
    assert [word for word in ("is_late", "on_time", "is_thin", "is_thick", "0.137", "1013.7") if word in text] == []


def test_the_row_of_a_trial_sums_up_force_path_and_limiters(practising: World) -> None:
    practising.servo.run(1.0, (0.0, 0.0, 0.0), device_force_n=(3.0, 0.0, 4.0), limiters=0b1001)
    practising.servo.run(1.0, (0.03, 0.04, 0.0), device_force_n=(0.0, 0.0, 1.0), lateness_ns=2_000_000)
    practising.run(1.2, (0.0, 0.0, 0.0))
    (row,) = practising.journal.of("trial_ended")
    assert row["ticks"] == 3001
    assert row["tick_rate_hz"] == pytest.approx(1000)
    assert row["path_length_m"] == pytest.approx(0.1)
    assert row["mean_speed_mps"] == pytest.approx(0.1 / 3, abs=1e-6)
    assert row["force_mean_n"] == pytest.approx((5 * 1000 + 1 * 1000) / 3001, abs=1e-6)
    assert row["force_peak_n"] == pytest.approx(5)
    assert (row["limiter_slope"], row["limiter_norm"], row["limiter_slew"]) == (1000, 1000, 0)
    assert row["lateness_p99_ms"] == pytest.approx(2)
    assert (row["frames"], row["first_frame_gap_ms"], row["worst_frame_gap_ms"]) == (1, 0.0, None)


def test_the_row_of_a_trial_holds_the_share_of_the_force_withheld_in_its_task(practising: World) -> None:
    practising.servo.scene = 0
    practising.servo.run(0.5, permitted_n=9.0, withheld_n=9.0)  # before the task
    practising.servo.scene = 1
    practising.servo.run(1.0, permitted_n=4.0, withheld_n=0.5)
    practising.servo.run(1.0, permitted_n=2.0)
    practising.servo.run(1.001)
    practising.run(0.2, permitted_n=9.0, withheld_n=9.0)  # after it
    (row,) = practising.journal.of("trial_ended")
    assert row["withheld_share"] == pytest.approx(0.5 / 6, abs=1e-6)


def test_a_trial_without_force_has_no_share_withheld(practising: World) -> None:
    practising.run(3.2)
    assert practising.journal.of("trial_ended")[0]["withheld_share"] is None


def test_the_row_of_a_trial_says_that_the_loops_delay_changed(practising: World) -> None:
    practising.run(0.5, delay_ticks=1)
    for _ in range(2):
        practising.run(0.5, delay_ticks=3)
        practising.run(0.5, delay_ticks=2)
    practising.run(0.7, delay_ticks=2)
    practising.run(3.2, delay_ticks=2)
    rows = practising.journal.of("trial_ended")
    assert [(row["loop_delay_ticks"], row["loop_delay_changes"]) for row in rows] == [(3, 4), (2, 0)]


def test_samples_that_were_lost_are_counted_for_their_trial_alone(practising: World) -> None:
    practising.servo.telemetry.dropped = 7
    practising.run(3.2)
    assert practising.journal.of("trial_ended")[0]["samples_dropped"] == 7
    practising.run(3.2)
    assert practising.journal.of("trial_ended")[1]["samples_dropped"] == 0


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


def test_an_interrupted_attempt_keeps_what_was_measured_and_the_trial_starts_again(practising: World) -> None:
    practising.run(0.8)
    practising.runner.post(PauseAsked(0.8, "operator"))
    (first,) = practising.journal.of("trial_ended")
    assert (first["attempt"], first["outcome"], first["ticks"]) == (1, "interrupted", 800)
    practising.run(5.0)  # a pause is no exploration
    practising.runner.post(ResumeAsked(5.8, "operator"))
    assert practising.servo.scene == 2
    practising.run(3.2)
    second = practising.journal.of("trial_ended")[-1]
    assert (second["attempt"], second["outcome"], second["ticks"]) == (2, "complete", 3001)


def test_resuming_after_a_force_stop_fades_the_force_in(practising: World) -> None:
    practising.run(0.1, buttons=BUTTON_STOP)
    practising.runner.post(ResumeAsked(1.0, "operator"))
    assert practising.servo.force_is_on
    assert practising.log.index("fade_in") < practising.log.index("load")


def test_a_repeated_trial_keeps_both_attempts(practising: World) -> None:
    practising.run(0.5)
    practising.runner.post(RepeatAsked(0.5, "a sneeze"))
    practising.run(3.2)
    ended = practising.journal.of("trial_ended")
    assert [(line["attempt"], line["outcome"]) for line in ended] == [(1, "interrupted"), (2, "complete")]
    assert practising.journal.of("repeat") == [
        {"event": "repeat", "t_s": 0.5, "trial": 1, "reason": "a sneeze"},
    ]


def test_the_first_button_goes_on_neither_from_a_consent_nor_from_a_task(world: World) -> None:
    world.runner.post(Begin(0.0))
    world.run(0.1, buttons=BUTTON_CONTINUE)
    assert world.state.phase is Phase.READING  # a squeeze of the grip is no consent
    world.run(0.1)
    world.runner.post(Continue(0.2))
    world.run(0.1)
    world.run(1.5, buttons=BUTTON_CONTINUE)
    assert world.state.phase is Phase.TASK  # the least time is over, but a squeeze is not a key


def test_a_button_held_down_is_one_press(world: World) -> None:
    world = at_block("seeing")
    for _ in range(30):
        if world.state.phase is Phase.READING:
            break
        step(world)
    assert world.state.phase is Phase.READING
    world.run(0.1, buttons=BUTTON_CONTINUE)
    assert world.runner.finished
    again = at_block("seeing")
    for _ in range(30):
        if again.state.phase is Phase.READING:
            break
        step(again)
        again.servo.run(0.01, buttons=BUTTON_CONTINUE)
    again.run(0.1, buttons=BUTTON_CONTINUE)  # pressed before the page was there
    assert again.state.phase is Phase.READING


def test_a_fault_of_the_servo_is_kept_once_and_calls_the_operator(practising: World) -> None:
    practising.run(0.5)
    practising.servo.fault = "the device 'scripted' stopped answering"
    practising.run(0.1)
    practising.run(0.1)
    assert practising.journal.of("broke") == [
        {"event": "broke", "t_s": pytest.approx(0.6), "what": "the device 'scripted' stopped answering"}
    ]
    assert isinstance(practising.pages[-1], TroublePage)
    assert practising.log[0] == "stop_force"
    practising.runner.post(EndAsked(2.0, "aborted", "cable"))
    assert practising.journal.status == "broken"


def test_a_servo_that_refuses_a_scene_calls_the_operator(world: World) -> None:
    world.runner.post(Begin(0.0))
    world.servo.refuses = ServoFault("the device is gone")
    world.runner.post(Continue(1.0))
    assert world.state.phase is Phase.TROUBLE
    assert world.journal.of("broke")[0]["what"] == "the device is gone"
    assert not world.servo.force_is_on


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
    world.runner.post(ResumeAsked(20.0, "operator"))
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
    world.runner.post(ResumeAsked(20.0, "operator"))
    assert world.pages[-1].chosen == ((item, 6),)
    assert [line["value"] for line in world.journal.of("choice")] == [6]


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
        practising.runner.post(ResumeAsked(9.0, "participant"))
    assert not practising.servo.force_is_on
    practising.runner.post(ResumeAsked(9.1, "operator"))
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
    world.run(0.1, buttons=BUTTON_CONTINUE)
    assert world.state.phase is Phase.READING


def test_a_session_that_is_ended_with_a_full_disk_ends_and_stays_unfinished(practising: World) -> None:
    stall(practising)
    practising.runner.post(Note(1.0, "mark", ""))
    with pytest.raises(StoreError, match="resume it later"):
        practising.runner.post(EndAsked(2.0, "aborted", ""))
    assert practising.runner.finished
    assert isinstance(practising.pages[-1], EndPage)
    assert practising.journal.status is None


def test_a_session_that_is_ended_when_there_is_space_again_is_finished(practising: World) -> None:
    stall(practising)
    practising.runner.post(Note(1.0, "mark", ""))
    practising.journal.fails_after = None
    practising.runner.post(EndAsked(2.0, "withdrawn", ""))
    assert practising.journal.status == "withdrawn"
    assert [line["event"] for line in practising.journal.lines[-4:]] == [
        "note",
        "trial_ended",
        "force_stopped",
        "paused",
    ]


def test_an_end_whose_receipt_fails_is_an_end_and_is_tried_again(practising: World) -> None:
    practising.journal.finish_fails = True
    practising.runner.post(EndAsked(1.0, "withdrawn", ""))
    assert practising.runner.finished
    assert practising.runner.stalled == "no room for the receipt"
    assert isinstance(practising.pages[-1], EndPage)
    practising.journal.finish_fails = False
    practising.run(RETRY_S + 0.01)
    assert practising.runner.stalled is None
    assert isinstance(practising.pages[-1], EndPage)


class Tape:
    """A recorder that is all memory: what came in which order."""

    def __init__(self) -> None:
        self.told: list[Any] = []

    def start(self, trial: int, attempt: int, rate_hz: float) -> None:
        self.told.append(("start", trial, attempt, rate_hz))

    def append(self, samples: Any) -> None:
        self.told.append(samples)

    def frame(self, painted_ns: int, sample_ns: int) -> None:
        self.told.append(("frame", painted_ns, sample_ns))

    def stop(self) -> None:
        self.told.append(("stop",))


def recorded(tape: Tape) -> list[list[int]]:
    """Return the ticks of each recording."""
    found: list[list[int]] = []
    for told in tape.told:
        if isinstance(told, tuple) and told[0] == "start":
            found.append([])
        elif not isinstance(told, tuple):
            found[-1] += told["tick"].tolist()
    return found


def test_every_turn_of_a_trial_is_recorded_and_those_shortly_before_it() -> None:
    tape = Tape()
    world = World(recorder=tape)
    world.runner.post(Begin(0.0))
    for _ in range(10):
        world.run(0.5)
    world.runner.post(Continue(world.clock()))
    for _ in range(8):
        world.run(0.4)
    world.run(0.05)
    first, second = recorded(tape)
    assert first == list(range(5000 - 600 + 1, 5000 + 3200 + 1))  # until it was left, after its end was shown
    assert second == list(range(8200 - 600 + 1, 8250 + 1))
    assert [told for told in tape.told if isinstance(told, tuple) and told[0] != "frame"] == [
        ("start", 1, 1, 1000.0),
        ("stop",),
        ("start", 2, 1, 1000.0),
    ]


def test_frames_are_recorded_with_their_trial_and_attempts_have_recordings_of_their_own() -> None:
    tape = Tape()
    world = World(recorder=tape)
    world.runner.post(Begin(0.0))
    world.runner.frame_shown(1, 0)
    world.runner.post(Continue(0.0))
    world.run(0.5)
    world.runner.frame_shown(500, 400)
    world.runner.post(PauseAsked(0.5, "operator"))
    world.run(0.5)
    world.runner.post(ResumeAsked(1.0, "operator"))
    told = [told for told in tape.told if isinstance(told, tuple)]
    first = [("start", 1, 1, 1000.0), ("frame", 0, 0), ("frame", 500, 400), ("stop",)]
    assert told == [*first, ("start", 1, 2, 1000.0), ("frame", 10**9, 10**9)]


def test_a_trial_with_a_late_screen_or_a_late_servo_says_so(practising: World) -> None:
    for _ in range(20):
        now = practising.servo.now_ns()
        practising.runner.frame_shown(now + 90_000_000, now)
    practising.run(1.0)
    practising.servo.ticks += 150  # the servo stood still
    practising.run(2.2, lateness_ns=5_000_000)
    (row,) = practising.journal.of("trial_ended")
    assert row["delay_error_p95_ms"] == pytest.approx(90)
    assert row["frames_late"] == 20
    assert row["lateness_p99_ms"] == pytest.approx(5)


def test_listeners_hear_every_event_that_was_taken(world: World) -> None:
    phases: list[Phase] = []
    world.runner.on_change(lambda state: phases.append(state.phase))
    world.runner.post(Begin(0.0))
    world.runner.post(Note(0.5, "mark", ""))
    with pytest.raises(SessionError):
        world.runner.post(Submitted(0.6))
    world.runner.post(Continue(1.0))
    assert phases == [Phase.READING, Phase.READING, Phase.TASK]

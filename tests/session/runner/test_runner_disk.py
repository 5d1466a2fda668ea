"""The runner while the disk takes no data: the force is off, nothing is lost, and the session pauses."""

import pytest

from study_app.errors import SessionError, StoreError
from study_app.session.device_buttons import CONTINUE
from study_app.session.pages import EndPage, PausePage, TaskPage, TroublePage
from study_app.session.runner import RETRY_S
from study_app.session.transitions.events import Begin, Chosen, EndAsked, ForceStopped, Note, ResumeAsked, Submitted
from study_app.session.transitions.state import Phase
from tests.session.fakes import LEFT, RIGHT, World, at_block


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
    world.run(0.1, buttons=CONTINUE)
    assert world.state.stall is not None
    assert world.state.stall.before is Phase.READING


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

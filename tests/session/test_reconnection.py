"""A device that failed and was connected again: zero force until the operator resumes, then the next attempt."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pytest

from study_app.errors import DeviceLost, SessionError
from study_app.session.transitions.commands import Command, FadeIn, StartTrial, StopForce, Write
from study_app.session.transitions.events import Broke, PauseAsked, Reconnected, ResumeAsked, broken
from study_app.session.transitions.state import Phase
from study_app.session.transitions.table import advance
from study_app.store.journals.journal_events import CAUSE_WITHHELD
from study_app.store.tables import session_tables
from tests.faults.support.worlds import StoredWorld
from tests.session.transitions.states import state_in

FAULT = "the device 'memory' stopped responding"
AGAIN = Reconnected(30.0, {"name": "memory", "force_limit_n": 8.0})


@pytest.mark.parametrize("phase", [Phase.READING, Phase.TASK, Phase.ANSWERING])
def test_a_reconnected_device_pauses_without_force_and_the_operator_resumes_what_was_interrupted(phase: Phase) -> None:
    before = state_in(phase)
    trouble, _ = advance(before, Broke(20.0, FAULT, "device"))
    assert trouble.lost_device
    paused, commands = advance(trouble, AGAIN)
    assert isinstance(commands[0], StopForce)
    assert not any(isinstance(command, FadeIn | StartTrial) for command in commands)
    assert (paused.phase, paused.force_off, paused.answers) == (Phase.PAUSED, True, before.answers)
    with pytest.raises(SessionError, match="the operator resumes"):
        advance(paused, ResumeAsked(31.0, "participant"))
    resumed, commands = advance(paused, ResumeAsked(31.0, "operator"))
    assert (resumed.phase, resumed.force_off) == (phase, False)
    assert resumed.attempt == before.attempt + (phase is Phase.TASK)
    assert any(isinstance(command, FadeIn) for command in commands)


def test_a_device_that_fails_in_a_pause_goes_back_to_what_was_paused() -> None:
    paused, _ = advance(state_in(Phase.TASK), PauseAsked(9.0, "operator"))
    again, _ = advance(advance(paused, Broke(20.0, FAULT, "device"))[0], AGAIN)
    assert advance(again, ResumeAsked(31.0, "operator"))[0].phase is Phase.TASK


@pytest.mark.parametrize("failures", [["program"], ["program", "device"], ["device", "program"]], ids="-then-".join)
def test_a_failure_of_the_program_cannot_be_reconnected(failures: list[str]) -> None:
    state = state_in(Phase.TASK)
    for by in failures:
        state, _ = advance(state, Broke(20.0, "a bug", by))  # type: ignore[arg-type]
    with pytest.raises(SessionError, match="was not stopped by its device"):
        advance(state, AGAIN)


def test_a_session_that_broke_before_its_first_page_cannot_be_reconnected() -> None:
    trouble, _ = advance(state_in(Phase.OPENING), Broke(0.5, FAULT, "device"))
    with pytest.raises(SessionError, match="was not stopped by its device"):
        advance(trouble, AGAIN)


def test_which_errors_are_the_devices() -> None:
    assert broken(1.0, DeviceLost("gone")) == Broke(1.0, "gone", "device")
    assert broken(1.0, KeyError("x")) == Broke(1.0, "KeyError: 'x'", "program")


@pytest.mark.slow
def test_the_rows_of_the_trial_and_of_its_repetition_say_that_the_device_failed(tmp_path) -> None:
    world = StoredWorld(tmp_path / "small")
    world.start()
    world.until(Phase.TASK)
    number = world.state.trial.number
    world.servo.fault = FAULT
    world.run(0.1)
    assert world.state.phase is Phase.TROUBLE
    assert not world.servo.force_is_on
    world.servo.fault = None
    world.runner.post(AGAIN)
    assert not world.servo.force_is_on
    world.runner.post(ResumeAsked(world.clock(), "operator"))
    assert world.servo.force_is_on
    world.until(Phase.ANSWERING)
    first, again = [row for row in session_tables.trials(world.lines) if row["trial"] == number]
    assert (first["attempt"], first["outcome"], again["attempt"], again["outcome"]) == (1, "interrupted", 2, "complete")
    assert first["notes"] == f"the device failed and was connected again ({FAULT})"
    assert again["notes"] == f"presented again: the device failed and was connected again ({FAULT})"
    world.until(Phase.COMPLETE)
    others = [row["notes"] for row in session_tables.trials(world.lines) if row["trial"] != number]
    assert set(others) == {None}


@pytest.mark.parametrize("what", [FAULT, "a video of the study stopped (no picture for 1 s): check camera and files"])
def test_in_a_study_with_videos_journal_and_tables_do_not_say_what_failed(what: str) -> None:
    """Only some conditions show a video, so that its failure tells what a code stands for."""
    state = state_in(Phase.TASK)
    first, *others = state.plan.protocol.conditions
    conditions = state.plan.protocol.conditions
    seen = {**conditions, first: conditions[first].model_copy(update={"view": "camera"})}
    protocol = state.plan.protocol.model_copy(update={"conditions": seen})
    assert others
    state = replace(state, plan=replace(state.plan, protocol=protocol))
    trouble, commands = advance(state, Broke(20.0, what, "device"))
    assert trouble.lost_device
    assert fields_of(commands, "broke") == {"what": CAUSE_WITHHELD}
    _, commands = advance(state, Broke(20.0, "a bug"))
    assert fields_of(commands, "broke") == {"what": "a bug"}


def fields_of(commands: Sequence[Command], event: str) -> Mapping[str, Any]:
    (written,) = [one for one in commands if isinstance(one, Write) and one.event == event]
    return written.fields


def test_the_journal_says_what_device_goes_on() -> None:
    trouble, _ = advance(state_in(Phase.TASK), Broke(20.0, FAULT, "device"))
    _, commands = advance(trouble, AGAIN)
    (told,) = [one for one in commands if isinstance(one, Write) and one.event == "device_reconnected"]
    assert told.waits
    assert told.fields == {"device": "memory", "described": AGAIN.described}

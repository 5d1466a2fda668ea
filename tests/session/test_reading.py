"""Pages to read: in which language, how long a break lasts, and where they say one is."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pytest

from study_app.errors import DeviceLost
from study_app.protocol.load import load
from study_app.session.pages import Progress, TextPage
from study_app.session.transitions.events import Broke, Command, Reconnected, ResumeRequested, TaskDone, Write, broken
from study_app.session.transitions.state import FINAL, Phase
from study_app.session.transitions.table import advance
from study_app.store.journals.journal_events import CAUSE_WITHHELD
from study_app.store.tables import session_tables
from tests.faults.support.worlds import StoredWorld
from tests.session import small
from tests.session.transitions.states import shown, state_in
from tests.session.transitions.transcribed import opened


def test_pages_between_the_trials_say_which_part_it_is_and_how_far() -> None:
    state = opened(load("rek2024"))
    progress_of_page: dict[str, Progress | None] = {}
    while state.phase not in FINAL:
        if state.phase is Phase.TASK:
            event: Any = TaskDone(100.0, "complete", {})
        else:
            event = small.next_event(state, 100.0)
        state, commands = advance(state, event)
        page = shown(commands)
        if isinstance(page, TextPage):
            progress_of_page[page.id] = page.progress
    assert progress_of_page == {
        "consent": None,
        "instructions": None,
        "part_1": Progress(part=1, parts=2, label="", index=1, of=3),
        "rest": Progress(part=1, parts=2, label="", index=4, of=3),
        "part_2": Progress(part=2, parts=2, label="", index=1, of=1),
        "delays_intro": Progress(part=2, parts=2, label="", index=1, of=7),
        "debrief": None,
    }


FAULT = "the device 'memory' stopped responding"
AGAIN = Reconnected(30.0, {"name": "memory", "force_limit_n": 8.0})


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
    world.runner.post(ResumeRequested(world.clock(), "operator"))
    assert world.servo.force_is_on
    world.until(Phase.ANSWERING)
    first, again = [row for row in session_tables.SessionRows(world.store.lines).trials if row["trial"] == number]
    assert (first["attempt"], first["outcome"], again["attempt"], again["outcome"]) == (1, "interrupted", 2, "complete")
    assert first["notes"] == f"the device failed and was reconnected ({FAULT})"
    assert again["notes"] == f"presented again: the device failed and was reconnected ({FAULT})"
    world.until(Phase.COMPLETE)
    others = [row["notes"] for row in session_tables.SessionRows(world.store.lines).trials if row["trial"] != number]
    assert set(others) == {None}


@pytest.mark.parametrize(
    "what", [FAULT, "one of the study's videos stopped (no frame arrived for 1 s): check the camera and the files"]
)
def test_journal_and_tables_of_a_study_with_videos_do_not_name_the_failed_part(what: str) -> None:
    """Only some conditions show a video, so that its failure reveals the condition of a code."""
    state = state_in(Phase.TASK)
    first, *others = state.plan.protocol.conditions
    conditions = state.plan.protocol.conditions
    with_view = {**conditions, first: conditions[first].model_copy(update={"view": "camera"})}
    protocol = state.plan.protocol.model_copy(update={"conditions": with_view})
    assert others
    state = replace(state, plan=replace(state.plan, protocol=protocol))
    trouble, commands = advance(state, Broke(20.0, what, "device"))
    assert trouble.lost_device
    assert fields_of(commands, "broke") == {"what": CAUSE_WITHHELD}
    _, commands = advance(state, Broke(20.0, "a bug"))
    assert fields_of(commands, "broke") == {"what": "a bug"}


def fields_of(commands: Sequence[Command], event: str) -> Mapping[str, Any]:
    (write,) = [command for command in commands if isinstance(command, Write) and command.line.event == event]
    return write.line.fields()

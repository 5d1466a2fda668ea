"""Pages to read: in which language, how long a break lasts, and where they say one is."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from study_app.errors import DeviceLost
from study_app.protocol.load import load
from study_app.protocol.orders.durations import expected_duration_s
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.session.pages import Progress, TextPage
from study_app.session.resume import resume_at
from study_app.session.transitions.events import (
    Begin,
    Broke,
    Chosen,
    Command,
    ItemShown,
    Reconnected,
    ResumeRequested,
    ShowPage,
    Submitted,
    TaskDone,
    Write,
    broken,
)
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, open_session
from study_app.store.journals.journal_events import CAUSE_WITHHELD
from study_app.store.progress import progress_of
from study_app.store.tables import session_tables
from study_app.store.verification.verify_session import wrong_responses
from tests.faults.support.worlds import StoredWorld
from tests.journal_lines import event_from
from tests.protocol.forms.mixed import mixed_file
from tests.session import small
from tests.session.transitions.states import shown, state_in
from tests.session.transitions.transcribed import opened, with_break


def test_a_break_counts_in_how_long_a_session_is_expected_to_take() -> None:
    longer = expected_duration_s(with_break()) - expected_duration_s(with_break(min_s=None))
    assert 50 < longer < 60  # the reading alone takes some seconds of the 60


def test_only_a_break_can_last() -> None:
    with pytest.raises(ValidationError, match="belongs to a page of kind break"):
        with_break(kind="instructions")


def test_pages_between_the_trials_say_which_part_it_is_and_how_far() -> None:
    state = opened(load("rek2024"))
    told: dict[str, Progress | None] = {}
    while state.phase not in FINAL:
        if state.phase is Phase.TASK:
            event: Any = TaskDone(100.0, "complete", {})
        else:
            event = small.next_event(state, 100.0)
        state, commands = advance(state, event)
        page = shown(commands)
        if isinstance(page, TextPage):
            told[page.id] = page.progress
    assert told == {
        "consent": None,
        "instructions": None,
        "part_1": Progress(1, 2, "", 1, 3),
        "rest": Progress(1, 2, "", 4, 3),
        "part_2": Progress(2, 2, "", 1, 1),
        "delays_intro": Progress(2, 2, "", 1, 7),
        "debrief": None,
    }


class Walked:
    """A session of the mixed study, and the lines that it wrote."""

    def __init__(self, study: Any) -> None:
        self.study = study
        self.schedule = build_schedule(study, "P001", 1)
        key = draw_key(study, stream(1, "key").random)
        self.state: SessionState = open_session(study, self.schedule, key, "en")
        self.lines: list[dict[str, Any]] = [{"event": "session_started", "t_s": 0.0, "n": 1, "language": "en"}]
        self.page: Any = None
        self.clock = 0.0
        self.do(Begin)

    def do(self, kind: type[Any], *more: Any) -> list[str]:
        self.clock += 1.0
        self.state, commands = advance(self.state, kind(self.clock, *more))
        for command in commands:
            if isinstance(command, Write):
                number = len(self.lines) + 1
                self.lines.append(
                    {"event": command.line.event, "t_s": self.clock, "n": number, **command.line.fields()}
                )
            if isinstance(command, ShowPage):
                self.page = command.page
        return [command.line.event for command in commands if isinstance(command, Write)]


@pytest.fixture
def walked(tmp_path: Path) -> Walked:
    return Walked(load(mixed_file(tmp_path)))


def test_form_is_written_with_kinds_and_without_hidden_questions(walked: Walked) -> None:
    for item in ("age", "hand", "used"):
        walked.do(ItemShown, item)
    walked.do(Chosen, "age", 42)
    walked.do(Chosen, "hand", "left")
    walked.do(Chosen, "used", ("mouse", "falcon"))
    assert walked.do(Submitted) == ["form_answered", "trial_started"]
    rows = next(line for line in walked.lines if line["event"] == "form_answered")["items"]
    assert [(row["item"], row["number"], row["kind"], row["value"]) for row in rows] == [
        ("age", 1, "number", 42),
        ("hand", 2, "choice", "left"),
        ("used", 4, "choice", ("mouse", "falcon")),
    ]
    assert list(wrong_responses(list(map(event_from, walked.lines)))) == []


def test_interrupted_form_is_shown_again_from_its_beginning(walked: Walked) -> None:
    walked.do(Chosen, "age", 20)
    start = resume_at(walked.study, walked.schedule, map(event_from, walked.lines))
    assert start.step == 0
    walked.lines.append({"event": "form_shown", "t_s": 99.0, "n": 99, "form": "start"})
    assert progress_of(list(map(event_from, walked.lines))).answers == {}


def test_session_goes_on_after_an_answered_form(walked: Walked) -> None:
    walked.do(Chosen, "age", 20)
    walked.do(Chosen, "hand", "left")
    walked.do(Submitted)
    assert resume_at(walked.study, walked.schedule, map(event_from, walked.lines)).step == 1


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
    assert first["notes"] == f"the device failed and was connected again ({FAULT})"
    assert again["notes"] == f"presented again: the device failed and was connected again ({FAULT})"
    world.until(Phase.COMPLETE)
    others = [row["notes"] for row in session_tables.SessionRows(world.store.lines).trials if row["trial"] != number]
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
    (written,) = [one for one in commands if isinstance(one, Write) and one.line.event == event]
    return written.line.fields()

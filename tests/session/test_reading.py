"""Pages to read: in which language, how long a break lasts, and where they say one is."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from study_app.errors import DeviceLost, SessionError
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.orders.durations import expected_duration_s
from study_app.protocol.orders.schedule import FormStep, build_schedule, draw_key, stream
from study_app.session.pages import Progress, QuestionnairePage, TextPage
from study_app.session.resume import resume_at
from study_app.session.transitions.commands import Command, FadeIn, ShowPage, StartTrial, StopForce, Write
from study_app.session.transitions.events import (
    Begin,
    Broke,
    Chosen,
    Continue,
    ForceStopped,
    ItemShown,
    LanguageChosen,
    PauseAsked,
    Reconnected,
    RepeatAsked,
    ResumeAsked,
    Retracted,
    Submitted,
    TaskDone,
    broken,
)
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, open_session
from study_app.store.journals.journal_events import CAUSE_WITHHELD
from study_app.store.progress import progress_of
from study_app.store.tables import session_tables
from study_app.store.verification.response_checks import wrong_responses
from tests.faults.support.worlds import StoredWorld
from tests.protocol.forms.mixed import mixed_file
from tests.session import small
from tests.session.transitions.states import state_in


def opened(protocol: Protocol, language: str = "en") -> SessionState:
    key = draw_key(protocol, stream(1, "key").random)
    return open_session(protocol, build_schedule(protocol, "P001", 1), key, language)


def with_break(**changed: Any) -> Protocol:
    tables = deepcopy(small.TABLES)
    tables["pages"]["rest"] = {"kind": "break", "title": "Rest", "body": "Breathe.", "min_s": 60, **changed}
    tables["blocks"]["feeling"] |= {"break_every": 1, "break_page": "rest"}
    return Protocol.model_validate(tables)


def shown(commands: tuple[Any, ...]) -> Any:
    return next((command.page for command in commands if isinstance(command, ShowPage)), None)


def written(commands: tuple[Any, ...]) -> list[tuple[str, dict[str, Any]]]:
    return [(command.event, dict(command.fields)) for command in commands if isinstance(command, Write)]


def to_page(state: SessionState, page_id: str) -> tuple[SessionState, Any]:
    """Walk to a page; return the state and the page."""
    while not (state.phase is Phase.READING and state.page_id == page_id):
        state, commands = advance(state, small.next_event(state, 100.0))
    return state, shown(commands)


def test_a_language_is_offered_until_the_consent_is_given_and_all_pages_are_in_it() -> None:
    state, commands = advance(opened(load("rek2024")), Begin(0.0))
    assert (shown(commands).language, shown(commands).languages) == ("en", ("en", "nl"))
    state, commands = advance(state, LanguageChosen(2.0, "nl"))
    assert written(commands) == [("language_chosen", {"language": "nl"})]
    page = shown(commands)
    assert (page.title, page.language, page.languages) == ("Welkom", "nl", ("en", "nl"))
    state, commands = advance(state, Continue(3.0))
    assert (shown(commands).title, shown(commands).languages) == ("Hoe het werkt", ())
    _, instruction = to_task(state)
    assert instruction.startswith("Beweeg de bal")


def to_task(state: SessionState) -> tuple[SessionState, str]:
    while state.phase is not Phase.TASK:
        state, commands = advance(state, small.next_event(state, 9.0))
    return state, shown(commands).instruction


def test_after_the_consent_the_language_stays() -> None:
    state, _ = advance(opened(load("rek2024")), Begin(0.0))
    state, _ = advance(state, Continue(3.0))
    with pytest.raises(SessionError, match="chosen before the consent"):
        advance(state, LanguageChosen(4.0, "nl"))


def test_a_language_that_the_study_does_not_have_is_refused_and_the_same_one_is_no_event() -> None:
    state, _ = advance(opened(load("rek2024")), Begin(0.0))
    with pytest.raises(SessionError, match="choose en or nl"):
        advance(state, LanguageChosen(2.0, "fr"))
    assert advance(state, LanguageChosen(2.0, "en")) == (state, ())


def test_a_study_in_one_language_offers_none() -> None:
    _, commands = advance(small.opened(), Begin(0.0))
    assert shown(commands).languages == ()


def test_a_break_with_a_least_time_is_not_left_before_whoever_presses() -> None:
    state, page = to_page(opened(with_break()), "rest")
    assert page.stays_until_s == pytest.approx(160.0)
    assert advance(state, Continue(159.9)) == (state, ())
    assert advance(state, Continue(160.0))[0].phase is Phase.TASK


def test_a_pause_in_a_break_neither_lengthens_nor_shortens_it() -> None:
    state, page = to_page(opened(with_break()), "rest")
    paused, _ = advance(state, PauseAsked(120.0, "participant"))
    again, commands = advance(paused, ResumeAsked(150.0, "participant"))
    assert shown(commands) == page
    stopped, _ = advance(again, ForceStopped(151.0, "participant"))
    again, _ = advance(stopped, ResumeAsked(161.0, "participant"))
    assert advance(again, Continue(162.0))[0].phase is Phase.TASK


def test_a_break_without_a_time_is_the_participants_own() -> None:
    state, page = to_page(opened(with_break(min_s=None)), "rest")
    assert page.stays_until_s is None
    assert advance(state, Continue(100.0))[0].phase is Phase.TASK


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


def test_a_break_within_a_block_says_how_many_settings_are_done() -> None:
    _, page = to_page(opened(with_break()), "rest")
    assert page.progress == Progress(1, 2, "", 2, 2)


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
                self.lines.append({"event": command.event, "t_s": self.clock, "n": number, **command.fields})
            if isinstance(command, ShowPage):
                self.page = command.page
        return [command.event for command in commands if isinstance(command, Write)]


@pytest.fixture
def walked(tmp_path: Path) -> Walked:
    return Walked(load(mixed_file(tmp_path)))


def test_form_is_a_page_of_its_questions(walked: Walked) -> None:
    assert isinstance(walked.state.step, FormStep)
    assert walked.state.phase is Phase.ANSWERING
    page = walked.page
    assert isinstance(page, QuestionnairePage)
    assert (page.form, page.trial, page.labels) == ("start", None, ())
    assert [item.widget for item in page.items] == ["number", "choice", "number", "choice"]
    assert walked.lines[-1]["event"] == "form_shown"


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
    assert list(wrong_responses(walked.lines)) == []


def test_answer_that_hides_a_question_removes_its_answer(walked: Walked) -> None:
    with pytest.raises(SessionError, match="is not shown: an earlier answer hides it"):
        walked.do(Chosen, "since", 3)
    walked.do(Chosen, "hand", "both")
    walked.do(Chosen, "since", 3)
    assert walked.do(Chosen, "hand", "right") == ["choice", "answer_removed"]
    walked.do(Chosen, "age", 20)
    walked.do(Submitted)
    assert list(wrong_responses(walked.lines)) == []
    rows = next(line for line in walked.lines if line["event"] == "form_answered")["items"]
    assert [row["item"] for row in rows] == ["age", "hand", "used"]


def test_required_question_that_an_answer_shows_must_be_answered(walked: Walked) -> None:
    walked.do(Chosen, "age", 20)
    walked.do(Chosen, "hand", "both")
    with pytest.raises(SessionError, match="answer 3 first"):
        walked.do(Submitted)


def test_retracted_answer_is_missing_again(walked: Walked) -> None:
    walked.do(Chosen, "age", 20)
    assert walked.do(Retracted, "age") == ["answer_removed"]
    assert walked.do(Retracted, "age") == []
    walked.do(Chosen, "hand", "left")
    with pytest.raises(SessionError, match="answer 1 first"):
        walked.do(Submitted)


def test_an_answer_that_was_retracted_and_given_again_has_the_first_onset_and_no_change(walked: Walked) -> None:
    walked.do(ItemShown, "age")
    shown_s = walked.clock
    walked.do(Chosen, "age", 20)
    walked.do(Retracted, "age")
    walked.do(Chosen, "age", 21)
    answer = walked.state.answers["age"]
    assert (answer.onset_s, answer.first_s, answer.changes, answer.value) == (shown_s, walked.clock, 0, 21)


@pytest.mark.parametrize(
    ("item", "value", "sentence"),
    [
        ("age", 15, "give a whole number from 16 to 99"),
        ("age", 20.5, "give a whole number from 16 to 99"),
        ("age", "20", "give a whole number"),
        ("hand", "foot", "choose left or right or both"),
        ("used", ("mouse", "mouse"), "choose mouse or falcon"),
        ("used", (), "choose mouse or falcon"),
        ("thumb", 1, "is not on this page"),
    ],
)
def test_answer_that_is_not_one_is_refused(walked: Walked, item: str, value: Any, sentence: str) -> None:
    before = walked.state
    with pytest.raises(SessionError, match=sentence):
        walked.do(Chosen, item, value)
    assert walked.state == before


def test_form_comes_back_after_a_pause_with_its_answers(walked: Walked) -> None:
    walked.do(Chosen, "age", 20)
    walked.do(PauseAsked, "participant")
    walked.do(ResumeAsked, "participant")
    assert walked.state.phase is Phase.ANSWERING
    assert walked.page.chosen == (("age", 20),)
    assert "form_shown" not in [line["event"] for line in walked.lines[-2:]]


def test_form_is_not_repeated_as_a_trial(walked: Walked) -> None:
    with pytest.raises(SessionError, match="no trial is under way"):
        walked.do(RepeatAsked, "a call")


def test_interrupted_form_is_shown_again_from_its_beginning(walked: Walked) -> None:
    walked.do(Chosen, "age", 20)
    start = resume_at(walked.study, walked.schedule, walked.lines)
    assert start.step == 0
    walked.lines.append({"event": "form_shown", "t_s": 99.0, "n": 99, "form": "start"})
    assert progress_of(walked.lines).answers == {}


def test_session_goes_on_after_an_answered_form(walked: Walked) -> None:
    walked.do(Chosen, "age", 20)
    walked.do(Chosen, "hand", "left")
    walked.do(Submitted)
    assert resume_at(walked.study, walked.schedule, walked.lines).step == 1


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

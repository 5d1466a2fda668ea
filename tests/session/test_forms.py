"""Forms and other questions in the state machine: what is written, what is hidden, and where a session goes on."""

from pathlib import Path
from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import FormStep, build_schedule, draw_key, stream
from study_app.session.pages import QuestionnairePage
from study_app.session.resume import resume_at
from study_app.session.transitions.commands import ShowPage, Write
from study_app.session.transitions.events import (
    Begin,
    Chosen,
    ItemShown,
    PauseAsked,
    RepeatAsked,
    ResumeAsked,
    Retracted,
    Submitted,
)
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance, open_session
from study_app.store.progress import progress_of
from study_app.store.verification.response_checks import wrong_responses
from tests.protocol.forms.mixed import mixed_file


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

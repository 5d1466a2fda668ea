"""A question of a new kind is added from outside the package: asked in a session, shown, and reported."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QPushButton, QWidget

from study_app.analysis.data import questions as measured
from study_app.analysis.data.questions import Measure, counts_of_missing
from study_app.analysis.figures import question_figures
from study_app.analysis.figures.page_layout import Look, Sheet
from study_app.analysis.figures.question_figures import QuestionFigure, rows
from study_app.analysis.report.write_report import report
from study_app.analysis.results import QuestionResult
from study_app.gui.participant import questions as fields
from study_app.gui.participant.forms.question_field import QuestionField
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol import questions
from study_app.protocol.model import Protocol
from study_app.protocol.questions import Context, Draw, ItemView, Question, Value, ValueType
from study_app.protocol.wording.languages import Words, words
from study_app.session.pages import QuestionnairePage
from study_app.session.simulated import answers_only
from study_app.session.transitions.events import Chosen, Submitted
from study_app.store.verification.verify_study import verify
from tests.gui.small import ManualClock
from tests.session import small

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]


@dataclass(frozen=True, slots=True)
class MoodView(ItemView):
    widget: ClassVar[str] = "toy_mood"

    @property
    def keys(self) -> str:
        return "M"

    def simulated(self, opinion: float, draw: Draw) -> Value:
        return "sunny" if opinion > 4 else "grey"


class Mood(Question):
    widget: ClassVar[str] = "toy_mood"
    measure: ClassVar[str] = "toy_sunny"
    figure: ClassVar[str | None] = "toy_sun"
    value_type: ClassVar[ValueType] = "text"
    kind: Literal["toy_mood"] = "toy_mood"

    def view(self, number: int, context: Context) -> ItemView:
        return self._shown(MoodView, number, context)

    def problem(self, answer: Value, context: Context) -> str | None:
        return None if answer in ("sunny", "grey") else "choose sunny or grey"


class MoodField(QuestionField):
    widget_id: ClassVar[str] = "toy_mood"

    def __init__(self, view: ItemView, said: Words, parent: QWidget) -> None:
        super().__init__(view, said, parent)
        self.sun = QPushButton("sunny", self)
        self.sun.clicked.connect(lambda: self.give("sunny"))
        self.put(self.sun)

    def show_answer(self, value: Value) -> None:
        self.kept(value)

    def clear(self) -> None:
        self.sun.setText("sunny")


def sunny(_asked: Any, answers: Any) -> dict[str, Any]:
    return {**counts_of_missing(answers), "sunny": int((answers["response"] == "sunny").sum())}


def sun(_asked: Any, found: QuestionResult, look: Look) -> Sheet:
    return rows([one.name for one in found.groups], [one.numbers["n"] for one in found.groups], look, row_pt=20)[0]


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> Protocol:
    monkeypatch.setitem(questions.KINDS, "toy_mood", Mood)
    monkeypatch.setitem(fields.FIELDS, "toy_mood", MoodField)
    measure = Measure("toy_sunny", sunny, lambda _asked, numbers: {"sunny": str(numbers["sunny"])})
    monkeypatch.setitem(measured.MEASURES, "toy_sunny", measure)
    monkeypatch.setitem(question_figures.FIGURES, "toy_sun", QuestionFigure("toy_sun", sun, "How sunny it was."))
    mood = Mood(id="mood", text="How was the weather in there?", short="Weather")
    asked = {"weather": {"intro": "Look out.", "items": (mood,)}, **small.TABLES["questionnaires"]}
    return Protocol.model_validate(
        {**small.TABLES, "format": 2, "questionnaires": asked, "sequence": ["weather", *small.TABLES["sequence"]]}
    )


@pytest.mark.nightly
def test_question_of_a_new_kind_runs_a_session_and_a_report(
    study: Protocol, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(answers_only, "source_bytes", lambda _name: b"made in Python")
    monkeypatch.setattr(answers_only, "parse", lambda _source, _name: study)
    folder = answers_only.rehearse_answers("toy", participants=3, seed=1, results=tmp_path / "results")
    assert verify(folder).errors == ()
    failed: list[str] = []
    files = report(folder, tmp_path / "report", failed=failed.append)
    assert failed == []
    assert "question-weather-mood.png" in {path.name for path in files}
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "How was the weather in there?" in page
    assert '<th class="n">sunny</th>' in page
    assert "How sunny it was." in page


def test_question_of_a_new_kind_is_shown_and_answered(study: Protocol, qtbot: Any) -> None:
    form = study.forms["weather"]
    context = form.context(study.scales, "en")
    items = tuple(item.view(number, context) for number, item in enumerate(form.items, 1))
    window = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
    qtbot.addWidget(window)
    told: list[Any] = []
    window.event.connect(told.append)
    window.resize(1366, 768)
    window.show()
    window.show_page(QuestionnairePage(None, "Weather", "Look out.", items, (), None, None, form="weather"))
    QApplication.processEvents()
    (field,) = window.widget.fields  # type: ignore[union-attr]
    QTest.mouseClick(field.sun, Qt.MouseButton.LeftButton)
    QTest.mouseClick(window.widget.button, Qt.MouseButton.LeftButton)  # type: ignore[union-attr]
    assert [(one.item, one.value) for one in told if isinstance(one, Chosen)] == [("mood", "sunny")]
    assert isinstance(told[-1], Submitted)
    window.may_close = True
    window.close()

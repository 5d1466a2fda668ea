"""Counts of options: a kind of question says which options an answer counts for."""

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import pandas as pd
import pytest

from study_app.analysis.designs.question_measures import MEASURES
from study_app.analysis.export.export import export
from study_app.analysis.tables.asked_questions import AskedIn, AskedQuestion
from study_app.protocol.forms import kinds
from study_app.protocol.forms.show_if import Value
from study_app.protocol.model import Protocol
from study_app.protocol.questions.choice import Choice, ChoiceView, Option
from study_app.protocol.questions.question import Context, Draw, ItemView, Question, ValueType
from study_app.session.simulated import answers_only
from tests.session import small

OPTIONS = tuple(Option(id=name, text=name.capitalize()) for name in ("thin", "middle", "thick"))
RESPONSES = ["thick middle thin", "thick thin middle", "thin thick middle", None]


@dataclass(frozen=True, slots=True)
class ToyRankingView(ChoiceView):
    def simulated(self, opinion: float, draw: Draw) -> Value:
        return tuple(option for option, _ in self.options[::-1])


class ToyRanking(Question):
    widget: ClassVar[str] = "choice"
    measure: ClassVar[str] = "counts"
    figure: ClassVar[str | None] = "counts"
    value_type: ClassVar[ValueType] = "text"
    kind: Literal["toy_ranking"] = "toy_ranking"
    options: tuple[Option, ...]

    def view(self, number: int, context: Context) -> ItemView:
        shown = tuple((option.id, context.text(option.text)) for option in self.options)
        return ToyRankingView(*self._shown(number, context), options=shown, several=True)

    def problem(self, answer: Value, context: Context) -> str | None:
        ids = {option.id for option in self.options}
        return None if isinstance(answer, tuple) and set(answer) == ids else f"rank {ids}"

    def levels(self, context: Context) -> dict[str, str]:
        return {option.id: context.text(option.text) for option in self.options}

    @property
    def names_several(self) -> bool:
        return True

    def counted(self, response: str) -> tuple[str, ...]:
        return tuple(response.split()[:1])


RANKING = ToyRanking(id="best", text="Which is best?", short="Best", options=OPTIONS)


@pytest.mark.parametrize(
    ("question", "counts"),
    [
        (
            Choice(id="best", text="Which are good?", short="Good", options=OPTIONS, several=True),
            {"thin": 3, "middle": 3, "thick": 3},
        ),
        (RANKING, {"thin": 1, "middle": 0, "thick": 2}),
    ],
)
def test_question_says_which_options_an_answer_counts_for(question: Question, counts: dict[str, int]) -> None:
    asked = AskedQuestion(AskedIn("order", "Order", True, ()), question, Context({}, None, "en"))
    answers = pd.DataFrame(
        {"response": RESPONSES, "value": None, "cannot_judge": False, "participant": ["P1", "P2", "P3", "P4"]}
    )
    measure = MEASURES["counts"]
    found = measure.of(asked, answers)
    assert found["counts"] == counts
    assert (found["n"], found["missing"]) == (3, 1)
    assert measure.cells is not None
    assert measure.cells(asked, found)["Thick"].startswith(f"{counts['thick']} (")


@pytest.mark.slow
def test_answers_that_name_several_options_stay_words_in_spss(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(kinds.KINDS, "toy_ranking", ToyRanking)
    asked = {"order": {"intro": "Rank.", "items": (RANKING,)}, **small.TABLES["questionnaires"]}
    sequence = [*small.TABLES["sequence"], "order"]
    study = Protocol.model_validate({**small.TABLES, "format": 2, "questionnaires": asked, "sequence": sequence})
    monkeypatch.setattr(answers_only, "source_bytes", lambda _name: b"made in Python")
    monkeypatch.setattr(answers_only, "parse", lambda _source, _name: study)
    folder = answers_only.rehearse_answers("toy", participants=2, seed=1, results=tmp_path / "results")
    export(folder, tmp_path / "tables", extras={"sav", "wide"})
    (path,) = (tmp_path / "tables").glob("*wide*.sav")
    frame, _ = importlib.import_module("pyreadstat").read_sav(path)
    assert list(frame["order__best"]) == ["thick middle thin"] * 2

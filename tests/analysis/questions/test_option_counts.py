"""Counts of options: a kind of question says which options an answer counts for."""

from typing import ClassVar, Literal

import pandas as pd
import pytest

from study_app.analysis.data.blocks import PlacedQuestion, QuestionPlace
from study_app.analysis.data.questions import MEASURES
from study_app.protocol.questions import Choice, Context, ItemView, Option, Question, Value, ValueType

OPTIONS = tuple(Option(id=name, text=name.capitalize()) for name in ("thin", "middle", "thick"))
RESPONSES = ["thick middle thin", "thick thin middle", "thin thick middle", None]


class ToyRanking(Question):
    widget: ClassVar[str] = "choice"
    measure: ClassVar[str] = "counts"
    figure: ClassVar[str | None] = "counts"
    value_type: ClassVar[ValueType] = "text"
    kind: Literal["toy_ranking"] = "toy_ranking"
    options: tuple[Option, ...]

    def view(self, number: int, context: Context) -> ItemView:
        raise NotImplementedError

    def problem(self, answer: Value, context: Context) -> str | None:
        raise NotImplementedError

    def levels(self, context: Context) -> dict[str, str]:
        return {option.id: context.text(option.text) for option in self.options}

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
    asked = PlacedQuestion(QuestionPlace("order", "Order", True, ()), question, Context({}, None, "en"))
    answers = pd.DataFrame(
        {"response": RESPONSES, "value": None, "cannot_judge": False, "participant": ["P1", "P2", "P3", "P4"]}
    )
    measure = MEASURES["counts"]
    found = measure.of(asked, answers)
    assert found["counts"] == counts
    assert (found["n"], found["missing"]) == (3, 1)
    assert measure.cells is not None
    assert measure.cells(asked, found)["Thick"].startswith(f"{counts['thick']} (")

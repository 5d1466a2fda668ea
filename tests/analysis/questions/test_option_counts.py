"""Counts of options: a kind of question says which options an answer counts for."""

from __future__ import annotations

from typing import Literal

import pandas as pd
import pytest

from study_app.analysis.designs.questions import MEASURES
from study_app.analysis.tables.asked_questions import AskedIn, AskedQuestion
from study_app.protocol.questions.choice import Choice, Option
from study_app.protocol.questions.question import Context

OPTIONS = tuple(Option(id=name, text=name.capitalize()) for name in ("thin", "middle", "thick"))
RESPONSES = ["thick middle thin", "thick thin middle", "thin thick middle", None]


class ToyRanking(Choice):
    kind: Literal["toy_ranking"] = "toy_ranking"  # type: ignore[assignment]

    def counted(self, response: str) -> tuple[str, ...]:
        return tuple(response.split()[:1])


@pytest.mark.parametrize(
    ("kind", "counts"),
    [(Choice, {"thin": 3, "middle": 3, "thick": 3}), (ToyRanking, {"thin": 1, "middle": 0, "thick": 2})],
)
def test_question_says_which_options_an_answer_counts_for(kind: type[Choice], counts: dict[str, int]) -> None:
    question = kind(id="best", text="Which is best?", short="Best", options=OPTIONS, several=True)
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

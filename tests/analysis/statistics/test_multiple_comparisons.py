"""Published percentages of answers (R package likert): what the figures and the exported table count."""

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.data import measures
from study_app.analysis.statistics.outcome import false_discovery, holm
from study_app.errors import AnalysisError


@pytest.mark.parametrize(
    ("ps", "adjusted"),
    [
        ([0.01, 0.02, 0.03, 0.04, 0.05], [0.05, 0.08, 0.09, 0.09, 0.09]),
        ([0.0004, 0.0095, 0.01, 0.0278, 0.0459, 0.0344], [0.0024, 0.0475, 0.0475, 0.0834, 0.0834, 0.0834]),
    ],
)
def test_published_adjustments(ps: list[float], adjusted: list[float]) -> None:
    assert holm(ps) == pytest.approx(adjusted)


@pytest.mark.parametrize("p", [-0.1, 1.1, float("nan")])
def test_what_is_no_p_is_refused(p: float) -> None:
    with pytest.raises(AnalysisError, match="cannot be adjusted"):
        holm([p, 0.5])
    with pytest.raises(AnalysisError, match="cannot be adjusted"):
        false_discovery([p])


MATH_ANXIETY = {
    "interesting": ("25544544513441522435", 25, 10, 65),
    "uptight": ("51145224452425343353", 30, 20, 50),
    "use in future": ("35555555534353454445", 0, 20, 80),
    "worry": ("41233125454314134242", 40, 20, 40),
    "favourite": ("14331442311241512313", 50, 25, 25),
}
# What 66,690 pupils read: counts of five levels, answered; low, neutral, high.
READING = {
    "magazines": ((6682, 13143, 13995, 20353, 11436), 30.21689, 21.33091, 48.45219),
    "comic books": ((24019, 16789, 10317, 9489, 4751), 62.43096, 15.78368, 21.78536),
}
PUPILS = 66690


def row_of(levels: list[float], people: int) -> pd.Series:
    """Aggregate answers on 1 to 5, put on 2 to 6 of our seven so that the middle stays the middle."""
    frame = pd.DataFrame(
        {
            "participant": [f"P{number}" for number in range(people)],
            "code": "L1",
            "item": "a",
            "response": pd.array(
                [*(int(level) + 1 for level in levels), *[None] * (people - len(levels))], dtype="Int64"
            ),
            "cannot_judge": False,
        }
    )
    return measures.aggregate(frame, {"L1": people}, ["L1"], ["a"]).iloc[0]


def shares(row: pd.Series) -> tuple[float, float, float]:
    low = row["count_1"] + row["count_2"] + row["count_3"]
    return 100 * low / row["n"], 100 * row["count_4"] / row["n"], row["agree_percent"]


@pytest.mark.parametrize("item", MATH_ANXIETY)
def test_twenty_students(item: str) -> None:
    digits, *expected = MATH_ANXIETY[item]
    assert shares(row_of([float(digit) for digit in digits], 20)) == pytest.approx(expected)


@pytest.mark.parametrize("item", READING)
def test_many_pupils_some_of_whom_did_not_answer(item: str) -> None:
    counts, *expected = READING[item]
    row = row_of(list(np.repeat(np.arange(1, 6), counts)), PUPILS)
    assert (row["n"], row["missing"]) == (sum(counts), PUPILS - sum(counts))
    assert shares(row) == pytest.approx(expected, abs=5e-6)

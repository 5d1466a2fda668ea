"""Published percentages of answers (R package likert): what the figures and the exported table count."""

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.data import measures
from study_app.analysis.statistics.outcome import false_discovery, holm
from study_app.errors import AnalysisError


@pytest.mark.parametrize("p", [-0.1, 1.1, float("nan")])
def test_values_that_are_not_p_values_are_refused(p: float) -> None:
    with pytest.raises(AnalysisError, match="cannot be adjusted"):
        holm([p, 0.5])
    with pytest.raises(AnalysisError, match="cannot be adjusted"):
        false_discovery([p])


# Twenty students on mathematics, and what 66,690 pupils read: counts of five levels, people; low, neutral, high.
LIKERT = {
    "interesting": ((2, 3, 2, 7, 6), 20, 25, 10, 65),
    "uptight": ((2, 4, 4, 5, 5), 20, 30, 20, 50),
    "magazines": ((6682, 13143, 13995, 20353, 11436), 66690, 30.21689, 21.33091, 48.45219),
    "comic books": ((24019, 16789, 10317, 9489, 4751), 66690, 62.43096, 15.78368, 21.78536),
}


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


def test_a_setting_that_was_not_presented_counts_as_zero_missing_answers() -> None:
    answers = pd.DataFrame(
        {
            "participant": ["P1", "P2", "P2", "P3"],
            "code": "L1",
            "item": ["a", "a", "b", "a"],
            "response": pd.array([6, None, 2, 5], dtype="Int64"),
            "cannot_judge": [False, True, False, False],
        }
    )
    table = measures.aggregate(answers, {"L1": 7}, ["L2", "L1"], ["b", "a"], {"L1": 4})
    columns = ["code", "item", "participants", "presented", "presented_excluded", "n", "cannot_judge", "missing"]
    assert table[columns].to_numpy().tolist() == [
        ["L2", "b", 0, 0, 0, 0, 0, 0],
        ["L2", "a", 0, 0, 0, 0, 0, 0],
        ["L1", "b", 1, 7, 4, 1, 0, 6],
        ["L1", "a", 2, 7, 4, 2, 1, 4],
    ]
    assert table["median"].tolist() == pytest.approx([np.nan, np.nan, 2, 5.5], nan_ok=True)
    assert table["agree_percent"].tolist() == pytest.approx([np.nan, np.nan, 0, 100], nan_ok=True)


def shares(row: pd.Series) -> tuple[float, float, float]:
    low = row["count_1"] + row["count_2"] + row["count_3"]
    return 100 * low / row["n"], 100 * row["count_4"] / row["n"], row["agree_percent"]


@pytest.mark.parametrize("item", LIKERT)
def test_published_shares_of_answers_some_of_which_are_missing(item: str) -> None:
    counts, people, *expected = LIKERT[item]
    row = row_of(list(np.repeat(np.arange(1, 6), counts)), people)
    assert (row["n"], row["missing"]) == (sum(counts), people - sum(counts))
    assert shares(row) == pytest.approx(expected, abs=5e-6)

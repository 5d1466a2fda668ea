"""Published percentages of answers (R package likert): what the figures and the exported table count."""

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.tables import measures

MATH_ANXIETY = {
    "interesting": ("25544544513441522435", 25, 10, 65),
    "uptight": ("51145224452425343353", 30, 20, 50),
    "use in future": ("35555555534353454445", 0, 20, 80),
    "blank": ("41223113253215224151", 60, 15, 25),
    "relates": ("24443554224352454415", 25, 10, 65),
    "worry": ("41233125454314134242", 40, 20, 40),
    "sinking": ("41234114453311144241", 45, 15, 40),
    "challenging": ("51334535454425244444", 15, 15, 70),
    "nervous": ("51224214453315134242", 45, 15, 40),
    "more classes": ("44231323311241522334", 45, 30, 25),
    "uneasy": ("51224214453315134341", 40, 20, 40),
    "favourite": ("14331442311241512313", 50, 25, 25),
    "enjoy": ("24332443311241522335", 40, 30, 30),
    "confused": ("41234124254415245343", 35, 15, 50),
}

# What 66,690 pupils read: counts of five levels, answered; low, neutral, high.
READING = {
    "magazines": ((6682, 13143, 13995, 20353, 11436), 30.21689, 21.33091, 48.45219),
    "newspapers": ((12317, 12141, 10314, 15645, 15165), 37.29377, 15.72688, 46.97935),
    "fiction": ((11131, 16164, 12818, 14569, 10658), 41.77380, 19.61739, 38.60882),
    "comic books": ((24019, 16789, 10317, 9489, 4751), 62.43096, 15.78368, 21.78536),
    "non-fiction": ((20145, 19961, 12768, 8797, 3622), 61.42466, 19.55493, 19.02042),
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

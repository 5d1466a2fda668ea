"""Ratings of any length: counts of all points, median, quartiles."""

from typing import Final

import pandas as pd

from study_app.analysis.measures.measure import Measure, Numbers, counts_of_missing, given, quartile_cells
from study_app.analysis.tables.asked_questions import AskedQuestion
from study_app.analysis.tables.measures import quartiles_or_none


def _of(asked: AskedQuestion, answers: pd.DataFrame) -> Numbers:
    chosen = given(answers)["response"].value_counts()
    low, middle, high = quartiles_or_none(given(answers)["value"].to_numpy(dtype=float))
    return {
        **counts_of_missing(answers),
        "counts": {point: int(chosen.get(point, 0)) for point in asked.levels},
        "median": middle,
        "q1": low,
        "q3": high,
    }


def _cells(_asked: AskedQuestion, numbers: Numbers) -> dict[str, str]:
    return {
        **{point: str(count) for point, count in numbers["counts"].items()},
        "n": str(numbers["n"]),
        "missing": str(numbers["missing"] + numbers["cannot_judge"]),
        **quartile_cells(numbers),
    }


MEASURE: Final = Measure("rating", _of, _cells)

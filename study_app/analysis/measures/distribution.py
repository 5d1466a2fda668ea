"""Sliders and numbers: median, quartiles, range."""

from typing import Final

import pandas as pd

from study_app.analysis.measures.measure import Measure, Numbers, counts_of_missing, given, quartile_cells
from study_app.analysis.results.words import number
from study_app.analysis.tables.asked_questions import AskedQuestion
from study_app.analysis.tables.measures import quartiles_or_none


def _of(_asked: AskedQuestion, answers: pd.DataFrame) -> Numbers:
    values = given(answers)["value"].to_numpy(dtype=float)
    low, middle, high = quartiles_or_none(values)
    return {
        **counts_of_missing(answers),
        "median": middle,
        "q1": low,
        "q3": high,
        "smallest": float(values.min()) if len(values) else None,
        "largest": float(values.max()) if len(values) else None,
        "values": sorted(float(value) for value in values),
    }


def _cells(_asked: AskedQuestion, numbers: Numbers) -> dict[str, str]:
    least, most = numbers["smallest"], numbers["largest"]
    return {
        "n": str(numbers["n"]),
        "missing": str(numbers["missing"]),
        **quartile_cells(numbers),
        "range": "–" if least is None else f"{number(least, 1)} – {number(most, 1)}",
    }


MEASURE: Final = Measure("distribution", _of, _cells)

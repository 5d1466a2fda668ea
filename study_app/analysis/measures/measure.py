"""A measure of the answers to one question: what it computes, and how a table shows it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import pandas as pd

from study_app.analysis.results.words import number
from study_app.analysis.tables.asked_questions import AskedQuestion

Numbers: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Measure:
    """A measure.

    ``of`` returns the numbers of a group of answers, by name: rows with ``response``, ``value`` and ``cannot_judge``.
    ``cells`` returns the cells of a table's row by their headings; a measure without any lists its ``texts``.
    """

    id: str
    of: Callable[[AskedQuestion, pd.DataFrame], Numbers]
    cells: Callable[[AskedQuestion, Numbers], Mapping[str, str]] | None


def given(answers: pd.DataFrame) -> pd.DataFrame:
    """Return the answers that were given, without those off the scale."""
    return answers[answers["response"].notna()]


def counts_of_missing(answers: pd.DataFrame) -> dict[str, Any]:
    """Return how many answers and participants there are, and how many answers are missing or off the scale."""
    valid = given(answers)
    cannot_judge = int(answers["cannot_judge"].sum())
    return {
        "n": len(valid),
        "participants": int(valid["participant"].nunique()),
        "cannot_judge": cannot_judge,
        "missing": len(answers) - len(valid) - cannot_judge,
    }


def quartile_cells(numbers: Numbers) -> dict[str, str]:
    """Return median and quartiles as cells."""
    low, high = numbers["q1"], numbers["q3"]
    return {
        "median": number(numbers["median"], 1),
        "quartiles": "–" if low is None else f"{number(low, 1)} – {number(high, 1)}",
    }

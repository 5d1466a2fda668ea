"""Measures of single statements: counts of all seven levels, medians, quartiles, agreement.

Answers to one statement are ordinal, so no means are calculated. Quartiles are interpolated linearly (Hyndman & Fan
1996, type 7: numpy's default). All seven levels are listed, even those that nobody chose.
"""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

LEVELS: Final = (1, 2, 3, 4, 5, 6, 7)
NEUTRAL: Final = 4
AGREEMENT: Final = (5, 6, 7)
QUARTILES: Final = "linear interpolation (Hyndman & Fan type 7)"
COUNT_COLUMNS: Final = tuple(f"count_{level}" for level in LEVELS)
COLUMNS: Final = (
    "code", "item", "participants", "presented", "presented_excluded", "n", "cannot_judge", "missing",
    *COUNT_COLUMNS, "median", "q1", "q3", "agree_percent",
)  # fmt: skip


def aggregate(
    answers: pd.DataFrame,
    presented: Mapping[str, int],
    codes: Sequence[str],
    items: Sequence[str],
    excluded: Mapping[str, int] = MappingProxyType({}),
) -> pd.DataFrame:
    """Summarise the valid answers by setting and statement, in the order of ``codes`` and then of ``items``.

    ``answers`` have ``participant``, ``code``, ``item``, ``response`` (1 to 7 or missing) and ``cannot_judge``;
    ``presented`` is how often each setting was presented with its questionnaire, ``excluded`` how often in excluded
    trials. Returns ``COLUMNS``; statistics without answers are NaN.
    """
    groups = answers.groupby(["code", "item"], sort=False).indices
    filled = answers["response"].astype("Float64").to_numpy(na_value=np.nan)
    responses = np.asarray(filled, dtype=np.float64)
    cannot_judge = answers["cannot_judge"].astype("boolean").to_numpy(dtype=bool, na_value=False)
    people, no_rows = answers["participant"].to_numpy(), np.zeros(0, np.intp)
    rows = []
    for code in codes:
        for item in items:
            indices = groups.get((code, item), no_rows)
            measured = _statement_measures(
                responses[indices], people[indices], int(cannot_judge[indices].sum()), presented.get(code, 0)
            )
            rows.append({"code": code, "item": item, "presented_excluded": excluded.get(code, 0), **measured})
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _statement_measures(responses: Array, people: NDArray[Any], cannot_judge: int, presented: int) -> dict[str, float]:
    is_given = ~np.isnan(responses)
    values = responses[is_given]
    return {
        "participants": len(set(people[is_given])),
        "presented": presented,
        "n": len(values),
        "cannot_judge": cannot_judge,
        "missing": presented - len(values) - cannot_judge,
        **{column: int((values == level).sum()) for column, level in zip(COUNT_COLUMNS, LEVELS, strict=True)},
        **quartiles(values)._asdict(),
        "agree_percent": 100 * float(np.isin(values, AGREEMENT).mean()) if len(values) else float("nan"),
    }


class Quartiles(NamedTuple):
    """Median, lower and upper quartile."""

    median: float
    q1: float
    q3: float


class QuartilesOrNone(NamedTuple):
    """`Quartiles` with None for NaN."""

    median: float | None
    q1: float | None
    q3: float | None


def quartiles(values: Array) -> Quartiles:
    """Return the quartiles of ``values`` (n,), ignoring NaN; NaN if no values remain."""
    valid = values[~np.isnan(values)]
    if not len(valid):
        return Quartiles(median=math.nan, q1=math.nan, q3=math.nan)
    q1, median, q3 = np.quantile(valid, (0.25, 0.5, 0.75), method="linear").tolist()
    return Quartiles(median=median, q1=q1, q3=q3)


def quartiles_or_none(values: Array) -> QuartilesOrNone:
    """Return the result of `quartiles` with None instead of NaN."""
    computed = quartiles(values)
    if math.isnan(computed.median):
        return QuartilesOrNone(median=None, q1=None, q3=None)
    return QuartilesOrNone(median=computed.median, q1=computed.q1, q3=computed.q3)


def number_or_none(value: Any) -> float | None:
    """Return a table cell as a number, None if it is missing."""
    return None if pd.isna(value) else float(value)


def presentations(
    answers: pd.DataFrame, participants: Sequence[str], columns: Mapping[str, int], item: str
) -> tuple[Array, Array]:
    """Return all answers to a statement (participants, settings, presentations), and their sessions (same shape).

    ``columns`` maps codes to columns; codes with the same column are presentations of one setting. They are ordered by
    session and trial; missing answers are NaN.
    """
    chosen = answers[(answers["item"] == item) & answers["response"].notna()]
    chosen = chosen.sort_values(["session", "trial"], kind="stable")
    rows = {participant: row for row, participant in enumerate(participants)}
    people = np.array([rows[str(participant)] for participant in chosen["participant"]], dtype=np.int64)
    places = np.array([columns[str(code)] for code in chosen["code"]], dtype=np.int64)
    settings = len(set(columns.values()))
    number = chosen.groupby([people, places]).cumcount().to_numpy() if len(chosen) else people
    shape = (len(participants), settings, int(number.max()) + 1 if len(number) else 1)
    values, sessions = np.full(shape, np.nan), np.full(shape, np.nan)
    values[people, places, number] = chosen["response"].to_numpy(dtype=float)
    sessions[people, places, number] = chosen["session"].to_numpy(dtype=float)
    return values, sessions


def medians(values: Array) -> Array:
    """Return the medians (participants, settings) of (participants, settings, presentations), NaN without answers."""
    if values.shape[2] == 1:
        return values[..., 0]
    is_given = ~np.isnan(values)
    result = np.full(values.shape[:2], np.nan)
    has_answers = is_given.any(axis=2)
    result[has_answers] = np.nanmedian(values[has_answers], axis=1)
    return result


def by_participant(answers: pd.DataFrame, participants: Sequence[str], columns: Mapping[str, int], item: str) -> Array:
    """Return one value per participant and setting (participants, settings) for a statement: see `presentations`.

    It is the median over repeated presentations, NaN if a participant gave no valid answer.
    """
    return medians(presentations(answers, participants, columns, item)[0])

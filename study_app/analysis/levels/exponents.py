"""Exponents of participants and groups.

The exponent is that of Stevens' power law, answer ∝ levelⁿ (Stevens 1957, Psychological Review 64, 153), or that of the
JND as a function of the standard: 1 means Weber's law, JND ∝ standard, and 0 a constant JND.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.data.study_tables import Study
from study_app.analysis.levels.statistic import (
    INTERVAL_2,
    PARTICIPANT_COLUMNS,
    LevelStatistic,
    TableColumn,
    group_mean_row,
    interval_phrase,
)
from study_app.analysis.levels.thresholds import ThresholdEstimate, Thresholds
from study_app.analysis.results import LevelsResult
from study_app.analysis.wording import counted, number


@dataclass(frozen=True, slots=True, kw_only=True)
class ExponentEstimate:
    """A participant's exponent: of a power law over ``n`` levels, or of the JND over ``n`` standards.

    If ``participant`` is None, it is the mean over ``n`` participants, with its 95 % interval by Student's t.
    """

    participant: str | None
    n: int
    exponent: float
    low: float | None = None
    high: float | None = None


def estimate_slope(levels: ArrayLike, answers: ArrayLike) -> float:
    """Return the least-squares slope of the mean ln answer at each level on ln level.

    Parameters
    ----------
    levels, answers : (n,) array
        Level and answer of each trial, at two or more different levels, all above zero.
    """
    log_levels, log_answers = (np.log(np.asarray(values, float)) for values in (levels, answers))
    unique_levels, level_index = np.unique(log_levels, return_inverse=True)
    means = np.bincount(level_index, log_answers) / np.bincount(level_index)
    return float(np.polyfit(unique_levels, means, 1)[0])


def estimated_exponents(block: LevelBlock, opened: pd.DataFrame) -> Iterator[ExponentEstimate]:
    """Yield the exponent of the group, followed by those of the participants with answers at two levels or more.

    The level of trials with the same requested level is the mean of their delivered levels.
    """
    if block.design.reply != "number":
        return
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & (opened["value"] > 0) & (opened["level"] > 0)]
    estimates = []
    for person, person_rows in rows.groupby("participant", sort=True):
        requested = person_rows["level"].astype(float)
        delivered = person_rows["level_delivered"].astype(float).groupby(requested).transform("mean")
        levels = delivered.where(delivered > 0, requested).to_numpy()
        if (count := len(np.unique(levels))) >= 2:
            estimates.append(
                ExponentEstimate(
                    participant=str(person),
                    n=count,
                    exponent=estimate_slope(levels, person_rows["value"].astype(float)),
                )
            )
    if estimates:
        yield group_mean_row(estimates, "exponent")
    yield from estimates


def jnd_slope(standards: ArrayLike, jnds: ArrayLike) -> float:
    """Return the least-squares slope of ln JND on ln standard.

    Parameters
    ----------
    standards, jnds : (k,) array
        Two or more different standards, and the JND at each, all above zero, in the same unit.
    """
    slope, _ = np.polyfit(np.log(np.asarray(standards, float)), np.log(np.asarray(jnds, float)), 1)
    return float(slope)


def weber_exponents(thresholds: Sequence[ThresholdEstimate], level_kind: str) -> Iterator[ExponentEstimate]:
    """Yield the exponent of the group, followed by those of the participants with thresholds at two standards or more.

    The JND is the Weber fraction times the standard, or the difference itself; levels that are values have no JND.
    """
    if level_kind == "value":
        return
    estimates = []
    for person in dict.fromkeys(threshold.participant for threshold in thresholds if threshold.participant is not None):
        jnds = [
            (threshold.standard, threshold.threshold * (threshold.standard if level_kind == "weber" else 1.0))
            for threshold in thresholds
            if threshold.participant == person
            and threshold.standard is not None
            and threshold.standard > 0
            and threshold.threshold > 0
        ]
        if len(jnds) >= 2:
            estimates.append(ExponentEstimate(participant=person, n=len(jnds), exponent=jnd_slope(*np.array(jnds).T)))
    if estimates:
        yield group_mean_row(estimates, "exponent")
    yield from estimates


class Exponents(LevelStatistic[ExponentEstimate]):
    """Exponents of the power law, or Weber exponents: that of the group, followed by those of its participants."""

    key = "exponents"
    place = 3
    table = "exponents"

    compute = staticmethod(
        lambda block, opened, _study, found: (
            *estimated_exponents(block, opened),
            *weber_exponents(Thresholds.rows_in(found), found.level_kind or "value"),
        )
    )

    @classmethod
    def is_exported_in(cls, study: Study) -> bool:
        return any(block.design.reply == "number" for block in study.levels)

    def export_rows(self) -> Iterator[Mapping[str, Any]]:
        for row in super().export_rows() if self._is_power_law else ():
            (estimate,) = (estimate for estimate in self.rows if estimate.participant == row["participant"])
            yield {**row, "levels": estimate.n}

    @property
    def _is_power_law(self) -> bool:
        return self.result.summary == "geometric mean"

    @property
    def name(self) -> str:
        """The name of the exponents."""
        return "exponent of the power law" if self._is_power_law else "Weber exponent"

    def heading(self) -> str:
        return self.name[0].upper() + self.name[1:]

    def table_columns(self) -> Sequence[TableColumn]:
        over = "standards" if Thresholds.rows_in(self.result) else "levels"
        participant, (_, n) = PARTICIPANT_COLUMNS
        return participant, (over, n), ("exponent", lambda row: number(row.exponent)), INTERVAL_2

    def explanation(self) -> str:
        if Thresholds.rows_in(self.result):
            return (
                "The exponent is the least-squares slope of ln JND on ln standard across a participant's standards; "
                "the just-noticeable difference (JND) is the threshold in the unit of the standard. An exponent of 1 "
                "means Weber’s law (the JND is proportional to the standard), and 0 means a constant JND. The group "
                "value is the mean across participants with a t-based confidence interval."
            )
        units = "; it does not depend on the unit that a participant chose" if self.result.own_units else ""
        return (
            "The exponent n of answer ∝ levelⁿ (Stevens 1957) is the least-squares slope of a participant’s "
            f"mean ln answer at each level on ln level, at the levels delivered to the hand{units}. The group value is "
            "the mean across participants with a t-based confidence interval."
        )

    def is_comparable_with(self, measure: str) -> bool:
        return measure == "exponent"

    def sentences(self) -> Iterator[str]:
        weber = bool(Thresholds.rows_in(self.result))
        name = self.name if weber else f"{self.name} for {self.result.quantity}"
        meaning = "; 1 is Weber’s law, 0 is a constant JND" if weber else ""
        for row in self.rows:
            if row.participant is None:
                yield (
                    f"{self.result.title}: {name} {number(row.exponent)} ({interval_phrase(row, number)}; "
                    f"{counted(row.n, 'participant')}){meaning}."
                )

    @classmethod
    def common_methods(cls, blocks: Sequence[LevelsResult]) -> Iterator[str]:
        with_exponents = [block for block in blocks if cls.rows_in(block)]
        if any(result.summary == "geometric mean" for result in with_exponents):
            yield (
                "The exponent of magnitude estimation (Stevens 1957) is the least-squares slope of each participant’s "
                "mean ln answer at each level on ln level; the group exponent is the mean with a 95 % confidence "
                "interval (Student’s t)."
            )
        if any(map(Thresholds.rows_in, with_exponents)):
            yield (
                "The Weber exponent is the least-squares slope of each participant’s ln JND on ln standard; the group "
                "exponent is the mean with a 95 % confidence interval (Student’s t)."
            )

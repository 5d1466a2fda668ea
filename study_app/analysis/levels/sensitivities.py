"""Sensitivity and bias over all levels of a standard, for each comparison, or for each level against the lowest."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.data.measures import number_or_none
from study_app.analysis.levels.columns import RESULTS
from study_app.analysis.levels.exponents import Exponents
from study_app.analysis.levels.statistic import (
    INTERVAL_2,
    PARTICIPANT_COLUMNS,
    LevelStatistic,
    TableColumn,
    analysed_rows,
    cell_text,
    group_mean_row,
    unit,
)
from study_app.analysis.levels.thresholds import Thresholds
from study_app.analysis.results import LevelsResult
from study_app.analysis.statistics.outcome import clopper_pearson
from study_app.analysis.wording import listed, number
from study_app.protocol.trials import Design
from study_app.psychophysics.detection import Model, Sensitivity, d_prime_at, rating
from study_app.psychophysics.grid import Z_95

_MODELS: Final = {
    "differencing": " d′ is calculated with the differencing model, because standards vary from trial to trial.",
    "independent": " d′ is calculated with the independent-observation model; in the exported thresholds table, the "
    "column d_prime_other contains d′ for the differencing model.",
}
_FROM_SHARE_CORRECT: Final = ("abx", "oddity", "3ifc", "4ifc")
"""Designs in which the proportion of correct answers alone determines d′."""
_BIASES: Final = {
    "2ifc": " c is positive if participants are biased towards the second interval.",
    "yesno": " c is positive if participants are biased towards answering “no”.",
    "samedifferent": " k is the perceived difference above which participants answer “different”.",
    **dict.fromkeys(
        _FROM_SHARE_CORRECT,
        " d′ is calculated from the proportion correct, assuming that participants do not have a response bias. A "
        "bias, which would show as unequal proportions of the possible answers, causes d′ to be underestimated. The "
        "confidence interval for each participant's d′ is derived from the Clopper–Pearson interval for the proportion "
        "correct; it cannot be calculated if all or no answers are correct. Below chance, d′ is negative, with the "
        "size of the d′ for a proportion equally far above chance, so the mean is 0 if participants guess. A small "
        "mean d′ is underestimated if there are few trials.",
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SensitivityEstimate:
    """A participant's sensitivity and bias or (``participant`` None) their means over ``n`` participants.

    They apply to a ``standard``, to a condition as ``comparison``, or to the ratings at a ``level`` against the lowest
    level. ``shares`` are the proportions of each answer. The 95 % interval of ``d_prime`` is from its variance, if
    known, or from the proportion of correct answers; the group's is from Student's t. ``criterion`` is c, or k for
    same–different; ``other`` is d′ under the model that is not ``model``.
    """

    participant: str | None
    n: int
    shares: Mapping[str, float]
    standard: float | None = None
    comparison: str | None = None
    level: float | None = None
    d_prime: float | None = None
    low: float | None = None
    high: float | None = None
    criterion: float | None = None
    model: str | None = None
    other: float | None = None


_BIASED: Final = 0.2
"""The smallest criterion in two-interval designs that is reported as a preference."""


def preferences(estimates: Iterable[SensitivityEstimate]) -> dict[str, float]:
    """Return the mean criterion over all standards of each participant who prefers one of two intervals.

    A participant prefers an interval if the criterion differs from 0 by more than `_BIASED` and twice its standard
    error.
    """
    counts = dict[str, list[tuple[float, float]]]()
    for estimate in estimates:
        if (
            estimate.participant is None
            or estimate.criterion is None
            or estimate.d_prime is None
            or estimate.high is None
        ):
            continue
        # Rows with a criterion have an interval of d′, whose error is √2 times that of the criterion.
        error = (estimate.high - estimate.d_prime) / Z_95 / math.sqrt(2)
        counts.setdefault(estimate.participant, []).append((estimate.criterion, error))
    means = {person: np.mean([criterion for criterion, _ in rows]) for person, rows in counts.items()}
    errors = {person: math.hypot(*(error for _, error in rows)) / len(rows) for person, rows in counts.items()}
    return {person: float(mean) for person, mean in means.items() if abs(mean) > max(_BIASED, 2 * errors[person])}


def sensitivities(block: LevelBlock, opened: pd.DataFrame) -> Iterator[SensitivityEstimate]:
    """Yield the group's sensitivity for each standard, condition or level, then that of its participants."""
    rows = analysed_rows(block, opened)
    match block.design.reply:
        case "choice":
            by = "standard" if block.stimulus is not None else "track"
            for key, group in rows.groupby(by, dropna=False, sort=True):
                where = {"standard": number_or_none(key)} if by == "standard" else {"comparison": str(key)}
                people = group.groupby("participant", sort=True)
                yield from _add_group_means(
                    [_estimate_from_choices(block, str(person), frame, where) for person, frame in people]
                )
        case "rating":
            lowest, *levels = sorted(rows["level"].dropna().unique()) or [None]
            for level in levels:
                people = rows.groupby("participant", sort=True)
                estimates = [_estimate_from_ratings(str(person), frame, lowest, level) for person, frame in people]
                yield from _add_group_means([estimate for estimate in estimates if estimate is not None])
        case "number" | "setting":
            return


def _add_group_means(estimates: Sequence[SensitivityEstimate]) -> Iterator[SensitivityEstimate]:
    """Yield the means over participants, followed by the values of each."""
    if estimates:
        proportions = {
            answer: float(np.mean([estimate.shares[answer] for estimate in estimates]))
            for answer in estimates[0].shares
        }
        yield replace(group_mean_row(estimates, "d_prime", "criterion", "other"), shares=proportions)
    yield from estimates


def _estimate_from_ratings(person: str, rows: pd.DataFrame, lowest: float, level: float) -> SensitivityEstimate | None:
    noise, signal = (rows.loc[rows["level"] == at, "value"].dropna().to_numpy(float) for at in (lowest, level))
    sensitivity = rating(noise, signal)
    estimate = SensitivityEstimate(participant=person, n=len(noise) + len(signal), shares={}, level=float(level))
    return None if sensitivity is None else _add_sensitivity(estimate, sensitivity)


def _estimate_from_choices(
    block: LevelBlock, person: str, rows: pd.DataFrame, where: Mapping[str, float | str | None]
) -> SensitivityEstimate:
    design = block.design
    pairs = zip(rows["arrangement"].astype(str), rows["response"].astype(str), strict=True)
    counts = Counter((design.arrangement_of(letters), answer) for letters, answer in pairs)
    answer_counts = Counter(rows["response"].astype(str))
    sensitivity = design.sensitivity(counts, roving=block.standards_rove) if block.has_correct_answer else None
    proportions = {answer: answer_counts[answer] / len(rows) for answer in design.answers}
    estimate = SensitivityEstimate(participant=person, n=len(rows), shares=proportions, **where)  # type: ignore[arg-type]  # standard or comparison
    if sensitivity is None:
        return estimate
    with_d_prime = _add_sensitivity(estimate, sensitivity)
    return (
        _add_interval(with_d_prime, design, counts, sensitivity.model)
        if design.kind in _FROM_SHARE_CORRECT
        else with_d_prime
    )


def _add_interval(
    estimate: SensitivityEstimate, design: Design, counts: Mapping[tuple[int, str], int], model: Model | None
) -> SensitivityEstimate:
    """Return an estimate with the d′ interval from the proportion correct; unchanged if all or none are correct."""
    correct, n = design.correct_of(counts)
    if correct in (0, n):
        return estimate
    proportion, task = clopper_pearson(correct, n), f"{design.kind}{f' {model}' if model else ''}"
    return replace(estimate, low=d_prime_at(task, proportion.low), high=d_prime_at(task, proportion.high))


def _add_sensitivity(estimate: SensitivityEstimate, sensitivity: Sensitivity) -> SensitivityEstimate:
    half = math.nan if sensitivity.variance is None else Z_95 * math.sqrt(sensitivity.variance)
    return replace(
        estimate,
        d_prime=sensitivity.d_prime,
        low=number_or_none(sensitivity.d_prime - half),
        high=number_or_none(sensitivity.d_prime + half),
        criterion=sensitivity.criterion,
        model=sensitivity.model,
        other=sensitivity.other,
    )


def _is_perfect(estimate: SensitivityEstimate) -> bool:
    """Return whether all answers were correct, so that d′ from the proportion of correct answers has no interval."""
    return estimate.d_prime is not None and estimate.d_prime > 0 and estimate.high is None


def _condition_text(estimate: SensitivityEstimate) -> str:
    return cell_text(estimate.comparison or (estimate.level if estimate.standard is None else estimate.standard))


class Sensitivities(LevelStatistic[SensitivityEstimate]):
    """d′ and criterion of the group and of each participant.

    The exported table has all estimates of a participant at a standard, including thresholds.
    """

    key = "sensitivities"
    place = 4
    title = "Sensitivity and bias"
    table = "thresholds"

    compute = staticmethod(lambda block, opened, _study, _found: sensitivities(block, opened))

    def export_rows(self) -> Iterator[Mapping[str, Any]]:
        exponents = {exponent.participant: exponent.exponent for exponent in Exponents.rows_in(self.result)}
        thresholds = {
            (threshold.participant, threshold.standard): threshold
            for threshold in Thresholds.participant_rows(self.result)
        }
        columns = RESULTS[self.table].columns
        for estimate in self.participant_rows(self.result):
            if estimate.level is not None:
                continue
            row = {column.name: getattr(estimate, column.name, None) for column in columns}
            row |= {"low": None, "high": None, "participant": estimate.participant, "block": self.result.block}
            if (
                estimate.comparison is None
                and (threshold := thresholds.get((estimate.participant, estimate.standard))) is not None
            ):
                known = {column.name: getattr(threshold, column.name, None) for column in columns}
                row |= {name: value for name, value in known.items() if value is not None}
                row |= {
                    "flat_width_threshold": threshold.flat_width,
                    "weber_exponent": exponents.get(estimate.participant),
                }
            yield row | {
                "condition": estimate.comparison,
                "d_prime_model": estimate.model,
                "d_prime_other": estimate.other,
                "share_first": next(iter(estimate.shares.values()), None),
            }

    def table_columns(self) -> Sequence[TableColumn]:
        first = self.rows[0]
        where = "Comparison" if first.level is None else "Level"
        has_d_prime = any(row.d_prime is not None for row in self.rows)
        has_criterion = any(row.criterion is not None for row in self.rows)
        answers = tuple(first.shares)
        proportions: list[TableColumn] = [
            (f"“{answer.replace('_', ' ')}”", lambda row, answer=answer: f"{100 * row.shares[answer]:.0f} %")  # type: ignore[misc]
            for answer in (answers[:1] if len(answers) == 2 else answers)
        ]
        return (
            (where if first.standard is None else f"Standard{unit(self.result)}", _condition_text)
            if len(set(map(_condition_text, self.rows))) > 1
            else None,
            *PARTICIPANT_COLUMNS,
            ("d′", lambda row: number(row.d_prime)) if has_d_prime else None,
            INTERVAL_2 if has_d_prime else None,
            ("k" if self.result.design == "samedifferent" else "c", lambda row: number(row.criterion))
            if has_criterion
            else None,
            *proportions,
        )

    def limits(self) -> Iterator[str]:
        if self.result.design in _FROM_SHARE_CORRECT and (
            perfect := list(filter(_is_perfect, self.participant_rows(self.result)))
        ):
            several = len(set(map(_condition_text, self.participant_rows(self.result)))) > 1
            people = listed(
                [f"{row.participant} ({_condition_text(row)})" if several else str(row.participant) for row in perfect]
            )
            yield (
                f"{self.result.title}: {people} answered all trials correctly, so these values of d′ are lower limits "
                "that depend on the number of trials."
            )
        if self.result.design != "2ifc" or self.result.vary is None:
            return
        if biased := preferences(self.participant_rows(self.result)):
            people = listed([f"{person} ({number(criterion)})" for person, criterion in biased.items()])
            yield (
                f"{self.result.title}: {people} showed a bias towards one interval (the absolute value of the "
                f"criterion c is above {_BIASED:g} and more than twice its standard error). Their threshold fits allow "
                "for this bias."
            )

    def explanation(self) -> str:
        proportions = "Percentages show how often each answer was given." if self.rows[0].shares else ""
        if all(row.d_prime is None for row in self.rows):
            return proportions
        over = "across all presented levels" if self.result.vary is not None else "for each comparison"
        if self.result.summary == "mean":
            over = "for each level relative to the lowest (d_a from the area under the ROC curve)"
        has_bias = self.result.design in _FROM_SHARE_CORRECT or any(row.criterion is not None for row in self.rows)
        bias, model = _BIASES.get(self.result.design, "") if has_bias else "", _MODELS.get(self.rows[0].model or "", "")
        return (
            f"d′ {over}, calculated from rates with the log-linear correction (Hautus 1995; Macmillan & Creelman "
            f"2005); the group value is the mean across participants with a t-based confidence interval.{model}{bias} "
            f"{proportions}"
        ).rstrip()

    @classmethod
    def common_methods(cls, blocks: Sequence[LevelsResult]) -> Iterator[str]:
        if any(estimate.d_prime is not None for block in blocks for estimate in cls.rows_in(block)):
            yield (
                "Sensitivity is expressed as d′, calculated from rates with the log-linear correction (Hautus 1995) "
                "using the model for each design (Macmillan & Creelman 2005)."
            )

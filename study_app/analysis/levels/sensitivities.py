"""Sensitivity and bias: over all levels of a standard, for each comparison, or for each level against the lowest."""

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
    OF_WHOM,
    LevelStatistic,
    Shown,
    analysed,
    cell_text,
    mean_over,
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
"""Designs whose d′ follows from the share of correct answers alone."""
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

    They are for a ``standard``, a condition as ``comparison``, or ratings at a ``level`` against the lowest. ``shares``
    are those of each answer. ``d_prime`` has a 95 % interval from its variance if known, or from the share correct; the
    group's is Student's t. ``criterion`` is c, or k for same–different; ``other`` is d′ under the model that is not
    ``model``.
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
"""A criterion of two intervals beyond which a preference is named."""


def preferences(of_people: Iterable[SensitivityEstimate]) -> dict[str, float]:
    """Return the mean criterion over all standards of each participant who prefers one of two intervals.

    It differs from 0 by more than `_BIASED` and by more than twice its standard error.
    """
    counts = dict[str, list[tuple[float, float]]]()
    for estimate in of_people:
        if (
            estimate.participant is None
            or estimate.criterion is None
            or estimate.d_prime is None
            or estimate.high is None
        ):
            continue
        error = (
            (estimate.high - estimate.d_prime) / Z_95 / math.sqrt(2)
        )  # rows with a criterion also have the rates of d′
        counts.setdefault(estimate.participant, []).append((estimate.criterion, error))
    means = {person: np.mean([criterion for criterion, _ in rows]) for person, rows in counts.items()}
    errors = {person: math.hypot(*(error for _, error in rows)) / len(rows) for person, rows in counts.items()}
    return {person: float(mean) for person, mean in means.items() if abs(mean) > max(_BIASED, 2 * errors[person])}


def sensitivities(block: LevelBlock, opened: pd.DataFrame) -> Iterator[SensitivityEstimate]:
    """Yield the group's sensitivity to each standard, condition or level, then that of its participants."""
    rows = analysed(block, opened)
    match block.design.reply:
        case "choice":
            by = "standard" if block.stimulus is not None else "track"
            for which, some in rows.groupby(by, dropna=False, sort=True):
                where = {"standard": number_or_none(which)} if by == "standard" else {"comparison": str(which)}
                people = some.groupby("participant", sort=True)
                yield from _add_group_means(
                    [_estimate_from_choices(block, str(person), frame, where) for person, frame in people]
                )
        case "rating":
            lowest, *levels = sorted(rows["level"].dropna().unique()) or [None]
            for level in levels:
                people = rows.groupby("participant", sort=True)
                own = [_estimate_from_ratings(str(person), frame, lowest, level) for person, frame in people]
                yield from _add_group_means([estimate for estimate in own if estimate is not None])
        case "number" | "setting":
            return


def _add_group_means(own: Sequence[SensitivityEstimate]) -> Iterator[SensitivityEstimate]:
    """Yield the means over participants, followed by the values of each."""
    if own:
        shares = {answer: float(np.mean([estimate.shares[answer] for estimate in own])) for answer in own[0].shares}
        yield replace(mean_over(own, "d_prime", "criterion", "other"), shares=shares)
    yield from own


def _estimate_from_ratings(person: str, rows: pd.DataFrame, lowest: float, level: float) -> SensitivityEstimate | None:
    noise, signal = (rows.loc[rows["level"] == at, "value"].dropna().to_numpy(float) for at in (lowest, level))
    sensitivity = rating(noise, signal)
    estimate = SensitivityEstimate(participant=person, n=len(noise) + len(signal), shares={}, level=float(level))
    return None if sensitivity is None else _with_sensitivity(estimate, sensitivity)


def _estimate_from_choices(
    block: LevelBlock, person: str, rows: pd.DataFrame, where: Mapping[str, float | str | None]
) -> SensitivityEstimate:
    design = block.design
    pairs = zip(rows["arrangement"].astype(str), rows["response"].astype(str), strict=True)
    counts = Counter((design.arrangement_of(letters), answer) for letters, answer in pairs)
    given = Counter(rows["response"].astype(str))
    sensitivity = design.sensitivity(counts, roving=block.standards_rove) if block.has_correct_answer else None
    shares = {answer: given[answer] / len(rows) for answer in design.answers}
    estimate = SensitivityEstimate(participant=person, n=len(rows), shares=shares, **where)  # type: ignore[arg-type]  # standard or comparison
    if sensitivity is None:
        return estimate
    measured = _with_sensitivity(estimate, sensitivity)
    return (
        _add_interval(measured, design, counts, sensitivity.model) if design.kind in _FROM_SHARE_CORRECT else measured
    )


def _add_interval(
    estimate: SensitivityEstimate, design: Design, counts: Mapping[tuple[int, str], int], model: Model | None
) -> SensitivityEstimate:
    """Return an estimate with the d′ interval from that of the share correct; unchanged if all or none are correct."""
    correct, n = design.correct_of(counts)
    if correct in (0, n):
        return estimate
    share, task = clopper_pearson(correct, n), f"{design.kind}{f' {model}' if model else ''}"
    return replace(estimate, low=d_prime_at(task, share.low), high=d_prime_at(task, share.high))


def _with_sensitivity(estimate: SensitivityEstimate, sensitivity: Sensitivity) -> SensitivityEstimate:
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
    """Return whether all answers were correct: d′ from the share correct then has no interval."""
    return estimate.d_prime is not None and estimate.d_prime > 0 and estimate.high is None


def _where(estimate: SensitivityEstimate) -> str:
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

    def exported(self) -> Iterator[Mapping[str, Any]]:
        exponents = {exponent.participant: exponent.exponent for exponent in Exponents.of(self.found)}
        thresholds = {
            (threshold.participant, threshold.standard): threshold for threshold in Thresholds.own(self.found)
        }
        columns = RESULTS[self.table].columns
        for estimate in self.own(self.found):
            if estimate.level is not None:
                continue
            row = {column.name: getattr(estimate, column.name, None) for column in columns}
            row |= {"low": None, "high": None, "participant": estimate.participant, "block": self.found.block}
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

    def shown(self) -> Sequence[Shown]:
        first = self.rows[0]
        where = "Comparison" if first.level is None else "Level"
        measured = any(row.d_prime is not None for row in self.rows)
        biased = any(row.criterion is not None for row in self.rows)
        answers = tuple(first.shares)
        shares: list[Shown] = [
            (f"“{answer.replace('_', ' ')}”", lambda row, answer=answer: f"{100 * row.shares[answer]:.0f} %")  # type: ignore[misc]
            for answer in (answers[:1] if len(answers) == 2 else answers)
        ]
        return (
            (where if first.standard is None else f"Standard{unit(self.found)}", _where)
            if len(set(map(_where, self.rows))) > 1
            else None,
            *OF_WHOM,
            ("d′", lambda row: number(row.d_prime)) if measured else None,
            INTERVAL_2 if measured else None,
            ("k" if self.found.design == "samedifferent" else "c", lambda row: number(row.criterion))
            if biased
            else None,
            *shares,
        )

    def limits(self) -> Iterator[str]:
        if self.found.design in _FROM_SHARE_CORRECT and (perfect := list(filter(_is_perfect, self.own(self.found)))):
            several = len(set(map(_where, self.own(self.found)))) > 1
            people = listed(
                [f"{row.participant} ({_where(row)})" if several else str(row.participant) for row in perfect]
            )
            yield (
                f"{self.found.title}: {people} answered all trials correctly, so these values of d′ are lower limits "
                "that depend on the number of trials."
            )
        if self.found.design != "2ifc" or self.found.vary is None:
            return
        if biased := preferences(self.own(self.found)):
            people = listed([f"{person} ({number(criterion)})" for person, criterion in biased.items()])
            yield (
                f"{self.found.title}: {people} showed a bias towards one interval (the absolute value of the "
                f"criterion c is above {_BIASED:g} and more than twice its standard error). Their threshold fits allow "
                "for this bias."
            )

    def explained(self) -> str:
        shares = "Percentages show how often each answer was given." if self.rows[0].shares else ""
        if all(row.d_prime is None for row in self.rows):
            return shares
        over = "across all presented levels" if self.found.vary is not None else "for each comparison"
        if self.found.summary == "mean":
            over = "for each level relative to the lowest (d_a from the area under the ROC curve)"
        has_bias = self.found.design in _FROM_SHARE_CORRECT or any(row.criterion is not None for row in self.rows)
        bias, model = _BIASES.get(self.found.design, "") if has_bias else "", _MODELS.get(self.rows[0].model or "", "")
        return (
            f"d′ {over}, calculated from rates with the log-linear correction (Hautus 1995; Macmillan & Creelman "
            f"2005); the group value is the mean across participants with a t-based confidence interval.{model}{bias} "
            f"{shares}"
        ).rstrip()

    @classmethod
    def common_methods(cls, blocks: Sequence[LevelsResult]) -> Iterator[str]:
        if any(estimate.d_prime is not None for block in blocks for estimate in cls.of(block)):
            yield (
                "Sensitivity is expressed as d′, calculated from rates with the log-linear correction (Hautus 1995) "
                "using the model for each design (Macmillan & Creelman 2005)."
            )

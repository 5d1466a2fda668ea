"""Tests of a trend of answers over ordered settings, and of the lowest delay at which it can be shown.

The value of each participant is the rank correlation of the answers with the order of the settings. The main p is from
random signs of these values, so individual participants may have trends if their mean is zero. Page's test (1963, J.
Am. Stat. Assoc. 58, 216–230) permutes the answers of each participant instead: its null hypothesis is that no
participant has a trend, so its p may be small although participants have no common trend.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from study_app.analysis.statistics.outcome import (
    NO_VARIATION,
    Lattice,
    Outcome,
    Whole,
    bootstrap,
    checked_values,
    complete_rows,
    doubled_ranks,
    sum_distribution,
)
from study_app.analysis.statistics.rank_tests import Alternative, signed_p
from study_app.analysis.wording import p_value
from study_app.errors import AnalysisError
from study_app.number_text import counted

Direction: TypeAlias = Literal["increasing", "decreasing"]

EXACT_UP_TO: Final = 200
"""The most participants with an exact p of Page's test; for more, it is a normal approximation, corrected for ties."""

_MAX_SETTINGS: Final = 12
"""The most settings with an exact distribution."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend(Outcome):
    """Page's L and the p of a trend in the population; ``effect`` is the mean rank correlation with the order.

    One-sided in ``direction``, two-sided if it is None. ``p_page`` is Page's exact one-sided p given the ties (None
    without a direction). A participant with equal answers in all settings has correlation 0.
    """

    direction: Direction | None
    p_page: float | None = None


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the step-down test: the trend over all delays up to ``longest_ms``."""

    longest_ms: float
    trend: Trend


@dataclass(frozen=True, slots=True, kw_only=True)
class StepDown:
    """The steps, the longest delay first; the last may be the first non-significant one.

    ``lowest_ms`` is the lowest delay up to which a trend was shown at ``alpha``: an upper bound of the noticeable
    delay, biased upward. None means that no trend was shown, which is not evidence against one, as ``note`` explains.
    """

    steps: tuple[Step, ...]
    lowest_ms: float | None
    alpha: float
    note: str


def trend(values: ArrayLike, direction: Direction | None = "increasing", *, seed: int | None = 1) -> Trend:
    """Test for a trend of answers (participants, settings) in the order of the settings, in the stated direction.

    Participants with NaN, a missing answer, are dropped. ``direction`` None means two-sided. ``seed`` is for the
    bootstrap interval of the effect, from ten participants upwards; None: no interval.
    """
    rows, dropped = complete_rows(values, at_least=2, why=" for a trend")
    ranks = doubled_ranks(rows if direction != "decreasing" else -rows)
    n, k = ranks.shape
    scores = ranks @ np.arange(1, k + 1)
    middle = k * (k + 1) ** 2 // 2
    correlations = (scores - middle) / (k * (k * k - 1) / 6)
    test = Trend(
        test="trend over participants",
        n=n,
        dropped=dropped,
        statistic_name="L",
        effect_name="mean rank correlation with the order of the levels, not corrected for ties",
        direction=direction,
    )
    if not n or (ranks == k + 1).all():
        note = "no participant answered in all conditions" if n == 0 else NO_VARIATION
        return replace(test, no_interval=note, note=note)
    side: Alternative = "two-sided" if direction is None else "greater"
    deviations = scores - middle
    p, smallest, method = signed_p(
        np.sort(np.abs(deviations[deviations != 0])), int(deviations[deviations > 0].sum()), side
    )
    p_page = None if direction is None else _page_p(ranks, int(scores.sum()))
    constant_reason = "no interval: all participants have the same correlation"
    interval, reason = bootstrap(n, seed, lambda people: correlations[people].mean(axis=1), constant_reason)
    return replace(
        test,
        statistic=float(scores.sum()) / 2,
        p=1.0 if p is None else p,
        smallest_p=smallest,
        method=f"{method}, {'two-sided' if direction is None else f'one-sided ({direction})'}",
        effect=float(correlations.mean()),
        interval=interval,
        no_interval=reason,
        note=""
        if p_page is None
        else f"p of Page's test of the hypothesis that no participant shows a trend: {p_value(p_page)}",
        p_page=p_page,
    )


def step_down(
    values: ArrayLike, delays_ms: Sequence[float], direction: Direction | None = "increasing", *, alpha: float = 0.05
) -> StepDown:
    """Drop the longest delay repeatedly while the remaining delays show a trend.

    The order of the tests is fixed and the first non-significant one ends them, so ``alpha`` holds for all of them
    together (Tamhane, Hochberg & Dunnett 1996, Biometrics 52, 21–37). ``values`` (participants, delays) are in the
    order of ``delays_ms``, which ascend from the control. Participants with any missing answer are dropped from all
    steps.
    """
    array = checked_values(values, "participants, delays")
    if len(delays_ms) != array.shape[1] or any(a >= b for a, b in pairwise(delays_ms)):
        raise AnalysisError(
            f"the delays {list(delays_ms)} ms must be {array.shape[1]} increasing values, one for each column of "
            "answers"
        )
    rows, dropped = complete_rows(array, at_least=2, why=" for a trend")
    steps: list[Step] = []
    lowest: float | None = None
    for last in range(len(delays_ms), 1, -1):
        result = trend(np.vstack([rows[:, :last], np.full((dropped, last), np.nan)]), direction, seed=None)
        steps.append(Step(float(delays_ms[last - 1]), result))
        if result.p is None or result.p > alpha:
            break
        lowest = float(delays_ms[last - 1])
    return StepDown(steps=tuple(steps), lowest_ms=lowest, alpha=alpha, note=_step_down_note(steps[0], lowest))


def _step_down_note(first: Step, lowest: float | None) -> str:
    if lowest is None:
        return (
            f"no trend was shown up to {first.longest_ms:g} ms with {counted(first.trend.n, 'participant')}; "
            "this is not evidence that there is none"
        )
    return (
        f"{lowest:g} ms is the shortest delay at which the answers from {counted(first.trend.n, 'participant')} show a "
        "trend; it is only an upper bound, because participants may also notice shorter delays"
    )


def _page_p(ranks: Whole, observed: int) -> float:
    """Return P(L ≥ ``observed``) for (doubled) ranks (n, k), with all orders of all participants equally likely."""
    n, k = ranks.shape
    if n > EXACT_UP_TO or k > _MAX_SETTINGS:
        mean = n * k * (k + 1) ** 2 / 2
        spread = ((ranks - (k + 1.0)) ** 2).sum() / (k - 1) * k * (k * k - 1) / 12
        return float(ndtr((mean - observed) / math.sqrt(spread)))
    return _score_sum_distribution(tuple(sorted(tuple(sorted(row)) for row in ranks.tolist()))).at_least(observed)


@lru_cache(maxsize=256)
def _score_sum_distribution(patterns: tuple[tuple[int, ...], ...]) -> Lattice:
    """Return the distribution of the sum of all participants' scores from their (doubled) ranks (n × k)."""
    return sum_distribution(_score_distribution(pattern) for pattern in patterns)


@lru_cache(maxsize=1024)
def _score_distribution(ranks: tuple[int, ...]) -> Lattice:
    """Return the distribution of Σ j·rank_j over all orders of one participant's (doubled) ranks (k,).

    It is computed setting by setting, over sets of used ranks instead of orders.
    """
    k = len(ranks)
    most = sum(place * rank for place, rank in enumerate(ranks, start=1))
    ways = np.zeros((2**k, most + 1))
    ways[0, 0] = 1.0
    for used in range(2**k - 1):
        setting = used.bit_count() + 1
        for rank in (rank for rank in range(k) if not used >> rank & 1):
            shift = setting * ranks[rank]
            ways[used | 1 << rank, shift:] += ways[used, : most + 1 - shift]
    reached = np.flatnonzero(ways[-1])
    return Lattice(int(reached[0]), ways[-1, reached[0] : reached[-1] + 1] / math.factorial(k))

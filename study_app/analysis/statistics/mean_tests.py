"""Tests of means: Student's t, a bootstrap that allows for people outside the sample, and t corrected for skewness.

The bootstrap gives each participant a random weight (Rubin 1981, Ann. Stat. 9, 130–134), and also one additional
participant who equals the most extreme one in the direction that contradicts the tested hypothesis. With the end of the
scale in place of the most extreme participant this is the test of Gaffke (2005, Math. Methods Stat. 14, 451–467), which
holds for every distribution on a bounded scale. t alone is significant too often where a few people differ strongly
from the others, or where differences are skewed; Hall's transformation of t (1992, J. R. Stat. Soc. B 54, 221–228)
allows for skewness. A difference is shown only if all three tests show it, an equivalence if t and the bootstrap do.

Between groups t has the degrees of freedom of the smaller group (Hsu 1938): its error rate holds whatever the standard
deviations are, while Welch's holds approximately, and not in groups of a few participants.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Final, NamedTuple

import numpy as np
from scipy.special import stdtr, stdtrit

from study_app.analysis.statistics.outcome import Array

_RESAMPLES: Final = 1999
_MOST_RESAMPLES: Final = 100_000
_SIMULATED_STUDIES: Final = 2000
"""Simulated studies, enough to estimate the difference that 80 % of them show to about 1 %."""
_MAX_MEANS: Final = 4_000_000
"""The most resampled means that are kept in memory at once."""
_HALVINGS: Final = 20
SAME: Final = 1e-9
"""Differences whose standard error is smaller than this are treated as equal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Means:
    """The estimated mean of each study (studies,), with its standard ``error``; t has ``freedom`` degrees of freedom.

    ``third`` is the third cumulant of the estimated mean, which is not 0 if participants' numbers are skewed.
    ``lowest`` and ``highest`` are resampled means (resamples, studies), with an additional participant like the lowest
    or the highest one.
    """

    mean: Array
    error: Array
    third: Array
    freedom: int
    lowest: Array
    highest: Array

    def __sub__(self, other: Means) -> Means:
        """Return the differences from the means of an independent group."""
        return Means(
            mean=self.mean - other.mean,
            error=np.hypot(self.error, other.error),
            third=self.third - other.third,
            freedom=min(self.freedom, other.freedom),
            lowest=self.lowest - other.highest,
            highest=self.highest - other.lowest,
        )

    def widened(self, variance: float) -> Means:
        """Return the means with an additional normal error of this variance, common to all participants."""
        errors = math.sqrt(variance) * np.random.default_rng(len(self.lowest)).normal(size=(len(self.lowest), 1))
        return replace(
            self,
            error=np.hypot(self.error, math.sqrt(variance)),
            lowest=self.lowest + errors,
            highest=self.highest + errors,
        )

    def t(self, value: float = 0.0) -> Array:
        """Return t of the differences from a value; infinite if participants do not differ."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.nan_to_num((self.mean - value) / self.error, posinf=math.inf, neginf=-math.inf))

    def p_t(self, value: float = 0.0) -> Array:
        """Return Student's one-sided p (studies,) for the hypothesis that the mean is above a value."""
        flat = np.where(self.mean > value + SAME, 0.0, 1.0)
        return np.asarray(np.where(self.error > SAME, stdtr(self.freedom, -self.t(value)), flat))

    def p_skewed(self) -> Array:
        """Return the one-sided p (studies,) for a mean above 0, by Hall's transformation of t."""
        with np.errstate(divide="ignore", invalid="ignore"):
            t, skewness = self.t(), np.nan_to_num(self.third / self.error**3)
            transformed = t + skewness / 6 + skewness * t**2 / 3 + skewness**2 * t**3 / 27
        return np.asarray(np.where(self.error > SAME, stdtr(self.freedom, -transformed), self.p_t()))

    def p_bootstrap(self, value: float = 0.0) -> Array:
        """Return the one-sided bootstrap p (studies,) for the hypothesis that the mean is above a value."""
        return np.asarray((1 + (self.lowest <= value + SAME).sum(axis=0)) / (1 + len(self.lowest)))

    def opposite(self) -> Means:
        """Return the means with the opposite sign, for tests of the other side."""
        return replace(self, mean=-self.mean, third=-self.third, lowest=-self.highest, highest=-self.lowest)

    def interval(self, level: float) -> tuple[Array, Array]:
        """Return Student's interval at this confidence level."""
        reach = float(stdtrit(self.freedom, (1 + level) / 2)) * self.error
        return self.mean - reach, self.mean + reach


def resamples_for(alpha: float) -> int:
    """Return a number of resamples that is large enough for tests at ``alpha``."""
    return min(_MOST_RESAMPLES, max(_RESAMPLES, math.ceil(20 / alpha)))


def means_of(
    values: Array, weights: Array | None = None, *, seed: int = 1, group: int = 0, resamples: int = _RESAMPLES
) -> Means:
    """Return estimates of the means of studies.

    Parameters
    ----------
    values : (studies, participants) array
        One number for each of two or more participants. Random weights are assigned by rank, so that names do not
        matter; with ``weights`` the numbers must ascend.
    weights : (participants,) array, optional
        Weights of the participants in the means; by default all are equal.
    seed, group : int
        Seed of the resamples; groups that are compared need different group numbers.
    resamples : int
        Number of resamples.
    """
    n, values = values.shape[1], np.sort(values, axis=1)
    weights = np.ones(n) if weights is None else weights / weights.mean()
    mean = values @ weights / n
    error = np.sqrt((values - mean[:, None]) ** 2 @ weights / (n * (n - 1)))
    cube_factor = 0.0 if n < 3 else 1 / (n * (n - 1) * (n - 2))
    draws = _random_weights(n, seed, group, resamples)
    return Means(
        mean=mean,
        error=error,
        third=(values - mean[:, None]) ** 3 @ weights * cube_factor,
        freedom=n - 1,
        lowest=_resample_means(values, weights, draws, 0),
        highest=_resample_means(values, weights, draws, -1),
    )


def _resample_means(values: Array, weights: Array, draws: Array, extreme: int) -> Array:
    """Return resampled means (resamples, studies), with one more participant equal to that at index ``extreme``."""
    extreme_weights = draws[:, -1:] * weights[extreme]
    sums = draws[:, :-1] @ (values * weights).T + extreme_weights * values[:, extreme]
    return np.asarray(sums / ((draws[:, :-1] @ weights)[:, None] + extreme_weights))


def _random_weights(n: int, seed: int, group: int, resamples: int) -> Array:
    """Return random weights (resamples, participants + 1)."""
    return np.random.default_rng([seed, group, n]).standard_exponential((resamples, n + 1))


class DifferencePs(NamedTuple):
    """The p (studies,) of three tests; a difference is shown only if all are significant."""

    t: Array
    bootstrap: Array
    skewed: Array


def p_differs(means: Means, alternative: str) -> DifferencePs:
    """Return the p of three tests that the means differ from 0: "greater", "less" or "two-sided".

    The bootstrap p is not doubled in two-sided tests: it only has to show the sign of the mean.
    """
    above, below = (np.array([side.p_t(), side.p_bootstrap(), side.p_skewed()]) for side in (means, means.opposite()))
    if alternative == "two-sided":
        p_t, p_bootstrap, p_skewed = np.where(means.mean > 0, above, below)
        return DifferencePs(t=np.minimum(1.0, 2 * p_t), bootstrap=p_bootstrap, skewed=np.minimum(1.0, 2 * p_skewed))
    p_t, p_bootstrap, p_skewed = above if alternative == "greater" else below
    return DifferencePs(t=p_t, bootstrap=p_bootstrap, skewed=p_skewed)


@cache
def smallest_shift(*sizes: int, alpha: float, alternative: str, power: float, most: float = math.inf) -> float:
    """Return the mean difference [SD] that all tests show in the proportion ``power`` of simulated studies.

    A study has pairs, or two groups of these ``sizes``, with normal numbers; ``alternative`` is "greater" or
    "two-sided". The difference is infinite if a thousand standard errors are too few, or if the t tests alone need
    more than ``most``: the bootstrap of hundreds of thousands of resamples is then left out.
    """
    if most < math.inf:
        (means,) = _simulated_means(sizes, resamples=1)
        if float(np.quantile(_smallest_shifts_of_t(means, alpha, alternative), power)) > most:
            return math.inf
    shifts = [
        np.maximum(_smallest_shifts_of_t(means, alpha, alternative), _smallest_shifts_of_bootstrap(means, alpha))
        for means in _simulated_means(sizes, resamples_for(alpha))
    ]
    return float(np.quantile(np.concatenate(shifts), power))


@cache
def equivalence_power(*sizes: int, alpha: float, bound: float) -> float:
    """Return the proportion of simulated studies without a difference that are shown to be within ±``bound`` [SD].

    A study has pairs, or two groups of these ``sizes``, with normal numbers.
    """
    proportions = []
    for means in _simulated_means(sizes, resamples_for(alpha)):
        p = [test(-bound) for side in (means, means.opposite()) for test in (side.p_t, side.p_bootstrap)]
        proportions.append(np.max(p, axis=0) <= alpha)
    return float(np.concatenate(proportions).mean())


def _simulated_means(sizes: tuple[int, ...], resamples: int) -> Iterator[Means]:
    """Yield the means, or the differences of two groups' means, of simulated studies without a difference."""
    draw = np.random.default_rng(1)
    values = [draw.normal(size=(_SIMULATED_STUDIES, size)) for size in sizes]
    batch = math.ceil(_MAX_MEANS / resamples)
    for start in range(0, _SIMULATED_STUDIES, batch):
        groups = [
            means_of(of_group[start : start + batch], group=group, resamples=resamples)
            for group, of_group in enumerate(values)
        ]
        yield groups[0] if len(groups) == 1 else groups[0] - groups[1]


def _smallest_shifts_of_bootstrap(means: Means, alpha: float) -> Array:
    """Return the smallest shift of each study's values (studies,) with which the bootstrap shows a mean above 0."""
    rank = math.floor(alpha * (1 + len(means.lowest)))  # the most resampled means that may be at most 0
    return np.asarray(SAME - np.partition(means.lowest, rank - 1, axis=0)[rank - 1])


def _smallest_shifts_of_t(means: Means, alpha: float, alternative: str) -> Array:
    """Return the smallest shift of each study's values (studies,) with which both t tests show a mean above 0."""
    below, most = -means.mean, -means.mean + 1000 * means.error
    above, tail = most, alpha / 2 if alternative == "two-sided" else alpha
    for _ in range(_HALVINGS):
        middle = (below + above) / 2
        raised = replace(means, mean=means.mean + middle)
        shown = np.maximum(raised.p_t(), raised.p_skewed()) <= tail
        below, above = np.where(shown, below, middle), np.where(shown, middle, above)
    return np.asarray(np.where(above < most, above, np.inf))

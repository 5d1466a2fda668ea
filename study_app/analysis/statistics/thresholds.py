"""Thresholds of single participants: posterior, goodness of fit, adjusted settings, and the mean of a group.

Wichmann & Hill 2001, Percept. Psychophys. 63, 1293–1313: deviance (eq. 4), its residuals (eq. 6), and their
correlation with the order of the trials.

Between-person variance by Paule & Mandel 1982, interval by Hartung & Knapp 2001 with Student's t.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import xlogy
from scipy.stats import t as student

from study_app.analysis.statistics.outcome import Array, student_interval
from study_app.psychophysics.grid import Grid, quantile

Beyond: TypeAlias = Literal["above", "below"]


@dataclass(frozen=True, slots=True)
class PosteriorThreshold:
    """Posterior medians, in the coordinate u, and the threshold's equal-tailed 95 % interval.

    ``flat`` is the threshold's median under a flat prior on the width; ``variance`` is the threshold's posterior
    variance; ``beyond`` says that the threshold lies beyond the levels that were presented.
    """

    n: int
    threshold: float
    low: float
    high: float
    variance: float
    width: float
    lapse: float
    guess: float
    flat: float
    beyond: Beyond | None


def fitted(levels: ArrayLike, successes: ArrayLike, failures: ArrayLike, grid: Grid) -> PosteriorThreshold:
    """Return the threshold from counts of answers.

    Parameters
    ----------
    levels : (k,) array
        The levels, in u; −∞ for a level of zero on log spacing.
    successes, failures : (k,) array
        Counts.
    grid : Grid
        The cells and their prior.
    """
    posterior = grid.posterior(levels, successes, failures)
    marginal = posterior.sum(axis=(1, 2, 3))
    thresholds = np.array(grid.thresholds)
    low, middle, high = (quantile(thresholds, marginal, share) for share in (0.025, 0.5, 0.975))
    mean = float(marginal @ thresholds)
    flat = replace(grid, width_prior=None).posterior(levels, successes, failures).sum(axis=(1, 2, 3))
    lapse = _median(grid.lapses, posterior.sum(axis=(0, 1, 3)))
    shown = np.asarray(levels, float)
    shown = shown[np.isfinite(shown)]
    return PosteriorThreshold(
        n=int(np.sum(successes) + np.sum(failures)),
        threshold=middle,
        low=low,
        high=high,
        variance=float(marginal @ (thresholds - mean) ** 2),
        width=_median(grid.widths, posterior.sum(axis=(0, 2, 3))),
        lapse=lapse,
        guess=lapse if grid.guesses is None else _median(grid.guesses, posterior.sum(axis=(0, 1, 2))),
        flat=quantile(thresholds, flat, 0.5),
        beyond="above" if middle > shown.max() else "below" if middle < shown.min() else None,
    )


def band(
    levels: ArrayLike, successes: ArrayLike, failures: ArrayLike, grid: Grid, at: ArrayLike
) -> NDArray[np.float64]:
    """Return the median and the ends of the pointwise 95 % band of ψ at the levels ``at``, shape (3, len(at))."""
    weights = grid.posterior(levels, successes, failures).ravel()
    psi = grid.success(at).reshape(len(np.atleast_1d(np.asarray(at, float))), -1)
    found = []
    for row in psi:
        order = np.argsort(row)
        shares = np.cumsum(weights[order])
        found.append(np.interp((0.5, 0.025, 0.975), shares, row[order]))
    return np.asarray(found, float).T


def narrowing(
    levels: ArrayLike, places: ArrayLike, successes: ArrayLike, grid: Grid
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ends of the threshold's 95 % interval after each answer, shape (n,) each.

    Parameters
    ----------
    levels : (k,) array
        The levels, in u.
    places, successes : (n,) array
        Which level each answer was given to, and whether it was a success, in the order of the trials.
    grid : Grid
        The cells and their prior.
    """
    psi = grid.success(levels)
    log_success, log_failure = np.log(psi), np.log1p(-psi)
    log_likelihood = np.zeros(grid.shape)
    thresholds, ends = np.array(grid.thresholds), []
    for place, right in zip(np.asarray(places, int), np.asarray(successes, bool), strict=True):
        log_likelihood += (log_success if right else log_failure)[place]
        weights = grid.prior * np.exp(log_likelihood - log_likelihood.max())
        marginal = weights.sum(axis=(1, 2, 3)) / weights.sum()
        ends.append([quantile(thresholds, marginal, share) for share in (0.025, 0.975)])
    low, high = np.asarray(ends, float).reshape(-1, 2).T
    return low, high


def _median(values: ArrayLike, weights: NDArray[np.float64]) -> float:
    """Return the median of a distribution over few values, interpolated between them."""
    values = np.asarray(values, float)
    return float(values[0]) if len(values) == 1 else float(np.interp(0.5, np.cumsum(weights) - weights / 2, values))


SETS: Final = 999
SEED: Final = 1
WORST: Final = 0.05
"""Below this p the report says that the function does not fit."""


def deviances(successes: ArrayLike, n: ArrayLike, expected: ArrayLike) -> Array:
    """Return twice the log-likelihood ratio of the saturated model to the function, of each level.

    Parameters
    ----------
    successes, n : array
        Successes and answers at each level, shape (…, k).
    expected : (k,) array
        The function's shares, strictly between 0 and 1.
    """
    y, m, psi = np.asarray(successes, float), np.asarray(n, float), np.asarray(expected, float)
    found = 2.0 * (xlogy(y, y / (m * psi)) + xlogy(m - y, (m - y) / (m * (1.0 - psi))))
    return np.asarray(np.maximum(found, 0.0), float)


def p_of_fit(successes: ArrayLike, n: ArrayLike, expected: ArrayLike) -> float:
    """Return the share of simulated sets of answers whose deviance is no smaller: (1 + #{D* ≥ D})/1000.

    Parameters
    ----------
    successes, n, expected : (k,) array
        As of `deviances`; the sets are binomial, with a fixed seed.
    """
    draw = np.random.default_rng(SEED)
    drawn = draw.binomial(np.asarray(n, np.int64), np.asarray(expected, float), (SETS, np.size(expected)))
    simulated = deviances(drawn, n, expected).sum(axis=-1)
    found = float(deviances(successes, n, expected).sum())
    return float(1 + np.count_nonzero(simulated >= found - 1e-9)) / (SETS + 1)


def drift(successes: ArrayLike, expected: ArrayLike) -> float | None:
    """Return the correlation of trial number and deviance residual; None where either does not vary.

    Parameters
    ----------
    successes : (n,) array of bool
        The answers in the order of the trials.
    expected : (n,) array
        The function's share at the level of each.
    """
    y, psi = np.asarray(successes, float), np.asarray(expected, float)
    residuals = np.sign(y - psi) * np.sqrt(deviances(y, np.ones_like(y), psi))
    if len(y) < 3 or float(np.ptp(residuals)) == 0.0:
        return None
    return float(np.corrcoef(np.arange(len(y)), residuals)[0, 1])


def drifts(correlation: float | None, n: int) -> bool:
    """Return whether a correlation over ``n`` trials is beyond 2/√n."""
    return correlation is not None and abs(correlation) > 2.0 / math.sqrt(n)


@dataclass(frozen=True, slots=True)
class SettingStatistics:
    """What settings of one observer show, in u: log10 of the level on log spacing, else the level.

    Attributes
    ----------
    n : int
        How many settings.
    pse : float
        Point of subjective equality, their mean.
    low, high : float or None
        Student's 95 % interval of the PSE; None where there is none.
    jnd : float or None
        Just-noticeable difference, their standard deviation (n − 1); None of a single setting.
    hysteresis : float or None
        Mean of the settings that started high − mean of those that started low; None where either is lacking.
    """

    n: int
    pse: float
    low: float | None
    high: float | None
    jnd: float | None
    hysteresis: float | None


def setting_statistics(u: Array, started_high: NDArray[np.bool_]) -> SettingStatistics:
    """Return what settings show (Gescheider 1997, Psychophysics: The Fundamentals, chapter 3).

    Parameters
    ----------
    u : (n,) array
        The settings, at least one.
    started_high : (n,) array
        Of each whether it started in the upper half of the levels.
    """
    above, below = u[started_high], u[~started_high]
    low, high = student_interval(u)
    return SettingStatistics(
        n=len(u),
        pse=float(u.mean()),
        low=low,
        high=high,
        jnd=float(u.std(ddof=1)) if len(u) > 1 else None,
        hysteresis=float(above.mean() - below.mean()) if len(above) and len(below) else None,
    )


FEWEST: Final = 3
"""Estimates below which no interval is given."""


@dataclass(frozen=True, slots=True)
class GroupMean:
    """The mean of ``n`` estimates, the ends of its 95 % interval, and the variance between them."""

    n: int
    mean: float
    low: float | None
    high: float | None
    between: float


def group_mean(estimates: Sequence[float], variances: Sequence[float]) -> GroupMean:
    """Return the random-effects mean of estimates, shape (n,), with their variances, each above zero.

    Raises
    ------
    ValueError
        There is no estimate.
    """
    y, v = np.asarray(estimates, float), np.asarray(variances, float)
    n = len(y)
    if n == 0:
        raise ValueError("a mean needs an estimate")

    def excess(between: float) -> float:
        weights = 1.0 / (v + between)
        mean = float((weights * y).sum() / weights.sum())
        return float((weights * (y - mean) ** 2).sum()) - (n - 1)

    between = 0.0
    if n > 1 and excess(0.0) > 0.0:
        between = float(brentq(excess, 0.0, float(np.var(y, ddof=1)) * n + 1e-12, xtol=1e-14))
    weights = 1.0 / (v + between)
    mean = float((weights * y).sum() / weights.sum())
    if n < FEWEST:
        return GroupMean(n, mean, None, None, between)
    variance = float((weights * (y - mean) ** 2).sum()) / ((n - 1) * float(weights.sum()))
    half = float(student.ppf(0.975, n - 1)) * math.sqrt(variance)
    return GroupMean(n, mean, mean - half, mean + half, between)

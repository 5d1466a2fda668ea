"""Standardised effects with intervals, and the Bayes factor of a t test.

Intervals of d invert the noncentral t distribution (Steiger & Fouladi 1997); those of Cliff's delta are asymmetric ones
with Student's t (Cliff 1993, Psychol. Bull. 114, 494–509; Feng & Cliff 2004). The Bayes factor is that of Rouder,
Speckman, Sun, Morey & Iverson (2009, Psychon. Bull. Rev. 16, 225–237), by numerical integration over g.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import gammaln, nctdtr, stdtrit

from study_app.analysis.statistics.outcome import Array

PRIOR_SCALE: Final = math.sqrt(2) / 2
"""Scale of the Cauchy prior of the standardised difference ("medium")."""
_LEVEL: Final = 0.95
LARGEST_LOG: Final = 700.0
"""Logarithm of the largest Bayes factor; larger ones could exceed the range of a float."""
_SAME: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectSize:
    """A standardised effect ("d_z", "g" or "Cliff's delta") and the ends of its 95 % interval.

    ``t`` is Student's t of the same numbers; None for Cliff's delta.
    """

    name: str
    value: float
    low: float
    high: float
    t: float | None = None


def d_z(differences: Array) -> EffectSize | None:
    """Return the mean of paired differences in units of their standard deviation; None if they do not vary."""
    n = len(differences)
    if n < 2 or (sd := float(np.std(differences, ddof=1))) < _SAME:
        return None
    value = float(differences.mean()) / sd
    t = value * math.sqrt(n)
    low, high = _noncentrality_interval(t, n - 1)
    return EffectSize(name="d_z", value=value, low=low / math.sqrt(n), high=high / math.sqrt(n), t=t)


def hedges_g(first: Array, second: Array) -> EffectSize | None:
    """Return the difference of two groups' means in units of their pooled SD, corrected for bias.

    The correction is the exact one (Hedges 1981). None if a group has fewer than two numbers, or none of them varies.
    """
    n, m = len(first), len(second)
    if min(n, m) < 2 or (sd := _pooled_sd(first, second)) < _SAME:
        return None
    d, degrees_of_freedom, root = float(first.mean() - second.mean()) / sd, n + m - 2, math.sqrt(n * m / (n + m))
    bias = math.exp(gammaln(degrees_of_freedom / 2) - gammaln((degrees_of_freedom - 1) / 2)) / math.sqrt(
        degrees_of_freedom / 2
    )
    low, high = _noncentrality_interval(d * root, degrees_of_freedom)
    return EffectSize(name="g", value=bias * d, low=bias * low / root, high=bias * high / root, t=d * root)


def _pooled_sd(first: Array, second: Array) -> float:
    squares = sum(float(((group - group.mean()) ** 2).sum()) for group in (first, second))
    return math.sqrt(squares / (len(first) + len(second) - 2))


def _noncentrality_interval(t: float, degrees_of_freedom: int) -> tuple[float, float]:
    """Return the 95 % interval of the noncentrality of the t distribution, given an observed t."""
    tail, half_width = (1 - _LEVEL) / 2, 10.0 + 3 * abs(t)

    def excess(shift: float, p: float) -> float:
        below = float(nctdtr(degrees_of_freedom, shift, t))
        return (float(shift < t) if math.isnan(below) else below) - p

    def noncentrality(p: float) -> float:
        return float(brentq(excess, t - half_width, t + half_width, (p,)))

    return noncentrality(1 - tail), noncentrality(tail)


def cliffs_delta(first: Array, second: Array) -> EffectSize | None:
    """Return P(first > second) − P(first < second) over pairs of numbers from the two groups.

    None if a group has fewer than two numbers.
    """
    n, m = len(first), len(second)
    if min(n, m) < 2:
        return None
    signs = np.sign(first[:, None] - second[None, :])
    delta = float(signs.mean())
    rows, columns = signs.mean(axis=1), signs.mean(axis=0)
    of_rows, of_columns = float(((rows - delta) ** 2).sum()), float(((columns - delta) ** 2).sum())
    of_cells = float(((signs - delta) ** 2).sum())
    variance = (m**2 * of_rows + n**2 * of_columns - of_cells) / (n * m * (n - 1) * (m - 1))
    minimum = (1 - delta**2) / (n * m - 1)
    return _delta_with_interval(delta, max(variance, minimum), n + m - 2, min(n, m))


def paired_delta(differences: Array) -> EffectSize | None:
    """Return the proportion of positive differences minus the proportion of negative differences.

    None if there are fewer than two, or all are zero.
    """
    n = len(differences)
    signs = np.where(np.abs(differences) < _SAME, 0.0, np.sign(differences))
    if n < 2 or not signs.any():
        return None
    return _delta_with_interval(float(signs.mean()), float(signs.var(ddof=1)) / n, n - 1, n)


def _delta_with_interval(delta: float, variance: float, degrees_of_freedom: int, cases: int) -> EffectSize:
    """Return Cliff's delta with its interval, limited to −1 to 1.

    At ±1, where the variance is zero, the inner limit follows from the Clopper–Pearson (1934) limit for ``cases``
    successes in ``cases`` trials.
    """
    if 1 - abs(delta) < _SAME:
        end = 2 * ((1 - _LEVEL) / 2) ** (1 / cases) - 1
        ends = (end, 1.0) if delta > 0 else (-1.0, -end)
        return EffectSize(name="Cliff's delta", value=delta, low=ends[0], high=ends[1])
    t = float(stdtrit(degrees_of_freedom, (1 + _LEVEL) / 2))
    half_width = t * math.sqrt(variance) * math.sqrt((1 - delta**2) ** 2 + t**2 * variance)
    centre, denominator = delta - delta**3, 1 - delta**2 + t**2 * variance
    low, high = (centre - half_width) / denominator, (centre + half_width) / denominator
    return EffectSize(name="Cliff's delta", value=delta, low=max(-1.0, low), high=min(1.0, high))


def jzs_bayes_factor(t: float, n: int, m: int | None = None, scale: float = PRIOR_SCALE) -> float:
    """Return the two-sided JZS Bayes factor: the likelihood of t with a difference, divided by that without.

    Parameters
    ----------
    t : float
        Student's t of differences, or of two groups with equal variances.
    n, m : int
        Number of differences or, with ``m``, the sizes of the groups.
    scale : float
        Scale of the Cauchy prior of the standardised difference.
    """
    degrees_of_freedom, size = (n - 1, float(n)) if m is None else (n + m - 2, n * m / (n + m))

    def log_likelihood(g: float) -> float:
        return -0.5 * math.log1p(size * g) - (degrees_of_freedom + 1) / 2 * math.log1p(
            t**2 / ((1 + size * g) * degrees_of_freedom)
        )

    def log_density(log_g: float) -> float:
        g = math.exp(log_g)
        prior = math.log(scale) - 0.5 * math.log(2 * math.pi) - 0.5 * log_g - scale**2 / (2 * g)
        return log_likelihood(g) + prior - none

    none = -(degrees_of_freedom + 1) / 2 * math.log1p(t**2 / degrees_of_freedom)
    peak = max(log_density(float(log_g)) for log_g in np.linspace(-12, 25, 371))
    area = quad(lambda log_g: math.exp(log_density(log_g) - peak), -12, 25, limit=400, points=(-4, 0, 4))[0]
    return math.exp(min(math.log(area) + peak, LARGEST_LOG))

"""A group's mean from estimates that are each known with a variance of their own.

Between-person variance by Paule & Mandel 1982, interval by Hartung & Knapp 2001 with Student's t.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t as student

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

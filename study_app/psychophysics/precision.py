"""Precision of a threshold: posteriors of many observers at once, and the interval of a group's mean."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from functools import cache
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from study_app.psychophysics.families import Floats
from study_app.psychophysics.grid import Grid, quantile

BETWEEN_PEOPLE: Final = 1.2
"""Factor (one standard deviation of the logarithm) between the thresholds of people. [choice]"""
ESTIMATE_NOISE: Final = 0.25
"""Standard deviation of the logarithm of a simulated magnitude estimate. [choice]"""
AT_ONCE: Final = 100
"""Number of posteriors computed together."""
_COVERED: Final = 0.95
_Z: Final = 1.959964


@dataclass(frozen=True, eq=False)
class Estimates:
    """Thresholds of many observers, in u: posterior medians, ends of their 95 % intervals, posterior variances.

    Each is an (observers,) array.
    """

    medians: Floats
    lows: Floats
    highs: Floats
    variances: Floats


def estimated(grid: Grid, levels: ArrayLike, successes: Floats, failures: Floats) -> Estimates:
    """Return the thresholds of many observers from counts of answers.

    Parameters
    ----------
    grid : Grid
        The cells and their prior.
    levels : (k,) array
        In u; −∞ for a level of zero on log spacing.
    successes, failures : (observers, k) array
        Numbers of answers with and without success at each level.
    """
    psi = grid.success(levels).reshape(successes.shape[1], -1)
    log_success, log_failure, prior = np.log(psi), np.log1p(-psi), grid.prior.ravel()
    thresholds = np.array(grid.thresholds)
    found = []
    for first in range(0, len(successes), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        log_likelihood = np.einsum("tk,kc->tc", successes[some], log_success)
        log_likelihood += np.einsum("tk,kc->tc", failures[some], log_failure)
        weights = prior * np.exp(log_likelihood - log_likelihood.max(axis=1, keepdims=True))
        marginals = weights.reshape(len(weights), len(thresholds), -1).sum(axis=2)
        for marginal in marginals / marginals.sum(axis=1, keepdims=True):
            mean = float((marginal * thresholds).sum())
            variance = float((marginal * (thresholds - mean) ** 2).sum())
            found.append([*(quantile(thresholds, marginal, share) for share in (0.5, 0.025, 0.975)), variance])
    return Estimates(*np.asarray(found, float).T)


@dataclass(frozen=True, slots=True)
class Expected:
    """The expected precision of one participant's threshold at one standard, d′, d_a or exponent.

    Attributes
    ----------
    spacing : {"log", "linear"}
        Of u: decades, or units of the level; "linear" for d′, d_a and exponents.
    trials : int
        Of one standard.
    standards : int
        Number of standards in the group's mean.
    half : float
        Half the 95 % interval of one participant, in u; infinite if nothing is measured.
    spread : float
        Standard deviation of the estimate's error, in u; infinite if nothing is measured.
    threshold : float
        Approximate threshold, as a level; or the assumed d′, d_a or exponent.
    """

    spacing: Literal["log", "linear"]
    trials: int
    standards: int
    half: float
    spread: float
    threshold: float

    @property
    def measured(self) -> bool:
        """Whether there are estimates: levels are not clipped."""
        return math.isfinite(self.half)

    @property
    def factor(self) -> float | None:
        """The factor by which each end of one participant's interval differs from the threshold; None: not log."""
        return 10.0**self.half if self.spacing == "log" else None

    def of_group(self, participants: int, trials: float | None = None) -> float:
        """Return half the 95 % interval of a group's mean over all standards, as a share of the mean.

        Parameters
        ----------
        participants : int
            Their number; the result is infinite below two.
        trials : float, optional
            Of each standard; the variance of the error is taken to be inversely proportional to their number.
        """
        if participants < 2:
            return math.inf
        log = self.spacing == "log"
        between = math.log10(BETWEEN_PEOPLE) if log else self.threshold * math.log(BETWEEN_PEOPLE)
        own = self.spread**2 / self.standards * (self.trials / (trials or self.trials))
        half = student_975(participants - 1) * math.sqrt((own + between**2) / participants)
        return 10.0**half - 1.0 if log else half / self.threshold

    def participants_for(self, precision: float, most: int = 1000) -> int | None:
        """Return the fewest participants for half a group's interval within ``precision``; None: more than ``most``."""
        sizes = range(2, most + 1)
        place = bisect_left(sizes, -precision, key=lambda n: -self.of_group(n))
        return sizes[place] if place < len(sizes) else None

    def trials_for(self, precision: float, participants: int, most: int = 1000) -> int | None:
        """Return the fewest sufficient trials of each standard, in steps of ten; None: people differ by too much."""
        found = (n for n in range(10, most + 1, 10) if self.of_group(participants, n) <= precision)
        return next(found, None)


@cache
def student_975(freedom: int) -> float:
    """Return the 97.5 % quantile of Student's t, to 1e-6 of it; without scipy, which protocols do not load.

    With t = √ν tan θ the distribution function is the integral of cos^(ν−1) θ.
    """
    if freedom > 2000:
        return _Z * (1.0 + (1.0 + _Z**2) / (4.0 * freedom))
    angles = np.linspace(0.0, math.pi / 2, 40001)
    heights = np.cos(angles) ** (freedom - 1)
    areas = np.concatenate(([0.0], np.cumsum(heights[1:] + heights[:-1])))
    return math.sqrt(freedom) * math.tan(float(np.interp(_COVERED, areas / areas[-1], angles)))

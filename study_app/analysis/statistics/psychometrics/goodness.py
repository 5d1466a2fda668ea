"""Whether a psychometric function fits: deviance against simulated answers, and drift over trials.

Wichmann & Hill 2001, Percept. Psychophys. 63, 1293–1313: deviance (eq. 4), its residuals (eq. 6), and their
correlation with the order of the trials.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import xlogy

from study_app.analysis.statistics.outcome import Array

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

"""The bootstrap-t test of a mean: for answers that lean to one side, where t and changes of signs do not hold.

Efron & Tibshirani (1993), An Introduction to the Bootstrap, 12.5. Where only few participants answer strongly, many
resamples hold none of them: their standard error is small, they lie far away, and the mean is then not shown to lie
within the bound.
"""

import math
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from study_app.analysis.statistics.outcome import Array

RESAMPLES: Final = 1999
MOST: Final = 100_000
ROUNDING: Final = 1 / 6
"""The variance that rounding to whole points hides in a difference of two answers; added to every variance, so that a
resample without spread is not infinitely far away."""


def p_within(differences: Array, bound: float, seed: int, resamples: int = RESAMPLES) -> Array:
    """Return the larger of both one-sided p that the means lie above −``bound`` and below ``bound``.

    Parameters
    ----------
    differences : (studies, participants) array
        Paired differences, in points of the scale.
    bound : float
        In points of the scale.
    seed : int
        Of the resamples.
    resamples : int
        How many are drawn.
    """
    n = differences.shape[1]
    shares = _shares(n, seed, resamples)
    mean = differences.mean(axis=1)
    centred = (differences - mean[:, None]).T.astype(np.float32)
    drawn = shares @ centred
    spread = shares @ centred**2
    spread -= drawn**2
    spread += np.float32(ROUNDING)
    t = drawn / np.sqrt(np.maximum(spread, np.float32(ROUNDING)))
    error = np.sqrt(differences.var(axis=1) + ROUNDING)
    below, above = ((mean + side * bound) / error for side in (-1, 1))
    reached = np.maximum((t <= below.astype(np.float32)).sum(axis=0), (t >= above.astype(np.float32)).sum(axis=0))
    return np.asarray((1 + reached) / (1 + resamples))


def resamples_for(alpha: float) -> int:
    """Return how many resamples are drawn: so many that their number does not decide whether p reaches ``alpha``."""
    return min(MOST, max(RESAMPLES, math.ceil(20 / alpha)))


@lru_cache(maxsize=16)
def _shares(n: int, seed: int, resamples: int) -> NDArray[np.float32]:
    """Return the share of each of ``n`` participants in each resample (resamples, n)."""
    counts = np.random.default_rng(seed).multinomial(n, np.full(n, 1 / n), size=resamples)
    return np.asarray(counts / n, dtype=np.float32)

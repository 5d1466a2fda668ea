"""Equivalence over thousands of simulated studies at once, and how many participants it takes.

All studies meet the same random changes of signs; sums over participants are then products of matrices, exact in
single precision for whole numbers and their halves.
"""

import math
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as t_distribution

from study_app.analysis.statistics.equivalence.bootstrap_t import p_within
from study_app.analysis.statistics.equivalence.tost import SAME, fewest, p_unseen
from study_app.analysis.statistics.exact_distributions import doubled_ranks
from study_app.analysis.statistics.outcome import Array

DRAWS: Final = 499
MOST_DRAWS: Final = 20_000
AT_ONCE: Final = 500
"""Studies that are resampled together: more take more memory."""

POWER: Final = 0.80
STUDIES: Final = 1000
MOST: Final = 400
"""No more participants than these are looked for."""

FINENESS: Final = 0.04
"""Spreads within 4 % of each other need the same number of participants."""


def equivalent(
    differences: Array, bound: float, alpha: float, rng: np.random.Generator, draws: int = DRAWS
) -> NDArray[np.bool_]:
    """Return whether each study shows equivalence within ± ``bound`` as ``tost`` does: by every one of its tests.

    Parameters
    ----------
    differences : (studies, participants) array
        Paired differences, in points of the scale.
    bound : float
        In points of the scale.
    alpha : float
        Level of each one-sided test.
    rng : Generator
        Draws the resamples.
    draws : int
        How many are drawn.
    """
    n = differences.shape[1]
    spread = differences.std(axis=1, ddof=1) if n > 1 else np.zeros(len(differences))
    mean = np.abs(differences.mean(axis=1))
    flat = spread <= SAME
    reach = float(t_distribution.ppf(1 - alpha, n - 1)) * spread / math.sqrt(n) if n > 1 else spread
    many, many_equal = p_unseen(n, equal=False) <= alpha, p_unseen(n, equal=True) <= alpha
    shown = np.asarray(np.where(flat, (mean < bound - SAME) & many_equal, (mean + reach <= bound) & many))
    held = np.flatnonzero(shown & ~flat)
    up = (rng.random((draws, n)) < 0.5).astype(np.float32)
    for part in np.array_split(held, max(1, math.ceil(len(held) / AT_ONCE))):
        rows = differences[part]
        for side in (-1.0, 1.0):
            shifted = bound + side * rows
            shown[part] &= p_above(np.abs(shifted), shifted > 0, up) <= alpha
            shown[part] &= p_above(sizes(shifted), shifted > 0, up) <= alpha
        shown[part] &= p_within(rows, bound, 1, draws) <= alpha
    return shown


def sizes(differences: Array) -> Array:
    """Return the (doubled) ranks of differences (rows, n) among those that are not 0, whose own are 0."""
    if not len(differences):
        return differences
    ranked = doubled_ranks(np.abs(differences)) - 2 * (differences == 0).sum(axis=1, keepdims=True)
    return np.where(differences == 0, 0, ranked)


def p_above(values: Array, positive: NDArray[np.bool_], up: NDArray[np.float32]) -> Array:
    """Return the one-sided p (rows,) that the ``positive`` of ``values`` (rows, n) outweigh the others.

    ``up`` (draws, n) are the signs that are drawn, 1 for positive.
    """
    seen = np.where(positive, values, 0).sum(axis=1).astype(np.float32) * np.float32(1 - 1e-6)
    drawn = up @ values.T.astype(np.float32)
    return np.asarray((1 + (drawn >= seen).sum(axis=0)) / (1 + len(up)))


def participants_needed(differences: Array, bound: float, alpha: float) -> int | None:
    """Return how many participants show equivalence with 80 % power; None: more than ``MOST``.

    Studies are simulated whose differences spread as these do about a true difference of 0, normally and then rounded
    as these are: to whole points, to halves, or not at all.
    """
    kept = differences[~np.isnan(differences)]
    step = next((size for size in (1.0, 0.5) if np.array_equal(kept / size, np.rint(kept / size))), 0.0)
    sd = float(kept.std(ddof=1)) if len(kept) > 1 else 0.0
    place = round(math.log(max(sd, 1e-3)) / FINENESS)
    return _needed(place, step, bound, alpha)


@lru_cache(maxsize=4096)
def _needed(place: int, step: float, bound: float, alpha: float) -> int | None:
    """Return the smallest number with enough power, which grows with it except at single steps of rounded answers."""
    sd = math.exp(place * FINENESS)
    normal = _before_rounding(sd, step)

    def enough(n: int) -> bool:
        return power(n, normal, step, bound, alpha) >= POWER

    least = fewest(alpha, equal=True)
    by_t = math.ceil((float(norm.ppf([1 - alpha, (1 + POWER) / 2]).sum()) * sd / bound) ** 2)
    low, high = least - 1, max(least, by_t)
    while high <= MOST and not enough(high):
        low, high = high, high + max(1, high // 6)
    if high > MOST:
        return None
    if low == least - 1 and high > least:
        low = max(low, high * 4 // 5)
        if enough(low):
            low, high = least - 1, low
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


def power(n: int, sd: float, step: float, bound: float, alpha: float) -> float:
    """Return the share of simulated studies of ``n`` participants that show equivalence, the true difference being 0.

    ``sd`` is that of the normal differences before they are rounded to ``step`` (0: not at all).
    """
    rng = np.random.default_rng(n)
    drawn = sd * rng.normal(size=(STUDIES, n))
    rounded = step * np.rint(drawn / step) if step else drawn
    draws = min(MOST_DRAWS, max(DRAWS, math.ceil(5 / alpha)))
    return float(equivalent(rounded, bound, alpha, rng, draws).mean())


def _before_rounding(sd: float, step: float) -> float:
    """Return the spread of a normal number whose multiple of ``step`` nearest to it spreads by ``sd``."""
    if not step:
        return sd
    levels = step * np.arange(1, 60)
    low, high = 0.0, sd + step
    for _ in range(40):
        middle = (low + high) / 2
        beyond = norm.sf((levels - step / 2) / middle)
        spread = 2 * (levels**2 * -np.diff(beyond, append=0.0)).sum()
        low, high = (middle, high) if spread < sd**2 else (low, middle)
    return high

"""One test over all statements at once, without correction: settings are relabelled within participants.

A participant's answers to all statements move together, so that statements may depend on each other in any way.
The statistic is the sum of the statements' Friedman statistics (nonparametric combination; Pesarin & Salmaso 2010).
"""

import math
from dataclasses import dataclass
from itertools import permutations
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from study_app.analysis.statistics.exact_distributions import doubled_ranks
from study_app.analysis.statistics.friedman import shuffles, tied_spread
from study_app.analysis.statistics.outcome import DRAWS, NO_VARIATION, Array, Outcome, Whole, checked
from study_app.errors import AnalysisError

EXACT_UP_TO: Final = 50_000
"""So many rearrangements are gone through (three settings: seven participants); beyond that p is drawn."""

ROUNDING: Final = 1e-9
"""Sums of the same numbers in another order differ by less than this, relatively."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GlobalPermutation(Outcome):
    """The sum of Friedman's chi-square over ``items`` statements that vary; ``effect`` is their mean Kendall's W.

    ``dropped`` participants completed no statement; ``incomplete`` counts the rows of single statements that were left
    out of ``n`` × statements.
    """

    items: int
    incomplete: int


def global_permutation(values: ArrayLike, *, draws: int = DRAWS, seed: int = 1) -> GlobalPermutation:
    """Test whether settings are answered alike in all statements.

    Parameters
    ----------
    values : (items, participants, settings) array
        NaN where an answer is missing: that participant's row of that statement is left out.
    draws : int
        Rearrangements drawn where not all can be listed.
    seed : int
        Of the rearrangements.

    Raises
    ------
    AnalysisError
        There are fewer than two settings.
    """
    array = checked(values, "items, participants, settings")
    k = array.shape[2]
    if k < 2:
        raise AnalysisError(f"{k} settings: at least 2 are needed for a test of settings")
    whole = np.asarray(~np.isnan(array).any(axis=2))
    used = whole.any(axis=0)
    array, whole = array[:, used], whole[:, used]
    scores, n = _scores(array, whole), array.shape[1]
    varying = scores.any(axis=(1, 2))
    scores = scores[varying]
    found = _statistic(scores.sum(axis=1)[None])[0] if len(scores) else None
    p, smallest, method = (None, None, "none") if found is None else _p(scores, float(found), draws, seed)
    rows = whole.sum(axis=1)[varying]
    mean_w = None if found is None else _mean_w(scores, rows)
    return GlobalPermutation(
        test="global permutation over all statements",
        n=n,
        dropped=int((~used).sum()),
        statistic_name="sum of chi2",
        statistic=None if found is None else float(found),
        p=p,
        smallest_p=smallest,
        method=method,
        effect_name="mean Kendall's W",
        effect=mean_w,
        no_interval="no interval for W: it cannot be negative, so that intervals for it cover less than they claim",
        note="" if found is not None else "no participant completed a statement" if n == 0 else NO_VARIATION,
        items=int(varying.sum()),
        incomplete=int((~whole).sum()),
    )


def _scores(array: Array, whole: NDArray[np.bool_]) -> Array:
    """Return centred ranks (items, n, k), scaled so that squared column sums add up to Friedman's chi-square."""
    k = array.shape[2]
    scores = np.zeros(array.shape)
    for item, (values, kept) in enumerate(zip(array, whole, strict=True)):
        ranks = doubled_ranks(values[kept])
        spread = tied_spread(ranks)
        if spread:
            scores[item, kept] = (ranks - (k + 1)) * math.sqrt((k - 1) / spread)
    return scores


def _statistic(sums: Array) -> Array:
    """Return the sums of chi-squares (…) of column sums (…, items, k)."""
    squares: Array = (sums**2).sum(axis=(-2, -1))
    return squares


def _mean_w(scores: Array, rows: Whole) -> float:
    chi2 = (scores.sum(axis=1) ** 2).sum(axis=1)
    return float((chi2 / (rows * (scores.shape[2] - 1))).mean())


def _p(scores: Array, found: float, draws: int, seed: int) -> tuple[float, float, str]:
    """Return p, the smallest it could have been, and how it was found."""
    items, n, k = scores.shape
    people = scores.transpose(1, 0, 2)
    orders = math.factorial(k)
    if (n - 1) * math.log(orders) <= math.log(EXACT_UP_TO):
        reached = _all(people)
        highest = reached.max()
        p = float((reached >= found * (1 - ROUNDING)).mean())
        return p, float((reached >= highest * (1 - ROUNDING)).mean()), "exact permutation"
    rng = np.random.default_rng(seed)
    sums = np.zeros((items, draws, k))
    for person in people:
        sums += person[:, shuffles(rng, draws, k)]
    p = (1 + int((_statistic(sums.transpose(1, 0, 2)) >= found * (1 - ROUNDING)).sum())) / (1 + draws)
    least = max(1 / (1 + draws), math.exp((1 - n) * math.log(orders)))
    return p, least, f"Monte Carlo permutation, {draws} draws, seed {seed}"


def _all(people: Array) -> Array:
    """Return the statistic of every rearrangement of people (n, items, k); the first may stay as it is."""
    sums = people[:1]
    orders = np.array(list(permutations(range(people.shape[2]))))
    for person in people[1:]:
        moved = person[:, orders].transpose(1, 0, 2)
        sums = (sums[:, None] + moved[None]).reshape(-1, *person.shape)
    return _statistic(sums)

"""Friedman's test of several settings, exact: all rearrangements of each participant's answers are equally likely.

Friedman (1937), J. Am. Stat. Assoc. 32, 675–701; ties: Conover (1999), Practical Nonparametric Statistics, p. 370.
The exact distribution is built participant by participant over the sorted rank sums, so ties count as they are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc, fdtrc

from study_app.analysis.statistics.exact_distributions import doubled_ranks
from study_app.analysis.statistics.outcome import DRAWS, NO_VARIATION, Array, Outcome, Whole, complete

WORK: Final = 1_500_000
"""So many sums may be formed for an exact distribution; beyond that p is drawn."""

DRAWN_UP_TO: Final = 200
"""Beyond so many participants the chi-square p is used: nearer to the exact one, far from 0.5, than a drawn p, which
cannot fall below 1 / (1 + draws)."""

APPROXIMATE: Final = f"chi-square approximation, corrected for ties, as always above {DRAWN_UP_TO} participants"

DENSE: Final = 50_000
"""Up to so many codes of rank sums are counted in a table, which is quicker than sorting them."""

TABLED: Final = 7
"""Up to so many settings all their orders fit into a table."""

NO_INTERVAL: Final = "no interval for W: it cannot be negative, so that intervals for it cover less than they claim"


@dataclass(frozen=True, slots=True, kw_only=True)
class Friedman(Outcome):
    """Friedman's chi-square with ``df`` degrees of freedom, ``effect`` Kendall's W.

    ``p`` is exact or drawn, as ``method`` says; ``p_chi2`` and ``p_f`` (of ``f``) are the two approximations.
    ``mean_ranks`` has one entry a setting.
    """

    test: str = "Friedman"
    statistic_name: str = "chi2"
    effect_name: str = "Kendall's W"
    df: int
    p_chi2: float | None = None
    f: float | None = None
    p_f: float | None = None
    mean_ranks: tuple[float, ...]


def friedman(values: ArrayLike, *, draws: int = DRAWS, seed: int = 1) -> Friedman:
    """Test whether settings are answered alike.

    Parameters
    ----------
    values : (participants, settings) array
        NaN where an answer is missing; such participants are dropped.
    draws, seed : int
        For a drawn p, where the exact distribution would take too long.

    Raises
    ------
    AnalysisError
        There are fewer than three settings.
    """
    rows, dropped = complete(values, at_least=3, why=" for Friedman's test; compare two by the signed ranks of pairs")
    n, k = rows.shape
    ranks = doubled_ranks(rows)
    spread = tied_spread(ranks)
    sums = ranks.sum(axis=0)
    if spread == 0:
        note, middle = NO_VARIATION if n else "no participant answered under all settings", (k + 1) / 2
        ranks_of_all = (middle,) * k if n else ()
        return Friedman(n=n, dropped=dropped, no_interval=note, note=note, df=k - 1, mean_ranks=ranks_of_all)
    squares = _squares(sums[None, :], n)[0]
    statistic = (k - 1) * squares / spread
    w = statistic / (n * (k - 1))
    p, smallest, method = _p(ranks, int(squares), draws, seed)
    approximate = float(chdtrc(k - 1, statistic))
    f, p_f = _f(w, n, k)
    return Friedman(
        n=n,
        dropped=dropped,
        statistic=float(statistic),
        p=approximate if p is None else p,
        smallest_p=smallest,
        method=method,
        effect=float(w),
        no_interval=NO_INTERVAL,
        df=k - 1,
        p_chi2=approximate,
        f=f,
        p_f=p_f,
        mean_ranks=tuple(float(rank) for rank in sums / (2 * n)),
    )


def tied_spread(ranks: Whole) -> int:
    """Return the sum over all (doubled) ranks (n, k) of their squared distance from the middle, 0 if all are tied."""
    return int(((ranks - (ranks.shape[1] + 1)) ** 2).sum())


def _squares(sums: Whole, n: int) -> Whole:
    """Return the sum of squared distances of (doubled) rank sums (…, k) from n times the middle."""
    squares: Whole = ((sums - n * (sums.shape[1] + 1)) ** 2).sum(axis=1)
    return squares


def _f(w: float, n: int, k: int) -> tuple[float | None, float | None]:
    """Return the F that approximates W's distribution, and its p (Kendall & Babington Smith 1939)."""
    if n < 2 or w >= 1.0:
        return None, None
    f = (n - 1) * w / (1 - w)
    df = k - 1 - 2 / n
    return float(f), float(fdtrc(df, (n - 1) * df, f))


def _p(ranks: Whole, squares: int, draws: int, seed: int) -> tuple[float | None, float | None, str]:
    """Return p (None: take the chi-square's), the smallest it could have been (None: any), and how it was found."""
    n, k = ranks.shape
    exact = distribution(tuple(sorted(tuple(sorted(row)) for row in ranks.tolist())))
    if exact is not None:
        support, tails = exact
        return float(tails[np.searchsorted(support, squares)]), float(tails[-1]), "exact permutation"
    if n > DRAWN_UP_TO:
        return None, None, APPROXIMATE
    least = math.exp((1 - n) * math.lgamma(k + 1))
    drawn = _squares(drawn_sums(ranks, draws, seed), n)
    p = (1 + int((drawn >= squares).sum())) / (1 + draws)
    return p, max(least, 1 / (1 + draws)), f"Monte Carlo permutation, {draws} draws, seed {seed}"


@lru_cache(maxsize=1024)
def distribution(patterns: tuple[tuple[int, ...], ...]) -> tuple[Whole, Array] | None:
    """Return every sum of squares that (doubled) ranks of these ``patterns`` (n × k) can have, ascending, and P(≥).

    None if it would take more than ``WORK``. Rank sums are kept sorted, since every relabelling is equally likely.
    """
    n, k = len(patterns), len(patterns[0])
    base = 2 * n * k + 1
    if k > TABLED or base**k >= 2**62:
        return None
    powers = base ** np.arange(k, dtype=np.int64)
    dense = base ** (k - 1) <= DENSE
    states = np.zeros((1, k), dtype=np.int64)
    weights: Array = np.ones(1)
    work = 0
    for pattern in patterns:
        orders = _orders(pattern)
        work += len(states) * len(orders)
        if work > WORK:
            return None
        sums = np.sort((states[:, None, :] + orders[None, :, :]).reshape(-1, k), axis=1)
        given = np.repeat(weights / len(orders), len(orders))
        if dense:  # the last sum follows from the others: without it the codes are few enough to be counted
            counted = np.bincount(sums[:, :-1] @ powers[:-1], given)
            codes = np.flatnonzero(counted)
            weights = counted[codes].astype(np.float64)
            states = codes[:, None] // powers[:-1] % base
            states = np.column_stack([states, sums[0].sum() - states.sum(axis=1)])
            continue
        codes, place = np.unique(sums @ powers, return_inverse=True)
        weights = np.bincount(place.ravel(), given).astype(np.float64)
        states = codes[:, None] // powers % base
    support, place = np.unique(_squares(states, n), return_inverse=True)
    chances = np.bincount(place.ravel(), weights=weights)
    tails = np.minimum(1.0, np.cumsum(chances[::-1])[::-1])
    return support, tails


@lru_cache(maxsize=1024)
def _orders(pattern: tuple[int, ...]) -> Whole:
    """Return the distinct orders (orders, k) of a participant's ranks, all equally likely."""
    return np.unique(np.array(list(permutations(pattern)), dtype=np.int64), axis=0)


def shuffles(rng: np.random.Generator, draws: int, k: int) -> Whole:
    """Return ``draws`` random orders (draws, k) of k settings."""
    if k > TABLED:
        return np.argsort(rng.random((draws, k)), axis=1)
    table = _orders(tuple(range(k)))
    return table[(rng.random(draws) * len(table)).astype(np.int64)]


def drawn_sums(ranks: Whole, draws: int, seed: int) -> Whole:
    """Return rank sums (draws, k) after shuffling each participant's ``ranks`` (n, k) at random."""
    rng = np.random.default_rng(seed)
    sums = np.zeros((draws, ranks.shape[1]), dtype=np.int64)
    for row in ranks:
        sums += row[shuffles(rng, draws, ranks.shape[1])]
    return sums

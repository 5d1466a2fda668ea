"""Rank tests of two or several settings within participants, for one statement or over all statements.

Friedman (1937), J. Am. Stat. Assoc. 32, 675–701; ties: Conover (1999), Practical Nonparametric Statistics, p. 370.
The exact distribution is built participant by participant over the sorted rank sums, and accounts for ties.

The test over all statements permutes a participant's answers to all statements together, so statements may be
dependent. The statistic is the sum of the statements' Friedman statistics (nonparametric combination; Pesarin & Salmaso
2010).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc, fdtrc, ndtr, ndtri

from study_app.analysis.statistics.outcome import (
    DRAWS,
    NO_VARIATION,
    Array,
    Interval,
    Lattice,
    Outcome,
    Whole,
    checked_values,
    complete_rows,
    doubled_ranks,
    monte_carlo_p,
)
from study_app.analysis.wording import p_value, significant
from study_app.errors import AnalysisError

Alternative: TypeAlias = Literal["two-sided", "greater", "less"]

_EXACT_UP_TO: Final = 200
"""The most pairs with an exact p; for more, p is a normal approximation, corrected for ties."""

_FEWEST_DIFFERING: Final = 6
"""The fewest differing pairs that can be significant and have an interval."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SignedRanks(Outcome):
    """Wilcoxon's V, the ranks of positive differences; ``effect`` is the matched rank-biserial correlation.

    ``zeros`` pairs were equal. ``superiority`` is P(x > y) − P(x < y) over participants (Cliff's delta of pairs).
    ``median_difference`` includes all pairs.
    """

    zeros: int
    superiority: float | None
    median_difference: float | None


def signed_rank_test(x: ArrayLike, y: ArrayLike, *, alpha: float = 0.05) -> SignedRanks:
    """Compare answers (participants,) of the same participants in two settings; equal answers are dropped, as in R.

    Pairs with NaN, a missing answer, are also dropped. The note says whether too few pairs remain to reach p ≤
    ``alpha``.
    """
    first, second = checked_values(x, "participants"), checked_values(y, "participants")
    if len(first) != len(second):
        raise AnalysisError(
            f"{len(first)} and {len(second)} answers are not pairs; specify two answers per participant"
        )
    all_differences = first - second
    differences = all_differences[~np.isnan(all_differences)]
    n, dropped = len(differences), int(np.isnan(all_differences).sum())
    ranks, signs = _signed_ranks(differences)
    v = int(ranks[signs > 0].sum())
    all_ranks = int(ranks.sum())
    effect = (2 * v - all_ranks) / all_ranks if len(ranks) else None
    p, smallest, method = signed_p(ranks, v)
    interval, reason = _fisher_z_interval(effect, len(ranks))
    return SignedRanks(
        test="Wilcoxon signed ranks",
        n=n,
        dropped=dropped,
        statistic_name="V",
        statistic=v / 2 if len(ranks) else None,
        p=p,
        smallest_p=smallest,
        method=f"{method}, two-sided; pairs of equal answers dropped",
        effect_name="matched-pairs rank-biserial correlation",
        effect=effect,
        interval=interval,
        no_interval=reason,
        note=_signed_rank_note(n, len(ranks), smallest, effect, alpha),
        zeros=int((differences == 0.0).sum()),
        superiority=float(np.sign(differences).mean()) if n else None,
        median_difference=float(np.median(differences)) if n else None,
    )


def _signed_ranks(differences: Array) -> tuple[Whole, Array]:
    """Return the (doubled) ranks and the signs of the differences that are not 0."""
    kept = differences[differences != 0.0]
    # Rounding makes ties of differences that are equal except for the last bit: 0.3 - 0.1 and 0.2.
    return doubled_ranks(np.round(np.abs(kept), 9)[None])[0], np.sign(kept)


def signed_p(ranks: Whole, v: int, alternative: Alternative = "two-sided") -> tuple[float | None, float | None, str]:
    """Return p of the sum ``v`` of the (doubled) ranks of positive differences, the smallest p, and the method.

    p and the smallest p are None if no pair differs. All signs of all ranks are equally likely.
    """
    n, sides = len(ranks), 2 if alternative == "two-sided" else 1
    if n == 0:
        return None, None, "none"
    below = int(ranks.sum()) - v
    tail = v if alternative == "greater" else below if alternative == "less" else max(v, below)
    if n > _EXACT_UP_TO:
        deviation = (tail - ranks.sum() / 2) / math.sqrt(float((ranks.astype(float) ** 2).sum()) / 4)
        return min(1.0, sides * float(ndtr(-deviation))), None, "normal approximation, corrected for ties"
    sums = _positive_rank_sums(tuple(sorted(ranks.tolist())))
    return min(1.0, sides * sums.at_least(tail)), min(1.0, sides * sums.highest), "exact permutation of signs"


@lru_cache(maxsize=4096)
def _positive_rank_sums(ranks: tuple[int, ...]) -> Lattice:
    """Return the distribution of the sum of the ranks that are positive, each of them with probability 1/2."""
    ways, highest = np.zeros(sum(ranks) + 1), 0
    ways[0] = 1.0
    for rank in ranks:
        ways[rank : highest + rank + 1] += ways[: highest + 1].copy()
        highest += rank
    return Lattice(0, ways / 2.0 ** len(ranks))


def _fisher_z_interval(effect: float | None, n: int) -> tuple[Interval | None, str]:
    """Return the 95 % Fisher-z interval of a rank-biserial correlation of ``n`` pairs, or None and the reason."""
    if effect is None:
        return None, "no interval: no pair differs"
    if n < _FEWEST_DIFFERING:
        return (
            None,
            f"no interval for fewer than {_FEWEST_DIFFERING} differing pairs, because its coverage would be far too "
            "low",
        )
    if abs(effect) == 1.0:
        return None, f"no interval: all {n} differing pairs differ in the same direction"
    deviation = math.sqrt((2 * n**3 + 3 * n**2 + n) / 6) / (n * (n + 1) / 2)
    reach = float(ndtri(0.975)) * deviation
    low, high = math.tanh(math.atanh(effect) - reach), math.tanh(math.atanh(effect) + reach)
    return Interval(
        low=low,
        high=high,
        level=0.95,
        method="Fisher z (approximate: coverage of about 90 % for up to 24 participants)",
    ), ""


def _signed_rank_note(n: int, different: int, smallest: float | None, effect: float | None, alpha: float) -> str:
    if n == 0:
        return "no participant answered in both conditions"
    if smallest is None:
        return f"all {n} pairs are equal"
    if smallest > alpha:
        return (
            f"cannot reach p ≤ {significant(alpha)}: the smallest possible p with {different} differing pairs is "
            f"{p_value(smallest)}"
        )
    return (
        f"all {different} differing pairs differ in the same direction"
        if effect is not None and abs(effect) == 1.0
        else ""
    )


WORK: Final = 1_500_000
"""The most sums that are formed for an exact distribution; if more are needed, permutations are random."""

DRAWN_UP_TO: Final = 200
"""The most participants with random permutations. For more, p is from chi-square: a p from permutations cannot be
smaller than 1 / (1 + draws)."""

_APPROXIMATE: Final = f"chi-square approximation, corrected for ties (always used above {DRAWN_UP_TO} participants)"

_MAX_TABLED_SETTINGS: Final = 7
"""The most settings whose orders are all kept in a table."""

_NO_INTERVAL: Final = "no interval for W: W cannot be negative, so such intervals have less than their nominal coverage"


@dataclass(frozen=True, slots=True, kw_only=True)
class Friedman(Outcome):
    """Friedman's chi-square with ``df`` degrees of freedom; ``effect`` is Kendall's W.

    ``p`` is exact or from random permutations, as ``method`` says; ``p_chi2`` and ``p_f`` (of ``f``) are the two
    approximations. ``mean_ranks`` has one entry per setting.
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
    """Test whether settings have the same answers: values (participants, settings), NaN if an answer is missing.

    ``draws`` and ``seed`` are for random permutations, if the exact distribution would take too long.
    """
    rows, dropped = complete_rows(values, at_least=3, why=" for Friedman's test (use the signed-rank test for two)")
    n, k = rows.shape
    ranks = doubled_ranks(rows)
    spread = _tied_spread(ranks)
    sums = ranks.sum(axis=0)
    if spread == 0:
        note, mean_rank = NO_VARIATION if n else "no participant answered in all conditions", (k + 1) / 2
        mean_ranks = (mean_rank,) * k if n else ()
        return Friedman(n=n, dropped=dropped, no_interval=note, note=note, df=k - 1, mean_ranks=mean_ranks)
    squares = _sums_of_squares(sums[None, :], n)[0]
    statistic = (k - 1) * squares / spread
    w = statistic / (n * (k - 1))
    p, smallest, method = _friedman_p(ranks, int(squares), draws, seed)
    approximate = float(chdtrc(k - 1, statistic))
    f, p_f = _f_approximation(w, n, k)
    return Friedman(
        n=n,
        dropped=dropped,
        statistic=float(statistic),
        p=approximate if p is None else p,
        smallest_p=smallest,
        method=method,
        effect=float(w),
        no_interval=_NO_INTERVAL,
        df=k - 1,
        p_chi2=approximate,
        f=f,
        p_f=p_f,
        mean_ranks=tuple(float(rank) for rank in sums / (2 * n)),
    )


def _tied_spread(ranks: Whole) -> int:
    """Return the sum of the squared distances of (doubled) ranks (n, k) from the mean rank; 0 if all are tied."""
    return int(((ranks - (ranks.shape[1] + 1)) ** 2).sum())


def _sums_of_squares(sums: Whole, n: int) -> Whole:
    """Return the sums of the squared distances of (doubled) rank sums (…, k) from n times the mean rank."""
    squares: Whole = ((sums - n * (sums.shape[1] + 1)) ** 2).sum(axis=1)
    return squares


def _f_approximation(w: float, n: int, k: int) -> tuple[float | None, float | None]:
    """Return the F that approximates W's distribution, and its p (Kendall & Babington Smith 1939)."""
    if n < 2 or w >= 1.0:
        return None, None
    f = (n - 1) * w / (1 - w)
    df = k - 1 - 2 / n
    return float(f), float(fdtrc(df, (n - 1) * df, f))


def _friedman_p(ranks: Whole, squares: int, draws: int, seed: int) -> tuple[float | None, float | None, str]:
    """Return p (None: use chi-square), the smallest possible p (None: unbounded), and the method."""
    n, k = ranks.shape
    exact = friedman_distribution(tuple(sorted(tuple(sorted(row)) for row in ranks.tolist())))
    if exact is not None:
        support, tails = exact
        return float(tails[np.searchsorted(support, squares)]), float(tails[-1]), "exact permutation"
    if n > DRAWN_UP_TO:
        return None, None, _APPROXIMATE
    minimum = math.exp((1 - n) * math.lgamma(k + 1))
    (sums,) = _permuted_sums(ranks[None], draws, seed)
    return monte_carlo_p(_sums_of_squares(sums, n) >= squares, seed, minimum)


@lru_cache(maxsize=1024)
def friedman_distribution(patterns: tuple[tuple[int, ...], ...]) -> tuple[Whole, Array] | None:
    """Return the possible sums of squares for ranks with these ``patterns`` (n × k), ascending, and P(≥) of each.

    None if this would take more than ``WORK`` sums. Ranks are doubled. Rank sums are kept sorted, because all
    relabellings of settings are equally likely.
    """
    n, k = len(patterns), len(patterns[0])
    base = 2 * n * k + 1
    if k > _MAX_TABLED_SETTINGS or base**k >= 2**62:
        return None
    powers = base ** np.arange(k, dtype=np.int64)
    states = np.zeros((1, k), dtype=np.int64)
    weights: Array = np.ones(1)
    work = 0
    for pattern in patterns:
        orders = _distinct_orders(pattern)
        work += len(states) * len(orders)
        if work > WORK:
            return None
        sums = np.sort((states[:, None, :] + orders[None, :, :]).reshape(-1, k), axis=1)
        codes, place = np.unique(sums @ powers, return_inverse=True)
        weights = np.bincount(place.ravel(), np.repeat(weights / len(orders), len(orders))).astype(np.float64)
        states = codes[:, None] // powers % base
    support, place = np.unique(_sums_of_squares(states, n), return_inverse=True)
    chances = np.bincount(place.ravel(), weights=weights)
    tails = np.minimum(1.0, np.cumsum(chances[::-1])[::-1])
    return support, tails


@lru_cache(maxsize=1024)
def _distinct_orders(pattern: tuple[int, ...]) -> Whole:
    """Return the distinct orders (orders, k) of a participant's ranks, all equally likely."""
    return np.unique(np.array(list(permutations(pattern)), dtype=np.int64), axis=0)


def _random_orders(rng: np.random.Generator, draws: int, k: int) -> Whole:
    """Return ``draws`` random orders (draws, k) of k settings."""
    if k > _MAX_TABLED_SETTINGS:
        return np.argsort(rng.random((draws, k)), axis=1)
    table = _distinct_orders(tuple(range(k)))
    return table[(rng.random(draws) * len(table)).astype(np.int64)]


def _permuted_sums(scores: NDArray[Any], draws: int, seed: int) -> NDArray[Any]:
    """Return the sums over participants (items, draws, settings) after random permutations of their scores.

    All items of ``scores`` (items, participants, settings) are permuted together.
    """
    items, _, k = scores.shape
    rng = np.random.default_rng(seed)
    sums = np.zeros((items, draws, k), dtype=scores.dtype)
    for participant_scores in scores.transpose(1, 0, 2):
        sums += participant_scores[:, _random_orders(rng, draws, k)]
    return sums


_MAX_ENUMERATED: Final = 50_000
"""The most permutations that are enumerated (three settings: seven participants); beyond that, they are random."""

_ROUNDING: Final = 1e-9
"""Relative tolerance for sums of the same numbers in a different order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GlobalPermutation(Outcome):
    """The sum of Friedman's chi-square over ``items`` statements that vary; ``effect`` is their mean Kendall's W.

    ``dropped`` participants completed no statement; ``incomplete`` counts the dropped rows of single statements, out of
    ``n`` × statements.
    """

    items: int
    incomplete: int


def global_permutation(values: ArrayLike, *, draws: int = DRAWS, seed: int = 1) -> GlobalPermutation:
    """Test whether settings have the same answers in all statements: values (items, participants, settings).

    A row of a participant and statement with NaN, a missing answer, is dropped. ``draws`` and ``seed`` are for random
    permutations, if a full enumeration is impossible.
    """
    array = checked_values(values, "items, participants, settings")
    k = array.shape[2]
    if k < 2:
        raise AnalysisError(f"too few conditions ({k}): at least 2 are needed for a comparison")
    is_complete = np.asarray(~np.isnan(array).any(axis=2))
    has_answers = is_complete.any(axis=0)
    array, is_complete = array[:, has_answers], is_complete[:, has_answers]
    scores, n = _global_scores(array, is_complete), array.shape[1]
    varying = scores.any(axis=(1, 2))
    scores = scores[varying]
    chi2 = (scores.sum(axis=1) ** 2).sum(axis=1)
    observed = float(chi2.sum()) if len(scores) else None
    p, smallest, method = (None, None, "none") if observed is None else _global_p(scores, observed, draws, seed)
    mean_w = None if observed is None else float((chi2 / (is_complete.sum(axis=1)[varying] * (k - 1))).mean())
    return GlobalPermutation(
        test="global permutation over all statements",
        n=n,
        dropped=int((~has_answers).sum()),
        statistic_name="sum of chi2",
        statistic=observed,
        p=p,
        smallest_p=smallest,
        method=method,
        effect_name="mean Kendall's W",
        effect=mean_w,
        no_interval=_NO_INTERVAL,
        note="" if observed is not None else "no participant completed a statement" if n == 0 else NO_VARIATION,
        items=int(varying.sum()),
        incomplete=int((~is_complete).sum()),
    )


def _global_scores(array: Array, is_complete: NDArray[np.bool_]) -> Array:
    """Return centred ranks (items, n, k), scaled so that squared column sums add up to Friedman's chi-square."""
    k = array.shape[2]
    scores = np.zeros(array.shape)
    for item, (values, complete) in enumerate(zip(array, is_complete, strict=True)):
        ranks = doubled_ranks(values[complete])
        spread = _tied_spread(ranks)
        if spread:
            scores[item, complete] = (ranks - (k + 1)) * math.sqrt((k - 1) / spread)
    return scores


def _global_p(scores: Array, observed: float, draws: int, seed: int) -> tuple[float, float, str]:
    """Return p, the smallest possible p, and the method."""
    _, n, k = scores.shape
    orders = math.factorial(k)
    if (n - 1) * math.log(orders) <= math.log(_MAX_ENUMERATED):
        people = scores.transpose(1, 0, 2)
        sums = people[:1]  # the first participant need not be permuted
        all_orders = np.array(list(permutations(range(k))))
        for person in people[1:]:
            sums = (sums[:, None] + person[:, all_orders].transpose(1, 0, 2)[None]).reshape(-1, *person.shape)
        statistics = (sums**2).sum(axis=(1, 2))
        p = float((statistics >= observed * (1 - _ROUNDING)).mean())
        return p, float((statistics >= statistics.max() * (1 - _ROUNDING)).mean()), "exact permutation"
    drawn = (_permuted_sums(scores, draws, seed) ** 2).sum(axis=(0, 2))
    return monte_carlo_p(drawn >= observed * (1 - _ROUNDING), seed, math.exp((1 - n) * math.log(orders)))

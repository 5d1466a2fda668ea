"""Equivalence: two one-sided tests, without normality too, and whether many simulated studies show it.

Efron & Tibshirani (1993), An Introduction to the Bootstrap, 12.5. Where only few participants answer strongly, many
resamples hold none of them: their standard error is small, they lie far away, and the mean is then not shown to lie
within the bound.

Schuirmann (1987), J. Pharmacokinet. Biopharm. 15, 657–680; Lakens (2017), Soc. Psychol. Personal. Sci. 8, 355–362.
A difference that is not significant is no evidence of equivalence; here it is called inconclusive.

All studies meet the same random changes of signs; sums over participants are then products of matrices, exact in
single precision for whole numbers and their halves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import stdtr, stdtrit
from scipy.stats import t as t_distribution

from study_app.analysis.statistics.outcome import (
    DRAWS,
    Array,
    Interval,
    Outcome,
    checked,
    clopper_pearson,
    doubled_ranks,
    p_of_draws,
)
from study_app.analysis.statistics.rank_tests import signed, signed_p
from study_app.errors import AnalysisError
from study_app.number_text import counted

RESAMPLES: Final = 1999
MOST_RESAMPLES: Final = 100_000
TIE: Final = 1e-4
"""Resampled t this close to the observed one are ties: single precision rounds them apart, on each CPU differently."""

ROUNDING: Final = 1 / 6
"""The variance that rounding to whole points hides in a difference of two answers; added to every variance, so that a
resample without spread is not infinitely far away."""


def p_within(differences: Array, bound: float, seed: int, resamples: int = RESAMPLES) -> Array:
    """Return the larger of both one-sided p that the mean is above −``bound`` and that it is below ``bound``.

    ``differences`` are (studies, participants), ``bound`` is in the same points of the scale.
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
    reached = np.maximum((t <= np.float32(below + TIE)).sum(axis=0), (t >= np.float32(above - TIE)).sum(axis=0))
    return np.asarray((1 + reached) / (1 + resamples))


def resamples_for(alpha: float) -> int:
    """Return how many resamples are drawn: so many that their number does not decide whether p reaches ``alpha``."""
    return min(MOST_RESAMPLES, max(RESAMPLES, math.ceil(20 / alpha)))


@lru_cache(maxsize=16)
def _shares(n: int, seed: int, resamples: int) -> NDArray[np.float32]:
    """Return the share of each of ``n`` participants in each resample (resamples, n)."""
    counts = np.random.default_rng(seed).multinomial(n, np.full(n, 1 / n), size=resamples)
    return np.asarray(counts / n, dtype=np.float32)


Verdict: TypeAlias = Literal["equivalent", "inconclusive", "out of reach"]

ALL_SIGNS_UP_TO: Final = 14
"""Up to so many participants all signs are gone through; beyond that they are drawn."""

SAME: Final = 1e-9
"""Differences that spread less than this are equal."""

UNSEEN: Final = 1 / 5
"""A group of this share of all people, who differ strongly, must not be missed by chance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Beyond:
    """How many of ``n`` participants differ by more than the bound: their ``share``, Clopper-Pearson interval."""

    count: int
    n: int
    share: float
    interval: Interval


@dataclass(frozen=True, slots=True, kw_only=True)
class Equivalence(Outcome):
    """Two one-sided t tests against ± ``bound``; ``p`` is the larger of ``p_lower`` and ``p_upper``.

    Three more tests ask the same without normality: ``p_permutation`` (signs of the shifted differences), ``p_ranks``
    (signed ranks, which bound the pseudo-median), both for differences that lie symmetrically, and ``p_bootstrap``
    (bootstrap-t), for those that lean to one side. Where all differences are equal there is no t, and the signs and
    ranks alone decide: ``p`` is the larger of theirs. No test sees people who are not in the sample: ``p_unseen`` is
    the probability that it holds no member of a group of the share ``UNSEEN`` of all people.

    ``verdict`` is "equivalent" where every p is at most alpha; else "out of reach" where no answers of so many
    participants could have been, else "inconclusive", which is no evidence of a difference. ``smallest_check_p`` is the
    smallest p that signs and ranks can give. ``beyond`` tells how many single participants differ by more than the
    bound: equivalent means say nothing about them.
    """

    bound: float
    alpha: float
    verdict: Verdict
    t_lower: float | None = None
    t_upper: float | None = None
    p_lower: float | None = None
    p_upper: float | None = None
    p_permutation: float | None = None
    p_ranks: float | None = None
    p_bootstrap: float | None = None
    p_unseen: float | None = None
    smallest_check_p: float | None = None
    checks_agree: bool | None = None
    sd: float | None = None
    beyond: Beyond | None = None

    @property
    def equal(self) -> bool:
        """Whether every test for equivalence shows it, by enough participants."""
        asked = (self.p, self.p_permutation, self.p_ranks, self.p_bootstrap, self.p_unseen)
        return self.p is not None and all(p is None or p <= self.alpha for p in asked)

    @property
    def p_without_normality(self) -> float | None:
        """The largest p of the tests for equivalence that do not ask for normality."""
        asked = (self.p_permutation, self.p_ranks, self.p_bootstrap)
        return max((p for p in asked if p is not None), default=None)


def tost(
    differences: ArrayLike,
    bound: float,
    *,
    alpha: float = 0.05,
    seed: int = 1,
    checks: bool = True,
    verdict_only: bool = False,
) -> Equivalence:
    """Test whether the mean of paired differences lies within ± ``bound``, set before the study.

    Parameters
    ----------
    differences : (participants,) array
        NaN where an answer is missing: dropped.
    bound : float
        In points of the scale.
    alpha : float
        Level of each one-sided test.
    seed : int
        Of the resamples.
    checks : bool
        Whether to ask without normality too, which takes long for many hundreds of participants.
    verdict_only : bool
        Whether to leave out those of these tests that cannot change the verdict, where the t tests or ``p_unseen`` do
        not show equivalence.
    """
    if not (bound > 0.0 and math.isfinite(bound)):
        raise AnalysisError(f"a bound of equivalence of {bound} means nothing; give one above 0 in points of the scale")
    array = checked(differences, "participants")
    kept = np.sort(array[~np.isnan(array)])
    found = _compared(tuple(kept.tolist()), float(bound), alpha, seed, checks, verdict_only)
    return replace(found, dropped=len(array) - len(kept))


def p_unseen(n: int) -> float:
    """Return the probability that a group of the share ``UNSEEN`` is not among ``n`` participants at all.

    The Clopper-Pearson upper bound of the share of people who differ strongly, where none of ``n`` does, is below
    that share where this is at most alpha.
    """
    return float((1 - UNSEEN) ** n)


def fewest(alpha: float) -> int:
    """Return how many participants it takes at least to show equivalence."""
    return math.ceil(math.log(alpha) / math.log(1 - UNSEEN) - 1e-9)


@lru_cache(maxsize=4096)
def _compared(
    differences: tuple[float, ...], bound: float, alpha: float, seed: int, checks: bool, verdict_only: bool
) -> Equivalence:
    """Return the comparison of ascending ``differences``: answers in whole points repeat."""
    kept = np.array(differences)
    found = _described(kept, bound, alpha)
    if found.n < 2:
        return found
    if found.sd is not None and found.sd > SAME:
        found = replace(found, no_interval="", **_by_t(kept, found.sd, bound, alpha))
        if checks:
            found = replace(found, smallest_check_p=_smallest(found.n))
            if found.equal or not verdict_only:
                p_bootstrap = float(p_within(kept[None], bound, seed, resamples_for(alpha))[0])
                found = replace(found, **_by_signs(kept, bound, seed), p_bootstrap=p_bootstrap)
    else:
        by_signs = _by_signs(kept, bound, seed)
        found = replace(
            found,
            **by_signs,
            p=max(by_signs.values()),
            method=f"signs and signed ranks, bound ±{bound:g} points: all differences are equal",
            p_unseen=p_unseen(found.n),
        )
    asked = (found.p_permutation, found.p_ranks, found.p_bootstrap)
    if found.p_ranks is not None and found.statistic is not None:
        by_t = found.p is not None and found.p <= alpha
        found = replace(found, checks_agree=all((p is None or p <= alpha) == by_t for p in asked))
    verdict: Verdict = "out of reach" if p_unseen(found.n) > alpha else "inconclusive"
    found = replace(found, verdict="equivalent" if found.equal else verdict)
    return replace(found, note=_note(found))


def _described(kept: Array, bound: float, alpha: float) -> Equivalence:
    """Return what can be said before any test."""
    n = len(kept)
    people = f"{counted(n, 'participant')}: no spread"
    reason = f"all {n} differences are equal: no spread for an interval" if n > 1 else people
    count = int((np.abs(kept) > bound + SAME).sum())
    return Equivalence(
        test="equivalence, two one-sided t tests",
        n=n,
        dropped=0,
        statistic_name="t",
        effect_name="mean difference",
        effect=float(kept.mean()) if n else None,
        no_interval=reason,
        note=reason,
        bound=bound,
        alpha=alpha,
        verdict="out of reach",
        smallest_check_p=_smallest(n) if n else None,
        sd=float(kept.std(ddof=1)) if n > 1 else None,
        beyond=Beyond(count=count, n=n, share=count / n, interval=clopper_pearson(count, n)) if n else None,
    )


def _by_t(kept: Array, sd: float, bound: float, alpha: float) -> dict[str, Any]:
    """Return what the t tests say."""
    mean, error, df = float(kept.mean()), sd / math.sqrt(len(kept)), len(kept) - 1
    lower, upper = ((mean + side * bound) / error for side in (1, -1))
    p_lower, p_upper = float(stdtr(df, -lower)), float(stdtr(df, upper))
    reach = float(stdtrit(df, 1 - alpha)) * error
    return {
        "statistic": min(lower, -upper),
        "p": max(p_lower, p_upper),
        "method": f"t({df}), bound ±{bound:g} points",
        "interval": Interval(low=mean - reach, high=mean + reach, level=1 - 2 * alpha, method="t"),
        "t_lower": lower,
        "t_upper": upper,
        "p_lower": p_lower,
        "p_upper": p_upper,
        "p_unseen": p_unseen(len(kept)),
        "smallest_check_p": None,
    }


def _by_signs(kept: Array, bound: float, seed: int) -> dict[str, Any]:
    """Return what changes of signs and signed ranks say of equivalence."""
    shifted = (kept + bound, bound - kept)
    return {"p_permutation": max(_signs(one, seed) for one in shifted), "p_ranks": max(map(_ranks, shifted))}


def _note(found: Equivalence) -> str:
    if found.verdict == "equivalent":
        return ""
    if max(p for p in (found.p, found.p_permutation, found.p_ranks, found.p_bootstrap, 0.0) if p is not None) <= (
        found.alpha
    ):
        return f"too few participants to call it equivalent: {fewest(found.alpha)} are needed"
    return "equivalence is not shown"


def _smallest(n: int) -> float:
    least = 0.5**n
    return least if n <= ALL_SIGNS_UP_TO else max(least, 1 / (1 + DRAWS))


def _ranks(shifted: Array) -> float:
    """Return the p of signed ranks that ``shifted`` lies above 0; 1 if all of it is 0."""
    ranks, signs = signed(shifted)
    p, _, _ = signed_p(ranks, int(ranks[signs > 0].sum()), "greater")
    return 1.0 if p is None else p


@lru_cache(maxsize=4)
def _all_signs(n: int) -> Array:
    return np.asarray(1.0 - 2.0 * (np.arange(2**n)[:, None] >> np.arange(n) & 1), dtype=np.float64)


@lru_cache(maxsize=4)
def _drawn_signs(n: int, seed: int) -> Array:
    """Return random signs (draws, n)."""
    return np.random.default_rng(seed).choice(np.array([-1.0, 1.0]), (DRAWS, n))


def _signs(shifted: Array, seed: int) -> float:
    """Return the one-sided p that the mean of ``shifted`` (n,) is above 0, by changing signs."""
    n, found = len(shifted), shifted.sum()
    rounding = 1e-9 * np.abs(shifted).sum()
    if n <= ALL_SIGNS_UP_TO:
        return float((_all_signs(n) @ shifted >= found - rounding).mean())
    return (1 + int((_drawn_signs(n, seed) @ shifted >= found - rounding).sum())) / (1 + DRAWS)


PLANNED_DRAWS: Final = 499
AT_ONCE: Final = 500
"""Studies that are resampled together: more take more memory."""


def equivalent(
    differences: Array, bound: float, alpha: float, rng: np.random.Generator, draws: int = PLANNED_DRAWS
) -> NDArray[np.bool_]:
    """Return whether each study shows equivalence within ± ``bound`` as ``tost`` does: by every one of its tests.

    ``differences`` are (studies, participants); ``draws`` resamples are drawn by ``rng``.
    """
    n = differences.shape[1]
    spread = differences.std(axis=1, ddof=1) if n > 1 else np.zeros(len(differences))
    mean = np.abs(differences.mean(axis=1))
    flat = spread <= SAME
    reach = float(t_distribution.ppf(1 - alpha, n - 1)) * spread / math.sqrt(n) if n > 1 else spread
    within = np.where(flat, mean < bound - SAME, mean + reach <= bound)
    shown: NDArray[np.bool_] = within & (p_unseen(n) <= alpha)
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
    return p_of_draws(drawn, seen)

"""Whether a difference is smaller than a bound that was set before the study: two one-sided tests.

Schuirmann (1987), J. Pharmacokinet. Biopharm. 15, 657–680; Lakens (2017), Soc. Psychol. Personal. Sci. 8, 355–362.
A difference that is not significant is no evidence of equivalence; here it is called inconclusive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtr, stdtrit

from study_app.analysis.statistics.equivalence.bootstrap_t import p_within, resamples_for
from study_app.analysis.statistics.outcome import DRAWS, Array, Interval, Outcome, checked, clopper_pearson
from study_app.analysis.statistics.paired import Alternative, signed, signed_p
from study_app.errors import AnalysisError
from study_app.number_text import counted

Verdict: TypeAlias = Literal["equivalent", "different", "inconclusive", "out of reach"]

ALL_SIGNS_UP_TO: Final = 14
"""Up to so many participants all signs are gone through; beyond that they are drawn."""

SAME: Final = 1e-9
"""Differences that spread less than this are equal."""

UNSEEN: Final = 1 / 5
UNSEEN_EQUAL: Final = 1 / 4
"""A group of this share of all people, who differ strongly, must not be missed by chance; the second where all
differences are equal."""


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

    ``verdict`` is "equivalent" where every p is at most alpha; else "different" where the larger p of a t test against
    0 (``p_different``) and of signed ranks (``p_different_ranks``) is; else "out of reach" where no answers of so many
    participants could have been either, else "inconclusive". ``smallest_check_p`` is the smallest p that signs and
    ranks can give. ``beyond`` tells how many single participants differ by more than the bound: equivalent means say
    nothing about them.
    """

    bound: float
    alpha: float
    verdict: Verdict
    t: float | None = None
    t_lower: float | None = None
    t_upper: float | None = None
    p_different: float | None = None
    p_different_ranks: float | None = None
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
    n_needed: int | None = None

    @property
    def equal(self) -> bool:
        """Whether every test for equivalence shows it, by enough participants."""
        asked = (self.p, self.p_permutation, self.p_ranks, self.p_bootstrap, self.p_unseen)
        return self.p is not None and all(p is None or p <= self.alpha for p in asked)

    @property
    def p_difference(self) -> float | None:
        """P that the mean differs from 0: the larger of the t test's and the signed ranks', of those there are."""
        return max((p for p in (self.p_different, self.p_different_ranks) if p is not None), default=None)

    def judged(self, p_adjusted: float | None, members: int) -> Equivalence:
        """Return this with the verdict that holds among ``members`` comparisons, whose p is ``p_adjusted`` here."""
        if self.equal:
            return replace(self, verdict="equivalent")
        if p_adjusted is not None and p_adjusted <= self.alpha:
            return replace(self, verdict="different")
        hopeless = min(p_unseen(self.n, equal=True), 2 * members * 0.5**self.n) > self.alpha
        return replace(self, verdict="out of reach" if hopeless else "inconclusive")


def tost(
    differences: ArrayLike,
    bound: float,
    *,
    alpha: float = 0.05,
    seed: int = 1,
    checks: bool = True,
    verdict_only: bool = False,
) -> Equivalence:
    """Test whether the mean of paired differences lies within ± ``bound``.

    Parameters
    ----------
    differences : (participants,) array
        NaN where an answer is missing: dropped.
    bound : float
        In points of the scale, set before the study.
    alpha : float
        Level of each one-sided test.
    seed : int
        Of the resamples.
    checks : bool
        Whether to ask without normality too, which takes long for many hundreds of participants.
    verdict_only : bool
        Whether to leave out those of these tests that cannot change the verdict: those for equivalence where the t
        tests or ``p_unseen`` do not show it, and the one of a difference where the t test does not.

    Raises
    ------
    AnalysisError
        The bound is not above 0.
    """
    if not (bound > 0.0 and math.isfinite(bound)):
        raise AnalysisError(f"a bound of equivalence of {bound} means nothing; give one above 0 in points of the scale")
    array = checked(differences, "participants")
    kept = np.sort(array[~np.isnan(array)])
    found = _compared(tuple(kept.tolist()), float(bound), alpha, seed, checks, verdict_only)
    return replace(found, dropped=len(array) - len(kept))


def p_unseen(n: int, *, equal: bool) -> float:
    """Return the probability that a group of the share ``UNSEEN`` is not among ``n`` participants at all.

    The Clopper-Pearson upper bound of the share of people who differ strongly, where none of ``n`` does, is below
    that share where this is at most alpha. ``equal``: all differences are equal.
    """
    return float((1 - (UNSEEN_EQUAL if equal else UNSEEN)) ** n)


def fewest(alpha: float, *, equal: bool = False) -> int:
    """Return how many participants it takes at least to show equivalence."""
    return math.ceil(math.log(alpha) / math.log(p_unseen(1, equal=equal)) - 1e-9)


@lru_cache(maxsize=4096)
def _compared(
    differences: tuple[float, ...], bound: float, alpha: float, seed: int, checks: bool, verdict_only: bool
) -> Equivalence:
    """Return the comparison of ascending ``differences``: answers in whole points repeat."""
    kept = np.array(differences)
    found = _described(kept, bound, alpha)
    if not len(kept):
        return found
    if found.sd is not None and found.sd > SAME:
        found = replace(found, no_interval="", **_by_t(kept, found.sd, bound, alpha))
        if checks:
            found = replace(found, **_without_normality(kept, found, seed, verdict_only))
    elif len(kept) > 1:
        found = replace(found, **_without_spread(kept, bound, seed))
    if found.p_ranks is not None and found.t is not None:
        asked = (found.p_permutation, found.p_ranks, found.p_bootstrap)
        by_t = found.p is not None and found.p <= alpha
        found = replace(found, checks_agree=all((p is None or p <= alpha) == by_t for p in asked))
    found = found.judged(found.p_difference, 1)
    return replace(found, note=_note(found)) if found.p is not None else found


def _described(kept: Array, bound: float, alpha: float) -> Equivalence:
    """Return what can be said before any test."""
    n = len(kept)
    reason = (
        f"all {n} differences are equal: no spread for an interval"
        if n > 1
        else f"{counted(n, 'participant')}: no spread"
    )
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
        beyond=_beyond(kept, bound) if n else None,
    )


def _beyond(kept: Array, bound: float) -> Beyond:
    count, n = int((np.abs(kept) > bound + SAME).sum()), len(kept)
    return Beyond(count=count, n=n, share=count / n, interval=clopper_pearson(count, n))


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
        "interval": Interval(mean - reach, mean + reach, 1 - 2 * alpha, "t"),
        "t": mean / error,
        "t_lower": lower,
        "t_upper": upper,
        "p_different": 2 * float(stdtr(df, -abs(mean) / error)),
        "p_lower": p_lower,
        "p_upper": p_upper,
        "p_unseen": p_unseen(len(kept), equal=False),
        "smallest_check_p": None,
    }


def _without_normality(kept: Array, found: Equivalence, seed: int, verdict_only: bool) -> dict[str, Any]:
    """Return what changing signs, signed ranks and the bootstrap say to the questions that the t tests answered."""
    bound, alpha, asked = found.bound, found.alpha, dict[str, Any](smallest_check_p=_smallest(len(kept)))
    if found.equal or not verdict_only:
        asked["p_permutation"] = max(_signs(kept + bound, seed), _signs(bound - kept, seed))
        asked["p_ranks"] = max(_ranks(kept + bound), _ranks(bound - kept))
        asked["p_bootstrap"] = float(p_within(kept[None], bound, seed, resamples_for(alpha))[0])
    if (found.p_different or 0.0) <= alpha or not verdict_only:
        asked["p_different_ranks"] = _ranks(kept, "two-sided")
    return asked


def _without_spread(kept: Array, bound: float, seed: int) -> dict[str, Any]:
    """Return what the tests that need no spread say where all differences are equal."""
    permuted = max(_signs(kept + bound, seed), _signs(bound - kept, seed))
    ranked = max(_ranks(kept + bound), _ranks(bound - kept))
    return {
        "p": max(permuted, ranked),
        "method": f"signs and signed ranks, bound ±{bound:g} points: all differences are equal",
        "p_permutation": permuted,
        "p_ranks": ranked,
        "p_different_ranks": _ranks(kept, "two-sided"),
        "p_unseen": p_unseen(len(kept), equal=True),
    }


def _note(found: Equivalence) -> str:
    p = found.p_difference
    differs = p is not None and p <= found.alpha
    if found.verdict == "equivalent":
        return "different from 0, but within the bound" if differs else ""
    if found.verdict == "different":
        return "the difference is shown, and it is not shown to stay within the bound"
    if max(p for p in (found.p, found.p_permutation, found.p_ranks, found.p_bootstrap, 0.0) if p is not None) <= (
        found.alpha
    ):
        return f"too few participants to call it equivalent: {fewest(found.alpha)} are needed"
    return "neither a difference nor equivalence is shown"


def _smallest(n: int) -> float:
    least = 0.5**n
    return least if n <= ALL_SIGNS_UP_TO else max(least, 1 / (1 + DRAWS))


def _ranks(shifted: Array, alternative: Alternative = "greater") -> float:
    """Return the p of signed ranks that ``shifted`` lies above 0 (or elsewhere); 1 if all of it is 0."""
    ranks, signs = signed(shifted)
    p, _, _ = signed_p(ranks, int(ranks[signs > 0].sum()), alternative)
    return 1.0 if p is None else p


@lru_cache(maxsize=4)
def _all_signs(n: int) -> Array:
    return np.asarray(1.0 - 2.0 * (np.arange(2**n)[:, None] >> np.arange(n) & 1), dtype=np.float64)


@lru_cache(maxsize=4)
def _drawn_signs(n: int, seed: int) -> Array:
    """Return random signs (draws, n)."""
    return np.random.default_rng(seed).choice([-1.0, 1.0], (DRAWS, n))


def _signs(shifted: Array, seed: int) -> float:
    """Return the one-sided p that the mean of ``shifted`` (n,) is above 0, by changing signs."""
    n, found = len(shifted), shifted.sum()
    rounding = 1e-9 * np.abs(shifted).sum()
    if n <= ALL_SIGNS_UP_TO:
        return float((_all_signs(n) @ shifted >= found - rounding).mean())
    return (1 + int((_drawn_signs(n, seed) @ shifted >= found - rounding).sum())) / (1 + DRAWS)

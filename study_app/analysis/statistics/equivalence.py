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
from scipy.stats import t as t_distribution

from study_app.analysis.statistics.outcome import DRAWS, Array, Interval, Outcome, checked, told
from study_app.analysis.statistics.paired import Alternative, signed, signed_p
from study_app.errors import AnalysisError

Verdict: TypeAlias = Literal["equivalent", "different", "inconclusive"]

ALL_SIGNS_UP_TO: Final = 14
"""Up to so many participants all signs are gone through; beyond that they are drawn."""

POWER: Final = 0.80
"""``n_needed`` participants show equivalence with this probability, were the true difference 0."""

MANY: Final = 10**9
"""With so many participants t is normal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Equivalence(Outcome):
    """Two one-sided t tests against ± ``bound``; ``p`` is the larger of ``p_lower`` and ``p_upper``.

    ``verdict`` is "equivalent" if p ≤ alpha, else "different" if the t test against 0 is significant (``p_different``),
    else "inconclusive". ``p_permutation`` (signs of the shifted differences) and ``p_ranks`` (signed ranks, which bound
    the pseudo-median) are the same question without normality; ``checks_agree`` tells whether both give the same
    answer as p, and ``smallest_check_p`` is the smallest that these two can be. ``n_needed`` is how many participants
    would give 80 % power, at this spread, were the true difference 0; never so few that these two could not agree.
    ``p_different_ranks`` is that of signed ranks, two-sided, for a difference from 0.
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
    smallest_check_p: float | None = None
    checks_agree: bool | None = None
    sd: float | None = None
    n_needed: int | None = None


def tost(
    differences: ArrayLike, bound: float, *, alpha: float = 0.05, seed: int = 1, checks: bool = True
) -> Equivalence:
    """Test whether the mean of paired differences lies within ± ``bound``.

    Parameters
    ----------
    differences : (participants,) array
        NaN where an answer is missing: dropped.
    bound : float
        In points of the scale, set before the study.
    checks : bool
        Whether to ask without normality too; planning, which asks thousands of times, does not.

    Raises
    ------
    AnalysisError
        The bound is not above 0.
    """
    if not (bound > 0.0 and math.isfinite(bound)):
        raise AnalysisError(f"a bound of equivalence of {bound} means nothing; give one above 0 in points of the scale")
    array = checked(differences, "participants")
    kept = array[~np.isnan(array)]
    found = _without_spread(kept, len(array) - len(kept), bound, alpha)
    if not found.sd:
        return found
    found = replace(found, no_interval="", **_by_t(kept, found.sd, bound, alpha))
    return replace(found, **_without_normality(kept, bound, alpha, seed, found)) if checks else found


def _by_t(kept: Array, sd: float, bound: float, alpha: float) -> dict[str, Any]:
    """Return what the t tests say."""
    n, mean, error = len(kept), float(kept.mean()), sd / math.sqrt(len(kept))
    t_lower, t_upper = (mean + bound) / error, (mean - bound) / error
    p_lower, p_upper = float(t_distribution.sf(t_lower, n - 1)), float(t_distribution.cdf(t_upper, n - 1))
    p, p_different = max(p_lower, p_upper), float(2 * t_distribution.sf(abs(mean / error), n - 1))
    reach = float(t_distribution.ppf(1 - alpha, n - 1)) * error
    return {
        "statistic": min(t_lower, -t_upper),
        "p": p,
        "method": f"t({n - 1}), bound ±{bound:g} points",
        "interval": Interval(mean - reach, mean + reach, 1 - 2 * alpha, "t"),
        "note": _note(p, p_different, alpha),
        "verdict": "equivalent" if p <= alpha else "different" if p_different <= alpha else "inconclusive",
        "t": mean / error,
        "t_lower": t_lower,
        "t_upper": t_upper,
        "p_different": p_different,
        "p_lower": p_lower,
        "p_upper": p_upper,
        "smallest_check_p": None,
        "n_needed": _needed(sd / bound, alpha),
    }


def _without_normality(kept: Array, bound: float, alpha: float, seed: int, by_t: Equivalence) -> dict[str, Any]:
    """Return what changing signs and signed ranks say to the same questions."""
    permuted = max(_signs(kept + bound, seed), _signs(bound - kept, seed))
    ranked = max(_ranks(kept + bound), _ranks(bound - kept))
    return {
        "p_permutation": permuted,
        "p_ranks": ranked,
        "p_different_ranks": _ranks(kept, "two-sided"),
        "smallest_check_p": _smallest(len(kept)),
        "checks_agree": all((p <= alpha) == (by_t.verdict == "equivalent") for p in (permuted, ranked)),
    }


def _note(p: float, p_different: float, alpha: float) -> str:
    if p <= alpha:
        return "different from 0, but within the bound" if p_different <= alpha else ""
    if p_different <= alpha:
        return "the difference is shown, and it is not shown to stay within the bound"
    return "neither a difference nor equivalence is shown"


def _without_spread(kept: Array, dropped: int, bound: float, alpha: float) -> Equivalence:
    """Return what can be said of fewer than two participants or of equal differences: no spread, no test."""
    n = len(kept)
    reason = f"all {n} differences are equal: no spread to judge by" if n > 1 else f"{told(n)}: no spread"
    return Equivalence(
        test="equivalence, two one-sided t tests",
        n=n,
        dropped=dropped,
        statistic_name="t",
        statistic=None,
        p=None,
        smallest_p=None,
        method="none",
        effect_name="mean difference",
        effect=float(kept.mean()) if n else None,
        no_interval=reason,
        note=reason,
        bound=bound,
        alpha=alpha,
        verdict="inconclusive",
        smallest_check_p=_smallest(n) if n else None,
        sd=float(kept.std(ddof=1)) if n > 1 else None,
    )


def _needed(spread: float, alpha: float) -> int:
    """Return how many participants show equivalence with 80 % power at a ``spread`` in bounds, the difference being 0.

    n ≥ ((t(1 − alpha) + t(1 − (1 − power) / 2)) · spread)² with n − 1 degrees of freedom (Chow, Shao & Wang 2008,
    Sample Size Calculations in Clinical Research, 3.1.3), and no fewer than the signs of n differences can show.
    """
    n = max(2, math.ceil(-math.log2(alpha)), math.ceil((_distance(MANY, alpha) * spread) ** 2))
    while math.sqrt(n) < _distance(n, alpha) * spread:
        n += 1
    return n


@lru_cache(maxsize=4096)
def _distance(n: int, alpha: float) -> float:
    """Return how many standard errors away the bound must be for n participants to show equivalence."""
    return float(t_distribution.ppf([1 - alpha, (1 + POWER) / 2], n - 1).sum())


def _smallest(n: int) -> float:
    least = 0.5**n
    return least if n <= ALL_SIGNS_UP_TO else max(least, 1 / (1 + DRAWS))


def _ranks(shifted: Array, alternative: Alternative = "greater") -> float:
    """Return the p of signed ranks that ``shifted`` lies above 0 (or elsewhere); 1 if all of it is 0."""
    ranks, signs = signed(shifted)
    p, _, _ = signed_p(ranks, int(ranks[signs > 0].sum()), alternative)
    return 1.0 if p is None else p


def _signs(shifted: Array, seed: int) -> float:
    """Return the one-sided p that the mean of ``shifted`` (n,) is above 0, by changing signs."""
    n, found = len(shifted), shifted.sum()
    rounding = 1e-9 * np.abs(shifted).sum()
    if n <= ALL_SIGNS_UP_TO:
        signs = 1.0 - 2.0 * (np.arange(2**n)[:, None] >> np.arange(n) & 1)
        return float((signs @ shifted >= found - rounding).mean())
    rng = np.random.default_rng(seed)
    sums = np.zeros(DRAWS)
    for value in shifted:
        sums += np.where(rng.random(DRAWS) < 0.5, value, -value)
    return (1 + int((sums >= found - rounding).sum())) / (1 + DRAWS)

"""Equivalence: two one-sided tests that a mean lies within a bound, and whether many simulated studies show it.

Schuirmann (1987), J. Pharmacokinet. Biopharm. 15, 657–680; Lakens (2017), Soc. Psychol. Personal. Sci. 8, 355–362. Each
test uses Student's t and the bootstrap of `mean_tests`. No test accounts for people outside the sample, so the sample
must be large enough to include, with high probability, a member of any minority that could shift the mean by the bound.

A difference that is not significant is not evidence of equivalence; the result is then inconclusive. A mean whose whole
interval lies beyond the bound is not equivalent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from study_app.analysis.statistics.mean_tests import SAME, Means, means_of, resamples_for
from study_app.analysis.statistics.outcome import Array, Interval, Outcome, checked_values, clopper_pearson
from study_app.analysis.wording import bound_text
from study_app.errors import AnalysisError
from study_app.number_text import counted
from study_app.protocol.participants import fewest_participants, smallest_minority

Verdict: TypeAlias = Literal["equivalent", "not equivalent", "inconclusive", "out of reach"]

STEPS: Final = 6.0
"""The largest difference between two answers on a seven-point scale."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Beyond:
    """The number of ``n`` participants who differ by more than the bound: ``share`` with Clopper–Pearson interval."""

    count: int
    n: int
    share: float
    interval: Interval


@dataclass(frozen=True, slots=True, kw_only=True)
class Equivalence(Outcome):
    """Two one-sided t tests against ± ``bound``; ``p`` is the larger of ``p_lower`` and ``p_upper``.

    ``p_bootstrap`` is the larger p of the bootstrap, which alone decides if all differences are equal. ``p_unseen`` is
    the probability that the sample contains no member of a minority that shifts the mean by the bound if its members
    differ by ``largest``.

    ``verdict`` is "equivalent" if every p is at most alpha; "not equivalent" if the whole interval lies beyond the
    bound (or, if all differences are equal, if they lie beyond it for so many participants that a sign test is
    significant); "out of reach" if so few participants cannot show equivalence, whatever they answer; and otherwise
    "inconclusive", which is not evidence of a difference. ``checks_agree`` is whether the bootstrap supports the
    decision of the t tests. ``beyond`` is the number of participants who differ by more than the bound; it may be
    large even if the means are equivalent.
    """

    bound: float
    alpha: float
    largest: float
    verdict: Verdict
    t_lower: float | None = None
    t_upper: float | None = None
    p_lower: float | None = None
    p_upper: float | None = None
    p_bootstrap: float | None = None
    p_unseen: float | None = None
    checks_agree: bool | None = None
    sd: float | None = None
    beyond: Beyond | None = None


def tost(
    differences: ArrayLike, bound: float, *, alpha: float = 0.05, seed: int = 1, largest: float = STEPS
) -> Equivalence:
    """Test whether the mean of paired differences lies within ± ``bound``, set before the study.

    Parameters
    ----------
    differences : (participants,) array
        NaN for a missing answer, which is dropped.
    bound : float
        The equivalence bound in scale points.
    alpha : float
        Level of each one-sided test.
    seed : int
        Seed of the resamples.
    largest : float
        Largest difference of a participant that the scale permits, in points.
    """
    if not (bound > 0.0 and math.isfinite(bound)):
        raise AnalysisError(
            f"an equivalence bound of {bound} is not meaningful; specify a bound above 0, in points on the scale"
        )
    array = checked_values(differences, "participants")
    kept = np.sort(array[~np.isnan(array)])
    equivalence = _compare_sorted(tuple(kept.tolist()), float(bound), alpha, seed, largest)
    return replace(equivalence, dropped=len(array) - len(kept))


def p_equivalent(means: Means, bound: float, n: int, largest: float | None) -> Array:
    """Return the largest p (studies,) of the tests that the means lie within ± ``bound``.

    ``n`` is the number of participants, for two groups that of the smaller one.
    """
    both = (means, means.opposite())
    ps = [p for means in both for p in (means.p_t(-bound), means.p_bootstrap(-bound))]
    return np.asarray(np.maximum(np.max(ps, axis=0), p_unseen(n, bound, largest)))


def p_unseen(n: int, bound: float, largest: float | None = STEPS) -> float:
    """Return the probability that a sample of ``n`` participants contains no member of the `smallest_minority`."""
    return float((1 - smallest_minority(bound, largest)) ** n)


@lru_cache(maxsize=4096)
def _compare_sorted(
    differences: tuple[float, ...], bound: float, alpha: float, seed: int, largest: float
) -> Equivalence:
    """Return the comparison of sorted ``differences``; cached, because whole points often give the same differences."""
    values = np.array(differences)
    equivalence = _describe_result(values, bound, alpha, largest)
    if equivalence.n < 2:
        return equivalence
    means = means_of(values[None], seed=seed, resamples=resamples_for(alpha))
    both = (means, means.opposite())
    p_lower, p_upper = (float(means.p_t(-bound)[0]) for means in both)
    by_bootstrap = max(float(means.p_bootstrap(-bound)[0]) for means in both)
    unseen = p_unseen(equivalence.n, bound, largest)
    equivalence = replace(equivalence, p=by_bootstrap, p_bootstrap=by_bootstrap, p_unseen=unseen)
    if equivalence.sd is not None and equivalence.sd > SAME:
        level = 1 - 2 * alpha
        low, high = means.interval(level)
        t_lower, t_upper = (float(means.t(side * bound)[0]) for side in (-1, 1))
        equivalence = replace(
            equivalence,
            statistic=min(t_lower, -t_upper),
            p=max(p_lower, p_upper),
            method=f"t({equivalence.n - 1}), bounds {bound_text(bound)}",
            interval=Interval(low=float(low[0]), high=float(high[0]), level=level, method="t"),
            no_interval="",
            t_lower=t_lower,
            t_upper=t_upper,
            p_lower=p_lower,
            p_upper=p_upper,
        )
    else:
        equivalence = replace(
            equivalence, method=f"bootstrap, bounds {bound_text(bound)}; all observed differences are equal"
        )
    by_tests = max(p_lower, p_upper, by_bootstrap) <= alpha
    beyond = is_beyond(equivalence, bound, alpha)
    if equivalence.interval is not None:
        far_side = means if equivalence.interval.low > 0 else means.opposite()
        bootstrap_agrees = by_bootstrap <= alpha, float(far_side.p_bootstrap(bound)[0]) <= alpha
        equivalence = replace(equivalence, checks_agree=bootstrap_agrees == (max(p_lower, p_upper) <= alpha, beyond))
    verdict: Verdict = "out of reach" if unseen > alpha else "equivalent" if by_tests else "inconclusive"
    too_few = (
        f"too few participants to show equivalence: at least {fewest_participants(alpha, bound, largest)} are needed"
    )
    note = "" if verdict == "equivalent" else too_few if by_tests else "equivalence was not shown"
    return replace(
        equivalence,
        verdict="not equivalent" if beyond else verdict,
        note="the mean differs by more than the bound" if beyond else note,
    )


def is_beyond(outcome: Outcome, bound: float, alpha: float) -> bool:
    """Return whether the whole interval of an effect is further than ``bound`` from 0.

    Without an interval, because all differences are equal, enough of them must lie beyond it for a sign test.
    """
    if outcome.effect is None:
        return False
    too_few = outcome.interval is None and 0.5**outcome.n > alpha
    low, high = (
        (outcome.effect, outcome.effect) if outcome.interval is None else (outcome.interval.low, outcome.interval.high)
    )
    return not too_few and (low > bound + SAME or high < -bound - SAME)


def _describe_result(kept: Array, bound: float, alpha: float, largest: float) -> Equivalence:
    """Return the descriptive part of a result, before any test."""
    n = len(kept)
    too_few = f"{counted(n, 'participant')}: no variation"
    reason = f"all {n} observed differences are equal, so an interval cannot be computed" if n > 1 else too_few
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
        largest=largest,
        verdict="out of reach",
        sd=float(kept.std(ddof=1)) if n > 1 else None,
        beyond=people_beyond(kept, bound) if n else None,
    )


def people_beyond(differences: Array, bound: float) -> Beyond:
    """Return the number of participants who differ by more than a bound."""
    n, count = len(differences), int((np.abs(differences) > bound + SAME).sum())
    return Beyond(count=count, n=n, share=count / n, interval=clopper_pearson(count, n))


_STUDIES_AT_ONCE: Final = 500
"""The number of studies that are resampled together, which limits memory."""


def shows_equivalence(
    differences: Array, bound: float, alpha: float, seed: int = 1, largest: float = STEPS
) -> NDArray[np.bool_]:
    """Return for each study (studies,) whether `tost` would show equivalence within ± ``bound``.

    ``differences`` has shape (studies, participants).
    """
    n, resamples = differences.shape[1], resamples_for(alpha)
    shown = np.zeros(len(differences), dtype=bool)
    if n < 2 or p_unseen(n, bound, largest) > alpha:
        return shown
    candidates = np.flatnonzero(np.abs(differences.mean(axis=1)) < bound)
    for indices in np.array_split(candidates, max(1, math.ceil(len(candidates) / _STUDIES_AT_ONCE))):
        means = means_of(differences[indices], seed=seed, resamples=resamples)
        shown[indices] = p_equivalent(means, bound, n, largest) <= alpha
    return shown

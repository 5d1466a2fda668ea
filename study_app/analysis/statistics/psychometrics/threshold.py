"""The delay that is noticed half of the time: maximum likelihood with a profile interval.

The rates of guesses and lapses are free. Answers of all participants are pooled for the curve; the interval is widened
by what participants differ from each other. A number is given only where noticing rises with the level and the levels
that were presented hold it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import chi2 as chi_square
from scipy.stats import t as t_distribution

from study_app.analysis.statistics.outcome import Array, Interval, Outcome, checked
from study_app.analysis.statistics.psychometrics.psychometric import (
    GUESSES,
    LAPSES,
    TINY,
    Bounds,
    Counts,
    Curve,
    Profile,
    Shape,
    at_bounds,
    fit,
    profile,
    profile_at,
    share,
)
from study_app.analysis.statistics.psychometrics.rise import NO_RISE, p_of_rise
from study_app.errors import AnalysisError

NOTICED_FROM: Final = 5.0
"""Agreement from "somewhat agree" on counts as having noticed."""

SURE: Final = 0.95
DROP: Final = float(chi_square.ppf(SURE, 1)) / 2
"""A log-likelihood so much below the best ends the 95 % profile interval of independent answers."""

FINER: Final = 16
"""Each end of the interval is refined within its step of the grid by so many thresholds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Threshold(Outcome):
    """The detection threshold (``effect``, in ms): half-way between ``guess`` and 1 − ``lapse``.

    ``statistic`` is the deviance; ``p`` is that of a rise against a flat line, by the likelihood ratio. ``yes`` of
    ``asked`` answers noticed something at each of ``levels``, where the curve expects ``expected``. ``effect`` and all
    that belongs to the curve are None where no threshold can be stated; ``note`` then says why in one sentence, and
    otherwise what must be said with the number. ``lower`` and ``upper`` are the ends of the interval that exist: where
    one is None there is no interval, and ``no_interval`` says which end is open. ``dispersion`` is how many times more
    than independent answers the participants' answers vary (1: no more, or not known).
    """

    levels: tuple[float, ...]
    yes: tuple[int, ...]
    asked: tuple[int, ...]
    expected: tuple[float, ...]
    width: float | None
    guess: float | None
    lapse: float | None
    lower: float | None
    upper: float | None
    dispersion: float | None
    log_likelihood: float | None
    shape: Shape


@dataclass(frozen=True, slots=True)
class _Found:
    curve: Curve
    ends: tuple[float | None, float | None]
    dispersion: float


def noticed(values: ArrayLike, levels: Sequence[float], *, alpha: float = 0.05, seed: int = 1) -> Threshold:
    """Return the threshold of raw answers: `NOTICED_FROM` or more means noticed, NaN is missing.

    Parameters
    ----------
    values : (participants, levels) or (participants, levels, presentations) array
        Answers in points of the scale.
    levels : sequence of float
        What was presented; equal levels are replicates of one.
    alpha : float
        No threshold is stated where p of a rise is above it.
    seed : int
        Of the rearrangements.
    """
    array = np.asarray(values, dtype=np.float64)
    array = checked(array[..., None] if array.ndim == 2 else array, "participants, levels, presentations")
    there = ~np.isnan(array)
    used = there.any(axis=(1, 2))
    rows = there[used]
    yes, asked = (rows & (array[used] >= NOTICED_FROM)).sum(axis=2), rows.sum(axis=2)
    return _estimated(
        np.asarray(levels, dtype=np.float64),
        yes.astype(np.float64),
        asked.astype(np.float64),
        "logistic",
        (GUESSES, LAPSES),
        int(used.sum()),
        int((~used).sum()),
        alpha,
        seed,
    )


def threshold(
    levels: ArrayLike,
    yes: ArrayLike,
    asked: ArrayLike,
    *,
    shape: Shape = "logistic",
    guess: float | None = None,
    lapse: float | None = None,
    alpha: float = 0.05,
    seed: int = 1,
) -> Threshold:
    """Fit a psychometric function to counts of independent yes answers.

    Parameters
    ----------
    levels, yes, asked : (levels,) arrays
        What was presented, how often it was noticed, and how often it was asked.
    shape : Shape
        The psychometric function's.
    guess, lapse : float, optional
        Fixed rates; otherwise free up to 0.5.
    alpha : float
        No threshold is stated where p of a rise is above it.
    seed : int
        Of the rearrangements.

    Raises
    ------
    AnalysisError
        The counts do not fit together.
    """
    x, noticed_, presented = (checked(one, "levels") for one in (levels, yes, asked))
    if not len(x) == len(noticed_) == len(presented):
        raise AnalysisError(
            f"{len(x)} levels, {len(noticed_)} yes counts and {len(presented)} asked do not fit together"
        )
    if np.isnan([x, noticed_, presented]).any() or (noticed_ < 0).any() or (noticed_ > presented).any():
        raise AnalysisError(
            f"{noticed_.tolist()} yes of {presented.tolist()} asked cannot be; give counts, yes ≤ asked"
        )
    rates = (GUESSES if guess is None else (guess, guess), LAPSES if lapse is None else (lapse, lapse))
    return _estimated(x, noticed_[None], presented[None], shape, rates, None, 0, alpha, seed)


def _estimated(
    levels: Array,
    yes: Array,
    asked: Array,
    shape: Shape,
    rates: tuple[Bounds, Bounds],
    people: int | None,
    dropped: int,
    alpha: float,
    seed: int,
) -> Threshold:
    """Return the threshold of ``yes`` of ``asked`` answers (participants, levels) where there is one."""
    order = np.unique(levels[(asked > 0).any(axis=0)]) if len(asked) else np.zeros(0)
    same = np.asarray(levels[:, None] == order, dtype=np.float64)
    yes, asked = yes @ same, asked @ same
    counts = Counts(order, yes.sum(axis=0), asked.sum(axis=0))
    n = int(counts.asked.sum()) if people is None else people
    reason = _impossible(counts)
    p = None if reason else p_of_rise(yes, asked, order, shape, seed, alpha)
    if p is not None and p > alpha:
        reason = NO_RISE.format(p=p)
    if reason:
        return _outcome(counts, None, shape, n, dropped, reason, p)
    found = _found(counts, shape, rates, yes, asked)
    reason = _outside(counts, found)
    if reason:
        return _outcome(counts, None, shape, n, dropped, reason, p)
    said = (*at_bounds(counts, found.curve, *rates), *_beyond(counts, found), *_of_whom(people, found.dispersion))
    return _outcome(counts, found, shape, n, dropped, "; ".join(said), p)


def _impossible(counts: Counts) -> str:
    if len(counts.levels) < 3:
        return "fewer than three levels were answered"
    if not counts.yes.any():
        return (
            f"no participant noticed anything up to {counts.levels.max():g}: the threshold lies above, or there is none"
        )
    if (counts.yes == counts.asked).all():
        return "everybody noticed something at every level"
    return ""


def _found(counts: Counts, shape: Shape, rates: tuple[Bounds, Bounds], yes: Array, asked: Array) -> _Found:
    """Return the curve and its interval.

    The drop of the log-likelihood that ends the interval is that of independent answers times the dispersion between
    participants, with t in place of the normal quantile: the scaled likelihood ratio of pooled answers that belong to
    clusters (Chandler & Bate 2007, Biometrika 94, 167–183).
    """
    coarse = profile(counts, shape, *rates)
    best = fit(counts, shape, *rates, coarse)
    naive = _crossings(counts, shape, rates, coarse, best.log_likelihood - DROP)
    people = len(yes)
    if people < 2:
        return _Found(best, _ends(naive), 1.0)
    dispersion = _dispersion(counts, shape, rates, coarse, naive, (yes, asked))
    drop = dispersion * float(t_distribution.ppf((1 + SURE) / 2, people - 1)) ** 2 / 2
    return _Found(best, _ends(_crossings(counts, shape, rates, coarse, best.log_likelihood - drop)), dispersion)


def _ends(crossings: tuple[tuple[float, bool], tuple[float, bool]]) -> tuple[float | None, float | None]:
    (low, low_there), (high, high_there) = crossings
    return low if low_there else None, high if high_there else None


def _crossings(
    counts: Counts, shape: Shape, rates: tuple[Bounds, Bounds], coarse: Profile, cut: float
) -> tuple[tuple[float, bool], tuple[float, bool]]:
    """Return the outermost thresholds at which the profile reaches ``cut``; False: it does so up to the grid's end."""
    above = np.flatnonzero(coarse.log_likelihoods >= cut)
    if not len(above):  # a profile so narrow that it lies between two thresholds of the grid
        above = np.array([int(coarse.log_likelihoods.argmax())])
    cells = []
    for inside, outside in ((above[0], above[0] - 1), (above[-1], above[-1] + 1)):
        there = 0 <= outside < len(coarse.thresholds)
        cells.append((inside, outside if there else inside, there))
    at = coarse.thresholds
    fine = [np.linspace(at[outside], at[inside], FINER) for inside, outside, _ in cells]
    values = profile_at(counts, shape, *rates, coarse, np.concatenate(fine)).log_likelihoods.reshape(2, FINER)
    found = []
    for steps, heights, (_, _, there) in zip(fine, values, cells, strict=True):
        reached = np.flatnonzero(heights >= cut)
        first = int(reached[0]) if len(reached) else FINER - 1
        if first == 0 or heights[first] == heights[first - 1]:
            found.append((float(steps[first]), there))
            continue
        part = np.clip((cut - heights[first - 1]) / (heights[first] - heights[first - 1]), 0.0, 1.0)
        found.append((float(steps[first - 1] + part * (steps[first] - steps[first - 1])), there))
    return found[0], found[1]


def _dispersion(
    counts: Counts,
    shape: Shape,
    rates: tuple[Bounds, Bounds],
    coarse: Profile,
    naive: tuple[tuple[float, bool], tuple[float, bool]],
    answers: tuple[Array, Array],
) -> float:
    """Return the variance of the participants' scores over the information that independent answers would have.

    A score is the finite difference of a participant's log-likelihood between the ends of the interval of independent
    answers: unlike a derivative it exists for a curve that is as steep as the fit allows.
    """
    yes, asked = answers
    at = profile_at(counts, shape, *rates, coarse, np.array([end for end, _ in naive]))
    each = []
    for place, (log_width, guess, lapse) in zip(at.thresholds, at.others, strict=True):
        curve = Curve(float(place), float(np.exp(log_width)) * counts.span, float(guess), float(lapse), 0.0)
        expected = np.clip(share(counts.levels, curve, shape), TINY, 1 - TINY)
        each.append(yes @ np.log(expected) + (asked - yes) @ np.log1p(-expected))
    scores = each[1] - each[0]
    z2 = 2 * DROP
    return max(1.0, float(scores.var(ddof=1)) * len(scores) / (4 * z2))


def _outside(counts: Counts, found: _Found) -> str:
    """Return why a fitted curve gives no threshold: the levels that were presented do not hold it."""
    low, high = float(counts.levels.min()), float(counts.levels.max())
    if not low <= found.curve.threshold <= high:
        return f"the fitted threshold lies outside the levels that were presented ({low:g} to {high:g})"
    if not any(end is not None and low <= end <= high for end in found.ends):
        return f"no end of the interval of the threshold lies among the levels presented ({low:g} to {high:g})"
    return ""


def _beyond(counts: Counts, found: _Found) -> Iterator[str]:
    """Say where the interval reaches beyond what was asked about."""
    if any(end is not None and not counts.levels.min() <= end <= counts.levels.max() for end in found.ends):
        yield "the interval reaches beyond the levels that were presented, where the function's shape alone gives it"


def _of_whom(people: int | None, dispersion: float) -> Iterator[str]:
    if people == 1:
        yield "the answers of one participant: the interval is about this person alone"
    elif people is not None:
        yield (
            "answers of all participants are pooled, and the interval includes how far participants differ (they vary "
            f"{dispersion:.1f} times as much as independent answers)"
        )


def _outcome(
    counts: Counts, found: _Found | None, shape: Shape, n: int, dropped: int, note: str, p: float | None
) -> Threshold:
    curve = None if found is None else found.curve
    lower, upper = (None, None) if found is None else found.ends
    interval = None
    if lower is not None and upper is not None:
        interval = Interval(lower, upper, SURE, "profile likelihood, scaled for participants who differ")
    return Threshold(
        test="detection threshold",
        n=n,
        dropped=dropped,
        statistic_name="deviance",
        statistic=None if curve is None else max(0.0, 2 * (counts.saturated - curve.log_likelihood)),
        p=p,
        method=f"maximum likelihood, {shape} function of level",
        effect_name="detection threshold",
        effect=None if curve is None else curve.threshold,
        interval=interval,
        no_interval="" if interval else note if curve is None else _open(lower, upper),
        note=note,
        levels=tuple(float(level) for level in counts.levels),
        yes=tuple(int(count) for count in counts.yes),
        asked=tuple(int(count) for count in counts.asked),
        expected=() if curve is None else tuple(float(value) for value in share(counts.levels, curve, shape)),
        width=None if curve is None else curve.width,
        guess=None if curve is None else curve.guess,
        lapse=None if curve is None else curve.lapse,
        lower=lower,
        upper=upper,
        dispersion=None if found is None else found.dispersion,
        log_likelihood=None if curve is None else curve.log_likelihood,
        shape=shape,
    )


def _open(lower: float | None, upper: float | None) -> str:
    side = "on both sides" if lower is None and upper is None else "below" if lower is None else "above"
    return f"no interval: the answers leave it open {side}"

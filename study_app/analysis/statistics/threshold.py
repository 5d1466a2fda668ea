"""The delay that is noticed half of the time: maximum likelihood with a profile interval.

The rate of guesses is free and pinned down by what was answered without any delay. Answers of all participants are
pooled, so that the interval does not hold the spread between people.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.stats import chi2 as chi_square

from study_app.analysis.statistics.outcome import Interval, Outcome, checked
from study_app.analysis.statistics.psychometric import (
    GUESSES,
    LAPSES,
    Bounds,
    Counts,
    Curve,
    Shape,
    at_bounds,
    fit,
    share,
)
from study_app.errors import AnalysisError

NOTICED_FROM: Final = 5.0
"""Agreement from "somewhat agree" on counts as having noticed, unless the protocol asks for yes or no."""

DROP: Final = float(chi_square.ppf(0.95, 1)) / 2
"""A log-likelihood so much below the best ends the 95 % profile interval."""

POOLED: Final = "answers of all participants are pooled: the interval does not hold the spread between people"


@dataclass(frozen=True, slots=True, kw_only=True)
class Threshold(Outcome):
    """The detection threshold (``effect``, in ms): half-way between ``guess`` and 1 − ``lapse``.

    ``statistic`` is the deviance; there is no p. ``yes`` of ``asked`` answers noticed something at each of ``levels``,
    where the curve expects ``expected``. ``lower`` and ``upper`` are the ends of the profile that exist: where one is
    None there is no interval, and ``no_interval`` says which end is open. ``note`` says what lies at an end
    of the fit.
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
    log_likelihood: float | None
    shape: Shape


def noticed(values: ArrayLike, levels: Sequence[float], *, noticed_from: float = NOTICED_FROM) -> Threshold:
    """Return the threshold of (participants, levels) answers: ``noticed_from`` or more means noticed, NaN is missing.

    For yes and no coded 1 and 0 give ``noticed_from`` = 1.
    """
    array = checked(values, "participants, levels")
    there = ~np.isnan(array)
    yes = (there & (array >= noticed_from)).sum(axis=0)
    used = there.any(axis=1)
    return threshold(levels, yes, there.sum(axis=0), n=int(used.sum()), dropped=int((~used).sum()))


def threshold(
    levels: ArrayLike,
    yes: ArrayLike,
    asked: ArrayLike,
    *,
    shape: Shape = "logistic",
    guess: float | None = None,
    lapse: float | None = None,
    n: int | None = None,
    dropped: int = 0,
) -> Threshold:
    """Fit a psychometric function to counts of yes answers.

    Parameters
    ----------
    levels, yes, asked : (levels,) arrays
        What was presented, how often it was noticed, and how often it was asked.
    guess, lapse : float, optional
        Fixed rates; otherwise free up to 0.5 and 0.06.
    n, dropped : int
        Participants behind the counts; without, the answers are counted.

    Raises
    ------
    AnalysisError
        The counts do not fit together.
    """
    counts = _counts(checked(levels, "levels"), checked(yes, "levels"), checked(asked, "levels"))
    people = int(counts.asked.sum()) if n is None else n
    reason = _impossible(counts)
    if reason:
        return _outcome(counts, None, (None, None), shape, people, dropped, reason)
    guesses: Bounds = GUESSES if guess is None else (guess, guess)
    lapses: Bounds = LAPSES if lapse is None else (lapse, lapse)
    best = fit(counts, shape, guesses, lapses)
    ends = tuple(_end(counts, shape, guesses, lapses, best, side) for side in (-1.0, 1.0))
    told = (*at_bounds(counts, best, guesses, lapses), *_beyond(counts, ends), *([] if n is None else [POOLED]))
    return _outcome(counts, best, (ends[0], ends[1]), shape, people, dropped, "; ".join(told))


def _counts(levels: ArrayLike, yes: ArrayLike, asked: ArrayLike) -> Counts:
    x, noticed_, presented = np.asarray(levels), np.asarray(yes), np.asarray(asked)
    if not len(x) == len(noticed_) == len(presented):
        raise AnalysisError(
            f"{len(x)} levels, {len(noticed_)} yes counts and {len(presented)} asked do not fit together"
        )
    if np.isnan([x, noticed_, presented]).any() or (noticed_ < 0).any() or (noticed_ > presented).any():
        raise AnalysisError(
            f"{noticed_.tolist()} yes of {presented.tolist()} asked cannot be; give counts, yes ≤ asked"
        )
    kept = presented > 0
    order = np.argsort(x[kept], kind="stable")
    return Counts(x[kept][order], noticed_[kept][order], presented[kept][order])


def _impossible(counts: Counts) -> str:
    if len(np.unique(counts.levels)) < 3:
        return "fewer than three levels were answered"
    if not counts.yes.any():
        return f"nobody noticed anything up to {counts.levels.max():g}: the threshold lies above, or there is none"
    if (counts.yes == counts.asked).all():
        return "everybody noticed something at every level"
    shares = counts.yes / counts.asked
    if np.cov(counts.levels, shares, aweights=counts.asked)[0, 1] <= 0:
        return "noticing does not grow with the level"
    return ""


def _end(counts: Counts, shape: Shape, guess: Bounds, lapse: Bounds, best: Curve, side: float) -> float | None:
    """Return where the profile of the threshold falls by ``DROP`` on one ``side``, or None within a span."""
    near = best

    def above(place: float) -> float:
        nonlocal near
        near = fit(counts, shape, guess, lapse, threshold=place, near=near)
        return near.log_likelihood - best.log_likelihood + DROP

    limit = counts.levels.min() - counts.span if side < 0 else counts.levels.max() + counts.span
    inside = best.threshold
    step = counts.span / 20
    while True:
        outside = inside + side * step
        if (outside - limit) * side > 0:
            return None
        if above(outside) < 0:
            break
        inside, step = outside, step * 1.5
    return float(brentq(above, inside, outside, xtol=1e-5 * counts.span))


def _beyond(counts: Counts, ends: Sequence[float | None]) -> Iterator[str]:
    """Say where the interval reaches beyond what was asked about."""
    if any(end is not None and not counts.levels.min() <= end <= counts.levels.max() for end in ends):
        yield "the interval reaches beyond the levels that were asked about, where only the function's shape tells it"


def _outcome(
    counts: Counts,
    best: Curve | None,
    ends: tuple[float | None, float | None],
    shape: Shape,
    n: int,
    dropped: int,
    note: str,
) -> Threshold:
    lower, upper = ends
    interval = None if lower is None or upper is None else Interval(lower, upper, 0.95, "profile likelihood")
    return Threshold(
        test="detection threshold",
        n=n,
        dropped=dropped,
        statistic_name="deviance",
        statistic=None if best is None else max(0.0, 2 * (counts.saturated - best.log_likelihood)),
        p=None,
        smallest_p=None,
        method=f"maximum likelihood, {shape} function of level",
        effect_name="detection threshold",
        effect=None if best is None else best.threshold,
        interval=interval,
        no_interval="" if interval else note if best is None else _open(lower, upper),
        note=note,
        levels=tuple(float(level) for level in counts.levels),
        yes=tuple(int(count) for count in counts.yes),
        asked=tuple(int(count) for count in counts.asked),
        expected=() if best is None else tuple(float(value) for value in share(counts.levels, best, shape)),
        width=None if best is None else best.width,
        guess=None if best is None else best.guess,
        lapse=None if best is None else best.lapse,
        lower=lower,
        upper=upper,
        log_likelihood=None if best is None else best.log_likelihood,
        shape=shape,
    )


def _open(lower: float | None, upper: float | None) -> str:
    side = "on both sides" if lower is None and upper is None else "below" if lower is None else "above"
    return f"no interval: the answers leave it open {side}"

"""Psychometric functions of pooled answers: fit, test for a rise, detection threshold.

Ψ(x) = γ + (1 − γ − λ) F((x − threshold) / width); the width reaches from F = 5 % to 95 %, γ is the rate of guesses and
λ that of lapses. Wichmann & Hill (2001), Percept. Psychophys. 63, 1293–1313; Schütt et al. (2016), Vision Res. 122,
105–123. The maximum of the likelihood is searched on a grid over all four parameters and refined from its best nodes,
so that it does not depend on starting values.

The width and the place of a curve mean nothing where it is flat, so that the ratio has no chi-square distribution.
Here each participant's answers change places among the levels presented to him or her, which holds the error rate
however participants differ from each other.

The rates of guesses and lapses are free. Answers of all participants are pooled for the curve; the interval is widened
by what participants differ from each other. A number is given only where noticing rises with the level and the levels
that were presented hold it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from scipy.special import expit, ndtr, ndtri
from scipy.stats import chi2 as chi_square
from scipy.stats import t as t_distribution

from study_app.analysis.statistics.outcome import MINIMISER, Array, Interval, Outcome, Whole, checked, draws_for
from study_app.errors import AnalysisError

Shape: TypeAlias = Literal["logistic", "normal"]
Bounds: TypeAlias = tuple[float, float]

GUESSES: Final[Bounds] = (0.0, 0.5)
LAPSES: Final[Bounds] = (0.0, 0.5)
"""Where a free rate may lie. People who never agree are lapses of the pooled answers, and there may be many of them."""

NEAR: Final = 1e-4
"""What is so near to a bound lies on it."""

TINY: Final = 1e-12
"""The smallest and, from 1, the largest share that a curve expects."""

LOGISTIC: Final = 2 * float(np.log(19.0))
NORMAL: Final = 2 * float(ndtri(0.95))
"""From 5 % to 95 % of the standard distributions."""

PLACES: Final = 61
"""Thresholds of the grid, from one span below the lowest level to one span above the highest."""

WIDTHS: Final = 12
RATES: Final = (0.0, 0.02, 0.06, 0.12, 0.2, 0.3, 0.4, 0.5)
"""Widths of the grid (their logarithms evenly spaced), and its rates of guesses and lapses."""

STEPS: Final = np.array(list(product((0.0, -1.0, 1.0), repeat=3)))
SAME_WIDTH: Final = 9
"""So many neighbours in a row have the same width."""

FIRST_STEP: Final = np.array([0.3, 0.03, 0.03])
ROUNDS: Final = 40
"""A node moves to its best neighbour (log width, guesses, lapses), or halves its steps, so many times at most."""

FINEST: Final = 1e-3
"""The search ends where all steps of the log width are smaller."""

POLISHED: Final = 3
"""The best curve is refined from so many local maxima of the profile at most."""


@dataclass(frozen=True, slots=True)
class Counts:
    """Yes answers of ``asked`` at each of ``levels``; levels without any question are left out."""

    levels: Array
    yes: Array
    asked: Array

    @property
    def span(self) -> float:
        """From the lowest level to the highest."""
        return float(np.ptp(self.levels))

    @property
    def saturated(self) -> float:
        """The log-likelihood of a model that fits every share exactly."""
        return float(_log_likelihoods(self, self.yes / self.asked))


@dataclass(frozen=True, slots=True)
class Curve:
    """A fitted function and its log-likelihood (without the binomial constants)."""

    threshold: float
    width: float
    guess: float
    lapse: float
    log_likelihood: float


@dataclass(frozen=True, slots=True)
class Profile:
    """The best curves at fixed ``thresholds`` (places,), their ``log_likelihoods`` and ``others`` (places, 3).

    ``others`` are the logarithm of the width in spans, the guesses and the lapses.
    """

    thresholds: Array
    log_likelihoods: Array
    others: Array


def share(x: Array, curve: Curve, shape: Shape) -> Array:
    """Return the share of yes answers that a fitted ``curve`` expects at ``x``."""
    z = (x - curve.threshold) / curve.width
    grown = expit(LOGISTIC * z) if shape == "logistic" else ndtr(NORMAL * z)
    found: Array = curve.guess + (1 - curve.guess - curve.lapse) * grown
    return found


def places(counts: Counts) -> Array:
    """Return the thresholds of the grid."""
    return np.linspace(counts.levels.min() - counts.span, counts.levels.max() + counts.span, PLACES)


def profile(counts: Counts, shape: Shape, guess: Bounds, lapse: Bounds) -> Profile:
    """Return the curves of maximum likelihood at the thresholds of the grid, with rates within bounds.

    Equal bounds hold a rate fixed.
    """
    nodes, yes, no = _grid(tuple(counts.levels.tolist()), shape, guess, lapse)
    best = (yes @ counts.yes + no @ (counts.asked - counts.yes)).argmax(axis=1)
    return _refined(counts, shape, guess, lapse, places(counts), nodes[best])


def profile_at(
    counts: Counts, shape: Shape, guess: Bounds, lapse: Bounds, coarse: Profile, thresholds: Array
) -> Profile:
    """Return the curves of maximum likelihood at any ``thresholds`` (places,) within the grid.

    ``coarse`` is the profile over the grid: the search begins at both of its neighbours.
    """
    after = np.clip(np.searchsorted(coarse.thresholds, thresholds), 1, len(coarse.thresholds) - 1)
    near = coarse.others[np.stack([after - 1, after], axis=1)]
    best = _at(counts, shape, thresholds[:, None], near).argmax(axis=1)
    return _refined(counts, shape, guess, lapse, thresholds, near[np.arange(len(best)), best])


@lru_cache(maxsize=4)
def _grid(levels: tuple[float, ...], shape: Shape, guess: Bounds, lapse: Bounds) -> tuple[Array, Array, Array]:
    """Return the nodes (nodes, 3) and the logs of the shares of yes and no there (places, nodes, levels)."""
    counts = Counts(np.array(levels), np.zeros(len(levels)), np.ones(len(levels)))
    nodes = np.array(list(product(np.linspace(*_log_widths(counts), WIDTHS), _rates(guess), _rates(lapse))))
    expected = np.clip(_expected(counts, shape, places(counts)[:, None], nodes[None]), TINY, 1 - TINY)
    return nodes, np.log(expected), np.log1p(-expected)


def _refined(counts: Counts, shape: Shape, guess: Bounds, lapse: Bounds, thresholds: Array, found: Array) -> Profile:
    """Search on from the nodes ``found`` (places, 3)."""
    low, high = _log_widths(counts)
    lows, highs = np.array([low, guess[0], lapse[0]]), np.array([high, guess[1], lapse[1]])
    step = np.tile(np.minimum(FIRST_STEP, highs - lows), (len(thresholds), 1))
    found, reached = found.copy(), _at(counts, shape, thresholds, found)
    for _ in range(ROUNDS):
        rows = np.flatnonzero(step[:, 0] >= FINEST)
        if not len(rows):
            break
        near = np.clip(found[rows, None] + step[rows, None] * STEPS, lows, highs)
        grown = _grown(counts, shape, thresholds[rows, None], near[:, ::SAME_WIDTH, 0])
        values = _log_likelihoods(counts, _with_rates(grown.repeat(SAME_WIDTH, axis=1), near))
        best = values.argmax(axis=1)
        found[rows], reached[rows] = near[np.arange(len(rows)), best], values.max(axis=1)
        step[rows[best == 0]] /= 2
    return Profile(thresholds, reached, found)


def fit(counts: Counts, shape: Shape, guess: Bounds, lapse: Bounds, begun: Profile | None = None) -> Curve:
    """Return the curve of maximum likelihood; ``begun`` is the profile over the grid, where it is known already."""
    start = profile(counts, shape, guess, lapse) if begun is None else begun
    low, span = float(counts.levels.min()), counts.span
    bounds = [(-1.0, 2.0), _log_widths(counts), guess, lapse]
    results = [
        minimize(
            _objective,
            [(start.thresholds[place] - low) / span, *start.others[place]],
            (counts, shape, low, span),
            MINIMISER,
            jac=True,
            bounds=bounds,
            options={"ftol": 1e-11, "gtol": 1e-7, "maxfun": 500},
        )
        for place in _maxima(start.log_likelihoods)[:POLISHED]
    ]
    best = min(results, key=lambda result: float(result.fun))
    place, log_width, guessed, lapsed = (float(value) for value in best.x)
    return Curve(low + place * span, float(np.exp(log_width)) * span, guessed, lapsed, -float(best.fun))


def _maxima(heights: Array) -> Whole:
    """Return the places that no neighbour exceeds, the highest first."""
    fenced = np.pad(heights, 1, constant_values=-np.inf)
    found = np.flatnonzero((heights >= fenced[:-2]) & (heights > fenced[2:]))
    return np.asarray(found[np.argsort(-heights[found], kind="stable")])


def at_bounds(counts: Counts, curve: Curve, guess: Bounds, lapse: Bounds) -> tuple[str, ...]:
    """Return, in words, which parameters of a curve lie at the bounds of the fit: the answers do not determine them."""
    narrow, wide = (counts.span * float(np.exp(end)) for end in _log_widths(counts))
    limits = []
    for what, found, (least, most) in (("guesses", curve.guess, guess), ("lapses", curve.lapse, lapse)):
        if least < most and found > most - NEAR:
            limits.append(f"{what} are at the most that the fit allows ({most:g}) and may be more")
    if curve.width < narrow * (1 + NEAR):
        limits.append("the curve is as steep as the fit allows: the levels lie too far apart to determine it")
    if curve.width > wide * (1 - NEAR):
        limits.append("the curve is as flat as the fit allows")
    return tuple(limits)


def _log_widths(counts: Counts) -> Bounds:
    """Return where the logarithm of the width may lie, in spans."""
    gap = float(np.diff(np.unique(counts.levels)).min())
    return float(np.log(gap / counts.span / 10)), float(np.log(10.0))


def _rates(bounds: Bounds) -> tuple[float, ...]:
    """Return the rates of the grid within bounds."""
    return tuple(dict.fromkeys((bounds[0], *(rate for rate in RATES if bounds[0] < rate < bounds[1]), bounds[1])))


def _at(counts: Counts, shape: Shape, thresholds: Array, others: Array) -> Array:
    """Return the log-likelihoods (…) at ``thresholds`` (…) and ``others`` (…, 3)."""
    return _log_likelihoods(counts, _expected(counts, shape, thresholds, others))


def _expected(counts: Counts, shape: Shape, thresholds: Array, others: Array) -> Array:
    """Return the shares of yes answers (…, levels) at ``thresholds`` (…) and ``others`` (…, 3)."""
    return _with_rates(_grown(counts, shape, thresholds, others[..., 0]), others)


def _grown(counts: Counts, shape: Shape, thresholds: Array, log_widths: Array) -> Array:
    """Return F (…, levels) at ``thresholds`` (…) and ``log_widths`` (…)."""
    factor = LOGISTIC if shape == "logistic" else NORMAL
    scale = factor / (np.exp(log_widths) * counts.span)
    z = (counts.levels - thresholds[..., None]) * scale[..., None]
    found: Array = expit(z) if shape == "logistic" else ndtr(z)
    return found


def _with_rates(grown: Array, others: Array) -> Array:
    """Return the shares of yes answers (…, levels) where F is ``grown`` (…, levels)."""
    found: Array = others[..., 1, None] + (1 - others[..., 1] - others[..., 2])[..., None] * grown
    return found


def _objective(values: Array, counts: Counts, shape: Shape, low: float, span: float) -> tuple[float, Array]:
    """Return −log-likelihood and its gradient for (place, log width, guess, lapse) in spans."""
    place, log_width, guess, lapse = values
    factor = LOGISTIC if shape == "logistic" else NORMAL
    z = factor * ((counts.levels - low) / span - place) / np.exp(log_width)
    grown, slope = (
        (expit(z), expit(z) * expit(-z)) if shape == "logistic" else (ndtr(z), np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi))
    )
    expected = np.clip(guess + (1 - guess - lapse) * grown, TINY, 1 - TINY)
    pull = counts.yes / expected - (counts.asked - counts.yes) / (1 - expected)
    steep = pull * (1 - guess - lapse) * slope
    gradient = np.array(
        [
            -(steep * factor / np.exp(log_width)).sum(),
            -(steep * z).sum(),
            (pull * (1 - grown)).sum(),
            -(pull * grown).sum(),
        ]
    )
    return -float(_log_likelihoods(counts, expected)), -gradient


def _log_likelihoods(counts: Counts, expected: Array) -> Array:
    """Return the log-likelihoods (…) of expected shares (…, levels)."""
    kept = np.clip(expected, TINY, 1 - TINY)
    values: Array = np.log(kept) @ counts.yes + np.log1p(-kept) @ (counts.asked - counts.yes)
    return values


NO_RISE: Final = "noticing is not shown to rise with the level (likelihood ratio against a flat line, p = {p:.3f})"

RISE_DRAWS: Final = 999
CELLS: Final = 2_000_000
"""So many answers are rearranged, and fewer times than ``DRAWS`` where there are many participants."""

AT_ONCE: Final = 20_000
"""So many rearrangements are compared with all curves together: more take more memory."""

RISE_PLACES: Final = 11
RISE_WIDTHS: Final = (0.05, 0.2, 0.5, 1.2, 3.0)
RISE_RATES: Final = (0.0, 0.1, 0.35)


def p_of_rise(yes: Array, asked: Array, levels: Array, shape: Shape, seed: int, alpha: float) -> float:
    """Return p that the share of yes answers rises with the level.

    Parameters
    ----------
    yes, asked : (participants, levels) arrays
        Counts; one row where answers are independent.
    levels : (levels,) array
        Ascending.
    shape : Shape
        The psychometric function's.
    seed : int
        Of the rearrangements.
    alpha : float
        So many rearrangements are drawn that their number does not decide whether p reaches it.
    """
    slope, no = _curves(tuple(levels.tolist()), shape)
    flat = no @ asked.sum(axis=0)
    found = float((slope @ yes.sum(axis=0) + flat).max())
    drawn = _rearranged(yes, asked, seed, alpha)
    different, times = np.unique(drawn, axis=0, return_counts=True)
    parts = (different[first : first + AT_ONCE] for first in range(0, len(different), AT_ONCE))
    highest = np.concatenate([(part @ slope.T + flat).max(axis=1) for part in parts])
    reached = highest >= found - 1e-9 * abs(found)
    return (1 + int(times[reached].sum())) / (1 + len(drawn))


@lru_cache(maxsize=8)
def _curves(levels: tuple[float, ...], shape: Shape) -> tuple[Array, Array]:
    """Return the log odds of yes, and the log of the share of no, of all curves (curves, levels)."""
    at = np.array(levels)
    place, width, guess, lapse = (
        axis.reshape(-1, 1)
        for axis in np.meshgrid(
            np.linspace(at[0], at[-1], RISE_PLACES), np.array(RISE_WIDTHS) * np.ptp(at), RISE_RATES, RISE_RATES
        )
    )
    z = (at - place) / width
    grown = expit(LOGISTIC * z) if shape == "logistic" else ndtr(NORMAL * z)
    expected = np.clip(guess + (1 - guess - lapse) * grown, 1e-9, 1 - 1e-9)
    no = np.log1p(-expected)
    return np.log(expected) - no, no


def _rearranged(yes: Array, asked: Array, seed: int, alpha: float) -> Array:
    """Return the yes counts (draws, levels) after each participant's answers changed places."""
    rng = np.random.default_rng(seed)
    draws = draws_for(alpha, min(RISE_DRAWS, CELLS // max(1, int(asked.sum()))))
    drawn = np.zeros((draws, asked.shape[1]))
    for said, presented in zip(yes.astype(np.int64), asked.astype(np.int64), strict=True):
        drawn += rng.multivariate_hypergeometric(presented, int(said.sum()), size=draws, method="marginals")
    return drawn


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

"""The psychometric function: how the share of yes answers grows with what is presented.

Ψ(x) = γ + (1 − γ − λ) F((x − threshold) / width); the width reaches from F = 5 % to 95 %, γ is the rate of guesses and
λ that of lapses. Wichmann & Hill (2001), Percept. Psychophys. 63, 1293–1313; Schütt et al. (2016), Vision Res. 122,
105–123. The maximum of the likelihood is searched on a grid over all four parameters and refined from its best nodes,
so that it does not depend on starting values.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Final, Literal, TypeAlias

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, ndtr, ndtri

from study_app.analysis.statistics.outcome import MINIMISER, Array, Whole

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

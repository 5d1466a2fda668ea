"""The psychometric function: how the share of yes answers grows with what is presented.

Ψ(x) = γ + (1 − γ − λ) F((x − threshold) / width); the width reaches from F = 5 % to 95 %, γ is the rate of guesses and
λ that of lapses. Wichmann & Hill (2001), Percept. Psychophys. 63, 1293–1313; Schütt et al. (2016), Vision Res. 122,
105–123.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, ndtr, ndtri

from study_app.analysis.statistics.outcome import MINIMISER, Array

Shape: TypeAlias = Literal["logistic", "normal"]
Bounds: TypeAlias = tuple[float, float]

GUESSES: Final[Bounds] = (0.0, 0.5)
LAPSES: Final[Bounds] = (0.0, 0.06)
"""Where a free rate may lie (lapses: Wichmann & Hill)."""

NEAR: Final = 1e-4
"""What is so near to a bound lies on it."""

LOGISTIC: Final = 2 * float(np.log(19.0))
NORMAL: Final = 2 * float(ndtri(0.95))
"""From 5 % to 95 % of the standard distributions."""


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
        return _log_likelihood(self, self.yes / self.asked)


@dataclass(frozen=True, slots=True)
class Curve:
    """A fitted function and its log-likelihood (without the binomial constants)."""

    threshold: float
    width: float
    guess: float
    lapse: float
    log_likelihood: float


def share(x: Array, curve: Curve, shape: Shape) -> Array:
    """Return the share of yes answers that a fitted ``curve`` expects at ``x``."""
    z = (x - curve.threshold) / curve.width
    grown = expit(LOGISTIC * z) if shape == "logistic" else ndtr(NORMAL * z)
    found: Array = curve.guess + (1 - curve.guess - curve.lapse) * grown
    return found


def fit(
    counts: Counts,
    shape: Shape,
    guess: Bounds,
    lapse: Bounds,
    *,
    threshold: float | None = None,
    near: Curve | None = None,
) -> Curve:
    """Return the curve of maximum likelihood, with guesses and lapses within bounds (equal ends: fixed).

    ``threshold`` holds the threshold fixed, for profiles; ``near`` is a curve to begin from.
    """
    low, span = float(counts.levels.min()), counts.span
    middle = (-1.0, 2.0) if threshold is None else ((threshold - low) / span,) * 2
    bounds = [middle, _log_widths(counts), guess, lapse]
    lows, highs = ([bound[end] for bound in bounds] for end in (0, 1))
    results = [
        minimize(
            _objective,
            np.clip(start, lows, highs),
            (counts, shape, low, span),
            MINIMISER,
            jac=True,
            bounds=bounds,
            options={"ftol": 1e-11, "gtol": 1e-7, "maxfun": 500},
        )
        for start in _starts(counts, guess, lapse, near, low)
    ]
    best = min(results, key=lambda result: float(result.fun))
    place, log_width, guessed, lapsed = (float(value) for value in best.x)
    return Curve(low + place * span, float(np.exp(log_width)) * span, guessed, lapsed, -float(best.fun))


def at_bounds(counts: Counts, curve: Curve, guess: Bounds, lapse: Bounds) -> tuple[str, ...]:
    """Return what of a fitted curve lies where the fit ends, so that the answers alone do not tell it."""
    narrow, wide = (counts.span * float(np.exp(end)) for end in _log_widths(counts))
    told = []
    for what, found, (least, most) in (("guesses", curve.guess, guess), ("lapses", curve.lapse, lapse)):
        if least < most and found > most - NEAR:
            told.append(f"{what} are at the most that the fit allows ({most:g}) and may be more")
    if curve.width < narrow * (1 + NEAR):
        told.append("the curve is as steep as the fit allows: the levels lie too far apart to tell how steep it is")
    if curve.width > wide * (1 - NEAR):
        told.append("the curve is as flat as the fit allows")
    if not counts.levels.min() <= curve.threshold <= counts.levels.max():
        told.append("the threshold lies outside the levels that were asked about")
    return tuple(told)


def _log_widths(counts: Counts) -> Bounds:
    """Return where the logarithm of the width may lie, in spans."""
    gap = float(np.diff(np.unique(counts.levels)).min())
    return float(np.log(gap / counts.span / 10)), float(np.log(10.0))


def _starts(counts: Counts, guess: Bounds, lapse: Bounds, near: Curve | None, low: float) -> list[list[float]]:
    if near is not None:
        place, width = (near.threshold - low) / counts.span, np.log(near.width / counts.span)
        return [[place, width, near.guess, near.lapse], [place, 0.0, guess[0], lapse[0]]]
    shares = np.maximum.accumulate(counts.yes / counts.asked)
    crossed = float(np.interp((shares[0] + shares[-1]) / 2, shares, counts.levels))
    place = (crossed - low) / counts.span
    return [[place, np.log(width), min(guess[1], guess[0] + 0.02), lapse[0]] for width in (0.15, 0.5, 1.5)]


def _objective(values: Array, counts: Counts, shape: Shape, low: float, span: float) -> tuple[float, Array]:
    """Return −log-likelihood and its gradient for (place, log width, guess, lapse) in spans."""
    place, log_width, guess, lapse = values
    factor = LOGISTIC if shape == "logistic" else NORMAL
    z = factor * ((counts.levels - low) / span - place) / np.exp(log_width)
    grown, slope = (
        (expit(z), expit(z) * expit(-z)) if shape == "logistic" else (ndtr(z), np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi))
    )
    expected = np.clip(guess + (1 - guess - lapse) * grown, 1e-12, 1 - 1e-12)
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
    return -_log_likelihood(counts, expected), -gradient


def _log_likelihood(counts: Counts, expected: Array) -> float:
    kept = np.clip(expected, 1e-12, 1 - 1e-12)
    return float((counts.yes * np.log(kept) + (counts.asked - counts.yes) * np.log1p(-kept)).sum())

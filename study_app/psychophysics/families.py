"""Psychometric functions: the probability of success as a function of level, guess rate and lapse rate.

ψ(u) = γ + (1 − γ − λ) F(u), with the threshold α (F = ½), the width ω (F from 0.05 to 0.95), the guess rate γ and the
lapse rate λ. The coordinate u of a level is its log10 if levels are spaced logarithmically, otherwise the level itself.
"""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import Final, Literal, TypeAlias, assert_never

import numpy as np
from numpy.typing import ArrayLike, NDArray

Family: TypeAlias = Literal["weibull", "normal", "logistic"]
Floats: TypeAlias = NDArray[np.float64]

KAPPA: Final = math.log10(math.log(20.0) / math.log(20.0 / 19.0))
"""Width of a Weibull function of slope one: the distance in log10 from F = 0.05 to F = 0.95."""
Z_95: Final = NormalDist().inv_cdf(0.95)
_LOGIT_95: Final = math.log(19.0)
CLIP: Final = 1e-9
"""Smallest distance of ψ from 0 and 1, so that a single answer cannot exclude a cell."""

_erfc: Final = np.vectorize(math.erfc, otypes=[float])


def normal_cdf(x: Floats) -> Floats:
    """Return the normal distribution function."""
    return np.asarray(0.5 * _erfc(-x / math.sqrt(2.0)), float)


def rise(family: Family, u: ArrayLike, threshold: ArrayLike, width: ArrayLike) -> Floats:
    """Return F, the fraction of the range from the guess rate to one minus the lapse rate.

    Parameters
    ----------
    family : "weibull" | "normal" | "logistic"
        The shape.
    u : array
        Levels, in the coordinate u.
    threshold : array
        The level at which F is one half.
    width : array
        Distance from F = 0.05 to F = 0.95.

    Returns
    -------
    array
        F, of the shape to which the arguments broadcast.
    """
    distance: Floats = (np.asarray(u, float) - threshold) / np.asarray(width, float)
    match family:
        case "weibull":
            return np.negative(np.expm1(-math.log(2.0) * 10.0 ** np.minimum(KAPPA * distance, 300.0)))
        case "normal":
            return np.asarray(0.5 * _erfc(-math.sqrt(2.0) * Z_95 * distance), float)
        case "logistic":
            return np.asarray(1.0 / (1.0 + np.exp(np.minimum(-2.0 * _LOGIT_95 * distance, 700.0))), float)
    assert_never(family)


def position(family: Family, share: float) -> float:
    """Return the distance from the threshold, in widths, at which F reaches ``share``, strictly between 0 and 1."""
    match family:
        case "weibull":
            return math.log10(-math.log1p(-share) / math.log(2.0)) / KAPPA
        case "normal":
            return NormalDist().inv_cdf(share) / (2.0 * Z_95)
        case "logistic":
            return math.log(share / (1.0 - share)) / (2.0 * _LOGIT_95)
    assert_never(family)


def success(
    family: Family, u: ArrayLike, threshold: ArrayLike, width: ArrayLike, guess: ArrayLike, lapse: ArrayLike
) -> Floats:
    """Return ψ, the probability of success; the arguments are broadcast."""
    guess, lapse = np.asarray(guess, float), np.asarray(lapse, float)
    return np.asarray(guess + (1.0 - guess - lapse) * rise(family, u, threshold, width), float)


def level_at(family: Family, percent: float, threshold: float, width: float, guess: float, lapse: float) -> float:
    """Return the level u at which ψ is ``percent``; NaN if ψ never reaches it."""
    proportion = (percent / 100.0 - guess) / (1.0 - guess - lapse)
    return threshold + width * position(family, proportion) if 0.0 < proportion < 1.0 else math.nan

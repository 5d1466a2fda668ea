"""Detection theory: P(correct) of a design from d′, and d′ and bias from counts of answers.

Rates use the log-linear correction (Hautus 1995), so that a rate of 0 or 1 has a finite d′. Models of the designs:
Macmillan & Creelman 2005, Detection Theory, chapters 1, 7, 9 and 10; oddity: Frijters 1979, Br. J. Math. Stat.
Psychol. 32, 229–241. *Independent* observation models compare each interval with known alternatives; *differencing*
models compare the intervals of a trial with each other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from statistics import NormalDist
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from study_app.psychophysics.families import Floats, normal_cdf

Model: TypeAlias = Literal["differencing", "independent"]

NORMAL: Final = NormalDist()
_NODES: Final = 200
_ENDS: Final = 9.0
"""Limits of integrals over the normal density [standard deviations]."""
_MAX_D_PRIME: Final = 20.0
"""The largest d′ in searches."""
_TOLERANCE: Final = 1e-10


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """Sensitivity d′ and bias, from the answers of one observer.

    Attributes
    ----------
    d_prime : float
        Under ``model``. Below chance, it is minus the d′ of a proportion equally far above chance, so that the mean
        over observers who guess is 0.
    criterion : float or None
        c of yes–no and of two-interval forced choice, k of the differencing model of same–different; else None.
    variance : float or None
        Of d′ (Gourevitch & Galanter 1967); None if no closed form exists.
    model : "differencing" | "independent" | None
        None if there is only one model.
    other : float or None
        d′ under the other model.
    """

    d_prime: float
    criterion: float | None = None
    variance: float | None = None
    model: Model | None = None
    other: float | None = None


def rate(count: float, n: float) -> float:
    """Return the proportion ``count`` of ``n`` with the log-linear correction: (count + ½)/(n + 1)."""
    return (count + 0.5) / (n + 1.0)


def proportion_correct(task: str, d_prime: float) -> float:
    """Return P(correct) of an unbiased observer.

    Parameters
    ----------
    task : str
        A key of `PROPORTIONS`, such as "2ifc", "abx differencing" or "oddity".
    d_prime : float
        Distance of comparison and standard in standard deviations of one observation, 0 or more.
    """
    return PROPORTIONS[task](d_prime)


@lru_cache(maxsize=4096)  # 50 ms for oddity
def d_prime_at(task: str, proportion: float) -> float:
    """Return d′ for a P(correct), by bisection to 1e-10; below chance, minus the d′ equally far above chance."""
    chance = PROPORTIONS[task](0.0)
    distance = _inverse(PROPORTIONS[task], chance + abs(proportion - chance))
    return distance if proportion >= chance else 0.0 - distance


def forced_choice(d_prime: float, intervals: int) -> float:
    """Return P(the comparison is the largest of ``intervals``): ∫ φ(x − d′) Φ(x)^(m−1) dx."""
    x, weights = _quadrature(-_ENDS, _ENDS)
    return float((weights * normal_cdf(x + d_prime) ** (intervals - 1)).sum())


def yes_no(hits: float, signals: float, false_alarms: float, noises: float) -> Sensitivity | None:
    """Return d′ = z(H) − z(F) and c = −½(z(H) + z(F)) from counts; None without signal or without noise trials."""
    if not signals or not noises:
        return None
    high, low = rate(hits, signals), rate(false_alarms, noises)
    z_high, z_low = NORMAL.inv_cdf(high), NORMAL.inv_cdf(low)
    variance = sum(
        proportion * (1 - proportion) / (n * NORMAL.pdf(z) ** 2)
        for proportion, n, z in ((high, signals, z_high), (low, noises, z_low))
    )
    return Sensitivity(d_prime=z_high - z_low, criterion=-0.5 * (z_high + z_low), variance=variance)


def two_intervals(first_of_first: float, firsts: float, first_of_second: float, seconds: float) -> Sensitivity | None:
    """Return d′ = (z(H) − z(F))/√2 and c of two-interval forced choice.

    Parameters
    ----------
    first_of_first, firsts : float
        Numbers of answers "first" and of trials, with the comparison first.
    first_of_second, seconds : float
        The same with the comparison second.
    """
    sensitivity = yes_no(first_of_first, firsts, first_of_second, seconds)
    if sensitivity is None or sensitivity.variance is None:
        return None
    return Sensitivity(
        d_prime=sensitivity.d_prime / math.sqrt(2.0),
        criterion=sensitivity.criterion,
        variance=sensitivity.variance / 2.0,
    )


def from_correct(task: str, correct: float, n: float) -> Sensitivity | None:
    """Return d′ from the number of correct answers; None without answers."""
    return Sensitivity(d_prime=d_prime_at(task, rate(correct, n))) if n else None


def abx(correct: float, n: float, model: Model) -> Sensitivity | None:
    """Return d′ of ABX from the number of correct answers; None without answers."""
    if not n:
        return None
    estimates = {name: d_prime_at(f"abx {name}", rate(correct, n)) for name in ("differencing", "independent")}
    other = estimates["independent" if model == "differencing" else "differencing"]
    return Sensitivity(d_prime=estimates[model], model=model, other=other)


def same_different(hits: float, differents: float, false_alarms: float, sames: float, model: Model) -> (
    Sensitivity | None
):  # fmt: skip
    """Return d′ of same–different, and k of the differencing model; None without trials of both kinds.

    Parameters
    ----------
    hits, differents : float
        Numbers of answers "different" and of trials, with different stimuli.
    false_alarms, sames : float
        The same with equal stimuli.
    model : "differencing" | "independent"
        The model of the returned d′; `Sensitivity.other` has the other one.
    """
    if not differents or not sames:
        return None
    high, low = rate(hits, differents), rate(false_alarms, sames)
    k, k_of_fewer = (-math.sqrt(2.0) * NORMAL.inv_cdf(proportion / 2.0) for proportion in (low, min(low, high)))
    distance = _inverse(partial(different_rate, k=k_of_fewer), max(low, high))
    differencing = distance if high >= low else 0.0 - distance
    unbiased = NORMAL.cdf(0.5 * (NORMAL.inv_cdf(high) - NORMAL.inv_cdf(low)))
    independent = d_prime_at("samedifferent independent", unbiased)
    if model == "differencing":
        return Sensitivity(d_prime=differencing, criterion=k, model=model, other=independent)
    return Sensitivity(d_prime=independent, model=model, other=differencing)


def different_rate(d_prime: float, k: float) -> float:
    """Return P("different") of the differencing model for two stimuli that are d′ apart: |x₁ − x₂| > k."""
    root = math.sqrt(2.0)
    return NORMAL.cdf((d_prime - k) / root) + NORMAL.cdf((-d_prime - k) / root)


def rating(noise: ArrayLike, signal: ArrayLike) -> Sensitivity | None:
    """Return d_a = √2 z(AUC) from ratings; None if there are no noise or no signal trials.

    Parameters
    ----------
    noise, signal : array
        The ratings of the lowest level and of another level. AUC is the Mann–Whitney proportion of pairs in which the
        signal is rated higher; ties count half, and the proportion has the log-linear correction.
    """
    low, high = np.sort(np.asarray(noise, float)), np.asarray(signal, float)
    if not low.size or not high.size:
        return None
    below, not_above = np.searchsorted(low, high, "left"), np.searchsorted(low, high, "right")
    wins = float((below + not_above).sum()) / 2.0
    return Sensitivity(d_prime=math.sqrt(2.0) * NORMAL.inv_cdf(rate(wins, low.size * high.size)))


def _inverse(proportion_of: Callable[[float], float], proportion: float) -> float:
    """Return the d′ at which an increasing function reaches ``proportion``; 0 if it is reached at 0."""
    low, high = 0.0, _MAX_D_PRIME
    if proportion <= proportion_of(low):
        return 0.0
    while high - low > _TOLERANCE:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if proportion_of(middle) < proportion else (low, middle)
    return 0.5 * (low + high)


@cache
def _quadrature(low: float, high: float) -> tuple[Floats, Floats]:
    """Return the nodes of Gauss–Legendre quadrature, and the weights multiplied by the normal density."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    x = 0.5 * (low + high) + 0.5 * (high - low) * nodes
    return x, 0.5 * (high - low) * weights * np.exp(-0.5 * x**2) / math.sqrt(2.0 * math.pi)


def _abx_correct(d_prime: float, divisor: float) -> float:
    """Return P(correct) of ABX: the signs of both comparisons are correct, or both are incorrect."""
    first, second = NORMAL.cdf(d_prime / math.sqrt(2.0)), NORMAL.cdf(d_prime / divisor)
    return first * second + (1.0 - first) * (1.0 - second)


def _oddity_correct(d_prime: float) -> float:
    """Return P(correct) of the triangle test: 2 ∫₀^∞ [Φ(−z√3 + d′√⅔) + Φ(−z√3 − d′√⅔)] φ(z) dz."""
    z, weights = _quadrature(0.0, _ENDS)
    shift = d_prime * math.sqrt(2.0 / 3.0)
    return float(
        2.0 * (weights * (normal_cdf(-z * math.sqrt(3.0) + shift) + normal_cdf(-z * math.sqrt(3.0) - shift))).sum()
    )


def _same_different_differencing(d_prime: float) -> float:
    """Return P(correct) for the criterion k at which "same" and "different" trials are equally often correct."""
    k = _inverse(lambda k: -different_rate(d_prime, k) - different_rate(0.0, k), -1.0)
    return 0.5 * (1.0 + different_rate(d_prime, k) - different_rate(0.0, k))


PROPORTIONS: Final[Mapping[str, Callable[[float], float]]] = {
    "2ifc": lambda d_prime: NORMAL.cdf(d_prime / math.sqrt(2.0)),
    "3ifc": partial(forced_choice, intervals=3),
    "4ifc": partial(forced_choice, intervals=4),
    "abx differencing": partial(_abx_correct, divisor=math.sqrt(6.0)),
    "abx independent": partial(_abx_correct, divisor=2.0),
    "oddity": _oddity_correct,
    "samedifferent differencing": _same_different_differencing,
    "samedifferent independent": lambda d_prime: 0.5 * (1.0 + (2.0 * NORMAL.cdf(d_prime / 2.0) - 1.0) ** 2),
    "yesno": lambda d_prime: NORMAL.cdf(d_prime / 2.0),
}
"""Functions from d′ to P(correct), by design and model."""

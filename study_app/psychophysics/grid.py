"""The fit of a psychometric function: the posterior of its parameters on a grid, from counts of answers per level.

The fit does not depend on the order of the answers. Sums use `numpy.einsum`, not BLAS, whose threads stall on busy
cores; only `adaptive` multiplies matrices, which are too small for threads.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from study_app.psychophysics.families import CLIP, Family, Floats, success

Values = tuple[float, ...]

Z_95: Final = 1.959964
"""Half-width of the 95 % interval of a normal distribution [standard deviations]."""
_Z_99: Final = 2.575829

FREE_GUESSES: Final[Values] = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3)
"""Guess rates of the grid if noise trials determine the guess rate."""


JND_WIDTH: Final = 0.205
"""The just-noticeable difference, from 50 to 75 % of the rise of a cumulative normal, as a proportion of its width."""
_OUTER_SHARE: Final = 0.05
_OPEN_MASS: Final = 0.005
"""The largest posterior mass in the outer part of the grid at which an interval's end is not open. [choice]"""


DecadeKind: TypeAlias = Literal["constant", "threshold", "jnd"]
"""What a change of a threshold by a decade is in u.

constant: 1, because u is the logarithm of a level; threshold: proportional to the threshold, because u is the level;
jnd: proportional to the just-noticeable difference, for a point of subjective equality, whose distance from zero does
not affect how precisely levels are compared.
"""


def decade_in_u(kind: DecadeKind, threshold: ArrayLike, width: float) -> Floats:
    """Return the change of each threshold that corresponds to a decade; all numbers are in u."""
    thresholds = np.asarray(threshold, float)
    if kind == "constant":
        return np.ones(thresholds.shape)
    sizes = np.abs(thresholds) if kind == "threshold" else np.full(thresholds.shape, JND_WIDTH * width)
    return math.log(10) * sizes


@dataclass(frozen=True, kw_only=True)
class Grid:
    """The parameter grid of a posterior, with the prior.

    Attributes
    ----------
    family : "weibull" | "normal" | "logistic"
        The psychometric function.
    thresholds : tuple of float
        In the coordinate u, evenly spaced, ascending; their prior is flat.
    widths : tuple of float
        In the same coordinate, evenly spaced in their logarithm.
    width_prior : tuple of float or None
        Median and factor (one standard deviation of the logarithm) of the log-normal prior; None: flat.
    lapses, lapse_prior : tuple of float
        The lapse rates and their prior weights.
    guesses : tuple of float or None
        Guess rates, of equal prior weight; None: the guess rate equals the lapse rate.
    session_sd : float
        Standard deviation of a person's threshold between sessions [decades].
    decade : DecadeKind
        What a change of the threshold by a decade is in u.
    """

    family: Family
    thresholds: Values
    widths: Values
    width_prior: tuple[float, float] | None
    lapses: Values
    lapse_prior: Values
    guesses: Values | None
    session_sd: float = 0.0
    decade: DecadeKind = "constant"

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of thresholds, widths, lapse rates and guess rates."""
        return len(self.thresholds), len(self.widths), len(self.lapses), len(self.guesses or (0.0,))

    @cached_property
    def prior(self) -> NDArray[np.float64]:
        """The prior weight of each cell, of the grid's shape; they sum to one."""
        widths = np.ones(len(self.widths))
        if self.width_prior is not None:
            median, factor = self.width_prior
            widths = np.exp(-0.5 * (np.log(np.array(self.widths) / median) / math.log(factor)) ** 2)
        weights = np.ones(self.shape) * widths[:, None, None] * np.array(self.lapse_prior)[:, None]
        return np.asarray(weights / weights.sum(), float)

    def success(self, levels: ArrayLike) -> NDArray[np.float64]:
        """Return ψ of each cell, clipped, of shape (levels, …); ``levels`` are in the coordinate u."""
        u = np.asarray(levels, float).reshape(-1, 1, 1, 1, 1)
        lapses = np.array(self.lapses)[:, None]
        guesses = lapses if self.guesses is None else np.array(self.guesses)
        psi = success(
            self.family, u, np.array(self.thresholds)[:, None, None, None], np.array(self.widths)[:, None, None],
            guesses, lapses,
        )  # fmt: skip
        return np.clip(np.broadcast_to(psi, (u.shape[0], *self.shape)), CLIP, 1.0 - CLIP)


class Others(NamedTuple):
    """The parameters of a psychometric function other than its threshold."""

    width: float
    guess: float
    lapse: float


@dataclass(frozen=True, eq=False)
class Posterior:
    """The posterior of one observer's psychometric function.

    Attributes
    ----------
    grid : Grid
        The cells and their prior.
    weights : (thresholds, widths, lapses, guesses) array
        The weight of each cell; they sum to one.
    """

    grid: Grid
    weights: NDArray[np.float64]

    @cached_property
    def marginal(self) -> NDArray[np.float64]:
        """The weight of each threshold."""
        return np.asarray(np.einsum("abcd->a", self.weights), float)

    def reweighted(self, factors: NDArray[np.float64]) -> Posterior:
        """Return the posterior if the prior is multiplied by ``factors`` (widths, lapses)."""
        weights = self.weights * factors[:, :, None]
        return Posterior(self.grid, weights / weights.sum())

    def quantile(self, share: float) -> float:
        """Return a quantile of the threshold [u]."""
        return quantile(self.grid.thresholds, self.marginal, share)

    @property
    def threshold(self) -> float:
        """The median of the threshold [u]: the estimate."""
        return self.quantile(0.5)

    @property
    def interval(self) -> tuple[float, float]:
        """The equal-tailed 95 % interval of the person's threshold [u], widened by `session_sd`."""
        middle, session_reach = self.threshold, Z_95 * self.session_sd
        below, above = (math.hypot(self.quantile(proportion) - middle, session_reach) for proportion in (0.025, 0.975))
        return middle - below, middle + above

    @property
    def open_ends(self) -> tuple[bool, bool]:
        """Whether the lower and the upper end of the interval are unknown: the threshold may lie beyond the grid."""
        outer = max(1, round(_OUTER_SHARE * len(self.marginal)))
        return bool(self.marginal[:outer].sum() > _OPEN_MASS), bool(self.marginal[-outer:].sum() > _OPEN_MASS)

    @cached_property
    def decade(self) -> float:
        """The change of the person's threshold [u] that corresponds to a decade."""
        return float(decade_in_u(self.grid.decade, self.threshold, self.others.width))

    @cached_property
    def session_sd(self) -> float:
        """The standard deviation of the person's threshold between sessions [u]."""
        return self.grid.session_sd * self.decade

    @property
    def variance(self) -> float:
        """The variance of the person's threshold [u²]."""
        thresholds = np.array(self.grid.thresholds)
        return float(self.marginal @ (thresholds - float(self.marginal @ thresholds)) ** 2) + self.session_sd**2

    @property
    def others(self) -> Others:
        """The medians of the other parameters, which `families.success` accepts as arguments."""
        width = _median(self.grid.widths, np.einsum("abcd->b", self.weights))
        lapse = _median(self.grid.lapses, np.einsum("abcd->c", self.weights))
        guesses = self.grid.guesses
        guess = lapse if guesses is None else _median(guesses, np.einsum("abcd->d", self.weights))
        return Others(width=width, guess=guess, lapse=lapse)

    def success(self, levels: ArrayLike) -> NDArray[np.float64]:
        """Return ψ at ``levels`` [u] of the function with all median parameters, clipped."""
        psi = success(self.grid.family, levels, self.threshold, **self.others._asdict())
        return np.asarray(np.clip(psi, CLIP, 1.0 - CLIP), float)

    def band(self, levels: ArrayLike) -> NDArray[np.float64]:
        """Return the ends of the pointwise 95 % band of ψ at ``levels`` [u], shape (2, levels)."""
        weights, ends = self.weights, []
        if self.session_sd:
            thresholds = np.array(self.grid.thresholds)
            kernel = np.exp(-0.5 * ((thresholds[:, None] - thresholds) / self.session_sd) ** 2)
            weights = np.einsum("ax,xbcd->abcd", kernel / kernel.sum(axis=0), weights)
        weights = weights.ravel()
        for row in self.grid.success(levels).reshape(np.size(levels), -1):
            order = np.argsort(row)
            ends.append(np.interp((0.025, 0.975), np.cumsum(weights[order]), row[order]))
        return np.asarray(ends, float).T


def fit(levels: ArrayLike, successes: ArrayLike, failures: ArrayLike, grid: Grid) -> Posterior:
    """Return the posterior of a psychometric function from counts of answers.

    Parameters
    ----------
    levels : (k,) array
        The levels, in the coordinate u; −∞ for a level of zero on log spacing.
    successes, failures : (k,) array
        Numbers of answers with and without success at each level; they need not be whole.
    grid : Grid
        The cells and their prior.
    """
    _, *logarithms = tables(replace(grid, width_prior=None, session_sd=0.0), tuple(np.asarray(levels, float).tolist()))
    return posterior(grid, [log_likelihood(successes, failures, *logarithms)])


def log_likelihood(
    successes: ArrayLike, failures: ArrayLike, log_success: NDArray[np.float64], log_failure: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the log likelihood of each cell from counts of answers (k,) and log ψ and log(1 − ψ) (k, …)."""
    total = np.zeros(log_success.shape[1:])
    for counts, logarithms in ((successes, log_success), (failures, log_failure)):
        answered = np.flatnonzero(counts)  # only few levels have answers
        total += np.einsum("k,kabcd->abcd", np.asarray(counts, float)[answered], logarithms[answered])
    return total


def posterior(grid: Grid, log_likelihoods: Sequence[NDArray[np.float64]], shares: ArrayLike = 1.0) -> Posterior:
    """Return the posterior from logarithms of the likelihood in each cell, averaged with weights ``shares``."""
    highest = max(values.max() for values in log_likelihoods)
    likelihood = np.zeros(grid.shape)
    for values, share in zip(log_likelihoods, np.broadcast_to(shares, len(log_likelihoods)), strict=True):
        likelihood += share * np.exp(values - highest)
    weights = grid.prior * likelihood
    return Posterior(grid, np.asarray(weights / weights.sum(), float))


@lru_cache(maxsize=8)
def tables(grid: Grid, levels: Values) -> tuple[NDArray[np.float64], ...]:
    """Return ψ, log ψ and log(1 − ψ) at each level in each cell, each of shape (levels, …)."""
    psi = grid.success(levels)
    return psi, np.log(psi), np.log1p(-psi)


ALIKE: Final = 0.6
"""Proportion of the standard deviation of log widths that is between people of a group; the rest is common. [choice]"""
_APART: Final = (0.05, 0.1, 0.2)
"""Standard deviations of the thresholds of people of one group [range of thresholds]. [choice]"""
MEAN_LAPSE: Final = 0.03
"""The mean lapse rates of groups are exponentially distributed with this mean. [choice]"""
NEAR_MODE: Final = 2
"""Power of the posterior of shared parameters with which estimates of several people are weighted.

A lapse rate cannot be negative, so its posterior mean is too high if there are few lapses, and thresholds would be too
low. [choice]
"""
GROUP_LAPSES: Final = (0.002, 0.01, 0.02, 0.03, 0.045, 0.065, 0.09, 0.12)
"""Mean lapse rates of groups; `_lapse_weights` is the distribution of a person's rate around the mean."""
MANY_LAPSES: Final = 0.09
"""A mean lapse rate for which the group's threshold is also computed, unless the answers exclude it. [choice]"""


def _lapse_weights(lapses: Values, mean: float) -> NDArray[np.float64]:
    """Return the prior weight of each lapse rate in a group with this mean: Erlang's distribution of order 2.

    ``lapses`` ascend; each represents the rates nearest to it.
    """
    edges = 2 / mean * np.array([0.0, *(np.array(lapses[1:]) + lapses[:-1]) / 2, np.inf])
    beyond = np.append((1 + edges[:-1]) * np.exp(-edges[:-1]), 0.0)
    return np.asarray(-np.diff(beyond), float)


def group_lapse_weights() -> NDArray[np.float64]:
    """Return the prior weight of each of `GROUP_LAPSES`; each represents the rates nearest to it."""
    edges = np.array([0.0, *(np.array(GROUP_LAPSES[1:]) + GROUP_LAPSES[:-1]) / 2, np.inf])
    return np.asarray(-np.diff(np.exp(-edges / MEAN_LAPSE)), float)


def lapse_prior(lapses: Values) -> Values:
    """Return the prior weight of each lapse rate for a person in an unknown group."""
    weights_by_mean = [_lapse_weights(lapses, mean) for mean in GROUP_LAPSES]
    return tuple((group_lapse_weights() @ np.array(weights_by_mean)).tolist())


class GroupPriors(NamedTuple):
    """The information that a group's answers provide about each of its members.

    Attributes
    ----------
    factors : (people, widths, lapses) array
        The prior of width and lapse rate given the answers of the others, divided by that of the grid.
    variance : float
        Mean square error of the group's mean threshold due to common parameters [u²].
    below, above : float
        How far the 95 % interval of this error extends below and above [u].
    if_many_lapses : float or None
        This error if the mean lapse rate is `MANY_LAPSES`; None if the likelihood ratio excludes that (p < .01).
    """

    factors: NDArray[np.float64]
    variance: float
    below: float
    above: float
    if_many_lapses: float | None


def group_priors(flat: Sequence[Posterior], width_prior: tuple[float, float]) -> GroupPriors:
    """Return each person's prior of width and lapse rate, given the answers of the others.

    Widths of a group are log-normal around a centre that is itself log-normal; lapse rates are distributed around an
    exponential mean; thresholds are normal around a mean with a flat prior. A person's answers near the threshold
    contain little information on the lapse rate, which shifts the threshold. The answers of a group contain more, and
    the remaining uncertainty is an error that all members share. A single person has `width_prior` and `lapse_prior`,
    apart from the part beyond the grid.

    Parameters
    ----------
    flat : sequence of Posterior
        Posterior of each person, on the same grid, with a flat prior on the width.
    width_prior : tuple of float
        Median and factor of the width prior of a person in an unknown group.
    """
    grid = flat[0].grid
    thresholds, widths = np.array(grid.thresholds), np.log(grid.widths)
    median, log_factor = math.log(width_prior[0]), math.log(width_prior[1])
    width_given_centre = np.exp(-0.5 * ((widths - widths[:, None]) / (ALIKE * log_factor)) ** 2)  # (centres, widths)
    width_given_centre /= width_given_centre.sum(axis=1, keepdims=True)
    lapse_given_mean = np.array([_lapse_weights(grid.lapses, mean) for mean in GROUP_LAPSES]) / grid.lapse_prior
    log_centres = -0.5 * ((widths - median) / log_factor) ** 2 / (1.0 - ALIKE**2)
    log_shared = (log_centres[:, None] + np.log(group_lapse_weights())).ravel()  # (centres × means of lapses)
    threshold_sds = np.array(_APART)[:, None, None] * np.ptp(thresholds)
    threshold_given_mean = np.exp(-0.5 * ((thresholds - thresholds[::2, None]) / threshold_sds) ** 2).reshape(
        -1, len(thresholds)
    )
    threshold_given_mean /= threshold_given_mean.sum(axis=1, keepdims=True)  # (means and spreads, thresholds)
    joint = np.array([np.einsum("abcd->abc", person.weights) for person in flat])
    given_shared = np.einsum("cw,pawl->pacl", width_given_centre, joint)
    given_shared = np.einsum("kl,pacl->pack", lapse_given_mean, given_shared).reshape(*joint.shape[:2], -1)
    evidence = np.log(np.maximum(np.einsum("ma,pas->pms", threshold_given_mean, given_shared), 1e-300))
    evidence_of_others = log_shared + evidence.sum(axis=0) - evidence
    weights = np.exp(evidence_of_others - evidence_of_others.max(axis=(1, 2), keepdims=True)).sum(axis=1)
    weights **= NEAR_MODE if len(flat) > 1 else 1
    weights = (weights / weights.sum(axis=1, keepdims=True)).reshape(len(flat), len(widths), -1)
    factors = np.einsum("pck,cw,kl->pwl", weights, width_given_centre, lapse_given_mean)
    evidence_of_all = log_shared + evidence.sum(axis=0)
    shared = np.exp(evidence_of_all - evidence_of_all.max()).sum(axis=0)
    shared /= shared.sum()
    means = (np.einsum("pas,a->ps", given_shared, thresholds) / given_shared.sum(axis=1)).mean(axis=0)
    errors = means - np.average(means, weights=shared**NEAR_MODE)
    order = np.argsort(errors)
    places = np.cumsum(shared[order]) - shared[order] / 2
    low, high = np.interp((0.025, 0.975), places, errors[order])
    shared_by_lapse = shared.reshape(len(widths), -1)  # (centres, means of lapses)
    likelihoods, many_lapses = shared_by_lapse.sum(axis=0) / group_lapse_weights(), GROUP_LAPSES.index(MANY_LAPSES)
    excluded = math.log(likelihoods.max() / max(likelihoods[many_lapses], 1e-300)) > _Z_99**2 / 2
    return GroupPriors(
        factors=np.asarray(factors, float),
        variance=float(shared @ errors**2),
        below=max(0.0, -float(low)),
        above=max(0.0, float(high)),
        if_many_lapses=None
        if excluded
        else float(
            errors.reshape(shared_by_lapse.shape)[:, many_lapses]
            @ shared_by_lapse[:, many_lapses]
            / shared_by_lapse[:, many_lapses].sum()
        ),
    )


def _median(values: Values, weights: NDArray[np.float64]) -> float:
    """Return the median of a discrete distribution, interpolated between its values."""
    return values[0] if len(values) == 1 else float(np.interp(0.5, np.cumsum(weights) - weights / 2, values))


def quantile(centres: ArrayLike, weights: ArrayLike, share: float) -> float:
    """Return a quantile of a distribution over cells, interpolated linearly between cell edges.

    Parameters
    ----------
    centres : (n,) array
        The centres of the cells, evenly spaced, ascending.
    weights : (n,) array
        Their weights, which sum to one.
    share : float
        Between 0 and 1; 0.5 gives the median.
    """
    centres = np.asarray(centres, float)
    half = 0.5 * (centres[1] - centres[0])
    edges = np.concatenate(([centres[0] - half], centres + half))
    return float(np.interp(share, np.concatenate(([0.0], np.cumsum(weights))), edges))


def evenly(low: float, high: float, count: int) -> Values:
    """Return ``count`` evenly spaced numbers from ``low`` to ``high``."""
    return tuple(np.linspace(low, high, count).tolist())


def geometric(low: float, high: float, count: int) -> Values:
    """Return ``count`` numbers from ``low`` to ``high``, evenly spaced in their logarithm."""
    return tuple(np.geomspace(low, high, count).tolist())

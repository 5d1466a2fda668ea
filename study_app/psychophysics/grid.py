"""The posterior of a psychometric function's parameters over a grid, from counts of answers per level.

It has no state and does not depend on the order of the answers. Sums use `numpy.einsum`, not BLAS, whose threads
stall on busy cores; only `simulated_tracks`, which background processes of one thread compute, uses matrix products.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from study_app.psychophysics.families import CLIP, Family, success

Values = tuple[float, ...]

FREE_GUESSES: Final[Values] = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3)
"""Guess rates if the answers to noise trials determine it."""


@dataclass(frozen=True)
class Grid:
    """The cells of a posterior, and their prior.

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
    """

    family: Family
    thresholds: Values
    widths: Values
    width_prior: tuple[float, float] | None
    lapses: Values
    lapse_prior: Values
    guesses: Values | None

    @property
    def shape(self) -> tuple[int, int, int, int]:
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
        found = success(
            self.family, u, np.array(self.thresholds)[:, None, None, None], np.array(self.widths)[:, None, None],
            guesses, lapses,
        )  # fmt: skip
        return np.clip(np.broadcast_to(found, (u.shape[0], *self.shape)), CLIP, 1.0 - CLIP)

    def posterior(self, levels: ArrayLike, successes: ArrayLike, failures: ArrayLike) -> NDArray[np.float64]:
        """Return the posterior weight of each cell, of the grid's shape; they sum to one.

        Parameters
        ----------
        levels : (k,) array
            The levels, in the coordinate u.
        successes, failures : (k,) array
            Numbers of answers with and without success at each level.
        """
        psi = self.success(levels)
        return self.weighted(np.log(psi), np.log1p(-psi), successes, failures)

    def weighted(
        self,
        log_success: NDArray[np.float64],
        log_failure: NDArray[np.float64],
        successes: ArrayLike,
        failures: ArrayLike,
    ) -> NDArray[np.float64]:
        """Return the posterior from log ψ and log(1 − ψ), each of shape (k, …), and counts of shape (k,)."""
        log_likelihood = np.einsum("k,kabcd->abcd", np.asarray(successes, float), log_success)
        log_likelihood += np.einsum("k,kabcd->abcd", np.asarray(failures, float), log_failure)
        weights = self.prior * np.exp(log_likelihood - log_likelihood.max())
        return np.asarray(weights / weights.sum(), float)


def quantile(centres: ArrayLike, weights: ArrayLike, share: float) -> float:
    """Return a quantile of a distribution over cells, interpolated linearly between the cells' edges.

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

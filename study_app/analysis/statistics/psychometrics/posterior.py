"""A participant's threshold: the posterior of a psychometric function, whatever method chose the levels."""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from study_app.psychophysics.grid import Grid, quantile

Beyond: TypeAlias = Literal["above", "below"]


@dataclass(frozen=True, slots=True)
class PosteriorThreshold:
    """Posterior medians, in the coordinate u, and the threshold's equal-tailed 95 % interval.

    ``flat`` is the threshold's median under a flat prior on the width; ``variance`` is the threshold's posterior
    variance; ``beyond`` says that the threshold lies beyond the levels that were presented.
    """

    n: int
    threshold: float
    low: float
    high: float
    variance: float
    width: float
    lapse: float
    guess: float
    flat: float
    beyond: Beyond | None


def fitted(levels: ArrayLike, successes: ArrayLike, failures: ArrayLike, grid: Grid) -> PosteriorThreshold:
    """Return the threshold from counts of answers.

    Parameters
    ----------
    levels : (k,) array
        The levels, in u; −∞ for a level of zero on log spacing.
    successes, failures : (k,) array
        Counts.
    grid : Grid
        The cells and their prior.
    """
    posterior = grid.posterior(levels, successes, failures)
    marginal = posterior.sum(axis=(1, 2, 3))
    thresholds = np.array(grid.thresholds)
    low, middle, high = (quantile(thresholds, marginal, share) for share in (0.025, 0.5, 0.975))
    mean = float(marginal @ thresholds)
    flat = replace(grid, width_prior=None).posterior(levels, successes, failures).sum(axis=(1, 2, 3))
    lapse = _median(grid.lapses, posterior.sum(axis=(0, 1, 3)))
    shown = np.asarray(levels, float)
    shown = shown[np.isfinite(shown)]
    return PosteriorThreshold(
        n=int(np.sum(successes) + np.sum(failures)),
        threshold=middle,
        low=low,
        high=high,
        variance=float(marginal @ (thresholds - mean) ** 2),
        width=_median(grid.widths, posterior.sum(axis=(0, 2, 3))),
        lapse=lapse,
        guess=lapse if grid.guesses is None else _median(grid.guesses, posterior.sum(axis=(0, 1, 2))),
        flat=quantile(thresholds, flat, 0.5),
        beyond="above" if middle > shown.max() else "below" if middle < shown.min() else None,
    )


def band(
    levels: ArrayLike, successes: ArrayLike, failures: ArrayLike, grid: Grid, at: ArrayLike
) -> NDArray[np.float64]:
    """Return the median and the ends of the pointwise 95 % band of ψ at the levels ``at``, shape (3, len(at))."""
    weights = grid.posterior(levels, successes, failures).ravel()
    psi = grid.success(at).reshape(len(np.atleast_1d(np.asarray(at, float))), -1)
    found = []
    for row in psi:
        order = np.argsort(row)
        shares = np.cumsum(weights[order])
        found.append(np.interp((0.5, 0.025, 0.975), shares, row[order]))
    return np.asarray(found, float).T


def narrowing(
    levels: ArrayLike, places: ArrayLike, successes: ArrayLike, grid: Grid
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ends of the threshold's 95 % interval after each answer, shape (n,) each.

    Parameters
    ----------
    levels : (k,) array
        The levels, in u.
    places, successes : (n,) array
        Which level each answer was given to, and whether it was a success, in the order of the trials.
    grid : Grid
        The cells and their prior.
    """
    psi = grid.success(levels)
    log_success, log_failure = np.log(psi), np.log1p(-psi)
    log_likelihood = np.zeros(grid.shape)
    thresholds, ends = np.array(grid.thresholds), []
    for place, right in zip(np.asarray(places, int), np.asarray(successes, bool), strict=True):
        log_likelihood += (log_success if right else log_failure)[place]
        weights = grid.prior * np.exp(log_likelihood - log_likelihood.max())
        marginal = weights.sum(axis=(1, 2, 3)) / weights.sum()
        ends.append([quantile(thresholds, marginal, share) for share in (0.025, 0.975)])
    low, high = np.asarray(ends, float).reshape(-1, 2).T
    return low, high


def _median(values: ArrayLike, weights: NDArray[np.float64]) -> float:
    """Return the median of a distribution over few values, interpolated between them."""
    values = np.asarray(values, float)
    return float(values[0]) if len(values) == 1 else float(np.interp(0.5, np.cumsum(weights) - weights / 2, values))

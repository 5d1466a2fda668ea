"""QUEST+: the next level is the one whose answer is expected to leave the least uncertainty.

Watson 2017 minimises the entropy of all parameters. Prins 2013 minimises that of the threshold's marginal alone, so
that levels are not spent on the width or the lapse rate; that is the default here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from study_app.psychophysics.grid import Grid, Values, fit, tables

Learn: TypeAlias = Literal["threshold", "all"]

TIE_NATS: Final = 1e-9
"""Expected entropies closer than this are equal: rounding on another processor shifts them by 1e-15."""


@dataclass(frozen=True)
class Search:
    """The parameters and levels among which QUEST+ chooses.

    Attributes
    ----------
    grid : Grid
        The parameters, and their prior.
    levels : tuple of float
        The levels that may be presented, in the coordinate u, ascending.
    learn : {"threshold", "all"}
        The parameters whose entropy is minimised.
    noise : bool
        Whether the first of the levels is that of noise trials, which is never chosen.
    """

    grid: Grid
    levels: Values
    learn: Learn = "threshold"
    noise: bool = False

    @property
    def psi(self) -> NDArray[np.float64]:
        """The probability of success at each level of each cell, of shape (levels, …)."""
        return tables(self.grid, self.levels)[0]

    def expected_entropy(self, posteriors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the entropy [nat] expected after an answer, (tracks, levels), of posteriors (tracks, …)."""
        cells = posteriors.reshape(len(posteriors), len(self.grid.thresholds), -1)
        psi = self.psi.reshape(len(self.levels), *cells.shape[1:])
        if self.learn == "threshold":
            succeeded = np.matmul(cells.transpose(1, 0, 2), psi.transpose(1, 2, 0))  # (thresholds, tracks, levels)
            before, axis = cells.sum(axis=2).T[:, :, None], 0
        else:
            succeeded = (psi[None] * cells[:, None]).reshape(len(cells), len(psi), -1)
            before, axis = cells.reshape(len(cells), 1, -1), -1
        return _weighted_entropy(succeeded, axis) + _weighted_entropy(before - succeeded, axis)

    def next_of(self, posteriors: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the index of the next level of each track, (tracks,): the lowest of equal ones."""
        first = int(self.noise)
        entropy = self.expected_entropy(posteriors)[:, first:]
        return first + np.asarray((entropy <= entropy.min(axis=1, keepdims=True) + TIE_NATS).argmax(axis=1), np.int64)

    def next(self, successes: ArrayLike, failures: ArrayLike) -> int:
        """Return the index of the next level to present, from counts of answers to each level."""
        return int(self.next_of(fit(self.levels, successes, failures, self.grid).weights[None])[0])


def _weighted_entropy(joint: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Return p × the entropy of joint/p, for the sum p over an axis of ``joint``."""
    total, terms = joint.sum(axis=axis), np.log(np.maximum(joint, 1e-300))
    terms *= joint
    return np.asarray(total * np.log(total) - terms.sum(axis=axis), float)

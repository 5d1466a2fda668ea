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

    def expected_entropy(self, posterior: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the entropy [nat] expected after an answer to each level, of shape (levels,)."""
        if self.learn == "threshold":
            succeeded = np.einsum("kabcd,abcd->ka", self.psi, posterior)
            before = np.einsum("abcd->a", posterior)[None, :]
        else:
            before = posterior.reshape(1, -1)
            succeeded = self.psi.reshape(len(self.levels), -1) * before
        return _weighted_entropy(succeeded) + _weighted_entropy(before - succeeded)

    def next(self, successes: ArrayLike, failures: ArrayLike) -> int:
        """Return the index of the next level to present: the lowest of equal ones."""
        first = int(self.noise)
        entropy = self.expected_entropy(fit(self.levels, successes, failures, self.grid).weights)[first:]
        return first + int(np.flatnonzero(entropy <= entropy.min() + TIE_NATS)[0])


def _weighted_entropy(joint: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return p × the entropy of joint/p, for the sum p of each row of ``joint``."""
    total = np.einsum("kc->k", joint)
    kept = np.maximum(joint, 1e-300)
    return np.asarray(total * np.log(total) - np.einsum("kc,kc->k", joint, np.log(kept)), float)

"""Whether a motion identifies parameters: the eigenvalues of the information matrix of their logarithms.

With J (n, p) the derivatives of the force by the logarithms of the parameters, w the weights of forgetting, σ² the
variance of the residuals and ρ their correlation from row to row,

    I = (1 − ρ)/(1 + ρ) · Jᵀ W J / σ² .

Its inverse is the covariance of the logarithms (Cramér–Rao; the factor of ρ is that of Bayley & Hammersley 1946 for a
first-order process). A motion identifies the parameters if the smallest eigenvalue of I is at least `NEEDED`: in every
direction of the parameters the half width of the 95 % interval is then 5 % or less.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from study_app.lab.estimation.rows import Floats

Z: Final = 1.959964
"""Half width of the 95 % interval of a normal distribution, in standard deviations."""
PERCENT: Final = 5.0
NEEDED: Final = (100 * Z / PERCENT) ** 2
LEAST_DEVIATION_N: Final = 1e-6
"""Least variance of residuals, for streams without noise."""
_LOADING: Final = 0.1


class Information(NamedTuple):
    """``smallest`` eigenvalue of the matrix, half widths (p,) of the intervals, and which parameters are vague.

    ``half`` are of the logarithms; ``vague`` (p,) are true for parameters in directions below `NEEDED`.
    """

    smallest: float
    half: Floats
    vague: tuple[bool, ...]

    @property
    def identified(self) -> bool:
        """Whether the motion identifies all of them."""
        return self.smallest >= NEEDED


def information(normal: Floats, variance_n2: float, following: float) -> Information:
    """Return the information of a motion.

    Parameters
    ----------
    normal : (p, p) array
        Jᵀ W J [N²].
    variance_n2 : float
        σ² [N²].
    following : float
        ρ, counted from 0 to 0.999.
    """
    rho = min(max(following, 0.0), 0.999)
    matrix = normal * ((1 - rho) / (1 + rho) / max(variance_n2, LEAST_DEVIATION_N**2))
    sizes, directions = np.linalg.eigh(matrix)
    known = np.maximum(sizes, 1e-300)
    half = Z * np.sqrt(np.sum(directions**2 / known, axis=1))
    weak = directions[:, sizes < NEEDED]
    vague = tuple(bool(row.any()) for row in weak**2 > _LOADING)
    return Information(max(float(sizes[0]), 0.0), half, vague)


def interval(value: float, half: float) -> tuple[float, float]:
    """Return the 95 % interval of a value from the half width of its logarithm."""
    half = min(half, 50.0)
    return float(value * math.exp(-half)), float(value * math.exp(half))

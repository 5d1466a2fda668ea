"""Whether noticing rises with the level at all: a likelihood ratio against a flat line, by permutation.

The width and the place of a curve mean nothing where it is flat, so that the ratio has no chi-square distribution.
Here each participant's answers change places among the levels presented to him or her, which holds the error rate
however participants differ from each other.
"""

from functools import lru_cache
from typing import Final

import numpy as np
from scipy.special import expit, ndtr

from study_app.analysis.statistics.outcome import Array, draws_for
from study_app.analysis.statistics.psychometrics.psychometric import LOGISTIC, NORMAL, Shape

NO_RISE: Final = "noticing is not shown to rise with the level (likelihood ratio against a flat line, p = {p:.3f})"

DRAWS: Final = 999
CELLS: Final = 2_000_000
"""So many answers are rearranged, and fewer times than ``DRAWS`` where there are many participants."""

AT_ONCE: Final = 20_000
"""So many rearrangements are compared with all curves together: more take more memory."""

PLACES: Final = 11
WIDTHS: Final = (0.05, 0.2, 0.5, 1.2, 3.0)
RATES: Final = (0.0, 0.1, 0.35)


def p_of_rise(yes: Array, asked: Array, levels: Array, shape: Shape, seed: int, alpha: float) -> float:
    """Return p that the share of yes answers rises with the level.

    Parameters
    ----------
    yes, asked : (participants, levels) arrays
        Counts; one row where answers are independent.
    levels : (levels,) array
        Ascending.
    shape : Shape
        The psychometric function's.
    seed : int
        Of the rearrangements.
    alpha : float
        So many rearrangements are drawn that their number does not decide whether p reaches it.
    """
    slope, no = _curves(tuple(levels.tolist()), shape)
    flat = no @ asked.sum(axis=0)
    found = float((slope @ yes.sum(axis=0) + flat).max())
    drawn = _rearranged(yes, asked, seed, alpha)
    different, times = np.unique(drawn, axis=0, return_counts=True)
    parts = (different[first : first + AT_ONCE] for first in range(0, len(different), AT_ONCE))
    highest = np.concatenate([(part @ slope.T + flat).max(axis=1) for part in parts])
    reached = highest >= found - 1e-9 * abs(found)
    return (1 + int(times[reached].sum())) / (1 + len(drawn))


@lru_cache(maxsize=8)
def _curves(levels: tuple[float, ...], shape: Shape) -> tuple[Array, Array]:
    """Return the log odds of yes, and the log of the share of no, of all curves (curves, levels)."""
    at = np.array(levels)
    place, width, guess, lapse = (
        axis.reshape(-1, 1)
        for axis in np.meshgrid(np.linspace(at[0], at[-1], PLACES), np.array(WIDTHS) * np.ptp(at), RATES, RATES)
    )
    z = (at - place) / width
    grown = expit(LOGISTIC * z) if shape == "logistic" else ndtr(NORMAL * z)
    expected = np.clip(guess + (1 - guess - lapse) * grown, 1e-9, 1 - 1e-9)
    no = np.log1p(-expected)
    return np.log(expected) - no, no


def _rearranged(yes: Array, asked: Array, seed: int, alpha: float) -> Array:
    """Return the yes counts (draws, levels) after each participant's answers changed places."""
    rng = np.random.default_rng(seed)
    draws = draws_for(alpha, min(DRAWS, CELLS // max(1, int(asked.sum()))))
    drawn = np.zeros((draws, asked.shape[1]))
    for said, presented in zip(yes.astype(np.int64), asked.astype(np.int64), strict=True):
        drawn += rng.multivariate_hypergeometric(presented, int(said.sum()), size=draws, method="marginals")
    return drawn

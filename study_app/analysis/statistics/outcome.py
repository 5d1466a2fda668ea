"""What every test returns, and the rules that all of them share for missing answers.

A result never holds NaN: what cannot be computed is None, and ``note`` or ``no_interval`` says why.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import binomtest

from study_app.errors import AnalysisError

Array: TypeAlias = NDArray[np.float64]
Whole: TypeAlias = NDArray[np.int64]

DRAWS: Final = 9999
"""Random rearrangements where not all can be gone through; (1 + those as extreme) / (1 + DRAWS) is then p."""

MOST_DRAWS: Final = 199_999
FLOOR: Final = 0.05
"""The smallest p that draws can give, corrected for its family, is this share of alpha at most."""

SAMPLES: Final = 1999
"""Bootstrap samples of an interval."""

FEW: Final = 10
"""Below so many participants neither a bootstrap interval nor a mixed model is offered: they do not hold there."""

TOO_FEW: Final = f"no interval below {FEW} participants: resampling so few covers far less than it claims"
MINIMISER: Final = "TNC"
"""Scipy's only bounded minimiser that asks no threads of BLAS: on busy cores those made a small fit 50 times slower."""

NO_VARIATION: Final = "no variation: every participant answered alike under all settings"


@dataclass(frozen=True, slots=True)
class Interval:
    """An interval of confidence ``level`` (0.95) and the method that it comes from."""

    low: float
    high: float
    level: float
    method: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a report prints with every test.

    ``n`` participants were used, ``dropped`` were not, for missing answers. ``statistic``, ``p``, ``effect`` are None
    where they do not exist; ``note`` then says why, and otherwise what must be said with the numbers. ``smallest_p`` is
    the smallest p that so many participants with these ties could have given however they had answered; None where p
    is continuous. ``interval`` belongs to ``effect``; where it is None ``no_interval`` says why.
    """

    test: str
    n: int
    dropped: int
    statistic_name: str
    statistic: float | None = None
    p: float | None = None
    smallest_p: float | None = None
    method: str = "none"
    effect_name: str
    effect: float | None = None
    interval: Interval | None = None
    no_interval: str = ""
    note: str = ""

    def reaches(self, alpha: float) -> bool:
        """Return whether these participants could have given a p of at most ``alpha`` at all."""
        return self.p is not None and (self.smallest_p is None or self.smallest_p <= alpha)


def checked(values: ArrayLike, axes: str) -> Array:
    """Return ``values`` as floats, NaN where an answer is missing.

    Parameters
    ----------
    values : array
        One axis for each word in ``axes``.
    axes : str
        Names of the axes ("participants, settings").

    Raises
    ------
    AnalysisError
        The number of axes differs, or a value is infinite.
    """
    array = np.asarray(values, dtype=np.float64)
    wanted = axes.count(",") + 1
    if array.ndim != wanted:
        raise AnalysisError(f"answers of shape {array.shape} cannot be tested; give {wanted} axes: {axes}")
    if np.isinf(array).any():
        raise AnalysisError("an answer is infinite; give numbers, and NaN for what is missing")
    return array


def complete(values: ArrayLike, *, at_least: int, why: str) -> tuple[Array, int]:
    """Return the participants (rows) that answered under all settings (columns), and how many did not.

    Raises
    ------
    AnalysisError
        There are fewer than ``at_least`` settings; ``why`` ends the message.
    """
    array = checked(values, "participants, settings")
    if array.shape[1] < at_least:
        raise AnalysisError(f"{array.shape[1]} settings: at least {at_least} are needed{why}")
    whole = ~np.isnan(array).any(axis=1)
    return array[whole], int((~whole).sum())


def draws_for(alpha: float, usual: int, members: int = 1) -> int:
    """Return how many rearrangements are drawn for each of ``members`` tests: their number decides no verdict."""
    return min(MOST_DRAWS, max(usual, math.ceil(members / (FLOOR * alpha))))


@lru_cache(maxsize=4096)
def clopper_pearson(count: int, n: int) -> Interval:
    """Return the exact 95 % interval of a share of ``count`` in ``n``."""
    ends = binomtest(count, n).proportion_ci(0.95, method="exact")
    return Interval(float(ends.low), float(ends.high), 0.95, "Clopper-Pearson")


def resamples(n: int, seed: int) -> Iterator[Whole]:
    """Yield ``SAMPLES`` draws of n of n participants with replacement, in tables (draws, n) of bounded size."""
    rng = np.random.default_rng(seed)
    rows = max(1, 1_000_000 // n)
    for done in range(0, SAMPLES, rows):
        yield rng.integers(0, n, (min(rows, SAMPLES - done), n))


def percentiles(samples: Array) -> Interval:
    """Return the 95 % percentile interval of bootstrapped values."""
    low, high = np.quantile(samples, [0.025, 0.975])
    return Interval(float(low), float(high), 0.95, f"percentile bootstrap over participants, {SAMPLES} samples")

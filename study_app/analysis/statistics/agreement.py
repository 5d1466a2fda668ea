"""How far two ways of naming agree.

Cohen (1960), Educ. Psychol. Meas. 20, 37–46; its standard error: Fleiss, Cohen & Everitt (1969), Psychol. Bull. 72,
323–327.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from study_app.analysis.statistics.outcome import Array, Interval, checked
from study_app.errors import AnalysisError

SURE: Final = 0.95


@dataclass(frozen=True, slots=True)
class Kappa:
    """Cohen's kappa of ``n`` pairs of names; None with ``note`` where it does not exist.

    ``interval`` takes the pairs to be independent.
    """

    n: int
    kappa: float | None
    agreement: float | None
    expected: float | None
    interval: Interval | None
    note: str


def kappa(table: ArrayLike) -> Kappa:
    """Return Cohen's kappa of a square table of counts.

    Raises
    ------
    AnalysisError
        The table is not square or holds something else than counts.
    """
    counts = checked(table, "categories of one, categories of the other")
    if counts.shape[0] != counts.shape[1] or not (counts >= 0).all():
        raise AnalysisError(
            f"a table of shape {counts.shape} is not a square table of counts: give one row and one column per category"
        )
    n = int(counts.sum())
    if n == 0:
        return Kappa(0, None, None, None, None, "nothing was named")
    shares = counts / n
    agreed = float(np.trace(shares))
    rows, columns = shares.sum(axis=1), shares.sum(axis=0)
    expected = float(rows @ columns)
    if expected == 1.0:
        return Kappa(n, None, agreed, expected, None, "no variation: always the same name for the same thing")
    found = (agreed - expected) / (1 - expected)
    error = _kappa_error(shares, rows, columns, agreed, expected, n)
    reach = float(norm.ppf((1 + SURE) / 2)) * error
    interval = Interval(found - reach, min(1.0, found + reach), SURE, "normal, answers taken as independent")
    return Kappa(n, found, agreed, expected, interval if error > 0.0 else None, "")


def _kappa_error(shares: Array, rows: Array, columns: Array, agreed: float, expected: float, n: int) -> float:
    """Return the standard error of kappa (Fleiss, Cohen & Everitt 1969, eq. 13)."""
    found = (agreed - expected) / (1 - expected)
    ends = columns[:, None] + rows[None, :]
    off = shares * ends**2
    np.fill_diagonal(off, 0.0)
    diagonal = np.diag(shares) * (1 - (rows + columns) * (1 - found)) ** 2
    variance = diagonal.sum() + (1 - found) ** 2 * off.sum() - (found - expected * (1 - found)) ** 2
    return math.sqrt(max(0.0, float(variance))) / ((1 - expected) * math.sqrt(n))

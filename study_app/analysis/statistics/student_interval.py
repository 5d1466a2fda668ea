"""The 95 % interval of a mean by Student's t."""

import math
from typing import Final

import numpy as np
from scipy.stats import t as student

from study_app.analysis.statistics.outcome import Array

ROUNDING: Final = 1e-12
"""Values that differ by less than this share of them are equal."""


def student_interval(values: Array) -> tuple[float | None, float | None]:
    """Return the 95 % interval of a mean (Student 1908); None for a single value and for equal ones."""
    n = len(values)
    if n < 2 or (spread := float(np.std(values, ddof=1))) <= ROUNDING * float(np.abs(values).max()):
        return None, None
    half = float(student.ppf(0.975, n - 1)) * spread / math.sqrt(n)
    return float(values.mean()) - half, float(values.mean()) + half

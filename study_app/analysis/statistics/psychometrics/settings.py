"""Settings of the method of adjustment: point of subjective equality, just-noticeable difference, hysteresis."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from study_app.analysis.statistics.outcome import Array
from study_app.analysis.statistics.student_interval import student_interval


@dataclass(frozen=True, slots=True)
class SettingStatistics:
    """What settings of one observer show, in u: log10 of the level on log spacing, else the level.

    Attributes
    ----------
    n : int
        How many settings.
    pse : float
        Point of subjective equality, their mean.
    low, high : float or None
        Student's 95 % interval of the PSE; None where there is none.
    jnd : float or None
        Just-noticeable difference, their standard deviation (n − 1); None of a single setting.
    hysteresis : float or None
        Mean of the settings that started high − mean of those that started low; None where either is lacking.
    """

    n: int
    pse: float
    low: float | None
    high: float | None
    jnd: float | None
    hysteresis: float | None


def setting_statistics(u: Array, started_high: NDArray[np.bool_]) -> SettingStatistics:
    """Return what settings show (Gescheider 1997, Psychophysics: The Fundamentals, chapter 3).

    Parameters
    ----------
    u : (n,) array
        The settings, at least one.
    started_high : (n,) array
        Of each whether it started in the upper half of the levels.
    """
    above, below = u[started_high], u[~started_high]
    low, high = student_interval(u)
    return SettingStatistics(
        n=len(u),
        pse=float(u.mean()),
        low=low,
        high=high,
        jnd=float(u.std(ddof=1)) if len(u) > 1 else None,
        hysteresis=float(above.mean() - below.mean()) if len(above) and len(below) else None,
    )

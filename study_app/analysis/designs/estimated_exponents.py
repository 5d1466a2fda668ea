"""Exponents of magnitude estimation: how the numbers that participants name grow with the varied number.

An exponent of n is Stevens' power law, answer ∝ levelⁿ (Stevens 1957, Psychological Review 64, 153).
"""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from study_app.analysis.results.level_results import ExponentFound
from study_app.analysis.statistics.student_interval import student_interval
from study_app.analysis.tables.level_blocks import LevelBlock


def estimate_slope(levels: ArrayLike, answers: ArrayLike) -> float:
    """Return the least-squares slope of the mean ln answer at each level on ln level.

    Parameters
    ----------
    levels, answers : (n,) array
        Of each trial, at two different levels or more, all above zero.
    """
    log_levels, log_answers = (np.log(np.asarray(one, float)) for one in (levels, answers))
    places, which = np.unique(log_levels, return_inverse=True)
    means = np.bincount(which, log_answers) / np.bincount(which)
    return float(np.polyfit(places, means, 1)[0])


def estimated_exponents(block: LevelBlock, opened: pd.DataFrame) -> Iterator[ExponentFound]:
    """Yield the exponent of the group, followed by those of the participants with answers at two levels or more.

    Trials of one requested level are at the mean of their delivered levels.
    """
    if block.design.reply != "number":
        return
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & (opened["value"] > 0) & (opened["level"] > 0)]
    own = []
    for person, of_person in rows.groupby("participant", sort=True):
        asked = of_person["level"].astype(float)
        delivered = of_person["level_delivered"].astype(float).groupby(asked).transform("mean")
        levels = delivered.where(delivered > 0, asked).to_numpy()
        if (count := len(np.unique(levels))) >= 2:
            own.append(ExponentFound(str(person), count, estimate_slope(levels, of_person["value"].astype(float))))
    if own:
        yield mean_exponent(own)
    yield from own


def mean_exponent(own: list[ExponentFound]) -> ExponentFound:
    """Return the group's exponent: the mean over participants, with Student's 95 % interval."""
    slopes = np.array([one.exponent for one in own])
    return ExponentFound(None, len(own), float(slopes.mean()), *student_interval(slopes))

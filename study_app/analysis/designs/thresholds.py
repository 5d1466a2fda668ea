"""Thresholds of a block of levels: one posterior per participant and standard, and the group's mean of each standard.

Fits take all counted answers of a participant at the levels delivered to the hand: trials of one requested level lie
at the mean of their delivered levels.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from study_app.analysis.results.level_results import ThresholdFound, compared_percent
from study_app.analysis.statistics.outcome import Array
from study_app.analysis.statistics.psychometrics.goodness import drift, p_of_fit
from study_app.analysis.statistics.psychometrics.posterior import fitted
from study_app.analysis.statistics.random_effects import group_mean
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.analysis.tables.measures import number_or_none
from study_app.analysis.tables.tracks import TRACK, answers_of, setting_of
from study_app.protocol.trials.stimuli import Stimulus, analysis_grid
from study_app.psychophysics.families import CLIP, level_at, success
from study_app.psychophysics.grid import Grid


@dataclass(frozen=True, slots=True)
class Counts:
    """Answers of one participant at one standard, by level in u: shape (k,) each.

    ``places``, shape (n,), are the levels of the rows.
    """

    levels: Array
    successes: Array
    failures: Array
    places: NDArray[np.int64]


def counts_of(stimulus: Stimulus, rows: pd.DataFrame) -> Counts:
    """Return counts by level from rows of tracks, each at the mean of its delivered levels."""
    asked, places = np.unique(rows["level"].to_numpy(dtype=float), return_inverse=True)
    each = rows["level_delivered"].astype("Float64").to_numpy(dtype=float, na_value=math.nan)
    known, k = np.isfinite(each), len(asked)
    measured = np.bincount(places[known], minlength=k)
    delivered = np.bincount(places[known], each[known], minlength=k) / np.maximum(measured, 1)
    has_place = (measured > 0) & ((delivered > 0) | (stimulus.spacing == "linear"))
    placed = np.where(has_place & (asked != 0), delivered, asked)
    successes = np.asarray(np.bincount(places, rows["success"].to_numpy(dtype=float), minlength=k), float)
    return Counts(
        levels=np.array([stimulus.coordinate(float(level)) for level in placed]),
        successes=successes,
        failures=np.asarray(np.bincount(places, minlength=k) - successes, float),
        places=np.asarray(places, np.int64),
    )


def thresholds(block: LevelBlock, opened: pd.DataFrame) -> Iterator[ThresholdFound]:
    """Yield the group's threshold of each standard, followed by those of its participants."""
    assumed, stimulus = block.assumed, block.stimulus
    if assumed is None or stimulus is None:
        return
    grid = analysis_grid(stimulus, block.design, assumed)
    all_rows = opened[(opened["block"] == block.id) & opened["success"].notna()].sort_values(["session", "trial"])
    for standard, at_standard in all_rows.groupby("standard", dropna=False, sort=True):
        own = [
            _own(block, stimulus, grid, standard, person, one)
            for person, one in at_standard.groupby("participant")
            if one["analysed"].any()
        ]
        if own:
            yield _with_compared(stimulus, _group(stimulus, standard, own), own)
        yield from own


def _own(
    block: LevelBlock, stimulus: Stimulus, grid: Grid, standard: Any, person: Any, heard: pd.DataFrame
) -> ThresholdFound:
    """Return a participant's threshold; of the rows those that are analysed enter the fit."""
    rows = heard[heard["analysed"]]
    counts = counts_of(stimulus, rows)
    found = fitted(counts.levels, counts.successes, counts.failures, grid)
    level_of = stimulus.level_of
    psi = success(grid.family, counts.levels, found.threshold, found.width, found.guess, found.lapse)
    psi = np.clip(psi, CLIP, 1 - CLIP)
    percent, compared = compared_percent(block.published), math.nan
    if percent is not None:
        compared = level_at(grid.family, percent, found.threshold, found.width, found.guess, found.lapse)
    return ThresholdFound(
        participant=str(person),
        standard=number_or_none(standard),
        n=found.n,
        threshold=level_of(found.threshold),
        low=level_of(found.low),
        high=level_of(found.high),
        width=found.width,
        lapse=found.lapse,
        guess=found.guess,
        flat_width=level_of(found.flat),
        beyond=found.beyond,
        variance=found.variance,
        fit_p=p_of_fit(counts.successes, counts.successes + counts.failures, psi),
        drift=drift(rows["success"].to_numpy(dtype=bool), psi[counts.places]),
        reversal_mean=_reversal_mean(block, stimulus, heard),
        target_percent=None if block.method is None else block.method.target_percent,
        compared=None if math.isnan(compared) else level_of(compared),
    )


def _reversal_mean(block: LevelBlock, stimulus: Stimulus, heard: pd.DataFrame) -> float | None:
    """Return the mean, in u, of the classical estimates of the tracks; None where none has any."""
    if block.method is None or block.method.target_percent is None:
        return None
    means = []
    for _, rows in heard.groupby(TRACK, sort=True):
        setting = setting_of(block, rows["track"].iloc[0])
        mean = None if setting is None else block.method.reversal_mean(setting, answers_of(rows))
        means += [] if mean is None else [stimulus.coordinate(mean)]
    return stimulus.level_of(float(np.mean(means))) if means else None


def _group(stimulus: Stimulus, standard: Any, own: Sequence[ThresholdFound]) -> ThresholdFound:
    mean, low, high = _mean(stimulus, [one.threshold for one in own], own)
    return ThresholdFound(None, number_or_none(standard), len(own), mean, low, high)


def _with_compared(stimulus: Stimulus, group: ThresholdFound, own: Sequence[ThresholdFound]) -> ThresholdFound:
    """Return the group with its level at the published percentage, where all participants have theirs."""
    compared = [one.compared for one in own if one.compared is not None]
    if len(compared) < len(own):
        return group
    mean, low, high = _mean(stimulus, compared, own)
    return replace(group, compared=mean, compared_low=low, compared_high=high)


def _mean(
    stimulus: Stimulus, levels: Sequence[float], own: Sequence[ThresholdFound]
) -> tuple[float, float | None, float | None]:
    """Return the random-effects mean of participants' levels with its interval, by the variances of thresholds."""
    mean = group_mean([stimulus.coordinate(level) for level in levels], [one.variance or 0.0 for one in own])
    low, high = (None if end is None else stimulus.level_of(end) for end in (mean.low, mean.high))
    return stimulus.level_of(mean.mean), low, high

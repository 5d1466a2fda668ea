"""Thresholds of a block of levels: one posterior per participant and standard, and the group's mean of each standard.

Fits take all counted answers of a participant at the levels delivered to the hand: trials of one requested level lie
at the mean of their delivered levels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from study_app.analysis.results.levels import ThresholdFound
from study_app.analysis.statistics.outcome import Array
from study_app.analysis.statistics.psychometrics.posterior import fitted
from study_app.analysis.statistics.random_effects import group_mean
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.protocol.trials.psychometric import Family, analysis_grid, family_of, rises, width_prior_of
from study_app.protocol.trials.stimuli import Stimulus
from study_app.psychophysics.grid import Grid


@dataclass(frozen=True, slots=True)
class Counts:
    """Answers of one participant at one standard, by level in u: shape (k,) each."""

    levels: Array
    successes: Array
    failures: Array


def family(block: LevelBlock) -> Family | None:
    """Return the psychometric function of a block; None where no answer enters one."""
    if block.stimulus is None or not rises(block.stimulus, block.design):
        return None
    return family_of(block.stimulus, block.design)


def grid_of(block: LevelBlock, stimulus: Stimulus, shape: Family) -> Grid:
    """Return the grid over which thresholds of a block are estimated."""
    return analysis_grid(stimulus, block.design, shape, width_prior_of(stimulus))


def counts_of(stimulus: Stimulus, rows: pd.DataFrame) -> Counts:
    """Return counts by level from rows of tracks, each at the mean of its delivered levels."""
    groups = rows.groupby("level", sort=True)
    delivered = groups["level_delivered"].mean().astype("Float64").to_numpy(dtype=float, na_value=math.nan)
    asked = groups["level"].first().to_numpy(dtype=float)
    placed = np.where(np.isfinite(delivered) & (delivered > 0) & (asked != 0), delivered, asked)
    successes = groups["success"].sum().to_numpy(dtype=float)
    return Counts(
        levels=np.array([stimulus.coordinate(float(level)) for level in placed]),
        successes=successes,
        failures=groups["success"].count().to_numpy(dtype=float) - successes,
    )


def thresholds(block: LevelBlock, opened: pd.DataFrame) -> Iterator[ThresholdFound]:
    """Yield the group's threshold of each standard, followed by those of its participants.

    Parameters
    ----------
    block : LevelBlock
        A block whose key is open.
    opened : DataFrame
        The rows of `tracks`.
    """
    shape, stimulus = family(block), block.stimulus
    if shape is None or stimulus is None:
        return
    grid = grid_of(block, stimulus, shape)
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["success"].notna()]
    for standard, at_standard in rows.groupby("standard", dropna=False, sort=True):
        own = [_own(stimulus, grid, standard, person, one) for person, one in at_standard.groupby("participant")]
        yield _group(stimulus, standard, [one for one, _ in own], [variance for _, variance in own])
        yield from (one for one, _ in own)


def _own(
    stimulus: Stimulus, grid: Grid, standard: Any, person: Any, rows: pd.DataFrame
) -> tuple[ThresholdFound, float]:
    """Return a participant's threshold and its variance in u."""
    counts = counts_of(stimulus, rows)
    found = fitted(counts.levels, counts.successes, counts.failures, grid)
    level_of = stimulus.level_of
    one = ThresholdFound(
        participant=str(person),
        standard=_number(standard),
        n=found.n,
        threshold=level_of(found.threshold),
        low=level_of(found.low),
        high=level_of(found.high),
        width=found.width,
        lapse=found.lapse,
        guess=found.guess,
        flat_width=level_of(found.flat),
        beyond=found.beyond,
    )
    return one, found.variance


def _group(stimulus: Stimulus, standard: Any, own: list[ThresholdFound], variances: list[float]) -> ThresholdFound:
    mean = group_mean([stimulus.coordinate(one.threshold) for one in own], variances)
    low, high = (None if end is None else stimulus.level_of(end) for end in (mean.low, mean.high))
    return ThresholdFound(None, _number(standard), mean.n, stimulus.level_of(mean.mean), low, high)


def _number(value: Any) -> float | None:
    return None if pd.isna(value) else float(value)

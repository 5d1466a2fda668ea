"""How the tracks of a participant ran at a standard: levels, answers, reversals, and the narrowing interval."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from study_app.analysis.designs.thresholds import counts_of
from study_app.analysis.statistics.outcome import Array
from study_app.analysis.statistics.psychometrics.posterior import narrowing
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.protocol.trials.stimuli import analysis_grid

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class TrackCourse:
    """The answers of one participant at one standard in the order of the trials, shape (n,) each.

    ``levels`` were requested; ``tracks`` count from 1; ``catches`` are catch trials, ``noises`` presented the standard
    alone: neither has a level that its track chose; ``low`` and ``high`` are the ends, as levels, of the 95 %
    interval of the threshold from the answers so far.
    """

    participant: str
    standard: float | None
    tracks: NDArray[np.int64]
    levels: Array
    successes: Flags
    reversals: Flags
    catches: Flags
    noises: Flags
    low: Array
    high: Array


def courses(block: LevelBlock, opened: pd.DataFrame, most: int) -> Iterator[TrackCourse]:
    """Yield the first ``most`` courses of a block by participant and standard, from the rows of `tracks`."""
    assumed, stimulus = block.assumed, block.stimulus
    if assumed is None or stimulus is None:
        return
    grid = analysis_grid(stimulus, block.design, assumed)
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["success"].notna()]
    rows = rows.sort_values(["participant", "session", "trial"])
    for number, (_, own) in enumerate(rows.groupby(["participant", "standard"], dropna=False)):
        if number == most:
            return
        standard = own["standard"].iloc[0]
        counts = counts_of(stimulus, own)
        low, high = narrowing(counts.levels, counts.places, own["success"].to_numpy(dtype=bool), grid)
        yield TrackCourse(
            participant=str(own["participant"].iloc[0]),
            standard=None if pd.isna(standard) else float(standard),
            tracks=np.array([int(name.rpartition("/")[2]) for name in own["track"]], np.int64),
            levels=own["level"].to_numpy(dtype=float),
            successes=own["success"].to_numpy(dtype=bool),
            reversals=own["reversal"].fillna(False).to_numpy(dtype=bool),
            catches=own["catch"].fillna(False).to_numpy(dtype=bool),
            noises=~own["arrangement"].str.contains("C").to_numpy(dtype=bool),
            low=_levels(stimulus.level_of, low),
            high=_levels(stimulus.level_of, high),
        )


def _levels(level_of: Any, values: Array) -> Array:
    return np.array([level_of(float(value)) for value in values])

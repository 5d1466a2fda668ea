"""The 95 % bands of participants' psychometric functions, where a block has one standard."""

from collections.abc import Mapping
from typing import Final

import numpy as np
import pandas as pd

from study_app.analysis.designs.thresholds import counts_of
from study_app.analysis.statistics.outcome import Array
from study_app.analysis.statistics.psychometrics.posterior import band
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.protocol.trials.stimuli import analysis_grid

PLACES: Final = 40


def psychometric_bands(
    block: LevelBlock, opened: pd.DataFrame, people: tuple[str, ...], ends: tuple[float, float]
) -> Mapping[str, Array]:
    """Return the band of each participant, shape (3, k): u, and the ends of the pointwise band there.

    The block has one standard; ``ends`` are the smallest and the largest u.
    """
    assumed, stimulus = block.assumed, block.stimulus
    if assumed is None or stimulus is None:
        return {}
    grid, u = analysis_grid(stimulus, block.design, assumed), np.linspace(*ends, PLACES)
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["success"].notna()]
    found = {}
    for person, own in rows[rows["participant"].isin(people)].groupby("participant"):
        counts = counts_of(stimulus, own)
        _, low, high = band(counts.levels, counts.successes, counts.failures, grid, u)
        found[str(person)] = np.array([u, low, high])
    return found

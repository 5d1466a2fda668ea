"""Studies of levels as files, and blocks and rows of tracks made up in memory."""

import math
from pathlib import Path

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import LevelBlock, Setting
from study_app.protocol.trials.designs import Design, default_design
from study_app.protocol.trials.methods import Constant
from study_app.protocol.trials.stimuli import Stimulus
from study_app.psychophysics.families import success
from tests.protocol.trials import matching
from tests.protocol.trials.level_studies import FIVE_POINTS, SHORT, text_of

MORE, ADAPTIVE = (
    "\n" + (Path(__file__).parent / f"{name}.toml").read_text(encoding="utf-8") for name in ("more", "adaptive")
)
"""Blocks of every reply, and of adaptive methods, that are put after a study of levels."""
SEQUENCE = ('sequence = ["viscosity"]', 'sequence = ["viscosity", "detect", "rate", "number", "equal", "odd", "pairs"]')
STIMULUS = Stimulus(vary="damping_nspm", levels=(0.02, 0.6), standards=(8.0,))
LEVELS = STIMULUS.spaced(9)
NAMES = ["participant", "session", "trial", "block", "standard", "level", "level_delivered", "analysed", "success"]
ROVING = tuple(Setting(code=f"V{number}", condition=f"{standard}/1") for number, standard in enumerate((4, 8), start=1))
ONE = (Setting(code="V1", condition="8/1"),)


def levels_file(folder: Path) -> Path:
    """Write the study with a block of every reply, and return the file."""
    path = folder / "levels.toml"
    path.write_text(text_of(SEQUENCE, *SHORT, more=FIVE_POINTS + MORE), encoding="utf-8", newline="\n")
    return path


def matching_file(folder: Path) -> Path:
    """Write the study whose participants adjust a damper, and return the file."""
    path = folder / "matching.toml"
    path.write_text(matching.text_of(), encoding="utf-8", newline="\n")
    return path


def block(
    design: Design | str = "2ifc", stimulus: Stimulus | None = STIMULUS, settings: tuple[Setting, ...] = ()
) -> LevelBlock:
    """Return a block of constant stimuli, or of conditions if there is no stimulus."""
    kind = default_design(design) if isinstance(design, str) else design
    return LevelBlock("b", "Block", "main", kind, stimulus, settings, Constant() if stimulus else None)


def rows(people: dict[str, float], trials: int = 400) -> pd.DataFrame:
    """Return rows of tracks of people with planted thresholds."""
    draw, trial_rows = np.random.default_rng(4), []
    for person, threshold in people.items():
        for number in range(trials):
            level = LEVELS[number % len(LEVELS)]
            right = bool(draw.random() < success("weibull", math.log10(level), math.log10(threshold), 1.4, 0.5, 0.01))
            trial_rows.append((person, "01", number + 1, "b", 8.0, level, level, True, right))
    return arranged(pd.DataFrame(trial_rows, columns=NAMES))


def arranged(frame: pd.DataFrame) -> pd.DataFrame:
    """Return rows of tracks with the comparison in either interval, in no order."""
    arrangement = np.where(np.random.default_rng(6).random(len(frame)) < 0.5, "CS", "SC")
    return frame.assign(arrangement=arrangement).astype({"level_delivered": "Float64", "success": "boolean"})

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

MORE = """
[stimuli.around]
condition = "oil"
vary = "viscosity_pa_s"
level = "value"
standards = [2]
levels = [0.5, 8]

[designs.numbered]
kind = "estimation"
modulus = { level = 2, number = 10 }

[methods.five]
kind = "constant"
levels = [0.5, 2, 8]
repetitions = 2

[blocks.detect]
task = "stir"
stimulus = "viscosity"
standards = [1]
design = "yesno"
method = "few"

[blocks.rate]
task = "stir"
stimulus = "value"
design = "rated"
method = "five"

[blocks.number]
task = "stir"
stimulus = "value"
design = "numbered"
method = "five"

[blocks.equal]
task = "stir"
stimulus = "around"
design = "2ifc"
method = "five"

[blocks.odd]
task = "stir"
stimulus = "around"
design = "oddity"
method = "five"

[blocks.pairs]
task = "stir"
design = "2ifc"
conditions = ["oil", "other", "late"]
standard = "oil"
repetitions = 4

[[analysis.published]]
block = "number"
measure = "exponent"
value = 0.44
low = 0.42
high = 0.46
source = "Stevens & Guirao 1964"
"""
SEQUENCE = ('sequence = ["viscosity"]', 'sequence = ["viscosity", "detect", "rate", "number", "equal", "odd", "pairs"]')
ADAPTIVE = """
[methods.steps]
kind = "updown"
tracks = 2
trials = 24
step_up = 2

[methods.quest]
kind = "questplus"
trials = 9

[blocks.staircase]
stimulus = "damping"
design = "2ifc"
method = "steps"

[blocks.quest]
stimulus = "damping"
standards = [8]
design = "3ifc"
method = "quest"

[[analysis.published]]
block = "staircase"
measure = "weber"
value = 0.1917
percent = 71
n = 10
source = "Jones et al. 1997"
"""

STIMULUS = Stimulus(vary="damping_nspm", levels=(0.02, 0.6), standards=(8.0,))
LEVELS = STIMULUS.spaced(9)
NAMES = ["participant", "session", "trial", "block", "standard", "level", "level_delivered", "analysed", "success"]
ROVING = tuple(Setting(f"V{number}", f"{standard}/1") for number, standard in enumerate((4, 8), start=1))
ONE = (Setting("V1", "8/1"),)


def levels_file(folder: Path) -> Path:
    """Write the study with a block of every reply, and return the file."""
    path = folder / "levels.toml"
    path.write_text(text_of(SEQUENCE, *SHORT, more=FIVE_POINTS + MORE))
    return path


def matching_file(folder: Path) -> Path:
    """Write the study whose participants adjust a damper, and return the file."""
    path = folder / "matching.toml"
    path.write_text(matching.text_of())
    return path


def block(
    design: Design | str = "2ifc", stimulus: Stimulus | None = STIMULUS, settings: tuple[Setting, ...] = ()
) -> LevelBlock:
    """Return a block of constant stimuli, or of conditions where there is no stimulus."""
    kind = default_design(design) if isinstance(design, str) else design
    return LevelBlock("b", "Block", "main", kind, stimulus, settings, Constant() if stimulus else None)


def rows(people: dict[str, float], trials: int = 400) -> pd.DataFrame:
    """Return rows of tracks of people with planted thresholds."""
    draw, found = np.random.default_rng(4), []
    for person, threshold in people.items():
        for number in range(trials):
            level = LEVELS[number % len(LEVELS)]
            right = bool(draw.random() < success("weibull", math.log10(level), math.log10(threshold), 1.4, 0.5, 0.01))
            found.append((person, "01", number + 1, "b", 8.0, level, level, True, right))
    return arranged(pd.DataFrame(found, columns=NAMES))


def arranged(frame: pd.DataFrame) -> pd.DataFrame:
    """Return rows of tracks with the comparison in either interval, in no order."""
    arrangement = np.where(np.random.default_rng(6).random(len(frame)) < 0.5, "CS", "SC")
    return frame.assign(arrangement=arrangement).astype({"level_delivered": "Float64", "success": "boolean"})

"""Magnitude estimation: the exponent of estimates over the varied number, known and recovered.

An observer's estimate is exp(n y + 0.25 N), where y is the logarithm of what reaches the hand: mean force over RMS
speed. The exponent over the varied number is therefore n times the slope of y over its logarithm at the task's pace,
from which n follows.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis.levels.thresholds import estimate_slope
from study_app.analysis.statistics.outcome import student_interval
from study_app.evidence.thresholds.known_thresholds import PEOPLE, Verdict, group_coverage
from study_app.haptics.model.overrides import override
from study_app.haptics.model.slope_limits import steady
from study_app.protocol.blocks import Block
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.simulated import OBSERVER, Observer, simulate_study
from study_app.protocol.trials.stimuli import DELAYS
from study_app.protocol.trials.tracks import condition_of, design_of, method_of, stimulus_of
from study_app.psychophysics.precision import ESTIMATE_NOISE

EXPONENT: Final = 0.44
"""Of perceived thickness over viscosity (Stevens & Guirao 1964)."""
SPREADS: Final = 3
ERROR_MOST: Final = 0.03
POINTS: Final = 64


@dataclass(frozen=True, slots=True)
class KnownExponent:
    """A study's main block of magnitude estimation, and the exponent of its observers.

    ``resistances`` are those of each level, ascending: mean force over RMS speed at the pace [N·s/m].
    """

    name: str
    protocol: Protocol
    block: Block
    resistances: tuple[float, ...]

    @property
    def levels(self) -> tuple[float, ...]:
        """The levels, ascending, in the unit of the varied number."""
        return tuple(sorted(method_of(self.protocol, self.block).levels_of(stimulus_of(self.protocol, self.block))))

    @property
    def resistance_exponent(self) -> float:
        """The slope of ln resistance over the logarithm of the level, by least squares."""
        return float(np.polyfit(np.log(self.levels), np.log(self.resistances), 1)[0])

    @property
    def observer(self) -> Observer:
        """Who estimates."""
        return replace(OBSERVER, estimates=(EXPONENT / self.resistance_exponent, ESTIMATE_NOISE))


def known_exponent(name: str, protocol: Protocol) -> KnownExponent | None:
    """Return what is known of a study's first main block of magnitude estimation at a pace; None: it has none."""
    for block in protocol.main_blocks:
        if block.stimulus is None or block.design is None:
            continue
        stimulus, task = stimulus_of(protocol, block), protocol.tasks[block.task]
        if design_of(protocol, block).reply != "number" or stimulus.vary in DELAYS or not isinstance(task, Follow):
            continue
        scene = protocol.scene_for(condition_of(protocol, stimulus))
        levels = sorted(method_of(protocol, block).levels_of(stimulus))
        pace_mps = task.fastest_stroke(protocol.device.workspace_m).speed_mps
        of_levels = tuple(_resistance(override(scene, stimulus.vary, level), pace_mps) for level in levels)
        return KnownExponent(name, protocol, block, of_levels)
    return None


def _resistance(scene: Any, fastest_mps: float) -> float:
    """Return mean force over RMS speed [N·s/m] in a sinusoidal motion with this peak speed."""
    speeds = [fastest_mps * math.sin(math.pi * (point + 0.5) / POINTS) for point in range(POINTS)]
    mean_n = sum(steady(scene, speed).drag_n for speed in speeds) / POINTS
    return mean_n / (fastest_mps / math.sqrt(2))


@dataclass(frozen=True, slots=True)
class ExponentsFound:
    """The exponent of each participant of a study, and the group's mean with its 95 % interval."""

    own: tuple[float, ...]
    mean: float
    low: float
    high: float

    def mean_of(self, people: int) -> float:
        """Return the mean over the first participants."""
        return sum(self.own[:people]) / people


def simulate_estimates(one: KnownExponent, number: int, seed: int, people: int = PEOPLE) -> ExponentsFound:
    """Return what a study of ``people`` equal observers finds; ``number`` names its draws.

    They estimate what would reach the hand at the pace.
    """
    reached = dict(zip(one.levels, one.resistances, strict=True))
    who = dict.fromkeys((f"P{person:03d}" for person in range(1, people + 1)), one.observer)
    study = f"validate/{one.name}/{number}"
    rows = simulate_study(one.protocol, who, seed, study, lambda presented: reached.get(presented.value, math.nan))
    frame = pd.DataFrame(row for row in rows if row.block == one.block.id)
    own = [estimate_slope(own["level"], own["answer"]) for _, own in frame.groupby("participant")]
    return found_of(own)


def found_of(own: Sequence[float]) -> ExponentsFound:
    """Return exponents with their mean and its interval (three participants or more)."""
    values = np.asarray(own, float)
    low, high = student_interval(values)
    assert low is not None and high is not None  # noqa: S101, PT018 - several participants have an interval
    return ExponentsFound(tuple(own), float(values.mean()), low, high)


def exponent_verdicts(one: KnownExponent, studies: Sequence[ExponentsFound]) -> Iterator[Verdict]:
    """Yield what studies of equal observers show of magnitude estimation."""
    mean = float(np.mean([found.mean for found in studies]))
    yield Verdict(
        one.name,
        f"exponent over {stimulus_of(one.protocol, one.block).vary}",
        f"{mean:.3f}",
        f"{EXPONENT:g} ± {ERROR_MOST:g}",
        abs(mean - EXPONENT) <= ERROR_MOST,
    )
    share = float(np.mean([found.low <= EXPONENT <= found.high for found in studies]))
    yield group_coverage(one.name, share, len(studies))


def spread_of_exponents(studies: Sequence[ExponentsFound], people: int) -> float:
    """Return the standard deviation of the mean exponent over studies of so many participants."""
    return float(np.std([found.mean_of(people) for found in studies], ddof=1))


def recovered_exponent(one: KnownExponent, exponents: Sequence[float], spread: float) -> Verdict:
    """Return whether rehearsed participants have the known exponent; ``spread`` is from `spread_of_exponents`."""
    mean = float(np.mean(exponents))
    return Verdict(
        one.name,
        f"exponent of {len(exponents)} people",
        f"{mean:.3f}",
        f"{EXPONENT:g} ± {SPREADS} SD ({SPREADS * spread:.3f})",
        abs(mean - EXPONENT) <= SPREADS * spread,
    )

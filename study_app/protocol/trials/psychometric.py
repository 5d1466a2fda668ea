"""The psychometric function of a block: its family, its guess rate, and the grid over which its parameters are known.

The prior is flat in the threshold, log-normal in the width and listed for the lapse rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.stimuli import Stimulus

if TYPE_CHECKING:
    from study_app.psychophysics.grid import Grid

Family: TypeAlias = Literal["weibull", "normal", "logistic"]

RUNNING_THRESHOLDS: Final = 41
RUNNING_WIDTHS: Final = 9
WIDTHS: Final = (0.5, 4.0)
"""The smallest and the largest width, in decades."""
LINEAR_OBSERVER: Final = (1.4, 1.5)
"""Median and factor of the widths [decades] of observers whose d′ is proportional to the level."""
LAPSES: Final = (0.0, 0.02, 0.04)
LAPSE_PRIOR: Final = (0.4, 0.4, 0.2)
ANALYSIS_LAPSES: Final = (0.0, 0.01, 0.02, 0.03, 0.05)
ANALYSIS_LAPSE_PRIOR: Final = (0.25, 0.3, 0.2, 0.15, 0.1)
BEYOND_DECADES: Final = 0.2
"""How far beyond the ends of the levels a threshold is looked for."""


@dataclass(frozen=True, slots=True)
class Assumed:
    """What is assumed about the psychometric function of a block, while levels are chosen and in the analysis.

    Attributes
    ----------
    family : "weibull" | "normal" | "logistic"
        Its shape.
    widths : tuple of float
        The smallest and the largest width, in u.
    width_prior : tuple of float
        Median and factor of the log-normal prior on the width, in u.
    """

    family: Family
    widths: tuple[float, float]
    width_prior: tuple[float, float]


def assumed_for(stimulus: Stimulus, design: Design) -> Assumed:
    """Return what is assumed where the method states nothing else."""
    return Assumed(family_of(stimulus, design), widths_of(stimulus), width_prior_of(stimulus))


def is_distance(stimulus: Stimulus) -> bool:
    """Return whether a level is a distance from a standard."""
    return stimulus.level_kind != "value"


def rises(stimulus: Stimulus, design: Design) -> bool:
    """Return whether the share of successes can only rise with the level, so that it has a threshold.

    It does not where a level is a value and the odd or the repeated interval is asked for: that is noticed above the
    standard and below it.
    """
    return design.adaptive and (is_distance(stimulus) or not design.has_standard or design.asks_for_more)


def family_of(stimulus: Stimulus, design: Design) -> Family:
    """Return the default family: Weibull where a distance of zero must mean chance, else normal."""
    by_chance = is_distance(stimulus) and stimulus.spacing == "log" and design.guess_rate is not None
    return "weibull" if by_chance else "normal"


def guesses_of(stimulus: Stimulus, design: Design) -> tuple[float, ...] | None:
    """Return the guess rates of a design; None where no answer is correct: the guess rate is the lapse rate."""
    from study_app.psychophysics.grid import FREE_GUESSES  # noqa: PLC0415 - loads numpy, where levels are chosen

    if design.has_standard and not is_distance(stimulus):
        return None
    return FREE_GUESSES if design.guess_rate is None else (design.guess_rate,)


def widths_of(stimulus: Stimulus) -> tuple[float, float]:
    """Return the smallest and the largest width, in u."""
    if stimulus.spacing == "log":
        return WIDTHS
    span = stimulus.domain[1] - stimulus.domain[0]
    return span / 8, 2 * span


def width_prior_of(stimulus: Stimulus) -> tuple[float, float]:
    """Return median and factor of the prior on the width, in u."""
    if stimulus.spacing == "log" and is_distance(stimulus):
        return LINEAR_OBSERVER
    return (stimulus.domain[1] - stimulus.domain[0]) / 2, 2.0


def running_grid(stimulus: Stimulus, design: Design, assumed: Assumed, lapses: tuple[float, ...]) -> Grid:
    """Return the grid over which levels are chosen during a session."""
    from study_app.psychophysics.grid import Grid, evenly, geometric  # noqa: PLC0415 - loads numpy

    return Grid(
        family=assumed.family,
        thresholds=evenly(*stimulus.domain, RUNNING_THRESHOLDS),
        widths=geometric(*assumed.widths, RUNNING_WIDTHS),
        width_prior=assumed.width_prior,
        lapses=lapses,
        lapse_prior=LAPSE_PRIOR if lapses == LAPSES else (1.0 / len(lapses),) * len(lapses),
        guesses=guesses_of(stimulus, design),
    )


def analysis_grid(stimulus: Stimulus, design: Design, assumed: Assumed) -> Grid:
    """Return the grid over which thresholds are estimated: finer, and beyond both ends of the levels."""
    from study_app.psychophysics.grid import Grid, evenly, geometric  # noqa: PLC0415 - loads numpy

    low, high = stimulus.domain
    log = stimulus.spacing == "log"
    beyond = BEYOND_DECADES if log else (high - low) / 10
    least, most = assumed.widths
    return Grid(
        family=assumed.family,
        thresholds=evenly(low - beyond, high + beyond, 81),
        widths=geometric(0.8 * least, most, 15),
        width_prior=assumed.width_prior,
        lapses=ANALYSIS_LAPSES,
        lapse_prior=ANALYSIS_LAPSE_PRIOR,
        guesses=guesses_of(stimulus, design),
    )


def ratio_in_u(stimulus: Stimulus, low: float, high: float) -> float:
    """Return the ratio of two levels that are given in u; infinite where the lower is not above zero."""
    least = stimulus.level_of(low)
    return stimulus.level_of(high) / least if least > 0 else math.inf

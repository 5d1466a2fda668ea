"""Simulated people, who may differ from the observers that the analysis assumes, and expected precision.

Validation, `power`, `check`, rehearsals and benchmarks use these observers.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Final, Literal, NamedTuple

import numpy as np

from study_app.psychophysics.families import Floats
from study_app.psychophysics.grid import Z_95

BETWEEN_PEOPLE: Final = 1.2
"""Factor (one standard deviation of the logarithm) between the thresholds of people. [choice]"""
ESTIMATE_NOISE: Final = 0.25
"""Standard deviation of the logarithm of a simulated magnitude estimate. [choice]"""
_WIDTHS: Final = (0.5, 2.5)
LAPSES_MOST: Final = 0.05
_PREFERENCE_SD: Final = 0.25
_CHANGE: Final = 1.2
"""Distributions of random people: limits of log-uniform widths, largest lapse rate, standard deviation of criterion and
of preference for the last answer, and factor (one standard deviation) of the change. [choice]"""
UNIFORM: Final = 12
"""The number of uniform numbers whose sum, minus six, is nearly normal."""


class Person(NamedTuple):
    """A simulated person as an observer.

    Attributes
    ----------
    width : float
        Width of the psychometric function, relative to that of an observer whose d′ is proportional to the level.
    lapse : float
        Proportion of random answers; with k alternatives, one in k of them is correct.
    criterion, repeats : float
        Preference for the first interval, and for the last answer [SD of the decision].
    change : float
        Threshold in the last trial of a block over that in the first.
    """

    width: float = 1.0
    lapse: float = 0.02
    criterion: float = 0.0
    repeats: float = 0.0
    change: float = 1.0

    def lapse_rate(self, answers: int) -> float:
        """Return the proportion of wrong answers at any level, if one of ``answers`` possible answers is correct."""
        return self.lapse * (1.0 - 1.0 / answers)

    def relative_threshold(self, done: float) -> float:
        """Return the threshold relative to its mean after a fraction ``done`` of the block."""
        return float(self.change ** (done - 0.5))

    def perceived_intensity(self, level: float, done: float) -> float:
        """Return a level's perceived intensity relative to the mean threshold: 1 at threshold, for unit width."""
        return float((level / self.relative_threshold(done)) ** (1.0 / self.width))


ASSUMED: Final = Person()
KINDS: Final = {
    "as assumed": ASSUMED,
    "psychometric function half as wide": Person(width=0.5),
    "psychometric function 1.5 times as wide": Person(width=1.5),
    "psychometric function 2.5 times as wide": Person(width=2.5),
    "5 % random answers": Person(lapse=0.05),
    "criterion of 0.5": Person(criterion=0.5),
    "often repeating the last answer": Person(repeats=0.5),
    "learning": Person(change=1 / 1.5),
    "fatigue": Person(change=1.5),
}
"""People who differ in one respect each."""
ALONE: Final = {name: person for name, person in KINDS.items() if not person.criterion and not person.repeats}
"""Kinds without a preference, for designs other than two intervals of which one is correct."""
MIXED: Final = "a mix of these"
"""The kind of a group of random people."""


def draw_normal(draw: Callable[[], float]) -> float:
    """Return an approximately standard normal number from uniform numbers in [0, 1)."""
    return sum(draw() for _ in range(UNIFORM)) - UNIFORM / 2


def draw_person(draw: Callable[[], float]) -> Person:
    """Return a random person, who may differ in every parameter, using uniform numbers in [0, 1)."""
    low, high = _WIDTHS
    return Person(
        width=low * (high / low) ** draw(),
        lapse=LAPSES_MOST * draw(),
        criterion=_PREFERENCE_SD * draw_normal(draw),
        repeats=_PREFERENCE_SD * draw_normal(draw),
        change=_CHANGE ** draw_normal(draw),
    )


def person_of_kind(kind: str, draw: Callable[[], float]) -> Person:
    """Return a person of a kind from `KINDS`, or a random person for `MIXED`."""
    return draw_person(draw) if kind == MIXED else KINDS[kind]


_COVERED: Final = 0.95


class Estimates(NamedTuple):
    """Thresholds of many observers, (observers,) arrays [u]: medians, ends of 95 % intervals, variances.

    ``shared``, (groups,), is the variance of a group's mean due to the common width and lapse rate of its members.
    """

    medians: Floats
    lows: Floats
    highs: Floats
    variances: Floats
    shared: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Expected:
    """The expected precision of one participant's threshold at one standard, d′, d_a or exponent.

    Attributes
    ----------
    spacing : {"log", "linear"}
        Of u: decades, or units of the level; "linear" for d′, d_a and exponents.
    trials : int
        Of one standard.
    standards : int
        Number of standards in the group's mean.
    halves : mapping of str to sequence of float
        Half-widths of participants' 95 % intervals, in u, for each kind; infinite if nothing is measured.
    spreads : mapping of str to float
        Standard deviation of the estimate's error, in u, for each kind; infinite if nothing is measured.
    threshold : float
        Approximate threshold, as a level; or the assumed d′, d_a or exponent.
    decade : float
        Change of the threshold, in u, that corresponds to a decade.
    shared : mapping of str to float
        For each kind, the variance of a group's mean due to the common width and lapse rate, multiplied by the number
        of people, because it is about inversely proportional to that number.
    """

    spacing: Literal["log", "linear"]
    trials: int
    standards: int
    halves: Mapping[str, Sequence[float]]
    spreads: Mapping[str, float]
    threshold: float
    decade: float
    shared: Mapping[str, float] = field(default_factory=dict)

    @property
    def measured(self) -> bool:
        """Whether there are estimates at every standard, because levels are not clipped."""
        return math.isfinite(self.worst[1]) and math.isfinite(self.spread)

    @property
    def median(self) -> float:
        """The median of `halves` over all kinds."""
        return float(np.median(np.concatenate([*self.halves.values()])))

    @property
    def spread(self) -> float:
        """The median of `spreads`."""
        return float(np.median([*self.spreads.values()]))

    @property
    def worst(self) -> tuple[str, float]:
        """The kind of participants with the widest interval, and the median of its half width."""
        return max(((kind, float(np.median(halve))) for kind, halve in self.halves.items()), key=lambda kind: kind[1])

    def group_half_width(self, participants: int, trials: float | None = None) -> float:
        """Return the relative half width of the 95 % interval of a group's mean over all standards, median over kinds.

        Parameters
        ----------
        participants : int
            Number of participants; the result is infinite below two.
        trials : float, optional
            Trials of each standard; variances of errors are assumed to be inversely proportional to it. The error that
            people share is common to all standards.
        """
        if participants < 2:
            return math.inf
        log = self.spacing == "log"
        between = math.log10(BETWEEN_PEOPLE) * self.decade
        fewer, t = self.trials / (trials or self.trials), student_975(participants - 1)
        halves = [
            math.hypot(
                t * math.sqrt(spread**2 * fewer / self.standards + between**2),
                Z_95 * math.sqrt(self.shared.get(kind, 0.0) * fewer),
            )
            for kind, spread in self.spreads.items()
        ]
        half = float(np.median(halves)) / math.sqrt(participants)
        if log:
            return float(10.0**half) - 1.0
        return half / abs(self.threshold) if self.threshold else math.inf

    def participants_for(self, precision: float, most: int = 1000) -> int | None:
        """Return the fewest participants for a relative half width of ``precision``; None: more than ``most``."""
        sizes = range(2, most + 1)
        place = bisect_left(sizes, -precision, key=lambda n: -self.group_half_width(n))
        return sizes[place] if place < len(sizes) else None

    def trials_for(self, precision: float, participants: int, most: int = 1000) -> int | None:
        """Return the fewest sufficient trials per standard, in steps of ten; None if participants differ too much."""
        sufficient = (n for n in range(10, most + 1, 10) if self.group_half_width(participants, n) <= precision)
        return next(sufficient, None)


@cache
def student_975(freedom: int) -> float:
    """Return the 97.5 % quantile of Student's t with a relative error of 1e-6, without importing scipy.

    With t = √ν tan θ the distribution function is the integral of cos^(ν−1) θ.
    """
    if freedom > 2000:
        return Z_95 * (1.0 + (1.0 + Z_95**2) / (4.0 * freedom))
    angles = np.linspace(0.0, math.pi / 2, 40001)
    heights = np.cos(angles) ** (freedom - 1)
    areas = np.concatenate(([0.0], np.cumsum(heights[1:] + heights[:-1])))
    return math.sqrt(freedom) * math.tan(float(np.interp(_COVERED, areas / areas[-1], angles)))

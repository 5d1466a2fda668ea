"""SIMULATED answers: a rater who knows what was felt and seen in a trial, never which condition it was.

For rehearsals and power analysis; never evidence about people, and marked as simulated wherever it is stored. The
rater turns a few features of the trial into an opinion from 1 to 7 for the statements it knows, adds the person's own
leaning and some noise, and rounds. To a statement it does not know it answers near the middle. Shapes and constants are
plausible, not measured **[choice]**; where the thesis reports something (Rek 2024, §5: honey and water recognised,
honey confused with tar, light oil not recognised; delays noticed from about 125 ms) the opinions agree with it.

Only sums, products, quotients and square roots of uniform numbers are used, so that answers are the same on every
machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from study_app.protocol.questions import POINTS

Draw = Callable[[], float]


@dataclass(frozen=True, slots=True)
class TrialFeatures:
    """What reached the senses in one trial; all of it at the hand.

    Attributes
    ----------
    force_mean_n, force_peak_n
        Mean and largest norm of the force sent [N].
    speed_rms_mps
        Root mean square of the hand's (estimated, not differenced) speed [m/s].
    push_share
        Share, 0 to 1, of the force's power that went along the motion: Σ of positive F·v over Σ |F·v|. Drag alone gives
        0, a wake that carries the hand more.
    roughness_n
        Root mean square of the change of the force from one tick to the next [N].
    delay_s
        Mean age of what was drawn, when it was drawn [s].
    force_delay_s
        How late the force was sent [s]; 0 in studies that do not delay it.
    """

    force_mean_n: float
    force_peak_n: float
    speed_rms_mps: float
    push_share: float
    roughness_n: float
    delay_s: float
    force_delay_s: float = 0.0


NO_FEATURES = TrialFeatures(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Rater:
    """How one simulated person differs from the next.

    ``leaning`` shifts every answer [points], ``noise`` is the spread between equal trials [points], ``strength`` is how
    strong forces seem, 1 on average, and ``threshold_s`` the delay that is noticed half of the time [s].
    """

    leaning: float
    noise: float
    strength: float
    threshold_s: float


@dataclass(frozen=True, slots=True)
class _Impression:
    """The trial in the rater's own terms, each from 0 to 1."""

    present: float
    resisting: float
    thick: float
    carried: float
    abrupt: float
    rough: float
    noticed: float
    bothered: float
    lost: float


def rater(draw: Draw) -> Rater:
    """Return a person, drawn with ``draw`` (uniform numbers in [0, 1))."""
    return Rater(
        leaning=0.4 * _normal(draw),
        noise=0.5 + 0.3 * draw(),
        strength=max(0.5, 1 + 0.1 * _normal(draw)),
        threshold_s=max(0.06, 0.13 + 0.015 * _normal(draw)),
    )


def rate(items: Iterable[str], felt: TrialFeatures, person: Rater, draw: Draw) -> dict[str, int]:
    """Return an answer from 1 to 7 for each item id, in the order given."""
    judged = judgements(items, felt, person, draw)
    return {item: min(POINTS, max(1, math.floor(points + 0.5))) for item, points in judged.items()}


def judgements(items: Iterable[str], felt: TrialFeatures, person: Rater, draw: Draw) -> dict[str, float]:
    """Return what a person would answer to each item id, in the order given: from 1 to 7, or a little beyond."""
    asked = tuple(items)
    return {
        item: opinion + person.leaning + person.noise * _normal(draw)
        for item, opinion in zip(asked, opinions(asked, felt, person), strict=True)
    }


def opinions(items: Iterable[str], felt: TrialFeatures, person: Rater) -> list[float]:
    """Return what a person thinks of each item, from 1 to 7, before leaning and noise make an answer of it."""
    impression = _impression(felt, person)
    return [OPINIONS[item](impression) if item in OPINIONS else NO_OPINION for item in items]


def _normal(draw: Draw) -> float:
    """Return a nearly normal number, mean 0, deviation 1: the sum of twelve uniform ones, less six."""
    return sum(draw() for _ in range(12)) - 6


def _rise(value: float, middle: float, width: float) -> float:
    """Return 0 … 1, one half at ``middle``, 0.15 and 0.85 one ``width`` away from it."""
    x = (value - middle) / width
    return 0.5 + 0.5 * x / math.sqrt(1 + x * x)


def _impression(felt: TrialFeatures, person: Rater) -> _Impression:
    force = felt.force_mean_n * person.strength
    resistance = force / max(felt.speed_rms_mps, 0.01) ** 2  # quadratic drag: the same however fast the hand
    peak = felt.force_peak_n / max(felt.force_mean_n, 0.05)
    return _Impression(
        present=_rise(force, 0.15, 0.1),
        resisting=_rise(resistance, 25.0, 10.0),
        thick=_rise(resistance, 98.0, 14.0),
        carried=_rise(felt.push_share, 0.08, 0.04),
        abrupt=_rise(peak, 8.0, 2.0),
        rough=_rise(felt.roughness_n, 0.15, 0.05),
        noticed=_rise(felt.delay_s, person.threshold_s, 0.015),
        bothered=_rise(felt.delay_s, person.threshold_s + 0.03, 0.03),
        lost=_rise(felt.delay_s, person.threshold_s + 0.08, 0.04),
    )


NO_OPINION = 4.0

OPINIONS: dict[str, Callable[[_Impression], float]] = {
    # what was felt
    "feels_liquid": lambda felt: 2.0 + 3.8 * felt.present - 1.5 * felt.rough,
    "immersive": lambda felt: 3.0 + 2.4 * felt.present - 1.5 * felt.rough,
    "strength": lambda felt: 2.5 + 3.0 * felt.present - 0.8 * felt.abrupt - 0.5 * felt.rough,
    "expected": lambda felt: 2.8 + 2.6 * felt.present - 1.2 * felt.abrupt - felt.rough,
    "like_honey": lambda felt: 1.6 + 4.2 * felt.thick * (1 - felt.carried),
    "like_water": lambda felt: 1.6 + 4.2 * felt.resisting * (1 - felt.thick) * (1 - 0.4 * felt.carried),
    "like_slime": lambda felt: 2.2 + 1.8 * felt.thick,
    "like_oil": lambda felt: 2.6 + 1.2 * (1 - felt.thick),
    "like_tar": lambda felt: 1.4 + 3.4 * felt.thick * (1 - felt.carried),
    # what was seen
    "different": lambda felt: 1.8 + 4.4 * felt.noticed,
    "harder": lambda felt: 1.7 + 3.8 * felt.bothered,
    "detracts": lambda felt: 1.7 + 3.2 * felt.bothered,
    "unusable": lambda felt: 1.4 + 2.6 * felt.lost,
    "comfortable": lambda felt: 6.0 - 1.4 * felt.lost - 0.4 * felt.bothered,
}
"""Item id → the opinion from 1 to 7; statements that people add get ``_no_opinion``."""

"""SIMULATED answers to trials of intervals: an observer who compares what was felt or seen, never a level.

What reaches the observer is a resistance (mean force over speed) or a delay, with Gaussian noise: in proportion to the
resistance (Weber's law), of constant spread for a delay; `Observer` plants both thresholds. Estimates follow a power
law with exponent 1/2 (Stevens 1957, Psychological Review 64, 153) unless another is planted. The observer's numbers are
plausible, not measured **[choice]**. Only sums, products, quotients and square roots are used, but for planted
exponents, so that answers are the same on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.questions import ChoiceView, ItemView, RatingView, Value, plain_number
from study_app.protocol.simulated_observer import TrialFeatures
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.stimuli import DELAYS, FORCE_DELAY, OF_LINK
from study_app.protocol.trials.tracks import design_of, stimulus_of

Draw = Callable[[], float]

_Z_75: Final = 0.6745
LEAST_SPEED_MPS: Final = 0.01
MODULUS: Final = 10.0
"""The number that the first stimulus is given."""


@dataclass(frozen=True, slots=True)
class Observer:
    """What a simulated participant can discriminate.

    Attributes
    ----------
    weber_fraction : float
        Of resistance, at 75 % correct in two intervals without lapses.
    delay_jnd_s : float
        Of a delay, likewise [s].
    lapses : float
        So often an answer is given at random.
    estimates : tuple of float, optional
        Exponent of estimates over resistance, and the standard deviation of their logarithm; None: 1/2 of the noisy
        resistance.
    """

    weber_fraction: float = 0.24
    delay_jnd_s: float = 0.025
    lapses: float = 0.02
    estimates: tuple[float, float] | None = None

    @property
    def resistance_noise(self) -> float:
        """The standard deviation of what a resistance is taken for, as a share of it."""
        return self.weber_fraction / (_Z_75 * math.sqrt(1 + (1 + self.weber_fraction) ** 2))

    @property
    def delay_noise_s(self) -> float:
        """The standard deviation of what a delay is taken for [s]."""
        return self.delay_jnd_s / (math.sqrt(2) * _Z_75)


OBSERVER: Final = Observer()


@dataclass(frozen=True, slots=True)
class Comparison:
    """What an observer attends to in a block, and whether the smaller one is asked for.

    These are delays, or resistances; of a force that is sent with jitter or loss how rough it is.
    """

    delays: bool
    smallest: bool
    observer: Observer
    vary: str | None = None

    @classmethod
    def of(cls, protocol: Protocol, block: Block, observer: Observer) -> Comparison:
        """Return what the question of a block is about."""
        if block.stimulus is not None:
            stimulus = stimulus_of(protocol, block)
            return cls(stimulus.vary in DELAYS, stimulus.direction == "down", observer, stimulus.vary)
        delays = {protocol.conditions[name].delay_ms for name in block.conditions}
        return cls(len(delays) > 1, smallest=False, observer=observer)

    def sensed(self, felt: TrialFeatures) -> float:
        """Return what is attended to: a delay [s], a roughness [N], or a resistance [N·s/m]."""
        if self.vary == FORCE_DELAY:
            return felt.force_delay_s
        if self.vary in OF_LINK:
            return felt.roughness_n
        return felt.delay_s if self.delays else felt.force_mean_n / max(felt.speed_rms_mps, LEAST_SPEED_MPS)

    def noisy(self, sensed: float, draw: Draw) -> float:
        """Return what the observer takes it for."""
        noise = sum(draw() for _ in range(12)) - 6  # nearly normal
        observer = self.observer
        return (
            sensed + observer.delay_noise_s * noise if self.delays else sensed * (1 + observer.resistance_noise * noise)
        )

    def distinct(self, difference: float, about: float) -> bool:
        """Return whether a difference is taken for one."""
        observer = self.observer
        return abs(difference) > (observer.delay_jnd_s if self.delays else observer.weber_fraction * abs(about))

    def choose(self, design: Design, sensed: Sequence[float], mean: float, draw: Draw) -> str:
        """Return the answer of a design with choices to what was sensed; ``mean`` is that of the block so far."""
        taken = [self.noisy(one, draw) for one in sensed]
        if draw() < self.observer.lapses:
            return design.answers[int(len(design.answers) * draw())]
        return design.simulated(taken, mean, self)


def answer(
    protocol: Protocol,
    block: Block,
    item: ItemView,
    sensed: Sequence[float],
    before: Sequence[float],
    draw: Draw,
    observer: Observer,
) -> Value:
    """Return the answer to a trial of intervals.

    Parameters
    ----------
    protocol : Protocol
        The study.
    block : Block
        The block of the trial.
    item : ItemView
        The question as shown.
    sensed : sequence of float
        What was sensed in each interval, see `Comparison.sensed`.
    before : sequence of float
        What was sensed in the block's earlier intervals, in order.
    draw : callable
        Uniform numbers in [0, 1).
    observer : Observer
        Who answers.
    """
    attended = Comparison.of(protocol, block, observer)
    known = [*before, *sensed]
    mean, first = sum(known) / len(known), known[0]
    if isinstance(item, ChoiceView):
        return attended.choose(design_of(protocol, block), sensed, mean, draw)
    if observer.estimates is not None and not isinstance(item, RatingView) and first > 0 and sensed[-1] > 0:
        return plain_number(max(0.01, round(estimate(observer, sensed[-1] / first, draw), 2)))
    taken = [attended.noisy(one, draw) for one in sensed]
    ratio = taken[-1] / (first if not isinstance(item, RatingView) else mean) if mean > 0 and first > 0 else 1.0
    if isinstance(item, RatingView):
        points = len(item.labels)
        middle = (points + 1) / 2
        return min(points, max(1, math.floor(middle + (ratio - 1) * (points - 1) + 0.5)))
    return plain_number(max(0.01, round(MODULUS * math.sqrt(max(ratio, 0.0)), 2)))


def estimate(observer: Observer, ratio: float, draw: Draw) -> float:
    """Return the number for a resistance that is ``ratio`` times the block's first, which is called `MODULUS`."""
    assert observer.estimates is not None  # noqa: S101 - planted
    exponent, spread = observer.estimates
    noise = sum(draw() for _ in range(12)) - 6  # nearly normal
    return MODULUS * math.exp(exponent * math.log(ratio) + spread * noise)

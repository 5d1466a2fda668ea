"""SIMULATED answers of people who know the forces and delays of a trial, but never its condition or level.

For rehearsals, power analysis and validation; never evidence about people, and marked as simulated wherever stored.

*Statements* are answered by a `Rater`, who forms an opinion from 1 to 7 on known statements from a few features of the
trial, and adds response bias and noise. Answers to other statements are near the middle. Opinions agree with the
results of the thesis where it reports any (Rek 2024, §5: honey and water recognised, honey confused with tar, light oil
not recognised; delays noticed from about 125 ms).

*Trials of intervals* are answered by an `Observer`, who compares resistances (mean force over speed) or delays with
Gaussian noise: proportional to the resistance (Weber's law), constant for a delay. Observers are people, who differ in
more than their threshold (`people.Person`). Estimates follow a power law with exponent 1/2 (Stevens 1957, Psychological
Review 64, 153), unless another exponent is set.

Shapes and constants are plausible, not measured **[choice]**. Only sums, products, quotients and square roots of
uniform numbers are used, except for exponents, so that answers are the same on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, build_schedule, draw_key
from study_app.protocol.participants.raters import REHEARSED, SimulatedParticipants
from study_app.protocol.presented.presentation import next_level, trial_result
from study_app.protocol.questions import POINTS
from study_app.protocol.randomization.streams import Draw, Key, draw_secret, stream
from study_app.protocol.trials.designs import Design, ForcedChoice, Rated
from study_app.protocol.trials.methods import TrialResult
from study_app.protocol.trials.stimuli import DELAYS, FORCE_DELAY, OF_LINK, Stimulated
from study_app.psychophysics.families import Floats
from study_app.psychophysics.people import ASSUMED, UNIFORM, Person, draw_normal, draw_person

_NO_OPINION: Final = 4.0
_LEAST_SPEED_MPS: Final = 0.01
_MODULUS: Final = 10.0
"""The number assigned to the first stimulus."""
_Z_75: Final = 0.6745


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialFeatures:
    """The stimulus of one trial at the hand.

    Attributes
    ----------
    force_mean_n, force_peak_n
        Mean and largest norm of the force sent [N].
    speed_rms_mps
        Root mean square of the hand's (estimated, not differenced) speed [m/s].
    push_share
        Proportion, 0 to 1, of the force's power along the motion: Σ of positive F·v over Σ |F·v|. It is 0 for pure
        drag, and larger for a wake that carries the hand.
    roughness_n
        Root mean square of the change of the force from one tick to the next [N].
    delay_s
        Mean age of the drawn position when it was drawn [s].
    force_delay_s
        Delay of the force [s]; 0 in studies that do not delay it.
    """

    force_mean_n: float
    force_peak_n: float
    speed_rms_mps: float
    push_share: float
    roughness_n: float
    delay_s: float
    force_delay_s: float = 0.0


NO_FEATURES: Final = TrialFeatures(
    force_mean_n=0.0, force_peak_n=0.0, speed_rms_mps=0.0, push_share=0.0, roughness_n=0.0, delay_s=0.0
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rater:
    """The individual parameters of a simulated person.

    ``leaning`` shifts every answer [points], ``noise`` is the standard deviation between equal trials [points],
    ``strength`` scales perceived forces, 1 on average, and ``threshold_s`` is the delay that is noticed half of the
    time [s].
    """

    leaning: float
    noise: float
    strength: float
    threshold_s: float


LEAST_NOISE, NOISE_RANGE, MEAN_NOISE = 0.5, 0.3, 0.65


def rater(draw: Draw, participants: SimulatedParticipants = REHEARSED) -> Rater:
    """Return a random participant, drawn with ``draw`` (uniform numbers in [0, 1)).

    The noise of participants is uniformly distributed from 77 % to 123 % of the mean.
    """
    return Rater(
        leaning=participants.bias_sd * draw_normal(draw),
        noise=participants.noise_sd / MEAN_NOISE * (LEAST_NOISE + NOISE_RANGE * draw()),
        strength=max(0.5, 1 + 0.1 * draw_normal(draw)),
        threshold_s=max(0.06, 0.13 + 0.015 * draw_normal(draw)),
    )


def rate(items: Iterable[str], trial: TrialFeatures, person: Rater, draw: Draw) -> dict[str, int]:
    """Return an answer from 1 to 7 for each item id, in the given order."""
    points_by_item = judgements(items, trial, person, draw)
    return {item: min(POINTS, max(1, math.floor(points + 0.5))) for item, points in points_by_item.items()}


def judgements(items: Iterable[str], trial: TrialFeatures, person: Rater, draw: Draw) -> dict[str, float]:
    """Return a person's unrounded answer to each item id, in the given order: from 1 to 7, or slightly beyond."""
    item_ids = tuple(items)
    opinions_by_item = zip(item_ids, _opinions(item_ids, trial, person), strict=True)
    return {item: opinion + person.leaning + person.noise * draw_normal(draw) for item, opinion in opinions_by_item}


def _opinions(items: Iterable[str], trial: TrialFeatures, person: Rater) -> list[float]:
    """Return a person's opinion on each item, from 1 to 7, before response bias and noise are added."""
    impression = _impression(trial, person)
    return [OPINIONS[item](impression) if item in OPINIONS else _NO_OPINION for item in items]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Impression:
    """The perceived qualities of a trial, each from 0 to 1."""

    present: float
    resisting: float
    thick: float
    carried: float
    abrupt: float
    rough: float
    noticed: float
    bothered: float
    lost: float


def _rise(value: float, middle: float, width: float) -> float:
    """Return a sigmoid from 0 to 1: one half at ``middle``, 0.15 and 0.85 one ``width`` below and above it."""
    x = (value - middle) / width
    return 0.5 + 0.5 * x / math.sqrt(1 + x * x)


def _impression(trial: TrialFeatures, person: Rater) -> _Impression:
    force = trial.force_mean_n * person.strength
    resistance = force / max(trial.speed_rms_mps, _LEAST_SPEED_MPS) ** 2  # independent of speed for quadratic drag
    peak = trial.force_peak_n / max(trial.force_mean_n, 0.05)
    return _Impression(
        present=_rise(force, 0.15, 0.1),
        resisting=_rise(resistance, 25.0, 10.0),
        thick=_rise(resistance, 98.0, 14.0),
        carried=_rise(trial.push_share, 0.08, 0.04),
        abrupt=_rise(peak, 8.0, 2.0),
        rough=_rise(trial.roughness_n, 0.15, 0.05),
        noticed=_rise(trial.delay_s, person.threshold_s, 0.015),
        bothered=_rise(trial.delay_s, person.threshold_s + 0.03, 0.03),
        lost=_rise(trial.delay_s, person.threshold_s + 0.08, 0.04),
    )


OPINIONS: Final[dict[str, Callable[[_Impression], float]]] = {
    # statements about the force
    "feels_liquid": lambda trial: 2.0 + 3.8 * trial.present - 1.5 * trial.rough,
    "immersive": lambda trial: 3.0 + 2.4 * trial.present - 1.5 * trial.rough,
    "strength": lambda trial: 2.5 + 3.0 * trial.present - 0.8 * trial.abrupt - 0.5 * trial.rough,
    "expected": lambda trial: 2.8 + 2.6 * trial.present - 1.2 * trial.abrupt - trial.rough,
    "like_honey": lambda trial: 1.6 + 4.2 * trial.thick * (1 - trial.carried),
    "like_water": lambda trial: 1.6 + 4.2 * trial.resisting * (1 - trial.thick) * (1 - 0.4 * trial.carried),
    "like_slime": lambda trial: 2.2 + 1.8 * trial.thick,
    "like_oil": lambda trial: 2.6 + 1.2 * (1 - trial.thick),
    "like_tar": lambda trial: 1.4 + 3.4 * trial.thick * (1 - trial.carried),
    # statements about the delay
    "different": lambda trial: 1.8 + 4.4 * trial.noticed,
    "harder": lambda trial: 1.7 + 3.8 * trial.bothered,
    "detracts": lambda trial: 1.7 + 3.2 * trial.bothered,
    "unusable": lambda trial: 1.4 + 2.6 * trial.lost,
    "comfortable": lambda trial: 6.0 - 1.4 * trial.lost - 0.4 * trial.bothered,
}
"""The opinion from 1 to 7 on each known item, by ID; other statements get `_NO_OPINION`."""


def simulate_ratings(
    items: Sequence[str], trials: Sequence[Sequence[TrialFeatures]], repetitions: int, person: Rater, random: Generator
) -> tuple[Floats, Floats]:
    """Return one person's opinion on each item in a block, and the noise of the answers.

    Parameters
    ----------
    items : sequence of str
        Ids of the statements.
    trials : sequence of sequence of TrialFeatures
        Trials of each condition, from which one is drawn for each presentation.
    repetitions : int
        Number of presentations of each condition.
    person : Rater
        The simulated person.
    random : random.Generator
        Random generator for trials and noise.

    Returns
    -------
    tuple of array
        Opinions, and noise, both (repetitions, conditions, items) [points].
    """
    random_numbers = random.random((repetitions, len(trials))).tolist()
    opinions = [
        [
            _opinions(items, condition_trials[int(len(condition_trials) * number)], person)
            for condition_trials, number in zip(trials, numbers, strict=True)
        ]
        for numbers in random_numbers
    ]
    noise = random.random((repetitions, len(trials), len(items), UNIFORM)).sum(axis=-1) - UNIFORM / 2
    return np.array(opinions), person.noise * noise


@dataclass(frozen=True, slots=True)
class Observer:
    """The sensitivity of a simulated participant.

    Attributes
    ----------
    weber_fraction : float
        Weber fraction of resistance, at 75 % correct in two intervals without lapses.
    delay_jnd_s : float
        Just noticeable delay, likewise [s].
    person : Person
        The other individual parameters of the observer.
    estimates : tuple of float, optional
        Exponent of estimates over resistance, and the standard deviation of their logarithm; None: 1/2 of the noisy
        resistance.
    """

    weber_fraction: float = 0.24
    delay_jnd_s: float = 0.025
    person: Person = ASSUMED
    estimates: tuple[float, float] | None = None

    @property
    def resistance_noise(self) -> float:
        """The standard deviation of a perceived resistance, relative to it."""
        return self.weber_fraction / (_Z_75 * math.sqrt(1 + (1 + self.weber_fraction) ** 2))

    @property
    def delay_noise_s(self) -> float:
        """The standard deviation of a perceived delay [s]."""
        return self.delay_jnd_s / (math.sqrt(2) * _Z_75)


OBSERVER: Final = Observer()


def observer_of(draw: Draw) -> Observer:
    """Return a simulated participant's observer, drawn at random."""
    return Observer(person=draw_person(draw))


class Course(NamedTuple):
    """An observer's progress in a block: the fraction of trials done, and the last answer to its design."""

    done: float = 0.5
    last: str | int | float | None = None


_MIDDLE: Final = Course()


@dataclass(frozen=True, slots=True)
class Comparison:
    """The quantity that an observer compares in a block, and whether the smaller one is asked for.

    It is a delay, a resistance or, for a force link with jitter or loss, the roughness of the force.
    """

    delays: bool
    smallest: bool
    observer: Observer
    vary: str | None = None

    @classmethod
    def of(cls, protocol: Protocol, block: Block, observer: Observer) -> Comparison:
        """Return the comparison that a block's question requires."""
        if block.stimulus is not None:
            stimulus = protocol.stimulus_of(block)
            return cls(stimulus.vary in DELAYS, stimulus.direction == "down", observer, stimulus.vary)
        delays = {protocol.conditions[name].delay_ms for name in block.conditions}
        return cls(len(delays) > 1, smallest=False, observer=observer)

    def sensed(self, trial: TrialFeatures) -> float:
        """Return the compared quantity of a trial: a delay [s], a roughness [N], or a resistance [N·s/m]."""
        if self.vary == FORCE_DELAY:
            return trial.force_delay_s
        if self.vary in OF_LINK:
            return trial.roughness_n
        return trial.delay_s if self.delays else trial.force_mean_n / max(trial.speed_rms_mps, _LEAST_SPEED_MPS)

    def noisy(self, sensed: float, draw: Draw) -> float:
        """Return the perceived value with noise."""
        noise, observer = draw_normal(draw), self.observer
        return (
            sensed + observer.delay_noise_s * noise if self.delays else sensed * (1 + observer.resistance_noise * noise)
        )

    def distinct(self, difference: float, about: float) -> bool:
        """Return whether a difference is noticed."""
        observer = self.observer
        return abs(difference) > (observer.delay_jnd_s if self.delays else observer.weber_fraction * abs(about))

    def choose(self, design: Design, sensed: Sequence[float], mean: float, draw: Draw, course: Course = _MIDDLE) -> str:
        """Return the answer of a design with choices to the sensed values; ``mean`` is that of the block so far."""
        perceived: Sequence[float] = [self.noisy(value, draw) for value in self._scale_to_width_one(sensed, course)]
        if draw() < self.observer.person.lapse:
            return design.answers[int(len(design.answers) * draw())]
        if isinstance(design, ForcedChoice):
            perceived = self._add_biases(design, perceived, course)
        return design.simulated(perceived, mean, self)

    def _scale_to_width_one(self, sensed: Sequence[float], course: Course) -> Sequence[float]:
        """Return the values that an observer with width 1 would have to sense to give the answers of this observer."""
        person, smallest_value = self.observer.person, (max if self.smallest else min)(sensed)
        if (person.width, person.change) == (1.0, 1.0) or (smallest_value == 0.0 and not self.delays):
            return sensed
        threshold = self.observer.delay_jnd_s if self.delays else self.observer.weber_fraction * abs(smallest_value)
        distances = [(value - smallest_value) / threshold for value in sensed]
        return [
            smallest_value + threshold * math.copysign(person.perceived_intensity(abs(distance), course.done), distance)
            for distance in distances
        ]

    def _add_biases(self, design: Design, perceived: Sequence[float], course: Course) -> Sequence[float]:
        """Return the perceived values after biases towards the first interval and the last answer."""
        person, noise = self.observer.person, self.observer.delay_noise_s
        if not self.delays:
            noise = self.observer.resistance_noise * sum(perceived) / len(perceived)
        unit = -math.sqrt(2) * noise if self.smallest else math.sqrt(2) * noise
        return [
            value + unit * (person.criterion * (position == 0) + person.repeats * (answer == course.last))
            for position, (answer, value) in enumerate(zip(design.answers, perceived, strict=True))
        ]

    def answer(
        self,
        protocol: Protocol,
        design: Design,
        sensed: Sequence[float],
        before: Sequence[float],
        draw: Draw,
        course: Course = _MIDDLE,
    ) -> str | int | float:
        """Return the answer to a trial: one of the design's answers, a scale point, or a number.

        ``sensed`` is the compared quantity in each interval, ``before`` that in the block's previous trials.
        """
        all_sensed = [*before, *sensed]
        mean, first = sum(all_sensed) / len(all_sensed), all_sensed[0]
        if design.reply == "choice":
            return self.choose(design, sensed, mean, draw, course)
        if isinstance(design, Rated):
            perceived, points = self._perceive_last_interval(sensed, draw), protocol.scales[design.scale].points
            ratio = perceived / mean if mean > 0 and first > 0 else 1.0
            return min(points, max(1, math.floor((points + 1) / 2 + (ratio - 1) * (points - 1) + 0.5)))
        if self.observer.estimates is not None and first > 0 and sensed[-1] > 0:
            exponent, spread = self.observer.estimates
            return _MODULUS * math.exp(exponent * math.log(sensed[-1] / first) + spread * draw_normal(draw))
        perceived = self._perceive_last_interval(sensed, draw)
        return _MODULUS * math.sqrt(max(perceived / first if mean > 0 and first > 0 else 1.0, 0.0))

    def _perceive_last_interval(self, sensed: Sequence[float], draw: Draw) -> float:
        """Return the perceived value of the last interval; noise is drawn for every interval."""
        return [self.noisy(value, draw) for value in sensed][-1]


class SimulatedTrial(NamedTuple):
    """One answered trial of a block with a design; ``track`` is the track of its ``code``.

    ``level`` is in the unit of the stimulus' levels, None if conditions are compared; ``success`` is whether the
    answer is a success of the psychometric function.
    """

    participant: str
    block: str
    code: str
    track: str
    trial: int
    catch: bool
    arrangement: str
    standard: float | None
    level: float | None
    answer: str | int | float
    success: bool | None


def as_requested(presented: Stimulated) -> float:
    """Return the compared quantity of an interval that presents exactly the requested number: a delay [s], or it."""
    return presented.value / 1000 if presented.vary in DELAYS else presented.value


def courses_of(schedule: Schedule) -> dict[int, float]:
    """Return, by trial number, the fraction of the block (0 to 1) that is done at the trial."""
    blocks: dict[str, list[int]] = {}
    for trial in schedule.trials:
        blocks.setdefault(trial.block, []).append(trial.number)
    return {
        number: position / (len(numbers) - 1) if len(numbers) > 1 else 0.5
        for numbers in blocks.values()
        for position, number in enumerate(numbers)
    }


def simulate_study(
    protocol: Protocol,
    people: Mapping[str, Observer],
    seed: int,
    study: str = "simulated",
    sense: Callable[[Stimulated], float] = as_requested,
) -> Iterator[SimulatedTrial]:
    """Yield the answers of participants to the blocks of levels, which the protocol's methods choose.

    Parameters
    ----------
    protocol : Protocol
        The study.
    people : mapping of str to Observer
        The observers by participant id.
    seed : int
        Seed of orders, the sealed key and answers.
    study : str
        Name of the random streams, so that one seed gives many independent studies.
    sense : callable
        Returns the perceived quantity of an interval.
    """
    random = stream(seed, study).random
    key = Key(draw_key(protocol, random), draw_secret(random))
    for person, observer in people.items():
        schedule = build_schedule(protocol, person, seed)
        results_by_block: dict[str, list[TrialResult]] = {}
        sensed_in: dict[str, list[float]] = {}
        courses = courses_of(schedule)
        last_answers: dict[str, str | int | float] = {}
        for trial in schedule.trials:
            block = protocol.blocks[trial.block]
            if block.stimulus is None:
                continue
            results, earlier_sensed = results_by_block.setdefault(block.id, []), sensed_in.setdefault(block.id, [])
            if (presentation := next_level(protocol, key, schedule, trial, results)) is None:
                continue
            design, sensed = protocol.design_of(block), [sense(interval) for interval in presentation.intervals]
            draw = stream(int.from_bytes(key.secret[:4], "big"), f"observer/{person}/{trial.number}").random
            course = Course(courses[trial.number], last_answers.get(block.id))
            answer = Comparison.of(protocol, block, observer).answer(
                protocol, design, sensed, earlier_sensed, draw, course
            )
            last_answers[block.id] = answer
            earlier_sensed += sensed
            identity = (trial.number, trial.code, presentation.level, presentation.arrangement, str(answer))
            results.append(trial_result(protocol, block, *identity, catch=presentation.catch))
            yield SimulatedTrial(
                participant=person,
                block=block.id,
                code=trial.code,
                track=key.codes[block.id][trial.code],
                trial=trial.number,
                catch=presentation.catch,
                arrangement=design.arrangement_text(presentation.arrangement),
                standard=presentation.standard,
                level=presentation.level,
                answer=answer,
                success=results[-1].success,
            )

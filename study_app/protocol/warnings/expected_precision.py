"""The expected precision of a block's results: thresholds, d′, d_a of ratings, exponents of magnitude estimation.

Simulated participants answer the block's trials with a fixed seed, and the estimates are those of the report. People
are assumed to differ by a factor of `BETWEEN_PEOPLE` in d′, d_a and exponents, as in thresholds; the group's interval
is that of the mean by Student's t.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, Final, TypeAlias

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.tracks import tracks_of
from study_app.protocol.presented.presented_levels import Clipping, clipping
from study_app.protocol.trials.designs import Design, Rated
from study_app.protocol.trials.methods import Method, TrackSetting
from study_app.protocol.trials.stimuli import LINEAR_WIDTH, WIDTH_PRIOR, Stimulus
from study_app.psychophysics.adaptive import Answers, Observers
from study_app.psychophysics.detection import NORMAL, rating
from study_app.psychophysics.families import Floats
from study_app.psychophysics.grid import Z_95, Posterior, decade_in_u, group_priors
from study_app.psychophysics.people import (
    ALONE,
    ASSUMED,
    BETWEEN_PEOPLE,
    ESTIMATE_NOISE,
    KINDS,
    Estimates,
    Expected,
    Person,
)

PRECISION: Final = "Expected precision"
"""The label of `precision_rows` and the heading of the tables of ``power``."""
_D_PRIME: Final = 1.0
"""The d′ or d_a of simulated participants. [choice]"""
_EXPONENT: Final = 0.5
"""The exponent of simulated participants if none was published, as in rehearsals. [choice]"""
_MEAN_OBSERVERS: Final = 1000
"""The number of simulated participants for a d′, d_a or exponent."""


@dataclass(frozen=True)
class SensitivityPlan:
    """The parameters that determine the precision of d′, for one compared condition or standard (``of_each``).

    Answers to the design must be correct or wrong. If standards alternate (``roving``), intervals can only be compared
    with each other.
    """

    design: Design
    trials: int
    roving: bool
    of_each: str
    value: ClassVar[float] = _D_PRIME
    unit: ClassVar[str] = ""
    estimated: ClassVar[str] = "values of d′"
    """The estimated quantity, as a plural noun."""
    words: ClassVar[str] = f"at d′ = {_D_PRIME:g}: "
    """The assumption, for the reader."""
    per = property(lambda self: f" per {self.of_each}")
    """The text after a number of trials, naming the unit of counting."""

    def with_trials(self, trials: int) -> SensitivityPlan:
        """Return the plan with another number of trials, rounded to a possible one."""
        return replace(self, trials=trials)

    def estimates(self, truth: Floats, random: Generator) -> Floats:
        """Return the d′ that the report would estimate for unbiased observers with these true d′."""
        design, count = self.design, len(self.design.arrangements)
        trials = [self.trials // count + (arrangement < self.trials % count) for arrangement in range(count)]
        correct = [str(design.correct(arrangement)) for arrangement in range(count)]
        wrong = [next(other for other in design.answers if other != answer) for answer in correct]
        d_primes = []
        for d_prime in truth:
            correct_counts = random.binomial(
                trials, design.proportion_correct(float(d_prime), roving=self.roving)
            ).tolist()
            answers = {
                (arrangement, correct[arrangement]): successes for arrangement, successes in enumerate(correct_counts)
            }
            answers |= {
                (arrangement, wrong[arrangement]): trials[arrangement] - successes
                for arrangement, successes in enumerate(correct_counts)
            }
            sensitivity = design.sensitivity(answers, roving=self.roving)
            d_primes.append(math.nan if sensitivity is None else sensitivity.d_prime)
        return np.array(d_primes)


@dataclass(frozen=True)
class EstimationPlan:
    """The parameters that determine the precision of the exponent of magnitude estimation.

    ``value`` is the exponent of simulated participants. The levels are above zero; each is presented ``repetitions``
    times.
    """

    levels: tuple[float, ...]
    repetitions: int
    value: float
    per: ClassVar[str] = ""
    unit: ClassVar[str] = ""
    estimated: ClassVar[str] = "exponents"
    words = property(lambda self: f"exponent of {self.value:g}: ")
    trials = property(lambda self: len(self.levels) * self.repetitions)

    def with_trials(self, trials: int) -> EstimationPlan:  # noqa: D102 - as above
        return replace(self, repetitions=max(1, round(trials / len(self.levels))))

    def estimates(self, truth: Floats, random: Generator) -> Floats:
        """Return the exponents that the report would estimate: least-squares slopes of mean ln answers on ln level."""
        x, noise = np.log(self.levels), ESTIMATE_NOISE / math.sqrt(self.repetitions)
        means = truth[:, None] * x + random.normal(0.0, noise, (len(truth), len(x)))
        return np.asarray((means @ (x - x.mean())) / ((x - x.mean()) ** 2).sum(), float)


@dataclass(frozen=True)
class RatingPlan:
    """The parameters that determine the precision of d_a of one level against the lowest, with equal trials."""

    points: int
    trials: int
    per: ClassVar[str] = " per level"
    unit: ClassVar[str] = ""
    value: ClassVar[float] = _D_PRIME
    estimated: ClassVar[str] = "values of d_a"
    words: ClassVar[str] = f"at d_a = {_D_PRIME:g}: "

    def with_trials(self, trials: int) -> RatingPlan:  # noqa: D102 - as above
        return replace(self, trials=trials)

    def estimates(self, truth: Floats, random: Generator) -> Floats:
        """Return the d_a that the report would estimate for observers who use all scale points about equally often.

        A rating is the number of criteria that a normal observation exceeds. The criteria divide a normal distribution
        with the mean and the standard deviation of both levels' observations at `value` into equal parts.
        """
        spread = math.sqrt(1.0 + (self.value / 2.0) ** 2)
        proportions = [point / self.points for point in range(1, self.points)]
        criteria = [self.value / 2.0 + spread * NORMAL.inv_cdf(proportion) for proportion in proportions]
        values = []
        for d_a in truth:
            lowest, level = (np.searchsorted(criteria, random.normal(mean, 1.0, self.trials)) for mean in (0.0, d_a))
            sensitivity = rating(lowest, level)
            values.append(math.nan if sensitivity is None else sensitivity.d_prime)
        return np.array(values)


MeanPlan: TypeAlias = SensitivityPlan | EstimationPlan | RatingPlan


def mean_plan(protocol: Protocol, block: Block) -> MeanPlan | None:
    """Return the plan for a block's d′, d_a or exponents; None if it has none of them."""
    if block.design is None or block.phase != "main":
        return None
    design = protocol.design_of(block).model_copy(update={"question": None})  # a dictionary has no hash
    slots = tracks_of(protocol, block)[0].slots
    if block.stimulus is None:
        choice = design.reply == "choice" and not design.has_noise
        return SensitivityPlan(design, slots, roving=False, of_each="comparison") if choice else None
    stimulus, method = protocol.stimulus_of(block), protocol.method_of(block)
    if design.reply == "number":
        levels = tuple(sorted({level for level in method.levels_of(stimulus) if level > 0}))
        repetitions = method.tracks * method.presentations(stimulus) // len(method.levels_of(stimulus))
        published = () if protocol.analysis is None else protocol.analysis.published
        exponents = (value.value for value in published if (value.block, value.measure) == (block.id, "exponent"))
        return EstimationPlan(levels, repetitions, next(exponents, _EXPONENT)) if len(levels) > 1 else None
    if isinstance(design, Rated) and len(method.levels_of(stimulus)) > 1 and len(protocol.standards_of(block)) == 1:
        repetitions = method.tracks * method.presentations(stimulus) // len(method.levels_of(stimulus))
        return RatingPlan(protocol.scales[design.scale].points, repetitions)
    if design.reply == "choice" and design.can_be_correct(stimulus) and not stimulus.rises(design):
        roving = len(protocol.standards_of(block)) > 1 and method.order == "interleaved"
        return SensitivityPlan(design, slots * method.tracks, roving, of_each="standard")
    return None


def expected_mean(plan: MeanPlan) -> Expected:
    """Return the expected precision of d′, d_a or exponents."""
    estimates = plan.estimates(np.full(_MEAN_OBSERVERS, plan.value), np.random.default_rng(SEED))
    spread = float(estimates.std())
    return Expected(
        spacing="linear",
        trials=plan.trials,
        standards=1,
        halves={"": [Z_95 * spread]},
        spreads={"": spread},
        threshold=plan.value,
        decade=plan.value * math.log(10),
    )


_THRESHOLD_OBSERVERS: Final = 200
"""The number of simulated participants for a threshold."""
PEOPLE: Final = 20
"""The default number of participants in a study."""
SEED: Final = 1
_FALSE_ALARMS: Final = 0.1
"""The guess rate of simulated observers if the design does not determine it. [choice]"""
_MAX_WORK: Final = 700_000_000
"""The limit of cells × levels × trials × observers in a simulation, beyond which there are fewer observers."""
_MIN_OBSERVERS: Final = 20
_CELLS: Final = 41 * 9 * 3
"""The number of cells in the grid for choosing levels."""
_MAX_TRIALS: Final = 200
"""The limit of simulated trials; with more, the variance is assumed to be inversely proportional to their number."""


@dataclass(frozen=True, eq=False)
class ObserverAnswers:
    """The answers of observers in a block: in the ``tracks`` of one standard, and in other trials.

    ``catch`` trials present the highest level, ``noise`` trials only the standard.
    """

    observers: Observers
    tracks: tuple[Answers, ...]
    catch: Answers
    noise: Answers


@dataclass(frozen=True)
class ThresholdPlan:
    """The parameters that determine the precision of the threshold of one standard.

    Each track has ``catch`` catch trials; the block has ``standards`` standards. ``clipping`` describes how limits clip
    the levels of the highest standard; None: they are not clipped.
    """

    stimulus: Stimulus
    design: Design
    method: Method
    catch: int
    standards: int
    clipping: Clipping | None = None

    per: ClassVar[str] = " per standard"
    words: ClassVar[str] = ""
    trials = property(lambda self: self.method.presentations(self.stimulus) * self.method.tracks)
    """The greatest number of comparisons with each standard."""

    def with_trials(self, trials: int) -> ThresholdPlan:
        """Return the plan with another number of trials per standard, rounded to one that its method can divide."""
        method, stimulus = self.method, self.stimulus
        trials_per_unit = method.tracks * (1 if method.adaptive else len(method.levels_of(stimulus)))
        units = max(1, round(trials / trials_per_unit))
        changed = {"trials": units * method.tracks} if method.adaptive else {"repetitions": units}
        catch = round(self.catch * units / max(1, self.trials // trials_per_unit))
        return replace(self, method=method.model_copy(update=changed), catch=catch)

    @property
    def two_intervals(self) -> bool:
        """Whether one of two intervals is correct, so that participants may prefer one."""
        return self.design.kind == "2ifc" and self.design.can_be_correct(self.stimulus)

    @property
    def has_pse(self) -> bool:
        """Whether thresholds are points of subjective equality."""
        return self.stimulus.has_pse(self.design)

    @property
    def estimated(self) -> str:
        """The estimated quantity, as a plural noun."""
        return "points of subjective equality" if self.has_pse else "thresholds"

    @property
    def kinds(self) -> Mapping[str, Person]:
        """The kinds of simulated participants."""
        return KINDS if self.two_intervals else ALONE

    @property
    def unit(self) -> str:
        """The unit of a threshold, with a leading space; empty for a Weber fraction."""
        weber = self.stimulus.level_kind == "weber"
        return "" if weber else f" {self.stimulus.unit}".rstrip()

    def each_standard(self) -> tuple[ThresholdPlan, ...]:
        """Return the plan of each standard, the highest first; only this plan if all standards are clipped alike."""
        highest = self.clipping
        if highest is None or not highest.others:
            return (self,)
        others = (replace(highest, standard=standard) for standard in highest.others)
        return tuple(replace(self, clipping=limits) for limits in (highest, *others))

    def measures(self, thresholds: Floats) -> NDArray[np.bool_]:
        """Return which thresholds [u] can be measured, because they are below the highest unclipped level."""
        return thresholds < self.stimulus.coordinate(self.highest)

    @property
    def highest(self) -> float:
        """The highest unclipped level."""
        return math.inf if self.clipping is None else self.clipping.highest(self.stimulus)

    def presented(self, levels: Floats) -> Floats:
        """Return levels after clipping, both in u."""
        if self.clipping is None:
            return levels
        log = self.stimulus.spacing == "log"
        clipped = self.clipping.presented(self.stimulus, 10.0**levels if log else levels)
        with np.errstate(divide="ignore"):  # a level of 0 has the logarithm −∞
            return np.log10(np.maximum(clipped, 0.0)) if log else clipped

    @property
    def width(self) -> float:
        """The width of a typical observer's function [u]."""
        prior = self.method.assumed(self.stimulus, self.design).width_prior
        return LINEAR_WIDTH if prior == WIDTH_PRIOR else prior[0]

    @property
    def value(self) -> float:
        """The level in the middle of the range."""
        return self.stimulus.level_of(sum(self.stimulus.domain) / 2)

    @property
    def between_people(self) -> float:
        """The standard deviation between people, of the natural logarithm of a threshold or relative to `value`."""
        middle = sum(self.stimulus.domain) / 2
        if self.stimulus.spacing == "log":
            return math.log10(BETWEEN_PEOPLE) * float(self.decade(middle)) * math.log(10)
        return math.log10(BETWEEN_PEOPLE) * float(self.decade(middle)) / abs(middle) if middle else math.inf

    def decade(self, threshold: ArrayLike) -> Floats:
        """Return the change of each threshold that corresponds to a decade; all numbers are in u."""
        return decade_in_u(self.stimulus.decade_kind(self.design), threshold, self.width)

    def answers(self, thresholds: Floats, random: Generator, people: Sequence[Person] = (ASSUMED,)) -> ObserverAnswers:
        """Return the answers of observers with these thresholds [u]; ``people`` has one entry each, or one for all."""
        stimulus, design = self.stimulus, self.design
        assumed, guess = self.method.assumed(stimulus, design), design.guess_rate
        answers = len(design.answers)
        columns = np.array(
            [
                (person.lapse_rate(answers), person.width, person.change, person.criterion, person.repeats)
                for person in people
            ]
        ).T
        lapse, width, change, criterion, repeats = columns if len(people) > 1 else columns[:, 0]
        if guess is None:
            guess = lapse if stimulus.guesses(design) is None else _FALSE_ALARMS
        presented = None if self.clipping is None else self.presented
        moves = np.log10(change) * self.decade(thresholds)
        observers = Observers(
            family=assumed.family,
            thresholds=thresholds,
            width=self.width * width,
            guess=guess,
            lapse=lapse,
            presented=presented,
            moves=moves,
            criterion=criterion,
            repeats=repeats,
        )
        noise_trials, highest_u = design.noise(self.method.presentations(stimulus)), stimulus.domain[1]
        tracks, false_alarms = [], [np.zeros((len(thresholds), 0), bool)]
        for number in range(1, self.method.tracks + 1):
            noise = random.random((len(thresholds), noise_trials)) if noise_trials else None
            if np.any([criterion, repeats]) and self.two_intervals:
                trials = self.method.presentations(stimulus)
                towards = random.permuted(np.tile((1.0, -1.0), (len(thresholds), (trials + 1) // 2)), axis=1)
                observers = replace(observers, towards=towards[:, :trials])
            tracks.append(self.method.simulated(TrackSetting(stimulus, design, number), observers, random, noise))
            false_alarms += [] if noise is None else [noise < np.reshape(guess, (-1, 1))]
        caught_trials = observers.probability(highest_u) > random.random((self.catch * len(tracks), len(thresholds)))

        def answers_at(level: float, successes: NDArray[np.bool_]) -> Answers:
            zeros = np.zeros(successes.shape)
            return Answers(levels=zeros + level, successes=successes, towards=zeros, before=zeros, done=zeros + 0.5)

        catch = answers_at(highest_u, caught_trials.T)
        noise_answers = answers_at(stimulus.coordinate(0.0), np.concatenate(false_alarms, 1))
        return ObserverAnswers(observers, tuple(tracks), catch, noise_answers)

    def fits(self, answered: ObserverAnswers, most: int | None = None) -> list[Posterior]:
        """Return the posterior of each observer with equally likely widths, as in the report.

        If ``most`` is given, only the first ``most`` trials of each track are used, and no catch trials.
        """
        low, high = self.stimulus.domain
        parts = [*(track.first(most) for track in answered.tracks), answered.noise, *([] if most else [answered.catch])]
        joined = {name: np.concatenate([getattr(part, name) for part in parts], axis=1) for name in Answers._fields}
        answers = Answers(**joined)
        presented = np.unique(answers.levels[~np.isnan(answers.levels)])
        if len(presented) > _THRESHOLD_OBSERVERS:
            presented = np.append(presented[presented < low], np.linspace(low, high, _THRESHOLD_OBSERVERS))
        grid = self.stimulus.analysis_grid(self.design, self.method.assumed(self.stimulus, self.design))
        return [
            observer.fit(grid, two_intervals=self.two_intervals).flat for observer in answers.person_answers(presented)
        ]

    def estimates(self, answered: ObserverAnswers, most: int | None = None, together: int = PEOPLE) -> Estimates:
        """Return the analysis' estimates from answers; see `fits` and `grouped`."""
        return self.grouped(self.fits(answered, most), together)

    def grouped(self, fits: Sequence[Posterior], together: int = PEOPLE) -> Estimates:
        """Return estimates from `fits`; each ``together`` consecutive ones are the participants of one study."""
        prior = self.method.assumed(self.stimulus, self.design).width_prior
        own_estimates, group_variances = list[tuple[float, ...]](), list[float]()
        for first in range(0, len(fits), together):
            group = fits[first : first + together]
            priors = group_priors(group, prior)
            reweighted = map(Posterior.reweighted, group, priors.factors)
            own_estimates += [
                (posterior.threshold, *posterior.interval, posterior.variance) for posterior in reweighted
            ]
            group_variances.append(priors.variance)
        medians, lows, highs, variances = np.array(own_estimates).T
        return Estimates(medians=medians, lows=lows, highs=highs, variances=variances, shared=np.array(group_variances))

    def simulate(
        self, thresholds: Floats, random: Generator, people: Sequence[Person] = (ASSUMED,), together: int = PEOPLE
    ) -> Estimates:
        """Return the analysis' estimates for observers with these thresholds [u]; see `answers`."""
        return self.estimates(self.answers(thresholds, random, people), together=together)


def threshold_plan(protocol: Protocol, block: Block) -> ThresholdPlan | None:
    """Return the plan for a block's thresholds; None if it has none."""
    if block.stimulus is None or block.design is None or block.phase != "main":
        return None
    stimulus = protocol.stimulus_of(block)
    design = protocol.design_of(block).model_copy(update={"question": None})  # a dictionary has no hash
    if not stimulus.rises(design):
        return None
    catch, standards = len(tracks_of(protocol, block)[0].catch), len(protocol.standards_of(block))
    limits = clipping(protocol, block)
    presented = limits if limits is not None and limits.paced else None
    return ThresholdPlan(stimulus, design, protocol.method_of(block), catch, standards, presented)


@lru_cache(maxsize=32)
def expected(plan: ThresholdPlan) -> Expected:
    """Return the expected precision of thresholds for each kind of participants.

    Intervals are infinite unless most thresholds are below the highest unclipped level.
    """
    cells = _CELLS * (6 if plan.design.has_noise else 1) * (30 if getattr(plan.method, "learn", "") == "all" else 1)
    work_per_trial = cells * plan.stimulus.steps
    trials = min(plan.trials, _MAX_TRIALS, max(10, _MAX_WORK // (work_per_trial * _MIN_OBSERVERS)))
    simulated = plan if trials == plan.trials else plan.with_trials(trials)
    kinds = plan.kinds
    affordable = min(_THRESHOLD_OBSERVERS, _MAX_WORK // (work_per_trial * simulated.trials))
    observers = max(_MIN_OBSERVERS, affordable) // len(kinds)
    together = min(PEOPLE, observers)
    observers = observers // together * together
    low, high = plan.stimulus.domain
    thresholds = low + (high - low) * (0.25 + 0.5 * (np.arange(observers) + 0.5) / observers)  # the middle half
    truth, people = np.tile(thresholds, len(kinds)), [kind for kind in kinds.values() for _ in thresholds]
    halves, variances, shared = [], [], []
    for standard_plan in simulated.each_standard():
        estimates = standard_plan.simulate(truth, np.random.default_rng(SEED), people, together)
        is_measurable = standard_plan.measures(thresholds)
        half_widths = ((estimates.highs - estimates.lows) / 2).reshape(len(kinds), -1)[:, is_measurable]
        errors = (estimates.medians - truth).reshape(len(kinds), -1)[:, is_measurable]
        has_estimates = is_measurable.mean() > 0.5
        halves.append(half_widths if has_estimates else np.full((len(kinds), 1), math.inf))
        variances.append(errors.var(axis=1, ddof=1) if has_estimates else np.full(len(kinds), math.inf))
        shared.append(together * estimates.shared.reshape(len(kinds), -1).mean(axis=1))
    scaling = (simulated.trials / plan.trials) ** 0.5
    return Expected(
        spacing=plan.stimulus.spacing,
        trials=plan.trials,
        standards=plan.standards,
        halves=dict(zip(kinds, (scaling * np.concatenate(halves, axis=1)).tolist(), strict=True)),
        spreads=dict(zip(kinds, (scaling * np.sqrt(np.mean(variances, axis=0))).tolist(), strict=True)),
        threshold=plan.stimulus.level_of(float(np.median(thresholds))),
        decade=float(plan.decade(float(np.median(thresholds)))),
        shared=dict(zip(kinds, (scaling**2 * np.mean(shared, axis=0)).tolist(), strict=True)),
    )


def precision_plan(protocol: Protocol, block: Block) -> ThresholdPlan | MeanPlan | None:
    """Return the plan for a block's thresholds, d′, d_a or exponents; None if it has none of them."""
    return threshold_plan(protocol, block) or mean_plan(protocol, block)


def expected_of(plan: ThresholdPlan | MeanPlan) -> Expected:
    """Return the expected precision of results."""
    return expected(plan) if isinstance(plan, ThresholdPlan) else expected_mean(plan)


def precision_rows(protocol: Protocol, block: Block) -> Iterator[tuple[str, str]]:
    """Yield the expected 95 % intervals of one participant and of the planned group, if there are any."""
    plan = precision_plan(protocol, block)
    if plan is None:
        return
    if not (precisions := expected_of(plan)).measured:
        yield PRECISION, "not available, because the levels for most thresholds are clipped"
        return
    log = precisions.spacing == "log"
    kind, worst_half = precisions.worst
    median, worst = (
        f"×/÷ {10.0**half:.1f}" if log else f"±{half:.2g}{plan.unit}" for half in (precisions.median, worst_half)
    )
    for_one = median if median == worst else f"{median} (at worst {worst}, {kind})"
    people, precision = _planned_sample(protocol)
    across = "" if precisions.standards == 1 else " across all standards"
    group = ""
    if people is not None:
        half = precisions.group_half_width(people)
        has_pse = isinstance(plan, ThresholdPlan) and plan.has_pse
        group_half = f"{half * abs(precisions.threshold):.2g}{plan.unit}" if has_pse else f"{100 * half:.0f} %"
        group = f"; ±{group_half}{across} for {people} participants"
    elif precision is not None and (needed := precisions.participants_for(precision)) is not None:
        group = f"; ±{100 * precision:g} %{across} requires {needed} participants"
    yield PRECISION, f"{plan.words}{for_one} for one participant{group} (95 % intervals)"


def imprecise(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield warnings that planned participants and trials do not reach the planned precision."""
    plan, (people, precision) = precision_plan(protocol, block), _planned_sample(protocol)
    if plan is None or people is None or precision is None:
        return
    precisions = expected_of(plan)
    if isinstance(plan, ThresholdPlan) and not precisions.measured:
        limits, named = plan.clipping, "" if plan.clipping is None else plan.clipping.named
        subject = f"levels above {plan.highest:.3g}{named and f' for standard{named}'} are"
        if limits is not None and limits.clips_standard:
            subject = f"the standard{named} is"
        yield (
            f"stimuli.{block.stimulus}.levels: a precision of ±{100 * precision:g} % cannot be achieved at a threshold "
            f"of {precisions.threshold:.2g}, because {subject} clipped"
        )
        return
    if (group_precision := precisions.group_half_width(people)) <= precision:
        return
    adaptive = block.stimulus is not None and protocol.method_of(block).adaptive
    key = "trials" if adaptive else "repetitions"
    place = f"blocks.{block.id}" if block.stimulus is None else f"methods.{block.method}"
    trials, participants = precisions.trials_for(precision, people), precisions.participants_for(precision)
    ways = [
        *([] if trials is None else [f"about {trials} trials"]),
        *([] if participants is None else [f"{participants} participants"]),
    ]
    yield (
        f"{place}.{key}: {plan.trials} trials{plan.per} and {people} planned participants yield "
        f"±{math.ceil(1000 * group_precision) / 10:.3g} % instead of ±{100 * precision:g} %; "
        f"{' or '.join(ways) + ' would suffice on average' if ways else 'choose a larger analysis.precision'}"
    )


def _planned_sample(protocol: Protocol) -> tuple[int | None, float | None]:
    """Return the planned number of participants and the planned precision."""
    analysis = protocol.analysis
    return (None, None) if analysis is None else (analysis.participants, analysis.precision)

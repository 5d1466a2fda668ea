"""How precise the results of a block are expected to be: thresholds, d′, d_a of ratings, exponents of estimation.

Simulated participants answer the block's trials with a fixed seed, and the estimates are those of the report. People
differ by a factor of `BETWEEN_PEOPLE` in d′, d_a and exponents, as their thresholds do, and the group's interval is
that of the mean by Student's t.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, Final, TypeAlias

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

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
from study_app.psychophysics.grid import Z_95, Posterior, group_priors
from study_app.psychophysics.people import ALONE, ASSUMED, ESTIMATE_NOISE, KINDS, Estimates, Expected, Person

PRECISION: Final = "Expected precision"
"""The label of `precision_rows` and the head of the tables of ``power``."""
_D_PRIME: Final = 1.0
"""Of simulated participants. [choice]"""
_EXPONENT: Final = 0.5
"""Of simulated participants, where no exponent was published; as the answers of rehearsals. [choice]"""
_MEAN_OBSERVERS: Final = 1000
"""Of a simulated d′, d_a or exponent."""


@dataclass(frozen=True)
class SensitivityPlan:
    """The parameters that determine the precision of d′, for one compared condition or standard (``of_each``).

    Answers to the design can be correct. If standards alternate (``roving``), intervals can only be compared with each
    other.
    """

    design: Design
    trials: int
    roving: bool
    of_each: str
    value: ClassVar[float] = _D_PRIME
    unit: ClassVar[str] = ""
    estimated: ClassVar[str] = "values of d′"
    """What participants differ in, as a plural noun."""
    words: ClassVar[str] = f"at d′ = {_D_PRIME:g}: "
    """What is assumed, in words."""
    per = property(lambda self: f" per {self.of_each}")
    """The words for what the number of trials counts for."""

    def with_trials(self, trials: int) -> SensitivityPlan:
        """Return the plan with ``trials`` trials, rounded so that they can be divided."""
        return replace(self, trials=trials)

    def estimates(self, truth: Floats, random: Generator) -> Floats:
        """Return the d′ that the report would estimate for unbiased observers with these true d′, both (observers,)."""
        design, count = self.design, len(self.design.arrangements)
        trials = [self.trials // count + (place < self.trials % count) for place in range(count)]
        correct = [str(design.correct(place)) for place in range(count)]
        wrong = [next(answer for answer in design.answers if answer != right) for right in correct]
        found = []
        for d_prime in truth:
            rights = random.binomial(trials, design.proportion_correct(float(d_prime), roving=self.roving)).tolist()
            answers = {(place, correct[place]): right for place, right in enumerate(rights)}
            answers |= {(place, wrong[place]): trials[place] - right for place, right in enumerate(rights)}
            sensitivity = design.sensitivity(answers, roving=self.roving)
            found.append(math.nan if sensitivity is None else sensitivity.d_prime)
        return np.array(found)


@dataclass(frozen=True)
class EstimationPlan:
    """The parameters that determine the precision of the exponent of magnitude estimation.

    ``value`` is the exponent of simulated participants. The levels are above zero, each is presented ``repetitions``
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
        with the mean and the standard deviation of both levels' observations at `value` into equal shares.
        """
        spread = math.sqrt(1.0 + (self.value / 2.0) ** 2)
        shares = [point / self.points for point in range(1, self.points)]
        criteria = [self.value / 2.0 + spread * NORMAL.inv_cdf(share) for share in shares]
        found = []
        for d_a in truth:
            lowest, level = (np.searchsorted(criteria, random.normal(mean, 1.0, self.trials)) for mean in (0.0, d_a))
            sensitivity = rating(lowest, level)
            found.append(math.nan if sensitivity is None else sensitivity.d_prime)
        return np.array(found)


MeanPlan: TypeAlias = SensitivityPlan | EstimationPlan | RatingPlan


def mean_plan(protocol: Protocol, block: Block) -> MeanPlan | None:
    """Return the plan for the precision of a block's d′, d_a or exponents; None if it has none of them."""
    if block.design is None or block.phase != "main":
        return None
    design = protocol.design_of(block).model_copy(update={"question": None})  # a dictionary has no hash
    slots = tracks_of(protocol, block)[0].slots
    if block.stimulus is None:
        choice = design.reply == "choice" and not design.has_noise
        return SensitivityPlan(design, slots, roving=False, of_each="comparison") if choice else None
    stimulus, method = protocol.stimulus_of(block), protocol.method_of(block)
    if design.reply == "number":
        levels = tuple(sorted({one for one in method.levels_of(stimulus) if one > 0}))
        repetitions = method.tracks * method.presentations(stimulus) // len(method.levels_of(stimulus))
        decided = () if protocol.analysis is None else protocol.analysis.published
        exponents = (
            published.value for published in decided if (published.block, published.measure) == (block.id, "exponent")
        )
        return EstimationPlan(levels, repetitions, next(exponents, _EXPONENT)) if len(levels) > 1 else None
    if isinstance(design, Rated) and len(method.levels_of(stimulus)) > 1 and len(protocol.standards_of(block)) == 1:
        repetitions = method.tracks * method.presentations(stimulus) // len(method.levels_of(stimulus))
        return RatingPlan(protocol.scales[design.scale].points, repetitions)
    if design.reply == "choice" and design.can_be_correct(stimulus) and not stimulus.rises(design):
        roving = len(protocol.standards_of(block)) > 1 and method.order == "interleaved"
        return SensitivityPlan(design, slots * method.tracks, roving, of_each="standard")
    return None


def expected_mean(plan: MeanPlan) -> Expected:
    """Return the expected precision of one participant's d′, d_a or exponent, and of the mean."""
    found = plan.estimates(np.full(_MEAN_OBSERVERS, plan.value), np.random.default_rng(SEED))
    spread = float(found.std())
    return Expected(
        spacing="linear",
        trials=plan.trials,
        standards=1,
        halves={"": [Z_95 * spread]},
        spreads={"": spread},
        threshold=plan.value,
    )


_OBSERVERS: Final = 200
"""Of a simulated threshold."""
PEOPLE: Final = 20
"""Of a study, unless it is said how many."""
SEED: Final = 1
_FALSE_ALARMS: Final = 0.1
"""Of simulated observers, where the guess rate is free. [choice]"""
_MOST_WORK: Final = 700_000_000
"""Cells × levels × trials × observers of one simulation, so that a check stays fast: fewer observers beyond it."""
_FEWEST: Final = 20
_CELLS: Final = 41 * 9 * 3
"""Of the grid over which levels are chosen."""
_MOST_TRIALS: Final = 200
"""Of a track that is simulated; beyond it the variance is taken to be inversely proportional to the trials."""


@dataclass(frozen=True, eq=False)
class ObserverAnswers:
    """The answers of observers in a block: the ``tracks`` of one standard, and other trials.

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
    estimated: ClassVar[str] = "thresholds"
    words: ClassVar[str] = ""
    trials = property(lambda self: self.method.presentations(self.stimulus) * self.method.tracks)
    """Comparisons of each standard, at most."""

    def with_trials(self, trials: int) -> ThresholdPlan:
        """Return the plan with ``trials`` trials per standard, rounded to what its method can divide."""
        method, stimulus = self.method, self.stimulus
        least = method.tracks * (1 if method.adaptive else len(method.levels_of(stimulus)))
        each = max(1, round(trials / least))
        changed = {"trials": each * method.tracks} if method.adaptive else {"repetitions": each}
        catch = round(self.catch * each / max(1, self.trials // least))
        return replace(self, method=method.model_copy(update=changed), catch=catch)

    @property
    def two_intervals(self) -> bool:
        """Whether one of two intervals is correct, so that people may have a preference."""
        return self.design.kind == "2ifc" and self.design.can_be_correct(self.stimulus)

    @property
    def kinds(self) -> Mapping[str, Person]:
        """The kinds of simulated participants."""
        return KINDS if self.two_intervals else ALONE

    @property
    def unit(self) -> str:
        """The unit of a threshold with a leading space."""
        weber = self.stimulus.level_kind == "weber"
        return "" if weber else f" {self.stimulus.unit}".rstrip()

    def each_standard(self) -> tuple[ThresholdPlan, ...]:
        """Return the plan of each standard with its clipping, the highest first; only this one if all are alike."""
        own = self.clipping
        if own is None or not own.others:
            return (self,)
        of_others = (replace(own, standard=other) for other in own.others)
        return tuple(replace(self, clipping=one) for one in (own, *of_others))

    def measures(self, thresholds: Floats) -> NDArray[np.bool_]:
        """Return which thresholds [u] are below the highest unclipped level; others cannot be measured."""
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
        found = self.clipping.presented(self.stimulus, 10.0**levels if log else levels)
        with np.errstate(divide="ignore"):  # a level of 0 has the logarithm −∞
            return np.log10(np.maximum(found, 0.0)) if log else found

    def answers(self, thresholds: Floats, random: Generator, people: Sequence[Person] = (ASSUMED,)) -> ObserverAnswers:
        """Return the answers of observers with thresholds (n,) [u]; ``people`` has one for each or one for all."""
        stimulus, design = self.stimulus, self.design
        assumed, guess = self.method.assumed(stimulus, design), design.guess_rate
        answers = len(design.answers)
        columns = np.array([(it.wrong(answers), it.width, it.change, it.criterion, it.repeats) for it in people]).T
        lapse, width, change, criterion, repeats = columns if len(people) > 1 else columns[:, 0]
        if guess is None:
            guess = lapse if stimulus.guesses(design) is None else _FALSE_ALARMS
        presented = None if self.clipping is None else self.presented
        moves = np.log10(change) if stimulus.spacing == "log" else thresholds * np.log(change)
        observers = Observers(
            family=assumed.family,
            thresholds=thresholds,
            width=(LINEAR_WIDTH if assumed.width_prior == WIDTH_PRIOR else assumed.width_prior[0]) * width,
            guess=guess,
            lapse=lapse,
            presented=presented,
            moves=moves,
            criterion=criterion,
            repeats=repeats,
        )
        noise_trials, high = design.noise(self.method.presentations(stimulus)), stimulus.domain[1]
        tracks, yes = [], [np.zeros((len(thresholds), 0), bool)]
        for number in range(1, self.method.tracks + 1):
            noise = random.random((len(thresholds), noise_trials)) if noise_trials else None
            if np.any([criterion, repeats]) and self.two_intervals:
                trials = self.method.presentations(stimulus)
                towards = random.permuted(np.tile((1.0, -1.0), (len(thresholds), (trials + 1) // 2)), axis=1)
                observers = replace(observers, towards=towards[:, :trials])
            tracks.append(self.method.simulated(TrackSetting(stimulus, design, number), observers, random, noise))
            yes += [] if noise is None else [noise < np.reshape(guess, (-1, 1))]
        caught = observers.probability(high) > random.random((self.catch * len(tracks), len(thresholds)))

        def evenly_spread(level: float, successes: NDArray[np.bool_]) -> Answers:
            none = np.zeros(successes.shape)
            return Answers(levels=none + level, successes=successes, towards=none, before=none, done=none + 0.5)

        catch, noises = evenly_spread(high, caught.T), evenly_spread(stimulus.coordinate(0.0), np.concatenate(yes, 1))
        return ObserverAnswers(observers, tuple(tracks), catch, noises)

    def fits(self, answered: ObserverAnswers, most: int | None = None) -> list[Posterior]:
        """Return the posterior of each observer with equally likely widths, as in the report.

        Only the first ``most`` trials of each track are used, if it is given, without catch trials.
        """
        low, high = self.stimulus.domain
        parts = [*(track.first(most) for track in answered.tracks), answered.noise, *([] if most else [answered.catch])]
        joined = {name: np.concatenate([getattr(it, name) for it in parts], axis=1) for name in Answers._fields}
        answers = Answers(**joined)
        presented = np.unique(answers.levels[~np.isnan(answers.levels)])
        if len(presented) > _OBSERVERS:
            presented = np.append(presented[presented < low], np.linspace(low, high, _OBSERVERS))
        grid = self.stimulus.analysis_grid(self.design, self.method.assumed(self.stimulus, self.design))
        return [it.fit(grid, two_intervals=self.two_intervals).flat for it in answers.given(presented)]

    def estimates(self, answered: ObserverAnswers, most: int | None = None, together: int = PEOPLE) -> Estimates:
        """Return the analysis' estimates from answers; see `fits` and `grouped`."""
        return self.grouped(self.fits(answered, most), together)

    def grouped(self, fits: Sequence[Posterior], together: int = PEOPLE) -> Estimates:
        """Return estimates from `fits`, of which ``together`` consecutive ones are the participants of one study."""
        prior = self.method.assumed(self.stimulus, self.design).width_prior
        found, of_groups = list[tuple[float, ...]](), list[float]()
        for first in range(0, len(fits), together):
            group = fits[first : first + together]
            priors = group_priors(group, prior)
            fitted = map(Posterior.reweighted, group, priors.factors)
            found += [(own.threshold, *own.interval, own.variance) for own in fitted]
            of_groups.append(priors.variance)
        medians, lows, highs, variances = np.array(found).T
        return Estimates(medians=medians, lows=lows, highs=highs, variances=variances, shared=np.array(of_groups))

    def simulate(
        self, thresholds: Floats, random: Generator, people: Sequence[Person] = (ASSUMED,), together: int = PEOPLE
    ) -> Estimates:
        """Return the analysis' estimates for observers with these thresholds [u]; see `answers`."""
        return self.estimates(self.answers(thresholds, random, people), together=together)


def threshold_plan(protocol: Protocol, block: Block) -> ThresholdPlan | None:
    """Return the plan for the precision of a block's thresholds; None if it has none."""
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

    Only thresholds below the highest unclipped level have estimates; unless these are the majority, no precision is
    expected.
    """
    cells = _CELLS * (6 if plan.design.has_noise else 1) * (30 if getattr(plan.method, "learn", "") == "all" else 1)
    per_trial = cells * plan.stimulus.steps
    trials = min(plan.trials, _MOST_TRIALS, max(10, _MOST_WORK // (per_trial * _FEWEST)))
    simulated = plan if trials == plan.trials else plan.with_trials(trials)
    kinds = plan.kinds
    observers = max(_FEWEST, min(_OBSERVERS, _MOST_WORK // (per_trial * simulated.trials))) // len(kinds)
    together = min(PEOPLE, observers)
    observers = observers // together * together
    low, high = plan.stimulus.domain
    own = low + (high - low) * (0.25 + 0.5 * (np.arange(observers) + 0.5) / observers)  # the middle half
    truth, people = np.tile(own, len(kinds)), [kind for kind in kinds.values() for _ in own]
    halves, variances, shared = [], [], []
    for one in simulated.each_standard():
        estimates = one.simulate(truth, np.random.default_rng(SEED), people, together)
        full = one.measures(own)
        ends = ((estimates.highs - estimates.lows) / 2).reshape(len(kinds), -1)[:, full]
        errors = (estimates.medians - truth).reshape(len(kinds), -1)[:, full]
        measured = full.mean() > 0.5
        halves.append(ends if measured else np.full((len(kinds), 1), math.inf))
        variances.append(errors.var(axis=1, ddof=1) if measured else np.full(len(kinds), math.inf))
        shared.append(together * estimates.shared.reshape(len(kinds), -1).mean(axis=1))
    shrunk = (simulated.trials / plan.trials) ** 0.5
    return Expected(
        spacing=plan.stimulus.spacing,
        trials=plan.trials,
        standards=plan.standards,
        halves=dict(zip(kinds, (shrunk * np.concatenate(halves, axis=1)).tolist(), strict=True)),
        spreads=dict(zip(kinds, (shrunk * np.sqrt(np.mean(variances, axis=0))).tolist(), strict=True)),
        threshold=plan.stimulus.level_of(float(np.median(own))),
        shared=dict(zip(kinds, (shrunk**2 * np.mean(shared, axis=0)).tolist(), strict=True)),
    )


def precision_plan(protocol: Protocol, block: Block) -> ThresholdPlan | MeanPlan | None:
    """Return the plan for a block's thresholds, d′, d_a or exponents; None if it has none of them."""
    return threshold_plan(protocol, block) or mean_plan(protocol, block)


def expected_of(plan: ThresholdPlan | MeanPlan) -> Expected:
    """Return the expected precision of results."""
    return expected(plan) if isinstance(plan, ThresholdPlan) else expected_mean(plan)


def precision_rows(protocol: Protocol, block: Block) -> Iterator[tuple[str, str]]:
    """Yield the expected 95 % intervals of one participant and of the planned group, if any are expected."""
    plan = precision_plan(protocol, block)
    if plan is None:
        return
    if not (found := expected_of(plan)).measured:
        yield PRECISION, "not available, because the levels for most thresholds are clipped"
        return
    log = found.spacing == "log"
    kind, most = found.worst
    median, worst = (f"×/÷ {10.0**half:.1f}" if log else f"±{half:.2g}{plan.unit}" for half in (found.median, most))
    one = median if median == worst else f"{median} (at worst {worst}, {kind})"
    people, precision = _planned_sample(protocol)
    over = "" if found.standards == 1 else " across all standards"
    group = ""
    if people is not None:
        group = f"; ±{100 * found.of_group(people):.0f} %{over} for {people} participants"
    elif precision is not None and (needed := found.participants_for(precision)) is not None:
        group = f"; ±{100 * precision:g} %{over} requires {needed} participants"
    yield PRECISION, f"{plan.words}{one} for one participant{group} (95 % intervals)"


def imprecise(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield warnings that planned participants and trials do not reach the planned precision."""
    plan, (people, precision) = precision_plan(protocol, block), _planned_sample(protocol)
    if plan is None or people is None or precision is None:
        return
    found = expected_of(plan)
    if isinstance(plan, ThresholdPlan) and not found.measured:
        clips, named = plan.clipping, "" if plan.clipping is None else plan.clipping.named
        what = f"levels above {plan.highest:.3g}{named and f' for standard{named}'} are"
        if clips is not None and clips.clips_standard:
            what = f"the standard{named} is"
        yield (
            f"stimuli.{block.stimulus}.levels: a precision of ±{100 * precision:g} % cannot be achieved at a threshold "
            f"of {found.threshold:.2g}, because {what} clipped"
        )
        return
    if (reached := found.of_group(people)) <= precision:
        return
    adaptive = block.stimulus is not None and protocol.method_of(block).adaptive
    key = "trials" if adaptive else "repetitions"
    place = f"blocks.{block.id}" if block.stimulus is None else f"methods.{block.method}"
    trials, wanted = found.trials_for(precision, people), found.participants_for(precision)
    ways = [
        *([] if trials is None else [f"about {trials} trials"]),
        *([] if wanted is None else [f"{wanted} participants"]),
    ]
    yield (
        f"{place}.{key}: {plan.trials} trials{plan.per} and {people} planned participants yield "
        f"±{math.ceil(1000 * reached) / 10:.3g} % instead of ±{100 * precision:g} %; "
        f"{' or '.join(ways) + ' would suffice on average' if ways else 'choose a larger analysis.precision'}"
    )


def _planned_sample(protocol: Protocol) -> tuple[int | None, float | None]:
    """Return the planned number of participants and the planned precision."""
    decided = protocol.analysis
    return (None, None) if decided is None else (decided.participants, decided.precision)

"""Simulated studies of thresholds, d′, d_a and exponents: how precisely one participant's and a group's mean are known.

The observers answer through the block's method; what they show is estimated as in the report. The people of a study
differ by a factor of 1.2: in their thresholds about a mean that is drawn from the middle half of the levels, in d′, d_a
and exponents about the value that `check` assumes.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.analysis.statistics.random_effects import FEWEST, group_mean
from study_app.analysis.statistics.student_interval import student_interval
from study_app.analysis.tables.measures import Array
from study_app.errors import AnalysisError
from study_app.protocol.checks.expected_precision import MeanPlan, ThresholdPlan, precision_plan
from study_app.protocol.model import Protocol
from study_app.psychophysics.precision import BETWEEN_PEOPLE

BATCH: Final = 10
"""Studies of one case; which studies these are does not depend on how many are asked for."""
TRACKS_AT_ONCE: Final = 200

Plan: TypeAlias = ThresholdPlan | MeanPlan
PrecisionPlans: TypeAlias = Mapping[str, Mapping[int, Plan]]
"""Block → trials of each standard → what is simulated."""


@dataclass(frozen=True)
class Case:
    """A batch of studies of one block with so many trials for each standard."""

    block: str
    plan: Plan
    seed: tuple[int, ...]


@dataclass
class Found:
    """What studies of one block found with so many trials for each standard.

    Attributes
    ----------
    errors : list of array
        Of each study the errors of the participants' thresholds, (people, standards), in natural logarithms; as shares
        of the threshold on linear spacing, of the mean d′, d_a or exponent.
    halves : list of array
        Of each study half the group's 95 % interval as a share of the mean, (sizes,); NaN below three participants,
        infinite where limits clip the levels above the mean threshold.
    """

    errors: list[Array] = field(default_factory=list)
    halves: list[Array] = field(default_factory=list)

    @property
    def spread(self) -> float:
        """The standard deviation of one participant's error at one standard; infinite where nothing is measured."""
        errors = np.concatenate([one.ravel() for one in self.errors])
        return float(np.std(errors[np.isfinite(errors)])) if np.isfinite(errors).any() else math.inf

    def half(self, place: int) -> float:
        """Return the median of half the group's interval at one of the sizes."""
        return float(np.median([one[place] for one in self.halves]))

    def within(self, place: int, precision: float) -> float:
        """Return the share of studies whose half interval is within the precision, at one of the sizes."""
        return float(np.mean([one[place] <= precision for one in self.halves]))


def plans(protocol: Protocol, trials: Sequence[int]) -> PrecisionPlans:
    """Return for each block of thresholds, d′, d_a or exponents the plan for each number of trials.

    Without numbers it is the protocol's.

    Raises
    ------
    AnalysisError
        A method cannot have so few trials.
    """
    found = {}
    for block in protocol.main_blocks:
        plan = precision_plan(protocol, block)
        if plan is None:
            continue
        changed: list[Plan] = [plan.with_trials(one) for one in trials] or [plan]
        for asked, one in zip(trials, changed, strict=False):
            if abs(one.trials - asked) > max(1, asked / 2):
                raise AnalysisError(
                    f"{asked} trials cannot be divided among the tracks and levels of {block.id}: give at least "
                    f"{one.trials}"
                )
        found[block.id] = {one.trials: one for one in changed}
    return found


def study_batch(case: Case, sizes: Sequence[int]) -> Found:
    """Return what the studies of a batch find.

    ``sizes`` ascend; smaller studies have the first participants of the largest.
    """
    plan, rng, people = case.plan, np.random.default_rng(case.seed), sizes[-1]
    if not isinstance(plan, ThresholdPlan):
        return _means(plan, sizes, rng)
    low, high = plan.stimulus.domain
    means = low + (high - low) * (0.25 + 0.5 * rng.random((BATCH, 1, 1)))
    apart = math.log(BETWEEN_PEOPLE) * rng.standard_normal((BATCH, people, 1))
    log = plan.stimulus.spacing == "log"
    own = means + apart / math.log(10) if log else means * np.exp(apart)
    shape = (BATCH, people, plan.standards)
    each, truth = plan.each_standard(), np.broadcast_to(own, shape)
    parts = [
        _estimates(one, part.reshape(-1), rng) for one, part in zip(each, np.split(truth, len(each), 2), strict=True)
    ]
    medians, variances = (
        np.concatenate([one.reshape(BATCH, people, -1) for one in it], 2) for it in zip(*parts, strict=True)
    )
    errors = (medians - truth) * (math.log(10) if log else 1 / truth)
    found = Found()
    full = plan.measures(means)
    for one, median, variance, measured in zip(errors, medians, variances, full.ravel().tolist(), strict=True):
        of_people, of_variances = median.mean(axis=1), variance.sum(axis=1) / plan.standards**2
        halves = []
        for n in sizes:
            group = group_mean(of_people[:n].tolist(), of_variances[:n].tolist()) if n >= FEWEST else None
            if group is None or group.low is None or group.high is None:
                halves.append(math.nan)
            elif not measured:
                halves.append(math.inf)
            else:
                half = (group.high - group.low) / 2
                halves.append(10.0**half - 1 if log else half / abs(group.mean))
        found.errors.append(one if measured else np.full_like(one, math.inf))
        found.halves.append(np.array(halves))
    return found


def _means(plan: MeanPlan, sizes: Sequence[int], rng: np.random.Generator) -> Found:
    """Return what the studies of a batch find of d′, d_a or exponents: their means have Student's interval."""
    people, found = sizes[-1], Found()
    truth = plan.value * np.exp(math.log(BETWEEN_PEOPLE) * rng.standard_normal((BATCH, people)))
    estimates = plan.estimates(truth.reshape(-1), rng).reshape(BATCH, people)
    for own, true in zip(estimates, truth, strict=True):
        halves = []
        for n in sizes:
            low, high = student_interval(own[:n])
            halves.append(math.nan if low is None or high is None else (high - low) / 2 / abs(own[:n].mean()))
        found.errors.append((own - true)[:, None] / plan.value)
        found.halves.append(np.array(halves))
    return found


def _estimates(plan: ThresholdPlan, truth: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return posterior medians and variances of observers with these thresholds [u]."""
    medians: list[NDArray[np.float64]] = []
    variances: list[NDArray[np.float64]] = []
    for first in range(0, len(truth), TRACKS_AT_ONCE):
        found = plan.simulate(truth[first : first + TRACKS_AT_ONCE], rng)
        if found is None:
            raise AnalysisError(f'power simulates no tracks of the method "{plan.method.name}"')
        medians.append(found.medians)
        variances.append(found.variances)
    return np.concatenate(medians), np.concatenate(variances)


def sweep(
    planned: PrecisionPlans, sizes: Sequence[int], studies: int, seed: int, executor: Executor
) -> Iterator[tuple[int, dict[tuple[str, int], Found]]]:
    """Yield after every round of batches how many studies were simulated so far, and what was found in them all.

    ``studies`` is how many there are for each block and number of trials; ``sizes`` ascend. Every batch draws from a
    seed of its own, so the numbers do not depend on the executor.
    """
    keys = [(block, trials) for block, of_trials in planned.items() for trials in of_trials]
    rounds = math.ceil(studies / BATCH)
    cases = [
        Case(block, planned[block][trials], (seed, place, trials, number))
        for number in range(rounds)
        for place, block in enumerate(planned)
        for trials in planned[block]
    ]
    total = {key: Found() for key in keys}
    found = executor.map(study_batch, cases, [tuple(sizes)] * len(cases))
    for number, (case, one) in enumerate(zip(cases, found, strict=True), start=1):
        done = (number - 1) // len(keys) * BATCH
        kept = min(BATCH, studies - done)
        held = total[case.block, case.plan.trials]
        held.errors += one.errors[:kept]
        held.halves += one.halves[:kept]
        if number % len(keys) == 0:
            yield done + kept, total

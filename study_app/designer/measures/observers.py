"""What is computed of a block: what simulated observers show, what studies find, how even its orders are.

The observers answer by the block's own method and are estimated as the analysis does, as for ``check`` and ``power``.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np

from study_app.protocol.blocks import Block
from study_app.protocol.checks.expected_precision import ObserverAnswers, ThresholdPlan
from study_app.protocol.model import Protocol
from study_app.protocol.orders.balance import Evenness, balances, numbered
from study_app.protocol.orders.sequences import row_count
from study_app.psychophysics.families import Floats

OBSERVERS: Final = 400
SEED: Final = 1
AT_ONCE: Final = 100
"""Observers that are simulated together."""
SHARES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
"""The quantiles of every band: the middle, the 50 % and the 90 % in between."""
POINTS: Final = 61
MOST_BARS: Final = 60
COURSE: Final = 12
"""Numbers of trials after which the estimate is computed."""
PLANTED: Final = 12
ENOUGH: Final = 0.8
"""Participants are enough where so many simulated studies are as precise as planned."""
BIAS: Final = 0.1
COVERAGE: Final = 0.93
"""A threshold can be measured if the mean estimate is within the bias and so many 95 % intervals hold it. [choice]"""

Check: TypeAlias = Callable[[], None]
"""Called between batches of simulations; raises to end them."""
Values: TypeAlias = tuple[float, ...]


def unchecked() -> None:
    """Let simulations come to their end."""


@dataclass(frozen=True, slots=True)
class Asked:
    """One trial of one observer: its number, its track (both from 1), its level, and whether it was a success."""

    trial: int
    track: int
    level: float
    success: bool


@dataclass(frozen=True, slots=True)
class Observed:
    """What observers with one threshold showed; levels are those of the stimulus, not comparisons.

    Planted were ``threshold``, a level, and ``lapses``; ``at_threshold`` is the share of successes there. At each of
    ``levels`` the planted function has the share ``planted``, and those through the quantiles (`SHARES`) of the
    thresholds that were found have ``found``. ``asked`` are levels with the share of trials that presented them,
    ``course`` quantiles of the estimates after so many trials of the standard, ``one`` the trials of the first
    observer. ``error`` is the standard deviation of the estimates as a share of the threshold, infinite where limits
    clip the levels above it, ``trials`` the comparisons of each standard, at most.
    """

    threshold: float
    lapses: float
    observers: int
    at_threshold: float
    levels: Values
    planted: Values
    found: tuple[Values, ...]
    asked: tuple[tuple[float, float], ...]
    course: tuple[tuple[int, Values], ...]
    one: tuple[Asked, ...]
    error: float
    trials: int


@dataclass(frozen=True, slots=True)
class Planted:
    """A threshold that was planted, the mean estimate's error as a share of it, and how many intervals held it."""

    threshold: float
    bias: float
    coverage: float

    @property
    def measurable(self) -> bool:
        return abs(self.bias) <= BIAS and self.coverage >= COVERAGE


@dataclass(frozen=True, slots=True)
class Measurable:
    """The thresholds that a block can measure, lowest to highest; None where it can measure none."""

    ends: tuple[float, float] | None
    planted: tuple[Planted, ...]


@dataclass(frozen=True, slots=True)
class GroupPrecision:
    """How many simulated studies know the group's mean threshold as precisely as planned.

    ``precision`` is half the group's 95 % interval that is wanted, as a share of the mean. With ``trials`` of each
    standard ``share`` of the studies reach it, with ``more_trials``, a third more, ``more_share``. ``enough`` is how
    many participants are enough, None if more than ``most``.
    """

    participants: int
    studies: int
    precision: float
    trials: int
    share: float
    more_trials: int
    more_share: float
    most: int
    enough: int | None


@dataclass(frozen=True, slots=True)
class Finding:
    """A statement of a block, and the smallest difference that 80 % of studies show [points]; None: none simulated."""

    item: str
    detectable: float | None


@dataclass(frozen=True, slots=True)
class Detectable:
    """The smallest differences that simulated studies of a block show, of each statement that the answer model knows.

    The smallest difference comes first; the scale has so many ``points``.
    """

    participants: int
    studies: int
    points: int
    findings: tuple[Finding, ...]


@dataclass(frozen=True, slots=True)
class Simulated:
    """What was simulated of an element, each part None until it was answered for the first time.

    ``waiting`` is said of numbers that are of an earlier study while others are simulated, ``failed`` why they cannot
    be; both are "" otherwise. ``warnings`` are those of ``check`` that take simulated observers.
    """

    observed: Observed | None = None
    measurable: Measurable | None = None
    group: GroupPrecision | None = None
    detectable: Detectable | None = None
    warnings: tuple[str, ...] = ()
    waiting: str = ""
    failed: str = ""


def observe(plan: ThresholdPlan, threshold: float, lapses: float, check: Check = unchecked) -> Observed:
    """Return what observers with a threshold (a level) show."""
    stimulus, random = plan.stimulus, np.random.default_rng(SEED)
    u = stimulus.coordinate(threshold)
    medians, course, presented = [], None, []
    first: ObserverAnswers | None = None
    for _ in range(0, OBSERVERS, AT_ONCE):
        check()
        answered = plan.answers(np.full(AT_ONCE, u), random, lapses)
        medians.append(plan.estimates(answered).medians)
        presented += [one.levels[~np.isnan(one.levels)] for one in answered.tracks]
        if first is None:
            first, course = answered, _course(plan, answered, check)
    assert first is not None  # noqa: S101 - there is a first one
    found, planted = np.concatenate(medians), replace(first.observers, thresholds=np.array(u))
    errors = (found - u) * math.log(10) if stimulus.spacing == "log" else (found - u) / u
    at = np.linspace(*stimulus.domain, POINTS)
    quantiles = np.quantile(found, SHARES)
    return Observed(
        threshold,
        lapses,
        len(found),
        float(planted.probability(u)),
        tuple(stimulus.level_of(float(one)) for one in at),
        tuple(planted.probability(at).tolist()),
        tuple(tuple(_function(first, float(one), at)) for one in quantiles),
        _asked(plan, np.concatenate(presented)),
        course or (),
        tuple(_one(plan, first)),
        float(np.std(errors)) if plan.measures(np.array(u)) else math.inf,
        plan.trials,
    )


def measurable(
    plan: ThresholdPlan, lapses: float, least: float, check: Check = unchecked, most: float = math.inf
) -> Measurable:
    """Return which thresholds a block can measure.

    ``lapses`` is the lapse rate of the observers. No threshold counts below the level ``least``, twice the largest
    error of a valid trial, or above ``most``, the highest one that is presented in full. ``check``
    is called between batches and raises to end the simulation.
    """
    stimulus, random = plan.stimulus, np.random.default_rng(SEED)
    found: list[Planted] = []
    planted = [(u, stimulus.level_of(u)) for u in np.linspace(*stimulus.domain, PLANTED).tolist()]
    planted = [(u, threshold) for u, threshold in planted if least <= threshold <= most and threshold > 0]
    for u, threshold in planted:
        levels, held = [], []
        for _ in range(0, OBSERVERS, AT_ONCE):
            check()
            answered = plan.answers(np.full(AT_ONCE, u), random, lapses)
            estimates = plan.estimates(answered)
            levels += [stimulus.level_of(one) for one in estimates.medians.tolist()]
            held.append((estimates.lows <= u) & (u <= estimates.highs))
        bias = float(np.mean(levels)) / threshold - 1.0
        found.append(Planted(threshold, bias, float(np.mean(np.concatenate(held)))))
    return Measurable(_longest(found), tuple(found))


def _longest(found: list[Planted]) -> tuple[float, float] | None:
    """Return the ends of the longest row of thresholds that are measurable."""
    best: list[Planted] = []
    run: list[Planted] = []
    for one in found:
        run = [*run, one] if one.measurable else []
        best = run if len(run) > len(best) else best
    return (best[0].threshold, best[-1].threshold) if best else None


def _function(answered: ObserverAnswers, u: float, at: Floats) -> list[float]:
    """Return the function of an observer with threshold ``u`` at some levels [u], were they presented in full."""
    found: list[float] = replace(answered.observers, thresholds=np.array(u), presented=None).probability(at).tolist()
    return found


def _asked(plan: ThresholdPlan, presented: Floats) -> tuple[tuple[float, float], ...]:
    """Return levels with their shares of the trials: those presented, or where they are many the nearest of a grid."""
    places = np.unique(presented)
    if len(places) > MOST_BARS:
        places = np.array([plan.stimulus.coordinate(level) for level in plan.stimulus.spaced(plan.stimulus.steps)])
    nearest = np.searchsorted((places[1:] + places[:-1]) / 2, presented)
    counts = np.bincount(nearest, minlength=len(places)) / len(presented)
    return tuple((plan.stimulus.level_of(u), share) for u, share in zip(places.tolist(), counts.tolist(), strict=True))


def _course(plan: ThresholdPlan, answered: ObserverAnswers, check: Check) -> tuple[tuple[int, Values], ...]:
    """Return the quantiles of the estimates after some numbers of trials."""
    each, tracks = answered.tracks[0].levels.shape[1], len(answered.tracks)
    found: list[tuple[int, Values]] = []
    for number in sorted({round(one) for one in np.geomspace(1, each, min(COURSE, each))}):
        check()
        medians = plan.estimates(answered, most=number).medians
        quantiles = (plan.stimulus.level_of(one) for one in np.quantile(medians, SHARES).tolist())
        found.append((number * tracks, tuple(quantiles)))
    return tuple(found)


def _one(plan: ThresholdPlan, answered: ObserverAnswers) -> list[Asked]:
    tracks = len(answered.tracks)
    each = answered.tracks[0].levels.shape[1]
    found = []
    for track, answers in enumerate(answered.tracks):
        for at, u in enumerate(answers.levels[0].tolist()):
            if math.isnan(u):
                continue
            place = at * tracks + track if plan.method.order == "interleaved" else track * each + at
            found.append(Asked(place + 1, track + 1, plan.stimulus.level_of(u), bool(answers.successes[0, at])))
    return sorted(found, key=lambda one: one.trial)


def balance_of(protocol: Protocol, block: Block, participants: int) -> tuple[str, Evenness, int | None] | None:
    """Return order and evenness of a block, and how many participants a round of its square takes, if it has one.

    None where the block has one code.
    """
    for judged in balances(protocol, numbered(participants), SEED):
        for one in judged.blocks:
            if one.id == block.id:
                rows = row_count(one.order, len(one.evenness.codes)) if one.order in ("williams", "latin") else None
                return one.order, one.evenness, rows
    return None

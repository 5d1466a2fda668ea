"""What a study can find: observers and studies that are simulated, in a process of its own."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from study_app.designer.document.elements import SEQUENCE
from study_app.designer.document.study import Study
from study_app.designer.measures.study_facts import text_keys
from study_app.protocol.blocks import Block
from study_app.protocol.model import Contrast, Protocol
from study_app.protocol.orders.balance import Evenness, balances, numbered_participants
from study_app.protocol.presented.presented_levels import clipping
from study_app.protocol.raters import TYPICAL
from study_app.protocol.sequences import row_count
from study_app.protocol.source.document import Path, value_at
from study_app.protocol.warnings.expected_precision import ObserverAnswers, ThresholdPlan, imprecise, threshold_plan
from study_app.psychophysics.families import Floats
from study_app.psychophysics.people import BETWEEN_PEOPLE, Person
from study_app.workers.client import WorkerClient
from study_app.workers.server import Send, Stop, Stopped

if TYPE_CHECKING:
    from study_app.analysis.planning import threshold_studies
    from study_app.session.simulated.rehearsal import ConditionFeatures

OBSERVERS: Final = 400
SEED: Final = 1
_AT_ONCE: Final = 100
"""Observers that are simulated together."""
_SHARES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
"""The quantiles of every band: the middle, the 50 % and the 90 % in between."""
_POINTS: Final = 61
_MOST_BARS: Final = 60
_COURSE: Final = 12
"""Numbers of trials after which the estimate is computed."""
_PLANTED: Final = 12
ENOUGH: Final = 0.8
"""Participants are enough where so many simulated studies are as precise as planned."""
_BIAS: Final = 0.1
_COVERAGE: Final = 0.93
"""A threshold can be measured if the mean estimate is within the bias and so many 95 % intervals hold it. [choice]"""

Check: TypeAlias = Callable[[], None]
"""Called between batches of simulations; raises to end them."""
_Values: TypeAlias = tuple[float, ...]


def _never_stop() -> None:
    """Let simulations run to their end."""


@dataclass(frozen=True, slots=True)
class Asked:
    """One trial of one observer: its number, its track (both from 1), its level, and whether it was a success."""

    trial: int
    track: int
    level: float
    success: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Observed:
    """What observers with one threshold showed; levels are those of the stimulus, not comparisons.

    Planted were ``threshold``, a level, and ``lapses``; ``at_threshold`` is the share of successes there. At each of
    ``levels`` the planted function has the share ``planted``, and those through the quantiles (`_SHARES`) of the
    thresholds that were found have ``found``. ``asked`` are levels with the share of trials that presented them,
    ``course`` quantiles of the estimates after so many trials of the standard, ``one`` the trials of the first
    observer. ``error`` is the standard deviation of the estimates as a share of the threshold, infinite where limits
    clip the levels above it, ``trials`` the comparisons of each standard, at most.
    """

    threshold: float
    lapses: float
    observers: int
    at_threshold: float
    levels: _Values
    planted: _Values
    found: tuple[_Values, ...]
    asked: tuple[tuple[float, float], ...]
    course: tuple[tuple[int, _Values], ...]
    one: tuple[Asked, ...]
    error: float
    trials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Planted:
    """A threshold that was planted, the mean estimate's error as a share of it, and how many intervals held it."""

    threshold: float
    bias: float
    coverage: float

    @property
    def measurable(self) -> bool:
        return abs(self.bias) <= _BIAS and self.coverage >= _COVERAGE


@dataclass(frozen=True, slots=True)
class Measurable:
    """The thresholds that a block can measure, lowest to highest; None where it can measure none."""

    ends: tuple[float, float] | None
    planted: tuple[Planted, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
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
    """A statement of a block, and the smallest difference that 80 % of studies show [points]; None: none simulated.

    ``number`` is the difference in words, with the range over kinds of people.
    """

    item: str
    detectable: float | None
    number: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Detectable:
    """The smallest differences that simulated studies of a block show, of each statement that the answer model knows.

    The smallest difference comes first; the scale has so many ``points``, and the main ``kind`` of people answers.
    """

    participants: int
    studies: int
    points: int
    findings: tuple[Finding, ...]
    kind: str = TYPICAL


@dataclass(frozen=True, slots=True)
class Simulated:
    """What was simulated of an element, None what nothing simulates.

    ``hypotheses`` are those that can be planned, each with what the simulated participants show of it. ``waiting`` is
    said of numbers that are of an earlier study while others are simulated, ``failed`` why they cannot
    be; both are "" otherwise. ``warnings`` are those of ``check`` that take simulated observers.
    """

    observed: Observed | None = None
    measurable: Measurable | None = None
    group: GroupPrecision | None = None
    detectable: Detectable | None = None
    hypotheses: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()
    waiting: str = ""
    failed: str = ""


def simulate_observers(plan: ThresholdPlan, threshold: float, lapses: float, check: Check = _never_stop) -> Observed:
    """Simulate observers with a threshold (a level) and return their answers and estimates."""
    stimulus, random = plan.stimulus, np.random.default_rng(SEED)
    u = stimulus.coordinate(threshold)
    medians, course, presented = [], None, []
    first: ObserverAnswers | None = None
    for _ in range(0, OBSERVERS, _AT_ONCE):
        check()
        answered = plan.answers(np.full(_AT_ONCE, u), random, (_lapsing_person(plan, lapses),))
        medians.append(plan.estimates(answered).medians)
        presented += [track.levels[~np.isnan(track.levels)] for track in answered.tracks]
        if first is None:
            first, course = answered, _estimate_course(plan, answered, check)
    assert first is not None  # noqa: S101 - there is a first one
    estimates, planted = np.concatenate(medians), replace(first.observers, thresholds=np.array(u), moves=0.0)
    errors = (estimates - u) * math.log(10) if stimulus.spacing == "log" else (estimates - u) / u
    at = np.linspace(*stimulus.domain, _POINTS)
    quantiles = np.quantile(estimates, _SHARES)
    return Observed(
        threshold=threshold,
        lapses=lapses,
        observers=len(estimates),
        at_threshold=float(planted.probability(u)),
        levels=tuple(stimulus.level_of(float(place)) for place in at),
        planted=tuple(planted.probability(at).tolist()),
        found=tuple(tuple(_psychometric_function(first, float(quantile), at)) for quantile in quantiles),
        asked=_presented_shares(plan, np.concatenate(presented)),
        course=course or (),
        one=tuple(_first_observer_trials(plan, first)),
        error=float(np.std(errors)) if plan.measures(np.array(u)) else math.inf,
        trials=plan.trials,
    )


def _lapsing_person(plan: ThresholdPlan, lapses: float) -> Person:
    """Return an observer with a lapse rate: some of the random answers are correct by chance."""
    return Person(lapse=lapses / Person(lapse=1.0).wrong(len(plan.design.answers)))


def measurable_thresholds(
    plan: ThresholdPlan, lapses: float, least: float, check: Check = _never_stop, most: float = math.inf
) -> Measurable:
    """Return the range of thresholds that a block can measure.

    ``lapses`` is the lapse rate of the observers. No threshold counts below the level ``least``, twice the largest
    error of a valid trial, or above ``most``, the highest one that is presented in full. ``check``
    is called between batches and raises to end the simulation.
    """
    stimulus, random = plan.stimulus, np.random.default_rng(SEED)
    measured: list[Planted] = []
    planted = [(u, stimulus.level_of(u)) for u in np.linspace(*stimulus.domain, _PLANTED).tolist()]
    planted = [(u, threshold) for u, threshold in planted if least <= threshold <= most and threshold > 0]
    for u, threshold in planted:
        levels, held = [], []
        for _ in range(0, OBSERVERS, _AT_ONCE):
            check()
            answered = plan.answers(np.full(_AT_ONCE, u), random, (_lapsing_person(plan, lapses),))
            estimates = plan.estimates(answered)
            levels += [stimulus.level_of(median) for median in estimates.medians.tolist()]
            held.append((estimates.lows <= u) & (u <= estimates.highs))
        bias = float(np.mean(levels)) / threshold - 1.0
        measured.append(Planted(threshold=threshold, bias=bias, coverage=float(np.mean(np.concatenate(held)))))
    return Measurable(_longest_measurable(measured), tuple(measured))


def _longest_measurable(planted: list[Planted]) -> tuple[float, float] | None:
    """Return the ends of the longest run of measurable thresholds."""
    best: list[Planted] = []
    run: list[Planted] = []
    for threshold in planted:
        run = [*run, threshold] if threshold.measurable else []
        best = run if len(run) > len(best) else best
    return (best[0].threshold, best[-1].threshold) if best else None


def _psychometric_function(answered: ObserverAnswers, u: float, at: Floats) -> list[float]:
    """Return the unclipped success rates of an observer with threshold ``u`` at some levels [u]."""
    observer = replace(answered.observers, thresholds=np.array(u), moves=0.0, presented=None)
    probabilities: list[float] = observer.probability(at).tolist()
    return probabilities


def _presented_shares(plan: ThresholdPlan, presented: Floats) -> tuple[tuple[float, float], ...]:
    """Return levels with their shares of the trials, on a grid if there are many."""
    places = np.unique(presented)
    if len(places) > _MOST_BARS:
        places = np.array([plan.stimulus.coordinate(level) for level in plan.stimulus.spaced(plan.stimulus.steps)])
    nearest = np.searchsorted((places[1:] + places[:-1]) / 2, presented)
    counts = np.bincount(nearest, minlength=len(places)) / len(presented)
    return tuple((plan.stimulus.level_of(u), share) for u, share in zip(places.tolist(), counts.tolist(), strict=True))


def _estimate_course(plan: ThresholdPlan, answered: ObserverAnswers, check: Check) -> tuple[tuple[int, _Values], ...]:
    """Return quantiles of the estimates after increasing numbers of trials."""
    trials, tracks = answered.tracks[0].levels.shape[1], len(answered.tracks)
    course: list[tuple[int, _Values]] = []
    for number in sorted({round(trial) for trial in np.geomspace(1, trials, min(_COURSE, trials))}):
        check()
        medians = plan.estimates(answered, most=number).medians
        quantiles = (plan.stimulus.level_of(median) for median in np.quantile(medians, _SHARES).tolist())
        course.append((number * tracks, tuple(quantiles)))
    return tuple(course)


def _first_observer_trials(plan: ThresholdPlan, answered: ObserverAnswers) -> list[Asked]:
    tracks = len(answered.tracks)
    trials = answered.tracks[0].levels.shape[1]
    asked = []
    for track, answers in enumerate(answered.tracks):
        for at, u in enumerate(answers.levels[0].tolist()):
            if math.isnan(u):
                continue
            place = at * tracks + track if plan.method.order == "interleaved" else track * trials + at
            asked.append(Asked(place + 1, track + 1, plan.stimulus.level_of(u), bool(answers.successes[0, at])))
    return sorted(asked, key=lambda trial: trial.trial)


def balance_of(protocol: Protocol, block: Block, participants: int) -> tuple[str, Evenness, int | None] | None:
    """Return order and evenness of a block, and the participants per round of its square, if it has one.

    None where the block has one code.
    """
    for judged in balances(protocol, numbered_participants(participants), SEED):
        for judged_block in judged.blocks:
            if judged_block.id == block.id:
                rows = (
                    row_count(judged_block.order, len(judged_block.evenness.codes))
                    if judged_block.order in ("williams", "latin")
                    else None
                )
                return judged_block.order, judged_block.evenness, rows
    return None


STUDIES: Final = 200
_SPREAD_OF: Final = 30
"""Fewest simulated participants from which the error of one participant's threshold is estimated."""
THRESHOLD_STUDIES: Final = 60
MORE: Final = 4 / 3
_MOST_PEOPLE: Final = 60
"""Up to so many participants it is looked for how many are enough."""
_PLANNED: Final = ("analysis", "participants")
PARTICIPANTS: Final = 12
"""Simulated participants of a study without `analysis.participants`."""
_PRECISION: Final = 0.15
_JND: Final = 0.19
"""People tell viscosities that differ by so much (Jones, Hunter & Lafontaine 1997)."""
LAPSES: Final = 0.02
_ERRORS: Final = 2.0
"""A threshold below so many times the largest error of a valid trial is not measured. [choice]"""
USUAL_ERROR_PERCENT, USUAL_ERROR_MS = 2.0, 2.0

_NAMED_BY: Final = {"stimuli": "stimulus", "methods": "method", "designs": "design", "questionnaires": "questionnaire",
                    "tasks": "task"}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Controls:
    """What is simulated: participants, the threshold (a level), the lapse rate, and the precision that is wanted.

    ``planned`` is how many participants the file plans, None where it does not say.
    """

    participants: int = 12
    threshold: float = 0.2
    lapses: float = 0.02
    precision: float = 0.15
    planned: int | None = None


@dataclass(frozen=True, slots=True)
class Focus:
    """The block that measures are of: the selected one, or the first that uses what is selected, else None.

    ``plan`` decides how precise its thresholds are; ``compares``: studies of its statements are simulated.
    """

    block: Block | None = None
    plan: ThresholdPlan | None = None
    compares: bool = False


def focus_of(protocol: Protocol | None, path: Path) -> Focus:
    """Return the block of an element's measures and what is simulated for it."""
    if protocol is None or (len(path) < 2 and path != SEQUENCE):
        return Focus()
    block = protocol.blocks.get(str(path[1])) if path[0] == "blocks" else None
    if path == SEQUENCE:  # the block of the first hypothesis is simulated
        block = next((protocol.blocks.get(contrast.blocks[0]) for contrast in hypotheses_of(protocol)), None)
    if (key := _NAMED_BY.get(str(path[0]))) is not None:
        users = [user for user in protocol.blocks_in_order if getattr(user, key) == path[1]]
        block = next((user for user in users if user.phase == "main"), next(iter(users), None))
    if block is None:
        return Focus()
    questionnaire = protocol.questionnaire_of(block.id)
    statements = () if questionnaire is None else questionnaire.statements
    compares = block.phase == "main" and bool(statements) and len(block.conditions) > 1
    return Focus(block, threshold_plan(protocol, block), compares)


def hypotheses_of(protocol: Protocol, block: str = "") -> tuple[Contrast, ...]:
    """Return the hypotheses of a study, or those that compare a block."""
    every = () if protocol.analysis is None else protocol.analysis.contrasts
    return tuple(contrast for contrast in every if block in {"", *contrast.blocks})


@dataclass(frozen=True, slots=True)
class Simulation:
    """What is simulated of a block ("" for none) of a study: those that agree in ``depends`` have one answer."""

    depends: str
    block: str
    controls: Controls
    protocol: Protocol = field(compare=False, repr=False)


def simulation_of(protocol: Protocol, focus: Focus, controls: Controls) -> Simulation | None:
    """Return the simulation that an element needs; None if it needs none."""
    simulated = focus.block is not None and (focus.plan is not None or focus.compares)
    if not simulated and not needs_precision_check(protocol):
        return None
    block = focus.block.id if focus.block is not None and simulated else ""
    depends = json.dumps(_without_texts(protocol.model_dump(mode="json", exclude={"pages"})), sort_keys=True)
    return Simulation(depends, block, controls if block else Controls(), protocol)


def needs_precision_check(protocol: Protocol) -> bool:
    """Return whether ``check`` warns about the precision of the study's thresholds, which it simulates."""
    decided = protocol.analysis
    planned = decided is not None and decided.precision is not None and decided.participants is not None
    return planned and any(threshold_plan(protocol, block) is not None for block in protocol.main_blocks)


def precision_of(protocol: Protocol | None) -> float:
    """Return half the desired 95 % interval as a share of the mean."""
    decided = None if protocol is None else protocol.analysis
    return _PRECISION if decided is None or decided.precision is None else decided.precision


def participants_of(study: Study) -> int:
    """Return the default number of simulated participants: the planned ones."""
    return planned_of(study) or PARTICIPANTS


def planned_of(study: Study) -> int | None:
    """Return the number of participants that the file plans, even if other parts are faulty; None if it states none."""
    planned = value_at(study.document, _PLANNED)
    faulty = any(fault.path == _PLANNED for fault in study.faults)
    return planned if isinstance(planned, int) and not faulty else None


def threshold_of(plan: ThresholdPlan) -> float:
    """Return the first simulated threshold (a level): that of viscosity, or one in the middle of the levels."""
    stimulus = plan.stimulus
    low, high = stimulus.levels
    if stimulus.level_kind == "weber" and low < _JND < high:
        return _JND
    return float(f"{stimulus.level_of(sum(stimulus.domain) / 2):.2g}")


def _smallest_level(protocol: Protocol, plan: ThresholdPlan) -> float:
    """Return the smallest level that can be estimated: twice the largest error of a valid trial."""
    limits = protocol.limits
    if plan.stimulus.vary.endswith("_ms"):
        return _ERRORS * (limits.level_error_ms or USUAL_ERROR_MS)
    if plan.stimulus.level_kind == "weber":
        return _ERRORS * (limits.level_error_percent or USUAL_ERROR_PERCENT) / 100
    return 0.0


def _without_texts(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_texts(inner) for key, inner in value.items() if key not in text_keys()}
    return [_without_texts(inner) for inner in value] if isinstance(value, list) else value


MeasureClient: TypeAlias = WorkerClient[Simulation, Simulated]


def start_measure_worker() -> MeasureClient:
    """Start the worker process, at the lowest priority."""
    return WorkerClient("study_app.designer.measures.simulation:run_simulation", name="measures", background=True)


def run_simulation(order: Simulation, _send: Send, stop: Stop) -> Simulated:
    """Run a simulation; raise Stopped if another order came or the client has ended."""

    def check() -> None:
        if stop():
            raise Stopped("the study was edited")

    protocol, controls, simulated = order.protocol, order.controls, Simulated()
    focus = focus_of(protocol, ("blocks", order.block))
    if (plan := focus.plan) is not None and focus.block is not None:
        clips = plan.clipping or clipping(protocol, focus.block)
        most = math.inf if clips is None else clips.highest(plan.stimulus)
        simulated = Simulated(
            simulate_observers(plan, controls.threshold, controls.lapses, check),
            measurable_thresholds(plan, controls.lapses, _smallest_level(protocol, plan), check, most),
            _group_precision(plan, controls, check),
        )
    shown = tuple(_ratio_sentences(protocol, order.block, controls.participants, check)) if order.block else ()
    if focus.compares:
        detectable, powers = _detectable_differences(order, check)
        simulated, shown = replace(simulated, detectable=detectable), (*shown, *powers)
    simulated = replace(simulated, hypotheses=shown)
    if needs_precision_check(protocol):
        simulated = replace(simulated, warnings=_precision_warnings(replace(order, block="", controls=Controls())))
    return simulated


@lru_cache(maxsize=1)
def _precision_warnings(order: Simulation) -> tuple[str, ...]:
    protocol = order.protocol
    return tuple(sentence for block in protocol.main_blocks for sentence in imprecise(protocol, block))


def _group_precision(plan: ThresholdPlan, controls: Controls, check: Check) -> GroupPrecision:
    people, precision = controls.participants, controls.precision
    more = plan.with_trials(round(MORE * plan.trials))
    shares = [_simulate_studies(part, (people,), check).within(0, precision) for part in (plan, more)]
    enough = people if shares[0] >= ENOUGH else None
    last = people
    while enough is None and last < _MOST_PEOPLE:
        sizes = range(last + 1, min(2 * last, _MOST_PEOPLE) + 1)
        precisions, last = _simulate_studies(plan, sizes, check), sizes[-1]
        enough = next((size for place, size in enumerate(sizes) if precisions.within(place, precision) >= ENOUGH), None)
    most = max(_MOST_PEOPLE, people)
    return GroupPrecision(
        participants=people,
        studies=THRESHOLD_STUDIES,
        precision=precision,
        trials=plan.trials,
        share=shares[0],
        more_trials=more.trials,
        more_share=shares[1],
        most=most,
        enough=enough,
    )


def _simulate_studies(plan: ThresholdPlan, sizes: Sequence[int], check: Check) -> threshold_studies.PrecisionResult:
    """Simulate studies of so many participants, as ``power`` does."""
    from study_app.analysis.planning import threshold_studies  # noqa: PLC0415 - loads scipy: only in this process

    total = threshold_studies.PrecisionResult()
    for number in range(THRESHOLD_STUDIES // threshold_studies.BATCH):
        check()
        case = threshold_studies.Case("", plan, (SEED, 0, plan.trials, number))
        total.halves += threshold_studies.study_batch(case, sizes).halves
    return total


_SHOWN: Final = "{} of studies of {} show it, if people answer as the model does"
_EQUALITY: Final = "{} of studies of {} show equivalence if there is no difference"


def _ratio_sentences(protocol: Protocol, block: str, people: int, check: Check) -> Iterator[tuple[str, str]]:
    """Yield a sentence for each hypothesis about thresholds, computed as ``power`` does."""
    from study_app.analysis.data.blocks import decisions  # noqa: PLC0415 - loads scipy: only in this process
    from study_app.analysis.planning.power_curves import detectable, shown_equal  # noqa: PLC0415 - the same
    from study_app.analysis.planning.simulated_studies import group_shares  # noqa: PLC0415 - the same
    from study_app.analysis.planning.threshold_studies import Case, log_bound, study_batch  # noqa: PLC0415 - the same

    for contrast in hypotheses_of(protocol, block):
        plans = [threshold_plan(protocol, protocol.blocks[name]) for name in contrast.blocks]
        groups = [int(people * share + 1e-9) for share in group_shares(protocol, contrast) or (1.0,)]
        spreads = []
        for plan in plans if contrast.measure == "threshold" and min(groups) > 1 else ():
            check()
            if plan is not None:
                batch = study_batch(Case("", plan, (SEED, 0, plan.trials, 0)), (max(people, _SPREAD_OF),))
                spreads.append(batch.spread / math.sqrt(plan.standards))
        if len(spreads) == len(plans) and all(map(math.isfinite, spreads)):
            spread, alpha = math.hypot(math.log(BETWEEN_PEOPLE), *spreads), decisions(protocol).alphas[-1]
            if contrast.bound is None:
                tail = alpha / len(hypotheses_of(protocol)) / (2 if contrast.expected is None else 1)
                apart = spread * detectable(*groups, tail=tail)[1]
                yield contrast.described(), f"80 % of studies of {people} show a ratio of {math.exp(apart):.2f}"
            elif (bound := log_bound(protocol, contrast)) is not None:
                share = shown_equal(bound / spread, *groups, alpha=alpha)
                yield contrast.described(), _EQUALITY.format(f"{share:.0%}", people)


def _detectable_differences(order: Simulation, check: Check) -> tuple[Detectable | None, tuple[tuple[str, str], ...]]:
    """Return the smallest detectable differences, and the share of studies that detect each statement hypothesis."""
    from study_app.analysis.planning.power_curves import Curve, difference_text, powers, with_range  # noqa: PLC0415
    from study_app.analysis.planning.simulated_studies import (  # noqa: PLC0415 - loads scipy
        BATCH,
        HIGHEST,
        IF_EQUAL,
        Counts,
        compares_statements,
        count,
        plan,
        total_counts,
    )

    if not compares_statements(order.protocol):
        return None, ()
    planned = plan(order.protocol, _condition_features(order, check))
    people = order.controls.participants
    counts = dict[str, Counts]()
    for number in range(STUDIES // BATCH):
        check()
        counts = total_counts(counts, count(planned, (people,), SEED, number, BATCH))
    power = powers(planned, (people,), STUDIES, STUDIES, SEED, counts)

    def difference_of(curve: Curve) -> str:
        return with_range([difference_text(of_kind.points(0), 1) for of_kind in power.among_kinds(curve)])

    findings = [
        Finding(curve.item, curve.points(0), difference_of(curve))
        for curve in power.curves
        if curve.block == order.block and curve.item is not None and curve.question in ("settings differ", "trend")
        and curve.item not in planned.unknown
    ]  # fmt: skip
    findings.sort(key=lambda finding: (finding.detectable is None, finding.detectable or 0.0))
    shares = {
        curve.over: with_range([f"{kind.power[0]:.0%}" for kind in power.among_kinds(curve)])
        for curve in power.curves
        if curve.question == "contrast"
    }
    stated = [(contrast.described(), contrast.bound) for contrast in hypotheses_of(order.protocol, order.block)]
    shown = tuple(
        (
            sentence,
            _SHOWN.format(shares[sentence], people)
            if bound is None
            else _EQUALITY.format(shares[f"{sentence}, {IF_EQUAL}"], people),
        )
        for sentence, bound in stated
        if sentence in shares
    )
    detectable = Detectable(
        participants=people, studies=STUDIES, points=HIGHEST, findings=tuple(findings), kind=next(iter(power.kinds))
    )
    return detectable, shown


_features_of: dict[str, ConditionFeatures] = {}


def _condition_features(order: Simulation, check: Check) -> ConditionFeatures:
    """Return the features of each condition, cached for the last study: rehearsing them takes most of the time."""
    from study_app.session.simulated.rehearsal import condition_features  # noqa: PLC0415 - the compiler: only here

    if order.depends not in _features_of:
        features = condition_features(order.protocol, seed=SEED, progress=lambda _words: check())
        _features_of.clear()
        _features_of[order.depends] = features
    return _features_of[order.depends]

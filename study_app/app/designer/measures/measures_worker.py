"""The worker process that simulates what a study can find; none of its numbers is computed in a window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeAlias

from study_app.authoring.measures.observers import GivenUp, Measurable, Observed, Watch, measurable, observe
from study_app.authoring.measures.planned import ENOUGH, Detectable, Finding, GroupPrecision
from study_app.protocol.checks.expected_precision import ThresholdPlan, imprecise
from study_app.protocol.model import Protocol
from study_app.workers.client import WorkerClient
from study_app.workers.server import Send, Stop, Stopped

if TYPE_CHECKING:
    from study_app.analysis.planning import threshold_studies
    from study_app.session.simulated.rehearsal import ConditionFeatures

SEED: Final = 1
"""That of ``power`` where none is given."""
STUDIES: Final = 200
THRESHOLD_STUDIES: Final = 60
MORE: Final = 4 / 3
MOST_PEOPLE: Final = 60
"""Up to so many participants it is looked for how many are enough."""


@dataclass(frozen=True, slots=True)
class Observing:
    """Ask for `Observed`."""

    plan: ThresholdPlan
    threshold: float
    lapses: float


@dataclass(frozen=True, slots=True)
class Measuring:
    """Ask for `Measurable`, not below a level, and not above another one."""

    plan: ThresholdPlan
    lapses: float
    least: float
    most: float = math.inf


@dataclass(frozen=True, slots=True)
class Grouping:
    """Ask for `GroupPrecision` of so many participants."""

    plan: ThresholdPlan
    participants: int
    precision: float


@dataclass(frozen=True, slots=True)
class Detecting:
    """Ask for `Detectable` of a block.

    Two questions that agree in ``depends``, what of the study the answer depends on, have one answer.
    """

    depends: str
    block: str
    participants: int
    protocol: Protocol = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Advising:
    """Ask for the warnings of ``check`` that take simulated observers; ``depends`` as in `Detecting`."""

    depends: str
    protocol: Protocol = field(compare=False, repr=False)


Wanted: TypeAlias = Observing | Measuring | Grouping | Detecting | Advising
Found: TypeAlias = Observed | Measurable | GroupPrecision | Detectable | tuple[str, ...] | None


@dataclass(frozen=True, slots=True)
class Counted:
    """How many of the wanted simulations are done, and how many there are."""

    wanted: Wanted
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class MeasureOrder:
    """What is wanted of a study, in this order; each is answered by (what was wanted, what was found).

    Before it, `Counted` says how far its simulations are.
    """

    wanted: tuple[Wanted, ...]


MeasureClient: TypeAlias = WorkerClient[MeasureOrder, tuple[Wanted, Found] | Counted | None]


def start_measure_worker() -> MeasureClient:
    """Start the worker process, at the lowest priority."""
    return WorkerClient("study_app.app.designer.measures.measures_worker:carry_out", name="measures", background=True)


def carry_out(order: MeasureOrder, send: Send, stop: Stop) -> None:
    """Answer what is wanted, one after the other.

    Raises
    ------
    Stopped
        Another order came, or the client is gone.
    """
    try:
        for wanted in order.wanted:
            send((wanted, _found(wanted, _watch(wanted, send, stop))))
    except GivenUp as given_up:
        raise Stopped("the study was edited") from given_up


def _watch(wanted: Wanted, send: Send, stop: Stop) -> Watch:
    def watch(done: int, total: int) -> None:
        if stop():
            raise GivenUp
        send(Counted(wanted, done, total))

    return watch


def _found(wanted: Wanted, watch: Watch) -> Found:
    match wanted:
        case Observing(plan, threshold, lapses):
            return observe(plan, threshold, lapses, watch)
        case Measuring(plan, lapses, least, most):
            return measurable(plan, lapses, least, watch, most)
        case Grouping():
            return _group(wanted, watch)
        case Detecting():
            return _detectable(wanted, watch)
        case Advising(protocol=protocol):
            return tuple(sentence for block in protocol.main_blocks for sentence in imprecise(protocol, block))


def _group(wanted: Grouping, watch: Watch) -> GroupPrecision:
    people, precision = wanted.participants, wanted.precision
    more, looked = wanted.plan.with_trials(round(MORE * wanted.plan.trials)), _looked_for(people)
    total = THRESHOLD_STUDIES * (2 + len(looked))
    plans = enumerate((wanted.plan, more))
    shares = [_studies(plan, (people,), watch, (at, total)).within(0, precision) for at, plan in plans]
    enough = people if shares[0] >= ENOUGH else None
    for at, sizes in enumerate(looked, start=2):
        if enough is not None:
            break
        found = _studies(wanted.plan, sizes, watch, (at, total))
        enough = next((size for place, size in enumerate(sizes) if found.within(place, precision) >= ENOUGH), None)
    most = max(MOST_PEOPLE, people)
    return GroupPrecision(
        people, THRESHOLD_STUDIES, precision, wanted.plan.trials, shares[0], more.trials, shares[1], most, enough
    )


def _looked_for(people: int) -> list[range]:
    """Return where it is looked for how many participants are enough: twice as many each time, up to `MOST_PEOPLE`."""
    found, last = [], people
    while last < MOST_PEOPLE:
        found.append(range(last + 1, min(2 * last, MOST_PEOPLE) + 1))
        last = found[-1][-1]
    return found


def _studies(plan: ThresholdPlan, sizes: Sequence[int], watch: Watch, turn: tuple[int, int]) -> threshold_studies.Found:
    """Return what simulated studies of so many participants find, as ``power`` does.

    ``turn`` is how often as many studies were simulated before, and how many there will be in all.
    """
    from study_app.analysis.planning import threshold_studies  # noqa: PLC0415 - loads scipy: only in this process

    total = threshold_studies.Found()
    for number in range(THRESHOLD_STUDIES // threshold_studies.BATCH):
        watch(turn[0] * THRESHOLD_STUDIES + number * threshold_studies.BATCH, turn[1])
        case = threshold_studies.Case("", plan, (SEED, 0, plan.trials, number))
        total.halves += threshold_studies.study_batch(case, sizes).halves
    return total


def _detectable(wanted: Detecting, watch: Watch) -> Detectable | None:
    from study_app.analysis.planning.power_curves import powers  # noqa: PLC0415
    from study_app.analysis.planning.simulated_studies import BATCH, HIGHEST, Counts, compares_statements, count, plan  # noqa: PLC0415 - loads scipy  # noqa: PLC0415

    protocol = wanted.protocol
    if not compares_statements(protocol):
        return None
    planned = plan(protocol, _features(wanted, watch))
    sizes, counts = (wanted.participants,), Counts()
    for number in range(STUDIES // BATCH):
        watch(number * BATCH, STUDIES)
        found = count(planned, sizes, SEED, number, BATCH)
        counts = {what: counts.get(what, 0) + one for what, one in found.items()}
    curves = powers(planned, sizes, STUDIES, STUDIES, SEED, counts).curves
    findings = [
        Finding(one.item, None if one.detectable is None else one.detectable[0])
        for one in curves
        if one.block == wanted.block and one.item is not None and one.question in ("settings differ", "trend")
        and one.item not in planned.unknown
    ]  # fmt: skip
    findings.sort(key=lambda one: (one.detectable is None, one.detectable or 0.0))
    return Detectable(wanted.participants, STUDIES, HIGHEST, tuple(findings))


_features_of: dict[str, ConditionFeatures] = {}


def _features(wanted: Detecting, watch: Watch) -> ConditionFeatures:
    """Return the features of each condition, kept for the last study: rehearsing them takes most of the time."""
    from study_app.session.simulated.rehearsal import condition_features  # noqa: PLC0415 - the compiler: only here

    if wanted.depends not in _features_of:
        found = condition_features(wanted.protocol, seed=SEED, progress=lambda _words: watch(0, STUDIES))
        _features_of.clear()
        _features_of[wanted.depends] = found
    return _features_of[wanted.depends]

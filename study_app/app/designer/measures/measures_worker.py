"""The worker process that simulates what a study can find; none of its numbers is computed in a window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeAlias

from study_app.authoring.measures.observers import GivenUp, Measurable, Observed, measurable, observe
from study_app.authoring.measures.planned import ENOUGH, Detectable, Finding, GroupPrecision
from study_app.protocol.checks.expected_precision import ThresholdPlan, imprecise
from study_app.protocol.model import Protocol
from study_app.workers.client import WorkerClient
from study_app.workers.messages import Stopped
from study_app.workers.server import Send, Stop

if TYPE_CHECKING:
    from study_app.analysis.power import threshold_studies
    from study_app.session.simulated.trial_features import ConditionFeatures

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
    """Ask for `Detectable`.

    Attributes
    ----------
    depends : str
        What of the study the answer depends on: two questions that agree in it have one answer.
    block : str
        The block.
    participants : int
        Of each study.
    protocol : Protocol
        The study.
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
class MeasureOrder:
    """What is wanted of a study, in this order; each is answered by (what was wanted, what was found)."""

    wanted: tuple[Wanted, ...]


MeasureClient: TypeAlias = WorkerClient[MeasureOrder, tuple[Wanted, Found] | None]


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
            send((wanted, _found(wanted, stop)))
    except GivenUp as given_up:
        raise Stopped("the study was edited") from given_up


def _found(wanted: Wanted, stop: Stop) -> Found:
    match wanted:
        case Observing(plan, threshold, lapses):
            return observe(plan, threshold, lapses, stop)
        case Measuring(plan, lapses, least, most):
            return measurable(plan, lapses, least, stop, most)
        case Grouping():
            return _group(wanted, stop)
        case Detecting():
            return _detectable(wanted, stop)
        case Advising(protocol=protocol):
            return tuple(sentence for block in protocol.main_blocks for sentence in imprecise(protocol, block))


def _group(wanted: Grouping, stop: Stop) -> GroupPrecision:
    people, precision = wanted.participants, wanted.precision
    more = wanted.plan.with_trials(round(MORE * wanted.plan.trials))
    shares = [_studies(plan, (people,), stop).within(0, precision) for plan in (wanted.plan, more)]
    enough = people if shares[0] >= ENOUGH else _enough(wanted, stop)
    most = max(MOST_PEOPLE, people)
    return GroupPrecision(
        people, THRESHOLD_STUDIES, precision, wanted.plan.trials, shares[0], more.trials, shares[1], most, enough
    )


def _enough(wanted: Grouping, stop: Stop) -> int | None:
    """Return how many participants are enough, looked for up to twice as many, then up to twice as many again."""
    last = wanted.participants
    while last < MOST_PEOPLE:
        sizes = range(last + 1, min(2 * last, MOST_PEOPLE) + 1)
        found, last = _studies(wanted.plan, sizes, stop), sizes[-1]
        for at, size in enumerate(sizes):
            if found.within(at, wanted.precision) >= ENOUGH:
                return size
    return None


def _studies(plan: ThresholdPlan, sizes: Sequence[int], stop: Stop) -> threshold_studies.Found:
    """Return what simulated studies of so many participants find, as ``power`` does."""
    from study_app.analysis.power import threshold_studies  # noqa: PLC0415 - loads scipy: only in this process

    total = threshold_studies.Found()
    for number in range(THRESHOLD_STUDIES // threshold_studies.BATCH):
        if stop():
            raise GivenUp
        case = threshold_studies.Case("", plan, (SEED, 0, plan.trials, number))
        total.halves += threshold_studies.study_batch(case, sizes).halves
    return total


def _detectable(wanted: Detecting, stop: Stop) -> Detectable | None:
    from study_app.analysis.power.batch_counts import BATCH, Counts, count  # noqa: PLC0415 - loads scipy
    from study_app.analysis.power.plan import HIGHEST, compares_statements, plan  # noqa: PLC0415
    from study_app.analysis.power.power_curves import powers  # noqa: PLC0415

    protocol = wanted.protocol
    if not compares_statements(protocol):
        return None
    planned = plan(protocol, _features(wanted, stop))
    sizes, counts = (wanted.participants,), Counts()
    for number in range(STUDIES // BATCH):
        if stop():
            raise GivenUp
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


def _features(wanted: Detecting, stop: Stop) -> ConditionFeatures:
    """Return the features of each condition, kept for the last study: rehearsing them takes most of the time."""
    from study_app.session.simulated.trial_features import condition_features  # noqa: PLC0415 - the compiler: only here

    if wanted.depends not in _features_of:

        def look(_words: str) -> None:
            if stop():
                raise GivenUp

        found = condition_features(wanted.protocol, seed=SEED, progress=look)
        _features_of.clear()
        _features_of[wanted.depends] = found
    return _features_of[wanted.depends]

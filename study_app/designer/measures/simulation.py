"""What a study can find, simulated in a process of its own; none of these numbers is computed in a window."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from study_app.designer.document.study import Study
from study_app.designer.measures.observers import (
    ENOUGH,
    Check,
    Detectable,
    Finding,
    GroupPrecision,
    Simulated,
    measurable,
    observe,
)
from study_app.designer.measures.participant_texts import text_keys
from study_app.protocol.blocks import Block
from study_app.protocol.checks.expected_precision import ThresholdPlan, imprecise, threshold_plan
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path, value_at
from study_app.protocol.trials.presented_levels import clipping
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
PLANNED: Final = ("analysis", "participants")
PARTICIPANTS: Final = 12
"""Simulated participants of a study without `analysis.participants`."""
PRECISION: Final = 0.15
JND: Final = 0.19
"""People tell viscosities that differ by so much (Jones, Hunter & Lafontaine 1997)."""
LAPSES: Final = 0.02
ERRORS: Final = 2.0
"""A threshold below so many times the largest error of a valid trial is not measured. [choice]"""
USUAL_ERROR_PERCENT, USUAL_ERROR_MS = 2.0, 2.0

_NAMED_BY: Final = {"stimuli": "stimulus", "methods": "method", "designs": "design", "questionnaires": "questionnaire",
                    "tasks": "task"}  # fmt: skip


@dataclass(frozen=True, slots=True)
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
    """Return what the measures of an element are of."""
    if protocol is None or len(path) < 2:
        return Focus()
    block = protocol.blocks.get(str(path[1])) if path[0] == "blocks" else None
    if (key := _NAMED_BY.get(str(path[0]))) is not None:
        users = [one for one in protocol.blocks_in_order if getattr(one, key) == path[1]]
        block = next((one for one in users if one.phase == "main"), next(iter(users), None))
    if block is None:
        return Focus()
    questionnaire = protocol.questionnaire_of(block.id)
    statements = () if questionnaire is None else questionnaire.statements
    compares = block.phase == "main" and bool(statements) and len(block.conditions) > 1
    return Focus(block, threshold_plan(protocol, block), compares)


@dataclass(frozen=True, slots=True)
class Simulation:
    """What is simulated of a block ("" for none) of a study: those that agree in ``depends`` have one answer."""

    depends: str
    block: str
    controls: Controls
    protocol: Protocol = field(compare=False, repr=False)


def simulation_of(protocol: Protocol, focus: Focus, controls: Controls) -> Simulation | None:
    """Return what is to be simulated for an element; None where nothing is."""
    simulated = focus.block is not None and (focus.plan is not None or focus.compares)
    if not simulated and not advises(protocol):
        return None
    block = focus.block.id if focus.block is not None and simulated else ""
    depends = json.dumps(_without_texts(protocol.model_dump(mode="json", exclude={"pages"})), sort_keys=True)
    return Simulation(depends, block, controls if block else Controls(), protocol)


def advises(protocol: Protocol) -> bool:
    """Return whether ``check`` warns of the precision of this study's thresholds, for which it simulates observers."""
    decided = protocol.analysis
    planned = decided is not None and decided.precision is not None and decided.participants is not None
    return planned and any(threshold_plan(protocol, block) is not None for block in protocol.main_blocks)


def precision_of(protocol: Protocol | None) -> float:
    """Return half the 95 % interval that is wanted, as a share of the mean."""
    decided = None if protocol is None else protocol.analysis
    return PRECISION if decided is None or decided.precision is None else decided.precision


def participants_of(study: Study) -> int:
    """Return how many participants are simulated unless another number is asked for: the planned ones."""
    return planned_of(study) or PARTICIPANTS


def planned_of(study: Study) -> int | None:
    """Return how many participants the file plans, whatever else is wrong with it; None where it does not say."""
    planned = value_at(study.document, PLANNED)
    faulty = any(fault.path == PLANNED for fault in study.faults)
    return planned if isinstance(planned, int) and not faulty else None


def threshold_of(plan: ThresholdPlan) -> float:
    """Return the threshold (a level) that is simulated first: that of viscosity, or one in the middle of the levels."""
    stimulus = plan.stimulus
    low, high = stimulus.levels
    if stimulus.level_kind == "weber" and low < JND < high:
        return JND
    return float(f"{stimulus.level_of(sum(stimulus.domain) / 2):.2g}")


def least_of(protocol: Protocol, plan: ThresholdPlan) -> float:
    """Return the smallest level that an estimate can be of: twice the largest error of a valid trial."""
    limits = protocol.limits
    if plan.stimulus.vary.endswith("_ms"):
        return ERRORS * (limits.level_error_ms or USUAL_ERROR_MS)
    if plan.stimulus.level_kind == "weber":
        return ERRORS * (limits.level_error_percent or USUAL_ERROR_PERCENT) / 100
    return 0.0


def _without_texts(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_texts(inner) for key, inner in value.items() if key not in text_keys()}
    return [_without_texts(inner) for inner in value] if isinstance(value, list) else value


MeasureClient: TypeAlias = WorkerClient[Simulation, Simulated | None]


def start_measure_worker() -> MeasureClient:
    """Start the worker process, at the lowest priority."""
    return WorkerClient("study_app.designer.measures.simulation:carry_out", name="measures", background=True)


def carry_out(order: Simulation, send: Send, stop: Stop) -> None:
    """Answer with what is known so far, each time a part of it was simulated, the quickest first.

    Raises Stopped if another order came, or the client is gone.
    """

    def check() -> None:
        if stop():
            raise Stopped("the study was edited")

    for found in _parts(order, check):
        send(found)


def _parts(order: Simulation, check: Check) -> Iterator[Simulated]:
    protocol, controls, found = order.protocol, order.controls, Simulated()
    focus = focus_of(protocol, ("blocks", order.block))
    if (plan := focus.plan) is not None and focus.block is not None:
        found = replace(found, observed=observe(plan, controls.threshold, controls.lapses, check))
        yield found
        found = replace(found, group=_group(plan, controls, check))
        yield found
        clips = plan.clipping or clipping(protocol, focus.block)
        most = math.inf if clips is None else clips.highest(plan.stimulus)
        found = replace(found, measurable=measurable(plan, controls.lapses, least_of(protocol, plan), check, most))
        yield found
    if focus.compares:
        found = replace(found, detectable=_detectable(order, check))
        yield found
    if advises(protocol):
        yield replace(found, warnings=_warnings(replace(order, block="", controls=Controls())))


@lru_cache(maxsize=1)
def _warnings(order: Simulation) -> tuple[str, ...]:
    protocol = order.protocol
    return tuple(sentence for block in protocol.main_blocks for sentence in imprecise(protocol, block))


def _group(plan: ThresholdPlan, controls: Controls, check: Check) -> GroupPrecision:
    people, precision = controls.participants, controls.precision
    more = plan.with_trials(round(MORE * plan.trials))
    shares = [_studies(one, (people,), check).within(0, precision) for one in (plan, more)]
    enough = people if shares[0] >= ENOUGH else None
    last = people
    while enough is None and last < MOST_PEOPLE:
        sizes = range(last + 1, min(2 * last, MOST_PEOPLE) + 1)
        found, last = _studies(plan, sizes, check), sizes[-1]
        enough = next((size for place, size in enumerate(sizes) if found.within(place, precision) >= ENOUGH), None)
    most = max(MOST_PEOPLE, people)
    return GroupPrecision(
        people, THRESHOLD_STUDIES, precision, plan.trials, shares[0], more.trials, shares[1], most, enough
    )


def _studies(plan: ThresholdPlan, sizes: Sequence[int], check: Check) -> threshold_studies.PrecisionResult:
    """Return what simulated studies of so many participants find, as ``power`` does."""
    from study_app.analysis.planning import threshold_studies  # noqa: PLC0415 - loads scipy: only in this process

    total = threshold_studies.PrecisionResult()
    for number in range(THRESHOLD_STUDIES // threshold_studies.BATCH):
        check()
        case = threshold_studies.Case("", plan, (SEED, 0, plan.trials, number))
        total.halves += threshold_studies.study_batch(case, sizes).halves
    return total


def _detectable(order: Simulation, check: Check) -> Detectable | None:
    from study_app.analysis.planning.power_curves import powers  # noqa: PLC0415 - loads scipy
    from study_app.analysis.planning.simulated_studies import BATCH, HIGHEST, Counts, compares_statements, count, plan  # noqa: PLC0415 - loads scipy

    if not compares_statements(order.protocol):
        return None
    planned = plan(order.protocol, _features(order, check))
    people = order.controls.participants
    counts = Counts()
    for number in range(STUDIES // BATCH):
        check()
        found = count(planned, (people,), SEED, number, BATCH)
        counts = {what: counts.get(what, 0) + one for what, one in found.items()}
    curves = powers(planned, (people,), STUDIES, STUDIES, SEED, counts).curves
    findings = [
        Finding(one.item, None if one.detectable is None else one.detectable[0])
        for one in curves
        if one.block == order.block and one.item is not None and one.question in ("settings differ", "trend")
        and one.item not in planned.unknown
    ]  # fmt: skip
    findings.sort(key=lambda one: (one.detectable is None, one.detectable or 0.0))
    return Detectable(people, STUDIES, HIGHEST, tuple(findings))


_features_of: dict[str, ConditionFeatures] = {}


def _features(order: Simulation, check: Check) -> ConditionFeatures:
    """Return the features of each condition, kept for the last study: rehearsing them takes most of the time."""
    from study_app.session.simulated.rehearsal import condition_features  # noqa: PLC0415 - the compiler: only here

    if order.depends not in _features_of:
        found = condition_features(order.protocol, seed=SEED, progress=lambda _words: check())
        _features_of.clear()
        _features_of[order.depends] = found
    return _features_of[order.depends]

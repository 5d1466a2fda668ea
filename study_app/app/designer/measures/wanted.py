"""Which simulations a study calls for, and what each of them depends on."""

import json
import math
from typing import Any, Final

from study_app.app.designer.measures.measures_worker import Advising, Detecting, Grouping, Measuring, Observing, Wanted
from study_app.authoring.edited_study import Study
from study_app.authoring.measures.participant_texts import text_keys
from study_app.protocol.blocks import Block
from study_app.protocol.checks.expected_precision import ThresholdPlan, threshold_plan
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import value_at
from study_app.protocol.trials.presented_levels import clipping
from study_app.viewmodels.designer.measures.measures_view import Controls, Focus

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


def wanted_of(protocol: Protocol, focus: Focus, controls: Controls) -> tuple[Wanted, ...]:
    """Return what is to be simulated, the quickest first."""
    wanted: list[Wanted] = []
    depends = ""
    if (plan := focus.plan) is not None and focus.block is not None:
        wanted = [
            Observing(plan, controls.threshold, controls.lapses),
            Grouping(plan, controls.participants, controls.precision),
            measuring(protocol, plan, focus.block, controls.lapses),
        ]
    if focus.compares and focus.block is not None:
        depends = _dependencies(protocol)
        wanted.append(Detecting(depends, focus.block.id, controls.participants, protocol))
    decided = protocol.analysis
    if decided is not None and decided.precision is not None and decided.participants is not None:
        plans = (threshold_plan(protocol, block) for block in protocol.main_blocks)
        if any(one is not None for one in plans):
            wanted.append(Advising(depends or _dependencies(protocol), protocol))
    return tuple(wanted)


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


def measuring(protocol: Protocol, plan: ThresholdPlan, block: Block, lapses: float) -> Measuring:
    """Return what asks for the thresholds that a block can measure, up to the highest level that is in full."""
    found = plan.clipping or clipping(protocol, block)
    most = math.inf if found is None else found.highest(plan.stimulus)
    return Measuring(plan, lapses, least_of(protocol, plan), most)


def _dependencies(protocol: Protocol) -> str:
    """Return the parts of a study on which its simulations depend: all except pages and texts."""
    whole = protocol.model_dump(mode="json", exclude={"pages"})
    return json.dumps(_without_texts(whole), sort_keys=True)


def _without_texts(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_texts(inner) for key, inner in value.items() if key not in text_keys()}
    return [_without_texts(inner) for inner in value] if isinstance(value, list) else value

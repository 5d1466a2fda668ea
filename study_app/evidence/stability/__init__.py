"""Stability of hard closed loops of liquid, servo, device and hand, and their maximum stable damping.

Reading order: stability_cases; bench, case_groups; damping_limits, force_delay, verdict, withheld_force;
driver_loop, velocity; delivered_force, stability_report.
"""

from study_app.evidence.stability.case_groups import evenly_chosen, groups, sweep
from study_app.evidence.stability.delivered_force import delivered_force_evidence, measure_delivered_force
from study_app.evidence.stability.force_delay import force_delay_evidence, measure_force_delays
from study_app.evidence.stability.stability_cases import parse_case
from study_app.evidence.stability.stability_report import (
    fidelities,
    run_sweep,
    slope_limits_evidence,
    stability_evidence,
    verdict_text,
    verdicts_on,
)
from study_app.evidence.stability.velocity import measure_velocities, velocity_evidence
from study_app.evidence.stability.verdict import NOISY, UNSTABLE
from study_app.evidence.stability.withheld_force import measure_withheld_force, withheld_force_evidence

__all__ = [
    "NOISY",
    "UNSTABLE",
    "delivered_force_evidence",
    "evenly_chosen",
    "fidelities",
    "force_delay_evidence",
    "groups",
    "measure_delivered_force",
    "measure_force_delays",
    "measure_velocities",
    "measure_withheld_force",
    "parse_case",
    "run_sweep",
    "slope_limits_evidence",
    "stability_evidence",
    "sweep",
    "velocity_evidence",
    "verdict_text",
    "verdicts_on",
    "withheld_force_evidence",
]

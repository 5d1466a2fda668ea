"""Drag: the liquid resists motion relative to it."""

from __future__ import annotations

from study_app.haptics.compiled import part
from study_app.haptics.layout import Record
from study_app.haptics.vector import norm


@part
def resist(liquid: Record, local: Record, state: Record) -> None:
    """Add F = −½ ρ C_d A |w| w φ to the force, with w = v − v_flow (Rek 2024, §4.1).

    A is the frontal area of the ball, φ the share of the liquid, v_flow the liquid's velocity at the body.
    """
    w = local.drag.relative_mps
    for axis in range(3):
        w[axis] = state.velocity_mps[axis] - local.flow_mps[axis]
    speed_mps = norm(w)
    for axis in range(3):
        local.drag.force_n[axis] = -liquid.drag.factor_kg_m * speed_mps * w[axis] * local.share
        state.force_n[axis] += local.drag.force_n[axis]

"""Buoyancy of the ball in the liquids, and the weight of the ball."""

from __future__ import annotations

from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.model.effects.buoyancy import BIT


@part
def buoyancy_force(model: Any) -> None:
    """Add (Σ ρ V_sub − ρ_body V) g, upward [N], to the force (Archimedes); V_sub is the ball's volume in each liquid.

    The weight counts once, if the ball is in or above any liquid that has buoyancy: a ball that rises through the
    surface keeps its weight, so the force has no step there. [choice] Without a surface the weight fades in and out at
    the border.
    """
    parameters, state = model.parameters[0], model.state[0]
    lift_n = 0.0
    weighing = 0.0
    for i in range(parameters.liquids):
        liquid, local = model.liquids[i], model.liquid_states[i]
        if liquid.effects & BIT:
            lift_n += liquid.buoyancy.lift_n * local.share
            weighing += local.border
    state.lift_n[1] = lift_n - parameters.weight_n * min(weighing, 1.0)
    state.force_n[1] += state.lift_n[1]

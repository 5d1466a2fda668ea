"""Current: a liquid that flows by itself."""

from __future__ import annotations

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.vector import copy
from study_app.haptics.model.effects.current import CURRENT_CHANNEL, CURRENT_UNIFORM
from study_app.haptics.model.layout import Record


@part
def current_velocity(liquid: Record, local: Record, state: Record) -> None:
    """Subtract v_current(p), (3,) [m/s], from the velocity that the other effects use; it adds no force.

    Uniform: the same everywhere. Channel: u (1 − (s/h)²), s the distance from the middle, 2h the width between the
    walls, at rest beyond (plane Poiseuille flow). Vortex: u · 2(r/a)/(1 + (r/a)²) around the vertical axis, fastest at
    r = a, 0 in the centre, proportional to 1/r far out (Kaufmann 1962; Scully 1975).
    """
    current, flow = liquid.current, local.current.velocity_mps
    if current.kind == CURRENT_UNIFORM:
        for axis in range(3):
            flow[axis] = current.velocity_mps[axis]
    else:
        x_m = state.position_m[0] - current.centre_m[0]
        z_m = state.position_m[2] - current.centre_m[2]
        if current.kind == CURRENT_CHANNEL:
            side = (x_m * current.across[0] + z_m * current.across[2]) / current.size_m
            share = max(1.0 - side * side, 0.0)
            for axis in range(3):
                flow[axis] = share * current.velocity_mps[axis]
        else:
            x, z = x_m / current.size_m, z_m / current.size_m
            turning_mps = 2.0 * current.peak_mps / (1.0 + x * x + z * z)
            flow[0], flow[1], flow[2] = turning_mps * z, 0.0, -turning_mps * x
    for axis in range(3):
        local.motion_mps[axis] -= flow[axis]
    copy(flow, state.drift_mps)

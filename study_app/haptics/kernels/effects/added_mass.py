"""Added mass: an accelerating ball also accelerates the liquid around it."""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.vector import clear, copy, square
from study_app.haptics.model.estimators import kalman
from study_app.haptics.model.layout import Record

NOTHING_MPS2 = 1e-30


@part
def added_mass_force(
    parameters: Record, liquid: Record, local: Record, state: Record, delay_ticks: int, interval_s: float
) -> None:
    """Add F = −C_a ρ V_sub dw/dt to the force, (3,) [N]; C_a = ½ for a sphere in potential flow (Lamb 1932, §92).

    dw/dt is the difference of w over Δt, smoothed over τ: a ← a + (1 − e^(−Δt/τ))(Δw/Δt − a). Unsmoothed, one encoder
    count would cause a spike of 0.3 N. In the first tick in a liquid the acceleration is 0; in uniform motion it decays
    to 0, not to a denormal number. Only the share that keeps the loop stable is sent.
    """
    mass, tracks, w = liquid.added_mass, local.added_mass, local.relative_mps
    if local.ticks == 0:
        clear(tracks.acceleration_mps2)
        copy(w, tracks.previous_mps)
    accelerate(tracks.acceleration_mps2, w, tracks.previous_mps, mass.filter_per_s, interval_s)
    copy(w, tracks.previous_mps)
    force_n = local.inertia_n[local.inertial]
    local.inertial += 1
    for axis in range(3):
        force_n[axis] = -mass.mass_kg * local.share * tracks.acceleration_mps2[axis]
        state.force_n[axis] += force_n[axis]
    square_m2ps2 = storing_square(parameters, mass, local, tracks)
    state.returnable_j += 0.5 * liquid.inertia_share[delay_ticks] * mass.mass_kg * local.share * square_m2ps2


@part
def accelerate(acceleration_mps2: Any, w: Any, previous_mps: Any, filter_per_s: float, interval_s: float) -> None:
    """Set the smoothed dw/dt, (3,), from w and w of the tick before."""
    weight = -math.expm1(-filter_per_s * interval_s)
    for axis in range(3):
        difference_mps2 = (w[axis] - previous_mps[axis]) / interval_s
        smoothed_mps2 = acceleration_mps2[axis] + weight * (difference_mps2 - acceleration_mps2[axis])
        acceleration_mps2[axis] = smoothed_mps2 if abs(smoothed_mps2) > NOTHING_MPS2 else 0.0


@part
def storing_square(parameters: Record, mass: Record, local: Record, tracks: Record) -> float:
    """Return v² [m²/s²] of the energy ½ m v² that the added mass m stores.

    Its force is -m dw_s/dt, w_s being w smoothed over τ: w_s' = (w - w_s)/τ. So the hand does the work ∫m w_s' w dt = ½
    m w_s² + ∫m τ w_s'² dt: only ½ m w_s² can be returned, with w_s = w - τ w_s', which at a reversal is not 0 when w
    is. With the other estimators their own stored energy, of a longer lag, covers the difference.
    """
    if parameters.estimator != kalman.CODE:
        return float(square(local.motion_mps))
    lag_s, square_m2ps2 = 1.0 / mass.filter_per_s, 0.0
    for axis in range(3):
        smoothed_mps = local.motion_mps[axis] - lag_s * tracks.acceleration_mps2[axis]
        square_m2ps2 += smoothed_mps * smoothed_mps
    return square_m2ps2

"""Added mass: an accelerating ball also accelerates the liquid around it."""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.known_force import STORAGE, solve_inertia
from study_app.haptics.kernels.vector import clear, copy, square
from study_app.haptics.model.estimators import KALMAN
from study_app.haptics.model.layout import Record

_NOTHING_MPS2 = 1e-30


@part
def added_mass_force(
    parameters: Record, liquid: Record, local: Record, state: Record, delay_ticks: int, interval_s: float
) -> None:
    """Add F = −C_a ρ V_sub dw/dt to the force, (3,) [N]; C_a = ½ for a sphere in potential flow (Lamb 1932, §92).

    dw/dt is the difference of w over Δt, smoothed (`accelerate`). Unsmoothed, one encoder count would cause a spike of
    0.3 N. In the first tick in a liquid the acceleration is 0; in uniform motion it decays to 0, not to a denormal
    number. Only the fraction that keeps the loop stable is sent.
    """
    mass, tracks, w = liquid.added_mass, local.added_mass, local.relative_mps
    if local.ticks == 0:
        clear(tracks.smoothed_mps2[0])
        clear(tracks.smoothed_mps2[1])
        copy(w, tracks.previous_mps)
    rate_per_s = mass.filter_per_s * liquid.smoothing_rate[delay_ticks]
    lead = parameters.smoothing_lead
    accelerate(tracks.acceleration_mps2, tracks.smoothed_mps2, w, tracks.previous_mps, rate_per_s, lead, interval_s)
    copy(w, tracks.previous_mps)
    force_n = local.inertia_n[local.inertial]
    local.inertial += 1
    for axis in range(3):
        force_n[axis] = -mass.mass_kg * local.share * tracks.acceleration_mps2[axis]
        state.force_n[axis] += force_n[axis]
    square_m2ps2 = storing_square(parameters, local, tracks.smoothed_mps2, rate_per_s)
    state.returnable_j += 0.5 * liquid.inertia_share[delay_ticks] * mass.mass_kg * local.share * square_m2ps2


@part
def implicit_added_mass_force(
    parameters: Record, liquid: Record, local: Record, state: Record, delay_ticks: int
) -> None:
    """Add the same force, with dw/dt of the known force (`known_force.solve_inertia`)."""
    mass, tracks = liquid.added_mass, local.added_mass
    force_n = local.inertia_n[local.inertial]
    local.inertial += 1
    inertia_kg = mass.mass_kg * local.share
    solve_inertia(parameters, state.kalman, state.force_n, inertia_kg, delay_ticks, tracks.acceleration_mps2)
    follow_acceleration(tracks.smoothed_mps2, tracks.acceleration_mps2)
    copy(local.relative_mps, tracks.previous_mps)
    for axis in range(3):
        force_n[axis] = -inertia_kg * tracks.acceleration_mps2[axis]
        state.force_n[axis] += force_n[axis]
    state.returnable_j += 0.5 * STORAGE * local.inertia_share * inertia_kg * square(local.motion_mps)


@part
def follow_acceleration(smoothed_mps2: Any, acceleration_mps2: Any) -> None:
    """Let smoothed accelerations continue from this one if the filter has a fault."""
    copy(acceleration_mps2, smoothed_mps2[0])
    copy(acceleration_mps2, smoothed_mps2[1])


@part
def accelerate(
    acceleration_mps2: Any,
    smoothed_mps2: Any,
    w: Any,
    previous_mps: Any,
    rate_per_s: float,
    lead: float,
    interval_s: float,
) -> None:
    """Set the smoothed dw/dt, (3,), from w and w of the tick before.

    It is smoothed once and twice over T = (1 + g)/rate: a ← a + (1 − e^(−Δt/T))(Δw/Δt − a); with the lead g, a₁ + g
    (a₁ − a₂) lags by (1 − g) T and passes noise as if it were smoothed once at the rate.
    """
    weight = -math.expm1(-rate_per_s / (1.0 + lead) * interval_s)
    for axis in range(3):
        difference_mps2 = (w[axis] - previous_mps[axis]) / interval_s
        once_mps2 = smoothed_mps2[0, axis] + weight * (difference_mps2 - smoothed_mps2[0, axis])
        twice_mps2 = smoothed_mps2[1, axis] + weight * (once_mps2 - smoothed_mps2[1, axis])
        smoothed_mps2[0, axis] = once_mps2 = once_mps2 if abs(once_mps2) > _NOTHING_MPS2 else 0.0
        smoothed_mps2[1, axis] = twice_mps2 = twice_mps2 if abs(twice_mps2) > _NOTHING_MPS2 else 0.0
        acceleration_mps2[axis] = once_mps2 + lead * (once_mps2 - twice_mps2)


@part
def storing_square(parameters: Record, local: Record, smoothed_mps2: Any, rate_per_s: float) -> float:
    """Return v² [m²/s²] of the energy ½ m v² that the added mass m stores (`stored_square`).

    With the other estimators their own stored energy, of a longer lag, covers that of the smoothing.
    """
    if parameters.estimator != KALMAN:
        return float(square(local.motion_mps))
    time_s, square_m2ps2 = (1.0 + parameters.smoothing_lead) / rate_per_s, 0.0
    for axis in range(3):
        once_mps = local.motion_mps[axis] - time_s * smoothed_mps2[0, axis]
        square_m2ps2 += stored_square(once_mps, time_s * smoothed_mps2[1, axis], parameters.smoothing_lead)
    return square_m2ps2


@part
def stored_square(once_mps: float, less_mps: float, lead: float) -> float:
    """Return v² [m²/s²] of the energy ½ m v² that can be returned: of w₁ and w₁ − w₂, w smoothed once and twice.

    The force is -m u', u = w₁ + g (w₁ − w₂), T w₁' = w - w₁, T w₂' = w₁ - w₂. The hand does the work ∫m u' w dt ≥
    ½ m (u² + g (w₁ − w₂)²), for g = 0 and 1 the available storage (Willems 1972), which at a reversal is not 0 when
    w is.
    """
    smoothed_mps = once_mps + lead * less_mps
    return smoothed_mps * smoothed_mps + lead * less_mps * less_mps

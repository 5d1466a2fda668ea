"""Added mass: to move the ball is to move the liquid around it."""

from __future__ import annotations

import math

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.vector import clear, copy
from study_app.haptics.model.layout import Record

NOTHING_MPS2 = 1e-30


@part
def added_mass_force(liquid: Record, local: Record, state: Record, interval_s: float) -> None:
    """Add F = −C_a ρ V_sub dw/dt to the force, (3,) [N]; C_a = ½ for a sphere in potential flow (Lamb 1932, §92).

    dw/dt is the difference of w over Δt, smoothed over τ: a ← a + (1 − e^(−Δt/τ))(Δw/Δt − a). Unsmoothed, one count of
    an encoder would be a spike of 0.3 N. The first tick in a liquid knows no acceleration yet; what is left of one when
    motion is even ends as 0, not as a denormal number.
    """
    mass, tracks, w = liquid.added_mass, local.added_mass, local.relative_mps
    if tracks.primed == 0:
        tracks.primed = 1
        clear(tracks.acceleration_mps2)
        copy(w, tracks.previous_mps)
    weight = -math.expm1(-mass.filter_per_s * interval_s)
    for axis in range(3):
        difference_mps2 = (w[axis] - tracks.previous_mps[axis]) / interval_s
        smoothed_mps2 = tracks.acceleration_mps2[axis] + weight * (difference_mps2 - tracks.acceleration_mps2[axis])
        tracks.acceleration_mps2[axis] = smoothed_mps2 if abs(smoothed_mps2) > NOTHING_MPS2 else 0.0
        tracks.previous_mps[axis] = w[axis]
        tracks.force_n[axis] = -mass.mass_kg * local.share * tracks.acceleration_mps2[axis]
        state.force_n[axis] += tracks.force_n[axis]

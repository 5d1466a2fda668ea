"""Non-Newtonian drag: yield stress, shear thinning and thickening, elasticity, of a ball in creeping flow.

With w the velocity relative to the liquid, τ_v = K (|w|/D)^n and η the effective viscosity F/(3πD|w|)::

    Herschel–Bulkley  F = 3πD² [X(n) τ_v + 1.7 n^1.5 √(τ_v τ_y)] w/|w| + F_y s/s_y,    F_y = 3πD² · 1.157 τ_y
    Carreau           F = 3πη₀D w [1 + (0.275 · 2λ|w|/D)²]^((n−1)/2)
    Maxwell           F = 3πη₀D v,    v' = (w − v)/λ
    shear thickening  F = 3πηD w, η from η₀ to the thickened viscosity between the onset γ̇ = 2|w|/D and twice that

All are multiplied by φ(Re), Re = ρ|w|D/η (``laws.finite_reynolds``), and oppose the motion; the part (φ − 1) F_y acts
along w, so that the elastic stiffness is unchanged. X: Gu & Tanner 1985. The elastic displacement s is that of an
elastic-plastic solid, ds = dp − |dp| s/s_y: at rest the liquid holds the ball, and it flows once the force exceeds F_y;
|dp| ignores motion within two encoder counts. s and v are computed from positions, which lag less than a velocity
estimate: the loop is stable with F_y/s_y up to 400 N/m at the hand where the viscous part keeps 0.75 of the slope
limit, and with any λ. A power law has F_y = 0, a Bingham liquid n = 1.
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.vector import clear, copy, norm, square
from study_app.haptics.model import laws
from study_app.haptics.model.effects import non_newtonian
from study_app.haptics.model.laws import finite_reynolds
from study_app.haptics.model.layout import GROWS_AS_SPEED, GROWS_LESS, Record

_SLACK_COUNTS = 2.0
"""Encoder counts: motion within them relaxes no stress, otherwise noise would let a hand at rest creep. [choice]"""

_MOST_STRAIN = 3.0
"""In a tick that strains the liquid more, it flows, with the yield stress as shear stress."""

_herschel_bulkley = part(laws.herschel_bulkley)
_carreau = part(laws.carreau)
_shear_thickening = part(laws.shear_thickening)
_over_stokes = part(finite_reynolds)


@part
def non_newtonian_force(
    parameters: Record, liquid: Record, local: Record, state: Record, delay_ticks: int, interval_s: float
) -> None:
    """Add F to the force, (3,) [N], by the fraction φ of the frontal area.

    The slope limit B bounds the viscous part. The excess over B in an elastic or thickening liquid is passed on as
    ``local.excess_n``, which the safety layer removes.
    """
    law, tracks = liquid.non_newtonian, local.non_newtonian
    if local.ticks == 0:
        clear(tracks.strain)
        clear(tracks.ahead_m)
        clear(tracks.velocity_mps)
        clear(tracks.step_m)
    else:
        for axis in range(3):
            drift_mps = state.velocity_mps[axis] - local.motion_mps[axis]
            tracks.step_m[axis] = state.position_m[axis] - state.previous_m[axis] - drift_mps * interval_s
    limit_nspm = parameters.slope_limit_nspm[delay_ticks]
    state.growth = max(state.growth, GROWS_AS_SPEED)
    if law.kind == non_newtonian.KIND_HERSCHEL_BULKLEY:
        _yielding(parameters, law, tracks, local, state, limit_nspm)
    elif law.kind == non_newtonian.KIND_MAXWELL:
        _viscoelastic(law, tracks, local, state, interval_s)
    else:
        _viscous(law, local, state, limit_nspm)


@part
def _yielding(parameters: Record, law: Any, tracks: Record, local: Record, state: Record, limit_nspm: float) -> None:
    """Herschel–Bulkley; the elastic energy ½ F_y s²/s_y may be returned to the hand."""
    w, strain = local.relative_mps, tracks.strain
    speed_mps = norm(w)
    viscous_n = _herschel_bulkley(speed_mps, law.viscous, law.plastic, law.exponent)
    whole_n = viscous_n + law.yield_n
    beyond_n = (_inertial_factor(law, whole_n, speed_mps) - 1.0) * whole_n
    if speed_mps > 0.0:
        resistance_nspm = local.frontal * (viscous_n + beyond_n) / speed_mps
        stable_nspm = (
            min(resistance_nspm, non_newtonian.VISCOUS_SHARE * limit_nspm) if law.yield_n > 0.0 else resistance_nspm
        )
        _add_limited_force(local, state, w, stable_nspm)
        _add_excess_force(local, state, w, resistance_nspm - stable_nspm)
    state.growth = GROWS_LESS
    if law.yield_n == 0.0:
        return
    stable = min(limit_nspm / law.full_nspm, 1.0)
    per_m = law.stiffness_npm * stable * stable / law.yield_n
    x = min(_play_step_m(tracks, _SLACK_COUNTS * parameters.count_m * parameters.scale) * per_m, _MOST_STRAIN)
    share = _mean(x)
    for axis in range(3):
        strain[axis] += share * (tracks.step_m[axis] * per_m - x * strain[axis])
    shortening = 1.0 / max(norm(strain), 1.0)
    for axis in range(3):
        strain[axis] *= shortening
        state.force_n[axis] -= local.frontal * law.yield_n * strain[axis]
    state.returnable_j += 0.5 * local.frontal * law.yield_n * square(strain) / per_m


@part
def _mean(x: float) -> float:
    """Return (1 − e^(−x))/x, the mean of a decay over a tick, to 1 % up to x = 2; x times it is less than 1."""
    return 1.0 / (1.0 + x * (0.5 + x / 12.0))


@part
def _play_step_m(tracks: Record, slack_m: float) -> float:
    """Return the ball's motion in this tick [m] without encoder noise and dither: the step of a play operator."""
    ahead_m = tracks.ahead_m
    for axis in range(3):
        ahead_m[axis] += tracks.step_m[axis]
    distance_m = norm(ahead_m)
    if distance_m <= slack_m:
        return 0.0
    for axis in range(3):
        ahead_m[axis] *= slack_m / distance_m
    return distance_m - slack_m


@part
def _viscoelastic(law: Any, tracks: Record, local: Record, state: Record, interval_s: float) -> None:
    """Maxwell; the slope limit holds F at |v|: at |w| it would remove the push after a stop."""
    w, v = local.relative_mps, tracks.velocity_mps
    if law.relaxation_s == 0.0:
        copy(w, v)
    else:
        x = interval_s / law.relaxation_s
        share = _mean(x)
        for axis in range(3):
            v[axis] += share * (tracks.step_m[axis] / law.relaxation_s - x * v[axis])
    speed_mps = norm(v)
    ratio = local.frontal * _inertial_factor(law, law.stokes_nspm * speed_mps, speed_mps)
    for axis in range(3):
        local.late_n[axis] = -ratio * law.stokes_nspm * v[axis]
        state.force_n[axis] += local.late_n[axis]
    local.late_mps = speed_mps
    local.prompt_nspm = 0.0
    state.returnable_j += 0.5 * ratio * law.stokes_nspm * law.relaxation_s * square(v)


@part
def _viscous(law: Any, local: Record, state: Record, limit_nspm: float) -> None:
    """Carreau and shear thickening."""
    w = local.relative_mps
    speed_mps = norm(w)
    if speed_mps == 0.0:
        return
    if law.kind == non_newtonian.KIND_CARREAU:
        force_n = _carreau(speed_mps, law.stokes_nspm, law.time_spm, law.exponent)
        state.growth = GROWS_LESS
        _add_limited_force(
            local, state, w, local.frontal * _inertial_factor(law, force_n, speed_mps) * force_n / speed_mps
        )
        return
    force_n = _shear_thickening(speed_mps, law.stokes_nspm, law.thickened_nspm, law.onset_mps, math.inf)
    stable_n = _shear_thickening(speed_mps, law.stokes_nspm, law.thickened_nspm, law.onset_mps, limit_nspm)
    ratio = local.frontal * _inertial_factor(law, force_n, speed_mps) / speed_mps
    _add_limited_force(local, state, w, ratio * stable_n)
    _add_excess_force(local, state, w, ratio * (force_n - stable_n))


@part
def _add_limited_force(local: Record, state: Record, w: Any, resistance_nspm: float) -> None:
    """Add −R w to the force as damping, which the slope limit bounds."""
    for axis in range(3):
        force_n = -resistance_nspm * w[axis]
        local.damping_n[axis] += force_n
        state.force_n[axis] += force_n


@part
def _add_excess_force(local: Record, state: Record, w: Any, resistance_nspm: float) -> None:
    """Add −R w to the force, and the part above the slope limit to the excess."""
    for axis in range(3):
        local.excess_n[axis] = -resistance_nspm * w[axis]
        state.force_n[axis] += local.excess_n[axis]


@part
def _inertial_factor(law: Any, force_n: float, speed_mps: float) -> float:
    """Return φ(Re) of `laws.inertial_factor`."""
    return float(_over_stokes(law.inertia_kg_m * speed_mps * speed_mps / force_n)) if force_n > 0.0 else 1.0

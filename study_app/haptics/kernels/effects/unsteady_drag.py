"""Unsteady drag: drag, added mass and history of a ball in one law that is also valid at finite Reynolds numbers.

With w the velocity relative to the liquid, ν = µ/ρ, and vectors w, y, z, s, e, h, m_i::

    F  = −3πµD (w + y + h) − ½ρV dw/dt
    u  = √(|w|² + |z|²)                                 speed of convection: of the ball, or of its wake after a stop
    z' = c_z u/D (w − z)                                velocity of the wake behind the ball
    s' = c_s u/D (w − s)                                velocity of the wake farther behind
    e  = w − Re_u/(Re_u + R₀) (β o z + p s)             effective relative velocity, Re_u = uD/ν, with
    o  = min(max(1 − w·z/|z|², 0), 1)                   how far the wake overtakes or opposes it; 0 if z = 0
    p  = min(max(−w·s/|s|², 0), 1)                      how far it moves back through its wake; 0 if s = 0
    y' = c_y u/D (φ(|e|) e − w − y)                     drag beyond Stokes', rising over distance; φ: `finite_reynolds`
    h  = D/(2√(πν)) Σ b_i m_i,  m_i' = dw/dt − (k_i + c_m u/D) m_i   history, convected with the flow

The exponentials are 1/√t within 1.5 % from 1 ms to 30 s. As Re → 0, F is that of Stokes, the added mass and Basset.
The constants are fitted to this project's fluid solver at Re 0.3 to 100 by ``liquid-study cfd --refit``, which prints
the errors. The cost per tick is constant, and a step of any length is stable.
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.effects.added_mass import accelerate, follow_acceleration, storing_square
from study_app.haptics.kernels.known_force import STORAGE, solve_inertia
from study_app.haptics.kernels.vector import clear, copy, dot, norm, square
from study_app.haptics.model import laws
from study_app.haptics.model.effects.unsteady_drag import EXPONENTIALS, LATE_SHARE
from study_app.haptics.model.layout import GROWS_AS_SPEED, Record

MEMORY_LOSS = 0.268  # c_m
EXCESS_GAIN = 0.756  # c_y
WAKE_GAIN = 3.15  # c_z
FAR_WAKE_GAIN = 0.972  # c_s
OVERTAKING = 2.96  # β
OVERTAKING_REYNOLDS = 11.0  # R₀
RATES_PER_S = (0.0212334, 0.257773, 1.39978, 7.11516, 36.0112, 182.242, 927.902)  # k_i
WEIGHTS_RPS = (0.33973, 0.52101, 1.09144, 2.44114, 5.48942, 12.3529, 28.26937)  # b_i [1/√s]
_SLOW = 4  # number of exponentials driven by the velocity itself
_SHORT = 4.0  # `_mean` needs no exp up to this value
_NOTHING = 1e-30

_over_stokes = part(laws.finite_reynolds)


@part
def unsteady_drag_force(
    parameters: Record,
    liquid: Record,
    local: Record,
    state: Record,
    delay_ticks: int,
    interval_s: float,
    knows_force: bool,
) -> None:
    """Add F to the force, (3,) [N]; dw/dt is smoothed, as for the effects "added_mass" and "history".

    The fraction φ of the frontal area counts for drag, that of the volume for added mass and history. A body that
    enters the liquid in motion begins as if it had always moved so. The slope limit B bounds 3πµDw, and the rest of B
    bounds 3πµDy at 0.6 of the speed u: at w it would remove the push of a wake on a body at rest. y grows with the
    speed to the power of 1.7, so its slope is 1.7 times its secant: at the full speed, released handles of 100 g and
    less oscillated on a steady drift at scales of 10 and 20. Only the fractions of added mass and history that keep the
    loop stable are sent.
    """
    law, tracks, w = liquid.unsteady_drag, local.unsteady_drag, local.relative_mps
    if local.ticks == 0:
        _reset_tracks(law, tracks, w)
    wake2 = square(tracks.wake_mps)
    u_mps = math.sqrt(square(w) + wake2)
    if not knows_force:
        _smooth_accelerations(parameters, liquid, tracks, w, delay_ticks, interval_s)
    _update_wakes(law, tracks, w, u_mps, wake2, interval_s)
    for axis in range(3):
        local.damping_n[axis] = -law.stokes_nspm * w[axis] * local.frontal
        local.late_n[axis] = -law.stokes_nspm * tracks.excess_mps[axis] * local.frontal
    force_n = local.inertia_n[local.inertial]
    local.inertial += 1
    if knows_force:
        _add_implicit_inertia(parameters, law, local, state, u_mps, delay_ticks, interval_s, force_n)
    else:
        _update_memory(law, tracks, u_mps, interval_s, force_n)
        for axis in range(3):
            inertial = law.factor_kg_rs * force_n[axis] + law.mass_kg * tracks.acceleration_mps2[axis]
            force_n[axis] = -local.share * inertial
            state.force_n[axis] += local.damping_n[axis] + local.late_n[axis] + force_n[axis]
    copy(w, tracks.previous_mps)
    local.late_mps = LATE_SHARE * u_mps
    local.prompt_nspm = law.stokes_nspm * local.frontal
    state.growth = max(state.growth, GROWS_AS_SPEED)
    of_history_kg = 0.5 * law.factor_kg_rs * parameters.rules.history_rs
    stored_kg = (law.mass_kg + of_history_kg) * local.share
    if knows_force:
        state.returnable_j += 0.5 * STORAGE * local.inertia_share * stored_kg * square(local.motion_mps)
        return
    rate_per_s = liquid.smoothing_rate[delay_ticks] * law.filter_per_s
    square_m2ps2 = storing_square(parameters, local, tracks.smoothed_mps2, rate_per_s)
    state.returnable_j += 0.5 * liquid.inertia_share[delay_ticks] * stored_kg * square_m2ps2


@part
def _add_implicit_inertia(
    parameters: Record,
    law: Any,
    local: Record,
    state: Record,
    u_mps: float,
    delay_ticks: int,
    interval_s: float,
    force_n: Any,
) -> None:
    """Add drag and inertial forces with dw/dt of the known force; set ``force_n`` (3,) [N] to the inertial ones."""
    tracks, factor = local.unsteady_drag, local.share * law.factor_kg_rs
    _remember_velocity(law, tracks, local.relative_mps, u_mps, interval_s, tracks.remembered_mps2)
    for axis in range(3):
        force_n[axis] = -factor * tracks.remembered_mps2[axis]
        state.force_n[axis] += local.damping_n[axis] + local.late_n[axis] + force_n[axis]
    inertia_kg = local.share * law.mass_kg + factor * _young_weight(law, u_mps, interval_s)
    solve_inertia(parameters, state.kalman, state.force_n, inertia_kg, delay_ticks, tracks.acceleration_mps2)
    for axis in range(3):
        young_n = -inertia_kg * tracks.acceleration_mps2[axis]
        force_n[axis] += young_n
        state.force_n[axis] += young_n
    _remember_acceleration(law, tracks, u_mps, interval_s)
    follow_acceleration(tracks.smoothed_mps2, tracks.acceleration_mps2)
    follow_acceleration(tracks.history_smoothed_mps2, tracks.acceleration_mps2)


@part
def _smooth_accelerations(
    parameters: Record, liquid: Record, tracks: Record, w: Any, delay_ticks: int, interval_s: float
) -> None:
    """Smooth dw/dt for the added mass and for the history."""
    law, previous_mps = liquid.unsteady_drag, tracks.previous_mps
    lead, rate = parameters.smoothing_lead, liquid.smoothing_rate[delay_ticks]
    of_mass_per_s, of_history_per_s = rate * law.filter_per_s, rate * law.history_filter_per_s
    once_and_twice = tracks.history_smoothed_mps2
    accelerate(tracks.acceleration_mps2, tracks.smoothed_mps2, w, previous_mps, of_mass_per_s, lead, interval_s)
    accelerate(tracks.remembered_mps2, once_and_twice, w, previous_mps, of_history_per_s, lead, interval_s)


@part
def _reset_tracks(law: Any, tracks: Record, w: Any) -> None:
    """Begin at the present velocity, as if the motion had always been uniform."""
    excess = _over_stokes(law.reynolds_spm * norm(w)) - 1.0
    copy(w, tracks.previous_mps)
    for order in range(2):
        clear(tracks.smoothed_mps2[order])
        clear(tracks.history_smoothed_mps2[order])
    copy(w, tracks.wake_mps)
    copy(w, tracks.far_wake_mps)
    for axis in range(3):
        tracks.excess_mps[axis] = excess * w[axis]
        for i in range(EXPONENTIALS):
            tracks.memory_mps[i, axis] = 0.0


@part
def _update_wakes(law: Any, tracks: Record, w: Any, u_mps: float, wake2: float, interval_s: float) -> None:
    """Advance y, then z and s, by one step."""
    wake, far, excess = tracks.wake_mps, tracks.far_wake_mps, tracks.excess_mps
    far2 = square(far)
    overtaking = min(max(1.0 - dot(w, wake) / wake2, 0.0), 1.0) if wake2 > 0.0 else 0.0
    back = min(max(-dot(w, far) / far2, 0.0), 1.0) if far2 > 0.0 else 0.0
    reynolds = law.reynolds_spm * u_mps
    inertial = reynolds / (reynolds + OVERTAKING_REYNOLDS)
    overtaking *= inertial * OVERTAKING
    back *= inertial
    ex = w[0] - overtaking * wake[0] - back * far[0]
    ey = w[1] - overtaking * wake[1] - back * far[1]
    ez = w[2] - overtaking * wake[2] - back * far[2]
    ratio = _over_stokes(law.reynolds_spm * math.sqrt(ex * ex + ey * ey + ez * ez))
    x = u_mps * law.per_m * interval_s
    toward = EXCESS_GAIN * x * _mean(EXCESS_GAIN * x)
    excess[0] += toward * (ratio * ex - w[0] - excess[0])
    excess[1] += toward * (ratio * ey - w[1] - excess[1])
    excess[2] += toward * (ratio * ez - w[2] - excess[2])
    toward = WAKE_GAIN * x * _mean(WAKE_GAIN * x)
    toward_far = FAR_WAKE_GAIN * x * _mean(FAR_WAKE_GAIN * x)
    for axis in range(3):
        wake[axis] += toward * (w[axis] - wake[axis])
        far[axis] += toward_far * (w[axis] - far[axis])


@part
def _update_memory(law: Any, tracks: Record, u_mps: float, interval_s: float, history: Any) -> None:
    """Add dw/dt to the exponentials and let them decay; set ``history`` to Σ b_i m_i plus its remainder [m/s/√s]."""
    acceleration, memory = tracks.remembered_mps2, tracks.memory_mps
    loss_per_s = MEMORY_LOSS * u_mps * law.per_m
    hx = hy = hz = youngest = 0.0
    for i in range(EXPONENTIALS):
        x = (RATES_PER_S[i] + loss_per_s) * interval_s
        mean = _mean(x)
        keep, gained_s = 1.0 - x * mean, interval_s * mean
        mx = _cleared(keep * memory[i, 0] + gained_s * acceleration[0])
        my = _cleared(keep * memory[i, 1] + gained_s * acceleration[1])
        mz = _cleared(keep * memory[i, 2] + gained_s * acceleration[2])
        memory[i, 0], memory[i, 1], memory[i, 2] = mx, my, mz
        hx, hy, hz = hx + WEIGHTS_RPS[i] * mx, hy + WEIGHTS_RPS[i] * my, hz + WEIGHTS_RPS[i] * mz
        youngest += WEIGHTS_RPS[i] * gained_s
    lacking = 2.0 * math.sqrt(interval_s) - youngest
    history[0] = hx + lacking * acceleration[0]
    history[1] = hy + lacking * acceleration[1]
    history[2] = hz + lacking * acceleration[2]


@part
def _remember_velocity(law: Any, tracks: Record, w: Any, u_mps: float, interval_s: float, history: Any) -> None:
    """Let the exponentials decay and add Δw to the slow ones; set ``history`` to Σ b_i m_i [m/s/√s].

    The slow ones integrate over so long that they need no smoothing, which would distort them.
    """
    loss_per_s = MEMORY_LOSS * u_mps * law.per_m
    clear(history)
    for i in range(EXPONENTIALS):
        x = (RATES_PER_S[i] + loss_per_s) * interval_s
        mean = _mean(x)
        for axis in range(3):
            memory_mps = (1.0 - x * mean) * tracks.memory_mps[i, axis]
            if i < _SLOW:
                memory_mps += mean * (w[axis] - tracks.previous_mps[axis])
            memory_mps = _cleared(memory_mps)
            tracks.memory_mps[i, axis] = memory_mps
            history[axis] += WEIGHTS_RPS[i] * memory_mps


@part
def _young_weight(law: Any, u_mps: float, interval_s: float) -> float:
    """Return the weight of the newest dw/dt in the history beside that of the slow exponentials [√s]."""
    loss_per_s = MEMORY_LOSS * u_mps * law.per_m
    weight_rs = 2.0 * math.sqrt(interval_s)
    for i in range(_SLOW):
        weight_rs -= WEIGHTS_RPS[i] * interval_s * _mean((RATES_PER_S[i] + loss_per_s) * interval_s)
    return weight_rs


@part
def _remember_acceleration(law: Any, tracks: Record, u_mps: float, interval_s: float) -> None:
    """Add the newest dw/dt to the fast exponentials."""
    loss_per_s = MEMORY_LOSS * u_mps * law.per_m
    for i in range(_SLOW, EXPONENTIALS):
        gained_s = interval_s * _mean((RATES_PER_S[i] + loss_per_s) * interval_s)
        for axis in range(3):
            tracks.memory_mps[i, axis] += gained_s * tracks.acceleration_mps2[axis]


@part
def _mean(x: float) -> float:
    """Return (1 − e^(−x))/x, the mean of a decay over a step; up to x = 4 by 1/(1 + x/2 + x²/12)."""
    return 1.0 / (1.0 + x * (0.5 + x / 12.0)) if x <= _SHORT else -math.expm1(-x) / x


@part
def _cleared(value: float) -> float:
    """Return the value, or 0 if it has decayed to nearly 0."""
    return value if abs(value) > _NOTHING else 0.0

"""The acceleration of the handle from positions and the known force, so that inertia is not delayed feedback.

A force −M dw/dt from past positions acts too late: with a delay of some ticks, a loop with more liquid than handle
oscillates. But the fast part of the acceleration that the force itself causes is known before a position shows it. Per
axis a Kalman filter has four states, position, velocity, acceleration and jerk that the hand gives to the handle,
driven by white snap (the derivative of jerk); all axes share one covariance. The force, delayed by the assumed loop
delay, passes a high-pass filter of second order (``rules.fast_radps``, ``rules.fast_damping``), like the acceleration
of a mass that a spring and a damper hold; the response of the four states to it at 1 kg is computed beside them, and θ,
the inverse of the mass that the fast force moves, is estimated from the innovations, as in `estimators` (Friedland
1969). When the force F of this tick acts, the acceleration will be

    a = a_hand + θ (a_response + HP(F)),

with a_hand and a_response predicted over a part of the delay. With the other forces F₀ of this tick, F = F₀ − M a is
solved for a: the inertia is implicit. F₀ is compared with the force asked for in the last tick and not with the force
sent, so that a force that safety withholds does not count as a change.

A hand that lets go changes the acceleration faster than the filter learns of it, and θ would take the change for an
effect of the force. Such a surprise resets the motion. Afterwards, and after accelerations above a limit, inertial
forces are smoothed and limited for ``rules.unused_s`` as without the known force, which then returns within
``rules.regained_s``.
"""

from __future__ import annotations

from typing import Any, Final

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.vector import clear, copy, square
from study_app.haptics.model.layout import Record

STORAGE: Final = 3.0
"""Multiple of ½ M v² that an implicit inertial force may return: less took the force from fast strokes in firm hands,
where the velocity falls before the force does. [choice]"""
JERK_M2PS5: Final = 0.5
_JERK_OF_SPEED_PS3: Final = 2200.0
JERK_OF_ACCELERATION_PS: Final = 10.0
_MOST_JERK_M2PS5: Final = 20.0
"""Without this limit the filter was so fast in quick strokes that the loop oscillated at 40 to 60 Hz."""
_SNAP_PS2: Final = 3200.0
"""Ratio of the densities of snap and jerk [1/s²]."""
_AHEAD: Final = 0.4
"""Part of the delay over which the acceleration is predicted: the jerk is too uncertain for all of it."""
TIMING_S: Final = 20e-6
FIRST_SPEED_MPS: Final = 0.01
FIRST_ACCELERATION_MPS2: Final = 1.0
_FIRST_JERK_MPS3: Final = 10.0
_USUAL_SHARE: Final = 0.7
_LEAST_SHARE: Final = 0.05
"""θ times the least mass of the device: usual and least values."""
_FIRST_VARIANCE_PKG2: Final = 4.0
_MOST_VARIANCE_PKG2: Final = 25.0
LEARNING_PKG2S: Final = 10.0
"""Growth rate of the variance of θ [1/(kg² s)]."""
FORGETTING_S: Final = 2.0
"""Time in which θ returns to its usual value."""
_SURPRISED: Final = 1.5
"""Mean of Σ innovation² / its variance above which the known force is not used: no sine to 3 Hz reaches it, noise of
3 Hz in glycerin and honey at times. [choice]"""
_MOST_ACCELERATION_MPS2: Final = 15.0
"""Likewise of the handle: a sine of 3 Hz ±42 mm. In faster reversals the passivity controller interrupted the force."""
_NOTHING: Final = 1e-30


@part
def begin_known_force(parameters: Record, filtered: Record) -> None:
    """Reset motion and force."""
    for order in range(2):
        clear(filtered.late[order])
        clear(filtered.ahead[order])
    filtered.trust = 1.0
    _begin_motion(parameters, filtered)


@part
def _begin_motion(parameters: Record, filtered: Record) -> None:
    """Reset the motion to the estimated velocity without acceleration."""
    for state in range(4):
        clear(filtered.hand_motion[state])
        clear(filtered.response_motion[state])
    copy(filtered.estimate_mps, filtered.hand_motion[1])
    p = filtered.motion_covariance
    for i in range(10):
        p[i] = 0.0
    p[0] = 0.5 * parameters.count_m * parameters.count_m
    p[4] = FIRST_SPEED_MPS * FIRST_SPEED_MPS
    p[7] = FIRST_ACCELERATION_MPS2 * FIRST_ACCELERATION_MPS2
    p[9] = _FIRST_JERK_MPS3 * _FIRST_JERK_MPS3
    filtered.compliance_per_kg = _USUAL_SHARE / parameters.mass_kg
    filtered.compliance_variance = _FIRST_VARIANCE_PKG2


@part
def _feedthrough(rules: Record, interval_s: float) -> float:
    """Return the immediate response of the high-pass filter."""
    x = rules.fast_radps * interval_s
    return float(1.0 / (1.0 + x * (2.0 * rules.fast_damping + x)))


@part
def _pass_fast(rules: Record, passed: Any, force_n: float, axis: int, interval_s: float) -> float:
    """Pass a force through the high-pass filter, whose states are the integrals ``passed`` (2, 3) of its output."""
    fast_n = _feedthrough(rules, interval_s) * (force_n - _slow_part(rules, passed, axis))
    passed[0, axis] = _or_zero(passed[0, axis] + interval_s * fast_n)
    passed[1, axis] = _or_zero(passed[1, axis] + interval_s * passed[0, axis])
    return fast_n


@part
def _slow_part(rules: Record, passed: Any, axis: int) -> float:
    return float(rules.fast_radps * (2.0 * rules.fast_damping * passed[0, axis] + rules.fast_radps * passed[1, axis]))


@part
def track_motion(parameters: Record, state: Record, interval_s: float) -> float:
    """Predict and correct both motions by the newest position; return Σ innovation² / its variance over the axes."""
    filtered, rules = state.kalman, parameters.rules
    t, half, third = interval_s, 0.5 * interval_s * interval_s, interval_s * interval_s * interval_s / 6.0
    variance_m2 = _update_covariance(parameters, filtered, t, half, third)
    to_x, to_v, to_a, to_j = filtered.gains[0], filtered.gains[1], filtered.gains[2], filtered.gains[3]
    responses_m2 = products_m2 = squares_m2 = square_m2ps4 = 0.0
    hand, response, per_m = filtered.hand_motion, filtered.response_motion, 1.0 / parameters.scale
    for axis in range(3):
        a = filtered.acceleration_mps2[axis] + filtered.response_mps2[axis] * filtered.per_kg
        square_m2ps4 += a * a
        _pass_fast(rules, filtered.ahead, filtered.sent_n[axis], axis, parameters.period_s)
        fast_n = _pass_fast(rules, filtered.late, filtered.force_n[axis], axis, interval_s)
        step_m = (state.position_m[axis] - state.previous_m[axis]) * per_m
        v, a, j = hand[1, axis], hand[2, axis], hand[3, axis]
        offset_m = hand[0, axis] + t * v + half * a + third * j - step_m
        hand[0, axis] = _or_zero(offset_m - to_x * offset_m)
        hand[1, axis] = _or_zero(v + t * a + half * j - to_v * offset_m)
        hand[2, axis] = _or_zero(a + t * j - to_a * offset_m)
        hand[3, axis] = _or_zero(j - to_j * offset_m)
        left_m = -offset_m
        v, a, j = response[1, axis], response[2, axis], response[3, axis]
        offset_m = response[0, axis] + t * v + half * (a + fast_n) + third * j
        responses_m2 += offset_m * offset_m
        left_m -= offset_m * filtered.compliance_per_kg
        products_m2 += offset_m * left_m
        squares_m2 += left_m * left_m
        response[0, axis] = _or_zero(offset_m - to_x * offset_m)
        response[1, axis] = _or_zero(v + t * (a + fast_n) + half * j - to_v * offset_m)
        response[2, axis] = _or_zero(a + t * j - to_a * offset_m)
        response[3, axis] = _or_zero(j - to_j * offset_m)
    uncertain = filtered.compliance_variance
    gain = 0.0 if filtered.repeated else uncertain / (responses_m2 * uncertain + variance_m2)
    usual = _USUAL_SHARE / parameters.mass_kg
    per_kg = filtered.compliance_per_kg + gain * products_m2
    per_kg += (usual - per_kg) * t / FORGETTING_S
    filtered.compliance_per_kg = min(max(per_kg, _LEAST_SHARE / parameters.mass_kg), 1.0 / parameters.mass_kg)
    learned = uncertain - gain * uncertain * responses_m2 + LEARNING_PKG2S * t
    filtered.compliance_variance = min(learned, _MOST_VARIANCE_PKG2)
    if filtered.surprise > _SURPRISED:
        filtered.trust = -rules.unused_s / rules.regained_s
        _begin_motion(parameters, filtered)
        copy(filtered.sent_n, filtered.asked_n)
    elif square_m2ps4 > _MOST_ACCELERATION_MPS2 * _MOST_ACCELERATION_MPS2:
        filtered.trust = -rules.unused_s / rules.regained_s
    else:
        filtered.trust = min(filtered.trust + t / rules.regained_s, 1.0)
    return float(squares_m2 / (variance_m2 + responses_m2 * uncertain))


@part
def _update_covariance(parameters: Record, filtered: Record, t: float, half: float, third: float) -> float:
    """Predict and correct the covariance, set the gains, and return the variance of an innovation [m²]."""
    p, gains = filtered.motion_covariance, filtered.gains
    xx = p[0] + t * p[1] + half * p[2] + third * p[3]
    xv = p[1] + t * p[4] + half * p[5] + third * p[6]
    xa = p[2] + t * p[5] + half * p[7] + third * p[8]
    xj = p[3] + t * p[6] + half * p[8] + third * p[9]
    vv = p[4] + t * p[5] + half * p[6]
    va = p[5] + t * p[7] + half * p[8]
    vj = p[6] + t * p[8] + half * p[9]
    aa = p[7] + t * p[8]
    aj = p[8] + t * p[9]
    jj = p[9]
    speed_m2ps2 = square(filtered.estimate_mps)
    jerk_m2ps5 = JERK_M2PS5 + _JERK_OF_SPEED_PS3 * speed_m2ps2
    jerk_m2ps5 += JERK_OF_ACCELERATION_PS * square(filtered.hand_motion[2])
    jerk_m2ps5 = min(jerk_m2ps5, _MOST_JERK_M2PS5)
    snap = _SNAP_PS2 * jerk_m2ps5
    xx += t * xv + half * xa + third * xj
    xv += t * xa + half * xj
    xa += t * xj
    vv += t * va + half * vj
    va += t * vj
    aa += t * aj + snap * t * half * (2.0 / 3.0)
    aj += snap * half
    jj += snap * t
    variance_m2 = xx + 0.5 * parameters.count_m * parameters.count_m + TIMING_S * TIMING_S * speed_m2ps2
    measured = 0.0 if filtered.repeated else 1.0 / variance_m2
    to_x, to_v, to_a, to_j = measured * xx, measured * xv, measured * xa, measured * xj
    p[0], p[1], p[2], p[3] = xx - to_x * xx, xv - to_x * xv, xa - to_x * xa, xj - to_x * xj
    p[4], p[5], p[6] = vv - to_v * xv, va - to_v * xa, vj - to_v * xj
    p[7], p[8], p[9] = aa - to_a * xa, aj - to_a * xj, jj - to_j * xj
    gains[0], gains[1], gains[2], gains[3] = to_x, to_v, to_a, to_j
    return float(variance_m2)


@part
def solve_inertia(
    parameters: Record, filtered: Record, others_n: Any, inertia_kg: float, delay_ticks: int, acceleration_mps2: Any
) -> None:
    """Set dw/dt (3,) [m/s², scene] when the force of this tick acts: F = F₀ − M dw/dt, with ``others_n`` (3,) F₀."""
    lead_s = _AHEAD * parameters.period_s * (delay_ticks + 0.5)
    rules, per_kg = parameters.rules, filtered.compliance_per_kg
    passed = _feedthrough(rules, parameters.period_s)
    hand, response = filtered.hand_motion, filtered.response_motion
    own = parameters.scale * per_kg * passed
    for axis in range(3):
        known_mps2 = hand[2, axis] + lead_s * hand[3, axis]
        response_mps2 = response[2, axis] + lead_s * response[3, axis]
        changed_n = filtered.sent_n[axis] - filtered.asked_n[axis]
        response_mps2 += passed * (changed_n - _slow_part(rules, filtered.ahead, axis))
        known_mps2 = parameters.scale * (known_mps2 + per_kg * response_mps2)
        acceleration_mps2[axis] = (known_mps2 + own * others_n[axis]) / (1.0 + own * inertia_kg)


@part
def _or_zero(value: float) -> float:
    return value if abs(value) > _NOTHING else 0.0

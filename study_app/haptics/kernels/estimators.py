"""The velocity that the liquids act on, from positions: estimator, then compression of high speeds.

The Kalman filter of velocity uses the sent force and estimates the mass that the force moves.

Per axis the state is position, velocity and acceleration, driven by white jerk of density q that grows with speed and
acceleration, and where innovations exceed their variance; all axes share one covariance. The force, delayed by the
assumed loop delay, passes two high-pass filters, since only its fast part surely accelerates the device's mass and not
the hand. Its effect is the state's response V to it at 1 kg, times the inverse mass θ, estimated separately: a
two-stage filter (Friedland 1969, IEEE TAC 14:359). So the estimate lags neither behind the hand nor behind the effect
of the force on the handle.

If the position is unchanged although the handle must have moved, the device repeated a sample: it is skipped, but a
second one in a row is used. Innovations far outside their variance for 20 ms, or a change of the delay, are a fault:
from that tick on the estimate is that of EWMA, which runs in parallel, and after a second without a fault the filter's
again. Their difference then is added and fades out, so that the estimate does not jump.

Vibrations at 10 to 60 Hz, such as those of gears, change the acceleration faster than the filter assumes, and its
velocity overshoots. Its lead (its velocity less the mean of EWMA's last two) is therefore checked at every fourth
sample. The mean velocity over eight samples shows the error of the filter's velocity in their middle. The regression of
this error on the lead is the false fraction of the lead. A multiple of the excess over the tolerated one is subtracted.
"""

from __future__ import annotations

import math
from typing import Any, Final

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.known_force import begin_known_force, track_motion
from study_app.haptics.kernels.vector import clear, copy, norm, square
from study_app.haptics.model import estimators
from study_app.haptics.model.layout import COMPRESSION_SQRT, COMPRESSION_SQUARE, Record

JERK_M2PS5: Final = 0.5
JERK_OF_ACCELERATION_PS: Final = 10.0
JERK_OF_SURPRISE_M2PS5: Final = 300.0
SURPRISE: Final = 4.0
"""Mean of Σ innovation² / its variance above which the jerk is raised: a reach that begins within 50 ms at rest."""
TIMING_S: Final = 20e-6
"""Standard deviation of a sample's time [s]."""
CORNER_RADPS: Final = 2.0 * math.pi * 6.0
"""Corner frequency of both high-pass filters [rad/s]."""
USUAL_PER_KG: Final = 1.5
LEARNING_PKG2S: Final = 10.0
"""Growth rate of the variance of θ [1/(kg² s)]."""
FORGETTING_S: Final = 0.5
"""Rate at which θ returns to its usual value."""
FIRST_SPEED_MPS: Final = 0.01
FIRST_ACCELERATION_MPS2: Final = 1.0

TROUBLE: Final = 16.0
"""Mean of Σ innovation² / its variance over three axes above which it is far outside; single ones count up to twice
this."""
REPEATED: Final = 9.0
"""Innovation² / its variance above which an unchanged position counts as a repeated sample."""
TROUBLE_S: Final = 20e-3
"""Time over which that mean is taken [s]."""
_QUIET_S: Final = 1.0
CHECKED_S: Final = 0.4
"""Time over which the false fraction of the lead is averaged [s]."""
LEAST_LEAD_S: Final = 0.04
"""A lead of about one count in this time, or less, is too small to be checked [s]."""
_CARRIED_S: Final = 10e-3
_NOTHING: Final = 1e-30
"""Smaller values become 0, since denormal numbers would slow arithmetic down [SI units]."""


@part
def reset_estimator(parameters: Record, state: Record) -> None:
    """Reset the estimate: the velocity is 0, since one position does not determine it, unless it is measured."""
    if parameters.estimator not in (estimators.GIVEN, estimators.DEVICE):
        clear(state.estimate_mps)
    if parameters.estimator == estimators.KALMAN:
        begin_filter(parameters, state.kalman)


@part
def estimate_velocity(parameters: Record, state: Record, interval_s: float) -> None:
    """Update ``state.estimate_mps`` and ``state.velocity_mps`` to the newest position, Δt after the one before."""
    if parameters.estimator == estimators.EWMA:
        _ewma(parameters, state, state.estimate_mps, interval_s)
    elif parameters.estimator == estimators.KALMAN:
        _ewma(parameters, state, state.kalman.smoothed_mps, interval_s)
        filter_velocity(parameters, state, interval_s)
    elif parameters.estimator == estimators.RAW:
        for axis in range(3):
            state.estimate_mps[axis] = (state.position_m[axis] - state.previous_m[axis]) / interval_s
    _compress_speed(parameters, state)


@part
def _ewma(parameters: Record, state: Record, velocity_mps: Any, interval_s: float) -> None:
    """Move ``velocity_mps`` (3,) to the newest difference u = Δp/Δt: v ← v + α(Δt)(u − v) (Rek 2024, §4.2).

    α(Δt) = 1 − (1 − α)^(Δt/1 ms) makes it the same filter at any rate; α is recomputed only if Δt changes. At rest the
    estimate becomes exactly 0: arithmetic on denormal numbers is slow.
    """
    if interval_s != state.weighted_s:
        state.weighted_s = interval_s
        state.weight = -math.expm1(parameters.log_keep_per_s * interval_s)
    weight, per_s = state.weight, 1.0 / interval_s
    for axis in range(3):
        difference_mps = (state.position_m[axis] - state.previous_m[axis]) * per_s
        estimate_mps = velocity_mps[axis] + weight * (difference_mps - velocity_mps[axis])
        velocity_mps[axis] = estimate_mps if abs(estimate_mps) > _NOTHING else 0.0


@part
def _compress_speed(parameters: Record, state: Record) -> None:
    """Lower speeds above the threshold and keep the direction; the estimate itself is unchanged.

    ``sqrt`` has unit slope at the threshold: s' = s0 + √(1 + 2(s − s0)) − 1 with s, s0 in m/s. ``square`` is the
    literal "squaring the part above" of Rek 2024, which raises any excess over 1 m/s.
    """
    share = 1.0
    if square(state.estimate_mps) > parameters.compression_threshold_mps * parameters.compression_threshold_mps:
        speed_mps = norm(state.estimate_mps)
        excess_mps = speed_mps - parameters.compression_threshold_mps
        if parameters.compression_law == COMPRESSION_SQRT:
            share = (parameters.compression_threshold_mps + math.sqrt(1.0 + 2.0 * excess_mps) - 1.0) / speed_mps
        elif parameters.compression_law == COMPRESSION_SQUARE:
            share = (parameters.compression_threshold_mps + excess_mps * excess_mps) / speed_mps
    for axis in range(3):
        state.velocity_mps[axis] = share * state.estimate_mps[axis]


@part
def begin_filter(parameters: Record, filtered: Record) -> None:
    """Reset motion and force; use the filter."""
    for axis in range(3):
        filtered.passed_n[axis] = filtered.input_n[axis] = 0.0
        filtered.offset_m[axis] = filtered.velocity_mps[axis] = filtered.acceleration_mps2[axis] = 0.0
        filtered.response_m[axis] = filtered.response_mps[axis] = filtered.response_mps2[axis] = 0.0
        filtered.estimate_mps[axis] = filtered.smoothed_mps[axis] = filtered.carried_mps[axis] = 0.0
        filtered.smoothed_before_mps[axis] = 0.0
    copy(filtered.force_n, filtered.before_n)
    begin_known_force(parameters, filtered)
    filtered.covariance[0] = 0.5 * parameters.count_m * parameters.count_m
    filtered.covariance[1] = filtered.covariance[2] = filtered.covariance[4] = 0.0
    filtered.covariance[3] = FIRST_SPEED_MPS * FIRST_SPEED_MPS
    filtered.covariance[5] = FIRST_ACCELERATION_MPS2 * FIRST_ACCELERATION_MPS2
    filtered.per_kg = min(USUAL_PER_KG, 1.0 / parameters.mass_kg)
    filtered.per_kg_variance = 0.25 * USUAL_PER_KG * USUAL_PER_KG
    filtered.on_ewma = 0
    filtered.delay_ticks = filtered.assumed_ticks
    filtered.surprise = 0.0
    filtered.quiet_s = 0.0
    filtered.repeated = 0
    filtered.samples = 0
    filtered.elapsed_s = filtered.lead_m2ps2 = filtered.false_lead_m2ps2 = filtered.false_share = 0.0


@part
def take_force(parameters: Record, state: Record, safety: Record) -> None:
    """Give the Kalman filter the mean force that acted since the last sample, delayed by the assumed loop delay."""
    if parameters.estimator != estimators.KALMAN:
        return
    passivity, filtered = safety.passivity, state.kalman
    sent_n = passivity.acted_n[passivity.row]
    late = passivity.row - safety.delay_ticks
    late_n = passivity.acted_n[late if late >= 0 else late + passivity.acted_n.shape[0]]
    lasted_s = passivity.impulse_s + safety.tick_s
    for axis in range(3):
        filtered.sent_n[axis] = sent_n[axis]
        filtered.asked_n[axis] = state.force_n[axis] - state.lift_n[axis]
        filtered.force_n[axis] = late_n[axis]
        if lasted_s > 0.0:
            filtered.force_n[axis] = (passivity.acted_impulse_ns[axis] + late_n[axis] * safety.tick_s) / lasted_s
    filtered.assumed_ticks = safety.delay_ticks


@part
def filter_velocity(parameters: Record, state: Record, interval_s: float) -> None:
    """Update ``state.estimate_mps`` to the newest position; EWMA's estimate is already in ``smoothed_mps``."""
    filtered = state.kalman
    _filter_force(filtered, interval_s)
    ratio = _correct(parameters, state, filtered, interval_s)
    on_ewma = _needs_ewma(filtered, ratio, interval_s)
    if filtered.assumed_ticks >= parameters.known_force_ticks:
        track_motion(parameters, state, interval_s)
        if on_ewma:
            filtered.trust = min(filtered.trust, 0.0)
    filtered.samples += 1
    filtered.elapsed_s += interval_s
    if filtered.samples & 3 == 0 and parameters.rules.false_lead_gain > 0.0:
        _check_lead(parameters, state, filtered)
    share = interval_s / _CARRIED_S
    kept = 1.0 - share / (1.0 + share * (0.5 + share / 12.0))
    for axis in range(3):
        source_mps = filtered.smoothed_mps[axis] if on_ewma else parameters.scale * filtered.estimate_mps[axis]
        if filtered.false_share > 0.0 and not on_ewma:
            source_mps -= filtered.false_share * _lead_mps(parameters, filtered, axis)
        filtered.smoothed_before_mps[axis] = filtered.smoothed_mps[axis]
        if on_ewma != filtered.on_ewma:
            filtered.carried_mps[axis] = state.estimate_mps[axis] - source_mps
        else:
            filtered.carried_mps[axis] = _or_zero(kept * filtered.carried_mps[axis])
        state.estimate_mps[axis] = source_mps + filtered.carried_mps[axis]
    filtered.on_ewma = on_ewma


@part
def _filter_force(filtered: Record, interval_s: float) -> None:
    """Pass the force through two high-pass filters of first order."""
    x = CORNER_RADPS * interval_s
    kept = 1.0 - x / (1.0 + x * (0.5 + x / 12.0))  # exp(-x) to 1e-4 over ten milliseconds
    for axis in range(3):
        force_n, passed_n = filtered.force_n[axis], filtered.passed_n[axis]
        once_n = _or_zero(kept * (passed_n + force_n - filtered.before_n[axis]))
        filtered.input_n[axis] = _or_zero(kept * (filtered.input_n[axis] + once_n - passed_n))
        filtered.passed_n[axis] = once_n
        filtered.before_n[axis] = force_n


@part
def _correct(parameters: Record, state: Record, filtered: Record, interval_s: float) -> float:
    """Predict and correct state, response and inverse mass; return Σ innovation² / its variance over the axes."""
    t, half = interval_s, 0.5 * interval_s * interval_s
    speed_m2ps2 = square(filtered.estimate_mps)
    excess = max(filtered.surprise - SURPRISE, 0.0)
    of_speed_ps3 = parameters.rules.jerk_of_speed_ps3
    jerk_m2ps5 = JERK_M2PS5 + of_speed_ps3 * speed_m2ps2 + JERK_OF_SURPRISE_M2PS5 * excess * excess
    jerk_m2ps5 += JERK_OF_ACCELERATION_PS * square(filtered.acceleration_mps2)
    qt = jerk_m2ps5 * t
    qh = jerk_m2ps5 * half
    p = filtered.covariance
    pv, pa, va = p[1] + t * p[3] + half * p[4], p[2] + t * p[4] + half * p[5], p[4] + t * p[5]
    pp = p[0] + t * p[1] + half * p[2] + t * pv + half * pa + 0.2 * half * half * qt
    vv = p[3] + t * p[4] + t * va + t * qh * (2.0 / 3.0)
    pv += t * pa + 0.5 * half * qh
    pa += t * qh / 3.0
    va += qh
    aa = p[5] + qt

    variance_m2 = pp + 0.5 * parameters.count_m * parameters.count_m + TIMING_S * TIMING_S * speed_m2ps2
    measured = 1.0
    if filtered.repeated:
        filtered.repeated = 0
    elif _repeats(parameters, state, filtered, t, variance_m2):
        filtered.repeated = 1
        measured = 0.0
    to_p, to_v, to_a = measured * pp / variance_m2, measured * pv / variance_m2, measured * pa / variance_m2
    p[0], p[1], p[2] = pp * (1.0 - to_p), pv * (1.0 - to_p), pa * (1.0 - to_p)
    p[3], p[4], p[5] = vv - to_v * pv, va - to_v * pa, aa - to_a * pa

    responses_m2 = products_m2 = squares_m2 = 0.0
    per_m = 1.0 / parameters.scale
    for axis in range(3):
        v, a = filtered.velocity_mps[axis], filtered.acceleration_mps2[axis]
        step_m = (state.position_m[axis] - state.previous_m[axis]) * per_m
        offset_m = filtered.offset_m[axis] + t * v + half * a - step_m
        filtered.offset_m[axis] = _or_zero(offset_m - to_p * offset_m)
        filtered.velocity_mps[axis] = _or_zero(v + t * a - to_v * offset_m)
        filtered.acceleration_mps2[axis] = _or_zero(a - to_a * offset_m)
        rv, ra, input_n = filtered.response_mps[axis], filtered.response_mps2[axis], filtered.input_n[axis]
        response_m = filtered.response_m[axis] + t * rv + half * (ra + input_n)
        filtered.response_m[axis] = _or_zero(response_m - to_p * response_m)
        filtered.response_mps[axis] = _or_zero(rv + t * (ra + input_n) - to_v * response_m)
        filtered.response_mps2[axis] = _or_zero(ra - to_a * response_m)
        left_m = -offset_m - response_m * filtered.per_kg
        responses_m2 += response_m * response_m
        products_m2 += response_m * left_m
        squares_m2 += left_m * left_m

    uncertain = filtered.per_kg_variance
    gain = measured * uncertain / (responses_m2 * uncertain + variance_m2)
    per_kg = filtered.per_kg + gain * products_m2
    per_kg += (USUAL_PER_KG - per_kg) * t / FORGETTING_S
    filtered.per_kg = min(max(per_kg, 0.0), 1.0 / parameters.mass_kg)
    filtered.per_kg_variance = uncertain - gain * uncertain * responses_m2 + LEARNING_PKG2S * t
    for axis in range(3):
        filtered.estimate_mps[axis] = filtered.velocity_mps[axis] + filtered.response_mps[axis] * filtered.per_kg
    return float(measured * squares_m2 / (variance_m2 + responses_m2 * uncertain))


@part
def _repeats(parameters: Record, state: Record, filtered: Record, t: float, variance_m2: float) -> bool:
    """Return whether a sample repeats the last one although the predicted motion far exceeds its uncertainty."""
    half, squares_m2 = 0.5 * t * t, 0.0
    for axis in range(3):
        if state.position_m[axis] != state.previous_m[axis]:
            return False
        response_m = filtered.response_m[axis] + t * filtered.response_mps[axis]
        response_m += half * (filtered.response_mps2[axis] + filtered.input_n[axis])
        left_m = filtered.offset_m[axis] + t * filtered.velocity_mps[axis] + half * filtered.acceleration_mps2[axis]
        left_m += response_m * filtered.per_kg
        squares_m2 += left_m * left_m
    return squares_m2 > REPEATED * variance_m2


@part
def _needs_ewma(filtered: Record, ratio: float, interval_s: float) -> int:
    """Return 1 if this tick uses EWMA, 0 if it uses the filter."""
    share = interval_s / TROUBLE_S
    weight = share / (1.0 + share * (0.5 + share / 12.0))
    filtered.surprise += weight * (min(ratio, 2.0 * TROUBLE) - filtered.surprise)
    filtered.quiet_s += interval_s
    if filtered.surprise > TROUBLE or filtered.delay_ticks != filtered.assumed_ticks:
        filtered.quiet_s = 0.0
        filtered.delay_ticks = filtered.assumed_ticks
        return 1
    return 1 if filtered.on_ewma and filtered.quiet_s < _QUIET_S else 0


@part
def _lead_mps(parameters: Record, filtered: Record, axis: int) -> float:
    """Return the filter's velocity less the mean of EWMA's last two [m/s, scene]."""
    smoothed_mps = 0.5 * (filtered.smoothed_mps[axis] + filtered.smoothed_before_mps[axis])
    return float(parameters.scale * filtered.estimate_mps[axis] - smoothed_mps)


@part
def _check_lead(parameters: Record, state: Record, filtered: Record) -> None:
    """Update the false fraction of the lead from the position eight samples ago, velocity and lead four samples ago."""
    number = filtered.samples >> 2
    first, middle = filtered.checked[number & 1], filtered.checked[(number + 1) & 1]
    if number > 2:
        duration_s = filtered.elapsed_s - first[9]
        per_s = 1.0 / duration_s
        leads_m2ps2 = false_m2ps2 = 0.0
        for axis in range(3):
            lead_mps = middle[6 + axis]
            leads_m2ps2 += lead_mps * lead_mps
            false_m2ps2 += lead_mps * (middle[3 + axis] - per_s * (state.position_m[axis] - first[axis]))
        weight = duration_s / (2.0 * CHECKED_S + duration_s)
        leads_m2ps2 = _or_zero(filtered.lead_m2ps2 + weight * (leads_m2ps2 - filtered.lead_m2ps2))
        false_m2ps2 = _or_zero(filtered.false_lead_m2ps2 + weight * (false_m2ps2 - filtered.false_lead_m2ps2))
        filtered.lead_m2ps2, filtered.false_lead_m2ps2 = leads_m2ps2, false_m2ps2
        least_mps = parameters.scale * parameters.count_m / LEAST_LEAD_S
        share = false_m2ps2 / (leads_m2ps2 + least_mps * least_mps) - parameters.rules.tolerated_false_lead
        filtered.false_share = min(max(parameters.rules.false_lead_gain * share, 0.0), 1.0)
    for axis in range(3):
        first[axis] = state.position_m[axis]
        first[3 + axis] = parameters.scale * filtered.estimate_mps[axis]
        first[6 + axis] = _lead_mps(parameters, filtered, axis)
    first[9] = filtered.elapsed_s


@part
def _or_zero(value: float) -> float:
    return value if abs(value) > _NOTHING else 0.0

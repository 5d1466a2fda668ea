"""The velocity that the liquids act on, from positions: estimator, then speed limiter (knee)."""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.estimators.kalman import begin_filter, filter_velocity
from study_app.haptics.kernels.estimators.lead import add_lead, begin_lead
from study_app.haptics.kernels.vector import clear, copy, norm, square
from study_app.haptics.model.estimators import device, ewma, foaw, given, kalman, lead, line, raw
from study_app.haptics.model.layout import KNEE_SQRT, KNEE_SQUARE, Record

TIE = 1e-9
NOTHING_MPS = 1e-30


@part
def reset_estimator(parameters: Record, state: Record) -> None:
    """Reset the estimate: the velocity is 0, since one position does not determine it, unless it is measured."""
    if parameters.estimator not in (given.CODE, device.CODE):
        clear(state.estimate_mps)
        state.window_held = 0
    if parameters.estimator == kalman.CODE:
        begin_filter(parameters, state.kalman)
    elif parameters.estimator == lead.CODE:
        begin_lead(state.lead)


@part
def estimate_velocity(parameters: Record, state: Record, window: Any, interval_s: float) -> None:
    """Bring ``state.estimate_mps`` and ``state.velocity_mps`` to the newest position, Δt after the one before."""
    if parameters.estimator == ewma.CODE:
        _ewma(parameters, state, state.estimate_mps, interval_s)
    elif parameters.estimator == kalman.CODE:
        _ewma(parameters, state, state.kalman.smoothed_mps, interval_s)
        filter_velocity(parameters, state, interval_s)
    elif parameters.estimator == lead.CODE:
        _ewma(parameters, state, state.lead.smoothed_mps, interval_s)
        add_lead(state, state.lead, interval_s)
    elif parameters.estimator == line.CODE:
        _store_sample(parameters, state, window, interval_s)
        _line(parameters, state, window)
    elif parameters.estimator == foaw.CODE:
        _store_sample(parameters, state, window, interval_s)
        _foaw(parameters, state, window)
    elif parameters.estimator == raw.CODE:
        _raw(state, interval_s)
    _knee(parameters, state)


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
        velocity_mps[axis] = estimate_mps if abs(estimate_mps) > NOTHING_MPS else 0.0


@part
def _raw(state: Record, interval_s: float) -> None:
    """Take the newest difference Δp/Δt."""
    for axis in range(3):
        state.estimate_mps[axis] = (state.position_m[axis] - state.previous_m[axis]) / interval_s


@part
def _store_sample(parameters: Record, state: Record, window: Any, interval_s: float) -> None:
    """Add the newest sample to the window, replacing the oldest if it is full, and update their ages."""
    samples = parameters.window_samples
    state.window_newest = (state.window_newest + 1) % samples
    state.window_held = min(state.window_held + 1, samples)
    newest = window[state.window_newest]
    copy(state.position_m, newest.position_m)
    newest.interval_s = interval_s
    age_s = 0.0
    for back in range(state.window_held):
        row = _back(parameters, state, window, back)
        row.age_s = age_s
        age_s += row.interval_s


@part
def _back(parameters: Record, state: Record, window: Any, back: int) -> Any:
    """Return the sample ``back`` samples before the newest."""
    return window[(state.window_newest + parameters.window_samples - back) % parameters.window_samples]


@part
def _line(parameters: Record, state: Record, window: Any) -> None:
    """Set the slope of the least-squares line through the samples: v = Σ(t − t̄)p / Σ(t − t̄)², with measured times."""
    mean_s = squares_s2 = 0.0
    for back in range(state.window_held):
        mean_s += _back(parameters, state, window, back).age_s / state.window_held
    for back in range(state.window_held):
        squares_s2 += (_back(parameters, state, window, back).age_s - mean_s) ** 2
    clear(state.estimate_mps)
    for back in range(1, state.window_held):
        row = _back(parameters, state, window, back)
        weight = (mean_s - row.age_s) / squares_s2
        for axis in range(3):
            state.estimate_mps[axis] += weight * (row.position_m[axis] - state.position_m[axis])


@part
def _foaw(parameters: Record, state: Record, window: Any) -> None:
    """Set the slope of the best-fit line through as many samples as lie along it.

    First-order adaptive windowing (Janabi-Sharifi, Hayward & Chen 2000, IEEE TCST 8:1003, best-fit): starting with the
    newest two samples, one more is added while every sample in between lies within the tolerance of the line through
    the newest one with the least-squares slope. Distances are Euclidean, so one window serves all axes and no direction
    is preferred. [choice]
    """
    clear(state.estimate_mps)
    ages_s = squares_s2 = 0.0
    sx = sy = sz = tx = ty = tz = 0.0  # Σ p and Σ age · p, p relative to the newest
    for back in range(1, state.window_held):
        row = _back(parameters, state, window, back)
        px = row.position_m[0] - state.position_m[0]
        py = row.position_m[1] - state.position_m[1]
        pz = row.position_m[2] - state.position_m[2]
        ages_s += row.age_s
        squares_s2 += row.age_s * row.age_s
        sx, sy, sz = sx + px, sy + py, sz + pz
        tx, ty, tz = tx + row.age_s * px, ty + row.age_s * py, tz + row.age_s * pz
        count = back + 1
        spread_s2 = count * squares_s2 - ages_s * ages_s
        vx = (ages_s * sx - count * tx) / spread_s2
        vy = (ages_s * sy - count * ty) / spread_s2
        vz = (ages_s * sz - count * tz) / spread_s2
        if not _is_along(parameters, state, window, back, vx, vy, vz):
            return
        state.estimate_mps[0], state.estimate_mps[1], state.estimate_mps[2] = vx, vy, vz


@part
def _is_along(parameters: Record, state: Record, window: Any, until: int, vx: float, vy: float, vz: float) -> bool:
    """Return whether the samples between the newest and ``until`` lie along the line of this slope.

    Encoder counts often deviate by exactly the tolerance: that counts as within it, despite rounding.
    """
    most_m2 = parameters.tolerance_m * parameters.tolerance_m * (1.0 + TIE)
    for back in range(1, until):
        row = _back(parameters, state, window, back)
        dx = row.position_m[0] - state.position_m[0] + vx * row.age_s
        dy = row.position_m[1] - state.position_m[1] + vy * row.age_s
        dz = row.position_m[2] - state.position_m[2] + vz * row.age_s
        if dx * dx + dy * dy + dz * dz > most_m2:
            return False
    return True


@part
def _knee(parameters: Record, state: Record) -> None:
    """Lower speeds above the threshold and keep the direction; the estimate itself is unchanged.

    ``sqrt`` has unit slope at the threshold: s' = s0 + √(1 + 2(s − s0)) − 1 with s, s0 in m/s. ``square`` is the
    literal "squaring the part above" of Rek 2024, which raises any excess over 1 m/s.
    """
    share = 1.0
    if square(state.estimate_mps) > parameters.knee_threshold_mps * parameters.knee_threshold_mps:
        speed_mps = norm(state.estimate_mps)
        excess_mps = speed_mps - parameters.knee_threshold_mps
        if parameters.knee_law == KNEE_SQRT:
            share = (parameters.knee_threshold_mps + math.sqrt(1.0 + 2.0 * excess_mps) - 1.0) / speed_mps
        elif parameters.knee_law == KNEE_SQUARE:
            share = (parameters.knee_threshold_mps + excess_mps * excess_mps) / speed_mps
    for axis in range(3):
        state.velocity_mps[axis] = share * state.estimate_mps[axis]

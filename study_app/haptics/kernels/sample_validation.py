"""Validation of samples and of the time between them: implausible ones do not reach the model."""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.vector import copy, norm, square, square_distance
from study_app.haptics.model import layout
from study_app.haptics.model.estimators import DEVICE

_SHORTEST_S = 0.2e-3
_LONGEST_S = 20e-3
_FASTEST_HAND_MPS = 10.0
_FARTHEST_HAND_M = 10.0
_REFUSALS_IN_A_ROW = 5
_COUNTS = 2.0
"""Encoder counts by which two steps may differ at rest."""
_CERTAIN_SHARE = 0.999
"""Fraction of the square of a limit up to which no rounding error can exceed the limit."""
_STALE_NS = 5_000_000
FAULT_NS = 50_000_000


@part
def clamp(interval_s: float) -> float:
    """Return the time between two samples, limited to the range of the model [s]."""
    return min(max(interval_s, _SHORTEST_S), _LONGEST_S)


@part
def accept_sample(
    parameters: layout.Record, state: layout.Record, safety: layout.Record, sample: layout.Record
) -> float:
    """Take the sample's position into the scene and return Δt [s], or 0 if no sample is accepted.

    Δt is the time since the last accepted sample, so that the next one covers any gap; the first takes the nominal
    period. A position is rejected if it is not finite, lies more than 10 m from the device's middle along an axis, or
    cannot be reached at 10 m/s within Δt; if the device measures velocity, also without one of at most 10 m/s along
    each axis. From the third sample on, it is also rejected if no hand can have accelerated so much (`_within_reach`).
    After five rejections in a row tracking is lost: the next plausible position resets estimator and wakes. A position
    out of reach after a gap is accepted, but does so, too, since the device's zero may be another; the force fades in.
    A rejected position that the device repeats is marked as rejected.
    """
    if sample.fresh == 0:
        if state.rejected > 0:
            sample.limiters |= layout.LIMITER_GLITCH
        return 0.0
    interval_s: float = parameters.period_s
    if state.tracking:
        interval_s = clamp((sample.time_ns - state.accepted_ns) * 1e-9)
    if not _plausible(parameters, state, safety, sample, interval_s):
        sample.limiters |= layout.LIMITER_GLITCH
        state.rejected += 1
        if state.rejected == _REFUSALS_IN_A_ROW:
            state.tracking = 0
            safety.withheld |= layout.LIMITER_GLITCH
        return 0.0
    hand_m = sample.position_m
    if is_gap(parameters, interval_s) and not _within_reach(parameters, state, 0.0, 0.0, hand_m, interval_s):
        state.tracking = 0
        safety.fade = 0.0
    _note_step(state, hand_m, interval_s)
    copy(hand_m, state.hand_m)
    place(state, *_in_scene(parameters, hand_m))
    if parameters.estimator == DEVICE:
        for axis in range(3):
            state.estimate_mps[axis] = parameters.scale * sample.device_velocity_mps[axis]
    state.rejected = 0
    state.accepted_ns = sample.time_ns
    safety.usable_ns = sample.time_ns
    return interval_s


@part
def place(state: layout.Record, x_m: float, y_m: float, z_m: float) -> None:
    """Move the body to a place of the scene; without tracking, the previous place is the same."""
    copy(state.position_m, state.previous_m)
    state.position_m[0] = x_m
    state.position_m[1] = y_m
    state.position_m[2] = z_m
    if state.tracking == 0:
        copy(state.position_m, state.previous_m)


@part
def _in_scene(parameters: layout.Record, hand_m: Any) -> tuple[float, float, float]:
    scale, origin_m = parameters.scale, parameters.origin_m
    return scale * hand_m[0] + origin_m[0], scale * hand_m[1] + origin_m[1], scale * hand_m[2] + origin_m[2]


@part
def _plausible(
    parameters: layout.Record, state: layout.Record, safety: layout.Record, sample: layout.Record, interval_s: float
) -> bool:
    """Return whether the position is plausible for a hand, and within reach of the last accepted one."""
    hand_m = sample.position_m
    for axis in range(3):
        if not abs(hand_m[axis]) <= _FARTHEST_HAND_M:  # also rejects NaN
            return False
    if parameters.estimator == DEVICE and not _has_velocity(sample):
        return False
    if state.tracking == 0:
        return True
    if not can_have_moved(state.hand_m, hand_m, interval_s):
        return False
    if is_gap(parameters, interval_s) or _within_reach(parameters, state, 0.0, 0.0, hand_m, interval_s):
        return True
    square_n2 = 0.0
    for row in range(safety.passivity.sent_n.shape[0]):
        square_n2 = max(square_n2, square(safety.passivity.sent_n[row]))
    force_n = math.sqrt(square_n2)
    late_m = 2.0 * math.sqrt(state.fastest_m2ps2) * parameters.period_s
    return _within_reach(parameters, state, force_n, late_m, hand_m, interval_s)


@part
def is_gap(parameters: layout.Record, interval_s: float) -> bool:
    """Return whether so much time between two samples is a gap."""
    return bool(interval_s > parameters.rules.gap_ticks * parameters.period_s)


@part
def _note_step(state: layout.Record, hand_m: Any, interval_s: float) -> None:
    """Store the velocity of the step to an accepted position; none is known of the first one.

    A repeated position does not change the speeds: the device may have repeated a sample.
    """
    if state.tracking == 0:
        state.steps = 0
        state.square_m2ps2 = state.fastest_m2ps2 = 0.0
        return
    state.steps = 1
    state.step_s = interval_s
    for axis in range(3):
        state.step_mps[axis] = (hand_m[axis] - state.hand_m[axis]) / interval_s
    square_m2ps2 = square(state.step_mps)
    if square_m2ps2 > 0.0:
        state.fastest_m2ps2 = max(square_m2ps2, state.square_m2ps2)
        state.square_m2ps2 = square_m2ps2


@part
def _within_reach(
    parameters: layout.Record, state: layout.Record, force_n: float, late_m: float, hand_m: Any, interval_s: float
) -> bool:
    """Return whether hand and force can have accelerated the handle to a position from its last step.

    The distance from the place that it would reach at constant velocity is limited by the acceleration of hand and
    force, and by the encoder count. With ``late_m`` it may also stop, as at an end stop, and samples may be late by
    that way along the motion. Nothing is out of reach as long as no step is known.
    """
    if state.steps == 0:
        return True
    square_m2 = along_m2ps = 0.0
    for axis in range(3):
        off_m = hand_m[axis] - state.hand_m[axis] - state.step_mps[axis] * interval_s
        square_m2 += off_m * off_m
        along_m2ps += off_m * state.step_mps[axis]
    least_m = parameters.rules.hand_mps2 * 0.5 * interval_s * (interval_s + state.step_s) + _COUNTS * parameters.count_m
    if square_m2 < _CERTAIN_SHARE * least_m * least_m:  # the usual case, without roots
        return True
    speed_mps = norm(state.step_mps)
    along_m = abs(along_m2ps) / speed_mps if speed_mps > 0.0 else math.sqrt(square_m2)
    most_mps2 = parameters.rules.hand_mps2 + force_n / parameters.mass_kg
    most_m = most_mps2 * 0.5 * interval_s * (interval_s + state.step_s)
    most_m += _COUNTS * parameters.count_m * (1.0 + interval_s / state.step_s)
    if late_m > 0.0:
        most_m += math.sqrt(state.fastest_m2ps2) * interval_s
    return bool(along_m <= most_m + late_m and square_m2 - along_m * along_m <= most_m * most_m)


@part
def can_have_moved(from_m: Any, to_m: Any, interval_s: float) -> bool:
    """Return whether a hand can have moved so far within a time [s]; False if a position is not finite."""
    farthest_m = _FASTEST_HAND_MPS * interval_s
    return bool(square_distance(to_m, from_m) <= farthest_m * farthest_m)


@part
def _has_velocity(sample: layout.Record) -> bool:
    """Return whether the device measured a velocity that is plausible for a hand."""
    for axis in range(3):
        if not abs(sample.device_velocity_mps[axis]) <= _FASTEST_HAND_MPS:  # also rejects NaN
            return False
    return bool(sample.measured & layout.MEASURED_VELOCITY)


@part
def watchdog(parameters: layout.Record, safety: layout.Record, sample: layout.Record) -> None:
    """Set the tick's duration, and start a fade after 5 ms without a usable sample; after 50 ms, zero and fault.

    A late tick counts alike, even with a new sample, since the device held an old force meanwhile: its fade is where
    ticks on time would have taken it, and after 50 ms the force returns as slowly as at a start.
    """
    if safety.started == 0:
        safety.started = 1
        safety.tick_ns = sample.time_ns
        safety.usable_ns = sample.time_ns
    since_ns = sample.time_ns - safety.tick_ns
    safety.tick_s = min(max(since_ns * 1e-9, 0.0), _LONGEST_S)
    safety.tick_ns = sample.time_ns
    safety.late_s = max(since_ns - parameters.period_s * 1e9 - _STALE_NS, 0.0) * 1e-9
    age_ns = sample.time_ns - safety.usable_ns
    if age_ns == 0:
        safety.withheld = 0
    elif age_ns > _STALE_NS:
        safety.withheld |= layout.LIMITER_STALE
    if age_ns >= FAULT_NS and safety.fault == layout.STATUS_OK:
        safety.fault = layout.STATUS_STALE_FAULT

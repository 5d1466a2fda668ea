"""Which samples enter the model, and how much time has passed: nothing doubtful gets further than here."""

from __future__ import annotations

from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.vector import copy, square_distance
from study_app.haptics.model.estimators import device
from study_app.haptics.model.layout import (
    LIMITER_GLITCH,
    LIMITER_STALE,
    MEASURED_VELOCITY,
    STATUS_OK,
    STATUS_STALE_FAULT,
    Record,
)

SHORTEST_S = 0.2e-3
LONGEST_S = 20e-3
FASTEST_HAND_MPS = 10.0
FARTHEST_HAND_M = 10.0
REFUSALS_IN_A_ROW = 5
STALE_NS = 5_000_000
FAULT_NS = 50_000_000


@part
def clamp(interval_s: float) -> float:
    """Return a time between samples as the model takes it [s], whatever the clock did."""
    return min(max(interval_s, SHORTEST_S), LONGEST_S)


@part
def accept_sample(parameters: Record, state: Record, safety: Record, sample: Record) -> float:
    """Take the sample's position into the scene and return Δt [s], or 0 where there is nothing to take.

    Δt is the time since the last accepted sample, so that the next one covers any gap; the first takes the nominal
    period. A position is refused where it is not finite, lies more than 10 m off the device's middle along an axis, or
    is out of reach of a hand of 10 m/s within Δt; so is one without the velocity, of 10 m/s at most along an axis,
    where the device is to measure that. After five refusals in a row estimator and wakes have lost the body, and the
    next position that a hand can have is a new beginning. A position that the device only repeats after it was refused
    is marked as refused too.
    """
    if sample.fresh == 0:
        if state.rejected > 0:
            sample.limiters |= LIMITER_GLITCH
        return 0.0
    interval_s: float = parameters.period_s
    if state.tracking:
        interval_s = clamp((sample.time_ns - state.accepted_ns) * 1e-9)
    if not _plausible(parameters, state, sample, interval_s):
        sample.limiters |= LIMITER_GLITCH
        state.rejected += 1
        if state.rejected == REFUSALS_IN_A_ROW:
            state.tracking = 0
            safety.withheld |= LIMITER_GLITCH
        return 0.0
    hand_m = sample.position_m
    copy(hand_m, state.hand_m)
    place(state, *_in_scene(parameters, hand_m))
    if parameters.estimator == device.CODE:
        for axis in range(3):
            state.estimate_mps[axis] = parameters.scale * sample.device_velocity_mps[axis]
    state.rejected = 0
    state.accepted_ns = sample.time_ns
    safety.usable_ns = sample.time_ns
    return interval_s


@part
def place(state: Record, x_m: float, y_m: float, z_m: float) -> None:
    """Put the body at a place of the scene; at a beginning it has always been there."""
    copy(state.position_m, state.previous_m)
    state.position_m[0] = x_m
    state.position_m[1] = y_m
    state.position_m[2] = z_m
    if state.tracking == 0:
        copy(state.position_m, state.previous_m)


@part
def _in_scene(parameters: Record, hand_m: Any) -> tuple[float, float, float]:
    scale, origin_m = parameters.scale, parameters.origin_m
    return scale * hand_m[0] + origin_m[0], scale * hand_m[1] + origin_m[1], scale * hand_m[2] + origin_m[2]


@part
def _plausible(parameters: Record, state: Record, sample: Record, interval_s: float) -> bool:
    """Return whether the position is one that a hand can have, and within reach of the last accepted one."""
    hand_m = sample.position_m
    for axis in range(3):
        if not abs(hand_m[axis]) <= FARTHEST_HAND_M:  # NaN neither
            return False
    if parameters.estimator == device.CODE and not _has_velocity(sample):
        return False
    return state.tracking == 0 or can_have_moved(state.hand_m, hand_m, interval_s)


@part
def can_have_moved(from_m: Any, to_m: Any, interval_s: float) -> bool:
    """Return whether a hand of 10 m/s can have moved so far within a time [s]; not where a position is not finite."""
    farthest_m = FASTEST_HAND_MPS * interval_s
    return bool(square_distance(to_m, from_m) <= farthest_m * farthest_m)


@part
def _has_velocity(sample: Record) -> bool:
    """Return whether the device measured the velocity, and it is one that a hand can have."""
    for axis in range(3):
        if not abs(sample.device_velocity_mps[axis]) <= FASTEST_HAND_MPS:  # NaN neither
            return False
    return bool(sample.measured & MEASURED_VELOCITY)


@part
def watchdog(parameters: Record, safety: Record, sample: Record) -> None:
    """Say how long the tick is, and let the force go when no usable sample came: 5 ms fade, 50 ms zero and fault.

    A tick that comes late itself is no better, however fresh its sample: the device held an old force meanwhile. It
    finds the fade where ticks in time would have taken it: after 50 ms at zero, to return as slowly as at a start.
    """
    if safety.started == 0:
        safety.started = 1
        safety.tick_ns = sample.time_ns
        safety.usable_ns = sample.time_ns
    since_ns = sample.time_ns - safety.tick_ns
    safety.tick_s = min(max(since_ns * 1e-9, 0.0), LONGEST_S)
    safety.tick_ns = sample.time_ns
    safety.late_s = max(since_ns - parameters.period_s * 1e9 - STALE_NS, 0.0) * 1e-9
    age_ns = sample.time_ns - safety.usable_ns
    if age_ns == 0:
        safety.withheld = 0
    elif age_ns > STALE_NS:
        safety.withheld |= LIMITER_STALE
    if age_ns >= FAULT_NS and safety.fault == STATUS_OK:
        safety.fault = STATUS_STALE_FAULT

"""A closed loop, compiled: the hand moves the handle, the servo's own tick answers, the motors act on the handle.

The handle is that of ``haptics.kernels.plant``, or of a second plant (`arm`). The same motion can be played to the tick
again without the force acting on anything. All sizes are at the hand. What belongs to a device's own delay acts after
the force link of the scene.
"""

import math
from typing import Any, Final

import numpy as np

from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.estimators import take_force
from study_app.haptics.kernels.loop import follow_delay
from study_app.haptics.kernels.passivity import log_acted, log_command, update_observer
from study_app.haptics.kernels.plant import measure, move, next_tick, push, random
from study_app.haptics.kernels.safety import delay_force
from study_app.haptics.kernels.sample_validation import accept_sample, watchdog
from study_app.haptics.kernels.tick import compute_tick, step_model, write_sample
from study_app.haptics.kernels.vector import clear, copy, difference, distance, is_finite, norm
from study_app.haptics.model.layout import MEASURED_VELOCITY
from study_app.haptics.runtime.closed_loop.arm import ARM, advance, write_force

NONE, AVERAGE, FIRST_ORDER, LATE = range(4)
"""Filters of the velocity that a device measures; NONE: it measures none."""
_KEPT: Final = 16  # ticks: the longest mean is of 16

_MEASURED = np.dtype(
    [
        ("filter", np.int64),
        ("lag", np.float64),  # mean [ticks]
        ("noise_mps", np.float64),  # from peak to peak
        ("count_mps", np.float64),  # the velocity is a whole number of them; 0: any
        ("ticks", np.int64),  # number of velocities processed
        ("kept_mps", np.float64, (_KEPT, 3)),  # the last of them
        ("slow_mps", np.float64, (3,)),  # state of the first-order filter
        ("seen_mps", np.float64, (3,)),  # as it is measured
    ],
    align=True,
)


@kernel
def measure_velocity(measured: Any, velocity_mps: Any, shown: int, pace: Any) -> None:
    """Add the handle's velocity in this tick; if it is ``shown``, write the measured velocity to ``seen_mps``."""
    if measured.ticks == 0:  # it has always been that
        copy(velocity_mps, measured.slow_mps)
        for row in range(_KEPT):
            copy(velocity_mps, measured.kept_mps[row])
    copy(velocity_mps, measured.kept_mps[measured.ticks % _KEPT])
    for axis in range(3):
        if measured.filter == AVERAGE:
            value = _mean(measured, 0, round(2.0 * measured.lag), axis)
        elif measured.filter == FIRST_ORDER:
            measured.slow_mps[axis] += (velocity_mps[axis] - measured.slow_mps[axis]) / (1.0 + measured.lag)
            value = measured.slow_mps[axis]
        else:
            value = _mean(measured, math.floor(measured.lag), math.ceil(measured.lag), axis)
        if measured.noise_mps > 0.0:
            value += measured.noise_mps * (random(pace) - 0.5)
        if measured.count_mps > 0.0:
            value = math.floor(value / measured.count_mps + 0.5) * measured.count_mps
        if shown:
            measured.seen_mps[axis] = value
    measured.ticks += 1


@kernel
def _mean(measured: Any, newest: int, oldest: int, axis: int) -> float:
    """Return the mean velocity over a range of past ticks, before this tick is counted."""
    total = 0.0
    for back in range(newest, oldest + 1):
        total += measured.kept_mps[(measured.ticks - back) % _KEPT, axis]
    return float(total / (oldest - newest + 1))


REACHES, CIRCLES, STROKE, SINE = range(4)

BURST_PERIOD_S: Final = 0.3
_SLOWER_S: Final = 0.5
MEASURED_S: Final = 0.03
"""How long a device takes to measure its delay."""

_STRETCH_S: Final = 0.15
"""After so long the mass of the handle or the delay changes, in cases where it does: within each stroke of a hand."""

# Hand, servo and encoder, in addition to the handle and the model.
LOOP = np.dtype(
    [
        ("safe", np.int64),  # 1: with the safety layer, 0: the force of the effects goes to the motors as it is
        ("motion", np.int64),
        ("rigid", np.int64),  # 1: in `follow`, the handle is at the hand's intended position
        ("speed_mps", np.float64),  # greatest speed of the hand
        ("way_m", np.float64),  # length of a reach, diameter of a circle, twice the amplitude of a sine
        ("moving_s", np.float64),  # then the hand rests
        ("release_s", np.float64),  # when it lets go
        ("until_s", np.float64),  # when a run ends
        ("tremor_m", np.float64),
        ("noise_m", np.float64),  # from peak to peak, on top of the encoder
        ("lost", np.float64),  # fraction of ticks without a new sample
        ("duplicated", np.float64),  # fraction of samples that repeat the position of the sample before
        ("burst_s", np.float64),  # duration without any new sample at the end of each `BURST_PERIOD_S`
        ("jump_m", np.float64),  # greatest offset of all positions along an axis, redrawn after each such gap
        ("offset_m", np.float64, (3,)),  # that offset
        ("outliers", np.float64),  # fraction of ticks whose position is wrong
        ("outlier_m", np.float64),  # greatest error along each axis
        ("error_m", np.float64, (3,)),  # of the newest position: offset and outlier
        ("in_burst", np.int64),  # 1 during such a gap
        ("delay", np.int64),  # of the device [ticks]
        ("slows_to", np.int64),  # its delay from `_SLOWER_S` on; above 0: it measures its delay, `MEASURED_S` late
        ("swaps", np.int64),  # 1: this delay in every second stretch of `_STRETCH_S` alone
        ("mass_kg", np.float64),  # of the handle
        ("other_kg", np.float64),  # the same in every second stretch of `_STRETCH_S`; 0: always the same
        ("now_s", np.float64),
        ("broken", np.int64),  # 1 once a force or the handle's position was not finite
        ("was_m", np.float64, (3,)),  # where the hand is
        ("goes_m", np.float64, (3,)),  # its position at the next tick
        ("measured", np.int64),  # 1 if it belongs to this tick
        ("seen_m", np.float64, (3,)),  # the last sample
        ("arm", ARM),  # the second plant, where it is used
        ("velocity", _MEASURED),  # the device's own measurements
    ],
    align=True,
)

# One tick, as seen from outside.
TRACE = np.dtype(
    [
        ("t_s", np.float64),
        ("fresh", np.int64),  # 1: the device reported a new sample
        ("measured", np.int64),  # 1: it is the handle's position now, 0: that of the sample before
        ("error_m", np.float64, (3,)),  # of the position that the device reported, beside noise and count
        ("position_m", np.float64, (3,)),  # of the handle
        ("velocity_mps", np.float64, (3,)),
        ("asked_n", np.float64, (3,)),  # by the effects
        ("sent_n", np.float64, (3,)),  # by the servo
        ("acting_n", np.float64, (3,)),  # from this tick to the next
        ("lift_n", np.float64, (3,)),  # buoyancy and weight in what was sent
        ("drift_mps", np.float64, (3,)),  # of the current
        ("reserve_j", np.float64),  # energy that liquids and estimator could return
        ("permitted_n", np.float64),  # size of the force after slope limit, norm and fade
        ("withheld_n", np.float64),  # size of the change by passivity controller and slew limit
        ("delay", np.int64),  # of the device: how many ticks ago the acting force was sent
        ("assumed", np.int64),  # the delay that the servo assumes [ticks]
        ("limiters", np.int64),
    ],
    align=True,
)


@kernel
def begin(loop: Any, handle: Any) -> None:
    """Move hand and handle to the start of the motion, with its initial speed."""
    loop.now_s = 0.0
    place(loop, 0.0, loop.was_m)
    place(loop, 1e-4, loop.goes_m)
    for axis in range(3):
        handle.position_m[axis] = loop.was_m[axis]
        handle.velocity_mps[axis] = (loop.goes_m[axis] - loop.was_m[axis]) / 1e-4
    copy(handle.position_m, loop.seen_m)
    copy(handle.position_m, loop.arm.arm_m)
    copy(handle.position_m, loop.arm.handle_m)
    copy(handle.velocity_mps, loop.arm.arm_mps)
    copy(handle.velocity_mps, loop.arm.handle_mps)


@kernel
def place(loop: Any, t_s: float, out: Any) -> None:
    """Write the hand's intended position into ``out`` (3,): reaches, circles, one straight stroke, or a sine."""
    t = min(t_s, loop.moving_s)
    if loop.motion == REACHES:
        ticks = t * loop.speed_mps / (1.875 * loop.way_m)
        s = ticks - math.floor(ticks)
        share = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        x = loop.way_m * (0.5 - share if math.floor(ticks) % 2.0 == 1.0 else share - 0.5)
        out[0], out[1], out[2] = 0.9 * x, 0.3 * x, 0.3 * x
    elif loop.motion == CIRCLES:
        radius_m = 0.5 * loop.way_m
        angle = loop.speed_mps * t / radius_m
        out[0], out[1], out[2] = radius_m * math.cos(angle), 0.0, radius_m * math.sin(angle)
    elif loop.motion == STROKE:
        out[0], out[1], out[2] = 0.8 * loop.speed_mps * t, 0.0, 0.6 * loop.speed_mps * t
    else:
        amplitude_m = 0.5 * loop.way_m
        x = amplitude_m * math.sin(loop.speed_mps * t / amplitude_m)
        out[0], out[1], out[2] = 0.8 * x, 0.0, 0.6 * x
    out[0] += loop.tremor_m * math.sin(2.0 * math.pi * 9.0 * t_s)
    out[1] += loop.tremor_m * math.sin(2.0 * math.pi * 10.3 * t_s + 1.0)
    out[2] += loop.tremor_m * math.sin(2.0 * math.pi * 8.2 * t_s + 2.0)


@kernel
def write_places(loop: Any, t_s: Any, out_m: Any) -> None:
    """Write the hand's intended positions at times (n,) [s] into ``out_m`` (n, 3)."""
    for k in range(t_s.shape[0]):
        place(loop, t_s[k], out_m[k])


@kernel
def run(model: Any, safety: Any, sample: Any, handle: Any, pace: Any, loop: Any, trace: Any, first: int) -> int:
    """Run ticks until ``loop.until_s``, one per row of ``trace`` from ``first``; return the next row."""
    k = first
    while k < trace.shape[0] and loop.now_s < loop.until_s and loop.broken == 0:
        if k > 0:
            elapsed_s = next_tick(pace)
            loop.now_s += elapsed_s
            place(loop, loop.now_s, loop.goes_m)
            if loop.now_s >= loop.release_s:
                handle.held = loop.arm.held = 0
            if loop.slows_to > 0:
                handle.delay = loop.arm.delay = delay_at(loop, loop.now_s)
            if loop.other_kg > 0.0:
                other = math.floor(loop.now_s / _STRETCH_S) % 2.0 == 1.0
                handle.mass_kg = loop.arm.handle_kg = loop.other_kg if other else loop.mass_kg
            _move(handle, loop, elapsed_s)
            copy(loop.goes_m, loop.was_m)
        _see(sample, handle, pace, loop)
        if loop.slows_to > 0 and loop.now_s >= MEASURED_S:
            follow_delay(safety, sample, delay_at(loop, loop.now_s - MEASURED_S))
        _answer(model, safety, sample, loop)
        force = sample.device_force_n
        _push(handle, loop, force)
        _record(model, safety, sample, handle, loop, trace[k])
        if not (is_finite(force) and is_finite(handle.position_m)):
            loop.broken = 1
        k += 1
    return k


@kernel
def delay_at(loop: Any, t_s: float) -> int:
    """Return the device's delay [ticks] at a time."""
    slower = t_s >= _SLOWER_S and (loop.swaps == 0 or math.floor(t_s / _STRETCH_S) % 2.0 == 1.0)
    return int(max(loop.delay, loop.slows_to) if slower else loop.delay)


@kernel
def follow(model: Any, safety: Any, sample: Any, handle: Any, pace: Any, loop: Any, trace: Any, path_m: Any) -> None:
    """Run one tick per row of ``trace`` while the hand follows ``path_m`` (rows, 3) [m] without a release.

    With ``loop.rigid`` the handle follows the path regardless of the force.
    """
    period_s = pace.period_s
    for k in range(trace.shape[0]):
        for axis in range(3):
            loop.was_m[axis] = path_m[max(k - 1, 0), axis]
            loop.goes_m[axis] = path_m[k, axis]
            if loop.rigid or k == 0:
                handle.position_m[axis] = path_m[k, axis]
                handle.velocity_mps[axis] = (loop.goes_m[axis] - loop.was_m[axis]) / period_s
        if k > 0 and loop.rigid == 0:
            _move(handle, loop, period_s)
        loop.now_s = k * period_s
        _see(sample, handle, pace, loop)
        _answer(model, safety, sample, loop)
        _push(handle, loop, sample.device_force_n)
        _record(model, safety, sample, handle, loop, trace[k])


@kernel
def _move(handle: Any, loop: Any, elapsed_s: float) -> None:
    """Let time pass; for the second plant, ``handle`` is the position that the encoder sees."""
    if loop.arm.used == 0:
        move(handle, loop.was_m, loop.goes_m, elapsed_s)
        return
    advance(loop.arm, loop.was_m, loop.goes_m, elapsed_s)
    copy(loop.arm.handle_m, handle.position_m)
    copy(loop.arm.handle_mps, handle.velocity_mps)


@kernel
def _push(handle: Any, loop: Any, force_n: Any) -> None:
    if loop.arm.used == 0:
        push(handle, force_n[0], force_n[1], force_n[2])
        return
    write_force(loop.arm, force_n)
    copy(loop.arm.force_n, handle.force_n)


@kernel
def _record(model: Any, safety: Any, sample: Any, handle: Any, loop: Any, row: Any) -> None:
    write_row(model, safety, sample, handle, row)
    row.t_s = loop.now_s
    row.fresh, row.measured = sample.fresh, loop.measured
    copy(loop.error_m, row.error_m)
    copy(safety.passivity.lift_n if loop.safe else model.state[0].lift_n, row.lift_n)
    row.delay = handle.delay


@kernel
def write_row(model: Any, safety: Any, sample: Any, handle: Any, row: Any) -> None:
    """Write motion and forces of a tick into a row of the trace."""
    copy(handle.position_m, row.position_m)
    copy(handle.velocity_mps, row.velocity_mps)
    copy(sample.force_n, row.asked_n)
    copy(sample.device_force_n, row.sent_n)
    copy(handle.force_n, row.acting_n)
    for axis in range(3):
        row.drift_mps[axis] = model.state[0].drift_mps[axis] / model.parameters[0].scale
    row.reserve_j = safety.passivity.reserve_j
    row.assumed = safety.delay_ticks
    row.permitted_n = norm(safety.permitted_n)
    row.withheld_n = distance(safety.permitted_n, sample.device_force_n)
    row.limiters = sample.limiters


@kernel
def play(model: Any, safety: Any, sample: Any, handle: Any, pace: Any, loop: Any, trace: Any, places_m: Any) -> None:
    """Run the tick along a motion (rows, 3) at the times of ``trace``, and write its force to ``sent_n``.

    Samples are lost and repeated in the same ticks as in the trace. An estimator that uses the force receives the
    previous content of ``sent_n``, the force that belongs to the motion; a device that measures the velocity reports
    ``velocity_mps``. No work is done, so the passivity controller does not act.
    """
    for k in range(trace.shape[0]):
        loop.now_s = trace[k].t_s
        for axis in range(3):
            handle.position_m[axis] = places_m[k, axis]
            handle.velocity_mps[axis] = trace[k].velocity_mps[axis]
        sample.fresh, loop.measured = trace[k].fresh, trace[k].measured
        safety.delay_ticks = trace[k].assumed
        copy(trace[k].error_m, loop.error_m)
        _read(sample, handle, pace, loop)
        _settle_passivity(safety.passivity)
        _answer(model, safety, sample, loop)
        log_acted(safety.passivity, trace[k].sent_n)
        copy(sample.device_force_n, trace[k].sent_n)


@kernel
def _settle_passivity(passivity: Any) -> None:
    """Reset the passivity controller: each balance starts the tick as high as the liquid's reserve permits."""
    passivity.balance_j = passivity.late_balance_j = passivity.later_balance_j = passivity.fast.balance_j = math.inf
    passivity.gain = 1.0
    passivity.settling = passivity.reversals = 0
    passivity.acting_s = 0.0
    clear(passivity.velocity_mps)


@kernel
def _see(sample: Any, handle: Any, pace: Any, loop: Any) -> None:
    """Read the encoder: a new sample, a repeated one, a wrong one, or none."""
    in_burst = loop.now_s % BURST_PERIOD_S > BURST_PERIOD_S - loop.burst_s
    if loop.jump_m > 0.0 and loop.in_burst and not in_burst:
        for axis in range(3):
            loop.offset_m[axis] = loop.jump_m * (2.0 * random(pace) - 1.0)
    loop.in_burst = 1 if in_burst else 0
    copy(loop.offset_m, loop.error_m)
    if loop.outliers > 0.0 and random(pace) < loop.outliers:
        for axis in range(3):
            loop.error_m[axis] += loop.outlier_m * (2.0 * random(pace) - 1.0)
    sample.fresh = 0 if in_burst or (loop.lost > 0.0 and random(pace) < loop.lost) else 1
    loop.measured = 1
    if sample.fresh == 0 or (loop.duplicated > 0.0 and random(pace) < loop.duplicated):
        loop.measured = 0
    _read(sample, handle, pace, loop)


@kernel
def _read(sample: Any, handle: Any, pace: Any, loop: Any) -> None:
    """Read the device's current position and velocity, or keep those of the previous sample."""
    sample.time_ns = round(loop.now_s * 1e9)
    if loop.velocity.filter != NONE:
        measure_velocity(loop.velocity, handle.velocity_mps, loop.measured, pace)
        copy(loop.velocity.seen_mps, sample.device_velocity_mps)
        sample.measured = MEASURED_VELOCITY
    if loop.measured:
        measure(handle, loop.seen_m)
        if loop.noise_m > 0.0:
            for axis in range(3):
                loop.seen_m[axis] += loop.noise_m * (random(pace) - 0.5)
    for axis in range(3):
        sample.position_m[axis] = loop.seen_m[axis] + loop.error_m[axis]


@kernel
def _answer(model: Any, safety: Any, sample: Any, loop: Any) -> None:
    """Run a tick; without safety the force of the effects is sent unchanged."""
    if loop.safe:
        compute_tick(model, safety, sample)
        return
    sample.limiters = 0
    interval_s = accept_sample(model.parameters[0], model.state[0], safety, sample)
    watchdog(model.parameters[0], safety, sample)
    if interval_s > 0.0:
        take_force(model.parameters[0], model.state[0], safety)
        step_model(model, interval_s, safety.delay_ticks)
    write_sample(model.state[0], sample)
    update_observer(model, safety, interval_s)
    copy(model.state[0].force_n, sample.device_force_n)
    copy(model.state[0].lift_n, safety.passivity.lift_n)
    link = model.parameters[0].link
    if link.acts != 0:
        delay_force(link, model.state[0].link, model.forces_n, sample.device_force_n)
    log_command(safety.passivity, difference(sample.device_force_n, safety.passivity.lift_n))

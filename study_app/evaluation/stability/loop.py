"""A closed loop, compiled: the hand moves the handle, the servo's own tick answers, the motors act on the handle.

The same motion can be played to the tick again without the force acting on anything. All sizes are at the hand.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from study_app.haptics.compiled import kernel
from study_app.haptics.door import admit, watch
from study_app.haptics.energy import open_account, reserve
from study_app.haptics.pace import next_turn, random
from study_app.haptics.plant import measure, move, push
from study_app.haptics.tick import report, respond, tick
from study_app.haptics.vector import copy, is_finite

REACHES, CIRCLES, STROKE = range(3)

# What hand, servo and encoder do beside the handle and the model.
LOOP = np.dtype(
    [
        ("safe", np.int64),  # 1: with the safety layer, 0: the force of the effects goes to the motors as it is
        ("motion", np.int64),
        ("speed_mps", np.float64),  # greatest speed of the hand
        ("way_m", np.float64),  # length of a reach, diameter of a circle
        ("moving_s", np.float64),  # then the hand rests
        ("release_s", np.float64),  # when it lets go
        ("until_s", np.float64),  # when a run ends
        ("tremor_m", np.float64),
        ("noise_m", np.float64),  # from peak to peak, on top of the encoder
        ("now_s", np.float64),
        ("broken", np.int64),  # 1 once a force or the handle's place was no number
        ("was_m", np.float64, (3,)),  # where the hand is
        ("goes_m", np.float64, (3,)),  # where it will be at the next turn
    ],
    align=True,
)

# One turn, as seen from outside.
TRACE = np.dtype(
    [
        ("t_s", np.float64),
        ("position_m", np.float64, (3,)),  # of the handle
        ("velocity_mps", np.float64, (3,)),
        ("asked_n", np.float64, (3,)),  # by the effects
        ("sent_n", np.float64, (3,)),  # by the servo
        ("acting_n", np.float64, (3,)),  # from this turn to the next
        ("lift_n", np.float64, (3,)),  # buoyancy and weight in what was sent
        ("drift_mps", np.float64, (3,)),  # of the current
        ("reserve_j", np.float64),  # what the liquid could give back
        ("limiters", np.int64),
    ],
    align=True,
)


@kernel
def begin(loop: Any, handle: Any) -> None:
    """Put hand and handle where the motion begins, at its speed."""
    loop.now_s = 0.0
    place(loop, 0.0, loop.was_m)
    place(loop, 1e-4, loop.goes_m)
    for axis in range(3):
        handle.position_m[axis] = loop.was_m[axis]
        handle.velocity_mps[axis] = (loop.goes_m[axis] - loop.was_m[axis]) / 1e-4


@kernel
def place(loop: Any, t_s: float, out: Any) -> None:
    """Write where the hand means to be into ``out`` (3,): reaches to and fro, circles, or one straight stroke."""
    t = min(t_s, loop.moving_s)
    if loop.motion == REACHES:
        turns = t * loop.speed_mps / (1.875 * loop.way_m)
        s = turns - math.floor(turns)
        share = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        x = loop.way_m * (0.5 - share if math.floor(turns) % 2.0 == 1.0 else share - 0.5)
        out[0], out[1], out[2] = 0.9 * x, 0.3 * x, 0.3 * x
    elif loop.motion == CIRCLES:
        radius_m = 0.5 * loop.way_m
        angle = loop.speed_mps * t / radius_m
        out[0], out[1], out[2] = radius_m * math.cos(angle), 0.0, radius_m * math.sin(angle)
    else:
        out[0], out[1], out[2] = 0.8 * loop.speed_mps * t, 0.0, 0.6 * loop.speed_mps * t
    out[0] += loop.tremor_m * math.sin(2.0 * math.pi * 9.0 * t_s)
    out[1] += loop.tremor_m * math.sin(2.0 * math.pi * 10.3 * t_s + 1.0)
    out[2] += loop.tremor_m * math.sin(2.0 * math.pi * 8.2 * t_s + 2.0)


@kernel
def run(model: Any, safety: Any, sample: Any, handle: Any, pace: Any, loop: Any, trace: Any, first: int) -> int:
    """Take turns, one to each row of ``trace`` from ``first`` on, until ``loop.until_s``; return the next row."""
    k = first
    while k < trace.shape[0] and loop.now_s < loop.until_s and loop.broken == 0:
        if k > 0:
            elapsed_s = next_turn(pace)
            loop.now_s += elapsed_s
            place(loop, loop.now_s, loop.goes_m)
            if loop.now_s >= loop.release_s:
                handle.held = 0
            move(handle, loop.was_m, loop.goes_m, elapsed_s)
            copy(loop.goes_m, loop.was_m)
        _see(sample, handle, pace, loop)
        _answer(model, safety, sample, loop.safe)
        force = sample.device_force_n
        push(handle, force[0], force[1], force[2])
        _write_down(model, safety, sample, handle, loop, trace[k])
        if not (is_finite(force) and is_finite(handle.position_m)):
            loop.broken = 1
        k += 1
    return k


@kernel
def _write_down(model: Any, safety: Any, sample: Any, handle: Any, loop: Any, row: Any) -> None:
    """Fill one row of the trace."""
    row.t_s = loop.now_s
    copy(handle.position_m, row.position_m)
    copy(handle.velocity_mps, row.velocity_mps)
    copy(sample.force_n, row.asked_n)
    copy(sample.device_force_n, row.sent_n)
    copy(handle.force_n, row.acting_n)
    copy(safety.account.lift_n if loop.safe else model.state[0].lift_n, row.lift_n)
    for axis in range(3):
        row.drift_mps[axis] = model.state[0].drift_mps[axis] / model.parameters[0].scale
    row.reserve_j = reserve(model)
    row.limiters = sample.limiters


@kernel
def play(model: Any, safety: Any, sample: Any, handle: Any, pace: Any, loop: Any, trace: Any, places_m: Any) -> None:
    """Let the tick answer a motion (rows, 3) at the times of ``trace``, and write its force over ``sent_n`` there.

    No work is done on anything, so the energy account stays out of it.
    """
    for k in range(trace.shape[0]):
        loop.now_s = trace[k].t_s
        for axis in range(3):
            handle.position_m[axis] = places_m[k, axis]
        _see(sample, handle, pace, loop)
        open_account(safety.account)
        _answer(model, safety, sample, loop.safe)
        copy(sample.device_force_n, trace[k].sent_n)


@kernel
def _see(sample: Any, handle: Any, pace: Any, loop: Any) -> None:
    """Read the encoder."""
    measure(handle, sample.position_m)
    if loop.noise_m > 0.0:
        for axis in range(3):
            sample.position_m[axis] += loop.noise_m * (random(pace) - 0.5)
    sample.time_ns = round(loop.now_s * 1e9)
    sample.fresh = 1


@kernel
def _answer(model: Any, safety: Any, sample: Any, safe: int) -> None:
    """Take a tick; without safety the force of the effects is sent as it is."""
    if safe:
        tick(model, safety, sample)
        return
    sample.limiters = 0
    interval_s = admit(model.parameters[0], model.state[0], safety, sample)
    watch(model.parameters[0], safety, sample)
    if interval_s > 0.0:
        respond(model, interval_s)
    report(model.state[0], sample)
    copy(sample.force_n, sample.device_force_n)

"""The safety layer, the last step of a tick: it computes the force sent to the hand, in the hand frame [N].

Order: slope limits on drag and inertia, force link, finite check, norm, fade, gain of the passivity controller, slew
limit, passivity controller, norm; a force stop or a fault bypasses all and sends zero. The slew limit starts from the
force of the last tick before the passivity controller: otherwise the controller's damping would act for too long, and
drive the motion.

``lift_n``, buoyancy and weight within the force, is shortened with it for the passivity controller.

The force link: it delays, jitters or drops the force of the effects, as a study specifies.

It lies between the slope limits and the rest of the safety layer, which acts on the force actually sent: the passivity
observer uses the work of the delayed force, and a stop is not delayed. Jitter and loss are a hash of the link's seed
and the tick, so that a recording is recomputed exactly.

The passivity observer excludes buoyancy and weight because they are conservative; it uses those of the present tick,
since they are conservative only at the present place of the hand. The difference of a delayed buoyancy from the present
one counts like any other force.
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import kernel, part
from study_app.haptics.kernels.passivity import (
    apply_controller,
    log_command,
    reduce_gain,
    reset_observer,
    update_observer,
)
from study_app.haptics.kernels.vector import (
    ZERO,
    Vector,
    components,
    copy,
    difference,
    distance,
    dot,
    is_finite,
    multiple,
    norm,
    square,
    square_distance,
    vector_sum,
)
from study_app.haptics.model import layout
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS

_MASK = 0xFFFFFFFF
_FACTOR = 0x45D9F3B
_PER_STEP = 2.0**-32


@kernel
def delay_force(link: layout.Record, state: layout.Record, forces_n: Any, force_n: Any) -> bool:
    """Replace ``force_n`` (3,) [N] by the force that arrives in this tick; return whether one has arrived so far.

    The force of tick n is due at n + delay + jitter; a force older than the last one sent is skipped. If a force is
    lost, the last one is held. Before the first one arrives the force is 0. ``forces_n`` (n, 3) stores the newest
    forces.
    """
    tick = state.ticks
    copy(force_n, forces_n[tick % forces_n.shape[0]])
    state.ticks = tick + 1
    if uniform(link.seed, 2 * tick) >= link.loss:
        jitter_ticks = int(uniform(link.seed, 2 * tick + 1) * (link.jitter_ticks + 1))
        arrived = tick - link.delay_ticks - jitter_ticks + 1
        if arrived > state.arrived:
            state.arrived = arrived
            copy(forces_n[(arrived - 1) % forces_n.shape[0]], state.force_n)
    copy(state.force_n, force_n)
    return bool(state.arrived > 0)


@part
def uniform(seed: int, number: int) -> float:
    """Return a number in [0, 1) determined by a seed and a number; both are taken modulo 2³²."""
    return _mixed(_mixed(number & _MASK) ^ (seed & _MASK)) * _PER_STEP


@part
def _mixed(value: int) -> int:
    """Return 32 bits as a hash of 32 bits (multiply and shift, the finaliser of MurmurHash)."""
    for _ in range(2):
        value = ((value >> 16) ^ value) * _FACTOR & _MASK
    return (value >> 16) ^ value


START_FADE_S = 0.5
_LATE_S = 0.045
_LEAST_SLEW = 1.0 / 3.0
"""Fraction of the slew limit during a fade in, and least fraction after a great energy debt."""


def new_safety(device_limit_n: float = math.inf, delay_ticks: int = ASSUMED_TICKS) -> Any:
    """Return one SAFETY record, shape (1,), for a servo about to start: zero force, 500 ms to full force.

    ``delay_ticks`` is the assumed delay of a force, in writes.
    """
    safety = layout.records(layout.SAFETY, 1)
    safety[0].fade_s = START_FADE_S
    reset_observer(safety[0].passivity)
    safety[0].device_limit_n = device_limit_n
    safety[0].delay_ticks = delay_ticks
    return safety


@kernel
def begin_scene(safety: layout.Record) -> None:
    """Fade in the force of another scene with its energy at 0; restart a start fade that has not ended.

    Damping sent for the last scene is removed in the next tick, which reports it.
    """
    settling = safety.passivity.settling
    safety.fade = 0.0
    reset_observer(safety.passivity)
    safety.passivity.settling = settling


@part
def guard(model: Any, safety: layout.Record, sample: layout.Record, interval_s: float) -> None:
    """Convert the force of the effects into the force to be sent, ``sample.device_force_n``.

    ``interval_s`` is the time since the last accepted sample, 0 if this tick has none. Vectors are tuples here: they
    stay in registers from step to step.
    """
    parameters, state, passivity = model.parameters[0], model.state[0], safety.passivity
    update_observer(model, safety, interval_s)
    asked_n, lift_n, lift_before_n = components(state.force_n), components(state.lift_n), components(passivity.lift_n)
    force_n = limit_inertia(model, sample, limit_slope(model, safety, sample, asked_n))
    if parameters.link.acts != 0:
        copy(force_n, sample.device_force_n)
        if not delay_force(parameters.link, state.link, model.forces_n, sample.device_force_n):
            lift_n = ZERO
            safety.fade = 0.0  # the first force that arrives fades in
        force_n = components(sample.device_force_n)
    if not (is_finite(force_n) and is_finite(lift_n)):
        sample.limiters |= layout.LIMITER_NON_FINITE
        sample.status = layout.STATUS_NON_FINITE
        force_n = lift_n = ZERO
    limit_n = min(parameters.force_limit_n, safety.device_limit_n)
    norm_share = _norm_share(force_n, limit_n, sample)
    passivity.norm_share = norm_share if limit_n > 0.0 else 1.0
    _update_fade(parameters, safety, sample)
    if norm_share < 1.0:
        force_n, lift_n = multiple(force_n, norm_share), multiple(lift_n, norm_share)
    if safety.fade < 1.0:
        force_n, lift_n = multiple(force_n, safety.fade), multiple(lift_n, safety.fade)
    permitted_n = force_n
    requested_n = _requested_force(parameters, safety, asked_n, permitted_n, limit_n)
    gain = reduce_gain(parameters, state, passivity)
    if gain < 1.0:
        sample.limiters |= layout.LIMITER_ENERGY
        force_n = vector_sum(lift_n, multiple(difference(force_n, lift_n), gain))
    force_n, lift_n = _limit_slew(force_n, lift_n, lift_before_n, parameters, state, safety, sample)
    slewed_n = force_n
    force_n = apply_controller(parameters, safety, sample, force_n, lift_n)
    norm_share = _norm_share(force_n, limit_n, sample)
    if norm_share < 1.0:
        force_n, lift_n = multiple(force_n, norm_share), multiple(lift_n, norm_share)
    if safety.stop != 0 or safety.fault != 0:
        _note_stop(safety, sample)
        force_n = lift_n = slewed_n = permitted_n = requested_n = ZERO
    copy(permitted_n, safety.permitted_n)
    copy(requested_n, safety.requested_n)
    copy(slewed_n, safety.slewed_n)
    copy(lift_n, passivity.lift_n)
    copy(force_n, sample.device_force_n)
    copy(force_n, sample.command_n)
    log_command(passivity, difference(force_n, lift_n))
    sample.delay_ticks = safety.delay_ticks
    sample.permitted_n = norm(requested_n)
    sample.withheld_n = distance(requested_n, force_n)


@part
def limit_slope(model: Any, safety: layout.Record, sample: layout.Record, force_n: Vector) -> Vector:
    """Return the force with each liquid's damping shortened to F·min(1, B|w|/|F|), the secant of the maximum one.

    Delayed drag is limited by the rest of B at its own, greater speed: in fast strokes it follows so soon that released
    handles of 50 g and less oscillated at scales of 10 and more. The excess ``excess_n`` of a force that is steeper
    than B is removed entirely. A body between liquids shares B among them, so that their sum keeps the limit.
    """
    parameters = model.parameters[0]
    shares = 0.0
    for i in range(parameters.liquids):
        shares += model.liquid_states[i].share
    for i in range(parameters.liquids):
        local = model.liquid_states[i]
        if local.share > 0.0:
            if square(local.excess_n) > 0.0:
                sample.limiters |= layout.LIMITER_SLOPE
                force_n = difference(force_n, local.excess_n)
            most_nspm = parameters.slope_limit_nspm[safety.delay_ticks] * local.slope_factor * local.share / shares
            if square(local.damping_n) > most_nspm * most_nspm * square(local.relative_mps):
                sample.limiters |= layout.LIMITER_SLOPE
                excess = 1.0 - most_nspm * norm(local.relative_mps) / norm(local.damping_n)
                force_n = difference(force_n, multiple(local.damping_n, excess))
            if local.late_mps > 0.0:
                most_n = max(most_nspm - local.prompt_nspm, 0.0) * local.late_mps
                if square(local.late_n) > most_n * most_n:
                    sample.limiters |= layout.LIMITER_SLOPE
                    excess = 1.0 - most_n / norm(local.late_n)
                    force_n = difference(force_n, multiple(local.late_n, excess))
    return force_n


@part
def limit_inertia(model: Any, sample: layout.Record, force_n: Vector) -> Vector:
    """Return the force with inertial forces reduced to their stable fraction (`pack`): they also damp fast motion."""
    for i in range(model.parameters[0].liquids):
        local = model.liquid_states[i]
        excess = 1.0 - local.inertia_share
        if excess > 0.0 and local.share > 0.0:
            sample.limiters |= layout.LIMITER_SLOPE
            for k in range(local.inertial):
                force_n = difference(force_n, multiple(local.inertia_n[k], excess))
    return force_n


@part
def _norm_share(force_n: Vector, limit_n: float, sample: layout.Record) -> float:
    """Return the fraction of the force that the limit permits."""
    if square(force_n) > limit_n * limit_n:
        sample.limiters |= layout.LIMITER_NORM
        return limit_n / norm(force_n)
    return 1.0


@part
def _update_fade(parameters: layout.Record, safety: layout.Record, sample: layout.Record) -> None:
    """Update the fraction of the force that is sent while it fades in or out (no usable sample, or a late tick).

    The scene sets the fade-in time; after a start it is at least 500 ms.
    """
    if safety.withheld or safety.late_s > 0.0:
        sample.limiters |= safety.withheld if safety.withheld else layout.LIMITER_STALE
        lasted_s = max(safety.late_s, safety.tick_s if safety.withheld else 0.0)
        safety.fade = max(safety.fade - lasted_s / parameters.rules.fade_out_s, 0.0)
        if safety.late_s >= _LATE_S:
            safety.fade_s = START_FADE_S
    elif safety.fade < 1.0:
        safety.fade = min(safety.fade + safety.tick_s / max(safety.fade_s, parameters.fade_s), 1.0)
    if safety.fade < 1.0:
        sample.limiters |= layout.LIMITER_FADE
    else:
        safety.fade_s = 0.0


@part
def _requested_force(
    parameters: layout.Record, safety: layout.Record, asked_n: Vector, permitted_n: Vector, limit_n: float
) -> Vector:
    """Return the force of the effects within norm and fade, from which the fraction withheld counts.

    A force link sends the force of earlier ticks: there the force after its limits counts.
    """
    if parameters.link.acts != 0 or limit_n <= 0.0 or not is_finite(asked_n):
        return permitted_n
    exceeds = square(asked_n) > limit_n * limit_n
    if exceeds or safety.fade < 1.0:
        return multiple(asked_n, safety.fade * limit_n / (norm(asked_n) if exceeds else limit_n))
    return asked_n


@part
def _limit_slew(
    force_n: Vector,
    lift_n: Vector,
    lift_before_n: Vector,
    parameters: layout.Record,
    state: layout.Record,
    safety: layout.Record,
    sample: layout.Record,
) -> tuple[Vector, Vector]:
    """Limit the change of the force from tick to tick (`slope_limits.slew_limit_n`), without pushing the hand on.

    After an energy debt the limit is reduced by the controller's gain; it is least during a fade in. A force that falls
    too slowly at a reversal would do work on the hand: its unwanted part along the motion is dropped at once.
    Return force and lift.
    """
    of_limit = max(safety.passivity.gain, _LEAST_SLEW)
    if safety.fade < 1.0:
        of_limit = parameters.rules.fade_out_slew if safety.withheld else _LEAST_SLEW
    most_n = parameters.slew_n * of_limit
    slewed_n = components(safety.slewed_n)
    if square_distance(force_n, slewed_n) <= most_n * most_n:
        return force_n, lift_n
    sample.limiters |= layout.LIMITER_SLEW
    v_mps = components(state.estimate_mps)
    wanted_nmps = dot(force_n, v_mps)
    share = most_n / distance(force_n, slewed_n)
    force_n = vector_sum(slewed_n, multiple(difference(force_n, slewed_n), share))
    lift_n = vector_sum(lift_before_n, multiple(difference(lift_n, lift_before_n), share))
    excess_nmps = dot(force_n, v_mps) - max(wanted_nmps, 0.0)
    square_mps2 = square(v_mps)
    if excess_nmps > 0.0 and square_mps2 > 0.0:  # the square of a speed below 1e-162 m/s is 0
        x_n = force_n[0] - excess_nmps * v_mps[0] / square_mps2
        y_n = force_n[1] - excess_nmps * v_mps[1] / square_mps2
        z_n = force_n[2] - excess_nmps * v_mps[2] / square_mps2
        force_n = (x_n, y_n, z_n)
        if square_distance(force_n, slewed_n) > most_n * most_n:
            sample.limiters |= layout.LIMITER_ENERGY
    return force_n, lift_n


@part
def _note_stop(safety: layout.Record, sample: layout.Record) -> None:
    """Note why the force is zero; afterwards it fades in as at the start."""
    if safety.stop != 0:
        sample.limiters |= layout.LIMITER_STOP
    if safety.fault != 0:
        sample.status = safety.fault
    safety.fade = 0.0
    safety.fade_s = START_FADE_S

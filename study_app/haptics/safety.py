"""What is sent to the hand: always the last step of a turn, in the hand frame [N].

Order: slope limit on drag, finite, norm, fade, slew, energy, norm; a force stop or a fault goes past all of them to
zero. ``lift_n``, what of the force is buoyancy and weight, is shortened along with it: the energy account needs it.
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.compiled import kernel, part
from study_app.haptics.energy import observe, open_account, remember, settle
from study_app.haptics.layout import (
    EFFECT_DRAG,
    LIMITER_FADE,
    LIMITER_NON_FINITE,
    LIMITER_NORM,
    LIMITER_SLEW,
    LIMITER_SLOPE,
    LIMITER_STOP,
    SAFETY,
    STATUS_NON_FINITE,
    Record,
    records,
)
from study_app.haptics.vector import clear, copy, distance, is_finite, norm, square, square_distance

START_FADE_S = 0.5
SCENE_FADE_S = 0.05
FADE_OUT_S = 0.045
SLEW_N = 0.5


def new_safety(device_limit_n: float = math.inf) -> Any:
    """Return one SAFETY record, shape (1,), for a servo that is about to start: no force yet, 500 ms to full force."""
    safety = records(SAFETY, 1)
    safety[0].fade_s = START_FADE_S
    safety[0].device_limit_n = device_limit_n
    return safety


@kernel
def begin_scene(safety: Record) -> None:
    """Let the force of another scene fade in, its energy at 0; a start fade that is not over begins again."""
    safety.fade = 0.0
    open_account(safety.account)


@part
def guard(model: Any, safety: Record, sample: Record, interval_s: float) -> None:
    """Turn the force of the effects into the force to be sent, ``sample.device_force_n``.

    ``interval_s`` is the time since the last accepted sample, 0 where this turn brought none.
    """
    parameters, state = model.parameters[0], model.state[0]
    account = safety.account
    force_n, lift_n = sample.device_force_n, account.lift_n
    observe(model, safety, interval_s)
    copy(lift_n, account.lift_before_n)
    copy(state.force_n, force_n)
    copy(state.lift_n, lift_n)
    _limit_slope(model, sample)
    if not (is_finite(force_n) and is_finite(lift_n)):
        sample.limiters |= LIMITER_NON_FINITE
        sample.status = STATUS_NON_FINITE
        clear(force_n)
        clear(lift_n)
    limit_n = min(parameters.force_limit_n, safety.device_limit_n)
    _limit_norm(force_n, lift_n, limit_n, sample)
    _fade(force_n, lift_n, safety, sample)
    _limit_slew(force_n, account, safety, sample)
    settle(parameters, account, sample)
    _limit_norm(force_n, lift_n, limit_n, sample)
    if safety.stop != 0 or safety.fault != 0:
        _let_go(force_n, safety, sample)
        clear(lift_n)
    copy(force_n, safety.sent_n)
    remember(account, force_n)


@part
def _limit_slope(model: Any, sample: Record) -> None:
    """Shorten each drag to F·min(1, B|w|/|F|): a secant a sampled damper of the hand's mass stays stable under.

    Where the body passes between liquids they share the limit B, so that their sum keeps it.
    """
    parameters = model.parameters[0]
    shares = 0.0
    for i in range(parameters.liquids):
        shares += model.liquid_states[i].share
    for i in range(parameters.liquids):
        local = model.liquid_states[i]
        if model.liquids[i].effects & EFFECT_DRAG and local.share > 0.0:
            most_nspm = parameters.slope_limit_nspm * local.share / shares
            if square(local.drag.force_n) > most_nspm * most_nspm * square(local.relative_mps):
                sample.limiters |= LIMITER_SLOPE
                excess = 1.0 - most_nspm * norm(local.relative_mps) / norm(local.drag.force_n)
                for axis in range(3):
                    sample.device_force_n[axis] -= excess * local.drag.force_n[axis]


@part
def _limit_norm(force_n: Any, lift_n: Any, limit_n: float, sample: Record) -> None:
    """Shorten the force to the limit, keeping its direction."""
    if square(force_n) > limit_n * limit_n:
        sample.limiters |= LIMITER_NORM
        _scale(force_n, lift_n, limit_n / norm(force_n))


@part
def _scale(force_n: Any, lift_n: Any, factor: float) -> None:
    for axis in range(3):
        force_n[axis] *= factor
        lift_n[axis] *= factor


@part
def _fade(force_n: Any, lift_n: Any, safety: Record, sample: Record) -> None:
    """Weaken the force while it fades in (start 500 ms, scene 50 ms) or out (no usable sample)."""
    if safety.withheld:
        sample.limiters |= safety.withheld
        safety.fade = max(safety.fade - safety.turn_s / FADE_OUT_S, 0.0)
    else:
        safety.fade = min(safety.fade + safety.turn_s / safety.fade_s, 1.0)
    if safety.fade < 1.0:
        sample.limiters |= LIMITER_FADE
        _scale(force_n, lift_n, safety.fade)
    else:
        safety.fade_s = SCENE_FADE_S


@part
def _limit_slew(force_n: Any, account: Record, safety: Record, sample: Record) -> None:
    """Let the force move by at most 0.5 N from the one sent before."""
    if square_distance(force_n, safety.sent_n) > SLEW_N * SLEW_N:
        sample.limiters |= LIMITER_SLEW
        share = SLEW_N / distance(force_n, safety.sent_n)
        lift_n, before_n = account.lift_n, account.lift_before_n
        for axis in range(3):
            force_n[axis] = safety.sent_n[axis] + (force_n[axis] - safety.sent_n[axis]) * share
            lift_n[axis] = before_n[axis] + (lift_n[axis] - before_n[axis]) * share


@part
def _let_go(force_n: Any, safety: Record, sample: Record) -> None:
    """Zero force now; when let on again, the force fades in as at the start."""
    if safety.stop != 0:
        sample.limiters |= LIMITER_STOP
    if safety.fault != 0:
        sample.status = safety.fault
    safety.fade = 0.0
    safety.fade_s = START_FADE_S
    clear(force_n)

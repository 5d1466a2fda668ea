"""The position tail: the liquid velocity left by the body's recent path, at a constant cost per tick.

Definition (Rek 2024, §4.3, eq. 1): the newest N elements e_j, each the velocity of one tick, fall into segments; a new
segment starts where the path turns by more than the breaking angle β. With d_i the unit direction of a segment's newest
element,

    v_tail = (1/S) Σ_i d_i Σ_{j in i} |e_j| ,      v_wake = v_tail · response(|v_tail| / m̄) .

This is linear in the |e_j|, so sums are stored and only entering and leaving elements are added and subtracted: this
module computes the response to the sums and updates the list per tick; ``wake_segments`` maintains segments and sums.
``evidence.reference_model`` is the literal definition, element by element.
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.effects.drag import resistance
from study_app.haptics.kernels.vector import clear, copy, distance, norm
from study_app.haptics.kernels.wake_segments import empty, renew, store, tail
from study_app.haptics.model.effects.drag import LAW_CONSTANT
from study_app.haptics.model.layout import Record

REST_MPS = 1e-3
RESPONSE_FLOOR = 0.05
SMALLEST_SCALE = 1e-60
NOTHING_MPS = 1e-30


@part
def wake_velocity(parameters: Record, liquid: Record, local: Record, state: Record, segments: Any) -> None:
    """Set the liquid's velocity at the body, ``local.wake_mps`` (3,) [m/s], from the wake so far."""
    wake, out = local.wake, local.wake_mps
    if local.ticks == 0:
        empty(liquid.wake, wake, segments)
    tail(liquid.wake, wake, segments, out)
    size_mps = norm(out)
    if size_mps < NOTHING_MPS:
        clear(out)
        return
    mean_mps = wake.scale * (wake.square_m2ps2 + wake.square_carry_m2ps2) / (wake.speed_mps + wake.speed_carry_mps)
    gain = response(size_mps / mean_mps, liquid.wake.exponent)
    for axis in range(3):
        out[axis] *= gain
    state.returnable_j += returnable_j(parameters, liquid, out, liquid.wake.length)


@part
def returnable_j(parameters: Record, liquid: Record, wake_mps: Any, length: int) -> float:
    """Return the greatest energy [J, scene] that a wake of ``length`` N gives to a body: max R(u - v) (u - v) v · N T.

    For a constant coefficient that power is (4/27) c u³, at v = u/3; R of the other laws grows less, so R(u) u²/4
    bounds it.
    """
    u_mps = norm(wake_mps)
    share = 4.0 / 27.0 if liquid.drag.law == LAW_CONSTANT else 0.25
    power_w = float(share * resistance(liquid.drag, u_mps) * u_mps * u_mps)
    return float(power_w * length * parameters.period_s)


@part
def response(fill: float, exponent: float) -> float:
    """Return the factor of |v_tail|, which is ``fill`` times the elements' mean speed.

    The response acts on the fill x = |v_tail|/m̄ with m̄ = Σ|e|²/Σ|e|: straight motion fills the wake as x^y. For y < 1
    a smooth floor x_0 keeps x^(y-1) finite where opposed segments cancel.
    """
    if exponent > 1.0:
        return float(fill ** (exponent - 1.0))
    if exponent < 1.0:
        return float((fill * fill + RESPONSE_FLOOR * RESPONSE_FLOOR) ** (0.5 * (exponent - 1.0)))
    return 1.0


@part
def update_wake(liquid: Record, local: Record, state: Record, elements: Any, segments: Any, interval_s: float) -> None:
    """Update the wake after the force: decay, arc length, and a new element if the rules require one.

    Elements hold the motion relative to the current: a body that drifts with the current leaves no wake. A body slower
    than 1 mm/s stores a zero element, which belongs to no segment but takes one of the N places; a moving body stores
    its velocity at each ``resolution`` of distance from its last stored element.
    """
    wake, tracks, h = liquid.wake, local.wake, local.motion_mps
    tracks.scale *= math.exp(wake.log_decay_per_s * interval_s)
    if tracks.scale < SMALLEST_SCALE or tracks.evicted >= wake.length:
        renew(wake, tracks, elements, segments)
    hx, hy, hz = h[0], wake.vertical * h[1], h[2]
    speed_mps = math.sqrt(hx * hx + hy * hy + hz * hz)
    tracks.arc_m += speed_mps * interval_s
    if speed_mps < REST_MPS:
        store(wake, tracks, elements, segments, 0.0, 0.0, 0.0, 0.0)
    elif tracks.stored == 0 or distance(state.position_m, tracks.stored_at_m) >= wake.resolution_m:
        store(wake, tracks, elements, segments, hx, hy, hz, speed_mps)
    else:
        return
    copy(state.position_m, tracks.stored_at_m)

"""The position tail: the liquid velocity left by the body's recent path, at a constant cost per tick.

Definition (Rek 2024, §4.3, eq. 1): the newest N elements e_j, each the velocity of one tick, fall into segments; a new
segment starts where the path turns by more than the breaking angle β. With d_i the unit direction of a segment's newest
element,

    v_tail = (1/S) Σ_i d_i Σ_{j in i} |e_j| ,      v_wake = v_tail · response(|v_tail| / m̄) .

This is linear in the |e_j|, so sums are stored and only entering and leaving elements are added and subtracted: this
module computes the response to the sums and updates the list per tick; the functions of segments maintain the sums.
``evidence.reference_model`` is the literal definition, element by element.

The elements of a wake in a ring, their segments in another, and sums that stay exact.

Elements and segments are numbered from 0 in order; number q is in ring row ``wake.row + q % wake.length``. Speeds and
sums are stored divided by ``tracks.scale``, the decay common to all of them. A sum is stored with its rounding error
(`add`), so that a fast burst that has left the list leaves no residue. Segments between the oldest, which loses
elements, and the newest, which gains them, do not change: their contribution is one vector, ``interior``. Each segment
holds at least one element, so N rows suffice; segment ``last`` may be empty at rest.
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import kernel, part
from study_app.haptics.kernels.effects.drag import resistance
from study_app.haptics.kernels.vector import clear, copy, distance, norm
from study_app.haptics.model.effects.drag import LAW_CONSTANT
from study_app.haptics.model.layout import Record

_COSINE_TOLERANCE = 1e-12


@part
def add(total: float, carry: float, term: float) -> tuple[float, float]:
    """Return total + term and the rounding errors so far (Neumaier 1974): their sum has twice the precision."""
    new = total + term
    lost = (total - new) + term if abs(total) >= abs(term) else (term - new) + total
    return new, carry + lost


@part
def _row(wake: Record, lap: int, number: int) -> int:
    """Return the row of an element or segment without a division; ``lap`` is the number in the first row."""
    row: int = wake.row + number - lap
    return row if number >= lap else row + wake.length


@kernel
def empty(wake: Record, tracks: Record, segments: Any) -> None:
    """Clear the wake: no element is stored."""
    tracks.stored = tracks.element_lap = 0
    tracks.held = 0
    tracks.arc_m = 0.0
    tracks.log_decay, tracks.decay = 0.0, 1.0
    _clear_sums(wake, tracks, segments)


@part
def tail(wake: Record, tracks: Record, segments: Any, out_mps: Any) -> None:
    """Write v_tail = (1/S) Σ_i d_i Σ|e| to ``out_mps``, shape (3,)."""
    first = segments[_row(wake, tracks.segment_lap, tracks.first_segment)]
    last = segments[_row(wake, tracks.segment_lap, tracks.last_segment)]
    first_mps = first.speed_mps + first.speed_carry_mps
    last_mps = last.speed_mps + last.speed_carry_mps if tracks.first_segment != tracks.last_segment else 0.0
    for axis in range(3):
        interior_mps = tracks.interior_mps[axis] + tracks.interior_carry_mps[axis]
        ends_mps = first.direction[axis] * first_mps + last.direction[axis] * last_mps
        out_mps[axis] = tracks.scale * (interior_mps + ends_mps) / wake.scaling


@part
def store(
    wake: Record, tracks: Record, elements: Any, segments: Any, ex: float, ey: float, ez: float, speed_mps: float
) -> None:
    """Append the element (ex, ey, ez) of size ``speed_mps``; beyond N the oldest is removed after the comparison."""
    moving = speed_mps > 0.0
    turns = moving and _turns(wake, tracks, elements, segments, ex, ey, ez, speed_mps)
    if tracks.held == wake.length:
        _evict(wake, tracks, elements, segments)
    if turns:
        _open(wake, tracks, segments)
    element = elements[_row(wake, tracks.element_lap, tracks.stored)]
    element.velocity_mps[0] = ex / tracks.scale
    element.velocity_mps[1] = ey / tracks.scale
    element.velocity_mps[2] = ez / tracks.scale
    element.speed_mps = speed_mps / tracks.scale
    element.arc_m = tracks.arc_m
    element.moving = moving
    if moving:
        _join(wake, tracks, segments, element)
    tracks.stored += 1
    tracks.held += 1
    if tracks.stored - tracks.element_lap == wake.length:
        tracks.element_lap = tracks.stored


@part
def _turns(
    wake: Record, tracks: Record, elements: Any, segments: Any, ex: float, ey: float, ez: float, speed_mps: float
) -> bool:
    """Return whether e·e_ref < (cos β − 1e-12)|e||e_ref|.

    The reference is the youngest element of the current segment at least ``breaking_span`` of arc earlier, or the
    segment's oldest while it is shorter. It never moves backward.
    """
    if segments[_row(wake, tracks.segment_lap, tracks.last_segment)].count == 0:
        return False
    while tracks.scanned < tracks.stored:
        element = elements[_row(wake, tracks.element_lap, tracks.scanned)]
        if tracks.arc_m - element.arc_m < wake.breaking_span_m:
            break
        if element.moving:
            tracks.reference = tracks.scanned
        tracks.scanned += 1
    reference = elements[_row(wake, tracks.element_lap, tracks.reference)]
    e = reference.velocity_mps
    along = ex * e[0] + ey * e[1] + ez * e[2]
    least = (wake.breaking_cosine - _COSINE_TOLERANCE) * speed_mps * reference.speed_mps
    return bool(along < least)


@part
def _open(wake: Record, tracks: Record, segments: Any) -> None:
    """Start a new segment; add the one before to the interior, unless it is the oldest or empty."""
    last = segments[_row(wake, tracks.segment_lap, tracks.last_segment)]
    if last.count == 0:
        return
    if tracks.last_segment != tracks.first_segment:
        _add_interior(tracks, last, 1.0)
    tracks.last_segment += 1
    if tracks.last_segment - tracks.segment_lap == wake.length:
        tracks.segment_lap = tracks.last_segment
    _clear(segments[_row(wake, tracks.segment_lap, tracks.last_segment)])


@part
def _join(wake: Record, tracks: Record, segments: Any, element: Record) -> None:
    """Add the newest element to the sums and to the newest segment, and set the segment's direction to its own."""
    segment = segments[_row(wake, tracks.segment_lap, tracks.last_segment)]
    if segment.count == 0:
        tracks.reference = tracks.stored
        tracks.scanned = tracks.stored + 1
    segment.count += 1
    for axis in range(3):
        segment.direction[axis] = element.velocity_mps[axis] / element.speed_mps
    _count_speed(tracks, segment, element.speed_mps, 1.0)


@part
def _evict(wake: Record, tracks: Record, elements: Any, segments: Any) -> None:
    """Remove the oldest element from the list."""
    oldest = tracks.stored - tracks.held
    element = elements[_row(wake, tracks.element_lap, oldest)]
    tracks.held -= 1
    if not element.moving:
        return
    tracks.evicted += 1
    segment = segments[_row(wake, tracks.segment_lap, tracks.first_segment)]
    segment.count -= 1
    _count_speed(tracks, segment, element.speed_mps, -1.0)
    if segment.count > 0:
        if tracks.reference == oldest:
            _move_reference(wake, tracks, elements)
    elif tracks.first_segment == tracks.last_segment:
        _clear_sums(wake, tracks, segments)
    else:
        tracks.first_segment += 1
        if tracks.first_segment != tracks.last_segment:
            _add_interior(tracks, segments[_row(wake, tracks.segment_lap, tracks.first_segment)], -1.0)


@part
def _move_reference(wake: Record, tracks: Record, elements: Any) -> None:
    """Set the reference to the next moving element, the oldest of its segment: the last one was removed."""
    tracks.reference += 1
    while elements[_row(wake, tracks.element_lap, tracks.reference)].moving == 0:
        tracks.reference += 1
    tracks.scanned = max(tracks.scanned, tracks.reference + 1)


@kernel
def renew(wake: Record, tracks: Record, elements: Any, segments: Any) -> None:
    """Reset the scale to 1 and recompute all sums from the stored elements: O(N), at most once in N evictions."""
    number = tracks.first_segment
    left = segments[_row(wake, tracks.segment_lap, number)].count
    scale, first, last = tracks.scale, tracks.first_segment, tracks.last_segment
    for i in range(first, last + 1):
        segment = segments[_row(wake, tracks.segment_lap, i)]
        segment.speed_mps = 0.0
        segment.speed_carry_mps = 0.0
    _clear_totals(tracks)
    for q in range(tracks.stored - tracks.held, tracks.stored):
        element = elements[_row(wake, tracks.element_lap, q)]
        for axis in range(3):
            element.velocity_mps[axis] *= scale
        element.speed_mps *= scale
        if element.moving:
            if left == 0:
                number += 1
                left = segments[_row(wake, tracks.segment_lap, number)].count
            left -= 1
            _count_speed(tracks, segments[_row(wake, tracks.segment_lap, number)], element.speed_mps, 1.0)
    for i in range(first + 1, last):
        _add_interior(tracks, segments[_row(wake, tracks.segment_lap, i)], 1.0)


@part
def _count_speed(tracks: Record, segment: Record, speed_mps: float, sign: float) -> None:
    """Add an element's speed to its segment and to the totals, or with ``sign`` −1 subtract it."""
    segment.speed_mps, segment.speed_carry_mps = add(segment.speed_mps, segment.speed_carry_mps, sign * speed_mps)
    tracks.speed_mps, tracks.speed_carry_mps = add(tracks.speed_mps, tracks.speed_carry_mps, sign * speed_mps)
    square = sign * speed_mps * speed_mps
    tracks.square_m2ps2, tracks.square_carry_m2ps2 = add(tracks.square_m2ps2, tracks.square_carry_m2ps2, square)


@part
def _add_interior(tracks: Record, segment: Record, sign: float) -> None:
    """Add a segment's contribution to the interior, or subtract exactly that with ``sign`` −1."""
    speed_mps = segment.speed_mps + segment.speed_carry_mps
    for axis in range(3):
        term = sign * (segment.direction[axis] * speed_mps)
        total, carry = add(tracks.interior_mps[axis], tracks.interior_carry_mps[axis], term)
        tracks.interior_mps[axis] = total
        tracks.interior_carry_mps[axis] = carry


@part
def _clear_sums(wake: Record, tracks: Record, segments: Any) -> None:
    """Reset all sums to exactly zero, and the scale to 1: no moving element is left."""
    tracks.first_segment = tracks.last_segment = tracks.segment_lap = 0
    _clear(segments[wake.row])
    _clear_totals(tracks)


@part
def _clear_totals(tracks: Record) -> None:
    tracks.scale = 1.0
    tracks.evicted = 0
    tracks.speed_mps = 0.0
    tracks.speed_carry_mps = 0.0
    tracks.square_m2ps2 = 0.0
    tracks.square_carry_m2ps2 = 0.0
    clear(tracks.interior_mps)
    clear(tracks.interior_carry_mps)


@part
def _clear(segment: Record) -> None:
    clear(segment.direction)
    segment.count = 0
    segment.speed_mps = 0.0
    segment.speed_carry_mps = 0.0


REST_MPS = 1e-3
_RESPONSE_FLOOR = 0.05
_SMALLEST_SCALE = 1e-60
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
        return float((fill * fill + _RESPONSE_FLOOR * _RESPONSE_FLOOR) ** (0.5 * (exponent - 1.0)))
    return 1.0


@part
def update_wake(liquid: Record, local: Record, state: Record, elements: Any, segments: Any, interval_s: float) -> None:
    """Update the wake after the force: decay, arc length, and a new element if the rules require one.

    Elements hold the motion relative to the current: a body that drifts with the current leaves no wake. A body slower
    than 1 mm/s stores a zero element, which belongs to no segment but takes one of the N places; a moving body stores
    its velocity at each ``resolution`` of distance from its last stored element.
    """
    wake, tracks, h = liquid.wake, local.wake, local.motion_mps
    if wake.log_decay_per_s * interval_s != tracks.log_decay:
        tracks.log_decay = wake.log_decay_per_s * interval_s
        tracks.decay = math.exp(tracks.log_decay)
    tracks.scale *= tracks.decay
    if tracks.scale < _SMALLEST_SCALE or tracks.evicted >= wake.length:
        renew(wake, tracks, elements, segments)
    hx, hy, hz = h[0], wake.vertical * h[1], h[2]
    speed_mps = math.sqrt(hx * hx + hy * hy + hz * hz)
    tracks.arc_m += speed_mps * interval_s
    if speed_mps < REST_MPS:
        store(wake, tracks, elements, segments, 0.0, 0.0, 0.0, 0.0)
    elif (
        wake.resolution_m == 0.0
        or tracks.stored == 0
        or distance(state.position_m, tracks.stored_at_m) >= wake.resolution_m
    ):
        store(wake, tracks, elements, segments, hx, hy, hz, speed_mps)
    else:
        return
    copy(state.position_m, tracks.stored_at_m)

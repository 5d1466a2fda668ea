"""The local wake: a position tail whose elements stay where they arose.

The tail (``wake``) acts at any place of the body: after a stop and a fast departure the body still meets the wake it
left elsewhere (Rek 2024, §6.3). Here the newest N elements e_j, one per tick, are stored in at most 64 cells of one
body diameter of path each, and the effect of a cell depends on its distance r from the body:

    v_tail = (1/S) Σ_c w_c λ^age_c Σ_{j in c} e_j ,   w_c = (σ_0/σ_c)³ exp(−r²/2σ_c²) ,   σ_c² = σ_0² + s_c + 2ν age_c .

σ_0 is the reach, about a diameter; the momentum of a cell spreads as in a viscous liquid, over a growing width: its age
counts from its last element, s_c is the variance of its elements at that time, including the distance of merged cells.
Elements are summed as vectors, so there are no segments: a turn on the spot cancels, and a circle keeps each of its
parts in place. v_wake = v_tail · response(|v_tail| / m̄) as in ``wake``, with m̄ weighted likewise. As w_c ≤ 1 and N ≤
S, the liquid is never faster than the body. Places drift with the current. [choice]
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.effects.wake import NOTHING_MPS, REST_MPS, response, returnable_j
from study_app.haptics.kernels.vector import clear, norm
from study_app.haptics.model.effects.local_wake import CELLS
from study_app.haptics.model.layout import Record

_FARTHEST = 40.0  # r²/2σ² beyond which a cell has no effect: e^-40


@part
def local_wake_velocity(
    parameters: Record, liquid: Record, local: Record, state: Record, cells: Any, interval_s: float
) -> None:
    """Set the liquid's velocity at the body, ``local.wake_mps`` (3,) [m/s], from the cells near it."""
    wake, tracks, out = liquid.local_wake, local.local_wake, local.wake_mps
    if local.ticks == 0:
        _clear(tracks)
    for axis in range(3):
        tracks.drift_m[axis] += (state.velocity_mps[axis] - local.motion_mps[axis]) * interval_s
    clear(out)
    speeds = squares = 0.0
    x, y, z = _place(tracks, state)
    for i in range(tracks.cells):
        cell = cells[wake.row + _wrapped(tracks.first + i)]
        if cell.speed_mps > 0.0:
            age_s = tracks.time_s - cell.time_s
            narrow_m2 = wake.reach_m * wake.reach_m
            wide_m2 = narrow_m2 + cell.spread_m2 + 2.0 * wake.spreading_m2ps * age_s
            dx, dy, dz = x - cell.place_m[0], y - cell.place_m[1], z - cell.place_m[2]
            far = 0.5 * (dx * dx + dy * dy + dz * dz) / wide_m2
            if far < _FARTHEST:
                thin = narrow_m2 / wide_m2
                decay = math.exp(wake.log_decay_per_s * age_s)
                weight = thin * math.sqrt(thin) * math.exp(-far) * decay
                speeds += weight * cell.speed_mps
                squares += weight * decay * cell.square_m2ps2
                for axis in range(3):
                    out[axis] += weight * cell.velocity_mps[axis] / wake.scaling
    size_mps = norm(out)
    if size_mps < NOTHING_MPS:
        clear(out)
        return
    gain = response(size_mps * speeds / squares, wake.exponent)
    for axis in range(3):
        out[axis] *= gain
    state.returnable_j += returnable_j(parameters, liquid, out, wake.length)


@part
def deposit_local_wake(liquid: Record, local: Record, state: Record, cells: Any, interval_s: float) -> None:
    """Update the wake after the force: advance its time, and add one element, zero below 1 mm/s."""
    wake, tracks, h = liquid.local_wake, local.local_wake, local.motion_mps
    tracks.time_s += interval_s
    hx, hy, hz = h[0], wake.vertical * h[1], h[2]
    speed_mps = math.sqrt(hx * hx + hy * hy + hz * hz)
    moves = speed_mps >= REST_MPS
    if tracks.held == wake.length:
        _evict(wake, tracks, cells)
    if tracks.cells == 0 or _is_full(wake, tracks, _newest(wake, tracks, cells), moves):
        _open(wake, tracks, cells)
    newest = _newest(wake, tracks, cells)
    _grow(wake, tracks, newest, *_place(tracks, state))
    if moves:
        tracks.path_m += speed_mps * interval_s
        newest.velocity_mps[0] += hx
        newest.velocity_mps[1] += hy
        newest.velocity_mps[2] += hz
        newest.speed_mps += speed_mps
        newest.square_m2ps2 += speed_mps * speed_mps


@part
def _clear(tracks: Record) -> None:
    """Clear the wake: no element is stored."""
    tracks.first = 0
    tracks.cells = 0
    tracks.held = 0
    tracks.time_s = 0.0
    clear(tracks.drift_m)


@part
def _is_full(wake: Record, tracks: Record, newest: Record, moves: bool) -> bool:
    """Return whether the next element needs a new cell: after a diameter of path, N/16 elements, or a start or stop."""
    moved = newest.speed_mps > 0.0
    return bool(tracks.path_m >= wake.cell_m or newest.count >= wake.cell_elements or moved != moves)


@part
def _open(wake: Record, tracks: Record, cells: Any) -> None:
    """Begin a cell; if all 64 are in use, merge the two oldest first."""
    if tracks.cells == CELLS:
        _merge_oldest(wake, tracks, cells)
    tracks.cells += 1
    cell = _newest(wake, tracks, cells)
    tracks.path_m = 0.0
    clear(cell.place_m)
    clear(cell.velocity_mps)
    cell.speed_mps = 0.0
    cell.square_m2ps2 = 0.0
    cell.count = 0
    cell.time_s = tracks.time_s
    cell.spread_m2 = 0.0


@part
def _newest(wake: Record, tracks: Record, cells: Any) -> Any:
    return cells[wake.row + _wrapped(tracks.first + tracks.cells - 1)]


@part
def _merge_oldest(wake: Record, tracks: Record, cells: Any) -> None:
    """Merge the oldest cell into the next: add the sums, set the place to the momentum's mean, keep its variance."""
    oldest = cells[wake.row + tracks.first]
    cell = cells[wake.row + _wrapped(tracks.first + 1)]
    elapsed_s = cell.time_s - oldest.time_s
    _scale_cell(oldest, math.exp(wake.log_decay_per_s * elapsed_s))
    speed_mps = oldest.speed_mps + cell.speed_mps
    share = oldest.speed_mps / speed_mps if speed_mps > 0.0 else 0.5
    apart_m2 = 0.0
    for axis in range(3):
        apart_m = oldest.place_m[axis] - cell.place_m[axis]
        apart_m2 += apart_m * apart_m
        cell.place_m[axis] += share * apart_m
        cell.velocity_mps[axis] += oldest.velocity_mps[axis]
    spread_m2 = oldest.spread_m2 + 2.0 * wake.spreading_m2ps * elapsed_s
    cell.spread_m2 += share * (spread_m2 - cell.spread_m2) + share * (1.0 - share) * apart_m2 / 3.0
    cell.speed_mps = speed_mps
    cell.square_m2ps2 += oldest.square_m2ps2
    cell.count += oldest.count
    _drop_oldest(tracks)


@part
def _grow(wake: Record, tracks: Record, cell: Record, x_m: float, y_m: float, z_m: float) -> None:
    """Update the newest cell to the present, and add one element at this place."""
    tracks.held += 1
    elapsed_s = tracks.time_s - cell.time_s
    _scale_cell(cell, math.exp(wake.log_decay_per_s * elapsed_s))
    cell.time_s = tracks.time_s
    cell.count += 1
    share = 1.0 / cell.count
    dx, dy, dz = x_m - cell.place_m[0], y_m - cell.place_m[1], z_m - cell.place_m[2]
    cell.place_m[0] += share * dx
    cell.place_m[1] += share * dy
    cell.place_m[2] += share * dz
    spread_m2 = cell.spread_m2 + 2.0 * wake.spreading_m2ps * elapsed_s
    cell.spread_m2 = (1.0 - share) * spread_m2


@part
def _evict(wake: Record, tracks: Record, cells: Any) -> None:
    """Remove the oldest element: subtract the mean of its elements from the oldest cell."""
    oldest = cells[wake.row + tracks.first]
    tracks.held -= 1
    if oldest.count == 1:
        _drop_oldest(tracks)
        return
    left = (oldest.count - 1.0) / oldest.count
    oldest.count -= 1
    for axis in range(3):
        oldest.velocity_mps[axis] *= left
    oldest.speed_mps *= left
    oldest.square_m2ps2 *= left


@part
def _drop_oldest(tracks: Record) -> None:
    tracks.first = _wrapped(tracks.first + 1)
    tracks.cells -= 1


@part
def _scale_cell(cell: Record, keep: float) -> None:
    """Multiply every element of a cell by a factor."""
    for axis in range(3):
        cell.velocity_mps[axis] *= keep
    cell.speed_mps *= keep
    cell.square_m2ps2 *= keep * keep


@part
def _place(tracks: Record, state: Record) -> tuple[float, float, float]:
    """Return the place of the body in the frame that drifts with the current."""
    return (
        state.position_m[0] - tracks.drift_m[0],
        state.position_m[1] - tracks.drift_m[1],
        state.position_m[2] - tracks.drift_m[2],
    )


@part
def _wrapped(number: int) -> int:
    return number if number < CELLS else number - CELLS

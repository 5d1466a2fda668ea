"""History force: the boundary layer around the ball depends on its past acceleration.

The Basset–Boussinesq force of creeping flow (Landau & Lifshitz, Fluid Mechanics, §24),

    F = −6 R² √(πρµ) φ ∫ dw/dτ (t − τ)^(−½) dτ ,

with w piecewise linear between ticks. Intervals younger than the window are integrated exactly; for the rest the kernel
1/√τ is replaced by ten exponentials Σ a_i √(e/t_i) e^(−τ/2t_i), t_i = t̃_i · window (van Hinsberg, ten Thije Boonkkamp
& Clercx 2011, J. Comput. Phys. 230:1465): within 0.7 % up to 100 windows, and each sum decays recursively. At Reynolds
numbers far above 1 the true force decays faster; this is an upper bound.
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.effects.added_mass import stored_square
from study_app.haptics.kernels.vector import clear, square
from study_app.haptics.model.effects.history import EXPONENTIALS
from study_app.haptics.model.estimators import KALMAN
from study_app.haptics.model.layout import Record

_TIMES = (0.1, 0.3, 1.0, 3.0, 10.0, 40.0, 190.0, 1000.0, 6500.0, 50000.0)  # t̃_i
_WEIGHTS = (
    0.23477481312586,
    0.28549576238194,
    0.28479416718255,
    0.26149775537574,
    0.32056200511938,
    0.35354490689146,
    0.39635904496921,
    0.42253908596514,
    0.48317384225265,
    0.63661146557001,
)  # a_i
_NOTHING = 1e-30
_ROUNDING_S = 1e-9  # a window of n ticks contains n of them, regardless of rounding


@part
def basset_force(
    parameters: Record, liquid: Record, local: Record, state: Record, rows: Any, delay_ticks: int, interval_s: float
) -> None:
    """Add the history force, (3,) [N], to the force; φ is the fraction of the volume in the liquid.

    w is first smoothed, as for the added mass. Only the fraction that keeps the loop stable is sent. It stores the
    energy of its inertia, 3πR² √(2µρ/ω) (Landau & Lifshitz, §24), in an oscillation of the period in the rules.
    """
    history, tracks = liquid.history, local.history
    intervals, exponentials = rows.intervals, rows.exponentials
    if local.ticks == 0:
        _reset_tracks(history, tracks, local.relative_mps, exponentials)
    _fade(history, exponentials, interval_s)
    rate_per_s = history.filter_per_s * liquid.smoothing_rate[delay_ticks]
    _append(history, tracks, local.relative_mps, intervals, rate_per_s, parameters.smoothing_lead, interval_s)
    force_n = local.inertia_n[local.inertial]
    local.inertial += 1
    clear(force_n)
    oldest_s = _integrate(history, tracks, intervals, force_n)
    for i in range(EXPONENTIALS):
        exponential = exponentials[history.tail_row + i]
        for axis in range(3):
            force_n[axis] += exponential.memory[axis]
    _move_to_exponentials(history, tracks, intervals, exponentials, oldest_s)
    for axis in range(3):
        force_n[axis] *= -history.factor_kg_rs * local.share
        state.force_n[axis] += force_n[axis]
    inertia_kg = 0.5 * history.factor_kg_rs * local.share * parameters.rules.history_rs
    state.returnable_j += (
        0.5 * liquid.inertia_share[delay_ticks] * inertia_kg * _storing_square(parameters, local, tracks)
    )


@part
def _storing_square(parameters: Record, local: Record, tracks: Record) -> float:
    """Return v² [m²/s²] of the energy that the history stores, with v smoothed as for the added mass."""
    if parameters.estimator != KALMAN:
        return float(square(local.motion_mps))
    square_m2ps2 = 0.0
    for axis in range(3):
        once_mps = local.motion_mps[axis] + tracks.smoothed_mps[axis] - local.relative_mps[axis]
        less_mps = tracks.smoothed_mps[axis] - tracks.twice_mps[axis]
        square_m2ps2 += stored_square(once_mps, less_mps, parameters.smoothing_lead)
    return square_m2ps2


@part
def _reset_tracks(history: Record, tracks: Record, w: Any, exponentials: Any) -> None:
    """Begin at the present velocity, as if the motion had always been uniform."""
    tracks.first = 0
    tracks.held = 0
    for axis in range(3):
        tracks.smoothed_mps[axis] = tracks.twice_mps[axis] = w[axis] if abs(w[axis]) > _NOTHING else 0.0
    for i in range(EXPONENTIALS):
        clear(exponentials[history.tail_row + i].memory)


@part
def _fade(history: Record, exponentials: Any, interval_s: float) -> None:
    """Let the exponentials decay over Δt."""
    for i in range(EXPONENTIALS):
        exponential = exponentials[history.tail_row + i]
        keep = math.exp(-0.5 * interval_s / (_TIMES[i] * history.window_s))
        for axis in range(3):
            kept = keep * exponential.memory[axis]
            exponential.memory[axis] = kept if abs(kept) > _NOTHING else 0.0


@part
def _append(
    history: Record, tracks: Record, w: Any, intervals: Any, rate_per_s: float, lead: float, interval_s: float
) -> None:
    """Append the newest interval to the window, which has room for it. At rest, w becomes exactly 0."""
    weight = -math.expm1(-rate_per_s / (1.0 + lead) * interval_s)
    newest = intervals[history.row + _wrapped(tracks.first + tracks.held, history.rows)]
    for axis in range(3):
        change_mps = weight * (w[axis] - tracks.smoothed_mps[axis])
        if abs(tracks.smoothed_mps[axis] + change_mps) <= _NOTHING:
            change_mps = -tracks.smoothed_mps[axis]
        tracks.smoothed_mps[axis] += change_mps
        twice_mps = weight * (tracks.smoothed_mps[axis] - tracks.twice_mps[axis])
        if abs(tracks.twice_mps[axis] + twice_mps) <= _NOTHING:
            twice_mps = -tracks.twice_mps[axis]
        tracks.twice_mps[axis] += twice_mps
        newest.acceleration_mps2[axis] = (change_mps + lead * (change_mps - twice_mps)) / interval_s
    newest.duration_s = interval_s
    tracks.held += 1


@part
def _integrate(history: Record, tracks: Record, intervals: Any, force_n: Any) -> float:
    """Add ∫ dw/dτ (t − τ)^(−½) dτ over the window to the force; return the age of its oldest interval [s]."""
    age_s = root = 0.0
    for back in range(1, tracks.held + 1):
        interval = intervals[history.row + _wrapped(tracks.first + tracks.held - back, history.rows)]
        age_s += interval.duration_s
        longer = math.sqrt(age_s)
        weight = 2.0 * (longer - root)
        root = longer
        for axis in range(3):
            force_n[axis] += weight * interval.acceleration_mps2[axis]
    return age_s


@part
def _move_to_exponentials(history: Record, tracks: Record, intervals: Any, exponentials: Any, oldest_s: float) -> None:
    """Move intervals that are older than the window into the exponentials, the oldest also if no row is free."""
    while tracks.held > 0:
        interval = intervals[history.row + tracks.first]
        ended_s = oldest_s - interval.duration_s
        if ended_s < history.window_s - _ROUNDING_S and tracks.held < history.rows:
            return
        for i in range(EXPONENTIALS):
            time_s = _TIMES[i] * history.window_s
            share = math.exp(-0.5 * ended_s / time_s) * -math.expm1(-0.5 * interval.duration_s / time_s)
            weight = 2.0 * _WEIGHTS[i] * math.sqrt(math.e * time_s) * share
            exponential = exponentials[history.tail_row + i]
            for axis in range(3):
                exponential.memory[axis] += weight * interval.acceleration_mps2[axis]
        oldest_s = ended_s
        tracks.first = _wrapped(tracks.first + 1, history.rows)
        tracks.held -= 1


@part
def _wrapped(number: int, rows: int) -> int:
    return number if number < rows else number - rows

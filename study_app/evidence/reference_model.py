"""The force model by its literal definition: slow, simple, and the reference for the program.

Every element of the wake is stored in a list and decays separately; segments are summed again each tick. It follows the
definition and shares no code with ``haptics.kernels.effects``. `exact_wakes` is the same without the rounding errors of
long sums.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from study_app.haptics.kernels.compiled import workings
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Ewma, Knee, Scene


class Response(NamedTuple):
    """The results of the definition for each row of a motion, (n, 3) except the last."""

    velocity_mps: Floats
    wake_mps: Floats
    force_n: Floats
    size_mps: Floats  # (n,): Σ|e| / S, the measure that rounding errors are compared with


def respond(scene: Scene, motion: Motion, *, exact: bool = False) -> Response:
    """Return velocity, wake and force along ``motion`` in a scene of one liquid that is everywhere.

    Drag and wake alone; with ``exact`` the wake is summed without rounding errors (`exact_wakes`).
    """
    liquid = scene.liquids[0]
    interval_s = np.clip(np.diff(motion.t_s, prepend=motion.t_s[0] - 1 / scene.rate_hz), 0.2e-3, 20e-3)
    interval_s[0] = 1 / scene.rate_hz
    given = motion.velocity_mps if motion.velocity_mps is not None else _filtered(scene, motion, interval_s)
    velocity_mps = given if liquid.drag.law == "linear" else np.array([lowered(row, scene.knee) for row in given])
    wake_mps, size_mps = np.zeros_like(velocity_mps), np.zeros(len(velocity_mps))
    if liquid.wake is not None and "wake" in liquid.effects:
        length = max(1, math.floor(liquid.wake.length * scene.rate_hz / 1000))
        wake_mps, size_mps = (exact_wakes if exact else wakes)(
            velocity_mps * np.array([1.0, 1.0 if liquid.wake.axes == "xyz" else 0.0, 1.0]),
            motion.position_m,
            interval_s,
            length,
            max(liquid.wake.scaling * scene.rate_hz / 1000, length),
            liquid.wake.exponent,
            math.cos(math.radians(liquid.wake.breaking_angle_deg)),
            liquid.wake.breaking_span_m,
            liquid.wake.decay,
            liquid.wake.resolution_m,
        )
    relative_mps = velocity_mps - wake_mps
    slopes_nspm = [resistance_nspm(scene, speed) for speed in np.linalg.norm(relative_mps, axis=1).tolist()]
    force_n = -np.array(slopes_nspm)[:, np.newaxis] * relative_mps
    return Response(velocity_mps, wake_mps, force_n, size_mps)


def resistance_nspm(scene: Scene, speed_mps: float) -> float:
    """Return |F|/|w| [N·s/m] by the liquid's law of drag, from C_d itself; at rest its limit."""
    liquid, diameter_m = scene.liquids[0], scene.body.diameter_m
    pressure_kg_m = 0.5 * liquid.density_kg_m3 * math.pi * (diameter_m / 2) ** 2
    if liquid.drag.law == "linear":
        return float(liquid.drag.damping_nspm / scene.scale)
    if liquid.drag.law == "constant":
        return pressure_kg_m * scene.body.drag_coefficient * speed_mps
    viscosity_pa_s = liquid.viscosity_pa_s or 0.0
    reynolds = liquid.density_kg_m3 * speed_mps * diameter_m / viscosity_pa_s
    if reynolds < 1e-12:
        return 3 * math.pi * viscosity_pa_s * diameter_m
    held = min(reynolds, 2e5)
    coefficient = {
        "schiller-naumann": max(24 / held * (1 + 0.15 * held**0.687), 0.44),
        "haider-levenspiel": 24 / held * (1 + 0.1806 * held**0.6459) + 0.4251 / (1 + 6880.95 / held),
        "brown-lawler": 24 / held * (1 + 0.150 * held**0.681) + 0.407 / (1 + 8710 / held),
    }[liquid.drag.law]
    return float(pressure_kg_m * coefficient * speed_mps)


def _filtered(scene: Scene, motion: Motion, interval_s: Floats) -> Floats:
    """Return the exponentially weighted velocity (n, 3), zero at the first row."""
    if not isinstance(scene.velocity, Ewma):
        raise TypeError(f"the definition filters with ewma alone, not {scene.velocity.kind}")
    velocity_mps = np.zeros_like(motion.position_m)
    for k in range(1, len(interval_s)):
        weight = 1 - (1 - scene.velocity.alpha) ** (interval_s[k] / 1e-3)
        difference_mps = (motion.position_m[k] - motion.position_m[k - 1]) / interval_s[k]
        velocity_mps[k] = velocity_mps[k - 1] + weight * (difference_mps - velocity_mps[k - 1])
    return velocity_mps


def lowered(velocity_mps: Floats, knee: Knee) -> Floats:
    """Return one velocity (3,) after the speed knee."""
    speed = float(np.linalg.norm(velocity_mps))
    excess = speed - knee.threshold_mps
    if excess <= 0 or knee.law == "none":
        return velocity_mps
    wanted = knee.threshold_mps + (math.sqrt(1 + 2 * excess) - 1 if knee.law == "sqrt" else excess**2)
    return velocity_mps * (wanted / speed)


@workings
def wakes(
    h_mps: Any,
    position_m: Any,
    interval_s: Any,
    length: int,
    scaling: float,
    exponent: float,
    breaking_cosine: float,
    breaking_span_m: float,
    decay: float,
    resolution_m: float,
) -> Any:
    """Return v_wake (n, 3) as each tick's drag meets it, and Σ|e|/S (n,), for velocities ``h_mps`` (n, 3) of the tail.

    The list is newest first: row 0 is the youngest of ``count`` elements. Zero elements have segment -1.
    """
    ticks = len(h_mps)
    wake_mps, size_mps = np.zeros((ticks, 3)), np.zeros(ticks)
    element, segment, arc = np.zeros((length + 1, 3)), np.zeros(length + 1, np.int64), np.zeros(length + 1)
    count, current, arc_m, stored_at, stored = 0, 0, 0.0, np.zeros(3), False
    for k in range(ticks):
        wake_mps[k], size_mps[k] = _wake(element, segment, count, scaling, exponent)

        element[:count] *= decay ** (interval_s[k] / 1e-3)
        speed = _size(h_mps[k])
        arc_m += speed * interval_s[k]
        rests = speed < 1e-3
        moved = not stored or _size(position_m[k] - stored_at) >= resolution_m
        if not rests and not moved:
            continue
        if not rests and _breaks(
            h_mps[k], element, segment, arc, count, current, arc_m, breaking_cosine, breaking_span_m
        ):
            current += 1
        for j in range(count, 0, -1):
            element[j], segment[j], arc[j] = element[j - 1], segment[j - 1], arc[j - 1]
        element[0] = np.zeros(3) if rests else h_mps[k]
        segment[0] = -1 if rests else current
        arc[0] = arc_m
        count = min(count + 1, length)
        stored_at[:], stored = position_m[k], True
    return wake_mps, size_mps


@workings
def exact_wakes(
    h_mps: Any,
    position_m: Any,
    interval_s: Any,
    length: int,
    scaling: float,
    exponent: float,
    breaking_cosine: float,
    breaking_span_m: float,
    decay: float,
    resolution_m: float,
) -> Any:
    """Return the result of `wakes` without its rounding errors: no sum continues from tick to tick.

    First the ticks that store an element, and its segment, are determined. Then every tick sums its N elements again,
    each times the λ^age of its age, with compensation of rounding errors (Neumaier 1974).
    """
    ticks = len(h_mps)
    wake_mps, size_mps = np.zeros((ticks, 3)), np.zeros(ticks)
    taken, segment, arc = np.zeros(ticks, np.int64), np.zeros(ticks, np.int64), np.zeros(ticks)
    speed_mps, clock_s = np.zeros(ticks), np.cumsum(interval_s)
    stored, current, arc_m = 0, 0, 0.0
    before = np.zeros(ticks, np.int64)  # number of elements stored before a tick's drag
    for k in range(ticks):
        before[k] = stored
        speed_mps[k] = _size(h_mps[k])
        arc_m += speed_mps[k] * interval_s[k]
        rests = speed_mps[k] < 1e-3
        if not rests and stored > 0 and _size(position_m[k] - position_m[taken[stored - 1]]) < resolution_m:
            continue
        if not rests:
            reference = -1
            for j in range(stored - 1, max(stored - 1 - length, -1), -1):
                if segment[j] == current:
                    reference = taken[j]
                    if arc_m - arc[j] >= breaking_span_m:
                        break
            along = np.sum(h_mps[k] * h_mps[reference])
            if reference < 0 or along < (breaking_cosine - 1e-12) * speed_mps[k] * speed_mps[reference]:
                current += 1
        taken[stored], segment[stored], arc[stored] = k, -1 if rests else current, arc_m
        stored += 1

    per_s = math.log(decay) * 1e3
    tail, speeds, squares, summed = np.zeros((3, 2)), np.zeros((1, 2)), np.zeros((1, 2)), np.zeros((1, 2))
    for k in range(ticks):
        tail[:], speeds[:], squares[:], summed[:] = 0.0, 0.0, 0.0, 0.0
        newest, inside = 0, -1
        for j in range(before[k] - 1, max(before[k] - 1 - length, -1), -1):
            if segment[j] < 0:
                continue
            i = taken[j]
            if segment[j] != inside:
                for axis in range(3):
                    _add(tail, axis, h_mps[newest, axis] / max(speed_mps[newest], 1e-3) * (summed[0, 0] + summed[0, 1]))
                summed[:], newest, inside = 0.0, i, segment[j]
            size = speed_mps[i] * math.exp(per_s * (clock_s[k - 1] - clock_s[i]))
            _add(summed, 0, size)
            _add(speeds, 0, size)
            _add(squares, 0, size * size)
        for axis in range(3):
            _add(tail, axis, h_mps[newest, axis] / max(speed_mps[newest], 1e-3) * (summed[0, 0] + summed[0, 1]))
        if speeds[0, 0] > 0.0:
            v_tail = (tail[:, 0] + tail[:, 1]) / scaling
            mean = (squares[0, 0] + squares[0, 1]) / (speeds[0, 0] + speeds[0, 1])
            wake_mps[k] = v_tail * _gain(_size(v_tail) / mean, exponent)
            size_mps[k] = (speeds[0, 0] + speeds[0, 1]) / scaling
    return wake_mps, size_mps


@workings
def _add(sums: Any, row: int, value: float) -> None:
    """Add to a sum, whose rounding error is in the next column (Neumaier 1974, ZAMM 54:39)."""
    total = sums[row, 0] + value
    if abs(sums[row, 0]) >= abs(value):
        sums[row, 1] += (sums[row, 0] - total) + value
    else:
        sums[row, 1] += (value - total) + sums[row, 0]
    sums[row, 0] = total


@workings
def local_wakes(
    h_mps: Any,
    position_m: Any,
    interval_s: Any,
    length: int,
    scaling: float,
    exponent: float,
    decay: float,
    reach_m: float,
    spreading_m2ps: float,
) -> Any:
    """Return v_wake (n, 3) of a local wake in which every element keeps its own place and age, in any number.

    v_tail = (1/S) Σ_j (σ_0/σ_j)³ exp(−r_j²/2σ_j²) λ^age_j e_j over the newest N elements, zero ones included, with
    σ_j² = σ_0² + 2ν age_j; then the response to the fill, whose mean speed is weighted likewise.
    """
    ticks = len(h_mps)
    wake_mps = np.zeros((ticks, 3))
    for k in range(ticks):
        tail, speeds, squares, age_s = np.zeros(3), 0.0, 0.0, 0.0
        for j in range(k - 1, max(k - 1 - length, -1), -1):
            speed = _size(h_mps[j])
            if speed >= 1e-3:
                wide_m2 = reach_m**2 + 2 * spreading_m2ps * age_s
                fades = decay ** (age_s / 1e-3)
                felt = (reach_m**2 / wide_m2) ** 1.5 * math.exp(
                    -0.5 * _size(position_m[k] - position_m[j]) ** 2 / wide_m2
                )
                tail += felt * fades * h_mps[j] / scaling
                speeds += felt * fades * speed
                squares += felt * (fades * speed) ** 2
            age_s += interval_s[j]
        if speeds > 0.0:
            wake_mps[k] = tail * _gain(_size(tail) * speeds / squares, exponent)
    return wake_mps


@workings
def _wake(element: Any, segment: Any, count: int, scaling: float, exponent: float) -> Any:
    """Return v_wake of a list and Σ|e|/S: eq. (1), then the response to the fill."""
    tail, speeds, squares = np.zeros(3), 0.0, 0.0
    direction, summed, inside = np.zeros(3), 0.0, -1
    for j in range(count):
        speed = _size(element[j])
        if segment[j] >= 0 and speed > 0.0:
            if segment[j] != inside:
                tail += direction * summed
                direction, summed, inside = element[j] / speed, 0.0, segment[j]
            summed += speed
            speeds += speed
            squares += speed * speed
    tail = (tail + direction * summed) / scaling
    if speeds == 0.0:
        return np.zeros(3), 0.0
    return tail * _gain(_size(tail) / (squares / speeds), exponent), speeds / scaling


@workings
def _breaks(
    h: Any,
    element: Any,
    segment: Any,
    arc: Any,
    count: int,
    current: int,
    arc_m: float,
    breaking_cosine: float,
    breaking_span_m: float,
) -> bool:
    """Return whether a velocity begins a new segment."""
    reference = -1
    for j in range(count):
        if segment[j] == current:
            reference = j
            if arc_m - arc[j] >= breaking_span_m:
                break
    if reference < 0:
        return True
    e = element[reference]
    along = h[0] * e[0] + h[1] * e[1] + h[2] * e[2]
    return bool(along < (breaking_cosine - 1e-12) * _size(h) * _size(e))


@workings
def _gain(fill: float, exponent: float) -> float:
    """Return the factor of the tail by the response to a fill."""
    return float(fill ** (exponent - 1.0) if exponent >= 1.0 else (fill**2 + 0.05**2) ** ((exponent - 1.0) / 2.0))


@workings
def _size(vector: Any) -> float:
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)

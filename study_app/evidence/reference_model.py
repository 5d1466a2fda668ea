"""The force by its literal definition: slow, simple, and the reference for the program.

Every element of the wake is stored unchanged, with its segment and time. Every wake is the sum of all elements, each
decayed by its age, with compensation of rounding errors (Neumaier 1974, ZAMM 54:39). Unsteady drag follows the
equations of the law, with exact exponentials for every step, from a given acceleration and given constants. The steady
force of non-Newtonian drag is that of ``haptics.model.laws``, and its states are integrated in many steps per tick. No
code or constants are shared with ``haptics.kernels.effects``.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np

from study_app.haptics.kernels import copy, distance, evidence_kernel, kernel, norm
from study_app.haptics.model import laws
from study_app.haptics.model.effects import STIFFNESS_NPM, Wake
from study_app.haptics.model.laws import Maxwell
from study_app.haptics.model.layout import records
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Ewma, Knee, Scene


class Response(NamedTuple):
    """The exact velocity, wake and force at each row of a motion, (n, 3) except the last."""

    velocity_mps: Floats
    wake_mps: Floats
    force_n: Floats
    size_mps: Floats  # (n,): Σ|e| / S, the measure that rounding errors are compared with


def respond(scene: Scene, motion: Motion) -> Response:
    """Return velocity, wake and force along ``motion`` in a scene with one liquid everywhere: drag and wake."""
    liquid = scene.liquids[0]
    interval_s = np.clip(np.diff(motion.t_s, prepend=motion.t_s[0] - 1 / scene.rate_hz), 0.2e-3, 20e-3)
    interval_s[0] = 1 / scene.rate_hz
    scene_mps = motion.velocity_mps if motion.velocity_mps is not None else _filter_velocity(scene, motion, interval_s)
    velocity_mps = (
        scene_mps if liquid.drag.law == "linear" else np.array([compress_speed(row, scene.knee) for row in scene_mps])
    )
    wake_mps: Floats = np.zeros_like(velocity_mps)
    size_mps: Floats = np.zeros(len(velocity_mps))
    if liquid.wake is not None and "wake" in liquid.effects:
        axes = np.array([1.0, 1.0 if liquid.wake.axes == "xyz" else 0.0, 1.0])
        wake_mps, size_mps = wakes(velocity_mps * axes, motion.position_m, interval_s, liquid.wake, scene.rate_hz)
    relative_mps = velocity_mps - wake_mps
    slopes_nspm = [resistance_nspm(scene, speed) for speed in np.linalg.norm(relative_mps, axis=1).tolist()]
    force_n = -np.array(slopes_nspm)[:, np.newaxis] * relative_mps
    return Response(velocity_mps=velocity_mps, wake_mps=wake_mps, force_n=force_n, size_mps=size_mps)


def resistance_nspm(scene: Scene, speed_mps: float) -> float:
    """Return |F|/|w| [N·s/m] of the liquid's drag law, computed from C_d itself; at rest its limit."""
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
    clipped = min(reynolds, 2e5)
    coefficient = {
        "schiller-naumann": max(24 / clipped * (1 + 0.15 * clipped**0.687), 0.44),
        "haider-levenspiel": 24 / clipped * (1 + 0.1806 * clipped**0.6459) + 0.4251 / (1 + 6880.95 / clipped),
        "brown-lawler": 24 / clipped * (1 + 0.150 * clipped**0.681) + 0.407 / (1 + 8710 / clipped),
    }[liquid.drag.law]
    return float(pressure_kg_m * coefficient * speed_mps)


def _filter_velocity(scene: Scene, motion: Motion, interval_s: Floats) -> Floats:
    """Return the exponentially weighted velocity (n, 3), zero at the first row."""
    if not isinstance(scene.velocity, Ewma):
        raise TypeError(f"the reference definition supports only ewma, not {scene.velocity.kind}")
    velocity_mps = np.zeros_like(motion.position_m)
    for k in range(1, len(interval_s)):
        weight = 1 - (1 - scene.velocity.alpha) ** (interval_s[k] / 1e-3)
        difference_mps = (motion.position_m[k] - motion.position_m[k - 1]) / interval_s[k]
        velocity_mps[k] = velocity_mps[k - 1] + weight * (difference_mps - velocity_mps[k - 1])
    return velocity_mps


def compress_speed(velocity_mps: Floats, knee: Knee) -> Floats:
    """Return one velocity (3,) after applying the speed knee."""
    speed = float(np.linalg.norm(velocity_mps))
    excess = speed - knee.threshold_mps
    if excess <= 0 or knee.law == "none":
        return velocity_mps
    compressed = knee.threshold_mps + (math.sqrt(1 + 2 * excess) - 1 if knee.law == "sqrt" else excess**2)
    return velocity_mps * (compressed / speed)


_WAKE_LIST = np.dtype(
    [
        ("length", np.int64),  # N
        ("scaling", np.float64),
        ("exponent", np.float64),
        ("breaking_cosine", np.float64),
        ("breaking_span_m", np.float64),
        ("resolution_m", np.float64),
        ("log_decay_pns", np.float64),
        ("stored", np.int64),
        ("held", np.int64),
        ("segment", np.int64),  # the current one
        ("age_ns", np.int64),  # all intervals so far
        ("arc_m", np.float64),
        ("stored_at_m", np.float64, (3,)),
        ("sums", np.float64, (6, 2)),  # with their rounding errors
    ],
    align=True,
)
_ELEMENT = np.dtype(
    [
        ("velocity_mps", np.float64, (3,)),
        ("speed_mps", np.float64),  # 0: an element at rest
        ("segment", np.int64),
        ("age_ns", np.int64),  # scale of the list when it was stored
        ("arc_m", np.float64),
    ],
    align=True,
)
_REST_MPS: Final = 1e-3


def new_wake_list(wake: Wake, rate_hz: float) -> tuple[Any, Any]:
    """Return an empty wake list: `_WAKE_LIST` (1,) and its elements (N,) `_ELEMENT`."""
    wake_list, length = records(_WAKE_LIST, 1), max(1, math.floor(wake.length * rate_hz / 1000))
    wake_list.length, wake_list.scaling = length, max(wake.scaling * rate_hz / 1000, length)
    wake_list.exponent, wake_list.resolution_m = wake.exponent, wake.resolution_m
    wake_list.breaking_cosine = math.cos(math.radians(wake.breaking_angle_deg))
    wake_list.breaking_span_m, wake_list.log_decay_pns = wake.breaking_span_m, math.log(wake.decay) * 1e-6
    return wake_list, records(_ELEMENT, length)


def wakes(
    h_mps: Floats, position_m: Floats, interval_s: Floats, wake: Wake, rate_hz: float = 1000.0
) -> tuple[Floats, Floats]:
    """Return v_wake (n, 3) used by each tick's drag, and Σ|e|/S (n,), for velocities (n, 3) of the tail."""
    wake_mps, size_mps = np.zeros_like(h_mps), np.zeros(len(h_mps))
    wake_list, elements = new_wake_list(wake, rate_hz)
    _wakes(wake_list[0], elements, h_mps, position_m, np.rint(interval_s * 1e9).astype(np.int64), wake_mps, size_mps)
    return wake_mps, size_mps


@evidence_kernel
def _wakes(
    wake: Any, elements: Any, h_mps: Any, position_m: Any, interval_ns: Any, wake_mps: Any, size_mps: Any
) -> None:
    for k in range(h_mps.shape[0]):
        size_mps[k] = sum_elements(wake, elements, wake_mps[k])
        store_element(wake, elements, h_mps[k], position_m[k], interval_ns[k])


@kernel
def store_element(wake: Any, elements: Any, h_mps: Any, position_m: Any, interval_ns: int) -> None:
    """Advance the time, and store the velocity ``h_mps`` (3,) at ``position_m`` (3,) if the rules require it."""
    speed_mps = norm(h_mps)
    wake.age_ns += interval_ns
    wake.arc_m += speed_mps * (interval_ns * 1e-9)
    rests = speed_mps < _REST_MPS
    if not rests and wake.stored > 0 and distance(position_m, wake.stored_at_m) < wake.resolution_m:
        return
    if not rests and _begins_segment(wake, elements, h_mps, speed_mps):
        wake.segment += 1
    element = elements[wake.stored % wake.length]
    copy(h_mps, element.velocity_mps)
    copy(position_m, wake.stored_at_m)
    element.speed_mps = 0.0 if rests else speed_mps
    element.segment, element.age_ns, element.arc_m = wake.segment, wake.age_ns, wake.arc_m
    wake.stored += 1
    wake.held = min(wake.held + 1, wake.length)


@kernel
def _begins_segment(wake: Any, elements: Any, h_mps: Any, speed_mps: float) -> bool:
    """Return whether a velocity begins a new segment; the search starts at the newest element."""
    reference = -1
    for number in range(wake.stored - 1, wake.stored - wake.held - 1, -1):
        element = elements[number % wake.length]
        if element.speed_mps == 0.0:
            continue
        if element.segment != wake.segment:
            break
        reference = number
        if wake.arc_m - element.arc_m >= wake.breaking_span_m:
            break
    if reference < 0:
        return True
    element = elements[reference % wake.length]
    along = 0.0
    for axis in range(3):
        along += h_mps[axis] * element.velocity_mps[axis]
    return bool(along < (wake.breaking_cosine - 1e-12) * speed_mps * element.speed_mps)


@kernel
def sum_elements(wake: Any, elements: Any, wake_mps: Any) -> float:
    """Write the v_wake that the next tick's drag uses into ``wake_mps`` (3,); return Σ|e|/S."""
    sums, newest = wake.sums, -1
    sums[:] = 0.0
    for number in range(wake.stored - 1, wake.stored - wake.held - 1, -1):
        element = elements[number % wake.length]
        if element.speed_mps == 0.0:
            continue
        if newest < 0 or element.segment != elements[newest].segment:
            _add_segment(sums, elements, newest)
            newest = number % wake.length
        size = element.speed_mps * math.exp(wake.log_decay_pns * (wake.age_ns - element.age_ns))
        _add(sums, 3, size)
        _add(sums, 4, size)
        _add(sums, 5, size * size)
    _add_segment(sums, elements, newest)
    speeds, squares = sums[4, 0] + sums[4, 1], sums[5, 0] + sums[5, 1]
    for axis in range(3):
        wake_mps[axis] = (sums[axis, 0] + sums[axis, 1]) / wake.scaling
    size_mps = norm(wake_mps)
    if speeds == 0.0 or size_mps == 0.0:
        wake_mps[:] = 0.0
        return float(speeds / wake.scaling)
    gain = _gain(size_mps * speeds / squares, wake.exponent)
    for axis in range(3):
        wake_mps[axis] *= gain
    return float(speeds / wake.scaling)


@kernel
def _add_segment(sums: Any, elements: Any, newest: int) -> None:
    """Add the magnitudes of a segment in the direction of its newest element, and begin another segment."""
    if newest >= 0:
        for axis in range(3):
            along = elements[newest].velocity_mps[axis] / elements[newest].speed_mps
            _add(sums, axis, along * (sums[3, 0] + sums[3, 1]))
    sums[3, 0] = sums[3, 1] = 0.0


@kernel
def _add(sums: Any, row: int, value: float) -> None:
    """Add to a compensated sum, whose rounding error is in the next column."""
    total = sums[row, 0] + value
    if abs(sums[row, 0]) >= abs(value):
        sums[row, 1] += (sums[row, 0] - total) + value
    else:
        sums[row, 1] += (value - total) + sums[row, 0]
    sums[row, 0] = total


@evidence_kernel
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
    """Return v_wake (n, 3) of a local wake in which every element keeps its own position and age.

    v_tail = (1/S) Σ_j (σ_0/σ_j)³ exp(−r_j²/2σ_j²) λ^age_j e_j over the newest N elements, including zero ones, with
    σ_j² = σ_0² + 2ν age_j; then the fill response is applied, with the mean speed weighted in the same way.
    """
    ticks = len(h_mps)
    wake_mps = np.zeros((ticks, 3))
    for k in range(ticks):
        tail, speeds, squares, age_s = np.zeros(3), 0.0, 0.0, 0.0
        for j in range(k - 1, max(k - 1 - length, -1), -1):
            speed = math.sqrt(np.sum(h_mps[j] ** 2))
            if speed >= 1e-3:
                spread_m2 = reach_m**2 + 2 * spreading_m2ps * age_s
                decayed = decay ** (age_s / 1e-3)
                proximity = (reach_m**2 / spread_m2) ** 1.5 * math.exp(
                    -0.5 * np.sum((position_m[k] - position_m[j]) ** 2) / spread_m2
                )
                tail += proximity * decayed * h_mps[j] / scaling
                speeds += proximity * decayed * speed
                squares += proximity * (decayed * speed) ** 2
            age_s += interval_s[j]
        if speeds > 0.0:
            wake_mps[k] = tail * _gain(math.sqrt(np.sum(tail**2)) * speeds / squares, exponent)
    return wake_mps


@kernel
def _gain(fill: float, exponent: float) -> float:
    """Return the gain of the tail for a fill."""
    return float(fill ** (exponent - 1.0) if exponent >= 1.0 else (fill**2 + 0.05**2) ** ((exponent - 1.0) / 2.0))


_RATES_PER_S: Final = np.array([0.0212334, 0.257773, 1.39978, 7.11516, 36.0112, 182.242, 927.902])
_WEIGHTS_RPS: Final = np.array([0.33973, 0.52101, 1.09144, 2.44114, 5.48942, 12.3529, 28.26937])


class Constants(NamedTuple):
    """The constants c_m, c_y, c_z, c_s, β and R₀ that ``liquid-study cfd --refit`` fits to the fluid solver."""

    c_m: float
    c_y: float
    c_z: float
    c_s: float
    beta: float
    r_0: float


CONSTANTS: Final = Constants(c_m=0.268, c_y=0.756, c_z=3.15, c_s=0.972, beta=2.96, r_0=11.0)


@evidence_kernel
def over_stokes(reynolds: float) -> float:
    """Return φ, the steady drag as a multiple of Stokes drag."""
    if reynolds == 0:
        return 1.0
    oseen = 3 / 16 * reynolds / (1 + 0.450 * math.sqrt(reynolds))
    return 1 + oseen + 0.486 / 24 * reynolds / (1 + math.pow(4040 / reynolds, 0.70))


def unsteady_n(
    scene: Scene, w_mps: Floats, acceleration_mps2: Floats, interval_s: Floats, constants: Constants = CONSTANTS
) -> Floats:
    """Return the force (n, 3) [N] in the scene's first liquid, which has a viscosity, at rest and everywhere.

    ``w_mps`` (n, 3) are velocities [m/s, scene], and ``acceleration_mps2`` their derivatives. Before the first row, the
    body is assumed to have moved at the first velocity.
    """
    liquid, diameter_m = scene.liquids[0], scene.body.diameter_m
    density_kg_m3, viscosity_pa_s = liquid.density_kg_m3, liquid.viscosity_pa_s or math.nan
    stokes_nspm = 3 * math.pi * viscosity_pa_s * diameter_m
    beyond_w = late_mps(w_mps, acceleration_mps2, interval_s, diameter_m, viscosity_pa_s / density_kg_m3, constants)
    added_kg = 0.5 * density_kg_m3 * scene.body.volume_m3
    return -stokes_nspm * (w_mps + beyond_w) - added_kg * acceleration_mps2


@evidence_kernel
def late_mps(
    w_mps: Floats,
    acceleration_mps2: Floats,
    interval_s: Floats,
    diameter_m: float,
    nu_m2ps: float,
    constants: Constants,
) -> Floats:
    """Return y + h (n, d) [m/s], excess drag and history over the Stokes drag per unit speed, in d dimensions."""
    result = np.empty_like(w_mps)
    z, s = w_mps[0].copy(), w_mps[0].copy()
    y = (over_stokes(math.sqrt((z**2).sum()) * diameter_m / nu_m2ps) - 1) * z
    m = np.zeros((len(_RATES_PER_S), len(z)))
    for k in range(len(w_mps)):
        w, dw, dt = w_mps[k], acceleration_mps2[k], interval_s[k]
        z2, s2 = (z**2).sum(), (s**2).sum()
        u_mps = math.sqrt((w**2).sum() + z2)
        overtaking = min(max(1 - (w * z).sum() / z2, 0.0), 1.0) if z2 > 0 else 0.0
        back = min(max(-(w * s).sum() / s2, 0.0), 1.0) if s2 > 0 else 0.0
        re_u = u_mps * diameter_m / nu_m2ps
        e = w - re_u / (re_u + constants.r_0) * (constants.beta * overtaking * z + back * s)
        phi = over_stokes(math.sqrt((e**2).sum()) * diameter_m / nu_m2ps)
        y = y - math.expm1(-constants.c_y * u_mps / diameter_m * dt) * (phi * e - w - y)
        z = z - math.expm1(-constants.c_z * u_mps / diameter_m * dt) * (w - z)
        s = s - math.expm1(-constants.c_s * u_mps / diameter_m * dt) * (w - s)
        remembered = 2 * math.sqrt(dt) * dw
        for i in range(len(_RATES_PER_S)):
            decay_per_s = _RATES_PER_S[i] + constants.c_m * u_mps / diameter_m
            gained_s = -math.expm1(-decay_per_s * dt) / decay_per_s
            m[i] = math.exp(-decay_per_s * dt) * m[i] + gained_s * dw
            remembered = remembered + _WEIGHTS_RPS[i] * (m[i] - gained_s * dw)
        result[k] = y + diameter_m / (2 * math.sqrt(math.pi * nu_m2ps)) * remembered
    return result


_STEPS: Final = 50
"""Integration steps of the elastic state per tick."""


def non_newtonian_n(scene: Scene, w_mps: Floats, interval_s: Floats, *, slack_m: float = 0.0) -> Floats:
    """Return the force (n, 3) [N] in the scene's first liquid, which has a flow curve, at rest and everywhere.

    ``w_mps`` (n, 3) are velocities [m/s, scene], ``interval_s`` (n,) the times since the previous tick [s]. Motion
    within ``slack_m`` [m, scene], two encoder counts in the servo, does not relax elastic stress.
    """
    liquid, diameter_m = scene.liquids[0], scene.body.diameter_m
    law = liquid.non_newtonian
    speeds_mps = np.linalg.norm(w_mps, axis=1)
    if isinstance(law, Maxwell):
        viscous_mps = _relax_velocity(w_mps, interval_s, law.relaxation_time_s)
        held, speeds_mps = np.zeros_like(w_mps), np.linalg.norm(viscous_mps, axis=1)
    else:
        viscous_mps, held = w_mps, np.zeros_like(w_mps)
        if (yield_n := laws.yield_n(law, diameter_m)) > 0:
            per_m = STIFFNESS_NPM / scene.scale / yield_n
            held = _strains(w_mps, interval_s, per_m, slack_m)
    parts_n = [laws.steady_force_n(law, liquid.density_kg_m3, diameter_m, float(speed)) for speed in speeds_mps]
    held_n, viscous_n = np.array(parts_n).T
    directions = viscous_mps / np.maximum(speeds_mps, math.ulp(0.0))[:, np.newaxis]
    force_n: Floats = -(held_n[:, np.newaxis] * held + viscous_n[:, np.newaxis] * directions)
    return force_n


def _relax_velocity(w_mps: Floats, interval_s: Floats, relaxation_s: float) -> Floats:
    """Return v (n, 3) [m/s] that solves v' = (w − v)/λ, exact for a constant velocity in each tick."""
    v = np.zeros_like(w_mps)
    for k, w in enumerate(w_mps):
        previous = v[k - 1] if k else np.zeros(3)
        v[k] = w + (previous - w) * math.exp(-interval_s[k] / relaxation_s)
    return v


@evidence_kernel
def _strains(w_mps: Any, interval_s: Any, per_m: float, slack_m: float) -> Any:
    """Return s/s_y (n, 3) that solves ds = dp − |dp| s/s_y, with |dp| counted beyond the slack."""
    strains = np.zeros(w_mps.shape)
    strain, ahead_m = np.zeros(3), np.zeros(3)
    for k in range(len(w_mps)):
        step_m = w_mps[k] * (interval_s[k] / _STEPS)
        for _ in range(_STEPS):
            ahead_m += step_m
            distance_m = math.sqrt(np.sum(ahead_m**2))
            slipped_m = max(distance_m - slack_m, 0.0)
            if slipped_m > 0.0:
                ahead_m *= slack_m / distance_m
            strain += (step_m - slipped_m * strain) * per_m
            strain /= max(math.sqrt(np.sum(strain**2)), 1.0)
        strains[k] = strain
    return strains

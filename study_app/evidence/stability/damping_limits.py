"""The maximum stable damping of a free handle, measured with the real tick, and the table of limits."""

import itertools
import math
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from typing import Final

import numpy as np

from study_app.evidence.stability.bench import Bench
from study_app.evidence.stability.stability_cases import STROKE, THROWN, Case
from study_app.haptics.model.device_dynamics import MOST_DELAY, Dynamics
from study_app.haptics.model.effects import Drag
from study_app.haptics.model.estimators import NAMED
from study_app.haptics.model.scene import Ewma, Kalman, Knee, Liquid, Raw, Scene, Velocity
from study_app.haptics.model.slope_limits import DampingLimits, Entry
from study_app.haptics.runtime.closed_loop import empty_trace

PERIODS_S: Final = (0.5e-3, 1e-3, 2e-3, 4e-3)
DELAYS: Final = (0, 1, 2, 3, 4)
FREE_HANDLE_KG: Final = 0.1
_FRICTION_NSPM: Final = 0.5

_UNALTERED_NSPM: Final = 53.0
"""Limit at 1 kHz and up to one tick of delay with "ewma" and "kalman", which hardly alters the shipped liquids. Light
oil has a secant of 55 N·s/m where it reaches 8 N at a scale of 10, so the limit removes only 4 % of this force. With
"ewma", the limit is 75 % of the greatest stable damping of a free handle of 0.1 kg."""
_UNALTERED_SHARE: Final = 0.75
"""Greatest proportion of the stable damping under these conditions with another filter."""
_UNALTERED_INERTIA_SHARE: Final = 0.85
"""Proportion of this limit for added mass and history, so that those of honey are not limited either."""
_INERTIA_SHARE: Final = 0.3
"""Proportion of a drag limit for added mass and history under other conditions."""
_SHARE: Final = 0.5
"""Proportion of the stable damping under other conditions: the slope of a quadratic law is twice its secant."""
_FAST_SHARE: Final = 0.4
"""Proportion of the stable damping above 1 kHz, where an encoder count corresponds to a greater speed and the slew
limit permits a steeper force."""
_FAST_NSPM: Final = 40.0
"""Greatest limit above 1 kHz [N·s/m]."""
_FAST_KALMAN_NSPM: Final = 22.0
"""Greatest limit above 1 kHz with "kalman" [N·s/m], which passes more of a release while a wake breaks."""
_KALMAN_SHARE: Final = 0.64
"""Proportion of the limits above with "kalman", up to 1 kHz, except where forces are not limited. With 1 and a delay
one tick longer than assumed, a held handle was noisy in tar at 250 Hz, and a released one oscillated at 500 Hz; with
0.8, a released handle was noisy in gear oil at a scale of 40 with 3 ticks of delay."""
_COUNT_N: Final = 0.25
"""The greatest force that one count of a Falcon's encoder may cause [N]."""
_COUNT_M: Final = 38e-6
NOMINAL_S: Final = 1e-3

_REST_WITH_COUNTS_MPS: Final = 0.04
"""Speed below which a handle counts as at rest if the encoder has counts, which alone cause such a motion [m/s]."""

_THROWN_MPS = 0.02
_DECAYED = 0.05
_DURATION_S = 3.0
_STEP = 1.01


def boundary_nspm(
    velocity: Velocity,
    period_s: float,
    delay: int,
    *,
    believed: int | None = None,
    mass_kg: float = FREE_HANDLE_KG,
    friction_nspm: float = _FRICTION_NSPM,
) -> float:
    """Return the greatest linear damping [N·s/m] at which a released handle comes to rest, to 1 %.

    ``believed`` is the delay that the loop assumes, by default ``delay``. The safety layer is off. The encoder is
    exact, except for "kalman": this filter is nonlinear in the counts, so they have the size of a Falcon's.
    """
    believed = delay if believed is None else believed
    low, high = 0.1, 1e5
    while high / low > _STEP:
        middle = math.sqrt(low * high)
        if _handle_comes_to_rest(velocity, period_s, (delay, believed), middle, mass_kg, friction_nspm):
            low = middle
        else:
            high = middle
    return low


def passive_nspm(friction_nspm: float, period_s: float = NOMINAL_S, delay: int = 0, alpha: float = 0.1) -> float:
    """Return the greatest damping B that is passive on a handle with friction b, for this filter and delay.

    After Colgate & Schenkel (1997) with K = 0, for v filtered by v += α(u - v): b > B · sup -α Re(e^(-jdθ) / (e^jθ - (1
    - α))) over 0 < θ ≤ π, which is b > B α/(2 - α) for d = 0.
    """
    weight = _weight(alpha, period_s)
    angles = np.linspace(1e-4, math.pi, 20_001)
    lags = np.exp(-1j * delay * angles) / (np.exp(1j * angles) - (1.0 - weight))
    return float(friction_nspm / np.max(-weight * lags.real))


def measured_estimators() -> tuple[Velocity, ...]:
    """Return the estimators that the table contains."""
    return (*(Ewma(alpha=alpha) for alpha in NAMED["ewma"].measured), Raw(), Kalman())


def measure_limits(
    velocities: Iterable[Velocity] | None = None, *, executor: Executor | None = None
) -> Iterator[Entry]:
    """Yield the table of limits, line by line, for all or some estimators; in parallel with an executor."""
    loops = itertools.product(velocities or measured_estimators(), PERIODS_S, DELAYS[1:])
    map_loops = map if executor is None else executor.map
    yield from map_loops(_entry, *zip(*loops, strict=True))


def _entry(velocity: Velocity, period_s: float, delay: int) -> Entry:
    unaltered = velocity.kind in {"ewma", "kalman"} and period_s == NOMINAL_S and delay <= 1
    drag = _limit_nspm(velocity, period_s, delay, unaltered=unaltered)
    inertia = (_UNALTERED_INERTIA_SHARE if unaltered else _INERTIA_SHARE) * drag
    limits = DampingLimits(_round_down(drag), _round_down(inertia))
    return Entry(velocity.kind, velocity.alpha if isinstance(velocity, Ewma) else None, period_s, delay, limits)


def _limit_nspm(velocity: Velocity, period_s: float, delay: int, *, unaltered: bool) -> float:
    """Return the damping limit: a fraction of the boundary, less if it is noisy or the filter may be wrong.

    The raw difference passes one encoder count on in full, EWMA according to `_weight`.
    """
    is_fast = period_s < NOMINAL_S
    proportion = _UNALTERED_SHARE if unaltered else _FAST_SHARE if is_fast else _SHARE
    limits = [proportion * boundary_nspm(velocity, period_s, delay)]
    if unaltered:
        limits.append(_UNALTERED_NSPM)
    if is_fast:
        limits.append(_FAST_KALMAN_NSPM if isinstance(velocity, Kalman) else _FAST_NSPM)
    if not isinstance(velocity, Kalman):
        weight = _weight(velocity.alpha, period_s) if isinstance(velocity, Ewma) else 1.0
        limits.append(_COUNT_N * period_s / _COUNT_M / weight)
    else:
        mistaken_delays = (mistaken_delay for mistaken_delay in (delay - 1, delay + 1) if mistaken_delay <= MOST_DELAY)
        limits += [
            boundary_nspm(velocity, period_s, mistaken_delay, believed=delay) for mistaken_delay in mistaken_delays
        ]
        limits.append(_UNALTERED_SHARE * boundary_nspm(Ewma(), period_s, delay))
        if not unaltered and not is_fast:
            return _KALMAN_SHARE * min(limits)
    return min(limits)


def _weight(alpha: float, period_s: float) -> float:
    """Return the weight of the newest difference in a loop of this period."""
    return float(1.0 - (1.0 - alpha) ** (period_s / NOMINAL_S))


def _round_down(value: float) -> float:
    return math.floor(value * 10) / 10


def _handle_comes_to_rest(
    velocity: Velocity,
    period_s: float,
    delays: tuple[int, int],
    damping_nspm: float,
    mass_kg: float,
    friction_nspm: float,
) -> bool:
    """Return whether a handle thrown into a linear damper comes to rest; ``delays`` are (true, believed)."""
    has_counts = isinstance(velocity, Kalman)
    case = Case(
        rate_hz=1.0 / period_s,
        delay=delays[0],
        believed=delays[1],
        hand=THROWN,
        motion=STROKE,
        speed_mps=_THROWN_MPS,
        mass_kg=mass_kg,
        viscous_nspm=friction_nspm,
    )
    stokes = Liquid(
        id="damper",
        density_kg_m3=1.0,
        viscosity_pa_s=damping_nspm / (3.0 * math.pi * Scene().body.diameter_m),
        drag=Drag(law="schiller-naumann"),
    )
    scene = Scene(scale=1.0, rate_hz=1.0 / period_s, liquids=(stokes,), velocity=velocity, knee=Knee(law="none"))
    limits = DampingLimits(damping_nspm, damping_nspm)
    dynamics = Dynamics(delay_s=delays[1] * period_s, count_m=_COUNT_M, mass_kg=mass_kg)
    bench = Bench(case, safe=False, limits=limits, scene=scene, dynamics=dynamics)
    bench.loop.moving_s, bench.handle.motor_step_n = math.inf, 0.0
    bench.handle.quantum_m = _COUNT_M if has_counts else 0.0
    bench.begin()
    trace = empty_trace(round(_DURATION_S / period_s))
    bench.run(trace, 0, math.inf)
    speeds_mps = np.linalg.norm(trace.velocity_mps[-len(trace) // 10 :], axis=1)
    return bool(
        not bench.loop.broken and speeds_mps.max() < (_REST_WITH_COUNTS_MPS if has_counts else _DECAYED * _THROWN_MPS)
    )

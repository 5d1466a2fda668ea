"""How much damping a free handle bears, measured on the real tick, and the table of limits that follows from it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from study_app.evaluation.stability.cases import ESTIMATORS
from study_app.evaluation.stability.loop import LOOP, STROKE, TRACE, begin, run
from study_app.haptics.layout import SAMPLE, records
from study_app.haptics.limits import INERTIA_SHARE, Bearable, Entry
from study_app.haptics.pace import new_pace
from study_app.haptics.pack import pack
from study_app.haptics.plant import new_handle
from study_app.haptics.safety import new_safety
from study_app.haptics.scene import Body, Drag, Knee, Liquid, Scene, Velocity

PERIODS_S: Final = (0.5e-3, 1e-3, 2e-3, 4e-3)
DELAYS: Final = (0, 1, 2, 3, 4)
FREE_HANDLE_KG: Final = 0.1
FRICTION_NSPM: Final = 0.5

FELT_NSPM: Final = 53.0
"""What is felt as it is at 1 kHz, up to one tick of delay, with "ewma": light oil has a secant of 55 N·s/m where it
reaches 8 N at scale 10; this takes 4 % of that one force, and is 75 % of what a free handle of 0.1 kg bears."""
FELT_INERTIA_SHARE: Final = 0.85
"""Of this limit, for added mass and history: those of honey are felt as they are, too."""
SHARE: Final = 0.5
"""Of the boundary that a limit takes elsewhere: a quadratic law has twice the slope of its secant."""
FAST_SHARE: Final = 0.4
"""The same beyond 1 kHz, where a count of the encoder is a greater speed and 0.5 N a tick a steeper force."""
FAST_NSPM: Final = 40.0
"""The most there."""
COUNT_N: Final = 0.25
"""The most that one count of a Falcon's encoder may be felt as [N]."""
COUNT_M: Final = 38e-6
WINDOWS: Final = ("line", "foaw")
NOMINAL_S: Final = 1e-3

_THROWN_MPS = 0.02
_LASTS_S = 3.0
_STEP = 1.01


def boundary_nspm(
    velocity: Velocity,
    period_s: float,
    delay: int,
    *,
    mass_kg: float = FREE_HANDLE_KG,
    friction_nspm: float = FRICTION_NSPM,
) -> float:
    """Return the greatest linear damping [N·s/m] under which a handle let go comes to rest, to 1 %.

    The safety layer is off, the encoder exact.
    """
    low, high = 0.1, 1e5
    while high / low > _STEP:
        middle = math.sqrt(low * high)
        if _comes_to_rest(velocity, period_s, delay, middle, mass_kg, friction_nspm):
            low = middle
        else:
            high = middle
    return low


def passive_nspm(friction_nspm: float, period_s: float = NOMINAL_S, delay: int = 0, alpha: float = 0.1) -> float:
    """Return the greatest damping B that filter and delay leave passive on a handle of friction b, whatever holds it.

    After Colgate & Schenkel (1997) with K = 0, for v filtered by v += α(u - v): b > B · sup -α Re(e^(-jdθ) / (e^jθ -
    (1 - α))) over 0 < θ ≤ π, which is b > B α/(2 - α) for d = 0.
    """
    weight = 1.0 - (1.0 - alpha) ** (period_s / NOMINAL_S)
    angles = np.linspace(1e-4, math.pi, 20_001)
    lags = np.exp(-1j * delay * angles) / (np.exp(1j * angles) - (1.0 - weight))
    return float(friction_nspm / np.max(-weight * lags.real))


def measure_limits() -> Iterator[Entry]:
    """Yield the table of limits, line by line."""
    for name, velocity in ESTIMATORS.items():
        for period_s in PERIODS_S:
            for delay in DELAYS[1:]:
                felt = name == "ewma" and period_s == NOMINAL_S and delay <= 1
                drag = FELT_NSPM if felt else _bearable_nspm(name, velocity, period_s, delay)
                inertia = (FELT_INERTIA_SHARE if felt else INERTIA_SHARE) * drag
                yield Entry(name, period_s, delay, Bearable(_rounded_down(drag), _rounded_down(inertia)))


def _bearable_nspm(name: str, velocity: Velocity, period_s: float, delay: int) -> float:
    """Return the limit of drag where it need not be felt as it is: a share of the boundary, less where that is noisy.

    Only the raw difference passes a count of the encoder on whole. A window has a fixed number of samples: in a faster
    loop it is shorter, its slope noisier in the same ratio.
    """
    fast = period_s < NOMINAL_S
    if name in WINDOWS and fast:
        return _bearable_nspm(name, velocity, NOMINAL_S, delay) * period_s / NOMINAL_S
    limit = (FAST_SHARE if fast else SHARE) * boundary_nspm(velocity, period_s, delay)
    if name == "raw":
        limit = min(limit, COUNT_N * period_s / COUNT_M)
    return min(limit, FAST_NSPM) if fast else limit


def _rounded_down(value: float) -> float:
    return math.floor(value * 10) / 10


def _comes_to_rest(
    velocity: Velocity, period_s: float, delay: int, damping_nspm: float, mass_kg: float, friction_nspm: float
) -> bool:
    """Return whether a handle thrown into a linear damper comes to rest."""
    body = Body()
    stokes = Liquid(
        id="damper",
        density_kg_m3=1.0,
        viscosity_pa_s=damping_nspm / (3.0 * math.pi * body.diameter_m),
        drag=Drag(law="schiller-naumann"),
    )
    scene = Scene(scale=1.0, rate_hz=1.0 / period_s, liquids=(stokes,), velocity=velocity, knee=Knee(law="none"))
    loop = records(LOOP, 1)[0]
    loop.motion, loop.speed_mps, loop.moving_s, loop.until_s = STROKE, _THROWN_MPS, math.inf, math.inf
    handle = new_handle(mass_kg=mass_kg, viscous_nspm=friction_nspm, motor_limit_n=8.0, delay=delay)
    handle.held = 0
    begin(loop, handle)
    trace = records(TRACE, round(_LASTS_S / period_s))
    run(
        pack(scene, delay_ticks=delay, limits=Bearable(damping_nspm, damping_nspm)),
        new_safety()[0],
        records(SAMPLE, 1)[0],
        handle,
        new_pace(period_s),
        loop,
        trace,
        0,
    )
    speeds_mps = np.linalg.norm(trace.velocity_mps[-len(trace) // 10 :], axis=1)
    return bool(not loop.broken and speeds_mps.max() < 0.05 * _THROWN_MPS)

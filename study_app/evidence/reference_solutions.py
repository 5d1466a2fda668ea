"""References for models of a liquid: motions with their forces, and the errors of a force against them.

There are two kinds. *Numerical*: the definition of the model itself, summed without rounding errors. *Physical*: the
known forces on a real sphere: measured steady drag and the exact forces of creeping flow. None shares code with
``haptics.kernels.effects``.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from study_app.evidence.reference_model import Constants, respond
from study_app.haptics.model.effects import Drag
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.laws import Law
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Effect, Liquid, Scene
from study_app.lab.identify.measured_force import vectors_x


def with_effects(scene: Scene, *effects: Effect, law: Law | None = None) -> Scene:
    """Return the scene with other effects and, if given, another drag law."""
    changes: dict[str, Any] = {"effects": effects} | ({} if law is None else {"drag": Drag(law=law)})
    return scene.model_copy(update={"liquids": (scene.liquids[0].model_copy(update=changes),)})


def without_buoyancy(scene: Scene) -> Scene:
    """Return the scene without buoyancy, with its liquid's other effects named explicitly."""
    scene = resolve(scene)
    return with_effects(scene, *(name for name in scene.liquids[0].effects if name != "buoyancy"))


_RADIUS_M: Final = 0.03
_TURNS: Final = 1.5
_STIRRING_S: Final = 3.0
_REST_S: Final = 1.0
_STRETCHES: Final = 3


def stirring_motion(scale: float, rate_hz: float) -> Motion:
    """Return a stirring motion: 1.5 circles of 30 mm in 3 s, a rest, the same backward, a rest, and forward again.

    Each segment has minimum jerk (Flash & Hogan 1985) with a small vertical motion: up to 0.18 m/s at the hand. In the
    scene, it is ``scale`` times as large.
    """
    stretch_s = _STIRRING_S + _REST_S
    t_s = np.arange(round(_STRETCHES * stretch_s * rate_hz) + 1) / rate_hz
    stretch = np.minimum(np.floor(t_s / stretch_s + 1e-9), _STRETCHES - 1)
    phase = np.clip((t_s - stretch * stretch_s) / _STIRRING_S, 0.0, 1.0)
    direction = np.where(stretch % 2 == 0, 1.0, -1.0)
    angle = 2 * math.pi * _TURNS * (phase**3 * (10 - 15 * phase + 6 * phase**2) * direction + (direction < 0))
    angular_per_s = 2 * math.pi * _TURNS * direction * 30 * phase**2 * (1 - phase) ** 2 / _STIRRING_S
    radius_m = scale * _RADIUS_M
    position_m = radius_m * np.column_stack([np.cos(angle), 0.1 * np.cos(2 * angle), np.sin(angle)])
    tangent = radius_m * np.column_stack([-np.sin(angle), -0.2 * np.sin(2 * angle), np.cos(angle)])
    return Motion(t_s, position_m, velocity_mps=tangent * angular_per_s[:, np.newaxis])


def stroke_motion(speed_mps: float, rate_per_s: float, cycles: int, rate_hz: float) -> Motion:
    """Return back-and-forth strokes along x, v = speed · sin ωt with ω = ``rate_per_s``."""
    t_s = np.arange(round(cycles * 2 * math.pi / rate_per_s * rate_hz) + 1) / rate_hz
    position_m = speed_mps / rate_per_s * (1 - np.cos(rate_per_s * t_s))
    return along_x(t_s, position_m, speed_mps * np.sin(rate_per_s * t_s))


def with_velocity(motion: Motion) -> Motion:
    """Return the motion with its velocities, computed by central differences if it has none."""
    if motion.velocity_mps is not None or len(motion.t_s) < 2:
        return motion
    return Motion(motion.t_s, motion.position_m, velocity_mps=np.gradient(motion.position_m, motion.t_s, axis=0))


def along_x(t_s: Floats, x_m: Floats, velocity_mps: Floats) -> Motion:
    """Return a motion along x from times [s], positions [m] and velocities [m/s], each (n,)."""
    return Motion(t_s, vectors_x(x_m), velocity_mps=vectors_x(velocity_mps))


COUNT_M: Final = 38e-6
"""One count of the Falcon's encoders, at the hand [m]."""


DRAG_POINTS: Final = (
    (0.1585, 169.8),
    (0.4786, 58.88),
    (3.02, 10.86),
    (7.015, 5.623),
    (15.49, 3.388),
    (57.54, 1.479),
    (144.5, 0.9204),
    (264.9, 0.7194),
    (512.9, 0.5623),
    (1000.0, 0.4786),
    (1862.0, 0.4365),
    (3162.0, 0.4074),
    (4764.0, 0.3890),
    (8375.0, 0.3981),
    (1.556e4, 0.4395),
    (2.648e4, 0.4571),
    (3.467e4, 0.4775),
    (5.888e4, 0.4732),
    (1e5, 0.4624),
    (1.702e5, 0.4395),
    (2.317e5, 0.4046),
)
"""(Re, C_d) of smooth spheres by experiment, below the drag crisis: CalcDEMma drag laboratory, Indiana University of
Pennsylvania. Its lowest point (Re 0.0588, C_d 492) is omitted because it is 20 % above Stokes' law, which is exact
there. The next two are still 8 to 9 % above Oseen's law, and those at Re 1 to 2 some 4 to 7 % above the fluid solver.
Equally small differences between drag laws therefore cannot be distinguished from the scatter of the experiments."""

_OSEEN_REYNOLDS: Final = 0.5
_CREEPING_REYNOLDS: Final = 0.01
_START_S: Final = 2.0
_UNCOUNTED_S: Final = 0.01  # at a step the added-mass force is infinite for an instant
_SPEEDS: Final = 60
CYCLES: Final = 6


@dataclass(frozen=True, eq=False)
class Case:
    """A motion with its exact velocities, the true force (n, 3) [N], and the rows that are compared (n,)."""

    motion: Motion
    force_n: Floats
    counted: NDArray[np.bool_]


@dataclass(frozen=True, eq=False, kw_only=True)
class Truth:
    """A reference solution; ``name`` is used in tables and figures, ``source`` cites it.

    ``computing_s`` is the solver's time per second of motion, with its machine; otherwise None. ``left_out`` are the
    constants of unsteady drag that were fitted without this reference; None if it is in no fit.
    """

    name: str
    source: str
    cases: tuple[Case, ...]
    computing_s: float | None = None
    machine: str = ""
    left_out: Constants | None = None


def definition_truth(scene: Scene, motion: Motion) -> Truth:
    """Return drag and wake of the scene's liquid from the exact definition, for a motion with its velocities."""
    force_n = respond(scene, motion).force_n
    source = "exact definition of the wake: full length, full rate, float64, exact sums"
    return Truth(name="definition", source=source, cases=(Case(motion, force_n, np.ones(len(force_n), bool)),))


def measured_drag_n(liquid: Liquid, diameter_m: float, speed_mps: Floats) -> Floats:
    """Return the drag [N] of a sphere at steady speeds (n,), interpolated between `DRAG_POINTS`.

    Between the points, log C_d is a smooth monotonic interpolation over log Re (Fritsch & Carlson 1980); below them the
    force is proportional to the speed, above them to its square.
    """
    reynolds_per_mps = liquid.density_kg_m3 * diameter_m / (liquid.viscosity_pa_s or math.nan)
    points = np.log(np.array(DRAG_POINTS))
    minimum, maximum = DRAG_POINTS[0][0], DRAG_POINTS[-1][0]
    reynolds = speed_mps * reynolds_per_mps
    clipped = np.clip(reynolds, minimum, maximum)
    coefficient = np.exp(PchipInterpolator(points[:, 0], points[:, 1])(np.log(clipped)))
    pressure_kg_m = 0.5 * liquid.density_kg_m3 * math.pi * (diameter_m / 2) ** 2
    force_n: Floats = pressure_kg_m * coefficient * speed_mps * np.maximum(speed_mps, minimum / reynolds_per_mps)
    return force_n


def steady_truth(scene: Scene) -> Truth | None:
    """Return measured steady drag up to the scene's greatest speed, or None if all measurements are at higher Re."""
    liquid, diameter_m = scene.liquids[0], scene.body.diameter_m
    reynolds_per_mps = liquid.density_kg_m3 * diameter_m / (liquid.viscosity_pa_s or math.nan)
    fastest_mps = scene.motion_in(liquid).speed_mps or 0.0
    speeds = np.linspace(0, fastest_mps, _SPEEDS + 1)[1:]
    known = speeds[(speeds * reynolds_per_mps >= DRAG_POINTS[0][0]) & (speeds * reynolds_per_mps <= DRAG_POINTS[-1][0])]
    if len(known) == 0:
        return None
    forces = measured_drag_n(liquid, diameter_m, known)
    cases = []
    for speed_mps, force_n in zip(known.tolist(), forces.tolist(), strict=True):
        t_s = np.arange(2) / scene.rate_hz
        motion = along_x(t_s, t_s * speed_mps, np.full(2, speed_mps))
        cases.append(Case(motion, vectors_x(np.full(2, -force_n)), np.array([False, True])))
    between = f"Re {known[0] * reynolds_per_mps:.2g} to {known[-1] * reynolds_per_mps:.2g}"
    slow = [(reynolds, drag) for reynolds, drag in DRAG_POINTS if reynolds < _OSEEN_REYNOLDS]
    above = max(drag * reynolds / 24 / (1 + 3 / 16 * reynolds) - 1 for reynolds, drag in slow)  # C_d of Oseen 1910
    scatter = f", which lie up to {100 * above:.0f} % above Oseen's law for slow flow"
    low = scatter if known[0] * reynolds_per_mps < _OSEEN_REYNOLDS else ""
    return Truth(name="steady drag", source=f"experiments with spheres, {between}{low}", cases=tuple(cases))


def oscillation_truth(scene: Scene) -> Truth:
    """Return the force on a sphere that oscillates in creeping flow, after the initial transient.

    Landau & Lifshitz, Fluid Mechanics, §24: F = −6πµR(1 + R/δ) u − 3πR²√(2µρ/ω)(1 + 2R/9δ) du/dt, δ = √(2µ/ρω). The
    frequency is that of a stroke with the greatest speed and acceleration of the scene.
    """
    liquid, radius_m = scene.liquids[0], scene.body.diameter_m / 2
    rate_per_s, speed_mps = strokes_per_s(scene), creeping_mps(scene)
    motion = stroke_motion(speed_mps, rate_per_s, CYCLES, scene.rate_hz)
    velocity_mps = speed_mps * np.sin(rate_per_s * motion.t_s)
    mu, rho = liquid.viscosity_pa_s or math.nan, liquid.density_kg_m3
    delta_m = math.sqrt(2 * mu / (rho * rate_per_s))
    acceleration_mps2 = speed_mps * rate_per_s * np.cos(rate_per_s * motion.t_s)
    damping_nspm = 6 * math.pi * mu * radius_m * (1 + radius_m / delta_m)
    inertia_kg = 3 * math.pi * radius_m**2 * math.sqrt(2 * mu * rho / rate_per_s) * (1 + 2 * radius_m / (9 * delta_m))
    force_n = -damping_nspm * velocity_mps - inertia_kg * acceleration_mps2
    counted = motion.t_s >= motion.t_s[-1] * (CYCLES - 2) / CYCLES
    source = f"exact for creeping flow (Landau & Lifshitz §24), {rate_per_s / (2 * math.pi):.2g} Hz"
    return Truth(name="oscillation", source=source, cases=(Case(motion, vectors_x(force_n), counted),))


def starting_truth(scene: Scene) -> Truth:
    """Return the force on a sphere that starts within one tick in creeping flow, from 10 ms onwards.

    Basset 1888: F = −6πµR U (1 + R/√(πνt)); with the start spread over one tick T, 1/√t becomes 2(√t − √(t−T))/T.
    """
    liquid, radius_m = scene.liquids[0], scene.body.diameter_m / 2
    tick_s, speed_mps = 1 / scene.rate_hz, creeping_mps(scene)
    t_s = np.arange(round(_START_S * scene.rate_hz) + 1) * tick_s
    mu = liquid.viscosity_pa_s or math.nan
    velocity_mps = np.where(t_s > 0, speed_mps, 0.0)
    spread = 2 * (np.sqrt(t_s) - np.sqrt(np.maximum(t_s - tick_s, 0.0))) / tick_s
    history = radius_m / math.sqrt(math.pi * mu / liquid.density_kg_m3) * spread
    force_n = -6 * math.pi * mu * radius_m * speed_mps * (1 + history)
    motion = along_x(t_s, speed_mps * np.maximum(t_s - tick_s / 2, 0.0), velocity_mps)
    source = "exact for creeping flow (Basset 1888), more than 10 ms after the start"
    return Truth(name="start", source=source, cases=(Case(motion, vectors_x(force_n), t_s >= _UNCOUNTED_S),))


def creeping_mps(scene: Scene) -> float:
    """Return a speed [m/s] at which the flow is creeping: Re = 0.01."""
    liquid = scene.liquids[0]
    return _CREEPING_REYNOLDS * (liquid.viscosity_pa_s or math.nan) / (liquid.density_kg_m3 * scene.body.diameter_m)


def strokes_per_s(scene: Scene) -> float:
    """Return the angular frequency ω [1/s] of a stroke with the scene's greatest speed and acceleration."""
    motion_range = scene.motion_in(scene.liquids[0])
    return (motion_range.acceleration_mps2 or math.nan) / (motion_range.speed_mps or math.nan)


RELATIVE: Final = 0.05
PERCEPTIBLE_N: Final = 0.05
"""The accuracy target: max(5 % of the force, 0.05 N), below the smallest difference of force that people feel, 7 %."""
ROUNDING: Final = 1e-9
"""Errors below this proportion of the force are rounding errors, and count as equal."""


class Error(NamedTuple):
    """The RMS and the greatest error of a force [N], the same relative to the reference, and the error of direction.

    ``direction_deg`` is the RMS angle where the reference is perceptible or, if it never is, clearly above zero.
    """

    rms_n: float
    most_n: float
    rms: float
    most: float
    direction_deg: float
    target: float  # max(5 %, 0.05 N) as a proportion of the true force


def error_of(forces_n: Sequence[Floats], truth: Truth) -> Error:
    """Return the errors of forces, one (n, 3) array per case of the reference."""
    true_n = np.concatenate([case.force_n[case.counted] for case in truth.cases])
    actual_n = np.concatenate([force[case.counted] for force, case in zip(forces_n, truth.cases, strict=True)])
    magnitudes_n = np.linalg.norm(true_n, axis=1)
    error_n = np.linalg.norm(actual_n - true_n, axis=1)
    true_rms_n, true_most_n = _rms(magnitudes_n), float(magnitudes_n.max())
    rms_n, most_n = _rms(error_n), float(error_n.max())
    perceptible = (magnitudes_n >= min(PERCEPTIBLE_N, RELATIVE * true_most_n)) & (np.linalg.norm(actual_n, axis=1) > 0)
    cross = np.linalg.norm(np.cross(actual_n[perceptible], true_n[perceptible]), axis=1)
    angles = np.degrees(np.arctan2(cross, (actual_n[perceptible] * true_n[perceptible]).sum(axis=1)))
    target = max(RELATIVE, PERCEPTIBLE_N / true_rms_n)
    direction_deg = _rms(angles) if len(angles) else math.nan
    return Error(
        rms_n=rms_n,
        most_n=most_n,
        rms=rms_n / true_rms_n,
        most=most_n / true_most_n,
        direction_deg=direction_deg,
        target=target,
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))

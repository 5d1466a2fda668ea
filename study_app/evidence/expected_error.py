"""The expected result of a scene's choice of effects: the time per tick, and the force error during strokes of a hand.

The hand makes back-and-forth strokes with the greatest speed and acceleration of the scene's motion. Positions are
quantised to encoder counts, velocities come from the scene's estimator, and the force is the one sent, after limits.
"""

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

import numpy as np

from study_app.evidence import reference_solutions
from study_app.evidence.cost import measure
from study_app.evidence.reference_model import (
    compress_speed,
    local_wakes,
    non_newtonian_n,
    resistance_nspm,
    respond,
    unsteady_n,
)
from study_app.evidence.reference_solutions import (
    COUNT_M,
    CYCLES,
    ROUNDING,
    Case,
    Truth,
    error_of,
    stroke_motion,
    with_effects,
    without_buoyancy,
)
from study_app.evidence.stability.delivered_force import Acting, acting_on_sine, case_of
from study_app.evidence.stability.velocity import WHOLE
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS, Dynamics
from study_app.haptics.model.effects import GRAVITY_MPS2, LocalWake
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Effect, Everywhere, Kalman, Liquid, Scene, Velocity
from study_app.haptics.runtime.offline import samples_along
from study_app.lab.identify.measured_force import vectors_x
from study_app.number_text import counted

_SETTLED: Final = 2 / 3
"""Proportion of the strokes after which the flow no longer depends on their start."""


class Causes(NamedTuple):
    """The change in force due to each cause along the same strokes: RMS of the change over RMS of the reference.

    The causes are added one after the other, from the reference to the force sent: the scene's effects with exact
    velocities (``law``), smoothed dw/dt (``acceleration``), velocities estimated from encoder counts (``velocity``),
    and the safety layer for a device with this delay (``limits``).
    """

    velocity: float = 0.0
    acceleration: float = 0.0
    limits: float = 0.0
    law: float = 0.0


class Expected(NamedTuple):
    """The time per tick of the scene's effects, and the RMS error of the force, relative to the reference and in N.

    ``causes`` splits the error, ``against`` describes the reference.
    """

    cost_ns: float
    error_share: float
    error_n: float
    causes: Causes
    against: str


def expected(scene: Scene, delay_ticks: int = ASSUMED_TICKS) -> Expected:
    """Measure a scene's cost and predict its error; with several liquids, the greatest error."""
    proportion, error_n, causes, against = _scene_errors(resolve(scene), delay_ticks)
    cost_ns = measure(scene).scene_ns
    return Expected(cost_ns=cost_ns, error_share=proportion, error_n=error_n, causes=causes, against=against)


def error_report(scene: Scene, delay_ticks: int = ASSUMED_TICKS) -> str:
    """Return the expected error on a device with a delay as one line of text."""
    error_share, error_n, causes, against = _scene_errors(resolve(scene), delay_ticks)
    proportions = (
        f"{name} {f'{100 * proportion:.2g} %' if proportion > ROUNDING else 'none'}"
        for name, proportion in causes._asdict().items()
    )
    return (
        f"expected error in the fastest strokes with a delay of {counted(delay_ticks, 'tick')}: {error_n:.2g} N, "
        f"{100 * error_share:.2g} % of the force; causes: {', '.join(proportions)}; reference: {against}"
    )


def acting_report(scene: Scene) -> str:
    """Return, for each liquid, the proportion of each part of its force that acts on the hand after 2 and 3 ticks.

    If ``kalman`` would have a smaller error than the scene's estimator, its proportions are added.
    """
    lines: list[str] = []
    if scene.velocity.kind == "given":
        return ""
    for liquid in resolve(scene).liquids:
        if not set(liquid.effects) - {"buoyancy", "current", "surface"}:
            continue
        single = _single_liquid_scene(scene, liquid)
        current, kalman = (_acting_by_delay(single, velocity) for velocity in (scene.velocity, Kalman()))
        better_ticks = [ticks for ticks in _LATE_TICKS if kalman[ticks].error < current[ticks].error]
        lines.append(
            f"delivered force of {liquid.id} (hand: medium grip, 0.2 kg, {WHOLE}; estimator {scene.velocity.kind}): "
            f"{_acting_text(current)}"
        )
        if better_ticks:
            lines.append(f'  with velocity = {{ kind = "kalman" }}: {_acting_text(kalman)}')
    return "\n".join(lines)


_LATE_TICKS: Final = (2, 3)


def _acting_by_delay(scene: Scene, velocity: Velocity) -> dict[int, Acting]:
    """Return the force that acts on the hand with an estimator, by ticks of delay."""
    scene = without_buoyancy(scene.model_copy(update={"velocity": velocity}))
    return {ticks: acting_on_sine(case_of(scene, velocity.kind, ticks), scene) for ticks in _LATE_TICKS}


def _acting_text(by_ticks: Mapping[int, Acting]) -> str:
    return "; ".join(
        f"with {ticks} ticks of delay, the hand receives "
        f"{' and '.join(f'{proportion:.0f} % of the {part}' for part, proportion in acting.parts.items())} "
        f"(error {acting.error:.2g} %)"
        for ticks, acting in by_ticks.items()
    )


def _single_liquid_scene(scene: Scene, liquid: Liquid) -> Scene:
    """Return a scene that the liquid fills, without a current and a surface."""
    filling = liquid.model_copy(update={"region": Everywhere(), "current": None})
    effects: tuple[Effect, ...] = () if liquid.effects == "auto" else liquid.effects
    kept_effects = tuple(effect for effect in effects if effect not in {"current", "surface"})
    return with_effects(scene.model_copy(update={"liquids": (filling,)}), *kept_effects)


def _scene_errors(scene: Scene, delay_ticks: int) -> tuple[float, float, Causes, str]:
    if not scene.liquids:
        return 0.0, 0.0, Causes(), "a scene without liquids"
    return max(
        (_liquid_errors(scene, index, delay_ticks) for index in range(len(scene.liquids))), key=lambda errors: errors[1]
    )


def _liquid_errors(scene: Scene, index: int, delay_ticks: int) -> tuple[float, float, Causes, str]:
    """Return the errors of one liquid, as if it filled the scene without a current."""
    single = _single_liquid_scene(scene, scene.liquids[index])
    liquid = single.liquids[0]
    effects: tuple[Effect, ...] = () if liquid.effects == "auto" else liquid.effects
    motion_range = single.motion_in(liquid)
    speed_mps, rate_per_s = motion_range.speed_mps or math.nan, reference_solutions.strokes_per_s(single)
    motion = stroke_motion(speed_mps, rate_per_s, CYCLES, single.rate_hz)
    if "unsteady_drag" in effects:
        intervals_s = np.full(len(motion.t_s), 1 / single.rate_hz)
        lift_n = np.array([0.0, _lift_n(single), 0.0])
        v, dv = _stroke(speed_mps, rate_per_s, motion.t_s)
        reference_n = unsteady_n(single, vectors_x(v), vectors_x(dv), intervals_s) + lift_n
        against = "the law of unsteady drag, which is within 8 % of a fluid solver at Re 0.3 to 100, and buoyancy"
    elif "non_newtonian" in effects:
        reference_n = _non_newtonian_n(single, motion, speed_mps, rate_per_s)
        against = f"the {liquid.non_newtonian.kind} law (no reference in unsteady flow), added mass and buoyancy"
    elif (
        liquid.viscosity_pa_s is not None and liquid.drag.law != "linear" and not {"wake", "local_wake"} & set(effects)
    ):
        reference_n = physical_n(single, speed_mps, rate_per_s, motion.t_s)
        against = "experimental drag, added mass, buoyancy and the history force of creeping flow (an upper bound)"
    else:
        effects = tuple(effect for effect in effects if effect in {"drag", "wake", "local_wake"})
        single = with_effects(single, *effects)
        reference_n = _defined_n(single, motion)
        against = f"the definition of {' and '.join(effects).replace('_', ' ') or 'nothing'}"
    if not reference_n.any():
        return 0.0, 0.0, Causes(), against
    truth = Truth(name="", source="", cases=(Case(motion, reference_n, motion.t_s >= _SETTLED * motion.t_s[-1]),))
    steps_n = [reference_n, *_forces(single, motion, Dynamics(delay_ticks / single.rate_hz, COUNT_M))]
    law, acceleration, velocity, limits = (
        error_of([reference_n + after_n - before_n], truth).rms for before_n, after_n in itertools.pairwise(steps_n)
    )
    total = error_of(steps_n[-1:], truth)
    return (
        total.rms,
        total.rms_n,
        Causes(velocity=velocity, acceleration=acceleration, limits=limits, law=law),
        against,
    )


def _forces(scene: Scene, motion: Motion, dynamics: Dynamics) -> Iterator[Floats]:
    """Yield the forces (n, 3) [N], each with one more of the causes in `Causes` than the previous one."""
    yield samples_along(scene, motion, dynamics).force_n
    yield samples_along(scene, motion, dynamics, smooths=True).force_n
    step_m = dynamics.count_m * scene.scale
    measured = (
        motion if scene.velocity.kind == "given" else Motion(motion.t_s, np.rint(motion.position_m / step_m) * step_m)
    )
    samples = samples_along(scene, measured, dynamics)
    yield samples.force_n
    yield samples.device_force_n


def physical_n(scene: Scene, speed_mps: float, rate_per_s: float, t_s: Floats) -> Floats:
    """Return the best-known force (n, 3) [N] on a ball in strokes along x, v = speed · sin ωt.

    It is the sum of steady drag from experiments, the added mass −½ρV dv/dt, the history −6πµR (R/δ)(v + (dv/dt)/ω),
    which is exact in creeping flow (Landau & Lifshitz §24) and an upper bound in faster flow, and net buoyancy.
    """
    liquid, radius_m = scene.liquids[0], scene.body.diameter_m / 2
    mu, rho, volume_m3 = liquid.viscosity_pa_s or math.nan, liquid.density_kg_m3, scene.body.volume_m3
    v, dv = _stroke(speed_mps, rate_per_s, t_s)
    drag_n = np.sign(v) * reference_solutions.measured_drag_n(liquid, scene.body.diameter_m, np.abs(v))
    added_n = 0.5 * rho * volume_m3 * dv
    delta_m = math.sqrt(2 * mu / (rho * rate_per_s))
    history_n = 6 * math.pi * mu * radius_m**2 / delta_m * (v + dv / rate_per_s)
    return np.column_stack([-drag_n - added_n - history_n, np.full_like(v, _lift_n(scene)), np.zeros_like(v)])


def _stroke(speed_mps: float, rate_per_s: float, t_s: Floats) -> tuple[Floats, Floats]:
    return speed_mps * np.sin(rate_per_s * t_s), speed_mps * rate_per_s * np.cos(rate_per_s * t_s)


def _non_newtonian_n(scene: Scene, motion: Motion, speed_mps: float, rate_per_s: float) -> Floats:
    """Return the sum of non-Newtonian drag, added mass and buoyancy (n, 3) [N]."""
    liquid, t_s = scene.liquids[0], motion.t_s
    v, dv = _stroke(speed_mps, rate_per_s, t_s)
    added_n = 0.5 * liquid.density_kg_m3 * scene.body.volume_m3 * dv
    drag_n = non_newtonian_n(scene, vectors_x(v), np.full(len(t_s), 1 / scene.rate_hz))
    force_n: Floats = drag_n - vectors_x(added_n) + np.array([0.0, _lift_n(scene), 0.0])
    return force_n


def _lift_n(scene: Scene) -> float:
    return (scene.liquids[0].density_kg_m3 - scene.body.density_kg_m3) * scene.body.volume_m3 * GRAVITY_MPS2


def _defined_n(scene: Scene, motion: Motion) -> Floats:
    """Return drag and wake (n, 3) [N] from the exact definition."""
    liquid = scene.liquids[0]
    if "drag" not in liquid.effects:
        return np.zeros_like(motion.position_m)
    local = liquid.local_wake
    if local is None or "local_wake" not in liquid.effects:
        return respond(scene, motion).force_n
    velocity_mps = motion.velocity_mps if motion.velocity_mps is not None else np.zeros_like(motion.position_m)
    v = np.array([compress_speed(row, scene.knee) for row in velocity_mps])
    w = v - _local_wake(scene, local, v, motion)
    speeds = np.linalg.norm(w, axis=1)
    return -np.array([resistance_nspm(scene, speed) for speed in speeds.tolist()])[:, np.newaxis] * w


def _local_wake(scene: Scene, wake: LocalWake, v: Floats, motion: Motion) -> Floats:
    vertical = 1.0 if wake.axes == "xyz" else 0.0
    wake_mps: Floats = local_wakes(
        v * np.array([1.0, vertical, 1.0]),
        motion.position_m,
        np.full(len(v), 1 / scene.rate_hz),
        max(1, math.floor(wake.length * scene.rate_hz / 1000)),
        wake.scaling * scene.rate_hz / 1000,
        wake.exponent,
        wake.decay,
        wake.reach_m or scene.body.diameter_m,
        wake.spreading_m2ps,
    )
    return wake_mps

"""The most each effect can do to the force, over how the body is expected to move; plain arithmetic, no compiler.

The motion box of a scene allows every motion with |v| ≤ v_max, |a| ≤ a_max and a depth of the body's centre within its
range. A bound is the greatest change of the force [N] that leaving the effect out makes for any of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from study_app.haptics.model.laws import Law, drag_n
from study_app.haptics.model.scene import (
    Channel,
    Current,
    Effect,
    Knee,
    Liquid,
    LocalWake,
    Scene,
    Uniform,
    Vortex,
    Wake,
)

GRAVITY_MPS2 = 9.80665
REFERENCE: Law = "haider-levenspiel"
"""The law that others are measured by: its published constants are confirmed, and it is nearest to experiments."""


def bounds(scene: Scene, liquid: Liquid) -> Mapping[Effect, float]:
    """Return the bound [N] of every effect that the liquid has parameters for.

    With V and R of the ball, v and a the greatest speed and acceleration:

    - ``drag``: F(v), by the reference law where the liquid has a viscosity;
    - ``wake``, ``local_wake``: F(v + u) − F(v), u the most that the liquid can follow; the laws are convex, so this is
      more than what a following liquid takes away;
    - ``current``: the same with its greatest speed u, and what added mass and history make of its shear s: to the ball
      that moves through it the liquid changes its velocity by up to u, at up to s v;
    - ``buoyancy``: g |ρ V_sub − ρ_body V|, at the worse end of the depth range;
    - ``added_mass``: C_a ρ V (a + s v);
    - ``history``: H(a, v) + H(s v, u) with H(a, v) = 12 R² √(2π ρ µ a v), the Basset integral for a body that was
      carried along at −v and then turned to v at a: no motion in the box makes it greater;
    - ``surface``: all of the others where the centre can cross the surface, for without it the ball is in or out.
    """
    motion = scene.motion_in(liquid)
    depth_m = motion.depth_m or (math.inf, math.inf)
    speed_mps = lowered_mps(motion.speed_mps or 0.0, scene.knee)
    acceleration_mps2 = motion.acceleration_mps2 or 0.0
    radius_m = scene.body.diameter_m / 2
    volume_m3 = 4 / 3 * math.pi * radius_m**3
    lift_n = liquid.density_kg_m3 * volume_m3 * GRAVITY_MPS2
    weight_n = scene.body.density_kg_m3 * volume_m3 * GRAVITY_MPS2
    mass_kg = liquid.added_mass.coefficient * liquid.density_kg_m3 * volume_m3
    per_root = 12 * radius_m**2 * math.sqrt(2 * math.pi * liquid.density_kg_m3 * (liquid.viscosity_pa_s or 0.0))

    def more_by(flow_mps: float) -> float:
        return resistance_n(scene, liquid, speed_mps + flow_mps) - resistance_n(scene, liquid, speed_mps)

    found: dict[Effect, float] = {"drag": resistance_n(scene, liquid, speed_mps)}
    if liquid.wake is not None:
        found["wake"] = more_by(speed_mps * fullest(liquid.wake))
    if liquid.local_wake is not None:
        found["local_wake"] = more_by(speed_mps * fullest(liquid.local_wake))
    found["added_mass"] = mass_kg * acceleration_mps2
    found["history"] = per_root * math.sqrt(acceleration_mps2 * speed_mps)
    if liquid.current is not None:
        flow_mps, change_mps2 = fastest_mps(liquid.current), shear_per_s(liquid.current) * speed_mps
        sheared_n = {"added_mass": mass_kg * change_mps2, "history": per_root * math.sqrt(change_mps2 * flow_mps)}
        found["current"] = more_by(flow_mps) + sum(sheared_n.values())
        found["added_mass"] += sheared_n["added_mass"]
        found["history"] += sheared_n["history"]
    if liquid.viscosity_pa_s is None:
        del found["history"]
    if depth_m[1] <= -radius_m:
        found = dict.fromkeys(found, 0.0)
    found["buoyancy"] = max(abs(lift_n * submerged(depth, radius_m) - weight_n) for depth in depth_m)
    if motion.depth_m is not None:
        frontal, volume = _in_doubt(motion.depth_m, radius_m)
        carried_n = found["added_mass"] + found.get("history", 0.0) + lift_n
        found["surface"] = frontal * (found["drag"] + found.get("current", 0.0)) + volume * carried_n
    return found


def _in_doubt(depth_m: tuple[float, float], radius_m: float) -> tuple[float, float]:
    """Return how much of frontal area and volume is wrong at most, 0 … 1, if the ball is all in or all out."""
    nearest_m = max(depth_m[0], -depth_m[1], 0.0)
    if nearest_m == 0.0:
        return 1.0, 1.0
    return max(1 - (nearest_m / radius_m) ** 2, 0.0), submerged(-nearest_m, radius_m)


def resistance_n(scene: Scene, liquid: Liquid, relative_mps: float, law: Law | None = None) -> float:
    """Return the size of the drag [N] on the scene's body at a relative speed; by default the truest law there is."""
    return drag_n(
        law or ("constant" if liquid.viscosity_pa_s is None else REFERENCE),
        relative_mps,
        density_kg_m3=liquid.density_kg_m3,
        viscosity_pa_s=liquid.viscosity_pa_s,
        diameter_m=scene.body.diameter_m,
        drag_coefficient=scene.body.drag_coefficient,
    )


def submerged(depth_m: float, radius_m: float) -> float:
    """Return the share of a ball's volume below the surface, its centre ``depth_m`` under it: V = πh²(3R − h)/3."""
    h = min(max(depth_m + radius_m, 0.0), 2 * radius_m)
    return h * h * (3 * radius_m - h) / (4 * radius_m**3)


def fullest(wake: Wake | LocalWake) -> float:
    """Return the most of the body's speed that its wake can have: (N/S)^y."""
    return float((wake.length / wake.scaling) ** wake.exponent)


def fastest_mps(current: Current) -> float:
    """Return the greatest speed of a current [m/s]."""
    if isinstance(current, Uniform):
        return math.hypot(*current.velocity_mps)
    if isinstance(current, Channel | Vortex):
        return abs(current.peak_mps)
    raise TypeError(f"no bound is known for a current of kind {current!r}")


def shear_per_s(current: Current) -> float:
    """Return how much a current changes over a way, at most [m/s per m]."""
    if isinstance(current, Channel):
        return 4 * abs(current.peak_mps) / current.width_m
    return 2 * abs(current.peak_mps) / current.core_m if isinstance(current, Vortex) else 0.0


def lowered_mps(speed_mps: float, knee: Knee) -> float:
    """Return a speed after the knee [m/s], as the effects meet it."""
    excess_mps = speed_mps - knee.threshold_mps
    if excess_mps <= 0 or knee.law == "none":
        return speed_mps
    return knee.threshold_mps + (math.sqrt(1 + 2 * excess_mps) - 1 if knee.law == "sqrt" else excess_mps**2)

"""Upper bounds of each effect's force over the expected motion of the body; plain arithmetic, no compiler.

The motion box of a scene allows every motion with |v| ≤ v_max, |a| ≤ a_max and a depth of the body's centre within its
range. A bound is the greatest change of the force [N] if the effect is omitted, over all these motions; each effect's
formula is in its descriptor (``haptics.model.effects``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

from study_app.haptics.model.effect import GRAVITY_MPS2, Flow
from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.effects.drag import resistance_n
from study_app.haptics.model.effects.non_newtonian import steady_n
from study_app.haptics.model.scene import Effect, Knee, Liquid, Scene


def bounds(scene: Scene, liquid: Liquid) -> Mapping[Effect, float]:
    """Return the bound [N] of every effect that the liquid has parameters for."""
    return Extremes(scene, liquid).bounds_n


@dataclass(frozen=True)
class Extremes:
    """The extremes of the motion in one liquid of a scene, and the quantities of which effects compute bounds."""

    scene: Scene
    liquid: Liquid

    @cached_property
    def bounds_n(self) -> Mapping[Effect, float]:
        """The bound [N] of every effect of the scene's format that the liquid has parameters for, by name."""
        known = [it for it in EFFECTS if it.format <= self.scene.format or it.name in self.liquid.effects]
        found = {effect.name: effect.bound_n(self) for effect in known}
        return {name: bound_n for name, bound_n in found.items() if bound_n is not None}

    @cached_property
    def exerted_n(self) -> Mapping[Effect, float]:
        """About the greatest force [N] that each effect exerts by itself."""
        found = {effect.name: effect.exerted_n(self) for effect in EFFECTS if effect.exerted_n is not None}
        return {name: newtons for name, newtons in found.items() if newtons is not None}

    @cached_property
    def has_top(self) -> bool:
        """Whether the liquid has a top face or the scene says how deep the body gets."""
        return self.scene.motion_in(self.liquid).depth_m is not None

    @cached_property
    def depth_m(self) -> tuple[float, float]:
        """The least and the greatest depth of the body's centre; without a top it is deep."""
        return self.scene.motion_in(self.liquid).depth_m or (math.inf, math.inf)

    @cached_property
    def relative_mps(self) -> float:
        """The greatest speed of the body, after the knee, relative to any flow that may be selected."""
        flow_mps = sum(it.speed_mps for it in _flows(self.liquid, called_for=True))
        return met_mps(self.scene, self.liquid, self.scene.motion_in(self.liquid).speed_mps or 0.0) + flow_mps

    @cached_property
    def speed_mps(self) -> float:
        """The greatest speed of the body in the liquid, after the knee; 0 if it is never in it."""
        if self._is_outside:
            return 0.0
        return met_mps(self.scene, self.liquid, self.scene.motion_in(self.liquid).speed_mps or 0.0)

    @cached_property
    def acceleration_mps2(self) -> float:
        """The greatest acceleration of the body in the liquid."""
        return 0.0 if self._is_outside else self.scene.motion_in(self.liquid).acceleration_mps2 or 0.0

    @cached_property
    def flow(self) -> Flow:
        """The speed and shear of the liquid's own flow."""
        if self._is_outside:
            return Flow(0.0, 0.0)
        flows = _flows(self.liquid)
        return Flow(sum(it.speed_mps for it in flows), sum(it.shear_per_s for it in flows))

    @property
    def reynolds(self) -> float:
        """The greatest Reynolds number ρ|w|D/µ; infinite without a viscosity."""
        liquid = self.liquid
        if liquid.viscosity_pa_s is None:
            return math.inf
        return self.relative_mps * liquid.density_kg_m3 * self.scene.body.diameter_m / liquid.viscosity_pa_s

    @property
    def radius_m(self) -> float:
        """Of the body."""
        return self.scene.body.diameter_m / 2

    @property
    def volume_m3(self) -> float:
        """Of the body."""
        return self.scene.body.volume_m3

    @property
    def lift_n(self) -> float:
        """The weight of the liquid that the whole body displaces."""
        return self.liquid.density_kg_m3 * self.volume_m3 * GRAVITY_MPS2

    @property
    def weight_n(self) -> float:
        """The weight of the body."""
        return self.scene.body.density_kg_m3 * self.volume_m3 * GRAVITY_MPS2

    def drag_by_flow_n(self, flow_mps: float) -> float:
        """Return F(v + u) − F(v), the drag that a flow u adds at most."""
        return self._resisting_n(self.speed_mps + flow_mps) - self._resisting_n(self.speed_mps)

    def _resisting_n(self, speed_mps: float) -> float:
        if self.liquid.non_newtonian is not None:
            return sum(steady_n(self.scene, self.liquid, speed_mps))
        return resistance_n(self.scene, self.liquid, speed_mps)

    def inertial_n(self, accelerated_n: Callable[[Extremes, float, float], float]) -> float:
        """Return the force at the body's greatest acceleration and in the shear of the flow together."""
        return accelerated_n(self, self.acceleration_mps2, self.speed_mps) + self._sheared_n(accelerated_n)

    def sheared_n(self) -> float:
        """Return the force of inertial effects in the shear of the flow."""
        return sum(self._sheared_n(effect.accelerated_n) for effect in EFFECTS if effect.accelerated_n is not None)

    def _sheared_n(self, accelerated_n: Callable[[Extremes, float, float], float]) -> float:
        return accelerated_n(self, self.flow.shear_per_s * self.speed_mps, self.flow.speed_mps)

    def total_n(self, extent: str) -> float:
        """Return the sum of the bounds of effects that grow with this extent of the wetted body."""
        return sum(effect.bound_n(self) or 0.0 for effect in EFFECTS if effect.extent == extent)

    def submerged(self, depth_m: float) -> float:
        """Return the share of the body's volume below the surface, its centre ``depth_m`` under it."""
        return submerged(depth_m, self.radius_m)

    def doubtful_shares(self) -> tuple[float, float]:
        """Return the greatest error of frontal area and volume, 0 … 1, if the ball counts as fully in or out."""
        nearest_m = max(self.depth_m[0], -self.depth_m[1], 0.0)
        if nearest_m == 0.0:
            return 1.0, 1.0
        return max(1 - (nearest_m / self.radius_m) ** 2, 0.0), self.submerged(-nearest_m)

    @cached_property
    def _is_outside(self) -> bool:
        return self.depth_m[1] <= -self.radius_m


def _flows(liquid: Liquid, *, called_for: bool = False) -> list[Flow]:
    """Return the flows that the liquid has a table of, or only those selected or left to the gate."""
    return [
        effect.flow(getattr(liquid, effect.name))
        for effect in EFFECTS
        if effect.flow is not None
        and getattr(liquid, effect.name) is not None
        and (not called_for or effect.name in liquid.effects or liquid.effects == "auto")
    ]


def submerged(depth_m: float, radius_m: float) -> float:
    """Return the share of a ball's volume below the surface, its centre ``depth_m`` under it: V = πh²(3R − h)/3."""
    h = min(max(depth_m + radius_m, 0.0), 2 * radius_m)
    return h * h * (3 * radius_m - h) / (4 * radius_m**3)


def met_mps(scene: Scene, liquid: Liquid, speed_mps: float) -> float:
    """Return the speed [m/s] that a liquid's effects use: after the knee, except for a damper."""
    return speed_mps if liquid.drag.law == "linear" else lowered_mps(speed_mps, scene.knee)


def lowered_mps(speed_mps: float, knee: Knee) -> float:
    """Return a speed after the knee [m/s], which the effects use."""
    excess_mps = speed_mps - knee.threshold_mps
    if excess_mps <= 0 or knee.law == "none":
        return speed_mps
    return knee.threshold_mps + (math.sqrt(1 + 2 * excess_mps) - 1 if knee.law == "sqrt" else excess_mps**2)

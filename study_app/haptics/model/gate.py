"""The gate selects the effects of a scene, with reasons: "simulate only the effects a scene calls for".

A liquid names its effects, or says ``effects = "auto"``. Then the effects with the smallest bounds (``bounds``) are
omitted as long as the *sum* of the omitted bounds stays within the scene's accuracy: by default 5 % of the sum of all
bounds or 0.05 N, whichever is greater. That is below the difference threshold of force, 7 %; the sum of all bounds is
capped at the force limit. [choice] Drag uses the least expensive law of C_d that stays within the same target of the
reference law at every speed. A wake is never selected automatically: density and viscosity do not determine its
parameters; nor are the effects that ``scene.accuracy.without`` lists.

The motion box of a scene allows every motion with |v| ≤ v_max, |a| ≤ a_max and a depth of the body's centre within its
range. A bound is the greatest change of the force [N] if the effect is omitted, over all these motions; each effect's
formula is in its descriptor (``haptics.model.effects``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Final, NamedTuple

from study_app.haptics.model.effect import GRAVITY_MPS2, Flow
from study_app.haptics.model.effects import EFFECTS, NAMED
from study_app.haptics.model.effects.drag import resistance_n
from study_app.haptics.model.effects.non_newtonian import steady_n
from study_app.haptics.model.scene import Effect, Knee, Liquid, Scene


def bounds(scene: Scene, liquid: Liquid) -> Mapping[Effect, float]:
    """Return the bound [N] of every effect that the liquid has parameters for."""
    return Extremes(scene, liquid).bounds_n


@dataclass(frozen=True)
class Extremes:
    """The extremes of the motion in one liquid of a scene, and the quantities from which effects compute bounds."""

    scene: Scene
    liquid: Liquid

    @cached_property
    def bounds_n(self) -> Mapping[Effect, float]:
        """The bound [N] of every effect that the scene permits and the liquid has parameters for, by name."""
        known = [it for it in EFFECTS if it.name not in self.scene.accuracy.without or it.name in self.liquid.effects]
        bounds = {effect.name: effect.bound_n(self) for effect in known}
        return {name: bound_n for name, bound_n in bounds.items() if bound_n is not None}

    @cached_property
    def exerted_n(self) -> Mapping[Effect, float]:
        """About the greatest force [N] that each effect exerts by itself."""
        exerted = {effect.name: effect.exerted_n(self) for effect in EFFECTS if effect.exerted_n is not None}
        return {name: newtons for name, newtons in exerted.items() if newtons is not None}

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
        return (
            effective_speed_mps(self.scene, self.liquid, self.scene.motion_in(self.liquid).speed_mps or 0.0) + flow_mps
        )

    @cached_property
    def speed_mps(self) -> float:
        """The greatest speed of the body in the liquid, after the knee; 0 if it is never in it."""
        if self._is_outside:
            return 0.0
        return effective_speed_mps(self.scene, self.liquid, self.scene.motion_in(self.liquid).speed_mps or 0.0)

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
        return self.scene.body.diameter_m / 2

    @property
    def volume_m3(self) -> float:
        return self.scene.body.volume_m3

    @property
    def lift_n(self) -> float:
        """The weight of the liquid that the whole body displaces."""
        return self.liquid.density_kg_m3 * self.volume_m3 * GRAVITY_MPS2

    @property
    def weight_n(self) -> float:
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
        return accelerated_n(self, self.acceleration_mps2, self.speed_mps) + self._shear_force_n(accelerated_n)

    def sheared_n(self) -> float:
        """Return the force of inertial effects in the shear of the flow."""
        return sum(self._shear_force_n(effect.accelerated_n) for effect in EFFECTS if effect.accelerated_n is not None)

    def _shear_force_n(self, accelerated_n: Callable[[Extremes, float, float], float]) -> float:
        return accelerated_n(self, self.flow.shear_per_s * self.speed_mps, self.flow.speed_mps)

    def total_n(self, extent: str) -> float:
        """Return the sum of the bounds of effects that grow with this extent of the wetted body."""
        return sum(effect.bound_n(self) or 0.0 for effect in EFFECTS if effect.extent == extent)

    def submerged(self, depth_m: float) -> float:
        """Return the fraction of the body's volume below the surface, its centre ``depth_m`` under it."""
        return submerged(depth_m, self.radius_m)

    def doubtful_shares(self) -> tuple[float, float]:
        """Return the greatest errors of frontal area and volume, 0 … 1, if the ball counts as fully in or out."""
        nearest_m = max(self.depth_m[0], -self.depth_m[1], 0.0)
        if nearest_m == 0.0:
            return 1.0, 1.0
        return max(1 - (nearest_m / self.radius_m) ** 2, 0.0), self.submerged(-nearest_m)

    @cached_property
    def _is_outside(self) -> bool:
        return self.depth_m[1] <= -self.radius_m


def _flows(liquid: Liquid, *, called_for: bool = False) -> list[Flow]:
    """Return all flows for which the liquid has a table, or only those selected or left to the gate."""
    return [
        effect.flow(getattr(liquid, effect.name))
        for effect in EFFECTS
        if effect.flow is not None
        and getattr(liquid, effect.name) is not None
        and (not called_for or effect.name in liquid.effects or liquid.effects == "auto")
    ]


def submerged(depth_m: float, radius_m: float) -> float:
    """Return the fraction of a ball's volume below the surface, its centre ``depth_m`` under it: V = πh²(3R − h)/3."""
    h = min(max(depth_m + radius_m, 0.0), 2 * radius_m)
    return h * h * (3 * radius_m - h) / (4 * radius_m**3)


def effective_speed_mps(scene: Scene, liquid: Liquid, speed_mps: float) -> float:
    """Return the speed [m/s] that a liquid's effects use: after the knee, except for a damper."""
    return speed_mps if liquid.drag.law == "linear" else speed_after_knee_mps(speed_mps, scene.knee)


def speed_after_knee_mps(speed_mps: float, knee: Knee) -> float:
    """Return a speed after the knee [m/s], which the effects use."""
    excess_mps = speed_mps - knee.threshold_mps
    if excess_mps <= 0 or knee.law == "none":
        return speed_mps
    return knee.threshold_mps + (math.sqrt(1 + 2 * excess_mps) - 1 if knee.law == "sqrt" else excess_mps**2)


_NEVER_BY_ITSELF: Final = tuple(effect.name for effect in EFFECTS if not effect.automatic)


class Verdict(NamedTuple):
    """The verdict on one effect in one liquid.

    ``share`` is its bound divided by the sum of the bounds, 0 … 1; None if another model of the effect is used instead.
    """

    liquid: str
    effect: Effect
    bound_n: float
    share: float | None
    included: bool
    why: str


def effect_verdicts(scene: Scene) -> tuple[Verdict, ...]:
    """Return the verdict on every effect that the scene's liquids have parameters for, liquid by liquid."""
    return tuple(verdict for liquid in scene.liquids for verdict in _verdicts(scene, liquid))


@lru_cache(maxsize=64)
def resolve(scene: Scene) -> Scene:
    """Return the scene with effects and a drag law selected wherever it says ``"auto"``."""
    if all(liquid.effects != "auto" for liquid in scene.liquids):
        return scene
    liquids = tuple(_resolve_liquid(scene, liquid) if liquid.effects == "auto" else liquid for liquid in scene.liquids)
    return scene.model_copy(update={"liquids": liquids})


def describe_gate(scene: Scene, cost_ns: Mapping[tuple[str, Effect], float] | None = None) -> tuple[str, ...]:
    """Return the verdicts as lines of text, a table per liquid, with the measured cost per tick if given.

    ``cost_ns`` maps (liquid, effect) to nanoseconds.
    """
    lines: list[str] = []
    for liquid in scene.liquids:
        lines += [_heading(scene, liquid), *_table(_verdicts(scene, liquid), cost_ns), ""]
    return tuple(lines[:-1])


def _budget_n(scene: Scene, total_n: float) -> float:
    """Return the total force [N] of the effects that may be omitted."""
    return max(scene.accuracy.relative * min(total_n, scene.force_limit_n), scene.accuracy.absolute_n)


def _verdicts(scene: Scene, liquid: Liquid) -> tuple[Verdict, ...]:
    bound_of = bounds(scene, liquid)
    barred = _barred_effects(scene, liquid, bound_of)
    total_n = sum(bound_n for effect, bound_n in bound_of.items() if effect not in barred)
    judged = (
        _verdicts_if_automatic(scene, liquid, bound_of, barred, total_n)
        if liquid.effects == "auto"
        else _verdicts_if_listed(liquid, bound_of)
    )
    return tuple(
        Verdict(
            liquid=liquid.id,
            effect=effect,
            bound_n=bound_of[effect],
            share=None if effect in barred else bound_of[effect] / total_n if total_n > 0 else 0.0,
            included=included,
            why=why,
        )
        for effect in NAMED
        if effect in bound_of
        for included, why in (judged[effect],)
    )


def _barred_effects(scene: Scene, liquid: Liquid, bound_of: Mapping[Effect, float]) -> dict[Effect, str]:
    """Return the effects that cannot be chosen, with reasons."""
    if liquid.effects != "auto":
        rivals = {it.name: it.excludes for it in EFFECTS if it.excludes and it.name in bound_of}
        names = [name for rival, others in rivals.items() for name in (others if rival in liquid.effects else (rival,))]
        return dict.fromkeys(names, "another model of the same effect is selected")
    barred = {
        name: why
        for effect in EFFECTS
        if effect.bars is not None and effect.name in bound_of
        for names, why in (effect.bars(Extremes(scene, liquid)),)
        for name in names
    }
    return barred | dict.fromkeys(
        _NEVER_BY_ITSELF, "cannot be selected automatically from density and viscosity: to use it, list it in effects"
    )


def _verdicts_if_listed(liquid: Liquid, bound_of: Mapping[Effect, float]) -> dict[Effect, tuple[bool, str]]:
    """Return the verdicts if the file lists the effects."""
    judged: dict[Effect, tuple[bool, str]] = dict.fromkeys(bound_of, (False, "not listed"))
    for name in bound_of:
        if name in liquid.effects:
            note = NAMED[name].note
            judged[name] = True, f"listed{note(liquid) if note is not None else ''}"
    return judged


def _verdicts_if_automatic(
    scene: Scene, liquid: Liquid, bound_of: Mapping[Effect, float], barred: Mapping[Effect, str], total_n: float
) -> dict[Effect, tuple[bool, str]]:
    """Omit the smallest effects while their sum stays within the target."""
    budget_n = _budget_n(scene, total_n)
    judged: dict[Effect, tuple[bool, str]] = {name: (False, why) for name, why in barred.items()}
    left_out_n = 0.0
    for effect in sorted((effect for effect in bound_of if effect not in judged), key=lambda effect: bound_of[effect]):
        with_it_n = left_out_n + bound_of[effect]
        if with_it_n <= budget_n:
            left_out_n = with_it_n
            judged[effect] = False, _omission_reason(bound_of[effect], left_out_n, budget_n)
        else:
            omitted = f"omitting it would raise the total omitted force to {with_it_n:.3g} N"
            judged[effect] = True, f"{omitted}, above the limit of {budget_n:.3g} N"
    for name in [name for name, (taken, _) in judged.items() if taken and NAMED[name].through]:
        carrier = next(it for it in NAMED[name].through if it not in barred)
        if not judged[carrier][0]:
            judged[carrier] = True, f"carries the {NAMED[name].label.lower()}"
    for name, (_, table_why) in _tables(scene, liquid).items():
        if judged[name][0]:
            judged[name] = True, f"{judged[name][1]}; {table_why}"
    for name, (taken, why) in judged.items():
        note = NAMED[name].note
        if taken and note is not None and NAMED[name].choose is None:
            judged[name] = True, f"{why}{note(liquid)}"
    return judged


def _omission_reason(bound_n: float, left_out_n: float, budget_n: float) -> str:
    if bound_n == 0.0:
        return "has no effect here"
    return f"{left_out_n:.3g} N omitted in total, within the {budget_n:.3g} N allowed"


def _tables(scene: Scene, liquid: Liquid) -> dict[Effect, tuple[Any, str]]:
    """Return the tables that effects choose, with reasons."""
    extremes = Extremes(scene, liquid)
    return {effect.name: effect.choose(extremes) for effect in EFFECTS if effect.choose is not None}


def _resolve_liquid(scene: Scene, liquid: Liquid) -> Liquid:
    taken = tuple(verdict.effect for verdict in _verdicts(scene, liquid) if verdict.included)
    tables = {name: table for name, (table, _) in _tables(scene, liquid).items()}
    return liquid.model_copy(update={"effects": taken, **tables})


def _heading(scene: Scene, liquid: Liquid) -> str:
    motion = scene.motion_in(liquid)
    box = f"up to {motion.speed_mps:g} m/s and {motion.acceleration_mps2:g} m/s² in the scene"
    if motion.depth_m is not None:
        least, greatest = (f"{depth_m:g}".replace("-", "−") for depth_m in motion.depth_m)
        box += f", ball centre {least} to {greatest} m deep"
    how = "effects selected automatically" if liquid.effects == "auto" else "effects listed in the file"
    return f"{liquid.id}: {how}; {box}"


def _table(verdicts: tuple[Verdict, ...], cost_ns: Mapping[tuple[str, Effect], float] | None) -> list[str]:
    rows = [
        ["effect", "largest force [N]", "share", *(["ns per tick"] if cost_ns is not None else []), "used", "reason"]
    ]
    for verdict in verdicts:
        row = [verdict.effect, _newtons(verdict.bound_n), "–" if verdict.share is None else f"{verdict.share:.1%}"]
        if cost_ns is not None:
            cost = cost_ns.get((verdict.liquid, verdict.effect))
            row.append("–" if cost is None else f"{max(cost, 0.0):.0f}")
        rows.append([*row, "yes" if verdict.included else "no", verdict.why])
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    numbers = range(1, len(widths) - 2)
    return [
        "  "
        + "  ".join(
            cell.rjust(width) if place in numbers else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def _newtons(force_n: float) -> str:
    """Return a force to three digits, at least to 1 mN."""
    if force_n >= 100:
        return f"{force_n:.0f}"
    return f"{force_n:.1f}" if force_n >= 10 else f"{force_n:.3f}"

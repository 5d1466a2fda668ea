"""Which effects a scene calls for, and why: "simulate only the effects a scene calls for", made a rule.

A liquid names its effects, or says ``effects = "auto"``. Then the effects with the smallest bounds (``bounds``) are
left out as long as the *sum* of what is left out stays within the scene's accuracy: 5 % of the sum of all bounds or
0.05 N, whichever is greater, by default. That is below the smallest difference of force that people feel, 7 %; since
nobody feels more than the force limit, a greater sum counts as that. [choice] Drag takes the cheapest law of C_d that
stays within the same target of the reference law at every speed. A wake is never taken by itself: it has no parameters
that density and viscosity could tell.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

from study_app.haptics.model.bounds import REFERENCE, bounds, fastest_mps, lowered_mps, resistance_n
from study_app.haptics.model.laws import LAWS, Law
from study_app.haptics.model.scene import Drag, Effect, Liquid, Scene

ORDER: Final[tuple[Effect, ...]] = (
    "drag",
    "wake",
    "local_wake",
    "current",
    "buoyancy",
    "surface",
    "added_mass",
    "history",
)
NEVER_BY_ITSELF: Final[tuple[Effect, ...]] = ("wake", "local_wake")
_SPEEDS: Final = 60


class Verdict(NamedTuple):
    """What becomes of one effect in one liquid: ``share`` is its bound over the sum of the bounds, 0 … 1."""

    liquid: str
    effect: Effect
    bound_n: float
    share: float
    included: bool
    why: str


def calls_for(scene: Scene) -> tuple[Verdict, ...]:
    """Return the verdict on every effect that the scene's liquids have parameters for, liquid by liquid."""
    return tuple(verdict for liquid in scene.liquids for verdict in _verdicts(scene, liquid))


def resolve(scene: Scene) -> Scene:
    """Return the scene with named effects and a law of drag wherever it says ``"auto"``."""
    if all(liquid.effects != "auto" for liquid in scene.liquids):
        return scene
    liquids = tuple(_resolved(scene, liquid) if liquid.effects == "auto" else liquid for liquid in scene.liquids)
    return scene.model_copy(update={"liquids": liquids})


def describe_gate(scene: Scene, cost_ns: Mapping[tuple[str, Effect], float] | None = None) -> tuple[str, ...]:
    """Return the verdicts as lines of text, a table per liquid, with the measured cost of a tick where it is given.

    ``cost_ns`` maps (liquid, effect) to nanoseconds.
    """
    lines: list[str] = []
    for liquid in scene.liquids:
        lines += [_heading(scene, liquid), *_table(_verdicts(scene, liquid), cost_ns), ""]
    return tuple(lines[:-1])


def cheapest_law(scene: Scene, liquid: Liquid) -> Law:
    """Return the cheapest law of drag within the accuracy target of the reference law, at every speed of the motion."""
    if liquid.viscosity_pa_s is None:
        return "constant"
    candidates: tuple[Law, ...] = ("constant", *LAWS)
    return next((law for law in candidates if _is_true_enough(scene, liquid, law)), REFERENCE)


def _is_true_enough(scene: Scene, liquid: Liquid, law: Law) -> bool:
    """Return whether a law stays within the accuracy target of the reference law's force at each speed."""
    for k in range(1, _SPEEDS + 1):
        speed_mps = _fastest_mps(scene, liquid) * k / _SPEEDS
        true_n = resistance_n(scene, liquid, speed_mps)
        wrong_n = abs(resistance_n(scene, liquid, speed_mps, law) - true_n)
        if wrong_n > max(scene.accuracy.relative * true_n, scene.accuracy.absolute_n):
            return False
    return True


def _fastest_mps(scene: Scene, liquid: Liquid) -> float:
    """Return the greatest speed relative to the liquid."""
    speed_mps = lowered_mps(scene.motion_in(liquid).speed_mps or 0.0, scene.knee)
    return speed_mps + (fastest_mps(liquid.current) if liquid.current is not None else 0.0)


def _budget_n(scene: Scene, total_n: float) -> float:
    """Return how much force may be left out."""
    return max(scene.accuracy.relative * min(total_n, scene.force_limit_n), scene.accuracy.absolute_n)


def _verdicts(scene: Scene, liquid: Liquid) -> tuple[Verdict, ...]:
    found = bounds(scene, liquid)
    auto = liquid.effects == "auto"
    total_n = sum(bound_n for effect, bound_n in found.items() if not (auto and effect in NEVER_BY_ITSELF))
    judged = _chosen(scene, liquid, found, total_n) if auto else _named(liquid, found)
    return tuple(
        Verdict(liquid.id, effect, found[effect], found[effect] / total_n if total_n > 0 else 0.0, *judged[effect])
        for effect in ORDER
        if effect in found
    )


def _named(liquid: Liquid, found: Mapping[Effect, float]) -> dict[Effect, tuple[bool, str]]:
    """Return what the file says."""
    named = {effect: effect in liquid.effects for effect in found}
    law = f", law {liquid.drag.law}"
    return {
        effect: (taken, f"named{law if effect == 'drag' else ''}" if taken else "not named")
        for effect, taken in named.items()
    }


def _chosen(
    scene: Scene, liquid: Liquid, found: Mapping[Effect, float], total_n: float
) -> dict[Effect, tuple[bool, str]]:
    """Leave out the smallest while the sum of what is left out stays within the target."""
    budget_n = _budget_n(scene, total_n)
    judged: dict[Effect, tuple[bool, str]] = dict.fromkeys(
        NEVER_BY_ITSELF, (False, "density and viscosity say nothing about it: name it to have it")
    )
    left_out_n = 0.0
    for effect in sorted((effect for effect in found if effect not in judged), key=lambda effect: found[effect]):
        with_it_n = left_out_n + found[effect]
        if with_it_n <= budget_n:
            left_out_n = with_it_n
            judged[effect] = False, _left_out(found[effect], left_out_n, budget_n)
        else:
            judged[effect] = True, f"without it {with_it_n:.3g} N would be missing, more than {budget_n:.3g} N"
    if "current" in judged and judged["current"][0] and not judged["drag"][0]:
        judged["drag"] = True, "carries the current"
    if judged["drag"][0]:
        judged["drag"] = True, f"{judged['drag'][1]}; {_law(scene, liquid)}"
    return judged


def _left_out(bound_n: float, left_out_n: float, budget_n: float) -> str:
    if bound_n == 0.0:
        return "does nothing here"
    return f"{left_out_n:.3g} N left out in all, within {budget_n:.3g} N"


def _law(scene: Scene, liquid: Liquid) -> str:
    law, accuracy = cheapest_law(scene, liquid), scene.accuracy
    if liquid.viscosity_pa_s is None:
        return "law constant, for want of a viscosity"
    if law == REFERENCE:
        return f"law {law}"
    return f"law {law}, within {100 * accuracy.relative:g} % or {accuracy.absolute_n:g} N of {REFERENCE}"


def _resolved(scene: Scene, liquid: Liquid) -> Liquid:
    taken = tuple(verdict.effect for verdict in _verdicts(scene, liquid) if verdict.included)
    return liquid.model_copy(update={"effects": taken, "drag": Drag(law=cheapest_law(scene, liquid))})


def _heading(scene: Scene, liquid: Liquid) -> str:
    motion = scene.motion_in(liquid)
    box = f"up to {motion.speed_mps:g} m/s and {motion.acceleration_mps2:g} m/s² in the scene"
    if motion.depth_m is not None:
        least, greatest = (f"{depth_m:g}".replace("-", "−") for depth_m in motion.depth_m)
        box += f", centre {least} to {greatest} m deep"
    how = "effects chosen" if liquid.effects == "auto" else "effects named"
    return f"{liquid.id}: {how}; {box}"


def _table(verdicts: tuple[Verdict, ...], cost_ns: Mapping[tuple[str, Effect], float] | None) -> list[str]:
    rows = [["effect", "bound [N]", "share", *(["ns a tick"] if cost_ns is not None else []), "", "why"]]
    for verdict in verdicts:
        row = [verdict.effect, _newtons(verdict.bound_n), f"{verdict.share:.1%}"]
        if cost_ns is not None:
            cost = cost_ns.get((verdict.liquid, verdict.effect))
            row.append("–" if cost is None else f"{max(cost, 0.0):.0f}")
        rows.append([*row, "in" if verdict.included else "out", verdict.why])
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

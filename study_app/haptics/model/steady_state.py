"""The force that the servo sends in uniform motion, computed without the compiler."""

import math
from typing import Final, Literal, NamedTuple

from study_app.haptics.model.bounds import met_mps
from study_app.haptics.model.effects.drag import resistance_n
from study_app.haptics.model.effects.non_newtonian import VISCOUS_SHARE, steady_n
from study_app.haptics.model.effects.unsteady_drag import LATE_SHARE, even_n
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import slope_limit

HAND_MPS: Final = 0.1
"""Hand speed while exploring a liquid [m/s]."""


class Steady(NamedTuple):
    """The sent force [N], the drag before the safety layer, and the limit that reduced it, if any."""

    force_n: float
    drag_n: float
    limit: Literal["slope", "norm"] | None


def steady(scene: Scene, hand_mps: float = HAND_MPS) -> Steady:
    """Return the force on a hand in uniform motion at ``hand_mps`` through the scene's liquid at rest.

    Only drag, after the safety layer: without wake, acceleration and buoyancy. The scene has one liquid; the loop one
    tick of delay.
    """
    (liquid,) = resolve(scene).liquids
    if not {"drag", "unsteady_drag", "non_newtonian"} & set(liquid.effects):
        return Steady(0.0, 0.0, None)
    speed_mps = met_mps(scene, liquid, scene.scale * hand_mps)
    slope_n = slope_limit(1 / scene.rate_hz, 1, scene.velocity) * speed_mps / scene.scale
    if "drag" in liquid.effects:
        drag_n = resistance_n(scene, liquid, speed_mps, liquid.drag.law)
        stable_n = min(drag_n, slope_n)
    elif "non_newtonian" in liquid.effects:
        drag_n = sum(steady_n(scene, liquid, speed_mps))
        held_n, viscous_n = steady_n(scene, liquid, speed_mps, slope_n / speed_mps if speed_mps > 0 else math.inf)
        stable_n = held_n + min(viscous_n, slope_n * (VISCOUS_SHARE if held_n > 0 else 1.0))
    else:
        drag_n, stokes_n = even_n(scene, liquid, speed_mps)
        most_late_n = LATE_SHARE * math.sqrt(2) * max(slope_n - stokes_n, 0.0)  # ball and wake have the same speed
        stable_n = drag_n if drag_n - stokes_n <= most_late_n else min(stokes_n, slope_n) + most_late_n
    force_n = min(stable_n, scene.force_limit_n)
    if force_n == drag_n:
        return Steady(force_n, drag_n, None)
    return Steady(force_n, drag_n, "norm" if force_n == scene.force_limit_n else "slope")

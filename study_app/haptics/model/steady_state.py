"""The force of an even motion by arithmetic: what the servo will send, foretold without the compiler."""

from __future__ import annotations

from typing import Final, Literal, NamedTuple

from study_app.haptics.model.bounds import lowered_mps, resistance_n
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.limits import slope_limit
from study_app.haptics.model.scene import Scene

HAND_MPS: Final = 0.1
"""A hand that explores a liquid [m/s]."""


class Steady(NamedTuple):
    """The force [N] that is sent, the drag before safety, and which limit shortened it, if one did."""

    force_n: float
    drag_n: float
    limit: Literal["slope", "norm"] | None


def steady(scene: Scene, hand_mps: float = HAND_MPS) -> Steady:
    """Return the force against a hand that moves evenly, at ``hand_mps``, through the scene's liquid at rest.

    Drag alone, after safety: no wake yet, no acceleration, and buoyancy left aside. The scene has one liquid; the loop
    one tick of delay.
    """
    (liquid,) = resolve(scene).liquids
    if "drag" not in liquid.effects:
        return Steady(0.0, 0.0, None)
    drag_n = resistance_n(scene, liquid, lowered_mps(scene.scale * hand_mps, scene.knee), liquid.drag.law)
    slope_n = (
        slope_limit(1 / scene.rate_hz, 1, scene.velocity)
        * lowered_mps(scene.scale * hand_mps, scene.knee)
        / scene.scale
    )
    force_n = min(drag_n, slope_n, scene.force_limit_n)
    if force_n == drag_n:
        return Steady(force_n, drag_n, None)
    return Steady(force_n, drag_n, "norm" if force_n == scene.force_limit_n else "slope")

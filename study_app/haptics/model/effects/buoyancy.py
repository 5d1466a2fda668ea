"""Buoyancy of the ball in the liquids, and the weight of the ball."""

from collections.abc import Mapping
from typing import Any

from study_app.haptics.model.effect import FLOAT, GRAVITY_MPS2, Effect, Extremes, Fields, Liquid, Scene

BIT = 1 << 4


def _bound_n(extremes: Extremes) -> float:
    """Return g |ρ V_sub − ρ_body V|, at the worse end of the depth range."""
    net_n = (extremes.lift_n * extremes.submerged(depth) - extremes.weight_n for depth in extremes.depth_m)
    return float(max(map(abs, net_n)))


def _fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    record.lift_n = liquid.density_kg_m3 * scene.body.volume_m3 * GRAVITY_MPS2


_PARAMETERS: Fields = (("lift_n", FLOAT),)  # ρ V g

EFFECT = Effect(
    name="buoyancy", label="Buoyancy", bit=BIT, bound_n=_bound_n, exerted_n=_bound_n, parameters=_PARAMETERS, fill=_fill
)

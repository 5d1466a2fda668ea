"""Whether what a study presents is felt, and differs: scenes that exert a force, liquids that are not equal.

Plain arithmetic without the compiler, so that whoever reads a file can ask. The force of a scene is estimated as its
ball moves through the liquid at rest, in the fastest stroke of the block's task.
"""

from __future__ import annotations

import math
from typing import Any, Final

from study_app.haptics.model.bounds import Extremes
from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.scene import Box, Everywhere, Liquid, MotionBox, Scene
from study_app.protocol.model import DeviceNeeds, SceneDefaults
from study_app.protocol.trials.tasks import Stroke

LEAST_N: Final = 0.01
"""Less is not felt: a tenth of the force that a hand at rest notices. [choice]"""


def force_n(scene: Scene, stroke: Stroke) -> float:
    """Return about how much a scene exerts at most in a stroke [N]: the sum of its strongest liquid's effects."""
    motion = MotionBox(
        speed_mps=_in_range(scene.scale * stroke.speed_mps),
        acceleration_mps2=_in_range(scene.scale * stroke.acceleration_mps2),
        depth_m=scene.motion.depth_m,
    )
    moved = scene.model_copy(update={"motion": motion})
    strongest_n = max((_liquid_n(moved, liquid) for liquid in resolve(scene).liquids), default=0.0)
    return min(strongest_n, scene.force_limit_n)


def _liquid_n(scene: Scene, liquid: Liquid) -> float:
    exerted_n = Extremes(scene, liquid).exerted_n
    return sum(newtons for effect, newtons in exerted_n.items() if effect in liquid.effects)


def _in_range(value: float) -> float:
    """Return a value of a motion that its model takes."""
    return min(max(value, 1e-3), 1000.0)


def within_tank(liquid: Liquid, scene: SceneDefaults, device: DeviceNeeds) -> bool:
    """Return whether the ball's centre meets a liquid somewhere in the tank."""
    region = liquid.region
    if isinstance(region, Everywhere):
        return True
    gaps_m = [
        max(abs(origin - centre) - scene.scale * size / 2, 0.0)
        for origin, centre, size in zip(scene.origin_m, region.centre_m, device.workspace_m, strict=True)
    ]
    if isinstance(region, Box):
        return all(gap <= size / 2 for gap, size in zip(gaps_m, region.size_m, strict=True))
    return math.hypot(gaps_m[0], gaps_m[2]) <= region.radius_m and gaps_m[1] <= region.height_m / 2


def numbers(liquid: Liquid) -> dict[str, Any]:
    """Return what makes a liquid feel as it does: all but its name, and the tables of effects it does not call for."""
    said = liquid.model_dump(exclude={"id"})
    if liquid.effects != "auto":
        said["effects"] = sorted(liquid.effects)
        for effect in EFFECTS:
            if effect.name not in liquid.effects:
                said.pop(effect.name, None)
    return said

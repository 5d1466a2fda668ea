"""The regions of the liquids: which one the body is in, and the fraction of the body in each."""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.effects.surface import submerge
from study_app.haptics.model.effects import surface
from study_app.haptics.model.layout import REGION_BOX, REGION_EVERYWHERE, Record

_HYSTERESIS_M = 1e-3
_FADE_S = 20e-3


@part
def update_volume_fractions(model: Any, interval_s: float) -> None:
    """Set the fraction φ of the body's volume in every liquid, which is also the first value for the frontal area.

    If liquids overlap, the last listed counts, for the part of the body under its surface. At a border φ changes from 0
    to 1 in 20 ms, but starts at its final value in a new scene; at a surface φ is the submerged part, without delay.
    """
    parameters, state = model.parameters[0], model.state[0]
    free = 1.0
    for i in range(parameters.liquids - 1, -1, -1):
        liquid, local = model.liquids[i], model.liquid_states[i]
        surfaced = liquid.effects & surface.BIT
        local.inside = _contains(liquid.region, state.position_m, local.inside, surfaced)
        target = free if local.inside else 0.0
        if local.border != target:
            step = interval_s / _FADE_S if state.placed else 1.0
            local.border += min(max(target - local.border, -step), step)
        local.share = local.border
        local.frontal = local.border
        if surfaced:
            submerge(liquid, local, state.position_m, parameters.radius_m)
            local.share *= local.surface.volume
            free *= 1.0 - local.inside * local.surface.volume
        else:
            free *= 1.0 - local.inside
    state.placed = 1


@part
def _contains(region: Record, place_m: Any, inside: int, surfaced: int) -> int:
    """Return 1 where ``place_m`` is in the region; a body inside leaves it 1 mm beyond the border.

    With a surface, the top face is not a border, and the region extends upward without limit.
    """
    if region.kind == REGION_EVERYWHERE:
        return 1
    margin_m = _HYSTERESIS_M if inside else 0.0
    dx = abs(place_m[0] - region.centre_m[0])
    dy = region.centre_m[1] - place_m[1] if surfaced else abs(place_m[1] - region.centre_m[1])
    dz = abs(place_m[2] - region.centre_m[2])
    if region.kind == REGION_BOX:
        within = dx <= region.half_m[0] + margin_m and dz <= region.half_m[2] + margin_m
    else:
        within = math.sqrt(dx * dx + dz * dz) <= region.half_m[0] + margin_m
    return 1 if within and dy <= region.half_m[1] + margin_m else 0

"""Where each liquid is: which one the body is in, and how much of it each one gets."""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.compiled import part
from study_app.haptics.layout import REGION_BOX, REGION_EVERYWHERE, Record

HYSTERESIS_M = 1e-3
FADE_S = 20e-3


@part
def share_out(model: Any, interval_s: float) -> None:
    """Move the share φ of every liquid toward 1 where the body is in it, else toward 0.

    Where liquids overlap, the last listed counts. φ takes 20 ms from 0 to 1, but starts at its end when a scene begins.
    """
    parameters, state = model.parameters[0], model.state[0]
    taken = False
    for i in range(parameters.liquids - 1, -1, -1):
        local = model.liquid_states[i]
        local.inside = _contains(model.liquids[i].region, state.position_m, local.inside)
        target = 1.0 if local.inside and not taken else 0.0
        taken = taken or local.inside != 0
        step = interval_s / FADE_S if state.placed else 1.0
        local.share += min(max(target - local.share, -step), step)
    state.placed = 1


@part
def _contains(region: Record, place_m: Any, inside: int) -> int:
    """Return 1 where ``place_m`` is in the region; a body that was inside leaves it 1 mm beyond the border."""
    if region.kind == REGION_EVERYWHERE:
        return 1
    margin_m = HYSTERESIS_M if inside else 0.0
    dx = abs(place_m[0] - region.centre_m[0])
    dy = abs(place_m[1] - region.centre_m[1])
    dz = abs(place_m[2] - region.centre_m[2])
    if region.kind == REGION_BOX:
        within = dx <= region.half_m[0] + margin_m and dz <= region.half_m[2] + margin_m
    else:
        within = math.sqrt(dx * dx + dz * dz) <= region.half_m[0] + margin_m
    return 1 if within and dy <= region.half_m[1] + margin_m else 0

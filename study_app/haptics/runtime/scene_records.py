"""Converts a liquid into the record that its effects read, and into the rows of the effects' arrays."""

from collections import namedtuple
from collections.abc import Mapping
from typing import Any, Final, TypeAlias

from study_app.haptics.model import layout
from study_app.haptics.model.effect import Rows
from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.liquid import Box, Cylinder, Liquid, Region
from study_app.haptics.model.scene import Scene

KINDS: Final[tuple[Rows, ...]] = tuple(rows for effect in EFFECTS for rows in effect.rows)
_ARRAYS: Final = tuple(name for kind in KINDS for name in kind.arrays)

EffectRows: Final[Any] = namedtuple("EffectRows", _ARRAYS)  # type: ignore[misc]
EffectRows.__doc__ = "The arrays of a model that effects own, by name."

Counts: TypeAlias = Mapping[str, int]
"""A number of rows for each of these arrays."""


def rows_needed(scene: Scene) -> Counts:
    """Return the rows that the effects of a scene's liquids own."""
    rows = no_rows()
    for liquid in scene.liquids:
        rows = rows_after(rows, liquid, scene.rate_hz)
    return rows


def no_rows() -> Counts:
    """Return none."""
    return dict.fromkeys(_ARRAYS, 0)


def rows_after(rows: Counts, liquid: Liquid, rate_hz: float) -> Counts:
    """Return the rows plus those that a liquid's effects own."""
    added = {
        name: kind.needed(liquid, rate_hz)
        for effect in EFFECTS
        if effect.name in liquid.effects
        for kind in effect.rows
        for name in kind.arrays
    }
    return {name: count + added.get(name, 0) for name, count in rows.items()}


def most_rows(liquids: int, capacity: int, rate_hz: float) -> Counts:
    """Return the rows for any ``liquids``; ``capacity`` where only the caller knows their number."""
    return {
        name: capacity if kind.most is None else liquids * kind.most(rate_hz) for kind in KINDS for name in kind.arrays
    }


def count_open_ended(rows: Counts) -> int:
    """Return the greatest number of the rows that only the caller that packs scenes knows."""
    return max((rows[name] for kind in KINDS if kind.most is None for name in kind.arrays), default=0)


def fill(record: layout.Record, liquid: Liquid, scene: Scene, first: Counts) -> None:
    """Write only the parameters of a liquid's effects, for rows from ``first`` on."""
    _fill_region(record.region, liquid.region)
    for effect in EFFECTS:
        if effect.name in liquid.effects:
            record.effects |= effect.bit
            if effect.parameters is not None:
                effect.fill(record[effect.name], liquid, scene, first)


def _fill_region(record: layout.Record, region: Region) -> None:
    if isinstance(region, Box):
        record.kind = layout.REGION_BOX
        record.centre_m[:] = region.centre_m
        record.half_m[:] = [size / 2 for size in region.size_m]
    elif isinstance(region, Cylinder):
        record.kind = layout.REGION_CYLINDER
        record.centre_m[:] = region.centre_m
        record.half_m[:] = region.radius_m, region.height_m / 2, region.radius_m
    else:
        record.kind = layout.REGION_EVERYWHERE

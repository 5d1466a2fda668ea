"""A liquid becomes the record its effects read, and rows of the model's arrays for those effects that own some."""

from __future__ import annotations

import math
from typing import NamedTuple

from study_app.haptics.model import layout
from study_app.haptics.model.effects import records
from study_app.haptics.model.liquid import (
    Box,
    Channel,
    Current,
    Cylinder,
    History,
    Liquid,
    LocalWake,
    Region,
    Uniform,
    Wake,
)
from study_app.haptics.model.scene import Body, Scene

GRAVITY_MPS2 = 9.80665
WAKE_RATE_HZ = 1000.0
LONGEST_WINDOW_S = 0.5

_EFFECTS = {
    "drag": layout.EFFECT_DRAG,
    "wake": layout.EFFECT_WAKE,
    "local_wake": layout.EFFECT_LOCAL_WAKE,
    "current": layout.EFFECT_CURRENT,
    "buoyancy": layout.EFFECT_BUOYANCY,
    "surface": layout.EFFECT_SURFACE,
    "added_mass": layout.EFFECT_ADDED_MASS,
    "history": layout.EFFECT_HISTORY,
}
_LAWS = {
    "constant": records.LAW_CONSTANT,
    "schiller-naumann": records.LAW_SCHILLER_NAUMANN,
    "haider-levenspiel": records.LAW_HAIDER_LEVENSPIEL,
    "brown-lawler": records.LAW_BROWN_LAWLER,
}


class Rows(NamedTuple):
    """How many rows of the model's arrays effects own."""

    elements: int = 0
    cells: int = 0
    intervals: int = 0
    exponentials: int = 0

    def plus(self, other: Rows) -> Rows:
        """Return the rows of both."""
        return Rows(*(mine + theirs for mine, theirs in zip(self, other, strict=True)))


def rows_of(liquid: Liquid, rate_hz: float) -> Rows:
    """Return the rows that a liquid's effects own."""
    history = "history" in liquid.effects
    return Rows(
        elements=scaled_length(liquid.wake, rate_hz) if liquid.wake is not None and "wake" in liquid.effects else 0,
        cells=records.CELLS if "local_wake" in liquid.effects else 0,
        intervals=_intervals(liquid.history.window_s, rate_hz) if history else 0,
        exponentials=records.EXPONENTIALS if history else 0,
    )


def most_rows(liquids: int, elements: int, rate_hz: float) -> Rows:
    """Return the rows that any ``liquids`` own which have up to ``elements`` wake elements together."""
    intervals = _intervals(LONGEST_WINDOW_S, rate_hz)
    return Rows(elements, liquids * records.CELLS, liquids * intervals, liquids * records.EXPONENTIALS)


def scaled_length(wake: Wake | LocalWake, rate_hz: float) -> int:
    """Return N at the scene's rate: rounded down, at least 1."""
    return max(1, math.floor(wake.length * rate_hz / WAKE_RATE_HZ))


def bits(liquid: Liquid) -> int:
    """Return the EFFECT_* bits of the effects that a liquid names."""
    return sum(_EFFECTS[effect] for effect in liquid.effects)


def fill(record: layout.Record, liquid: Liquid, scene: Scene, first: Rows) -> None:
    """Write what a liquid's effects need, and nothing else, for rows from ``first`` on."""
    effects = liquid.effects
    record.effects = bits(liquid)
    _fill_region(record.region, liquid.region)
    if "drag" in effects:
        _fill_drag(record.drag, liquid, scene.body)
    if liquid.wake is not None and "wake" in effects:
        _fill_wake(record.wake, liquid.wake, scene.rate_hz, first.elements)
    if liquid.local_wake is not None and "local_wake" in effects:
        _fill_local_wake(record.local_wake, liquid.local_wake, scene, first.cells)
    if liquid.current is not None and "current" in effects:
        _fill_current(record.current, liquid.current)
    if "buoyancy" in effects:
        record.buoyancy.lift_n = liquid.density_kg_m3 * volume_m3(scene.body) * GRAVITY_MPS2
    if "added_mass" in effects:
        record.added_mass.mass_kg = liquid.added_mass.coefficient * liquid.density_kg_m3 * volume_m3(scene.body)
        record.added_mass.filter_per_s = _per_s(scene.smoothing_s(liquid.added_mass))
    if liquid.viscosity_pa_s is not None and "history" in effects:
        _fill_history(record.history, liquid.history, scene, first)
        stickiness = math.sqrt(math.pi * liquid.density_kg_m3 * liquid.viscosity_pa_s)
        record.history.factor_kg_rs = 1.5 * scene.body.diameter_m**2 * stickiness


def volume_m3(body: Body) -> float:
    """Return the volume of the ball."""
    return math.pi / 6 * body.diameter_m**3


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


def _fill_drag(record: layout.Record, liquid: Liquid, body: Body) -> None:
    record.law = _LAWS[liquid.drag.law]
    record.factor_kg_m = 0.5 * liquid.density_kg_m3 * body.drag_coefficient * math.pi / 4 * body.diameter_m**2
    if liquid.drag.law != "constant" and liquid.viscosity_pa_s is not None:
        record.stokes_nspm = 3 * math.pi * liquid.viscosity_pa_s * body.diameter_m
        record.reynolds_spm = liquid.density_kg_m3 * body.diameter_m / liquid.viscosity_pa_s


def _fill_wake(record: layout.Record, wake: Wake, rate_hz: float, row: int) -> None:
    _fill_tail(record, wake, rate_hz, row)
    record.breaking_cosine = math.cos(math.radians(wake.breaking_angle_deg))
    record.breaking_span_m = wake.breaking_span_m
    record.resolution_m = wake.resolution_m


def _fill_local_wake(record: layout.Record, wake: LocalWake, scene: Scene, row: int) -> None:
    _fill_tail(record, wake, scene.rate_hz, row)
    record.cell_m = scene.body.diameter_m
    record.cell_elements = max(1, math.ceil(record.length / 16))
    record.reach_m = wake.reach_m or scene.body.diameter_m
    record.spreading_m2ps = wake.spreading_m2ps


def _fill_tail(record: layout.Record, wake: Wake | LocalWake, rate_hz: float, row: int) -> None:
    """Write what the two wakes have in common."""
    record.row = row
    record.length = scaled_length(wake, rate_hz)
    record.scaling = max(wake.scaling * rate_hz / WAKE_RATE_HZ, record.length)
    record.exponent = wake.exponent
    record.log_decay_per_s = WAKE_RATE_HZ * math.log(wake.decay)
    record.vertical = 1.0 if wake.axes == "xyz" else 0.0


def _fill_current(record: layout.Record, current: Current) -> None:
    if isinstance(current, Uniform):
        record.kind = records.CURRENT_UNIFORM
        record.velocity_mps[:] = current.velocity_mps
        return
    record.centre_m[:] = current.centre_m
    if isinstance(current, Channel):
        record.kind = records.CURRENT_CHANNEL
        heading = math.radians(current.heading_deg)
        record.velocity_mps[:] = current.peak_mps * math.cos(heading), 0.0, -current.peak_mps * math.sin(heading)
        record.across[:] = math.sin(heading), 0.0, math.cos(heading)
        record.size_m = current.width_m / 2
    else:
        record.kind = records.CURRENT_VORTEX
        record.size_m = current.core_m
        record.peak_mps = current.peak_mps


def _fill_history(record: layout.Record, history: History, scene: Scene, first: Rows) -> None:
    record.row = first.intervals
    record.rows = _intervals(history.window_s, scene.rate_hz)
    record.tail_row = first.exponentials
    record.window_s = history.window_s
    record.filter_per_s = _per_s(scene.smoothing_s(history))


def _intervals(window_s: float, rate_hz: float) -> int:
    """Return the rows that a window takes at the scene's rate, with room for a late tick or two."""
    return math.ceil(window_s * rate_hz) + 4


def _per_s(time_s: float) -> float:
    """Return the rate of a filter."""
    return math.inf if time_s == 0 else 1 / time_s

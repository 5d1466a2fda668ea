"""A scene becomes the memory the compiled code reads: allocated once, here, and refilled in place."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from study_app.errors import StudyError
from study_app.haptics import layout
from study_app.haptics.limits import slope_limit
from study_app.haptics.scene import MAX_LIQUIDS, MAX_WINDOW, Box, Cylinder, Ewma, Foaw, Given, Line, Region, Scene, Wake

_EFFECTS = {"drag": layout.EFFECT_DRAG, "wake": layout.EFFECT_WAKE}
_ESTIMATORS = {
    "ewma": layout.ESTIMATOR_EWMA,
    "given": layout.ESTIMATOR_GIVEN,
    "line": layout.ESTIMATOR_LINE,
    "foaw": layout.ESTIMATOR_FOAW,
    "raw": layout.ESTIMATOR_RAW,
}
_KNEES = {"none": layout.KNEE_NONE, "sqrt": layout.KNEE_SQRT, "square": layout.KNEE_SQUARE}
_WAKE_RATE_HZ = 1000.0


class Model(NamedTuple):
    """The memory of one scene: recarrays of the types in ``layout``; the first two constant, the others moving."""

    parameters: Any  # (1,) PARAMETERS
    liquids: Any  # (n,) LIQUID
    state: Any  # (1,) STATE
    liquid_states: Any  # (n,) LIQUID_STATE
    elements: Any  # (rows,) ELEMENT, of all wakes, each in its own stretch
    segments: Any  # (rows,) SEGMENT, likewise
    window: Any  # (rows,) WINDOW, the newest samples of the estimators that look back


def elements_needed(scene: Scene) -> int:
    """Return how many wake rows the scene owns: none where no liquid asks for a wake."""
    wakes = [liquid.wake for liquid in scene.liquids if liquid.wake is not None and "wake" in liquid.effects]
    return sum(_scaled_length(wake, scene.rate_hz) for wake in wakes)


def window_needed(scene: Scene) -> int:
    """Return how many samples the velocity estimator keeps: none for those that do not look back."""
    return scene.velocity.samples if isinstance(scene.velocity, Line | Foaw) else 0


def pack(scene: Scene, *, capacity: int | None = None, slope_limit_nspm: float | None = None) -> Model:
    """Return the memory of ``scene``.

    ``capacity`` is the least number of wake rows to own, with room for any number of liquids, so that other scenes fit
    in later (`pack_into`); by default the model owns exactly what the scene calls for. ``slope_limit_nspm`` is the
    greatest damping at the hand; by default that of one tick of delay at the scene's rate.
    """
    rows = elements_needed(scene)
    liquids = len(scene.liquids) if capacity is None else MAX_LIQUIDS
    rows = rows if capacity is None else max(rows, capacity)
    model = Model(
        parameters=layout.records(layout.PARAMETERS, 1),
        liquids=layout.records(layout.LIQUID, liquids),
        state=layout.records(layout.STATE, 1),
        liquid_states=layout.records(layout.LIQUID_STATE, liquids),
        elements=layout.records(layout.ELEMENT, rows),
        segments=layout.records(layout.SEGMENT, rows),
        window=layout.records(layout.WINDOW, window_needed(scene) if capacity is None else MAX_WINDOW),
    )
    _fill(model, scene, slope_limit(1 / scene.rate_hz, 1) if slope_limit_nspm is None else slope_limit_nspm)
    return model


def pack_into(model: Model, scene: Scene, *, delay_ticks: int = 1) -> None:
    """Fill memory made by `pack` with another scene, its state afresh, for a loop of ``delay_ticks`` of delay.

    Raises
    ------
    StudyError
        The scene does not fit, or takes its velocity from a table: a device has none.
    """
    if isinstance(scene.velocity, Given):
        raise StudyError('velocity "given" is for motions from a file; a device needs an estimator such as "ewma"')
    rows = elements_needed(scene)
    if rows > len(model.elements) or len(scene.liquids) > len(model.liquids):
        raise StudyError(
            f"the scene needs {rows} wake elements and {len(scene.liquids)} liquids; the servo was started with room "
            f"for {len(model.elements)} and {len(model.liquids)}: start it with more elements"
        )
    if window_needed(scene) > len(model.window):
        raise StudyError(
            f'velocity "{scene.velocity.kind}" looks at {window_needed(scene)} samples; the model was packed with room '
            f"for {len(model.window)}: pack it with a capacity"
        )
    _fill(model, scene, slope_limit(1 / scene.rate_hz, delay_ticks))


def _fill(model: Model, scene: Scene, slope_limit_nspm: float) -> None:
    """Write constants and a fresh state."""
    for rows in (model.parameters, model.liquids, model.state, model.liquid_states):
        rows.view(np.uint8)[:] = 0
    parameters = model.parameters[0]
    parameters.scale = scene.scale
    parameters.origin_m[:] = scene.origin_m
    parameters.period_s = 1 / scene.rate_hz
    parameters.liquids = len(scene.liquids)
    parameters.estimator = _ESTIMATORS[scene.velocity.kind]
    parameters.window_samples = window_needed(scene)
    if isinstance(scene.velocity, Ewma):
        keep = 1 - scene.velocity.alpha
        parameters.log_keep_per_s = _WAKE_RATE_HZ * math.log(keep) if keep > 0 else -math.inf
    elif isinstance(scene.velocity, Foaw):
        parameters.tolerance_m = scene.velocity.tolerance_m * scene.scale
    parameters.knee_law = _KNEES[scene.knee.law]
    parameters.knee_threshold_mps = scene.knee.threshold_mps
    parameters.slope_limit_nspm = slope_limit_nspm / scene.scale
    parameters.force_limit_n = scene.force_limit_n
    row = 0
    for record, liquid in zip(model.liquids, scene.liquids, strict=False):
        record.effects = sum(_EFFECTS[effect] for effect in liquid.effects)
        _fill_region(record.region, liquid.region)
        if "drag" in liquid.effects:
            frontal_m2 = math.pi * scene.body.diameter_m**2 / 4
            record.drag.factor_kg_m = 0.5 * liquid.density_kg_m3 * scene.body.drag_coefficient * frontal_m2
        if liquid.wake is not None and "wake" in liquid.effects:
            row = _fill_wake(record.wake, liquid.wake, scene.rate_hz, row)


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


def _fill_wake(record: layout.Record, wake: Wake, rate_hz: float, row: int) -> int:
    """Write a wake that owns the rows from ``row`` on; return the first row after it."""
    record.row = row
    record.length = _scaled_length(wake, rate_hz)
    record.scaling = max(wake.scaling * rate_hz / _WAKE_RATE_HZ, record.length)
    record.exponent = wake.exponent
    record.breaking_cosine = math.cos(math.radians(wake.breaking_angle_deg))
    record.breaking_span_m = wake.breaking_span_m
    record.log_decay_per_s = _WAKE_RATE_HZ * math.log(wake.decay)
    record.resolution_m = wake.resolution_m
    record.vertical = 1.0 if wake.axes == "xyz" else 0.0
    return row + int(record.length)


def _scaled_length(wake: Wake, rate_hz: float) -> int:
    """Return N at the scene's rate: rounded down, at least 1."""
    return max(1, math.floor(wake.length * rate_hz / _WAKE_RATE_HZ))

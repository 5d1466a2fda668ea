"""A scene becomes the memory the compiled code reads: allocated once, here, and refilled in place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model import layout
from study_app.haptics.model.device_dynamics import MOST_DELAY, UNKNOWN, Dynamics
from study_app.haptics.model.effects import records
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.limits import CUT_INERTIA_SHARE, LIGHTER, MEASURED_KG, Bearable, bearable, slew_limit_n
from study_app.haptics.model.scene import MAX_LIQUIDS, MAX_WINDOW, Ewma, Foaw, Given, Kalman, Line, Scene
from study_app.haptics.runtime.scene_records import (
    GRAVITY_MPS2,
    WAKE_RATE_HZ,
    Rows,
    fill,
    most_rows,
    rows_of,
    volume_m3,
)

_ESTIMATORS = {
    "ewma": layout.ESTIMATOR_EWMA,
    "given": layout.ESTIMATOR_GIVEN,
    "line": layout.ESTIMATOR_LINE,
    "foaw": layout.ESTIMATOR_FOAW,
    "raw": layout.ESTIMATOR_RAW,
    "kalman": layout.ESTIMATOR_KALMAN,
}
_KNEES = {"none": layout.KNEE_NONE, "sqrt": layout.KNEE_SQRT, "square": layout.KNEE_SQUARE}

KALMAN_LAG_S = 2e-3
"""What the Kalman filter lags by where a motion changes abruptly; in smooth ones less."""


class Model(NamedTuple):
    """The memory of one scene: recarrays of the types in ``layout``; the first two constant, the others moving.

    From ``elements`` on they hold what effects own, each liquid's rows in a stretch of its own.
    """

    parameters: Any  # (1,) PARAMETERS
    liquids: Any  # (n,) LIQUID
    state: Any  # (1,) STATE
    liquid_states: Any  # (n,) LIQUID_STATE
    window: Any  # (rows,) WINDOW, the newest samples of the estimators that look back
    elements: Any  # (rows,) ELEMENT, of wakes
    segments: Any  # (rows,) SEGMENT, likewise
    cells: Any  # (rows,) CELL, of local wakes
    intervals: Any  # (rows,) INTERVAL, of histories
    exponentials: Any  # (rows,) EXPONENTIAL, likewise


def elements_needed(scene: Scene) -> int:
    """Return how many wake rows the scene owns: none where no liquid asks for a wake."""
    return _rows_needed(resolve(scene)).elements


def window_needed(scene: Scene) -> int:
    """Return how many samples the velocity estimator keeps: none for those that do not look back."""
    return scene.velocity.samples if isinstance(scene.velocity, Line | Foaw) else 0


def pack(
    scene: Scene, *, capacity: int | None = None, limits: Bearable | None = None, dynamics: Dynamics = UNKNOWN
) -> Model:
    """Return the memory of ``scene``; where it leaves the choice of effects, ``gate`` makes it.

    ``capacity`` is the least number of wake rows to own, with room for any number of liquids, so that other scenes fit
    in later (`pack_into`); by default the model owns exactly what the scene calls for. ``limits`` is the greatest
    damping at the hand; by default what a loop of the scene's rate and estimator bears at each delay. ``dynamics`` are
    those of the device.
    """
    scene = _for_device(scene, dynamics)
    rows = _rows_needed(scene)
    if capacity is not None:
        rows = most_rows(MAX_LIQUIDS, max(rows.elements, capacity), scene.rate_hz)
    liquids = len(scene.liquids) if capacity is None else MAX_LIQUIDS
    model = Model(
        parameters=layout.records(layout.PARAMETERS, 1),
        liquids=layout.records(layout.LIQUID, liquids),
        state=layout.records(layout.STATE, 1),
        liquid_states=layout.records(layout.LIQUID_STATE, liquids),
        window=layout.records(layout.WINDOW, window_needed(scene) if capacity is None else MAX_WINDOW),
        elements=layout.records(records.ELEMENT, rows.elements),
        segments=layout.records(records.SEGMENT, rows.elements),
        cells=layout.records(records.CELL, rows.cells),
        intervals=layout.records(records.INTERVAL, rows.intervals),
        exponentials=layout.records(records.EXPONENTIAL, rows.exponentials),
    )
    _fill(model, scene, _by_delay(scene, dynamics) if limits is None else (limits,) * (MOST_DELAY + 1), dynamics)
    return model


def pack_into(model: Model, scene: Scene, *, dynamics: Dynamics = UNKNOWN) -> None:
    """Fill memory made by `pack` with another scene, its state afresh, for a device of these ``dynamics``.

    Raises
    ------
    StudyError
        The scene does not fit, or takes its velocity from a table: a device has none.
    """
    if isinstance(scene.velocity, Given):
        raise StudyError('velocity "given" is for motions from a file; a device needs an estimator such as "ewma"')
    scene = _for_device(scene, dynamics)
    rows = _rows_needed(scene)
    if rows.elements > len(model.elements) or len(scene.liquids) > len(model.liquids):
        raise StudyError(
            f"the scene needs {rows.elements} wake elements and {len(scene.liquids)} liquids; the servo was started "
            f"with room for {len(model.elements)} and {len(model.liquids)}: start it with more elements"
        )
    if window_needed(scene) > len(model.window):
        raise StudyError(
            f'velocity "{scene.velocity.kind}" looks at {window_needed(scene)} samples; the model was packed with room '
            f"for {len(model.window)}: pack it with a capacity"
        )
    if rows.cells > len(model.cells) or rows.intervals > len(model.intervals):
        raise StudyError(
            f"the scene needs {rows.cells} cells of local wakes and {rows.intervals} intervals of histories; the model "
            f"was packed with room for {len(model.cells)} and {len(model.intervals)}: pack it with a capacity"
        )
    _fill(model, scene, _by_delay(scene, dynamics), dynamics)


def adjust_into(model: Model, scene: Scene, *, dynamics: Dynamics = UNKNOWN) -> None:
    """Give memory of `pack` the numbers of a scene built like the one in it (`built_alike`); its state goes on."""
    scene = _for_device(scene, dynamics)
    _fill_constants(model, scene, _by_delay(scene, dynamics), dynamics)


def built_alike(scene: Scene, other: Scene) -> bool:
    """Return whether one scene's state means the same to the other: only numbers differ that no state was made with.

    Of rows, effects, laws and kinds nothing may differ, nor how the hand is placed in the scene. A history and a local
    wake are kept in portions that depend on their numbers.
    """
    mine, others = _constants(resolve(scene)), _constants(resolve(other))
    if any(record.effects & (layout.EFFECT_HISTORY | layout.EFFECT_LOCAL_WAKE) for record in mine.liquids):
        return False
    return (
        len(mine.liquids) == len(others.liquids)
        and all(np.array_equal(mine.parameters[name], others.parameters[name]) for name in ("scale", "origin_m"))
        and _whole_numbers(mine.parameters) == _whole_numbers(others.parameters)
        and _whole_numbers(mine.liquids) == _whole_numbers(others.liquids)
    )


def _constants(scene: Scene) -> Model:
    """Return a resolved scene's constants, in memory that holds nothing else."""
    nothing = [layout.records(layout.STATE, 0)] * (len(Model._fields) - 2)
    model = Model(layout.records(layout.PARAMETERS, 1), layout.records(layout.LIQUID, len(scene.liquids)), *nothing)
    _fill_constants(model, scene, _by_delay(scene, UNKNOWN), UNKNOWN)
    return model


def _whole_numbers(rows: Any) -> list[int]:
    """Return every whole number in records: rows owned, effects, laws, kinds."""
    if rows.dtype.names is None:
        return [int(it) for it in rows.ravel()] if rows.dtype.kind == "i" else []
    return [number for name in rows.dtype.names for number in _whole_numbers(rows[name])]


def _for_device(scene: Scene, dynamics: Dynamics) -> Scene:
    """Return the scene with its effects chosen; "kalman" is for devices that measure their delay, others get "ewma"."""
    if isinstance(scene.velocity, Kalman) and dynamics.delay_s is None:
        scene = scene.model_copy(update={"velocity": Ewma()})
    return resolve(scene)


def _rows_needed(scene: Scene) -> Rows:
    return reduce(Rows.plus, (rows_of(liquid, scene.rate_hz) for liquid in scene.liquids), Rows())


def _by_delay(scene: Scene, dynamics: Dynamics) -> Sequence[Bearable]:
    """Return what a loop of the scene's rate, estimator and device bears at each delay, 0 to `MOST_DELAY` ticks."""
    lighter = min(dynamics.mass_kg / MEASURED_KG, 1.0) ** LIGHTER
    found = (bearable(1 / scene.rate_hz, delay, scene.velocity) for delay in range(MOST_DELAY + 1))
    return [Bearable(lighter * limit.drag_nspm, lighter * limit.inertia_nspm) for limit in found]


def _fill(model: Model, scene: Scene, limits: Sequence[Bearable], dynamics: Dynamics) -> None:
    """Write constants and a fresh state."""
    for rows in (model.state, model.liquid_states):
        rows.view(np.uint8)[:] = 0
    _fill_constants(model, scene, limits, dynamics)


def _fill_constants(model: Model, scene: Scene, limits: Sequence[Bearable], dynamics: Dynamics) -> None:
    for rows in (model.parameters, model.liquids):
        rows.view(np.uint8)[:] = 0
    parameters = model.parameters[0]
    parameters.scale = scene.scale
    parameters.origin_m[:] = scene.origin_m
    parameters.period_s = 1 / scene.rate_hz
    parameters.liquids = len(scene.liquids)
    parameters.radius_m = scene.body.diameter_m / 2
    parameters.weight_n = scene.body.density_kg_m3 * volume_m3(scene.body) * GRAVITY_MPS2
    parameters.estimator = _ESTIMATORS[scene.velocity.kind]
    parameters.window_samples = window_needed(scene)
    if isinstance(scene.velocity, Ewma | Kalman):
        alpha = scene.velocity.alpha if isinstance(scene.velocity, Ewma) else Ewma().alpha
        keep = 1 - alpha
        parameters.log_keep_per_s = WAKE_RATE_HZ * math.log(keep) if keep > 0 else -math.inf
        parameters.fallback_lag_s = keep / (alpha * WAKE_RATE_HZ)
        is_ewma = isinstance(scene.velocity, Ewma)
        parameters.filter_lag_s = parameters.fallback_lag_s if is_ewma else KALMAN_LAG_S
    elif isinstance(scene.velocity, Foaw):
        parameters.tolerance_m = scene.velocity.tolerance_m * scene.scale
    parameters.knee_law = _KNEES[scene.knee.law]
    parameters.knee_threshold_mps = scene.knee.threshold_mps
    parameters.slope_limit_nspm = [limit.drag_nspm / scene.scale for limit in limits]
    parameters.force_limit_n = scene.force_limit_n
    parameters.slew_n = slew_limit_n(1 / scene.rate_hz, dynamics, scene.velocity)
    parameters.count_m = dynamics.count_m
    parameters.mass_kg = dynamics.mass_kg
    first = Rows()
    for record, liquid in zip(model.liquids, scene.liquids, strict=False):
        fill(record, liquid, scene, first)
        record.inertia_share = [_inertia_share(record, limit, scene.scale) for limit in limits]
        first = first.plus(rows_of(liquid, scene.rate_hz))
        parameters.effects |= record.effects


def _inertia_share(record: layout.Record, limits: Bearable, scale: float) -> float:
    """Return how much of added mass and history the loop bears, as the damper that fast motion meets in them.

    An added mass M smoothed over τ is a damper M/τ, a history H smoothed likewise one of about 0.4 H/√τ at the
    frequency where a loop becomes unstable. What does not fit whole is cut down to what any loop bears. [choice]
    """
    damping_nspm = 0.0
    if record.effects & layout.EFFECT_ADDED_MASS and math.isfinite(record.added_mass.filter_per_s):
        damping_nspm += record.added_mass.mass_kg * record.added_mass.filter_per_s
    if record.effects & layout.EFFECT_HISTORY and math.isfinite(record.history.filter_per_s):
        damping_nspm += 0.7 * record.history.factor_kg_rs * math.sqrt(record.history.filter_per_s)
    if damping_nspm * scale <= limits.inertia_nspm:
        return 1.0
    return min(limits.inertia_nspm, CUT_INERTIA_SHARE * limits.drag_nspm) / (damping_nspm * scale)

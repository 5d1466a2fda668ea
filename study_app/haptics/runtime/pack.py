"""Packs a scene into the memory that compiled code reads, which is allocated once and refilled in place.

Each liquid is converted into the record that its effects read, and into the rows of the effects' arrays.
"""

import math
from collections import namedtuple
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model import layout
from study_app.haptics.model.device_dynamics import MOST_DELAY, UNKNOWN, Dynamics
from study_app.haptics.model.effect import GRAVITY_MPS2, Rows
from study_app.haptics.model.effects import EFFECTS, current, history, local_wake, non_newtonian, wake
from study_app.haptics.model.estimators import MOST_LAG_TICKS, DeviceVelocity
from study_app.haptics.model.estimators import NAMED as ESTIMATORS
from study_app.haptics.model.force_rules import CURRENT, ForceRules
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.scene import (
    MAX_LIQUIDS,
    STORED_FORCES,
    Box,
    Cylinder,
    Ewma,
    Given,
    Kalman,
    Liquid,
    Region,
    Scene,
    Withdrawn,
)
from study_app.haptics.model.slope_limits import MEASURED_KG, DampingLimits, handle_limits, slew_limit_n

KINDS: Final[tuple[Rows, ...]] = tuple(rows for effect in EFFECTS for rows in effect.rows)
_EXPLICIT: Final = history.BIT | current.BIT | wake.BIT | local_wake.BIT
_ELASTIC: Final = (non_newtonian.KIND_HERSCHEL_BULKLEY, non_newtonian.KIND_MAXWELL)
_ARRAYS: Final = tuple(name for kind in KINDS for name in kind.arrays)
_NEVER_TICKS: Final = MOST_DELAY + 1
_EffectRows: Final[Any] = namedtuple("_EffectRows", _ARRAYS)  # type: ignore[misc]
_EffectRows.__doc__ = "The arrays of a model that effects own, by name."
_Counts: TypeAlias = Mapping[str, int]
"""A number of rows for each of these arrays."""
_RESOLUTION = 1e-6
"""Resolution of the factor of smoothing rates."""
_COMPRESSIONS = {"none": layout.COMPRESSION_NONE, "sqrt": layout.COMPRESSION_SQRT, "square": layout.COMPRESSION_SQUARE}


def _rows_needed(scene: Scene) -> _Counts:
    """Return the rows that the effects of a scene's liquids own."""
    rows = _no_rows()
    for liquid in scene.liquids:
        rows = _rows_after(rows, liquid, scene.rate_hz)
    return rows


def _no_rows() -> _Counts:
    """Return a count of 0 for every array."""
    return dict.fromkeys(_ARRAYS, 0)


def _rows_after(rows: _Counts, liquid: Liquid, rate_hz: float) -> _Counts:
    """Return the rows plus those that a liquid's effects own."""
    added = {
        name: kind.needed(liquid, rate_hz)
        for effect in EFFECTS
        if effect.name in liquid.effects
        for kind in effect.rows
        for name in kind.arrays
    }
    return {name: count + added.get(name, 0) for name, count in rows.items()}


def _most_rows(liquids: int, capacity: int, rate_hz: float) -> _Counts:
    """Return the rows for any ``liquids``; ``capacity`` where only the caller knows their number."""
    return {
        name: capacity if kind.most is None else liquids * kind.most(rate_hz) for kind in KINDS for name in kind.arrays
    }


def _count_open_ended(rows: _Counts) -> int:
    """Return the greatest number of the rows that only the caller that packs scenes knows."""
    return max((rows[name] for kind in KINDS if kind.most is None for name in kind.arrays), default=0)


def fill(record: layout.Record, liquid: Liquid, scene: Scene, first: _Counts) -> None:
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


class Model(NamedTuple):
    """The memory of one scene: recarrays of the types in ``layout``; the first two are constant, the others state."""

    parameters: Any  # (1,) PARAMETERS
    liquids: Any  # (n,) LIQUID
    state: Any  # (1,) STATE
    liquid_states: Any  # (n,) LIQUID_STATE
    forces_n: Any  # (STORED_FORCES, 3) the newest forces [N], if the scene's link delays them; else (0, 3)
    rows: Any  # `_EffectRows`: arrays of the effects, with contiguous rows per liquid

    @property
    def arrays(self) -> tuple[Any, ...]:
        """All its arrays, those of effects last."""
        return (*self[:-1], *self.rows)


def elements_needed(scene: Scene) -> int:
    """Return the number of wake rows of the scene: 0 if no liquid has a wake."""
    return _count_open_ended(_rows_needed(resolve(scene)))


def pack(
    scene: Scene,
    *,
    capacity: int | None = None,
    limits: DampingLimits | None = None,
    dynamics: Dynamics = UNKNOWN,
    rules: ForceRules = CURRENT,
) -> Model:
    """Return the memory of ``scene``; ``gate`` selects effects that the scene leaves open.

    ``capacity`` is the least number of wake rows to own, with room for any number of liquids, so that other scenes fit
    in later (`pack_into`); by default the model owns exactly what the scene calls for. ``limits`` is the greatest
    damping at the hand; by default those of the scene's rate and estimator at each delay. ``dynamics`` are
    those of the device, ``rules`` those of the version that computes the force.
    """
    scene = _adapt_to_device(scene, dynamics)
    rows = _rows_needed(scene)
    if capacity is not None:
        rows = _most_rows(MAX_LIQUIDS, max(_count_open_ended(rows), capacity), scene.rate_hz)
    liquids = len(scene.liquids) if capacity is None else MAX_LIQUIDS
    model = Model(
        parameters=layout.records(layout.PARAMETERS, 1),
        liquids=layout.records(layout.LIQUID, liquids),
        state=layout.records(layout.STATE, 1),
        liquid_states=layout.records(layout.LIQUID_STATE, liquids),
        forces_n=np.zeros((STORED_FORCES if capacity is not None or scene.link.acts else 0, 3)),
        rows=_EffectRows(
            **{
                name: layout.records(layout.record_type(fields), rows[name])
                for kind in KINDS
                for name, fields in kind.arrays.items()
            }
        ),
    )
    by_delay = _limits_by_delay(scene, dynamics, rules) if limits is None else (limits,) * (MOST_DELAY + 1)
    _fill(model, scene, by_delay, dynamics, rules)
    return model


def pack_into(model: Model, scene: Scene, *, dynamics: Dynamics = UNKNOWN) -> None:
    """Fill memory made by `pack` with another scene and a reset state, for a device of these ``dynamics``.

    Raises
    ------
    StudyError
        The scene does not fit, or requires a given velocity, which a device does not have.
    """
    if isinstance(scene.velocity, Given):
        raise StudyError('velocity "given" is only for motions from a file; a device needs an estimator such as "ewma"')
    scene = _adapt_to_device(scene, dynamics)
    if len(scene.liquids) > len(model.liquids):
        raise StudyError(
            f"the scene needs {len(scene.liquids)} liquids, but the model was packed for {len(model.liquids)}: pack it "
            "with a larger capacity"
        )
    if scene.link.acts and len(model.forces_n) == 0:
        raise StudyError(
            "the scene delays its force, but the model was packed without room for delayed forces: specify a capacity "
            "when you pack it"
        )
    rows = _rows_needed(scene)
    for kind in KINDS:
        for name in kind.arrays:
            if rows[name] > len(getattr(model.rows, name)):
                raise StudyError(
                    f"the scene needs {rows[name]} {kind.noun}, but the model was packed for "
                    f"{len(getattr(model.rows, name))}: pack it with a larger capacity"
                )
    _fill(model, scene, _limits_by_delay(scene, dynamics, CURRENT), dynamics, CURRENT)


def adjust_into(model: Model, scene: Scene, *, dynamics: Dynamics = UNKNOWN, rules: ForceRules = CURRENT) -> None:
    """Write the parameters of a scene like the one in memory of `pack` (`is_built_alike`) into it; keep its state."""
    scene = _adapt_to_device(scene, dynamics)
    _fill_constants(model, scene, _limits_by_delay(scene, dynamics, rules), dynamics, rules)


def is_built_alike(scene: Scene, other: Scene) -> bool:
    """Return whether one scene's state is valid in the other: they differ only in parameters that no state depends on.

    Rows, effects, laws, kinds and the mapping of the hand into the scene must be equal. The state of some effects
    depends on their parameters, which therefore cannot be adjusted.
    """
    mine, others = _constants(resolve(scene)), _constants(resolve(other))
    fixed = sum(effect.bit for effect in EFFECTS if not effect.adjustable)
    if any(record.effects & fixed for record in mine.liquids):
        return False
    return (
        len(mine.liquids) == len(others.liquids)
        and all(np.array_equal(mine.parameters[name], others.parameters[name]) for name in ("scale", "origin_m"))
        and _whole_numbers(mine.parameters) == _whole_numbers(others.parameters)
        and _whole_numbers(mine.liquids) == _whole_numbers(others.liquids)
    )


def _constants(scene: Scene) -> Model:
    """Return a resolved scene's constants, in new memory."""
    nothing = layout.records(layout.STATE, 0)
    model = Model(
        parameters=layout.records(layout.PARAMETERS, 1),
        liquids=layout.records(layout.LIQUID, len(scene.liquids)),
        state=nothing,
        liquid_states=nothing,
        forces_n=nothing,
        rows=nothing,
    )
    _fill_constants(model, scene, _limits_by_delay(scene, UNKNOWN, CURRENT), UNKNOWN, CURRENT)
    return model


def _whole_numbers(rows: Any) -> list[int]:
    """Return all integers in records: rows owned, effects, laws, kinds."""
    if rows.dtype.names is None:
        return [int(it) for it in rows.ravel()] if rows.dtype.kind == "i" else []
    return [number for name in rows.dtype.names for number in _whole_numbers(rows[name])]


def _adapt_to_device(scene: Scene, dynamics: Dynamics) -> Scene:
    """Return the scene with its effects chosen, and with a velocity estimator that the device permits.

    A device that measures its velocity replaces the scene's estimator; "kalman" is for devices that measure their
    delay, others get "ewma".
    """
    if takes_device_velocity(scene.rate_hz, dynamics) and not isinstance(scene.velocity, Given):
        velocity = DeviceVelocity(lag_s=dynamics.velocity_lag_s or 0.0)
        return resolve(scene).model_copy(update={"velocity": velocity})
    if isinstance(scene.velocity, Withdrawn):
        raise StudyError(": ".join(scene.velocity.refusal))
    if isinstance(scene.velocity, Kalman) and dynamics.delay_s is None:
        scene = scene.model_copy(update={"velocity": Ewma()})
    return resolve(scene)


def takes_device_velocity(rate_hz: float, dynamics: Dynamics) -> bool:
    """Return whether the velocity that a device measures replaces the scene's estimator at this rate."""
    return dynamics.velocity_lag_s is not None and dynamics.velocity_lag_s * rate_hz <= MOST_LAG_TICKS


def _limits_by_delay(scene: Scene, dynamics: Dynamics, rules: ForceRules) -> Sequence[DampingLimits]:
    """Return the limits of the scene's rate, estimator and device at each delay, 0 to `MOST_DELAY` ticks."""
    period_s, kg = 1 / scene.rate_hz, dynamics.mass_kg
    return [handle_limits(period_s, delay, scene.velocity, kg, rules) for delay in range(MOST_DELAY + 1)]


def _fill(model: Model, scene: Scene, limits: Sequence[DampingLimits], dynamics: Dynamics, rules: ForceRules) -> None:
    for rows in (model.state, model.liquid_states):
        rows.view(np.uint8)[:] = 0
    _fill_constants(model, scene, limits, dynamics, rules)


def _fill_constants(
    model: Model, scene: Scene, limits: Sequence[DampingLimits], dynamics: Dynamics, rules: ForceRules
) -> None:
    for rows in (model.parameters, model.liquids):
        rows.view(np.uint8)[:] = 0
    parameters = model.parameters[0]
    parameters.scale = scene.scale
    parameters.origin_m[:] = scene.origin_m
    parameters.period_s = 1 / scene.rate_hz
    parameters.liquids = len(scene.liquids)
    parameters.radius_m = scene.body.diameter_m / 2
    parameters.weight_n = scene.body.density_kg_m3 * scene.body.volume_m3 * GRAVITY_MPS2
    parameters.estimator = ESTIMATORS[scene.velocity.kind].code
    ESTIMATORS[scene.velocity.kind].fill(parameters, scene.velocity)
    parameters.compression_law = _COMPRESSIONS[scene.knee.law]
    parameters.compression_threshold_mps = scene.knee.threshold_mps
    parameters.slope_limit_nspm = [limit.drag_nspm / scene.scale for limit in limits]
    parameters.force_limit_n = max(scene.force_limit_n - dynamics.force_error_n, 0.0)
    parameters.fade_s = scene.fade_s
    parameters.slew_n = slew_limit_n(1 / scene.rate_hz, dynamics, scene.velocity)
    parameters.count_m = dynamics.count_m
    parameters.mass_kg = dynamics.mass_kg
    parameters.smoothing_lead = rules.smoothing_lead if isinstance(scene.velocity, Kalman) else 0.0
    parameters.link.acts = scene.link.acts
    parameters.link.delay_ticks, parameters.link.jitter_ticks = scene.link.ticks(scene.rate_hz)
    parameters.link.loss, parameters.link.seed = scene.link.loss, scene.link.seed
    parameters.rules = tuple(rules)
    first = _no_rows()
    for record, liquid in zip(model.liquids, scene.liquids, strict=False):
        fill(record, liquid, scene, first)
        record.known_force = _known_force(record, limits, scene, dynamics, rules)
        fits = [_inertia_fit(record, limit, scene, rules) for limit in limits]
        record.smoothing_rate, record.inertia_share = zip(*fits, strict=True)
        first = _rows_after(first, liquid, scene.rate_hz)
        parameters.effects |= record.effects
    parameters.known_force_ticks = rules.known_force_ticks if model.liquids.known_force.any() else _NEVER_TICKS


def _known_force(
    record: layout.Record, limits: Sequence[DampingLimits], scene: Scene, dynamics: Dynamics, rules: ForceRules
) -> list[float]:
    """Return ``layout.LIQUID.known_force`` of a liquid.

    The inertia in the force moves with the handle, so the stable damping grows with their sum, at most to that of one
    tick of delay. [choice] The effect "history" has no implicit form, and in a current or a wake dw/dt is not that of
    the handle. In toothpaste, whose force follows the position, handles of 50 and 100 g oscillated, and in tar, whose
    history exceeds its added mass, and on lighter handles the force was noisy. These are left out, and so are forces
    that a study delays.
    """
    mass_kg = record.added_mass.mass_kg + record.unsteady_drag.mass_kg
    history_kg = 2.0 * record.unsteady_drag.factor_kg_rs / math.sqrt(scene.rate_hz)
    ratio = scene.scale * (mass_kg + history_kg) / dynamics.mass_kg
    elastic = record.effects & non_newtonian.BIT and record.non_newtonian.kind in _ELASTIC
    is_permitted = (
        isinstance(scene.velocity, Kalman)
        and not scene.link.acts
        and abs(scene.rate_hz - 1000.0) < 1.0
        and scene.scale <= rules.most_known_scale
        and history_kg <= mass_kg
        and 0.0 < ratio <= rules.most_known_inertia
        and dynamics.mass_kg >= MEASURED_KG
        and not elastic
        and not record.effects & _EXPLICIT
    )
    most_nspm = limits[1].drag_nspm
    return [
        max(min(1.0 + ratio, most_nspm / limit.drag_nspm), 1.0)
        if is_permitted and ticks >= rules.known_force_ticks
        else 0.0
        for ticks, limit in enumerate(limits)
    ]


def _inertia_fit(record: layout.Record, limits: DampingLimits, scene: Scene, rules: ForceRules) -> tuple[float, float]:
    """Return the factor of smoothing rates, and the fraction that keeps inertial forces within their limit.

    The limit applies to their damping of fast motion; see `ForceRules`. [choice]
    """

    def damping_nspm(rate: float) -> float:
        parts = (
            effect.damping_nspm(record[effect.name], rate)
            for effect in EFFECTS
            if effect.damping_nspm is not None and record.effects & effect.bit
        )
        return sum(parts, 0.0) * scene.scale

    whole_nspm = damping_nspm(1.0)
    if whole_nspm <= limits.inertia_nspm:
        return 1.0, 1.0
    rate, high = 1.0, 1.0
    if isinstance(scene.velocity, Kalman):
        smoothed_nspm = whole_nspm * (limits.inertia_nspm / whole_nspm) ** rules.smoothed_excess
        rate = 1.0 / rules.longest_smoothing
        while high - rate > _RESOLUTION and damping_nspm(rate) < smoothed_nspm:
            middle = 0.5 * (rate + high)
            rate, high = (middle, high) if damping_nspm(middle) < smoothed_nspm else (rate, middle)
    least_nspm = min(limits.inertia_nspm, rules.cut_inertia_share * limits.drag_nspm)
    kept_nspm = limits.inertia_nspm * min(rules.kept_excess * limits.inertia_nspm / whole_nspm, 1.0) ** 3
    return rate, max(least_nspm, kept_nspm) / damping_nspm(rate)

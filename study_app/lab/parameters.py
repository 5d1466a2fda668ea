"""The parameters of a scene with one liquid, for sliders and fields: labels, units, ranges, choices.

Ranges are those of the scene's models; if a model has no bound, or one far outside perceptible values, the lab has its
own [choice]. A preset's value outside the range extends it. Names are ``table.field``, as in
``haptics.model.overrides``; ``.x``, ``.y`` or ``.z`` after a name selects a component, and ``effects.NAME`` one effect.

`with_parameter` returns a scene with one parameter set by its name. Unlike ``haptics.model.overrides``, it supports
vector components, single effects, and initial values of a table that the liquid does not have yet.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Final

from pydantic import BaseModel

from study_app.errors import StudyError
from study_app.haptics.model.effects import EFFECTS, LEAST, MOST, NAMED, Parameter, Value
from study_app.haptics.model.estimators import ESTIMATORS
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.scene import Given, Liquid, Scene
from study_app.protocol.quantities import QUANTITIES

_AXES: Final = ("x", "y", "z")
OFF, ON, AUTO = "off", "on", "auto"


@dataclass(frozen=True, slots=True)
class Section:
    """A group of related parameters."""

    title: str
    parameters: tuple[Parameter, ...]


_P = Parameter
_CHOICES: Final = {
    parameter.name: parameter
    for parameter in (
        _P("region.kind", "Region", choices=(("everywhere", "Everywhere"), ("box", "Box"), ("cylinder", "Cylinder"))),
        _P(
            "velocity.kind",
            "Estimator",
            choices=tuple((kind.name, kind.label) for kind in ESTIMATORS if kind.of_device),
        ),
        _P(
            "knee.law",
            "Knee law",
            choices=(("sqrt", "Square root"), ("square", "Square (as worded in the thesis)"), ("none", "None")),
        ),
    )
}
_ROWS: Final = QUANTITIES | _CHOICES


def sections(scene: Scene) -> tuple[Section, ...]:
    """Return the parameters of a scene with one liquid; an effect's parameters are included only if it is selected.

    Raises
    ------
    StudyError
        The scene does not have exactly one liquid, or takes its velocities from a table.
    """
    liquid = the_liquid(scene)
    effects = resolve(scene).liquids[0].effects
    with_liquid = (name for effect in EFFECTS if effect.with_liquid for name in _parameter_names(scene, effect.name))
    with_section = (
        effect for effect in EFFECTS if effect.name in effects and effect.model is not None and not effect.with_liquid
    )
    rows = [
        ("Liquid", ("liquid.density_kg_m3", "liquid.viscosity_pa_s", *with_liquid)),
        *(
            (effect.label, _parameter_names(scene, effect.name))
            for effect in with_section
            if getattr(liquid, effect.name) is not None
        ),
        ("Body", _parameter_names(scene, "body")),
        ("Filter", (*_parameter_names(scene, "velocity"), *_parameter_names(scene, "knee"))),
        ("Effects", ("effects", *(f"effects.{effect.name}" for effect in EFFECTS))),
        ("Accuracy", _accuracy_names(liquid)),
        ("Region", _parameter_names(scene, "region")),
        ("Hand", ("scene.scale", "scene.force_limit_n")),
    ]
    return tuple(
        Section(title, tuple(_displayed_parameter(scene, name) for name in names)) for title, names in rows if names
    )


def parameter(scene: Scene, name: str) -> Parameter:
    """Return one parameter of a scene by its name.

    Raises
    ------
    StudyError
        The scene has no parameter with this name.
    """
    for section in sections(scene):
        for candidate in section.parameters:
            if candidate.name == name:
                return candidate
    raise StudyError(
        f"this liquid currently does not have the parameter {name!r}: select the effect to which it belongs"
    )


def value_of(scene: Scene, name: str) -> Value:
    """Return the value of a parameter in a scene: a number in SI units, or a choice; None if it is not set.

    If other parameters determine a value that is not set, that value is returned, such as a reach of one diameter.
    """
    liquid = the_liquid(scene)
    table, _, field = name.partition(".")
    if table == "effects":
        if not field:
            return AUTO if liquid.effects == "auto" else ON
        return ON if field in resolve(scene).liquids[0].effects else OFF
    value = _read_value(resolve(scene) if table in NAMED and NAMED[table].choose is not None else scene, name)
    if value is None and table in NAMED and field in NAMED[table].open_values:
        return NAMED[table].open_values[field](scene)
    if value is None and table == "motion":
        return float(getattr(scene.motion_in(liquid), field))
    return value if value is None or isinstance(value, str) else float(value)


def _read_value(scene: Scene, name: str) -> Any:
    """Return the value of ``table.field`` or of its component in a scene; None if it is not set."""
    liquid = the_liquid(scene)
    table, field, *axis = name.split(".")
    values = (
        {"liquid": liquid, "scene": scene}.get(table) or getattr(liquid, table, None) or getattr(scene, table, None)
    )
    value = getattr(values, field, None)
    return value[_AXES.index(axis[0])] if axis and value is not None else value


def the_liquid(scene: Scene) -> Liquid:
    """Return the only liquid of a scene.

    Raises
    ------
    StudyError
        The scene does not have exactly one liquid, or takes its velocities from a table.
    """
    if len(scene.liquids) != 1:
        raise StudyError(f"the lab opens one liquid at a time, not {len(scene.liquids)}: choose one")
    if isinstance(scene.velocity, Given):
        raise StudyError('velocity "given" requires a motion from a file: choose an estimator such as "ewma"')
    return scene.liquids[0]


def _parameter_names(scene: Scene, table: str) -> tuple[str, ...]:
    """Return the names of a table's parameters, or of their components, in the order of the model."""
    values = getattr(the_liquid(scene), table, None) or getattr(scene, table)
    names: list[str] = []
    for field in type(values).model_fields:
        name = f"{table}.{field}"
        if isinstance(getattr(values, field), tuple):
            names += [f"{name}.{axis}" for axis in _AXES]
        elif name in _ROWS:
            is_derived = table in NAMED and field in NAMED[table].open_values
            if getattr(values, field) is not None or is_derived or _ROWS[name].default is not None:
                names.append(name)
    return tuple(names)


def _accuracy_names(liquid: Liquid) -> tuple[str, ...]:
    """Return the names of the parameters that select the effects; none if the liquid names its effects."""
    if liquid.effects != "auto":
        return ()
    return "accuracy.relative", "accuracy.absolute_n", "motion.speed_mps", "motion.acceleration_mps2"


def _displayed_parameter(scene: Scene, name: str) -> Parameter:
    """Return a parameter with its range, default value and displayed unit."""
    if name == "effects":
        return Parameter(name, "Selection", default=ON, choices=((ON, "Manual"), (AUTO, "Automatic")))
    if name.startswith("effects."):
        label = NAMED[name.partition(".")[2]].label
        return Parameter(name, label, default=OFF, choices=((OFF, "Off"), (ON, "On")))
    table, field, *axis = name.split(".")
    row = _ROWS[f"{table}.{field}"]
    default = _default_value(scene, table, field, row)
    if row.choices:
        return dataclasses.replace(row, default=default)
    if axis:
        default = default[_AXES.index(axis[0])] if isinstance(default, tuple) else None
        row = dataclasses.replace(row, name=name, label=f"{row.label} {axis[0]}")
    value = value_of(scene, name)
    default = value if default is None else default
    minimum, maximum = _lab_range(scene, table, field, row)
    known = [float(number) for number in (value, default) if isinstance(number, int | float)]
    return dataclasses.replace(
        row,
        least=min([minimum, *known]),
        most=max([maximum, *known]),
        default=default if default is None else float(default),
        shown_unit=row.shown_unit or row.unit,
    )


def _model_of(scene: Scene, table: str) -> type[BaseModel]:
    if table == "scene":
        return Scene
    liquid = the_liquid(scene)
    return Liquid if table == "liquid" else type(getattr(liquid, table, None) or getattr(scene, table))


def _default_value(scene: Scene, table: str, field: str, row: Parameter) -> Any:
    model = _model_of(scene, table)
    if table in NAMED and field in NAMED[table].open_values:
        return NAMED[table].open_values[field](scene)
    field_info = model.model_fields[field]
    return row.default if field_info.is_required() or field_info.default is None else field_info.default


def _lab_range(scene: Scene, table: str, field: str, row: Parameter) -> tuple[float, float]:
    """Return the lab's range, which is the model's where the lab does not define one."""
    minimum, maximum = row.least, row.most
    for bound in _model_of(scene, table).model_fields[field].metadata:
        if row.least == LEAST and getattr(bound, "ge", None) is not None:
            minimum = float(bound.ge)
        if row.most == MOST and getattr(bound, "le", None) is not None:
            maximum = float(bound.le)
    return minimum, maximum


_HALF_REACH_M: Final = 0.05
_KIND_FIELDS: Final = ("kind", "law")
"""Fields that determine which other fields a table has."""


def with_parameter(scene: Scene, name: str, value: Value) -> Scene:
    """Return the scene with one parameter set.

    Raises
    ------
    StudyError
        The scene has no such parameter, or the value is not permitted.
    """
    value = _check_value(parameter(scene, name), value)
    if name == "effects":
        return override_all(scene, {"effects": AUTO} if value == AUTO else _gate_selection(scene))
    if name.startswith("effects."):
        return _switch_effect(scene, name.partition(".")[2], on=value == ON)
    table, field, *axis = name.split(".")
    if axis:
        components = list(_read_value(scene, f"{table}.{field}"))
        components[_AXES.index(axis[0])] = value
        return override_all(scene, {f"{table}.{field}": tuple(components)})
    is_chosen = table in NAMED and NAMED[table].choose is not None
    selection = _gate_selection(scene) if is_chosen else {}  # fixed, since the gate would choose another law
    if field in _KIND_FIELDS and (table == "region" or table in NAMED):
        if value == _read_value(scene, name):
            return scene
        return override_all(scene, selection | {f"liquid.{table}": _initial_table(scene, table, str(value))})
    if _read_value(scene, name) is None and value == value_of(scene, name):  # not set, and not changed
        return scene
    selected = resolve(scene).liquids[0].effects
    replaced = (
        effect.name
        for effect in EFFECTS
        if table == "liquid" and field in effect.replaces and effect.name not in selected
    )
    return override_all(scene, selection | {f"liquid.{effect}": None for effect in replaced} | {name: value})


def _check_value(parameter: Parameter, value: Value) -> Value:
    if parameter.choices:
        if value not in {choice for choice, _ in parameter.choices}:
            choices = ", ".join(repr(choice) for choice, _ in parameter.choices)
            raise StudyError(f"{parameter.label} must be one of {choices}, not {value!r}")
        return value
    if isinstance(value, str) or value is None or not math.isfinite(value):
        raise StudyError(f"{parameter.label} must be a number, not {value!r}")
    slack = 1e-9 * (abs(parameter.least) + abs(parameter.most))  # rounding by a conversion of units
    if not parameter.least - slack <= value <= parameter.most + slack:
        raise StudyError(
            f"{parameter.label} must be from {parameter.shown(parameter.least)} to {parameter.shown(parameter.most)}, "
            f"not {parameter.shown(value)}"
        )
    value = min(max(float(value), parameter.least), parameter.most)
    return round(value) if parameter.whole else value


def _switch_effect(scene: Scene, effect: str, *, on: bool) -> Scene:
    """Return the scene with an effect switched on or off, with effects that it requires, without those it excludes."""
    liquid = the_liquid(scene)
    selected = set(resolve(scene).liquids[0].effects)
    if on:
        carriers = NAMED[effect].through
        selected |= {effect} if set(carriers) & selected else {effect, *carriers[:1]}
        for name in (*carriers, effect):
            if name in selected:
                selected -= {
                    other.name for other in EFFECTS if name in other.excludes or other.name in NAMED[name].excludes
                }
    selected -= set() if on else {effect}
    selected -= {other.name for other in EFFECTS if other.through and not set(other.through) & selected}
    values = _gate_selection(scene) | {"effects": tuple(name for name in NAMED if name in selected)}
    if on and NAMED[effect].model is not None and getattr(liquid, effect) is None:
        values[f"liquid.{effect}"] = _initial_table(scene, effect, "")
    if on:
        values |= {f"liquid.{name}": None for name in NAMED[effect].replaces}
    try:
        return override_all(scene, values)
    except StudyError as error:
        label, reason = NAMED[effect].label, str(error).partition(": ")[2]
        raise StudyError(f"{label} cannot be turned {'on' if on else 'off'}: {reason}") from error


def _gate_selection(scene: Scene) -> dict[str, object]:
    """Return the effects and tables that the gate selects, by name."""
    liquid = resolve(scene).liquids[0]
    chosen = (effect.name for effect in EFFECTS if effect.choose is not None)
    return {"effects": liquid.effects, **{f"liquid.{name}": getattr(liquid, name).model_dump() for name in chosen}}


def _initial_table(scene: Scene, table: str, kind: str) -> dict[str, Any]:
    """Return the initial table of a region or an effect, with the centre and size of the hand's reach."""
    centre_m, reach_m = scene.origin_m, scene.scale * _HALF_REACH_M
    if table in NAMED:
        start = NAMED[table].start
        return {} if start is None else dict(start(kind, centre_m, reach_m))
    fields: dict[str, dict[str, Any]] = {
        "everywhere": {},
        "box": {"centre_m": centre_m, "size_m": (2 * reach_m,) * 3},
        "cylinder": {"centre_m": centre_m, "radius_m": reach_m, "height_m": 2 * reach_m},
    }
    return {"kind": kind, **fields[kind]}

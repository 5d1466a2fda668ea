"""The parameters of a scene with one liquid, for sliders and fields: labels, units, ranges, choices.

Ranges are those of the scene's models; if those have no bound, or one far outside perceptible values, the rows below
define the lab's range [choice]. A preset's value beyond it extends it. Names are ``table.field``, as
``haptics.model.overrides`` takes them; ``.x``, ``.y``, ``.z`` after a name mean a component, ``effects.NAME`` one
effect.

`with_parameter` sets one parameter of a scene by its name, and returns a new scene, or raises an error of one line.

Unlike ``haptics.model.overrides`` it supports vector components, single effects, and the default values of a table that
the liquid does not have yet.
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
    it.name: it
    for it in (
        _P("region.kind", "Region", choices=(("everywhere", "Everywhere"), ("box", "Box"), ("cylinder", "Cylinder"))),
        _P("velocity.kind", "Estimator", choices=tuple((it.name, it.label) for it in ESTIMATORS if it.of_device)),
        _P(
            "knee.law",
            "Knee law",
            choices=(("sqrt", "Square root"), ("square", "Square (as worded in the thesis)"), ("none", "None")),
        ),
    )
}
_ROWS: Final = QUANTITIES | _CHOICES


def sections(scene: Scene) -> tuple[Section, ...]:
    """Return the parameters of a scene with one liquid, those of an effect only if it is selected.

    Raises
    ------
    StudyError
        The scene has no liquid, several, or takes its velocities from a table.
    """
    liquid = the_liquid(scene)
    effects = resolve(scene).liquids[0].effects
    with_liquid = (name for effect in EFFECTS if effect.with_liquid for name in _names(scene, effect.name))
    apart = (it for it in EFFECTS if it.name in effects and it.model is not None and not it.with_liquid)
    rows = [
        ("Liquid", ("liquid.density_kg_m3", "liquid.viscosity_pa_s", *with_liquid)),
        *((it.label, _names(scene, it.name)) for it in apart if getattr(liquid, it.name) is not None),
        ("Body", _names(scene, "body")),
        ("Filter", (*_names(scene, "velocity"), *_names(scene, "knee"))),
        ("Effects", ("effects", *(f"effects.{effect.name}" for effect in EFFECTS))),
        ("Accuracy", _accuracy(liquid)),
        ("Region", _names(scene, "region")),
        ("Hand", ("scene.scale", "scene.force_limit_n")),
    ]
    return tuple(Section(title, tuple(_parameter(scene, it) for it in names)) for title, names in rows if names)


def parameter(scene: Scene, name: str) -> Parameter:
    """Return one parameter of a scene by its name.

    Raises
    ------
    StudyError
        The scene has no parameter with this name.
    """
    for section in sections(scene):
        for it in section.parameters:
            if it.name == name:
                return it
    raise StudyError(
        f"this liquid currently does not have the parameter {name!r}: select the effect to which it belongs"
    )


def value_of(scene: Scene, name: str) -> Value:
    """Return the value of a parameter in a scene, SI or one of its choices; None if unset, such as a viscosity.

    An unset value that other parameters determine is returned: a reach is one diameter of the body.
    """
    liquid = the_liquid(scene)
    place, _, field = name.partition(".")
    if place == "effects":
        if not field:
            return AUTO if liquid.effects == "auto" else ON
        return ON if field in resolve(scene).liquids[0].effects else OFF
    value = _read_value(resolve(scene) if place in NAMED and NAMED[place].choose is not None else scene, name)
    if value is None and place in NAMED and field in NAMED[place].open_values:
        return NAMED[place].open_values[field](scene)
    if value is None and place == "motion":
        return float(getattr(scene.motion_in(liquid), field))
    return value if value is None or isinstance(value, str) else float(value)


def _read_value(scene: Scene, name: str) -> Any:
    """Return the value of ``table.field`` or of its component in a scene; None if unset."""
    liquid = the_liquid(scene)
    place, field, *axis = name.split(".")
    table = {"liquid": liquid, "scene": scene}.get(place) or getattr(liquid, place, None) or getattr(scene, place, None)
    value = getattr(table, field, None)
    return value[_AXES.index(axis[0])] if axis and value is not None else value


def the_liquid(scene: Scene) -> Liquid:
    """Return the only liquid of a scene.

    Raises
    ------
    StudyError
        The scene has no liquid, several, or takes its velocities from a table.
    """
    if len(scene.liquids) != 1:
        raise StudyError(f"the lab opens one liquid at a time, not {len(scene.liquids)}: choose one")
    if isinstance(scene.velocity, Given):
        raise StudyError('velocity "given" requires a motion from a file: choose an estimator such as "ewma"')
    return scene.liquids[0]


def _names(scene: Scene, place: str) -> tuple[str, ...]:
    """Return the names of a table's parameters, components one by one, in the order of its model."""
    table = getattr(the_liquid(scene), place, None) or getattr(scene, place)
    names: list[str] = []
    for field in type(table).model_fields:
        name = f"{place}.{field}"
        if isinstance(getattr(table, field), tuple):
            names += [f"{name}.{axis}" for axis in _AXES]
        elif name in _ROWS:
            follows = place in NAMED and field in NAMED[place].open_values
            if getattr(table, field) is not None or follows or _ROWS[name].default is not None:
                names.append(name)
    return tuple(names)


def _accuracy(liquid: Liquid) -> tuple[str, ...]:
    """Return the parameters that determine the omitted effects: none if effects are named."""
    if liquid.effects != "auto":
        return ()
    return "accuracy.relative", "accuracy.absolute_n", "motion.speed_mps", "motion.acceleration_mps2"


def _parameter(scene: Scene, name: str) -> Parameter:
    """Return a parameter with its range, default and unit for display."""
    if name == "effects":
        return Parameter(name, "Selection", default=ON, choices=((ON, "Manual"), (AUTO, "Automatic")))
    if name.startswith("effects."):
        label = NAMED[name.partition(".")[2]].label
        return Parameter(name, label, default=OFF, choices=((OFF, "Off"), (ON, "On")))
    place, field, *axis = name.split(".")
    row = _ROWS[f"{place}.{field}"]
    default = _default(scene, place, field, row)
    if row.choices:
        return dataclasses.replace(row, default=default)
    if axis:
        default = default[_AXES.index(axis[0])] if isinstance(default, tuple) else None
        row = dataclasses.replace(row, name=name, label=f"{row.label} {axis[0]}")
    value = value_of(scene, name)
    default = value if default is None else default
    least, most = _range(scene, place, field, row)
    known = [float(it) for it in (value, default) if isinstance(it, int | float)]
    return dataclasses.replace(
        row,
        least=min([least, *known]),
        most=max([most, *known]),
        default=default if default is None else float(default),
        shown_unit=row.shown_unit or row.unit,
    )


def _model(scene: Scene, place: str) -> type[BaseModel]:
    if place == "scene":
        return Scene
    liquid = the_liquid(scene)
    return Liquid if place == "liquid" else type(getattr(liquid, place, None) or getattr(scene, place))


def _default(scene: Scene, place: str, field: str, row: Parameter) -> Any:
    model = _model(scene, place)
    if place in NAMED and field in NAMED[place].open_values:
        return NAMED[place].open_values[field](scene)
    info = model.model_fields[field]
    return row.default if info.is_required() or info.default is None else info.default


def _range(scene: Scene, place: str, field: str, row: Parameter) -> tuple[float, float]:
    """Return the lab's range, limited by the model's."""
    least, most = row.least, row.most
    for bound in _model(scene, place).model_fields[field].metadata:
        if row.least == LEAST and getattr(bound, "ge", None) is not None:
            least = float(bound.ge)
        if row.most == MOST and getattr(bound, "le", None) is not None:
            most = float(bound.le)
    return least, most


_HALF_HAND_M: Final = 0.05
_KINDS: Final = ("kind", "law")
"""Fields that determine which other fields a table has."""


def with_parameter(scene: Scene, name: str, value: Value) -> Scene:
    """Return the scene with one parameter (``lab.parameters``) set.

    Raises
    ------
    StudyError
        The scene has no such parameter, or the value is not permitted.
    """
    it = parameter(scene, name)
    value = _check_value(it, value)
    if name == "effects":
        return override_all(scene, {"effects": AUTO} if value == AUTO else _chosen_by_gate(scene))
    if name.startswith("effects."):
        return _with_effect(scene, name.partition(".")[2], on=value == ON)
    place, field, *axis = name.split(".")
    if axis:
        whole = list(_read_value(scene, f"{place}.{field}"))
        whole[_AXES.index(axis[0])] = value
        return override_all(scene, {f"{place}.{field}": tuple(whole)})
    chosen = place in NAMED and NAMED[place].choose is not None
    by_hand = _chosen_by_gate(scene) if chosen else {}  # the gate would choose another law
    if field in _KINDS and (place == "region" or place in NAMED):
        if value == _read_value(scene, name):
            return scene
        return override_all(scene, by_hand | {f"liquid.{place}": _initial_table(scene, place, str(value))})
    if _read_value(scene, name) is None and value == value_of(scene, name):  # an unset value, unchanged
        return scene
    taken = resolve(scene).liquids[0].effects
    replaced = (it.name for it in EFFECTS if place == "liquid" and field in it.replaces and it.name not in taken)
    return override_all(scene, by_hand | {f"liquid.{effect}": None for effect in replaced} | {name: value})


def _check_value(it: Parameter, value: Value) -> Value:
    if it.choices:
        if value not in {choice for choice, _ in it.choices}:
            choices = ", ".join(repr(choice) for choice, _ in it.choices)
            raise StudyError(f"{it.label} must be one of {choices}, not {value!r}")
        return value
    if isinstance(value, str) or value is None or not math.isfinite(value):
        raise StudyError(f"{it.label} must be a number, not {value!r}")
    slack = 1e-9 * (abs(it.least) + abs(it.most))  # rounding of a number in other units
    if not it.least - slack <= value <= it.most + slack:
        raise StudyError(f"{it.label} must be from {it.shown(it.least)} to {it.shown(it.most)}, not {it.shown(value)}")
    value = min(max(float(value), it.least), it.most)
    return round(value) if it.whole else value


def _with_effect(scene: Scene, effect: str, *, on: bool) -> Scene:
    """Return the scene with an effect switched on or off, and the effects that it requires."""
    liquid = the_liquid(scene)
    wanted = set(resolve(scene).liquids[0].effects)
    if on:
        carriers = NAMED[effect].through
        wanted |= {effect} if set(carriers) & wanted else {effect, *carriers[:1]}
        for name in (*carriers, effect):
            if name in wanted:
                wanted -= {it.name for it in EFFECTS if name in it.excludes or it.name in NAMED[name].excludes}
    wanted -= set() if on else {effect}
    wanted -= {it.name for it in EFFECTS if it.through and not set(it.through) & wanted}
    values = _chosen_by_gate(scene) | {"effects": tuple(it for it in NAMED if it in wanted)}
    if on and NAMED[effect].model is not None and getattr(liquid, effect) is None:
        values[f"liquid.{effect}"] = _initial_table(scene, effect, "")
    if on:
        values |= {f"liquid.{name}": None for name in NAMED[effect].replaces}
    try:
        return override_all(scene, values)
    except StudyError as error:
        label, reason = NAMED[effect].label, str(error).partition(": ")[2]
        raise StudyError(f"{label} cannot be turned {'on' if on else 'off'}: {reason}") from error


def _chosen_by_gate(scene: Scene) -> dict[str, object]:
    """Return effects and tables as the gate chooses them, by name."""
    taken = resolve(scene).liquids[0]
    tables = {f"liquid.{it.name}": getattr(taken, it.name).model_dump() for it in EFFECTS if it.choose is not None}
    return {"effects": taken.effects, **tables}


def _initial_table(scene: Scene, place: str, kind: str) -> dict[str, Any]:
    """Return the initial table of a region or an effect, centred on the hand's reach and as large as it."""
    centre_m, reach_m = scene.origin_m, scene.scale * _HALF_HAND_M
    if place in NAMED:
        start = NAMED[place].start
        return {} if start is None else dict(start(kind, centre_m, reach_m))
    begun: dict[str, dict[str, Any]] = {
        "everywhere": {},
        "box": {"centre_m": centre_m, "size_m": (2 * reach_m,) * 3},
        "cylinder": {"centre_m": centre_m, "radius_m": reach_m, "height_m": 2 * reach_m},
    }
    return {"kind": kind, **begun[kind]}

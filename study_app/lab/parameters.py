"""The parameters of a scene with one liquid, for sliders and fields: labels, units, ranges, choices.

Ranges are those of the scene's models; if those have no bound, or one far outside perceptible values, the rows below
define the lab's range [choice]. A preset's value beyond it extends it. Names are ``table.field``, as
``haptics.model.overrides`` takes them; ``.x``, ``.y``, ``.z`` after a name mean a component, ``effects.NAME`` one
effect.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any, Final

from pydantic import BaseModel

from study_app.errors import StudyError
from study_app.haptics.model.effect import LEAST, MOST, Effect, Parameter, Value
from study_app.haptics.model.effects import EFFECTS, NAMED
from study_app.haptics.model.estimators import ESTIMATORS
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.liquid import Liquid
from study_app.haptics.model.scene import Given, Scene
from study_app.protocol.quantities import QUANTITIES

AXES: Final = ("x", "y", "z")
OFF, ON, AUTO = "off", "on", "auto"


@dataclass(frozen=True, slots=True)
class Section:
    """Parameters that belong together."""

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
            choices=(("sqrt", "Square root"), ("square", "Square (thesis' words)"), ("none", "None")),
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
    found = [
        ("Liquid", ("liquid.density_kg_m3", "liquid.viscosity_pa_s", *_names_with_liquid(scene))),
        *((it.label, _names(scene, it.name)) for it in EFFECTS if it.name in effects and _has_section(liquid, it)),
        ("Body", _names(scene, "body")),
        ("Filter", (*_names(scene, "velocity"), *_names(scene, "knee"))),
        ("Effects", ("effects", *(f"effects.{effect.name}" for effect in EFFECTS))),
        ("Accuracy", _accuracy(liquid)),
        ("Region", _names(scene, "region")),
        ("Hand", ("scene.scale", "scene.force_limit_n")),
    ]
    return tuple(Section(title, tuple(_parameter(scene, it) for it in names)) for title, names in found if names)


def parameter(scene: Scene, name: str) -> Parameter:
    """Return one parameter of a scene by its name.

    Raises
    ------
    StudyError
        The scene has none of this name.
    """
    for section in sections(scene):
        for it in section.parameters:
            if it.name == name:
                return it
    raise StudyError(f"this liquid has no parameter {name!r} now: select the effect to which it belongs")


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
    found = read(resolve(scene) if _is_chosen(place) else scene, name)
    if found is None and place in NAMED and field in NAMED[place].open_values:
        return NAMED[place].open_values[field](scene)
    if found is None and place == "motion":
        return float(getattr(scene.motion_in(liquid), field))
    return found if found is None or isinstance(found, str) else float(found)


def read(scene: Scene, name: str) -> Any:
    """Return the value of ``table.field`` or of its component in a scene; None if unset."""
    liquid = the_liquid(scene)
    place, field, *axis = name.split(".")
    table = {"liquid": liquid, "scene": scene}.get(place) or getattr(liquid, place, None) or getattr(scene, place, None)
    found = getattr(table, field, None)
    return found[AXES.index(axis[0])] if axis and found is not None else found


def the_liquid(scene: Scene) -> Liquid:
    """Return the liquid of a scene with exactly one.

    Raises
    ------
    StudyError
        It has none, or several, or its velocities come from a table.
    """
    if len(scene.liquids) != 1:
        raise StudyError(f"the lab opens one liquid at a time, not {len(scene.liquids)}: choose one of them")
    if isinstance(scene.velocity, Given):
        raise StudyError('velocity "given" is for motions from a file: choose an estimator such as "ewma"')
    return scene.liquids[0]


def _has_section(liquid: Liquid, effect: Effect) -> bool:
    """Return whether an effect's table is in the liquid, and shown separately."""
    return effect.model is not None and not effect.with_liquid and getattr(liquid, effect.name) is not None


def _names_with_liquid(scene: Scene) -> tuple[str, ...]:
    """Return the names of the effects' parameters that are shown with the liquid's own."""
    return tuple(name for effect in EFFECTS if effect.with_liquid for name in _names(scene, effect.name))


def _is_chosen(place: str) -> bool:
    """Return whether the gate chooses this table."""
    return place in NAMED and NAMED[place].choose is not None


def _names(scene: Scene, place: str) -> tuple[str, ...]:
    """Return the names of a table's parameters, components one by one, in the order of its model."""
    table = getattr(the_liquid(scene), place, None) or getattr(scene, place)
    names: list[str] = []
    for field in type(table).model_fields:
        name = f"{place}.{field}"
        if isinstance(getattr(table, field), tuple):
            names += [f"{name}.{axis}" for axis in AXES]
        elif name in _ROWS and _has_value(table, place, field):
            names.append(name)
    return tuple(names)


def _has_value(table: BaseModel, place: str, field: str) -> bool:
    """Return whether a field has a value, one computed from the scene, or a default in its row."""
    follows = place in NAMED and field in NAMED[place].open_values
    return getattr(table, field) is not None or follows or _ROWS[f"{place}.{field}"].default is not None


def _accuracy(liquid: Liquid) -> tuple[str, ...]:
    """Return the parameters that determine the omitted effects: none if effects are named."""
    if liquid.effects != "auto":
        return ()
    return "accuracy.relative", "accuracy.absolute_n", "motion.speed_mps", "motion.acceleration_mps2"


def _parameter(scene: Scene, name: str) -> Parameter:
    """Return a parameter with its range, default and unit as shown."""
    if name == "effects":
        return Parameter(name, "Chosen", default=ON, choices=((ON, "Chosen by hand"), (AUTO, "Automatic")))
    if name.startswith("effects."):
        label = NAMED[name.partition(".")[2]].label
        return Parameter(name, label, default=OFF, choices=((OFF, "Off"), (ON, "On")))
    place, field, *axis = name.split(".")
    row = _ROWS[f"{place}.{field}"]
    default = _default(scene, place, field, row)
    if row.choices:
        return dataclasses.replace(row, default=default)
    if axis:
        default = default[AXES.index(axis[0])] if isinstance(default, tuple) else None
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
    """Return the model that has a table's fields."""
    if place == "scene":
        return Scene
    liquid = the_liquid(scene)
    return Liquid if place == "liquid" else type(getattr(liquid, place, None) or getattr(scene, place))


def _default(scene: Scene, place: str, field: str, row: Parameter) -> Any:
    """Return a field's default in its model; None without one."""
    model = _model(scene, place)
    if place in NAMED and field in NAMED[place].open_values:
        return NAMED[place].open_values[field](scene)
    info = model.model_fields[field]
    return row.default if info.is_required() or info.default is None else info.default


def _range(scene: Scene, place: str, field: str, row: Parameter) -> tuple[float, float]:
    """Return the lab's range within the model's."""
    least, most = row.least, row.most
    for bound in _model(scene, place).model_fields[field].metadata:
        if row.least == LEAST and getattr(bound, "ge", None) is not None:
            least = float(bound.ge)
        if row.most == MOST and getattr(bound, "le", None) is not None:
            most = float(bound.le)
    return least, most

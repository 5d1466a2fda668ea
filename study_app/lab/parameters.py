"""Which parameters a scene of one liquid has, as sliders and fields need them: words, units, ranges, choices.

Ranges are those of the scene's own models; where those have no bound, or one far from anything that is felt, the rows
below state the range that the lab offers [choice]. A value of a preset beyond it widens it. Names are ``table.field``,
as ``haptics.model.overrides`` takes them; ``.x``, ``.y``, ``.z`` after a name mean a component, ``effects.NAME`` one
effect.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from pydantic import BaseModel

from study_app.errors import StudyError
from study_app.haptics.model.gate import ORDER, resolve
from study_app.haptics.model.liquid import AddedMass, History, Liquid
from study_app.haptics.model.scene import Given, Scene
from study_app.protocol.model import MAX_FORCE_N

Value: TypeAlias = "float | str | None"
Choices: TypeAlias = tuple[tuple[str, str], ...]

AXES: Final = ("x", "y", "z")
OFF, ON, AUTO = "off", "on", "auto"

_LEAST, _MOST = 0.0, 1.0  # of a parameter that says nothing else: then its model's own range counts


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter: what it is called, and what it may be, SI; as shown it is ``factor`` times as much.

    ``default`` is what its model gives it, or what the scene has where that gives nothing. A parameter with ``choices``
    (value, words) is one of those, and ``least``, ``most`` mean nothing. ``decimals`` of the shown number are worth
    telling.
    """

    name: str
    label: str
    unit: str = ""
    least: float = _LEAST
    most: float = _MOST
    default: Value = None
    logarithmic: bool = False
    whole: bool = False
    choices: Choices = ()
    shown_unit: str = ""
    factor: float = 1.0
    decimals: int = 2

    def shown(self, value: float) -> str:
        """Return a number with its unit, as people read it."""
        number = f"{value * self.factor:.{self.decimals}f}"
        number = number.rstrip("0").rstrip(".") if "." in number else number
        return f"{number} {self.shown_unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Section:
    """Parameters that belong together."""

    title: str
    parameters: tuple[Parameter, ...]


_P = Parameter
_NUMBERS: Final = {
    it.name: it
    for it in (
        _P("liquid.density_kg_m3", "Density", "kg/m³", 1.0, logarithmic=True, decimals=1),
        _P("liquid.viscosity_pa_s", "Viscosity", "Pa·s", 1e-5, 1000.0, 1e-3, True, factor=1e3, shown_unit="mPa·s"),
        _P("wake.length", "Length", "ticks", logarithmic=True, whole=True, decimals=0),
        _P("wake.scaling", "Scaling", "ticks", 1.0, 1e5, logarithmic=True, decimals=0),
        _P("wake.exponent", "Exponent", "", 0.05, logarithmic=True),
        _P("wake.breaking_angle_deg", "Breaking angle", "°", decimals=1),
        _P("wake.breaking_span_m", "Breaking span", "m", most=0.5, factor=1e3, shown_unit="mm", decimals=1),
        _P("wake.decay", "Decay", "a tick", 0.99, decimals=6),
        _P("wake.resolution_m", "Resolution", "m", most=0.05, factor=1e3, shown_unit="mm", decimals=1),
        _P("local_wake.length", "Length", "ticks", logarithmic=True, whole=True, decimals=0),
        _P("local_wake.scaling", "Scaling", "ticks", 1.0, 1e5, logarithmic=True, decimals=0),
        _P("local_wake.exponent", "Exponent", "", 0.05, logarithmic=True),
        _P("local_wake.decay", "Decay", "a tick", 0.99, decimals=6),
        _P("local_wake.reach_m", "Reach", "m", 1e-3, 0.5, factor=1e3, shown_unit="mm", decimals=1),
        _P("local_wake.spreading_m2ps", "Spreading", "m²/s", most=0.1, factor=1e4, shown_unit="cm²/s"),
        _P("current.velocity_mps", "Speed", "m/s", -5.0, 5.0),
        _P("current.centre_m", "Centre", "m", -1.0, 1.0, factor=1e3, shown_unit="mm", decimals=0),
        _P("current.heading_deg", "Heading", "°", decimals=0),
        _P("current.width_m", "Width", "m", 0.01, 5.0, factor=1e3, shown_unit="mm", logarithmic=True, decimals=0),
        _P("current.peak_mps", "Peak speed", "m/s", -5.0, 5.0),
        _P("current.core_m", "Core", "m", 0.01, 2.0, factor=1e3, shown_unit="mm", logarithmic=True, decimals=0),
        _P("added_mass.coefficient", "Coefficient", "", most=2.0),
        _P("added_mass.filter_s", "Smoothing", "s", most=0.2, factor=1e3, shown_unit="ms", decimals=1),
        _P("history.window_s", "Window", "s", factor=1e3, shown_unit="ms", decimals=0),
        _P("history.smoothing_s", "Smoothing", "s", most=0.2, factor=1e3, shown_unit="ms", decimals=1),
        _P("region.centre_m", "Centre", "m", -1.0, 1.0, factor=1e3, shown_unit="mm", decimals=0),
        _P("region.size_m", "Size", "m", 0.01, 5.0, factor=1e3, shown_unit="mm", logarithmic=True, decimals=0),
        _P("region.radius_m", "Radius", "m", 0.01, 5.0, factor=1e3, shown_unit="mm", logarithmic=True, decimals=0),
        _P("region.height_m", "Height", "m", 0.01, 5.0, factor=1e3, shown_unit="mm", logarithmic=True, decimals=0),
        _P("body.diameter_m", "Diameter", "m", most=0.5, factor=1e3, shown_unit="mm", logarithmic=True, decimals=1),
        _P("body.drag_coefficient", "Drag coefficient", "", most=2.0),
        _P("body.density_kg_m3", "Body density", "kg/m³", 1.0, logarithmic=True, decimals=1),
        _P("velocity.alpha", "Weight", "", 0.005, logarithmic=True, decimals=3),
        _P("velocity.samples", "Samples", "ticks", whole=True, decimals=0),
        _P("velocity.tolerance_m", "Tolerance", "m", most=1e-3, factor=1e6, shown_unit="µm", decimals=0),
        _P("knee.threshold_mps", "Speed knee", "m/s", 0.1, 20.0, logarithmic=True),
        _P("scene.scale", "Scale", "", 0.5, 50.0, logarithmic=True, decimals=2),
        _P("scene.force_limit_n", "Force limit", "N", 0.1, MAX_FORCE_N, decimals=1),
        _P("accuracy.relative", "Share left out", "", factor=100.0, shown_unit="%", decimals=1),
        _P("accuracy.absolute_n", "Force left out", "N", most=2.0, decimals=3),
        _P("motion.speed_mps", "Fastest", "m/s", 0.01, 20.0, logarithmic=True),
        _P("motion.acceleration_mps2", "Hardest", "m/s²", 0.1, 200.0, logarithmic=True, decimals=1),
    )
}
_CHOICES: Final = {
    it.name: it
    for it in (
        _P(
            "drag.law",
            "Drag law",
            choices=(
                ("constant", "Constant (thesis)"),
                ("schiller-naumann", "Schiller–Naumann"),
                ("haider-levenspiel", "Haider–Levenspiel"),
                ("brown-lawler", "Brown–Lawler"),
            ),
        ),
        _P("wake.axes", "Axes", choices=(("xz", "Horizontal (thesis)"), ("xyz", "All three"))),
        _P("local_wake.axes", "Axes", choices=(("xz", "Horizontal"), ("xyz", "All three"))),
        _P(
            "current.kind",
            "Current",
            choices=(("uniform", "Uniform"), ("channel", "Channel"), ("vortex", "Vortex")),
        ),
        _P(
            "region.kind",
            "Region",
            choices=(("everywhere", "Everywhere"), ("box", "Box"), ("cylinder", "Cylinder")),
        ),
        _P(
            "velocity.kind",
            "Estimator",
            choices=(
                ("kalman", "Kalman"),
                ("ewma", "EWMA (thesis)"),
                ("line", "Line"),
                ("foaw", "Adaptive window"),
                ("raw", "Raw difference"),
            ),
        ),
        _P(
            "knee.law",
            "Knee law",
            choices=(("sqrt", "Square root"), ("square", "Square (thesis' words)"), ("none", "None")),
        ),
    )
}
_SMOOTHING: Final = ("added_mass.filter_s", "history.smoothing_s")
"""What follows from the velocity estimator where it is left open."""
EFFECT_WORDS: Final = {
    "drag": "Drag",
    "wake": "Wake",
    "local_wake": "Local wake",
    "current": "Current",
    "buoyancy": "Buoyancy",
    "surface": "Surface",
    "added_mass": "Added mass",
    "history": "History",
}


def sections(scene: Scene) -> tuple[Section, ...]:
    """Return the parameters of a scene with one liquid, those of an effect only where it is called for.

    Raises
    ------
    StudyError
        The scene has no liquid, several, or takes its velocities from a table.
    """
    liquid = the_liquid(scene)
    effects = resolve(scene).liquids[0].effects
    found = [
        ("Liquid", ("liquid.density_kg_m3", "liquid.viscosity_pa_s", "drag.law")),
        *((EFFECT_WORDS[table], _names(scene, table)) for table in _tables_of(liquid, effects)),
        ("Body", _names(scene, "body")),
        ("Filter", (*_names(scene, "velocity"), *_names(scene, "knee"))),
        ("Effects", ("effects", *(f"effects.{effect}" for effect in ORDER))),
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
    raise StudyError(f"this liquid has no parameter {name!r} now: call for the effect it belongs to")


def value_of(scene: Scene, name: str) -> Value:
    """Return what a parameter is in a scene, SI or one of its choices; None where it has none, such as a viscosity.

    What follows from other parameters while it is left open is what follows: a reach is one diameter of the body.
    """
    liquid = the_liquid(scene)
    place, _, field = name.partition(".")
    if place == "effects":
        if not field:
            return AUTO if liquid.effects == "auto" else ON
        return ON if field in resolve(scene).liquids[0].effects else OFF
    found = resolve(scene).liquids[0].drag.law if name == "drag.law" else read(scene, name)
    if found is None and name == "local_wake.reach_m":
        return scene.body.diameter_m
    if found is None and name in _SMOOTHING:
        return scene.smoothing_s(getattr(liquid, place))
    if found is None and place == "motion":
        return float(getattr(scene.motion_in(liquid), field))
    return found if found is None or isinstance(found, str) else float(found)


def read(scene: Scene, name: str) -> Any:
    """Return what stands in a scene under ``table.field`` or a component of it; None where nothing does."""
    liquid = the_liquid(scene)
    place, field, *axis = name.split(".")
    table = {"liquid": liquid, "scene": scene}.get(place) or getattr(liquid, place, None) or getattr(scene, place, None)
    found = getattr(table, field, None)
    return found[AXES.index(axis[0])] if axis and found is not None else found


def the_liquid(scene: Scene) -> Liquid:
    """Return the liquid of a scene that has one.

    Raises
    ------
    StudyError
        It has none, or several, or its velocities come from a table.
    """
    if len(scene.liquids) != 1:
        raise StudyError(f"the lab takes one liquid at a time, not {len(scene.liquids)}: choose one of them")
    if isinstance(scene.velocity, Given):
        raise StudyError('velocity "given" is for motions from a file: choose an estimator such as "ewma"')
    return scene.liquids[0]


def _tables_of(liquid: Liquid, effects: Any) -> tuple[str, ...]:
    """Return the tables that belong to the effects called for, of those that stand in the liquid."""
    tables = ("wake", "local_wake", "current", "added_mass", "history")
    return tuple(it for it in tables if it in effects and getattr(liquid, it) is not None)


def _names(scene: Scene, place: str) -> tuple[str, ...]:
    """Return the names of a table's parameters, components one by one, in the order of its model."""
    table = getattr(the_liquid(scene), place, None) or getattr(scene, place)
    names: list[str] = []
    for field in type(table).model_fields:
        name = f"{place}.{field}"
        if isinstance(getattr(table, field), tuple):
            names += [f"{name}.{axis}" for axis in AXES]
        elif name in _NUMBERS or name in _CHOICES:
            names.append(name)
    return tuple(names)


def _accuracy(liquid: Liquid) -> tuple[str, ...]:
    """Return what decides which effects are left out: nothing, where they are named."""
    if liquid.effects != "auto":
        return ()
    return "accuracy.relative", "accuracy.absolute_n", "motion.speed_mps", "motion.acceleration_mps2"


def _parameter(scene: Scene, name: str) -> Parameter:
    """Return a parameter with its range, default and unit as shown."""
    if name == "effects":
        return Parameter(name, "Chosen", default=ON, choices=((ON, "By hand"), (AUTO, "By the gate (auto)")))
    if name.startswith("effects."):
        words = EFFECT_WORDS[name.partition(".")[2]]
        return Parameter(name, words, default=OFF, choices=((OFF, "Off"), (ON, "On")))
    place, field, *axis = name.split(".")
    row = (_CHOICES | _NUMBERS)[f"{place}.{field}"]
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
    """Return what a field's model gives it; None where it gives nothing."""
    model = _model(scene, place)
    if row.name in _SMOOTHING:
        return scene.smoothing_s(AddedMass() if place == "added_mass" else History())
    info = model.model_fields[field]
    return row.default if info.is_required() or info.default is None else info.default


def _range(scene: Scene, place: str, field: str, row: Parameter) -> tuple[float, float]:
    """Return the lab's range within the model's."""
    least, most = row.least, row.most
    for bound in _model(scene, place).model_fields[field].metadata:
        if row.least == _LEAST and getattr(bound, "ge", None) is not None:
            least = float(bound.ge)
        if row.most == _MOST and getattr(bound, "le", None) is not None:
            most = float(bound.le)
    return least, most

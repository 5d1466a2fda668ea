"""Quantities by name, with labels and units: the table that lab, reports and figures share.

Names are ``table.field``, as in ``haptics.model.overrides``; the parameters of an effect are in its descriptor.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from study_app.haptics.model.effects import EFFECTS, NAMED, Parameter
from study_app.haptics.model.laws import LAW_NAMES
from study_app.number_text import exact_text

MAX_FORCE_N: Final = 8.0
_P = Parameter
_SCENE_QUANTITIES: Final = {
    parameter.name: parameter
    for parameter in (
        _P("condition.delay_ms", "Visual delay", unit="ms"),
        _P("condition.force_delay_ms", "Force delay", unit="ms"),
        _P("condition.force_jitter_ms", "Force jitter", unit="ms"),
        _P("condition.force_loss", "Force loss", unit=""),
        _P("liquid.density_kg_m3", "Density", unit="kg/m³", least=1.0, logarithmic=True, decimals=1),
        _P(
            "liquid.viscosity_pa_s",
            "Viscosity",
            unit="Pa·s",
            least=1e-5,
            most=1000.0,
            default=1e-3,
            logarithmic=True,
            factor=1e3,
            shown_unit="mPa·s",
        ),
        _P("region.centre_m", "Centre", unit="m", least=-1.0, most=1.0, factor=1e3, shown_unit="mm", decimals=0),
        _P(
            "region.size_m",
            "Size",
            unit="m",
            least=0.01,
            most=5.0,
            factor=1e3,
            shown_unit="mm",
            logarithmic=True,
            decimals=0,
        ),
        _P(
            "region.radius_m",
            "Radius",
            unit="m",
            least=0.01,
            most=5.0,
            factor=1e3,
            shown_unit="mm",
            logarithmic=True,
            decimals=0,
        ),
        _P(
            "region.height_m",
            "Height",
            unit="m",
            least=0.01,
            most=5.0,
            factor=1e3,
            shown_unit="mm",
            logarithmic=True,
            decimals=0,
        ),
        _P(
            "body.diameter_m", "Diameter", unit="m", most=0.5, factor=1e3, shown_unit="mm", logarithmic=True, decimals=1
        ),
        _P("body.drag_coefficient", "Drag coefficient", unit="", most=2.0),
        _P("body.density_kg_m3", "Body density", unit="kg/m³", least=1.0, logarithmic=True, decimals=1),
        _P("velocity.alpha", "Weight", unit="", least=0.005, logarithmic=True, decimals=3),
        _P("knee.threshold_mps", "Speed knee", unit="m/s", least=0.1, most=20.0, logarithmic=True),
        _P("scene.scale", "Scale", unit="", least=0.5, most=50.0, logarithmic=True, decimals=2),
        _P("scene.force_limit_n", "Force limit", unit="N", least=0.1, most=MAX_FORCE_N, decimals=1),
        _P("accuracy.relative", "Negligible share", unit="", factor=100.0, shown_unit="%", decimals=1),
        _P("accuracy.absolute_n", "Negligible force", unit="N", most=2.0, decimals=3),
        _P("motion.speed_mps", "Fastest", unit="m/s", least=0.01, most=20.0, logarithmic=True),
        _P("motion.acceleration_mps2", "Hardest", unit="m/s²", least=0.1, most=200.0, logarithmic=True, decimals=1),
    )
}
_SESSION_TABLES: Final = frozenset({"scene", "velocity", "knee", "accuracy", "motion"})
"""Tables whose numbers apply to all liquids."""
QUANTITIES: Final = _SCENE_QUANTITIES | {
    parameter.name: parameter for effect in EFFECTS for parameter in effect.controls
}


def quantity(name: str) -> Parameter:
    """Return a quantity by name: ``table.field``, or a field, which means that of the first table that has it.

    Raises KeyError if there is none.
    """
    for known, parameter in QUANTITIES.items():
        if name in {known, known.partition(".")[2]}:
            return parameter
    raise KeyError(name)


def can_vary(name: str) -> bool:
    """Return whether a number belongs to a condition (its liquid, region, ball or delays), so that it can be varied."""
    return any(
        name in {known, known.partition(".")[2]} for known in QUANTITIES if _table_name(known) not in _SESSION_TABLES
    )


def quantity_text(name: str) -> str:
    """Return the name of a quantity for use within a sentence, such as "viscosity" or "wake scaling"."""
    parameter = quantity(name)
    effect = NAMED.get(_table_name(parameter.name))
    label = parameter.label if effect is None or effect.with_liquid else f"{effect.label} {parameter.label}"
    return label.lower()


def liquid_text(liquid: Mapping[str, Any]) -> str:
    """Return the text on a liquid's density, effects and parameters other than defaults, from its JSON table."""
    damping, viscosity, effects = liquid["drag"].get("damping_nspm"), liquid.get("viscosity_pa_s"), liquid["effects"]
    phrases = [f"{liquid['density_kg_m3']:g} kg/m³"] if damping is None else [f"damping {damping:g} N·s/m at the hand"]
    phrases += [] if viscosity is None else [f"{viscosity:g} Pa·s"]
    for effect in EFFECTS:
        if effect.name == "drag":
            phrases += [f"drag law: {LAW_NAMES[liquid['drag']['law']]}"] if effect.name in effects else []
            continue
        is_named, table = effect.name in effects, liquid.get(effect.name)
        values = ""
        if table is not None and (is_named or (effects == "auto" and effect.automatic)):
            values = ", ".join(_parameter_texts(effect.name, table, effect.model))
        if is_named or values:
            phrases.append(f"{effect.label[0].lower()}{effect.label[1:]}{f' ({values})' if values else ''}")
    region = liquid.get("region") or {"kind": "everywhere"}
    if region["kind"] != "everywhere":
        phrases.append(f"in a {region['kind']} ({', '.join(_parameter_texts('region', region))})")
    if body := liquid.get("body"):
        phrases.append(f"with its own ball ({', '.join(_parameter_texts('body', body))})")
    return ", ".join([*phrases, *(["effects selected automatically by size"] if effects == "auto" else [])])


def _parameter_texts(table: str, values: Mapping[str, Any], defaults: Any = None) -> Iterator[str]:
    """Yield name, value and SI unit of each parameter in a table that is not the default of its model.

    Tables with a kind are listed completely, and an exponent is always listed.
    """
    for name, value in values.items():
        parameter = QUANTITIES.get(f"{table}.{name}")
        if parameter is None or value is None:
            continue
        is_default = defaults is not None and "kind" not in values and defaults.model_fields[name].default == value
        if is_default and name != "exponent":
            continue
        if parameter.choices:
            text = dict(parameter.choices).get(value, str(value))
        elif isinstance(value, list | tuple):
            text = f"({', '.join(map(exact_text, value))})"
        else:
            text = exact_text(value)
        yield f"{parameter.label[0].lower()}{parameter.label[1:]} {text} {parameter.unit}".rstrip()


def _table_name(name: str) -> str:
    return name.partition(".")[0]


_COUNTABLE = ("exponent", "mean setting", "point of subjective equality", "threshold")


def with_article(measure: str) -> str:
    """Return a measure as the subject of a sentence: "the threshold", but "sensitivity (d′)"."""
    return f"the {measure}" if measure.startswith(_COUNTABLE) or " score" in measure else measure


def quoted_title(name: str) -> str:
    """Return a title of several words in quotation marks, so that a sentence can contain it."""
    return f"“{name}”" if " " in name and not name.startswith("“") and not name.endswith(")") else name

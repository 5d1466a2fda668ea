"""Quantities by name, in words and with units: the one table that lab, reports and figures read.

Names are ``table.field``, as ``haptics.model.overrides`` takes them; the parameters of an effect are in its descriptor.
"""

from __future__ import annotations

from typing import Final

from study_app.haptics.model.effect import Parameter
from study_app.haptics.model.effects import EFFECTS, NAMED
from study_app.protocol.model import MAX_FORCE_N

_P = Parameter
_OF_THE_SCENE: Final = {
    it.name: it
    for it in (
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
_OF_A_SESSION: Final = frozenset({"scene", "velocity", "knee", "accuracy", "motion"})
"""Tables whose numbers hold for all liquids."""
QUANTITIES: Final = _OF_THE_SCENE | {it.name: it for effect in EFFECTS for it in effect.controls}


def quantity(name: str) -> Parameter:
    """Return the varied quantity: ``table.field``, or a field of the first table that has it."""
    for known, row in QUANTITIES.items():
        if name in {known, known.partition(".")[2]}:
            return row
    raise KeyError(name)


def can_vary(name: str) -> bool:
    """Return whether a number belongs to a condition: to its liquid, region, ball or delay."""
    return any(
        name in {known, known.partition(".")[2]} for known in QUANTITIES if _table_name(known) not in _OF_A_SESSION
    )


def quantity_words(name: str) -> str:
    """Return the name of a quantity for use within a sentence, such as "viscosity" or "wake scaling"."""
    row = quantity(name)
    effect = NAMED.get(_table_name(row.name))
    label = row.label if effect is None or effect.with_liquid else f"{effect.label} {row.label}"
    return label.lower()


def _table_name(name: str) -> str:
    return name.partition(".")[0]

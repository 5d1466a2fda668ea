"""The words on a liquid in the methods and the preregistration: every parameter that an author wrote, with its unit."""

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

from study_app.haptics.model.scene import Liquid
from study_app.lab.presets import available_liquids
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import load
from study_app.protocol.quantities import liquid_text

UNITS = (
    ("_kg_m3", " kg/m³"), ("_pa_sn", " Pa·sⁿ"), ("_pa_s", " Pa·s"), ("_pa", " Pa"), ("_per_s", " 1/s"),
    ("_nspm", " N·s/m"), ("_mps", " m/s"), ("_m2ps", " m²/s"), ("_deg", " °"), ("_s", " s"), ("_m", " m"),
    ("length", " ticks"), ("scaling", " ticks"), ("decay", " per tick"),
    ("flow_index", ""), ("exponent", ""), ("coefficient", ""),
)  # fmt: skip
"""The unit of a parameter by the end of its name in a file."""
LAWS = {
    "haider-levenspiel": "Haider–Levenspiel",
    "herschel-bulkley": "Herschel–Bulkley",
    "carreau": "Carreau",
    "maxwell": "Maxwell",
    "shear-thickening": "Shear thickening",
    "vortex": "Vortex",
}


def written_values(table: dict[str, Any]) -> Iterator[str]:
    """Yield the text that each value of a liquid's table must have."""
    for name, value in table.items():
        if isinstance(value, dict):
            yield from written_values(value)
        elif name == "kind":
            yield LAWS.get(value, value)
        elif name == "law":
            yield f"drag law: {LAWS.get(value, value)}"
        elif isinstance(value, list):
            yield f"({', '.join(f'{part:g}' for part in value)}) m"
        elif not isinstance(value, str):
            yield f" {value:g}{next(unit for end, unit in UNITS if name.endswith(end))}"


@cache
def described_liquids(source: str) -> tuple[str, ...]:
    """Return the lines of a study's description, which the preregistration contains, on its liquids."""
    return tuple(describe(load(source)).split("\nLiquids\n")[1].split("\n\n")[0].splitlines())


SHIPPED = {(choice.source, choice.liquid): choice.scene.liquids[0] for choice in available_liquids()}


@pytest.mark.parametrize(("source", "name"), sorted(SHIPPED))
def test_each_parameter_of_a_shipped_liquid_is_named_with_its_unit(source: str, name: str) -> None:
    liquid = SHIPPED[source, name]
    table = liquid.model_dump(mode="json", exclude_defaults=True, exclude={"id", "effects"})
    flow_curve = liquid.non_newtonian
    values = [*written_values(table), *([] if flow_curve is None else [LAWS[flow_curve.kind]])]
    if liquid.drag.damping_nspm is not None:
        values = [value for value in values if "kg/m³" not in value]  # a damper's density has no effect
    assert values
    assert [value for value in values if value not in f" {liquid_text(liquid.model_dump(mode='json'))}"] == []
    (row,) = (line for line in described_liquids(source) if line.split()[0] == name)
    assert [value for value in values if value not in row] == []


TABLES: dict[str, dict[str, dict[str, tuple[float, float]]]] = {
    "non_newtonian": {
        "herschel-bulkley": {"yield_stress_pa": (1, 400), "consistency_pa_sn": (1, 900), "flow_index": (0.2, 0.9)},
        "carreau": {"zero_shear_viscosity_pa_s": (1, 50), "time_constant_s": (0.01, 9), "flow_index": (0.2, 0.9)},
        "maxwell": {"zero_shear_viscosity_pa_s": (1, 50), "relaxation_time_s": (0.01, 9)},
        "shear-thickening": {
            "zero_shear_viscosity_pa_s": (1, 5),
            "thickened_viscosity_pa_s": (10, 50),
            "onset_shear_rate_per_s": (1, 90),
        },
    },
    "current": {"vortex": {"core_m": (0.1, 2), "peak_mps": (0.1, 3)}},
    "added_mass": {"": {"coefficient": (0.6, 1.9), "filter_s": (0.01, 0.1)}},
    "history": {"": {"window_s": (0.06, 0.4), "smoothing_s": (0.02, 0.1)}},
    "region": {"cylinder": {"radius_m": (0.1, 2), "height_m": (0.1, 2)}},
}


@pytest.mark.parametrize("automatic", [True, False], ids=["auto", "named"])
@pytest.mark.parametrize(("effect", "kind"), [(effect, kind) for effect, kinds in TABLES.items() for kind in kinds])
def test_drawn_parameters_are_named_with_their_units(effect: str, kind: str, automatic: bool) -> None:
    rng = np.random.default_rng([len(effect), len(kind)])
    parameters = {name: round(float(rng.uniform(*ends)), 3) for name, ends in TABLES[effect][kind].items()}
    table: dict[str, Any] = {effect: parameters | ({"kind": kind} if kind else {})}
    effects = [effect] if effect == "non_newtonian" else ["drag", *([] if effect == "region" else [effect])]
    if effect == "history":
        table["viscosity_pa_s"] = 0.75
    liquid = Liquid(id="made", density_kg_m3=1234, effects="auto" if automatic else effects, **table)
    words = f" {liquid_text(liquid.model_dump(mode='json'))}"
    assert [value for value in written_values(table) if value not in words] == []


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({},
         "1234 kg/m³, 0.5 Pa·s, drag law: Brown–Lawler, wake (length 3 ticks, scaling 5 ticks, exponent 0.7), "
         "added mass"),
        ({"drag": {"law": "linear", "damping_nspm": 6.5}, "viscosity_pa_s": None, "effects": ["drag"]},
         "damping 6.5 N·s/m at the hand, drag law: linear"),
        ({"effects": "auto"}, "1234 kg/m³, 0.5 Pa·s, effects selected automatically by size"),
        ({"wake": {"scaling": 5}, "effects": ["history", "wake"]},
         "1234 kg/m³, 0.5 Pa·s, wake (scaling 5 ticks), history"),
        ({"wake": {"scaling": 1234567.25}, "effects": ["wake"]},
         "1234 kg/m³, 0.5 Pa·s, wake (scaling 1234567.25 ticks)"),
        ({"effects": "auto", "body": {"diameter_m": 0.037, "drag_coefficient": None, "density_kg_m3": 815.5}},
         "1234 kg/m³, 0.5 Pa·s, with its own ball (diameter 0.037 m, body density 815.5 kg/m³), "
         "effects selected automatically by size"),
    ],
)  # fmt: skip
def test_parameters_of_effects_that_do_not_act_are_left_out(changed: dict[str, Any], text: str) -> None:
    liquid = {
        "density_kg_m3": 1234.0,
        "viscosity_pa_s": 0.5,
        "drag": {"law": "brown-lawler"},
        "wake": {"length": 3.0, "scaling": 5.0, "exponent": 0.7},
        "effects": ["drag", "wake", "added_mass"],
    }
    assert liquid_text(liquid | changed) == text

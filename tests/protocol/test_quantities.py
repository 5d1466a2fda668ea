"""The table of quantities: words and units of everything that a stimulus can vary."""

import pytest

from study_app.haptics.model.overrides import number_names
from study_app.protocol.load import load
from study_app.protocol.quantities import quantity, quantity_words

OF_THE_LOOP = {"format", "rate_hz", "fade_s"}
"""Numbers of a scene that hold for a whole session."""


@pytest.mark.parametrize(
    ("name", "words", "unit"),
    [
        ("viscosity_pa_s", "viscosity", "Pa·s"),
        ("density_kg_m3", "density", "kg/m³"),
        ("body.density_kg_m3", "body density", "kg/m³"),
        ("damping_nspm", "damping at the hand", "N·s/m"),
        ("drag.damping_nspm", "damping at the hand", "N·s/m"),
        ("wake.scaling", "wake scaling", "ticks"),
        ("local_wake.scaling", "local wake scaling", "ticks"),
        ("delay_ms", "visual delay", "ms"),
    ],
)
def test_quantity_has_words_and_a_unit(name: str, words: str, unit: str) -> None:
    assert (quantity_words(name), quantity(name).unit) == (words, unit)


@pytest.mark.parametrize("study", ["rek2024", "demo", "physical2"])
def test_every_number_of_a_liquid_has_words(study: str) -> None:
    protocol = load(study)
    names = {name for condition in protocol.conditions for name in number_names(protocol.scene_for(condition))}
    assert len(names) > 15
    for name in names - OF_THE_LOOP:
        assert quantity_words(name)
        assert "_" not in quantity_words(name)


def test_unknown_quantity_is_refused() -> None:
    with pytest.raises(KeyError):
        quantity("rate_hz")

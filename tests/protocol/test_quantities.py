"""The table of quantities: words and units of everything that a stimulus can vary."""

import pytest

from study_app.haptics.model.overrides import number_names
from study_app.protocol.load import load
from study_app.protocol.quantities import quantity, quantity_words

OF_THE_LOOP = {"format", "rate_hz", "fade_s"}
"""Numbers of a scene that hold for a whole session."""


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

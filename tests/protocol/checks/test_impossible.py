"""Studies that could be read, but in which nothing would be felt, nothing would differ, or no trial could end."""

import pytest

from study_app.protocol.load import load, parse
from study_app.protocol.source.files import source_bytes
from study_app.protocol.warnings.study_warnings import warnings


@pytest.mark.parametrize(
    ("study", "old", "new", "device", "place"),
    [
        ("viscosityjnd", 'ball = "hidden"', 'ball = "hidden"\ndelay_ms = 50', "", "conditions.damper.delay_ms"),
        ("delaydetect", "[conditions.water]", "[conditions.water]", "Mouse", ""),
        ("forcedelay", "format = 2", "format = 2", "Mouse", "stimuli.delay.vary: Mouse does not produce force"),
        ("forcedelay", "damping_nspm = 4", "damping_nspm = 0.01", "", "stimuli.delay.vary: the condition does not"),
        (
            "demo",
            "format = 2",
            "format = 2",
            "Mouse",
            "blocks.liquids: Mouse does not produce force, so participants see",
        ),
        (
            "viscosityjnd",
            "format = 2",
            "format = 2",
            "Mouse",
            "blocks.viscosity: Mouse does not produce force, and the",
        ),
    ],
)
def test_a_condition_that_nobody_can_perceive_is_warned_of(
    study: str, old: str, new: str, device: str, place: str
) -> None:
    text = source_bytes(study).decode()
    assert old in text
    found = warnings(parse(text.replace(old, new, 1).encode(), study), simulates=False, without_force=device)
    perceived = [one for one in found if "does not produce force" in one or "ball is hidden" in one]
    assert [one for one in perceived if one.startswith(place)] if place else perceived == []
    assert not [one for one in warnings(load(study), simulates=False) if one in perceived]

"""Studies that could be read, but in which nothing would be felt, nothing would differ, or no trial could end."""

import pytest

from study_app.protocol.load import load, parse
from study_app.protocol.source.files import source_bytes
from study_app.protocol.warnings.study_warnings import warnings

SEEN = "Mouse does not produce force, so participants see but do not feel how the liquids slow the ball down"
UNSEEN = "Mouse does not produce force, and the ball is hidden, so participants cannot perceive the block's liquids"
LATE = "does not produce force, so participants cannot feel whether the force is late or lost"
HIDDEN = 'the ball is hidden, so participants cannot see its delay: write ball = "shown"'


@pytest.mark.parametrize(
    ("study", "old", "new", "device", "expected"),
    [
        ("viscosityjnd", 'ball = "hidden"', 'ball = "hidden"\ndelay_ms = 50', "",
         {f"conditions.damper.delay_ms: {HIDDEN}"}),
        ("delaydetect", "format = 2", "format = 2", "Mouse", set()),
        ("forcedelay", "format = 2", "format = 2", "Mouse", {f"stimuli.delay.vary: Mouse {LATE}"}),
        ("forcedelay", "damping_nspm = 4", "damping_nspm = 0.01", "", {f"stimuli.delay.vary: the condition {LATE}"}),
        ("demo", "format = 2", "format = 2", "Mouse", {f"blocks.liquids: {SEEN}"}),
        ("viscosityjnd", "format = 2", "format = 2", "Mouse", {f"blocks.viscosity: {UNSEEN}"}),
    ],
)  # fmt: skip
def test_a_condition_that_nobody_can_perceive_is_warned_of(
    study: str, old: str, new: str, device: str, expected: set[str]
) -> None:
    text = source_bytes(study).decode()
    assert old in text
    found = warnings(parse(text.replace(old, new, 1).encode(), study), simulates=False, without_force=device)
    assert {
        sentence for sentence in found if "not produce force" in sentence or "ball is hidden" in sentence
    } == expected
    assert expected.isdisjoint(warnings(load(study), simulates=False))

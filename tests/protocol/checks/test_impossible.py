"""Studies that could be read, but in which nothing would be felt, nothing would differ, or no trial could end."""

from types import SimpleNamespace
from typing import Any

import pytest

from study_app.haptics.model.scene import Box, Cylinder, Everywhere
from study_app.protocol.checks.consistency import _is_within_tank, felt_numbers
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
def test_an_imperceptible_condition_has_a_warning(
    study: str, old: str, new: str, device: str, expected: set[str]
) -> None:
    text = source_bytes(study).decode()
    assert old in text
    warning_lines = warnings(parse(text.replace(old, new, 1).encode(), study), simulates=False, without_force=device)
    assert {
        sentence for sentence in warning_lines if "not produce force" in sentence or "ball is hidden" in sentence
    } == expected
    assert expected.isdisjoint(warnings(load(study), simulates=False))


@pytest.mark.parametrize(
    ("region", "is_reached"),
    [
        (Everywhere(), True),
        (Box(centre_m=(0.25, 0.2, -0.3), size_m=(0.101, 0.01, 0.01)), True),
        (Box(centre_m=(0.25, 0.2, -0.3), size_m=(0.099, 0.01, 0.01)), False),
        (Box(centre_m=(0.1, 0.32, -0.3), size_m=(0.01, 0.081, 0.01)), True),
        (Box(centre_m=(0.1, 0.32, -0.3), size_m=(0.01, 0.079, 0.01)), False),
        (Box(centre_m=(0.1, 0.2, -0.4), size_m=(0.01, 0.01, 0.081)), True),
        (Box(centre_m=(0.1, 0.2, -0.4), size_m=(0.01, 0.01, 0.079)), False),
        (Cylinder(centre_m=(0.23, 0.2, -0.4), radius_m=0.051, height_m=0.01), True),
        (Cylinder(centre_m=(0.23, 0.2, -0.4), radius_m=0.049, height_m=0.01), False),
        (Cylinder(centre_m=(0.1, 0.32, -0.3), radius_m=0.01, height_m=0.081), True),
        (Cylinder(centre_m=(0.1, 0.32, -0.3), radius_m=0.01, height_m=0.079), False),
    ],
    ids=str,
)
def test_a_region_is_reached_if_it_touches_the_tank_in_the_scene(region: Any, is_reached: bool) -> None:
    """At twice the size the tank extends 0.1, 0.08 and 0.06 m from the origin."""
    scene: Any = SimpleNamespace(scale=2.0, origin_m=(0.1, 0.2, -0.3))
    device: Any = SimpleNamespace(workspace_m=(0.1, 0.08, 0.06))
    assert _is_within_tank(SimpleNamespace(region=region), scene, device) == is_reached  # type: ignore[arg-type]


def test_liquids_that_differ_only_in_names_and_unused_effects_feel_the_same() -> None:
    thin, thick = (load("demo").liquids[name] for name in list(load("demo").liquids)[:2])
    assert felt_numbers(thin) != felt_numbers(thick)
    assert felt_numbers(thin) == felt_numbers(thin.model_copy(update={"id": "another"}))
    changed = thin.model_copy(update={"effects": tuple(reversed(thin.effects))})
    assert felt_numbers(thin) == felt_numbers(changed)
    assert felt_numbers(thin) != felt_numbers(thin.model_copy(update={"density_kg_m3": thin.density_kg_m3 + 1}))

"""Up to which level safety left a late force alone, as the report says it."""

import re

import pytest

from study_app.analysis.report.answers.withheld_section import withheld
from study_app.analysis.results.level_results import LevelsFound, WithheldForce


def page(*rows: tuple[float | None, float, float]) -> str:
    """Return the section of comparisons in which at most so many percent were withheld, by standard and level."""
    found = tuple(WithheldForce(standard, level, level, 4, most / 2, most) for standard, level, most in rows)
    levels = LevelsFound(
        "b", "Block", "2ifc", True, (), "share", "correct", unit="ms", level_kind="difference", withheld=found
    )
    return re.sub(r"<[^>]+>", " ", "".join(withheld(levels)))


@pytest.mark.parametrize(
    ("most", "words"),
    [
        ((1.0, 4.9, 5.0), "in every comparison up to 80 ms."),
        ((1.0, 5.1, 0.0), "in every comparison up to 20 ms."),
        ((6.0, 0.0, 0.0), "in every comparison at no level presented."),
    ],
)
def test_the_longest_delay_ends_before_the_first_level_that_loses_more(most: tuple[float, ...], words: str) -> None:
    text = page(*((None, level, share) for level, share in zip((20.0, 40.0, 80.0), most, strict=True)))
    assert f"At most 5 % was withheld {words}" in text


def test_each_standard_has_its_own() -> None:
    text = page((0.0, 20.0, 1.0), (0.0, 40.0, 9.0), (50.0, 20.0, 7.0))
    assert "up to 20 ms at the standard of 0 ms." in text
    assert "at no level presented at the standard of 50 ms." in text

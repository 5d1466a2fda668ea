"""What counts as a success of the psychometric function, by design and kind of level."""

from types import SimpleNamespace
from typing import Any

import pytest

from study_app.protocol.trials.designs import default_design


@pytest.mark.parametrize(
    ("design", "of_ratios", "of_values"),
    [
        ("2ifc", "correct", "comparison chosen"),
        ("4ifc", "correct", "comparison chosen"),
        ("abx", "correct", "correct"),
        ("oddity", "correct", "correct"),
        ("yesno", "yes", "yes"),
    ],
)
def test_forced_choices_have_no_correct_answer_if_levels_lie_on_both_sides(
    design: str, of_ratios: str, of_values: str
) -> None:
    weber: Any = SimpleNamespace(level_kind="weber")
    value: Any = SimpleNamespace(level_kind="value")
    names = [default_design(design).success_of(stimulus) for stimulus in (None, weber, value)]
    assert names == [of_ratios, of_ratios, of_values]

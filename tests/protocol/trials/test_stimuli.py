from typing import Any

import pytest
from pydantic import ValidationError

from study_app.protocol.trials.stimuli import Stimulus


def stimulus(**keys: Any) -> Stimulus:
    return Stimulus.model_validate({"vary": "viscosity_pa_s", "levels": (0.1, 0.8)} | keys)


@pytest.mark.parametrize(
    ("keys", "standard", "level", "comparison"),
    [
        ({}, 8.0, 0.5, 12.0),
        ({"direction": "down"}, 8.0, 0.5, 4.0),
        ({"level": "difference"}, 8.0, 0.5, 8.5),
        ({"level": "difference", "direction": "down"}, 8.0, 0.5, 7.5),
        ({"level": "value"}, 8.0, 0.5, 0.5),
        ({"vary": "delay_ms"}, 100.0, 30.0, 130.0),
        ({"vary": "delay_ms"}, 0.0, 30.0, 30.0),
        ({"level": "value"}, None, 3.0, 3.0),
    ],
)
def test_the_comparison_of_a_level(keys: dict[str, str], standard: float | None, level: float, comparison: float):
    assert stimulus(**keys).comparison(standard, level) == comparison
    assert stimulus(**keys).level_between(standard, comparison) == level


def test_a_time_is_varied_by_differences_and_anything_else_by_weber_fractions():
    assert stimulus(vary="delay_ms").level_kind == "difference"
    assert stimulus().level_kind == "weber"


def test_levels_are_evenly_spaced_in_their_logarithm():
    levels = stimulus(levels=(1, 100), steps=5).grid
    assert levels == pytest.approx((1, 10**0.5, 10, 10**1.5, 100), rel=1e-12)
    assert (levels[0], levels[-1]) == (1, 100)


def test_levels_are_evenly_spaced():
    assert stimulus(levels=(0, 1), spacing="linear").spaced(5) == (0, 0.25, 0.5, 0.75, 1)


def test_one_level_is_the_largest():
    assert stimulus().spaced(1) == (0.8,)


@pytest.mark.parametrize(
    ("keys", "place", "message"),
    [
        ({"levels": (0.8, 0.1)}, "levels", "the first level must be the smaller"),
        ({"levels": (0.0, 0.8)}, "levels", "0 has no logarithm"),
        ({"levels": (-1, 1), "spacing": "linear"}, "levels", "below 0"),
        ({"standards": (0.0,)}, "level", "a Weber fraction of a standard of 0 does not exist"),
        ({"standards": (1.0, 1.0)}, "standards", "listed twice"),
    ],
)
def test_what_is_refused(keys: dict[str, Any], place: str, message: str):
    with pytest.raises(ValidationError, match=message) as caught:
        stimulus(**keys)
    assert caught.value.errors()[0]["ctx"]["place"] == place

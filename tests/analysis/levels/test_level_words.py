"""What the report says of thresholds in words: what they cannot show, and the methods paragraph."""

import re
from dataclasses import replace

import pandas as pd
import pytest

from study_app.analysis.designs.level_conduct import catch_answers, level_conduct
from study_app.analysis.report.answers.level_limits import level_limits
from study_app.analysis.report.answers.withheld_section import withheld
from study_app.analysis.results.level_results import (
    CatchAnswers,
    LevelAnswers,
    LevelConduct,
    LevelsFound,
    ThresholdFound,
    WithheldForce,
)
from tests.analysis.levels.level_studies import block

GOOD = ThresholdFound(
    "P001", 8.0, 100, 0.2, 0.15, 0.27, width=1.4, lapse=0.01, guess=0.5, flat_width=0.205, fit_p=0.4, drift=0.05
)
DEVICE = (
    "Block: the device's own damping, friction and mass are unknown, since they were not measured; Weber fractions are "
    "of what the motors delivered, and smaller ones of the sum with the device's own."
)
MOTORS = "Block: motors are audible and were not masked: participants may have used their sound."


def found(*ones: ThresholdFound, standards: tuple[float, ...] = (8.0,)) -> LevelsFound:
    group = [ThresholdFound(None, standard, 3, 0.2, None, None) for standard in standards]
    answers = tuple(LevelAnswers("P001", standard, 0.2, 9.0, 5, 1, 3, 0.6, 0.2, 0.9) for standard in standards)
    return LevelsFound(
        "b", "Block", "2ifc", True, (), "share", "correct", vary="damping_nspm", quantity="damping", unit="N·s/m",
        level_kind="weber", spacing="log",
        answers=answers, thresholds=(*group, *ones), family="weibull",
    )  # fmt: skip


def people(*changed: ThresholdFound) -> list[ThresholdFound]:
    return [*changed, *(replace(GOOD, participant=f"P10{number}") for number in range(3))]


def test_good_thresholds_have_the_limits_of_the_device_alone() -> None:
    good = found(*people())
    assert list(level_limits(good)) == [DEVICE, MOTORS]
    assert list(level_limits(replace(good, level_kind="difference"))) == [MOTORS]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"flat_width": 0.23}, "the prior of the width shifts a threshold by more than 10 %"),
        ({"flat_width": 0.17}, "the prior of the width shifts a threshold by more than 10 %"),
        ({"beyond": "above"}, "a threshold lies above the highest level presented"),
        ({"beyond": "below"}, "a threshold lies below the lowest level presented"),
        ({"fit_p": 0.049}, "the function does not fit the answers"),
        ({"drift": -0.3}, "answers became better or worse over the trials"),
        ({"n": 39}, "fewer than 40 answers"),
    ],
)
def test_each_limit_names_whose_threshold_it_is(changes: dict[str, float | str], words: str) -> None:
    first, *rest = level_limits(found(*people(replace(GOOD, **changes))))  # type: ignore[arg-type]  # any field
    assert first.startswith(f"Block: {words}")
    assert first.endswith("(P001).")
    assert rest == [DEVICE, MOTORS]


def test_several_standards_are_named_and_many_thresholds_counted() -> None:
    two = found(*people(replace(GOOD, fit_p=0.01)), replace(GOOD, standard=4.0), standards=(4.0, 8.0))
    assert "(P001 at 8)" in next(iter(level_limits(two)))
    many = [replace(GOOD, participant=f"P{number:03}", n=10) for number in range(9)]
    assert "(9 of 9 thresholds)" in next(iter(level_limits(found(*many))))


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


TRIALS = [  # participant, session, trial, standard, level, level_delivered, analysed, catch, right
    ("P001", 1, 1, 8.0, 0.2, 0.21, True, False, True),
    ("P001", 1, 2, 8.0, 0.4, 0.38, True, False, False),
    ("P001", 1, 3, 8.0, 0.6, None, True, True, False),
    ("P001", 1, 4, 8.0, 0.6, 0.6, True, True, True),
    ("P002", 1, 1, 8.0, 0.6, 0.9, False, True, False),
]
COLUMNS = ["participant", "session", "trial", "standard", "level", "level_delivered", "analysed", "catch", "right"]
INTERVALS = [  # participant, session, trial, attempt, interval, counted, invalid_reasons, pace_mps, apparent_mass_kg
    ("P001", 1, 1, 1, 1, False, "pace_error_percent", 0.9, 0.9),
    ("P001", 1, 1, 2, 1, False, "level_error_percent pace_error_percent", 0.9, 0.9),
    ("P001", 1, 1, 3, 1, True, None, 0.08, -0.01),
    ("P001", 1, 2, 1, 1, True, None, 0.1, -0.03),
    ("P002", 1, 1, 1, 1, False, "pace_error_percent", 0.9, 0.9),
]


@pytest.fixture
def opened() -> pd.DataFrame:
    frame = pd.DataFrame(TRIALS, columns=COLUMNS).assign(block="b")
    return frame.astype({"level_delivered": "Float64", "catch": "boolean", "right": "boolean"})


@pytest.fixture
def intervals() -> pd.DataFrame:
    names = ["participant", "session", "trial", "attempt", "interval", "counted", "invalid_reasons"]
    frame = pd.DataFrame(INTERVALS, columns=[*names, "pace_mps", "apparent_mass_kg"]).assign(block="b")
    return frame.astype({"pace_mps": "Float64", "apparent_mass_kg": "Float64", "invalid_reasons": "string"})


def test_conduct_is_that_of_the_trials_that_are_analysed(opened: pd.DataFrame, intervals: pd.DataFrame) -> None:
    (found,) = level_conduct(block(), opened, intervals)
    assert found == LevelConduct(
        standard=8.0,
        trials=4,
        repeated=2,
        reasons={"level_error_percent": 1, "pace_error_percent": 2},
        measured=3,
        error_mean=pytest.approx((0.01 - 0.02) / 3),
        error_largest=pytest.approx(0.02),
        pace_mps=pytest.approx(0.09),
        apparent_mass_kg=pytest.approx(-0.02),
    )


def test_catch_trials_are_counted_where_they_exclude_a_session_too(opened: pd.DataFrame) -> None:
    assert list(catch_answers(block(), opened)) == []
    kept, excluded = catch_answers(replace(block(), wrong_most=0.5), opened)
    assert kept == CatchAnswers("P001", 1, 2, 1, 0.5)
    assert excluded == CatchAnswers("P002", 1, 1, 1, 0.5)
    assert (kept.excludes, excluded.excludes) == (False, True)

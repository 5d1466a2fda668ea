"""What the report says of thresholds in words: what they cannot show, and the methods paragraph."""

from dataclasses import replace

import pandas as pd
import pytest

from study_app.analysis.levels.conduct import catch_answers, level_conduct
from tests.analysis.levels.level_studies import block

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
    assert found == {
        "standard": 8.0,
        "trials": 4,
        "repeated": 2,
        "reasons": {"level_error_percent": 1, "pace_error_percent": 2},
        "measured": 3,
        "error_mean": pytest.approx((0.01 - 0.02) / 3),
        "error_largest": pytest.approx(0.02),
        "pace_mps": pytest.approx(0.09),
        "apparent_mass_kg": pytest.approx(-0.02),
    }


def test_catch_trials_are_counted_where_they_exclude_a_session_too(opened: pd.DataFrame) -> None:
    assert list(catch_answers(block(), opened)) == []
    kept, excluded = catch_answers(replace(block(), wrong_most=0.5), opened)
    assert kept == {"participant": "P001", "session": 1, "n": 2, "wrong": 1, "most": 0.5}
    assert excluded == {"participant": "P002", "session": 1, "n": 1, "wrong": 1, "most": 0.5}

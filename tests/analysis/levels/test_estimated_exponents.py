"""Exponents of magnitude estimation: slopes of mean ln answers on ln levels, in report, table and R."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from study_app.analysis.levels.exponents import Exponents, estimated_exponents, weber_exponents
from study_app.analysis.levels.thresholds import ThresholdEstimate
from tests.analysis.levels.level_studies import block

LEVELS = (0.5, 2.0, 8.0)


def rows(exponents: dict[str, float], units: dict[str, float], delivered: float = 1.0) -> pd.DataFrame:
    """Return two answers of each noiseless participant to each level: 1.2 and 1/1.2 times the mean."""
    trial_rows = [
        (person, "b", level, delivered * level, True, factor * units[person] * (delivered * level) ** exponent)
        for person, exponent in exponents.items()
        for level in LEVELS
        for factor in (1.2, 1 / 1.2)
    ]
    frame = pd.DataFrame(trial_rows, columns=["participant", "block", "level", "level_delivered", "analysed", "value"])
    return frame.astype({"level_delivered": "Float64", "value": "Float64"})


def test_planted_exponents_are_estimated_in_any_unit() -> None:
    planted, units = {"P001": 0.44, "P002": 0.6}, {"P001": 10.0, "P002": 300.0}
    group, *own = estimated_exponents(block("estimation"), rows(planted, units))
    assert [estimate.exponent for estimate in own] == pytest.approx([0.44, 0.6], abs=1e-12)
    assert [(estimate.participant, estimate.n) for estimate in own] == [("P001", 3), ("P002", 3)]
    assert (group.participant, group.n, group.exponent) == (None, 2, pytest.approx(0.52))
    half = stats.t.ppf(0.975, 1) * np.std([0.44, 0.6], ddof=1) / math.sqrt(2)
    assert (group.low, group.high) == (pytest.approx(0.52 - half), pytest.approx(0.52 + half))


def test_choices_modulus_trials_and_a_single_level_have_no_exponent() -> None:
    frame = rows({"P001": 0.5}, {"P001": 1.0})
    assert list(estimated_exponents(block("2ifc"), frame)) == []
    estimation = block("estimation")
    assert list(estimated_exponents(estimation, frame.assign(analysed=False))) == []
    assert list(estimated_exponents(estimation, frame[frame["level"] == 2.0])) == []


STANDARDS = (0.4, 0.8, 16.0, 32.0)


def observers(*exponents: float, weber: bool = True) -> list[ThresholdEstimate]:
    """Return thresholds of observers whose JND is 0.5 standard^exponent."""
    return [
        ThresholdEstimate(
            participant=f"P{number:03d}", standard=s, n=60, threshold=0.5 * s ** (exponent - weber), low=None, high=None
        )
        for s in STANDARDS
        for number, exponent in enumerate(exponents, start=1)
    ]


@pytest.mark.parametrize("weber", [True, False])
def test_planted_exponents_are_estimated_for_fractions_and_for_differences(weber: bool) -> None:
    group, *own = weber_exponents(observers(1.0, 0.0, 0.8, weber=weber), "weber" if weber else "difference")
    assert [estimate.exponent for estimate in own] == pytest.approx([1.0, 0.0, 0.8], abs=1e-12)
    assert [(estimate.participant, estimate.n) for estimate in own] == [("P001", 4), ("P002", 4), ("P003", 4)]
    assert (group.participant, group.n, group.exponent) == (None, 3, pytest.approx(0.6))
    low, high = stats.ttest_1samp([1.0, 0.0, 0.8], 0.0).confidence_interval(0.95)
    assert (group.low, group.high) == pytest.approx((low, high))


@pytest.mark.parametrize(
    ("summary", "heading"), [("geometric mean", "Exponent of the power law"), ("share", "Weber exponent")]
)
def test_the_heading_names_the_law_of_the_exponents(summary: str, heading: str) -> None:
    level_result: Any = SimpleNamespace(summary=summary, statistics={})
    assert Exponents(level_result).heading() == heading


@pytest.mark.parametrize("own_units", [True, False])
def test_exponents_are_independent_of_the_unit_only_if_participants_chose_it(own_units: bool) -> None:
    level_result: Any = SimpleNamespace(summary="geometric mean", statistics={}, own_units=own_units)
    assert ("unit that a participant chose" in Exponents(level_result).explanation()) == own_units

"""Weber exponents: slopes of ln JND on ln standard per participant, and their mean."""

import math
from dataclasses import replace

import pytest
from scipy import stats

from study_app.analysis.designs.weber_exponents import jnd_slope, weber_exponents
from study_app.analysis.results.level_results import ThresholdFound

STANDARDS = (4.0, 8.0, 16.0, 32.0)


def observers(*exponents: float, weber: bool = True) -> list[ThresholdFound]:
    """Return thresholds of observers whose JND is 0.5 standard^exponent."""
    return [
        ThresholdFound(f"P{number:03d}", s, 60, 0.5 * s ** (exponent - weber), None, None)
        for s in STANDARDS
        for number, exponent in enumerate(exponents, start=1)
    ]


@pytest.mark.parametrize("weber", [True, False])
def test_planted_exponents_are_found_for_fractions_and_for_differences(weber: bool) -> None:
    group, *own = weber_exponents(observers(1.0, 0.0, 0.8, weber=weber), "weber" if weber else "difference")
    assert [one.exponent for one in own] == pytest.approx([1.0, 0.0, 0.8], abs=1e-12)
    assert [(one.participant, one.n) for one in own] == [("P001", 4), ("P002", 4), ("P003", 4)]
    assert (group.participant, group.n, group.exponent) == (None, 3, pytest.approx(0.6))
    low, high = stats.ttest_1samp([1.0, 0.0, 0.8], 0.0).confidence_interval(0.95)
    assert (group.low, group.high) == pytest.approx((low, high))


def test_a_slope_is_that_of_a_regression() -> None:
    jnds = (0.9, 1.4, 3.9, 6.1)
    logs = [[math.log(value) for value in values] for values in (STANDARDS, jnds)]
    assert jnd_slope(STANDARDS, jnds) == pytest.approx(stats.linregress(*logs).slope)


def test_one_standard_and_values_have_no_exponent() -> None:
    one = [threshold for threshold in observers(1.0, 1.0) if threshold.standard == 4.0]
    assert list(weber_exponents(one, "weber")) == []
    assert list(weber_exponents(observers(1.0), "value")) == []
    detection = [replace(threshold, standard=0.0) for threshold in one]
    assert list(weber_exponents([*one, *detection], "difference")) == []


def test_the_exponent_of_one_participant_has_no_interval() -> None:
    group, own = weber_exponents(observers(1.0), "weber")
    assert (group.n, group.low, group.high) == (1, None, None)
    assert own.participant == "P001"

"""Expected precision: posteriors of many observers at once, and the interval of a group's mean."""

import math

import numpy as np
import pytest
from scipy.stats import t as student

from study_app.analysis.statistics.psychometrics.posterior import fitted
from study_app.psychophysics.grid import Grid, evenly, geometric
from study_app.psychophysics.precision import AT_ONCE, Expected, estimated, student_975

GRID = Grid("weibull", evenly(-1.9, 0.0, 41), geometric(0.4, 4.0, 7), (1.4, 1.5), (0.0, 0.02), (0.5, 0.5), (0.5,))


def test_estimates_of_many_observers_are_those_of_each():
    levels, rng = evenly(-1.7, -0.2, 7), np.random.default_rng(1)
    counts = rng.integers(0, 9, (2, AT_ONCE + 5, 7)).astype(float)
    found = estimated(GRID, levels, *counts)
    for row in (0, 7, AT_ONCE, AT_ONCE + 4):
        one = fitted(levels, counts[0, row], counts[1, row], GRID)
        assert found.medians[row] == pytest.approx(one.threshold, abs=1e-12)
        assert found.lows[row] == pytest.approx(one.low, abs=1e-12)
        assert found.highs[row] == pytest.approx(one.high, abs=1e-12)
        assert found.variances[row] == pytest.approx(one.variance, rel=1e-9)


@pytest.mark.parametrize("freedom", [1, 2, 3, 9, 19, 99, 2000, 2001, 50_000])
def test_students_quantile_is_scipys(freedom):
    assert student_975(freedom) == pytest.approx(student.ppf(0.975, freedom), rel=1e-6)


def log10_of(percent):
    return math.log10(1 + percent / 100)


@pytest.mark.parametrize(
    ("participants", "trials", "percent"), [(10, 60, 27), (20, 60, 17), (20, 100, 15)]
)  # thresholds of people who differ by a factor of 1.2, with a standard deviation of 28 % at 60 trials
def test_a_groups_interval_is_students_over_errors_and_people(participants, trials, percent):
    one = Expected("log", 60, 1, log10_of(90), 0.28 / math.log(10), 0.2)
    assert 100 * one.of_group(participants, trials) == pytest.approx(percent, abs=1.5)


def test_standards_average_the_errors_but_not_the_people():
    one, four = (Expected("log", 60, standards, 0.3, 0.12, 0.2) for standards in (1, 4))
    errors = 0.12**2 * np.array([1, 0.25]) + math.log10(1.2) ** 2
    halves = np.log10([1 + one.of_group(20), 1 + four.of_group(20)])
    assert halves == pytest.approx(student.ppf(0.975, 19) * np.sqrt(errors / 20))


def test_linear_spacing_gives_a_share_of_the_threshold():
    one = Expected("linear", 60, 1, 8.0, 4.0, 50.0)
    half = student.ppf(0.975, 9) * math.sqrt((4.0**2 + (50 * math.log(1.2)) ** 2) / 10)
    assert one.of_group(10) == pytest.approx(half / 50)
    assert one.factor is None


def test_the_fewest_participants_and_trials_for_a_precision():
    one = Expected("log", 20, 1, 0.5, 0.2, 0.2)
    people = one.participants_for(0.15)
    assert one.of_group(people) <= 0.15 < one.of_group(people - 1)
    trials = one.trials_for(0.15, 20)
    assert one.of_group(20, trials) <= 0.15 < one.of_group(20, trials - 10)
    assert one.trials_for(0.05, 10) is None  # people differ by more
    assert one.participants_for(0.001) is None
    assert one.of_group(1) == math.inf

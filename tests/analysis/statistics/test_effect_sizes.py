"""Standardised effects and Bayes factors beside published values, and how often their intervals hold."""

import math

import numpy as np
import pytest
from scipy.stats import binomtest, norm

from study_app.analysis.statistics.effect_sizes import (
    LARGEST_LOG,
    cliffs_delta,
    d_z,
    hedges_g,
    jzs_bayes_factor,
    paired_delta,
)

SLEEP = np.array([0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0])
SLEEP_2 = np.array([1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4])
"""Hours of sleep gained under two drugs (Student 1908)."""


def test_d_of_a_published_example() -> None:
    """Student's sleep data, in the documentation of the R package effectsize: d = −1.28 [−2.12, −0.41]."""
    effect = d_z(SLEEP - SLEEP_2)
    assert effect is not None
    assert [round(number, 2) for number in (effect.value, effect.low, effect.high)] == [-1.28, -2.12, -0.41]
    assert d_z(np.ones(5)) is None


def test_g_of_two_groups_is_the_corrected_difference() -> None:
    effect = hedges_g(np.array([1.0, 2.0, 3.0]), np.array([3.0, 4.0, 5.0]))
    assert effect is not None
    # Mean difference −2, pooled SD 1, four degrees of freedom: J = Γ(2) / (√2 Γ(1.5)).
    assert effect.value == pytest.approx(-2 / (math.sqrt(2) * math.gamma(1.5)))
    assert effect.low < effect.value < effect.high


@pytest.mark.parametrize(
    ("t", "sizes", "factor"),
    [(3.5, (20, 20), 26.743), (3.5, (20,), 17.185), (-4.0621, (10,), 17.259)],
    ids=["pingouin, two groups", "pingouin, paired", "R package BayesFactor, Student's sleep data"],
)
def test_bayes_factors_are_those_published(t: float, sizes: tuple[int, ...], factor: float) -> None:
    assert jzs_bayes_factor(t, *sizes) == pytest.approx(factor, rel=1e-3)


def test_delta_is_counted() -> None:
    first, second = np.array([1.0, 2.0, 5.0, 7.0]), np.array([2.0, 3.0])
    effect = cliffs_delta(first, second)
    assert effect is not None
    assert effect.value == (4 - 3) / 8  # 5 and 7 are above both; 1 below both, 2 below one and equal to the other
    paired = paired_delta(np.array([1.0, 2.0, 0.0, -1.0]))
    assert paired is not None
    assert paired.value == 1 / 4
    all_higher = paired_delta(np.ones(10))
    assert all_higher is not None
    assert (all_higher.value, all_higher.high) == (1.0, 1.0)
    assert all_higher.low == pytest.approx(2 * binomtest(10, 10).proportion_ci(method="exact").low - 1)
    assert paired_delta(np.zeros(12)) is None


def test_a_bayes_factor_that_overflows_is_the_largest_float() -> None:
    assert jzs_bayes_factor(1e8, 60) == jzs_bayes_factor(60.0, 2000) == math.exp(LARGEST_LOG)


def test_intervals_hold_as_often_as_they_claim() -> None:
    """The true delta of normal groups is 2 Φ(d / √2) − 1, that of paired differences 2 Φ(d) − 1."""
    draw, studies, d = np.random.default_rng(7), 400, 0.8
    times_covered = np.zeros(4)
    for _ in range(studies):
        first, second = draw.normal(d, 1, 15), draw.normal(0, 1, 15)
        intervals = (d_z(first), hedges_g(first, second), cliffs_delta(first, second), paired_delta(first))
        true = (d, d, 2 * norm.cdf(d / math.sqrt(2)) - 1, 2 * norm.cdf(d) - 1)
        times_covered += [
            interval is not None and interval.low <= value <= interval.high
            for interval, value in zip(intervals, true, strict=True)
        ]
    assert (times_covered / studies >= 0.92).all(), times_covered / studies

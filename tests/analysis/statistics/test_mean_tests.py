"""Tests of means: t together with the bootstrap, weights, and groups that differ in size and spread."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import beta, binom, skew, ttest_1samp
from scipy.stats import t as student

from study_app.analysis.statistics.mean_tests import Means, means_of, p_differs
from study_app.analysis.statistics.thresholds import group_mean, random_effects_weights

STUDIES = 1000
AT_MOST = binom.ppf(0.999, STUDIES, 0.06) / STUDIES


def false_rate(means: Means) -> float:
    return float((np.max(p_differs(means, "two-sided"), axis=0) <= 0.05).mean())


def test_t_is_students_and_the_bootstrap_counts_a_further_participant() -> None:
    values = np.array([[5.0] + [-1.0] * 19, np.arange(20.0)])
    means = means_of(values)
    expected = ttest_1samp(values, 0.0, axis=1)
    assert means.t() == pytest.approx(expected.statistic)
    assert p_differs(means, "two-sided")[0] == pytest.approx(expected.pvalue)
    # The two at 5, one of them the further one, have a weight of Beta(2, 19): the mean is at 0 or above from 1 / 6 on.
    below = means.opposite().p_bootstrap()
    assert below[0] == pytest.approx(beta.sf(1 / 6, 2, 19), abs=0.02)
    low, high = means.interval(0.95)
    assert (low[1], high[1]) == pytest.approx(tuple(expected.confidence_interval(0.95)[end][1] for end in (0, 1)))


def test_the_p_for_skewness_is_that_of_halls_transformation() -> None:
    values = np.random.default_rng(5).exponential(size=(3, 11)) - 0.4
    t, skewness = ttest_1samp(values, 0.0, axis=1).statistic, skew(values, axis=1, bias=False) / math.sqrt(11)
    transformed = ((1 + skewness * t / 3) ** 3 - 1) / skewness + skewness / 6
    means = means_of(values)
    assert p_differs(means, "greater").skewed == pytest.approx(student.sf(transformed, 10))
    assert p_differs(means, "less").skewed == pytest.approx(student.cdf(transformed, 10))
    assert p_differs(means_of(-values), "greater").skewed == pytest.approx(student.cdf(transformed, 10))


def test_weighted_means_are_those_of_the_random_effects_model() -> None:
    estimates, variances = np.array([-0.2, 0.1, 0.3, 0.4, 0.5]), np.array([0.05, 0.01, 0.02, 0.04, 0.2])
    group = group_mean(estimates.tolist(), variances.tolist())
    means = means_of(estimates[None], random_effects_weights(estimates, variances)[0])
    low, high = means.interval(0.95)
    assert (means.mean[0], low[0], high[0]) == pytest.approx((group.mean, group.low, group.high))


def test_two_groups_have_the_degrees_of_freedom_of_the_smaller_one() -> None:
    first, second = np.array([[1.0, 4.0, 2.5]]), np.array([[0.0, 1.0, 0.5, 0.25, 0.75]])
    t = (first.mean() - second.mean()) / math.sqrt(first.var(ddof=1) / 3 + second.var(ddof=1) / 5)
    difference = means_of(first) - means_of(second, group=1)
    assert difference.t()[0] == pytest.approx(t)
    assert p_differs(difference, "greater")[0][0] == pytest.approx(student.sf(t, 2))
    assert p_differs(difference, "less")[0][0] == pytest.approx(student.cdf(t, 2))


@pytest.mark.slow
@pytest.mark.parametrize("n", [8, 12, 20, 30])
@pytest.mark.parametrize("opposite", [1.0, -1.0])
def test_skewed_differences_of_mean_zero_are_rarely_significant(n: int, opposite: float) -> None:
    """One in six is 5 points higher, the others one lower; samples of 8 are often equal and then not tested."""
    values = opposite * np.where(np.random.default_rng(n).random((STUDIES, n)) < 1 / 6, 5.0, -1.0)
    values = values[np.ptp(values, axis=1) > 0]
    assert false_rate(means_of(values)) <= AT_MOST


@pytest.mark.slow
@pytest.mark.parametrize("n", [8, 12, 20, 30])
def test_exponential_differences_of_mean_zero_are_rarely_significant(n: int) -> None:
    values = np.random.default_rng([n, 7]).exponential(size=(STUDIES, n)) - 1
    assert false_rate(means_of(values)) <= AT_MOST


@pytest.mark.slow
@pytest.mark.parametrize(("n", "other"), [(2, 6), (3, 5), (4, 8), (8, 4), (10, 20), (6, 6)])
@pytest.mark.parametrize("ratio", [1, 3, 6])
def test_groups_that_differ_only_in_spread_and_size_are_rarely_significant(n: int, other: int, ratio: float) -> None:
    rng = np.random.default_rng([n, other, int(ratio)])
    first, second = ratio * rng.normal(size=(STUDIES, n)), rng.normal(size=(STUDIES, other))
    assert false_rate(means_of(first) - means_of(second, group=1)) <= AT_MOST


@pytest.mark.slow
@pytest.mark.parametrize(("n", "shift", "least"), [(8, 1.5, 0.84), (12, 0.8, 0.6), (20, 0.8, 0.88)])
def test_the_power_for_normal_answers_is_close_to_that_of_the_t_test(n: int, shift: float, least: float) -> None:
    values = np.random.default_rng(n).normal(shift, 1.0, (STUDIES, n))
    by_t: Callable[[float], float] = lambda alpha: float((ttest_1samp(values, 0, axis=1).pvalue <= alpha).mean())  # noqa: E731
    assert least <= false_rate(means_of(values)) <= by_t(0.05)

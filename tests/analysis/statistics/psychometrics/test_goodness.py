"""Deviance, its simulated distribution, and drift over trials."""

import math

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from study_app.analysis.statistics.psychometrics.goodness import deviances, drift, drifts, p_of_fit
from study_app.analysis.statistics.psychometrics.settings import setting_statistics

PSI = np.array([0.55, 0.7, 0.85, 0.95])
N = np.array([40, 40, 40, 40])


def test_deviance_is_that_worked_by_hand_and_0_where_shares_are_as_expected() -> None:
    assert deviances([20], [40], [0.75]) == pytest.approx(2 * (20 * math.log(2 / 3) + 20 * math.log(2)))
    assert deviances(N * 0.5, N, np.full(4, 0.5)) == pytest.approx(np.zeros(4))
    assert deviances([0, 40], [40, 40], [0.5, 0.5]) == pytest.approx([80 * math.log(2)] * 2)


@pytest.mark.slow
def test_p_of_fit_is_uniform_where_the_function_is_true() -> None:
    draw = np.random.default_rng(7)
    found = np.array([p_of_fit(draw.binomial(N, PSI), N, PSI) for _ in range(400)])
    assert (found < 0.05).mean() == pytest.approx(0.05, abs=0.035)
    assert found.mean() == pytest.approx(0.5, abs=0.06)


def test_p_of_fit_is_small_where_answers_do_not_follow_the_function_and_the_same_again() -> None:
    assert p_of_fit([36, 12, 36, 20], N, PSI) == 1 / 1000
    assert p_of_fit([24, 27, 36, 38], N, PSI) == p_of_fit([24, 27, 36, 38], N, PSI) > 0.3


def test_drift_is_positive_where_answers_become_better_and_near_0_where_they_do_not() -> None:
    draw, n = np.random.default_rng(2), 400
    psi = np.full(n, 0.75)
    better = draw.random(n) < np.linspace(0.55, 0.95, n)
    steady = draw.random(n) < psi
    assert drift(better, psi) > 2 / math.sqrt(n)
    assert drift(~better[::-1], psi) > 2 / math.sqrt(n)
    assert abs(drift(steady, psi)) < 2 / math.sqrt(n)
    assert drift(np.ones(n, bool), psi) is None
    assert [drifts(drift(answers, psi), n) for answers in (better, steady, np.ones(n, bool))] == [True, False, False]


def test_four_settings_worked_by_hand() -> None:
    found = setting_statistics(np.array([7.0, 5.0, 8.0, 6.0]), np.array([True, False, True, False]))
    assert (found.n, found.pse, found.hysteresis) == (4, 6.5, 2.0)
    assert found.jnd == pytest.approx(math.sqrt(5 / 3))  # (0.5² + 1.5² + 1.5² + 0.5²)/3
    half = 3.182446305 * math.sqrt(5 / 3) / 2
    assert (found.low, found.high) == pytest.approx((6.5 - half, 6.5 + half))


def test_the_interval_is_that_of_a_t_test() -> None:
    u = np.random.default_rng(1).normal(0.8, 0.1, 20)
    found = setting_statistics(u, np.arange(20) % 2 == 0)
    interval = ttest_1samp(u, 0.0).confidence_interval()
    assert (found.low, found.high) == pytest.approx((interval.low, interval.high))
    assert found.hysteresis == pytest.approx(u[::2].mean() - u[1::2].mean())


def test_a_single_setting_has_no_scatter_and_one_end_no_hysteresis() -> None:
    one = setting_statistics(np.array([3.0]), np.array([True]))
    assert (one.n, one.pse, one.low, one.high, one.jnd, one.hysteresis) == (1, 3.0, None, None, None, None)
    assert setting_statistics(np.array([3.0, 4.0]), np.array([False, False])).hysteresis is None

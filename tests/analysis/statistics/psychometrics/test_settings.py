"""Settings worked by hand: mean, standard deviation, interval and hysteresis."""

import math

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from study_app.analysis.statistics.psychometrics.settings import setting_statistics


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

"""Deviance, its simulated distribution, and drift over trials."""

import math

import numpy as np
import pytest

from study_app.analysis.statistics.psychometrics.goodness import deviances, drift, drifts, p_of_fit

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

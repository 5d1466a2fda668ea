from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom, page_trend_test, spearmanr, wilcoxon

from study_app.analysis.statistics import trend_tests
from study_app.analysis.statistics.rank_tests import signed_rank_test
from study_app.analysis.statistics.trend_tests import step_down, trend
from study_app.errors import AnalysisError

# Siegel & Castellan, p. 186.
SIEGEL_TEXT = "797 873 888 923 942 956 794 772 908 982 946 913 838 801 853 951 883 837 815 801 747 859 887 902"
SIEGEL = np.array(SIEGEL_TEXT.split(), dtype=float).reshape(4, 6)
DELAYS = (0, 50, 75, 100, 125, 150, 200)
answers = st.lists(st.lists(st.integers(1, 4), min_size=4, max_size=4), min_size=1, max_size=3)


@given(answers)
@settings(max_examples=40, deadline=None)
def test_the_exact_p_is_that_of_all_rearrangements(rows: list[list[int]]) -> None:
    result = trend(rows)
    if result.p_page is None:
        assert result.note.startswith("no variation")
        return
    ranks = trend_tests.doubled_ranks(np.array(rows, dtype=float))
    sums = [sum(place * rank for place, rank in enumerate(row, start=1)) for row in ranks]
    each = [[sum(p * r for p, r in enumerate(order, start=1)) for order in permutations(row)] for row in ranks]
    every = np.array([sum(rearranged) for rearranged in product(*each)])
    assert result.statistic == sum(sums) / 2
    assert result.p_page == pytest.approx((every >= sum(sums)).mean())
    away = np.array([2 * total - 4 * 25 for total in sums]) / 2
    flipped = np.array(list(product([1, -1], repeat=len(away)))) @ away
    assert result.p == pytest.approx((flipped >= away.sum()).mean())


def test_individual_trends_around_zero_are_not_a_common_trend() -> None:
    """Page's null hypothesis is that nobody has a trend; the test decides about the population."""
    rng = np.random.default_rng(3)
    times_shown = dict.fromkeys(("trend", "page"), 0)
    for _ in range(300):
        slopes = rng.normal(size=(12, 1)) * np.linspace(-2.5, 2.5, 7)
        result = trend(np.rint(4 + slopes + rng.normal(size=(12, 7))), seed=None)
        assert result.p is not None
        assert result.p_page is not None
        times_shown["trend"] += result.p <= 0.05
        times_shown["page"] += result.p_page <= 0.05
    assert times_shown["trend"] <= binom.ppf(0.999, 300, 0.05)
    assert times_shown["page"] > binom.ppf(0.999, 300, 0.10)


def test_the_effect_is_the_mean_rank_correlation() -> None:
    result = trend(SIEGEL)
    assert result.effect == pytest.approx(np.mean([spearmanr(row, range(6)).statistic for row in SIEGEL]))
    assert result.interval is None
    assert "fewer than 10 participants" in result.no_interval
    assert trend([[1, 2, 3]] * 12).no_interval == "no interval: all participants have the same correlation"


def test_ties_lower_the_effect_and_change_its_name() -> None:
    answers = [[1, 1, 2, 4], [2, 3, 3, 3], [1, 2, 5, 4]]
    result = trend(answers)
    # Sums of (rank - 2.5) (place - 2.5): 4.5, 3 and 4, of at most 5.
    assert result.effect == pytest.approx((4.5 + 3 + 4) / 15)
    assert result.effect < np.mean([spearmanr(row, range(4)).statistic for row in answers])
    assert result.effect_name.endswith("not corrected for ties")


def test_many_people_are_approximated_as_scipy_does() -> None:
    rng = np.random.default_rng(2)
    values = np.argsort(rng.random((trend_tests.EXACT_UP_TO + 1, 5)), axis=1).astype(float)
    result = trend(values)
    expected = page_trend_test(values, method="asymptotic")
    assert result.p_page == pytest.approx(expected.pvalue)
    assert result.statistic == expected.statistic
    exact = trend(values[:-1])
    approximate = page_trend_test(values[:-1], method="asymptotic").pvalue
    assert exact.p_page == pytest.approx(approximate, rel=0.01)


def test_step_down_finds_the_lowest_delay_that_shows() -> None:
    rng = np.random.default_rng(0)
    truth = np.array([1, 1, 1, 1, 2, 4, 6])
    values = np.clip(truth + rng.integers(0, 2, (12, 7)), 1, 7)
    result = step_down(values, DELAYS)
    assert result.lowest_ms in {125, 150}
    assert [step.longest_ms for step in result.steps][:2] == [200, 150]
    for step in result.steps:
        columns = DELAYS.index(step.longest_ms) + 1
        assert step.trend.p == trend(values[:, :columns]).p
        assert (step.trend.p <= 0.05) == (step.longest_ms >= result.lowest_ms)  # type: ignore[operator]
    assert "upper bound" in result.note


def test_step_down_stops_at_the_first_failure_even_if_a_later_one_would_do() -> None:
    # A clear rise up to 75 ms, and a fall after it that hides it.
    values = np.tile([1, 3, 5, 4, 3, 2, 1], (10, 1))
    result = step_down(values, DELAYS)
    assert result.lowest_ms is None
    assert len(result.steps) == 1
    assert trend(values[:, :3]).p < 0.001  # type: ignore[operator]
    assert "this is not evidence that there is none" in result.note


def test_the_step_down_test_rarely_finds_a_delay_without_a_trend() -> None:
    rng = np.random.default_rng(7)
    are_found = [step_down(rng.integers(1, 8, (5, 7)), DELAYS).lowest_ms is not None for _ in range(300)]
    assert np.mean(are_found) <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 300)


def test_bad_delays_and_a_single_setting_are_refused() -> None:
    with pytest.raises(AnalysisError, match="must be 2 increasing values"):
        step_down(np.ones((3, 2)), (50, 0))
    with pytest.raises(AnalysisError, match="must be 2 increasing values"):
        step_down(np.ones((3, 2)), (0, 50, 100))
    with pytest.raises(AnalysisError, match="at least 2"):
        trend(np.ones((3, 1)))


def test_many_pairs_are_approximated_closely() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.integers(1, 8, (2, 400)).astype(float)
    result = signed_rank_test(x, y)
    assert result.smallest_p is None
    assert result.p == pytest.approx(wilcoxon(x - y, method="asymptotic", correction=False).pvalue)

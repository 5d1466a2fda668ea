import math
from itertools import product

import numpy as np
import pytest
from scipy.stats import mannwhitneyu, wilcoxon
from scipy.stats import t as t_distribution

from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.paired import cliffs_delta
from study_app.errors import AnalysisError

# Hours of sleep gained by ten patients with two drugs (Student 1908; R, sleep).
FIRST = np.array([0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0, 2.0])
SECOND = np.array([1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4])


def test_published_sleep_data() -> None:
    result = tost(FIRST - SECOND, 0.5)
    assert result.t == pytest.approx(-4.0621, abs=1e-4)
    assert result.p_different == pytest.approx(0.002833, abs=1e-6)
    assert (result.t_lower, result.p_lower) == pytest.approx((-2.7766, 0.98924), abs=5e-5)
    assert result.t_upper == pytest.approx(-5.3476, abs=5e-5)
    assert result.p_upper == pytest.approx(0.00023190, abs=5e-9)
    assert result.p == pytest.approx(0.98924, abs=5e-6)
    assert result.interval is not None
    assert (result.interval.low, result.interval.high) == pytest.approx((-2.2930, -0.8670), abs=5e-5)
    assert result.interval.level == pytest.approx(0.9)
    assert result.verdict == "different"


@pytest.mark.parametrize(
    ("shift", "alternative", "w", "p"),
    [(0.0, "two-sided", 25.5, 0.069328), (0.5, "greater", 34.0, 0.893853), (-0.5, "less", 20.0, 0.012874)],
)
def test_published_sleep_data_as_two_independent_groups_by_ranks(
    shift: float, alternative: str, w: float, p: float
) -> None:
    # No study here has independent groups: W follows from our delta of two groups, its approximate p is scipy's.
    delta = cliffs_delta(FIRST + shift, SECOND)
    assert delta is not None
    assert (delta + 1) / 2 * len(FIRST) * len(SECOND) == pytest.approx(w)
    theirs = mannwhitneyu(FIRST + shift, SECOND, alternative=alternative, method="asymptotic", use_continuity=True)
    assert (theirs.statistic, theirs.pvalue) == (pytest.approx(w), pytest.approx(p, abs=5e-7))
    assert cliffs_delta(FIRST, SECOND) == pytest.approx(-0.49)


@pytest.mark.parametrize("seed", range(6))
def test_the_verdict_is_that_of_the_interval(seed: int) -> None:
    rng = np.random.default_rng(seed)
    differences = rng.normal(rng.choice([0, 0.6]), 0.7, 20)
    result = tost(differences, 0.5)
    assert result.interval is not None
    inside = result.interval.low > -0.5 and result.interval.high < 0.5
    assert (result.verdict == "equivalent") == inside
    assert result.interval.low + result.interval.high == pytest.approx(2 * differences.mean())


def test_few_people_who_differ_little_are_inconclusive_and_told_how_many_it_takes() -> None:
    result = tost([1, -1, 0, 2, -1], 1.0)
    assert result.verdict == "inconclusive"
    assert result.note == "neither a difference nor equivalence is shown"
    assert result.sd is not None
    assert result.n_needed is not None
    assert result.n_needed > math.ceil(8.6 * result.sd**2)
    # The rule of thumb for many, 8.6 (spread / bound)²: 48 where differences spread by 2.36 points and the bound is 1.
    rng = np.random.default_rng(0)
    spread = rng.normal(size=100)
    spread = (spread - spread.mean()) / spread.std(ddof=1) * 2.36
    assert tost(spread, 1.0).n_needed in (48, 49, 50)


@pytest.mark.parametrize("spread", [0.3, 0.5, 0.9, 1.2, 2.0])
def test_so_many_participants_have_the_power_that_is_told(spread: float) -> None:
    # The rule of thumb would tell 2 participants for a spread of half a point, whom no answers could suffice.
    needed = tost(np.array([1.0, -1.0] * 5) * spread * math.sqrt(0.9), 1.0).n_needed
    assert needed is not None
    assert needed >= 5
    drawn = np.random.default_rng(needed).normal(0, spread, (20_000, needed))
    error = drawn.std(axis=1, ddof=1) / math.sqrt(needed)
    shown = np.abs(drawn.mean(axis=1)) + t_distribution.ppf(0.95, needed - 1) * error < 1
    assert shown.mean() > 0.78


def test_a_small_but_certain_difference_can_be_equivalent() -> None:
    result = tost(np.tile([0.2, 0.3], 10), 0.5)
    assert result.verdict == "equivalent"
    assert result.note == "different from 0, but within the bound"
    assert result.checks_agree


def test_the_permutation_check_goes_through_all_signs() -> None:
    differences = np.array([0.5, -0.5, 0.0, 1.0, 0.5, 0.0])
    result = tost(differences, 1.0)

    def p(shifted: np.ndarray) -> float:
        every = [np.dot(signs, shifted) for signs in product((1, -1), repeat=len(shifted))]
        return float(np.mean(np.array(every) >= shifted.sum() - 1e-9))

    assert result.p_permutation == pytest.approx(max(p(differences + 1), p(1 - differences)))


def test_the_rank_check_shifts_by_the_bound_to_both_sides() -> None:
    differences = FIRST - SECOND + 0.01 * np.arange(10)
    below = wilcoxon(differences + 2, alternative="greater", method="exact").pvalue
    above = wilcoxon(differences - 2, alternative="less", method="exact").pvalue
    assert tost(differences, 2.0).p_ranks == pytest.approx(max(below, above))
    # One of three lies on the bound and two about it.
    assert tost([0.0, 1.0, 2.0], 1.0).p_ranks == pytest.approx(0.75)


def test_many_people_have_drawn_signs_that_can_be_repeated() -> None:
    rng = np.random.default_rng(1)
    differences = rng.normal(0.1, 0.6, 30)
    result = tost(differences, 0.5, seed=2)
    assert result == tost(differences, 0.5, seed=2)
    assert result.p is not None
    assert result.p_permutation == pytest.approx(result.p, abs=0.004)


def test_equal_differences_are_told_and_not_divided_by() -> None:
    result = tost([0.0] * 5, 1.0)
    assert (result.verdict, result.p, result.effect) == ("inconclusive", None, 0.0)
    assert "no spread" in result.note
    nobody = tost([np.nan, np.nan], 1.0)
    assert (nobody.n, nobody.dropped, nobody.effect) == (0, 2, None)
    assert tost([1.0], 1.0).verdict == "inconclusive"


def test_missing_differences_are_dropped() -> None:
    result = tost([*(FIRST - SECOND), np.nan], 0.5)
    assert (result.n, result.dropped) == (10, 1)
    assert result.p == pytest.approx(0.98924, abs=5e-6)


@pytest.mark.parametrize("bound", [0, -1, np.nan, np.inf])
def test_a_bound_that_means_nothing_is_refused(bound: float) -> None:
    with pytest.raises(AnalysisError, match="bound of equivalence"):
        tost([1.0, 2.0], bound)


@pytest.mark.parametrize(("n", "power"), [(5, 0.02), (20, 0.17), (30, 0.47)])
def test_published_power_at_no_difference(n: int, power: float) -> None:
    # Paired differences of whole answers whose spread is 2.36 points; the bound is 1.
    rng = np.random.default_rng(n)
    shown = [tost(rng.normal(0, 2.36, n), 1.0, checks=False).verdict == "equivalent" for _ in range(1000)]
    assert np.mean(shown) == pytest.approx(power, abs=0.05)

from itertools import product

import numpy as np
import pytest
from scipy.stats import binom, wilcoxon

from study_app.analysis.statistics.equivalence import tost
from study_app.errors import AnalysisError

# Hours of sleep gained by ten patients with two drugs (Student 1908; R, sleep).
FIRST = np.array([0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0, 2.0])
SECOND = np.array([1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4])


@pytest.mark.slow
@pytest.mark.parametrize(("n", "others"), list(product((5, 12, 24), ((0,), (-1, 0, 1)))))
def test_where_a_few_notice_strongly_equivalence_is_seldom_shown(n: int, others: tuple[int, ...]) -> None:
    # One in five answers five points higher: the mean lies on the bound.
    rng = np.random.default_rng(n)
    shown = 0
    for _ in range(400):
        strong = rng.random(n) < 0.2
        found = tost(np.where(strong, 5.0, rng.choice(others, n)), 1.0)
        shown += found.verdict == "equivalent"
        assert found.beyond is not None
        assert found.beyond.count == strong.sum()
    assert shown <= binom.ppf(0.999, 400, 0.05)


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


@pytest.mark.parametrize("bound", [0, -1, np.nan, np.inf])
def test_a_bound_that_means_nothing_is_refused(bound: float) -> None:
    with pytest.raises(AnalysisError, match="bound of equivalence"):
        tost([1.0, 2.0], bound)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "power"), [(5, 0.02), (20, 0.17), (30, 0.47)])
def test_published_power_at_no_difference(n: int, power: float) -> None:
    # Paired differences of whole answers whose spread is 2.36 points; the bound is 1.
    rng = np.random.default_rng(n)
    shown = [tost(rng.normal(0, 2.36, n), 1.0, checks=False).verdict == "equivalent" for _ in range(1000)]
    assert np.mean(shown) == pytest.approx(power, abs=0.05)

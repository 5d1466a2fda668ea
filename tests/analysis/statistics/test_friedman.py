from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import friedmanchisquare

from study_app.analysis.statistics import rank_tests as module
from study_app.analysis.statistics.rank_tests import friedman, global_permutation

# scipy's documentation: ten people, three conditions, whole scores with ties.
SCORES = np.array([[4, 6, 3, 4, 3, 2, 2, 7, 6, 5], [5, 6, 8, 7, 7, 8, 4, 6, 4, 5], [2, 4, 4, 3, 2, 2, 1, 4, 3, 2]]).T
answers = st.integers(2, 4).flatmap(
    lambda n: st.lists(st.lists(st.integers(1, 7), min_size=3, max_size=3), min_size=n, max_size=n)
)


@pytest.mark.slow
@given(answers)
@settings(max_examples=40, deadline=None)
def test_the_exact_p_is_that_of_all_rearrangements(rows: list[list[int]]) -> None:
    result = friedman(rows)
    if result.p is None:
        assert result.note.startswith("no variation")
        return
    ranks = module.doubled_ranks(np.array(rows, dtype=float))

    def squares(chosen: tuple[tuple[int, ...], ...]) -> float:
        return float(((np.sum(chosen, axis=0) - len(rows) * 4) ** 2).sum())

    sums = squares(tuple(map(tuple, ranks)))
    every = [squares(rearranged) for rearranged in product(*(list(permutations(row)) for row in ranks))]
    assert result.p == pytest.approx(np.mean([value >= sums for value in every]))
    assert result.smallest_p == pytest.approx(np.mean([value == max(every) for value in every]))


def test_a_drawn_p_is_repeatable_and_near_the_exact_one(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = friedman(SCORES)
    module.friedman_distribution.cache_clear()
    monkeypatch.setattr(module, "WORK", 0)
    random_result = friedman(SCORES[:, ::-1], seed=3)
    assert random_result == friedman(SCORES[:, ::-1], seed=3)
    module.friedman_distribution.cache_clear()
    assert random_result.method == "Monte Carlo permutation, 9999 draws, seed 3"
    # As extreme counts: three who agree are one of 36, the most extreme there is.
    assert friedman([[1, 4, 7]] * 3).p == pytest.approx(1 / 36, abs=0.008)
    module.friedman_distribution.cache_clear()
    assert exact.p is not None
    assert random_result.p is not None
    assert abs(random_result.p - exact.p) < 5 * np.sqrt(exact.p / 9999) + 1e-4


@pytest.mark.slow
def test_seven_settings_are_drawn_and_many_people_approximated() -> None:
    rng = np.random.default_rng(0)
    seven = friedman(rng.integers(1, 8, (5, 7)))
    assert seven.method.startswith("Monte Carlo")
    assert seven.smallest_p == 1 / 10000
    for k in (3, 7):
        many = friedman(rng.integers(1, 8, (300, k)), draws=499)
        assert many.method == "chi-square approximation, corrected for ties (always used above 200 participants)"
        assert (many.p, many.smallest_p) == (many.p_chi2, None)


def made_up(items: int, n: int, k: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(1, 8, (items, n, k)).astype(float)


@pytest.mark.nightly
@pytest.mark.slow
def test_the_exact_p_is_that_of_relabelling_whole_participants() -> None:
    values = made_up(3, 4, 3)
    orders = list(permutations(range(3)))

    def statistic(chosen: tuple[tuple[int, ...], ...]) -> float:
        relabelled = np.stack([values[:, person][:, list(order)] for person, order in enumerate(chosen)], axis=1)
        return float(sum(friedmanchisquare(*item.T).statistic for item in relabelled))

    every = np.array([statistic(relabelling) for relabelling in product(orders, repeat=4)])
    result = global_permutation(values)
    assert result.method == "exact permutation"
    assert result.statistic == pytest.approx(every[0])
    assert result.p == pytest.approx((every >= every[0] - 1e-9).mean())
    assert result.smallest_p == pytest.approx((every >= every.max() - 1e-9).mean())

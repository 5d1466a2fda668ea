from itertools import permutations, product

import numpy as np
import pytest
from scipy.stats import friedmanchisquare

from study_app.analysis.statistics.friedman import friedman
from study_app.analysis.statistics.global_permutation import global_permutation
from study_app.errors import AnalysisError


def made_up(items: int, n: int, k: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(1, 8, (items, n, k)).astype(float)


def test_one_statement_is_friedmans_test() -> None:
    values = made_up(1, 5, 3)
    both = global_permutation(values), friedman(values[0])
    assert both[0].statistic == pytest.approx(both[1].statistic)
    assert both[0].p == pytest.approx(both[1].p)
    assert both[0].smallest_p == pytest.approx(both[1].smallest_p)
    assert both[0].effect == pytest.approx(both[1].effect)


@pytest.mark.nightly
@pytest.mark.slow
def test_the_exact_p_is_that_of_relabelling_whole_participants() -> None:
    values = made_up(3, 4, 3)
    orders = list(permutations(range(3)))

    def statistic(chosen: tuple[tuple[int, ...], ...]) -> float:
        moved = np.stack([values[:, person][:, list(order)] for person, order in enumerate(chosen)], axis=1)
        return float(sum(friedmanchisquare(*item.T).statistic for item in moved))

    every = np.array([statistic(chosen) for chosen in product(orders, repeat=4)])
    result = global_permutation(values)
    assert result.method == "exact permutation"
    assert result.statistic == pytest.approx(every[0])
    assert result.p == pytest.approx((every >= every[0] - 1e-9).mean())
    assert result.smallest_p == pytest.approx((every >= every.max() - 1e-9).mean())


def test_statements_that_say_the_same_give_one_answer_and_not_a_stronger_one() -> None:
    one = made_up(1, 5, 3, seed=4)
    assert global_permutation(np.repeat(one, 9, axis=0)).p == pytest.approx(global_permutation(one).p)


def test_small_shifts_in_all_statements_add_up() -> None:
    rng = np.random.default_rng(5)
    values = np.clip(rng.integers(2, 6, (9, 12, 3)) + np.array([0, 0, 1]), 1, 7).astype(float)
    result = global_permutation(values)
    singles = [friedman(item).p for item in values]
    assert result.p is not None
    assert result.p < min(p for p in singles if p is not None)
    assert result.method.startswith("Monte Carlo")
    assert result == global_permutation(values)


def test_relabelling_the_settings_changes_nothing() -> None:
    values = made_up(4, 6, 3, seed=2)
    assert global_permutation(values).p == pytest.approx(global_permutation(values[:, :, [2, 0, 1]]).p)


def test_a_missing_answer_leaves_out_one_row_and_not_the_participant() -> None:
    values = made_up(3, 5, 3)
    values[1, 2, 0] = np.nan
    values[:, 4] = np.nan
    result = global_permutation(values)
    assert (result.n, result.dropped, result.incomplete, result.items) == (4, 1, 1, 3)
    kept = [values[0, :4], values[1, [0, 1, 3]], values[2, :4]]
    assert result.statistic == pytest.approx(sum(friedmanchisquare(*rows.T).statistic for rows in kept))


def test_a_statement_without_variation_does_not_count() -> None:
    values = made_up(2, 5, 3)
    values[1] = 4
    result = global_permutation(values)
    assert result.items == 1
    assert result.p == pytest.approx(friedman(values[0]).p)
    flat = global_permutation(np.full((2, 5, 3), 4.0))
    assert (flat.statistic, flat.p, flat.effect) == (None, None, None)
    assert flat.note.startswith("no variation")
    assert global_permutation(np.full((2, 5, 3), np.nan)).note == "no participant completed a statement"


def test_one_setting_is_refused() -> None:
    with pytest.raises(AnalysisError, match="at least 2"):
        global_permutation(np.ones((2, 5, 1)))

from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import f as f_distribution
from scipy.stats import friedmanchisquare

from study_app.analysis.statistics import rank_tests as module
from study_app.analysis.statistics.rank_tests import friedman, global_permutation
from study_app.analysis.statistics.recognition import kappa

# Times to first base of 22 players by three methods (Hollander & Wolfe 1973; R, friedman.test).
TIMES = (
    "5.40 5.50 5.55 5.85 5.70 5.75 5.20 5.60 5.50 5.55 5.50 5.40 5.90 5.85 5.70 5.45 5.55 5.60 "
    "5.40 5.40 5.35 5.45 5.50 5.35 5.25 5.15 5.00 5.85 5.80 5.70 5.25 5.20 5.10 5.65 5.55 5.45 "
    "5.60 5.35 5.45 5.05 5.00 4.95 5.50 5.50 5.40 5.45 5.55 5.50 5.55 5.55 5.35 5.45 5.50 5.55 "
    "5.50 5.45 5.25 5.65 5.60 5.40 5.70 5.65 5.55 6.30 6.30 6.25"
)
BASES = np.array(TIMES.split(), dtype=float).reshape(22, 3)
# scipy's documentation: ten people, three conditions, whole scores with ties.
SCORES = np.array([[4, 6, 3, 4, 3, 2, 2, 7, 6, 5], [5, 6, 8, 7, 7, 8, 4, 6, 4, 5], [2, 4, 4, 3, 2, 2, 1, 4, 3, 2]]).T
# Upper tails of Friedman's statistic without ties: participants, settings, statistic, P.
TAILS = [
    (3, 3, 6.0, 0.02778),
    (4, 3, 8.0, 0.00463),
    (5, 3, 6.4, 0.03935),
    (5, 3, 8.4, 0.00849),
    (6, 3, 7.0, 0.02894),
    (8, 3, 6.25, 0.04691),
    (10, 3, 9.6, 0.00747),
    (3, 4, 7.4, 0.03299),
    (4, 4, 7.8, 0.03639),
    (5, 4, 9.96, 0.00874),
]
answers = st.integers(2, 4).flatmap(
    lambda n: st.lists(st.lists(st.integers(1, 7), min_size=3, max_size=3), min_size=n, max_size=n)
)


def test_published_times_to_first_base() -> None:
    result = friedman(BASES)
    assert result.statistic == pytest.approx(11.142857, abs=1e-6)
    assert (result.df, result.n, result.dropped) == (2, 22, 0)
    assert result.p_chi2 == pytest.approx(0.003805, abs=1e-6)
    assert result.effect == pytest.approx(0.2532468, abs=1e-7)
    assert result.f == pytest.approx(7.1217, abs=1e-4)
    assert result.p_f == pytest.approx(0.002574, abs=1e-6)
    assert result.p_f == pytest.approx(f_distribution.sf(7.1217, 1.909, 40.091), abs=1e-6)
    assert result.method == "exact permutation"


def test_published_whole_scores_with_ties() -> None:
    result = friedman(SCORES)
    assert result.statistic == pytest.approx(13.351351, abs=1e-6)
    assert result.p_chi2 == pytest.approx(0.00126122, abs=1e-8)


def test_five_people_with_ties_give_the_exact_p_and_not_the_approximate_one() -> None:
    result = friedman([[2, 5, 6], [3, 3, 6], [1, 4, 4], [4, 5, 7], [2, 2, 5]])
    assert result.statistic == pytest.approx(8.588235, abs=1e-6)
    assert result.p == pytest.approx(48 / 7776, rel=1e-12)
    assert result.p_chi2 == pytest.approx(0.01364861, abs=1e-8)


@pytest.mark.parametrize(("n", "k", "statistic", "p"), TAILS)
def test_published_exact_tails(n: int, k: int, statistic: float, p: float) -> None:
    exact = module.distribution(((*range(2, 2 * k + 1, 2),),) * n)
    assert exact is not None
    support, tails = exact
    spread = n * k * (k * k - 1) / 3  # of doubled ranks
    at = np.flatnonzero(np.isclose((k - 1) * support / spread, statistic))
    assert tails[at] == pytest.approx([p], abs=6e-6)


@pytest.mark.parametrize(
    ("n", "smallest"),
    [(4, 0.00463), (5, 0.000772), (6, 0.000129), (7, 2.1e-5), (8, 3.6e-6), (10, 9.9e-8), (11, 1.7e-8)],
)
def test_the_smallest_p_of_so_many_people(n: int, smallest: float) -> None:
    result = friedman([[1, 4, 7]] * n)
    assert result.smallest_p == pytest.approx(smallest, rel=0.03)
    assert result.p == result.smallest_p
    assert result.effect == pytest.approx(1.0)


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

    found = squares(tuple(map(tuple, ranks)))
    every = [squares(chosen) for chosen in product(*(list(permutations(row)) for row in ranks))]
    assert result.p == pytest.approx(np.mean([value >= found for value in every]))
    assert result.smallest_p == pytest.approx(np.mean([value == max(every) for value in every]))


@pytest.mark.parametrize(("rows", "n"), [([[4, 4, 4], [2, 2, 2]], 2), (np.empty((0, 3)), 0), ([[1, np.nan, 2]], 0)])
def test_nothing_to_compare_is_said_and_never_nan(rows: object, n: int) -> None:
    result = friedman(rows)  # type: ignore[arg-type]
    assert (result.n, result.statistic, result.p, result.effect) == (n, None, None, None)
    assert result.note


def test_a_drawn_p_is_repeatable_and_near_the_exact_one(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = friedman(SCORES)
    module.distribution.cache_clear()
    monkeypatch.setattr(module, "WORK", 0)
    drawn = friedman(SCORES[:, ::-1], seed=3)
    assert drawn == friedman(SCORES[:, ::-1], seed=3)
    module.distribution.cache_clear()
    assert drawn.method == "Monte Carlo permutation, 9999 draws, seed 3"
    # As extreme counts: three who agree are one of 36, the most extreme there is.
    assert friedman([[1, 4, 7]] * 3).p == pytest.approx(1 / 36, abs=0.008)
    module.distribution.cache_clear()
    assert exact.p is not None
    assert drawn.p is not None
    assert abs(drawn.p - exact.p) < 5 * np.sqrt(exact.p / 9999) + 1e-4


@pytest.mark.slow
def test_seven_settings_are_drawn_and_many_people_approximated() -> None:
    rng = np.random.default_rng(0)
    seven = friedman(rng.integers(1, 8, (5, 7)))
    assert seven.method.startswith("Monte Carlo")
    assert seven.smallest_p == 1 / 10000
    for k in (3, 7):
        many = friedman(rng.integers(1, 8, (300, k)), draws=499)
        assert many.method == "chi-square approximation, corrected for ties, as always above 200 participants"
        assert (many.p, many.smallest_p) == (many.p_chi2, None)


# R package irr, "anxiety": three raters, twenty people.
ANXIETY = ["33345523522615221243", "36462424332333221334", "21443216111233113322"]


def test_published_agreement_of_three_raters() -> None:
    result = friedman([[int(digit) for digit in row] for row in ANXIETY])
    assert result.effect == pytest.approx(0.5396568760, abs=1e-10)
    assert (result.statistic, result.df) == (pytest.approx(30.7604419, abs=1e-7), 19)
    assert result.p_chi2 == pytest.approx(0.0428835, abs=1e-7)


def test_published_kappa() -> None:
    assert kappa([[20, 5], [10, 15]]) == pytest.approx(0.4)


def made_up(items: int, n: int, k: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(1, 8, (items, n, k)).astype(float)


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

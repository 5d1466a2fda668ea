import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import PermutationMethod, wilcoxon

from study_app.analysis.statistics import paired as module
from study_app.analysis.statistics.paired import paired, signed, signed_p
from study_app.errors import AnalysisError

# Depression scores at two visits (Hollander & Wolfe 1973; R, wilcox.test).
FIRST = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30]
SECOND = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29]

levels = st.lists(st.tuples(st.integers(1, 7), st.integers(1, 7)), min_size=1, max_size=9)


def test_published_depression_scores() -> None:
    result = paired(FIRST, SECOND)
    assert result.statistic == 40
    assert result.p == pytest.approx(0.0390625, rel=1e-12)
    assert result.effect == pytest.approx(0.777778, abs=1e-6)
    assert result.interval is not None
    assert (result.interval.low, result.interval.high) == pytest.approx((0.2953631, 0.9441559), abs=1e-6)


def test_published_differences_with_ties_and_zeros() -> None:
    result = paired([0, 1, 1, -1, 2, 2, 3, 0, 1, 1], np.zeros(10))
    assert result.p == pytest.approx(0.046875, rel=1e-12)
    assert (result.n, result.zeros) == (10, 2)
    assert "equal pairs left out" in result.method


def test_published_differences_by_the_normal_approximation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "EXACT_UP_TO", 0)
    result = paired([0, 1, 1, -1, 2, 2, 3, 0, 1, 1], np.zeros(10))
    assert result.p == pytest.approx(0.0310325, abs=5e-8)
    assert "normal approximation, corrected for ties" in result.method


@pytest.mark.parametrize(
    ("n", "smallest"),
    [(4, 0.125), (5, 0.0625), (6, 0.03125), (7, 0.015625), (8, 0.0078125), (10, 0.001953125), (11, 0.0009765625)],
)
def test_the_smallest_p_of_so_many_pairs(n: int, smallest: float) -> None:
    result = paired(np.arange(n) + 2.0, np.ones(n))
    assert result.smallest_p == pytest.approx(smallest, rel=1e-12)
    assert result.p == result.smallest_p
    assert result.reaches(0.05) == (n >= 6)
    assert ("cannot reach p ≤ 0.05" in result.note) == (n < 6)


@pytest.mark.nightly
@pytest.mark.slow
@given(pairs=levels)
@settings(max_examples=25, deadline=None)
def test_the_exact_p_is_that_of_all_signs(pairs: list[tuple[int, int]]) -> None:
    x, y = np.array(pairs, dtype=float).T
    result = paired(x, y)
    if (x == y).all():
        assert result.p is None
        assert "equal" in result.note
        return
    if np.count_nonzero(x - y) < 2:  # scipy refuses to permute a single pair
        assert result.smallest_p == 1.0
        return
    ranks, signs = signed(x - y)
    every = PermutationMethod(n_resamples=10_000)
    for alternative in ("two-sided", "greater", "less"):
        p, _, _ = signed_p(ranks, int(ranks[signs > 0].sum()), alternative)  # type: ignore[arg-type]
        expected = wilcoxon(x - y, zero_method="wilcox", alternative=alternative, method=every)
        assert p == pytest.approx(expected.pvalue)
    assert result.p == signed_p(ranks, int(ranks[signs > 0].sum()))[0]


@given(levels)
@settings(max_examples=25, deadline=None)
def test_reversing_the_scale_turns_the_signs_round_and_nothing_else(pairs: list[tuple[int, int]]) -> None:
    x, y = np.array(pairs, dtype=float).T
    there, back = paired(x, y), paired(8 - x, 8 - y)
    assert there.p == back.p
    assert (there.effect is None and back.effect is None) or there.effect == pytest.approx(-(back.effect or 0.0))
    assert there.superiority == pytest.approx(-(back.superiority or 0.0))


def test_superiority_counts_people_and_not_ranks() -> None:
    result = paired([5, 5, 1, 4], [4, 4, 7, 4])
    assert result.superiority == pytest.approx((2 - 1) / 4)
    assert result.effect == pytest.approx((1.5 + 1.5 - 3) / 6)
    assert result.median_difference == pytest.approx(0.5)


def test_missing_answers_drop_the_pair() -> None:
    result = paired([*FIRST, 1.0, np.nan], [*SECOND, np.nan, 2.0])
    assert (result.n, result.dropped, result.p) == (9, 2, paired(FIRST, SECOND).p)


def test_there_is_no_interval_where_it_would_be_dishonest() -> None:
    few = paired([2, 3, 4, 1, 6], [1, 1, 1, 3, 1])
    assert few.interval is None
    assert "below 6 pairs" in few.no_interval
    alike = paired(np.arange(8) + 2, np.ones(8))
    assert alike.interval is None
    assert alike.no_interval == "no interval: all 8 pairs that differ went one way"
    assert (alike.effect, alike.note) == (1.0, "all 8 pairs that differ went one way")
    nothing = paired([3, 3], [3, 3])
    assert (nothing.statistic, nothing.effect, nothing.no_interval) == (None, None, "no interval: no pair differs")
    assert paired([], []).note == "no participant answered under both settings"


def test_differences_that_are_equal_but_for_rounding_tie() -> None:
    assert 0.3 - 0.1 != 0.2
    assert paired([0.3, 0.0, 2.0], [0.1, 0.2, 1.0]).statistic == 4.5


def test_many_pairs_are_approximated_closely() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.integers(1, 8, (2, 400)).astype(float)
    result = paired(x, y)
    assert "normal approximation" in result.method
    assert result.smallest_p is None
    assert result.p == pytest.approx(wilcoxon(x - y, method="asymptotic", correction=False).pvalue)


def test_unequal_lengths_are_refused() -> None:
    with pytest.raises(AnalysisError, match="3 and 2 answers are no pairs"):
        paired([1, 2, 3], [1, 2])

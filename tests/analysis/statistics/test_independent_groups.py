"""Groups of different participants: the Kruskal–Wallis test against scipy, p against all allocations."""

from itertools import permutations

import numpy as np
import pytest
from scipy.stats import kruskal, rankdata

from study_app.analysis.statistics import independent_groups as module
from study_app.analysis.statistics.independent_groups import groups_differ
from study_app.errors import AnalysisError

ANSWERS = np.array([3, 5, 5, 6, 2, 2, 4, 1, 7], dtype=float)
GROUPS = tuple("AAAABBBCC")


def brute_force(values: np.ndarray, groups: tuple[str, ...]) -> float:
    """Return p from every order of the participants."""
    centred = values - values.mean(axis=0)

    def between(order: tuple[str, ...]) -> float:
        names = np.array(order)
        return sum(
            (centred[names == name].mean(axis=0) ** 2).sum() * (names == name).sum() for name in sorted(set(groups))
        )

    found = between(groups)
    return float(np.mean([between(order) >= found - 1e-9 for order in permutations(groups)]))


def test_h_and_its_approximate_p_are_scipys() -> None:
    found = groups_differ(ANSWERS[:, None], GROUPS)
    h, p = kruskal(ANSWERS[:4], ANSWERS[4:7], ANSWERS[7:])
    assert (found.statistic, found.p_chi2) == (pytest.approx(h), pytest.approx(p))
    assert (found.n, found.df, found.sizes) == (9, 2, (4, 3, 2))
    assert found.effect == pytest.approx(h / 8)


@pytest.mark.parametrize("groups", ["AAABBB", "AABBCC", "ABBBBC"])
def test_p_is_exact(groups: str) -> None:
    answers = np.array([1, 2, 2, 5, 6, 4], dtype=float)
    found = groups_differ(answers[:, None], tuple(groups))
    assert found.method == "exact permutation of participants"
    assert found.p == pytest.approx(brute_force(rankdata(answers)[:, None], tuple(groups)))


def test_p_of_profiles_is_exact() -> None:
    ranks = np.array([[1, 2, 3], [1, 2, 3], [2, 1, 3], [3, 2, 1], [3, 1, 2], [1.5, 1.5, 3]])
    found = groups_differ(ranks, tuple("AAABBB"), test="profiles")
    assert found.p == pytest.approx(brute_force(ranks, tuple("AAABBB")))
    assert found.p_chi2 is None


def test_the_smallest_p_is_that_of_groups_without_overlap() -> None:
    found = groups_differ(np.arange(8.0)[:, None], tuple("AAAABBBB"))
    assert found.p == found.smallest_p == pytest.approx(2 / 70)
    assert groups_differ(np.arange(6.0)[:, None], tuple("ABABAB")).smallest_p == pytest.approx(2 / 20)


def test_a_drawn_p_is_near_the_exact_one(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = groups_differ(ANSWERS[:, None], GROUPS).p
    monkeypatch.setattr(module, "EXACT_UP_TO", 1)
    drawn = groups_differ(ANSWERS[:, None], GROUPS, seed=3)
    assert drawn.p == pytest.approx(exact, abs=4 * np.sqrt(0.25 / 9999))
    assert drawn.method == "Monte Carlo permutation of participants, 9999 draws, seed 3"
    assert drawn.p == groups_differ(ANSWERS[:, None], GROUPS, seed=3).p


def test_missing_answers_and_what_cannot_be_tested() -> None:
    answers = ANSWERS.copy()
    answers[0] = np.nan
    found = groups_differ(answers[:, None], GROUPS)
    assert (found.n, found.dropped, found.sizes) == (8, 1, (3, 3, 2))
    for values, groups, note in (
        ([1.0, 2, 3], "AAA", "fewer than two groups"),
        ([1.0, np.nan], "AB", "fewer than two groups"),
        ([1.0, 2], "AB", "each group has one participant"),
        ([4.0, 4, 4], "AAB", "no variation"),
        ([], "", "fewer than two groups"),
    ):
        none = groups_differ(np.array(values, dtype=float)[:, None], tuple(groups))
        assert none.p is None
        assert none.note.startswith(note)
    with pytest.raises(AnalysisError, match="2 participants and 1 groups"):
        groups_differ(np.ones((2, 1)), ("A",))


@pytest.mark.slow
def test_p_is_uniform_at_most_where_groups_are_alike() -> None:
    rng = np.random.default_rng(5)
    ps = [groups_differ(rng.integers(1, 8, (10, 1)).astype(float), tuple("AAAAABBBBB")).p or 1.0 for _ in range(300)]
    for alpha in (0.05, 0.2):
        assert np.mean(np.array(ps) <= alpha) <= alpha + 3 * np.sqrt(alpha * (1 - alpha) / len(ps))

from itertools import product

import numpy as np
import pytest
from scipy.stats import binom

from study_app.analysis.statistics.equivalence import tost
from study_app.errors import AnalysisError
from study_app.protocol.participants import fewest_participants


@pytest.mark.slow
@pytest.mark.parametrize(("n", "others"), list(product((5, 12, 24), ((0,), (-1, 0, 1)))))
def test_equivalence_is_rarely_shown_if_a_few_notice_strongly(n: int, others: tuple[int, ...]) -> None:
    # One in five answers five points higher: the mean lies on the bound.
    rng = np.random.default_rng(n)
    times_shown = 0
    for _ in range(400):
        strong = rng.random(n) < 0.2
        result = tost(np.where(strong, 5.0, rng.choice(others, n)), 1.0)
        times_shown += result.verdict == "equivalent"
        assert result.beyond is not None
        assert result.beyond.count == strong.sum()
    assert times_shown <= binom.ppf(0.999, 400, 0.05)


def test_the_bootstrap_counts_a_further_participant_like_the_most_extreme() -> None:
    """A value of 5 among zeros and a further copy have a weight of Beta(2, n − 1): ≥ q as often as B(n, q) ≤ 1."""
    n, bound = 20, 1.0
    result = tost([5.0] + [0.0] * (n - 1), bound)
    assert result.p_bootstrap == pytest.approx(binom.cdf(1, n, bound / 5), abs=0.02)
    # Of 2, 1, 0 and a further 2, less 1, the weights of two outweigh that of one in three of four draws.
    assert tost([2.0, 1.0, 0.0], 1.0).p_bootstrap == pytest.approx(0.75, abs=0.03)


@pytest.mark.parametrize(("bound", "n"), [(0.5, 35), (1.0, 17), (1.5, 14), (3.0, 14)])
def test_the_min_sample_depend_on_the_bound(bound: float, n: int) -> None:
    """A share bound / 6 of people who differ by six points shifts the mean by the bound; 5 % of samples have none."""
    assert (1 - min(1 / 5, bound / 6)) ** n <= 0.05 < (1 - min(1 / 5, bound / 6)) ** (n - 1)
    calm = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, bound / 4] * 6
    assert tost(calm[:n], bound).verdict == "equivalent"
    fewer = tost(calm[: n - 1], bound)
    assert (fewer.verdict, fewer.note) == (
        "out of reach",
        f"too few participants to show equivalence: at least {n} are needed",
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "bound", "n"),
    [(1 / 6, 1.0, 14), (1 / 6, 1.0, 30), (1 / 12, 0.5, 14), (1 / 12, 0.5, 30), (1 / 12, 0.5, 40)],
)
@pytest.mark.parametrize("others", [(0,), (-1, 0, 0, 1)])
def test_a_minority_that_differs_by_the_whole_scale_is_rarely_missed(
    share: float, bound: float, n: int, others: tuple[int, ...]
) -> None:
    rng = np.random.default_rng(n)
    are_shown = [
        tost(np.where(rng.random(n) < share, 6.0, rng.choice(others, n)), bound).verdict == "equivalent"
        for _ in range(400)
    ]
    assert sum(are_shown) <= binom.ppf(0.999, 400, 0.05)


@pytest.mark.parametrize("bound", [0, -1, np.nan, np.inf])
def test_a_meaningless_equivalence_bound_is_refused(bound: float) -> None:
    with pytest.raises(AnalysisError, match="equivalence bound"):
        tost([1.0, 2.0], bound)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "power"), [(5, 0.02), (20, 0.17), (30, 0.47)])
def test_the_power_of_equivalence_without_a_difference_is_as_published(n: int, power: float) -> None:
    # Paired differences of whole answers whose spread is 2.36 points; the bound is 1.
    rng = np.random.default_rng(n)
    are_shown = [(tost(rng.normal(0, 2.36, n), 1.0).p or 0.0) <= 0.05 for _ in range(1000)]
    assert np.mean(are_shown) == pytest.approx(power, abs=0.05)


@pytest.mark.parametrize(
    ("alpha", "bound", "largest", "n"),
    [
        (0.05, 1.0, 6.0, 17),
        (0.01, 1.0, 6.0, 26),
        (0.4096, 3.0, 6.0, 4),
        (0.4, 3.0, 6.0, 5),
        (0.05, 1.0, 12.0, 35),
        (0.05, 1.0, None, 14),
    ],
)
def test_a_minority_that_could_shift_the_mean_by_the_bound_must_be_improbable_in_the_sample(
    alpha: float, bound: float, largest: float | None, n: int
) -> None:
    """A share of bound / largest, at most a fifth, is missing from n people with a probability of (1 − share)^n."""
    assert fewest_participants(alpha, bound, largest) == n
    share = min(0.2, bound / (largest or bound))
    assert (1 - share) ** n <= alpha * (1 + 1e-9) < (1 - share) ** (n - 1)

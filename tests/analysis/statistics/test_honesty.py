"""What every result keeps to, whatever the answers: no NaN, a reason for what is not there, and never "no effect"."""

import dataclasses
import math
from collections.abc import Callable, Iterator
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom, ttest_1samp

from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.outcome import Outcome, draws_for, student_interval
from study_app.analysis.statistics.rank_tests import friedman, global_permutation, signed_rank_test
from study_app.analysis.statistics.recognition_tests import (
    UNANSWERED,
    UNDECIDED,
    Recognition,
    named_labels,
    recognition,
)
from study_app.analysis.statistics.slope_tests import slope_test
from study_app.analysis.statistics.thresholds import detection_threshold
from study_app.analysis.statistics.trend_tests import step_down, trend
from study_app.errors import AnalysisError

RNG = np.random.default_rng(11)
ANSWERS = RNG.integers(1, 8, (12, 3)).astype(float)
GAPS = np.where(RNG.random((12, 3)) < 0.2, np.nan, ANSWERS)
TABLES = {
    "twelve people": ANSWERS,
    "five people": ANSWERS[:5],
    "one person": ANSWERS[:1],
    "nobody": ANSWERS[:0],
    "missing answers": GAPS,
    "all missing": np.full((3, 3), np.nan),
    "all equal": np.full((12, 3), 4.0),
    "equal within people": np.repeat(np.arange(1.0, 8.0), 3).reshape(7, 3),
    "all alike": np.tile([1.0, 4.0, 7.0], (12, 1)),
    "unused levels": np.where(ANSWERS > 4, 7.0, 6.0),
    "one answers": np.vstack([[1.0, np.nan, np.nan], np.full((2, 3), np.nan)]),
    "one setting missing": np.column_stack([ANSWERS[:, 0], np.full(12, np.nan), ANSWERS[:, 2]]),
}
TESTS: dict[str, Callable[[np.ndarray], Outcome]] = {
    "friedman": friedman,
    "global": lambda values: global_permutation(values[None]),
    "paired": lambda values: signed_rank_test(values[:, 0], values[:, 2]),
    "trend": trend,
    "step down": lambda values: step_down(values, (0, 100, 200)).steps[0].trend,
    "tost": lambda values: tost(values[:, 2] - values[:, 0], 1.0),
    "threshold": lambda values: detection_threshold(values, (0, 100, 200)),
    "recognition": lambda values: recognition(named_labels(np.stack([values, values[:, ::-1]], axis=1)), [0, 2], 3),
    "means": slope_test,
    "slope": lambda values: slope_test(values, [[0.0], [1.0], [2.0]], "increasing"),
}


def numbers(value: object) -> Iterator[float]:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = [getattr(value, field.name) for field in dataclasses.fields(value)]
    if isinstance(value, list | tuple):
        for part in value:
            yield from numbers(part)
    elif isinstance(value, float):
        yield value


@pytest.mark.slow
@pytest.mark.parametrize("test", TESTS)
@pytest.mark.parametrize("table", TABLES)
def test_every_result_is_consistent(test: str, table: str) -> None:
    result = TESTS[test](TABLES[table])
    assert all(math.isfinite(number) for number in numbers(result))
    assert result.n + result.dropped == len(TABLES[table])
    assert (result.interval is None) == bool(result.no_interval)
    if result.p is None:
        assert result.note
    else:
        assert 0.0 <= result.p <= 1.0
        assert result.smallest_p is None or result.smallest_p <= result.p + 1e-12
    if result.interval is not None:
        assert result.interval.low <= result.interval.high
        assert result.effect is None or result.interval.low <= result.effect <= result.interval.high
    message = " ".join(str(part) for part in dataclasses.astuple(result))
    assert "no effect" not in message


def test_the_interval_of_a_mean_is_that_of_t_and_needs_values_that_differ() -> None:
    values = np.array([0.5, 2.0, 2.5, 7.0])
    for level in (0.9, 0.95):
        ends = ttest_1samp(values, 0.0).confidence_interval(level)
        assert student_interval(values, level) == pytest.approx((ends.low, ends.high))
    for few in (values[:0], values[:1], np.full(4, 0.1)):
        assert student_interval(few) == (None, None)


def test_a_stricter_alpha_and_more_tests_need_more_permutations() -> None:
    usual, strict, many = draws_for(0.05, 1000), draws_for(0.001, 1000), draws_for(0.001, 1000, 3)
    assert usual == 1000
    assert strict > 5000
    assert many == pytest.approx(3 * strict, abs=3)
    assert many < draws_for(1e-12, 1000) == draws_for(1e-15, 1000), "there is an upper limit"


# Fewest hits in all with p ≤ .05: participants, by matching, by the binomial distribution (too liberal).
CRITICAL = [(3, 7, 6), (5, 10, 9), (12, 19, 18), (24, 33, 32), (30, 40, 38)]


def hits_of(n: int, total: int) -> list[int]:
    """Return hits (0, 1 or 3 of each of n people) that add up to ``total``."""
    threes = next(threes for threes in range(n + 1) if 0 <= total - 3 * threes <= n - threes)
    ones = total - 3 * threes
    return [3] * threes + [1] * ones + [0] * (n - threes - ones)


def matching(hits: list[int]) -> Recognition:
    """Return the test of people who used each of three names once, with these ``hits``."""
    names = {3: [0, 1, 2], 1: [0, 2, 1], 0: [1, 2, 0]}
    return recognition([names[hit_count] for hit_count in hits], [0, 1, 2], 3)


def test_the_name_is_the_single_highest_rating() -> None:
    ratings = [[[7, 1, 2], [3, 3, 4], [1, 6, 5]], [[4, 4, 4], [5, 5, 1], [1, np.nan, 7]]]
    assert named_labels(ratings).tolist() == [[0, 2, 1], [UNDECIDED, UNDECIDED, UNANSWERED]]


@pytest.mark.parametrize(("n", "fewest", "binomial"), CRITICAL)
def test_published_critical_numbers_of_hits(n: int, fewest: int, binomial: int) -> None:
    enough, short = matching(hits_of(n, fewest)), matching(hits_of(n, fewest - 1))
    assert enough.p is not None
    assert short.p is not None
    assert enough.p <= 0.05 < short.p
    assert binom.sf(binomial - 1, 3 * n, 1 / 3) <= 0.05 < binom.sf(binomial - 2, 3 * n, 1 / 3)
    assert enough.expected == pytest.approx(n)


def test_published_matching_of_five_people() -> None:
    result = matching(hits_of(5, 10))
    assert result.p == pytest.approx(0.0303, abs=5e-5)
    assert binom.sf(9, 15, 1 / 3) == pytest.approx(0.0085, abs=5e-5)
    best = matching([3] * 5)
    assert best.p == pytest.approx((1 / 6) ** 5)
    assert best.p == best.smallest_p


@pytest.mark.slow
@given(st.lists(st.lists(st.integers(-2, 3), min_size=3, max_size=3), min_size=1, max_size=3))
@settings(max_examples=40, deadline=None)
def test_the_exact_p_is_that_of_all_exchanges_of_answered_settings(names: list[list[int]]) -> None:
    truth = [0, 1, 3]
    each = []
    for row in names:
        there = [place for place in range(3) if row[place] != UNANSWERED]
        orders = permutations([row[place] for place in there])
        each.append([sum(truth[p] == name for p, name in zip(there, order, strict=True)) for order in orders])
    every = np.array([sum(exchanged) for exchanged in product(*each)])
    result = recognition(names, truth, 4)
    if result.n == 0:
        assert result.p is None
        return
    assert result.p == pytest.approx((every >= result.statistic).mean())
    assert result.smallest_p == pytest.approx((every == every.max()).mean())
    assert result.expected == pytest.approx(every.mean())


def test_the_table_counts_everything_once() -> None:
    names = [[0, 1, 2], [0, 1, 3], [1, 1, 1], [0, UNDECIDED, 2], [2, UNANSWERED, 0], [UNANSWERED] * 3]
    result = recognition(names, [0, 1, 3], 5)
    assert result.table == ((3, 1, 1, 0, 0, 0, 1), (0, 3, 0, 0, 0, 1, 2), (1, 1, 2, 1, 0, 0, 1))
    assert (result.n, result.dropped, result.statistic) == (5, 1, 7)
    assert (result.decided, result.undecided, result.unanswered) == (13, 1, 4)
    assert result.note == "1 undecided answer counts as incorrect"
    assert [(rate.hits, rate.n) for rate in result.rates] == [(3, 5), (3, 4), (1, 5)]


def test_kappa_has_an_interval() -> None:
    rng = np.random.default_rng(0)
    names = np.where(rng.random((24, 3)) < 0.6, [0, 1, 2], rng.integers(0, 3, (24, 3)))
    result = recognition(names, [0, 1, 2], 3)
    assert result.interval is not None
    assert result.effect is not None
    assert result.interval.low < result.effect < result.interval.high
    assert result == recognition(names, [0, 1, 2], 3)
    assert recognition(names[:1], [0, 1, 2], 3).no_interval == "no interval: there is only one participant"


@pytest.mark.parametrize("n", [3, 12, 30])
def test_kappa_of_people_who_all_agree_has_a_lower_end_below_1(n: int) -> None:
    """The lower end of the share of correct answers is that of Clopper and Pearson for n of n participants."""
    interval = recognition([[0, 1, 2]] * n, [0, 1, 2], 3).interval
    assert interval is not None
    share = 0.025 ** (1 / n)
    assert interval.low == pytest.approx((share - 1 / 3) / (1 - 1 / 3), abs=0.05)
    assert interval.high == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "known"), [(5, 0.95), (12, 0.95), (20, 0.8), (30, 0.99)])
def test_intervals_of_kappa_cover_it(n: int, known: float) -> None:
    """Each of three names is correct with a known probability; wrong names are equally frequent."""
    rng, studies, covered = np.random.default_rng(n), 200, 0
    kappa = (known - 1 / 3) / (1 - 1 / 3)
    for number in range(studies):
        wrong = (np.arange(3) + rng.integers(1, 3, (n, 3))) % 3
        names = np.where(rng.random((n, 3)) < known, np.arange(3), wrong)
        names[rng.random((n, 3)) < 0.1] = UNDECIDED
        interval = recognition(names, [0, 1, 2], 3, seed=number).interval
        covered += interval is not None and interval.low <= kappa <= interval.high + 1e-9
    assert covered >= binom.ppf(0.001, studies, 0.95)


@pytest.mark.parametrize(
    ("names", "truth"),
    [([[0, 1]], [0, 1, 2]), ([[0, 5, 1]], [0, 1, 2]), ([[0, 1, 1.5]], [0, 1, 2]), ([[0, 1, 2]], [0, 1, 9])],
)
def test_names_and_truth_that_do_not_fit_are_refused(names: list[list[float]], truth: list[int]) -> None:
    with pytest.raises(AnalysisError, match=r"name|labels"):
        recognition(names, truth, 3)

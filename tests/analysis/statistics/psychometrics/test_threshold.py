import math

import numpy as np
import pytest
from scipy.special import expit
from scipy.stats import binom

from study_app.analysis.statistics.thresholds import detection_threshold, deviances, drift, p_of_fit
from study_app.psychophysics.families import success

pytestmark = pytest.mark.slow


DELAYS = (0, 50, 100, 125, 150, 200, 300)
STUDY = (0, 50, 75, 100, 125, 150, 200)


def pooled(yes: list[int], people: int) -> np.ndarray:
    """Return answers (people, levels) of which so many noticed something at each level."""
    return np.where(np.arange(people)[:, None] < np.array(yes), 6.0, 2.0)


def test_guesses_without_any_delay_raise_the_lower_end_and_not_the_threshold() -> None:
    rng = np.random.default_rng(5)
    chance = success("logistic", DELAYS, 130.0, 80.0, 0.3, 0.0)
    result = detection_threshold(np.where(rng.random((400, 7)) < chance, 6.0, 2.0), DELAYS)
    assert (result.effect, result.width) == pytest.approx((130, 80), rel=0.2)
    assert result.guess == pytest.approx(0.3, abs=0.05)
    assert result.statistic == pytest.approx(deviances(result.yes, result.asked, result.expected).sum())


def people_who_notice(rng: np.random.Generator, n: int, spread_ms: float, never: float) -> np.ndarray:
    """Return answers (n, 7), 6 for noticed and 2 for not, of people whose thresholds lie about 120 ms."""
    at = 120 + spread_ms * rng.normal(size=(n, 1))
    chance = 0.02 + 0.96 * expit(2 * np.log(19) * (np.array(STUDY) - at) / 60)
    chance[rng.random(n) < never] = 0.02
    return np.where(rng.random(chance.shape) < chance, 6.0, 2.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "spread_ms", "never"),
    [
        pytest.param(5, 0, 0, marks=pytest.mark.nightly),
        pytest.param(12, 0, 0, marks=pytest.mark.nightly),
        pytest.param(12, 35, 0, marks=pytest.mark.nightly),
        pytest.param(12, 60, 0, marks=pytest.mark.nightly),
        (12, 15, 1 / 6),
    ],
)
def test_the_interval_covers_the_threshold_of_people_who_differ(n: int, spread_ms: float, never: float) -> None:
    rng = np.random.default_rng(3)
    intervals = [detection_threshold(people_who_notice(rng, n, spread_ms, never), STUDY).interval for _ in range(40)]
    printed = [interval for interval in intervals if interval is not None]
    assert len(printed) >= 36
    covered = sum(interval.low <= 120 <= interval.high for interval in printed)
    assert covered >= binom.ppf(0.05, len(printed), 0.93)


def test_equal_levels_are_replicates_of_one() -> None:
    values = people_who_notice(np.random.default_rng(1), 8, 10, 0)
    doubled = detection_threshold(np.hstack([values, values[:, 3:4]]), (*STUDY, 100))
    stacked = np.full((8, 7, 2), np.nan)
    stacked[..., 0], stacked[:, 3, 1] = values, values[:, 3]
    assert doubled.levels == tuple(float(level) for level in STUDY)
    assert doubled.asked[3] == 16
    assert doubled == detection_threshold(stacked, STUDY)


def test_agreement_from_five_on_is_noticing_and_missing_answers_do_not_count() -> None:
    values = np.array([[1, 2, 3, 5, 6, 7, 7], [1, 1, 4, 4, 5, 6, np.nan], [np.nan] * 7])
    result = detection_threshold(values, DELAYS)
    assert (result.yes, result.asked) == ((0, 0, 0, 1, 2, 2, 1), (2, 2, 2, 2, 2, 2, 1))
    assert (result.n, result.dropped) == (2, 1)
    five = detection_threshold(np.vstack([values, values, values]), DELAYS)
    assert (
        "answers from all participants are pooled, and the interval allows for differences between participants"
        in five.note
    )
    assert five.effect == pytest.approx(125, abs=25)


@pytest.mark.parametrize(
    ("yes", "note"),
    [
        ([0] * 7, "no participant noticed a difference at any level up to 300"),
        ([5] * 7, "all participants noticed a difference at every level"),
        ([5, 4, 3, 2, 1, 0, 0], "the fitted threshold lies outside the range of presented levels"),
    ],
)
def test_answers_without_a_threshold_are_reported(yes: list[int], note: str) -> None:
    result = detection_threshold(pooled(yes, 5), DELAYS)
    assert (result.effect, result.interval, result.statistic) == (None, None, None)
    assert note in result.note
    assert note in result.no_interval


def test_people_who_never_agree_are_lapses() -> None:
    lapsing = detection_threshold(pooled([0, 0, 1, 4, 14, 17, 17], 20), DELAYS)  # three of twenty
    assert lapsing.lapse == pytest.approx(0.15, abs=0.03)
    assert lapsing.effect == pytest.approx(138, abs=8)


def test_an_open_interval_says_which_end_is_open() -> None:
    result = detection_threshold(pooled([0, 0, 0, 0, 0, 3, 4], 12), DELAYS)
    assert result.effect is not None
    assert result.interval is None
    assert result.lower is not None
    assert result.upper is None
    assert result.no_interval == "no interval: the answers do not determine the upper end"
    far = detection_threshold(pooled([0, 0, 0, 0, 1, 2, 8], 20), DELAYS)
    assert far.upper is not None
    assert far.upper > 300
    assert "the interval extends beyond the range of presented levels" in far.note


PSI = np.array([0.55, 0.7, 0.85, 0.95])
N = np.array([40, 40, 40, 40])


def test_deviance_is_that_worked_by_hand_and_0_where_shares_are_as_expected() -> None:
    assert deviances([20], [40], [0.75]) == pytest.approx(2 * (20 * math.log(2 / 3) + 20 * math.log(2)))
    assert deviances(N * 0.5, N, np.full(4, 0.5)) == pytest.approx(np.zeros(4))
    assert deviances([0, 40], [40, 40], [0.5, 0.5]) == pytest.approx([80 * math.log(2)] * 2)


@pytest.mark.slow
def test_p_of_fit_is_uniform_where_the_function_is_true() -> None:
    draw = np.random.default_rng(7)
    ps = np.array([p_of_fit(draw.binomial(N, PSI), N, PSI) for _ in range(400)])
    assert (ps < 0.05).mean() == pytest.approx(0.05, abs=0.035)
    assert ps.mean() == pytest.approx(0.5, abs=0.06)


def test_p_of_fit_is_small_where_answers_do_not_follow_the_function_and_the_same_again() -> None:
    assert p_of_fit([36, 12, 36, 20], N, PSI) == 1 / 1000
    assert p_of_fit([24, 27, 36, 38], N, PSI) == p_of_fit([24, 27, 36, 38], N, PSI) > 0.3


def test_drift_is_positive_where_answers_become_better_and_near_0_where_they_do_not() -> None:
    draw, n = np.random.default_rng(2), 400
    psi = np.full(n, 0.75)
    better = draw.random(n) < np.linspace(0.55, 0.95, n)
    steady = draw.random(n) < psi
    assert drift(better, psi) > 2 / math.sqrt(n)
    assert drift(~better[::-1], psi) > 2 / math.sqrt(n)
    assert abs(drift(steady, psi)) < 2 / math.sqrt(n)
    assert drift(np.ones(n, bool), psi) is None


@pytest.mark.parametrize(
    ("levels", "spread", "reason"),
    [
        ((20, 80, 130, 200), 12, ""),
        ((60, 80, 130, 200), 22, "the fitted threshold lies outside the range of presented levels (60 to 200)"),
    ],
)
def test_a_threshold_is_reported_from_the_lowest_level_onwards(
    levels: tuple[int, ...], spread: float, reason: str
) -> None:
    """The planted threshold of 45 ms lies between the first two levels, or below the first."""
    rng = np.random.default_rng(5)
    chance = expit((np.array(levels)[None, :, None] - 45) / spread)
    result = detection_threshold(np.where(rng.random((12, 4, 4)) < chance, 6.0, 2.0), levels)
    assert result.no_interval == reason
    assert (result.effect is None) == bool(reason)
    assert result.effect is None or 35 < result.effect < 55

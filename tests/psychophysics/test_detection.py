"""Detection theory: P(correct) and d′ of each design against closed forms, published values and simulation."""

import math

import numpy as np
import pytest
from scipy.stats import mannwhitneyu, norm

from study_app.psychophysics.detection import (
    PROPORTIONS,
    abx,
    d_prime_at,
    different_rate,
    proportion_correct,
    rate,
    rating,
    same_different,
    two_intervals,
    yes_no,
)

CHANCE = {"2ifc": 1 / 2, "3ifc": 1 / 3, "4ifc": 1 / 4, "oddity": 1 / 3}
WORKED = {  # P(correct) at d′ = 1 and 2, confirmed by simulations of 2·10⁶ trials to 0.0007
    "2ifc": (0.7602, 0.9214),
    "3ifc": (0.6337, 0.8658),
    "4ifc": (0.5520, 0.8228),
    "abx differencing": (0.5825, 0.7468),
    "abx independent": (0.5997, 0.7877),
    "oddity": (0.4180, 0.6048),
    "samedifferent differencing": (0.5513, 0.6748),
    "samedifferent independent": (0.5733, 0.7330),
    "yesno": (0.6915, 0.8413),
}


@pytest.mark.parametrize("task", PROPORTIONS)
def test_proportion_correct_is_the_worked_one_at_d_prime_1_and_2_and_chance_at_0(task):
    assert [proportion_correct(task, d) for d in (1, 2)] == pytest.approx(WORKED[task], abs=5e-5)
    assert proportion_correct(task, 0) == pytest.approx(CHANCE.get(task, 0.5), abs=1e-12)
    assert proportion_correct(task, 15) == pytest.approx(1, abs=1e-7)


@pytest.mark.parametrize("task", PROPORTIONS)
def test_d_prime_inverts_the_proportion_and_is_negative_below_chance(task):
    chance = CHANCE.get(task, 0.5)
    for planted in (0.05, 0.4, 0.7):
        proportion = proportion_correct(task, planted)
        assert d_prime_at(task, proportion) == pytest.approx(planted, abs=1e-7)
        assert d_prime_at(task, 2 * chance - proportion) == pytest.approx(-planted, abs=1e-7)
    assert d_prime_at(task, proportion_correct(task, 4.2)) == pytest.approx(4.2, abs=1e-7)
    assert d_prime_at(task, chance) == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("task", ["abx differencing", "oddity", "samedifferent independent", "4ifc"])
def test_the_mean_d_prime_of_observers_who_guess_is_0(task):
    correct = np.random.default_rng(len(task)).binomial(24, CHANCE.get(task, 0.5), 4000)
    guessed = np.array([d_prime_at(task, share) for share in correct / 24])
    assert abs(guessed.mean()) < 4 * guessed.std() / math.sqrt(len(guessed))


@pytest.mark.parametrize("task", ["3ifc", "4ifc", "abx differencing", "oddity", "samedifferent differencing"])
def test_proportions_are_those_of_simulated_observers(task):
    draw, n, d_prime = np.random.default_rng(3), 400_000, 1.4
    if task == "abx differencing":
        x = draw.normal(size=(n, 3)) + d_prime * np.array([0, 1, 1])
        right = np.abs(x[:, 2] - x[:, 1]) < np.abs(x[:, 2] - x[:, 0])
    elif task == "oddity":
        x = draw.normal(size=(n, 3)) + d_prime * np.array([0, 0, 1])
        gaps = np.abs(np.stack([x[:, 1] - x[:, 2], x[:, 0] - x[:, 2], x[:, 0] - x[:, 1]]))
        right = gaps.argmin(axis=0) == 2
    elif task == "samedifferent differencing":
        same, different = draw.normal(scale=math.sqrt(2), size=(2, n // 2))
        gaps = np.sort(np.abs(np.concatenate((same, different + d_prime))))
        k = gaps[n // 2]  # unbiased: "same" as often as "different"
        right = np.concatenate((np.abs(same) < k, np.abs(different + d_prime) >= k))
    else:
        x = draw.normal(size=(n, int(task[0])))
        x[:, 0] += d_prime
        right = x.argmax(axis=1) == 0
    assert right.mean() == pytest.approx(proportion_correct(task, d_prime), abs=4 * 0.5 / math.sqrt(n))


def test_yes_no_has_the_published_d_prime_and_criterion():
    estimate = yes_no(8e6, 1e7, 4e6, 1e7)  # Macmillan & Creelman 2005, chapter 1: H = .8, F = .4
    assert (estimate.d_prime, estimate.criterion) == pytest.approx((1.095, -0.294), abs=5e-4)


def test_the_variance_of_d_prime_is_that_of_repeated_experiments():
    draw, signals, noises = np.random.default_rng(5), 200, 120
    hits, alarms = draw.binomial(signals, 0.75, 4000), draw.binomial(noises, 0.2, 4000)
    estimates = [yes_no(h, signals, f, noises) for h, f in zip(hits, alarms, strict=True)]
    assert np.mean([estimate.variance for estimate in estimates]) == pytest.approx(
        np.var([estimate.d_prime for estimate in estimates]), rel=0.06
    )


def test_two_intervals_separates_sensitivity_from_a_bias_to_the_first():
    d_prime, bias, n = 1.2, 0.4, 10**7
    high, low = (norm.cdf((sign * d_prime + bias) / math.sqrt(2)) for sign in (1, -1))
    estimate = two_intervals(high * n, n, low * n, n)
    assert estimate.d_prime == pytest.approx(d_prime, abs=1e-5)
    assert estimate.criterion == pytest.approx(-bias / math.sqrt(2), abs=1e-5)
    assert estimate.variance == pytest.approx(yes_no(high * n, n, low * n, n).variance / 2)
    assert two_intervals(9, 10, 0, 0) is None


def test_same_different_finds_the_planted_d_prime_and_criterion_under_differencing():
    d_prime, k, n = 1.7, 1.3, 10**7
    estimate = same_different(n * different_rate(d_prime, k), n, n * different_rate(0, k), n, "differencing")
    assert (estimate.d_prime, estimate.criterion) == pytest.approx((d_prime, k), abs=1e-5)
    draw = np.random.default_rng(1).normal(size=(400_000, 2))
    assert (np.abs(draw[:, 0] - draw[:, 1] + d_prime) > k).mean() == pytest.approx(different_rate(d_prime, k), abs=3e-3)


def test_same_different_of_an_unbiased_independent_observer():
    n, d_prime = 10**8, 1.5
    share = proportion_correct("samedifferent independent", d_prime)
    estimate = same_different(n * share, n, n * (1 - share), n, "independent")
    assert estimate.d_prime == pytest.approx(d_prime, abs=1e-5)
    assert estimate.criterion is None
    for model in ("independent", "differencing"):
        more, fewer = same_different(12, 20, 3, 20, model), same_different(3, 20, 12, 20, model)
        assert fewer.d_prime == pytest.approx(-more.d_prime)
        assert more.d_prime > 0.5
    assert same_different(20, 20, 0, 20, "differencing").d_prime < 8
    assert same_different(20, 20, 0, 0, "differencing") is None


def abx_share(model, d_prime):
    """Return P(correct) of ABX by Macmillan & Creelman 2005, chapter 9."""
    of_standards, of_x = d_prime / math.sqrt(2), d_prime / {"independent": 2.0, "differencing": math.sqrt(6)}[model]
    return norm.cdf(of_standards) * norm.cdf(of_x) + norm.cdf(-of_standards) * norm.cdf(-of_x)


@pytest.mark.parametrize(("model", "other"), [("independent", "differencing"), ("differencing", "independent")])
def test_abx_has_the_d_prime_of_its_model_and_that_of_the_other(model, other):
    for correct, share in ((17, 17.5 / 21), (13, 13.5 / 21)):  # of 20, log-linear
        sensitivity = abx(correct, 20, model)
        assert abx_share(model, sensitivity.d_prime) == pytest.approx(share, abs=1e-7)
        assert abx_share(other, sensitivity.other) == pytest.approx(share, abs=1e-7)
        assert (sensitivity.model, sensitivity.criterion, sensitivity.variance) == (model, None, None)
    below = abx(3, 20, model)  # as far below one half as 17 of 20 are above it
    above = abx(17, 20, model)
    assert (below.d_prime, below.other) == pytest.approx((-above.d_prime, -above.other))
    assert abx(0, 0, model) is None


@pytest.mark.parametrize(("model", "other"), [("independent", "differencing"), ("differencing", "independent")])
def test_same_different_has_the_d_prime_of_the_other_model(model, other):
    sensitivity, of_other = same_different(12, 20, 3, 20, model), same_different(12, 20, 3, 20, other)
    assert (sensitivity.model, sensitivity.other) == (model, of_other.d_prime)
    assert abs(sensitivity.other - sensitivity.d_prime) > 0.1


def test_ratings_have_the_area_of_mann_and_whitney():
    low, high = [1, 2, 2, 3, 4], [2, 3, 5, 5, 4, 3]
    wins = mannwhitneyu(high, low).statistic
    assert rating(low, high).d_prime == pytest.approx(math.sqrt(2) * norm.ppf(rate(wins, 30)))
    assert rating([1, 1], [5, 5]).d_prime == pytest.approx(math.sqrt(2) * norm.ppf(4.5 / 5))
    assert rating([], [5]) is None

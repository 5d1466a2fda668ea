"""QUEST+: expected entropies by their definition, the published package's posterior, and what it recovers."""

import math

import numpy as np
import pytest

from study_app.psychophysics.adaptive import Search
from study_app.psychophysics.families import Z_95
from study_app.psychophysics.grid import Grid, evenly, fit, geometric

LOW, HIGH = math.log10(0.02), math.log10(0.6)
LEVELS = evenly(LOW, HIGH, 31)
RUNNING = Grid(
    family="weibull",
    thresholds=evenly(LOW, HIGH, 41),
    widths=geometric(0.5, 4.0, 9),
    width_prior=(1.4, 1.5),
    lapses=(0.0, 0.02, 0.04),
    lapse_prior=(0.4, 0.4, 0.2),
    guesses=(0.5,),
)
ANALYSIS = Grid(
    family="weibull",
    thresholds=evenly(LOW - 0.2, HIGH + 0.2, 81),
    widths=geometric(0.4, 4.0, 15),
    width_prior=(1.4, 1.5),
    lapses=(0.0, 0.01, 0.02, 0.03, 0.05),
    lapse_prior=(0.25, 0.3, 0.2, 0.15, 0.1),
    guesses=(0.5,),
)


def entropy(weights):
    positive = weights[weights > 0]
    return -float((positive * np.log(positive)).sum())


@pytest.mark.parametrize("learn", ["threshold", "all"])
def test_the_expected_entropy_is_that_of_both_posteriors_weighted_by_their_probability(learn):
    search = Search(RUNNING, LEVELS, learn)
    successes, failures = np.zeros(31), np.zeros(31)
    successes[[10, 20]], failures[[10, 5]] = 3, 2
    before = fit(LEVELS, successes, failures, RUNNING).weights
    (entropies,) = search.expected_entropy(before[None])
    for level in (0, 7, 16, 30):
        probability = float((RUNNING.success([LEVELS[level]])[0] * before).sum())
        expected = 0.0
        for counts, share in ((successes, probability), (failures, 1 - probability)):
            counts[level] += 1
            after = fit(LEVELS, successes, failures, RUNNING).weights
            counts[level] -= 1
            expected += share * entropy(after.sum(axis=(1, 2, 3)) if learn == "threshold" else after)
        assert entropies[level] == pytest.approx(expected, abs=1e-10)


def test_of_levels_that_promise_the_same_the_lowest_is_taken():
    flat = Grid(
        family="normal",
        thresholds=(-1.0, -0.5),
        widths=(1e-3,),
        width_prior=None,
        lapses=(0.0,),
        lapse_prior=(1.0,),
        guesses=(0.0,),
    )
    between = (-0.9, -0.8, -0.7, -0.6)
    assert Search(flat, between, "threshold").next((0, 0, 0, 0), (0, 0, 0, 0)) == 0


def test_entropies_that_differ_by_rounding_are_equal(monkeypatch):
    monkeypatch.setattr(Search, "expected_entropy", lambda *_: np.array([[2.0, 1.0 + 1e-12, 1.0, 1.0 + 1e-6]]))
    assert Search(RUNNING, LEVELS[:4]).next((0,) * 4, (0,) * 4) == 1


def test_the_level_of_noise_trials_is_never_chosen():
    nothing = (0, 0)
    levels = (math.log10(0.1), LOW - 3)  # the second promises nothing
    assert Search(RUNNING, levels).next(nothing, nothing) == 0
    assert Search(RUNNING, levels, noise=True).next(nothing, nothing) == 1


def test_the_interval_holds_95_percent():
    low, high = fit(LEVELS, np.zeros(31), np.zeros(31), RUNNING).interval
    span = (HIGH - LOW) * 41 / 40  # the prior is flat over cells, of which half a one lies beyond each end
    assert (high - low) / span == pytest.approx(0.95)
    assert low + high == pytest.approx(LOW + HIGH)


@pytest.mark.slow
def test_posterior_and_levels_are_those_of_the_questplus_package():
    """With flat priors and joint entropy; its normal function has a mean and a standard deviation."""
    package = pytest.importorskip("questplus")
    levels = evenly(-1.5, 0.0, 16)
    thresholds, widths = evenly(-1.4, -0.1, 14), geometric(0.5, 4.0, 6)
    lapses = (0.0, 0.02, 0.04)
    theirs = package.QuestPlus(
        stim_domain={"intensity": np.array(levels)},
        param_domain={
            "mean": np.array(thresholds),
            "sd": np.array(widths) / (2 * Z_95),
            "lower_asymptote": np.array([0.5]),
            "lapse_rate": np.array(lapses),
        },
        outcome_domain={"response": ["yes", "no"]},
        func="norm_cdf",
        stim_scale="linear",
        stim_selection_method="min_entropy",
        param_estimation_method="mean",
    )
    ours = Search(
        Grid(
            family="normal",
            thresholds=thresholds,
            widths=widths,
            width_prior=None,
            lapses=lapses,
            lapse_prior=(1, 1, 1),
            guesses=(0.5,),
        ),
        levels,
        "all",
    )
    successes, failures = np.zeros(16), np.zeros(16)
    draw = np.random.default_rng(3)
    for _ in range(40):
        level = ours.next(successes, failures)
        assert theirs.next_stim["intensity"] == pytest.approx(levels[level])
        right = bool(draw.random() < 0.5 + 0.48 * (levels[level] > -0.7))
        (successes if right else failures)[level] += 1
        theirs.update(stim={"intensity": levels[level]}, outcome={"response": "yes" if right else "no"})
        posterior = theirs.posterior.transpose("mean", "sd", "lapse_rate", "lower_asymptote").to_numpy()
        assert fit(levels, successes, failures, ours.grid).weights == pytest.approx(posterior, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("trials", "bias", "spread", "covered"),
    [
        (40, 0, 35, 96),
        pytest.param(60, 1, 26, 98, marks=pytest.mark.nightly),
        pytest.param(100, -2, 21, 97, marks=pytest.mark.nightly),
    ],
)
def test_a_linear_observer_is_recovered_as_the_prototype_measured(trials, bias, spread, covered):
    """Percent, ± 3 points and what 400 observers leave to chance (two standard errors)."""
    observers, w75 = 400, 0.2
    draw = np.random.default_rng(trials)
    search = Search(RUNNING, LEVELS, "threshold")
    noise = math.log1p(w75) / 0.6744897501960817
    correct = [0.5 * math.erfc(-math.log1p(10.0**u) / noise / math.sqrt(2)) for u in LEVELS]
    estimates, inside = [], 0
    for _ in range(observers):
        successes, failures = np.zeros(31), np.zeros(31)
        for _ in range(trials):
            level = search.next(successes, failures)
            right = draw.random() < 0.01 + 0.98 * correct[level]
            (successes if right else failures)[level] += 1
        fitted = fit(LEVELS, successes, failures, ANALYSIS)
        low, high = fitted.interval
        estimates.append(10.0**fitted.threshold)
        inside += low <= math.log10(w75) <= high
    ratios = np.array(estimates) / w75
    chance = 2 * 100 * ratios.std() / math.sqrt(observers)
    assert 100 * (math.exp(np.log(ratios).mean()) - 1) == pytest.approx(bias, abs=3 + chance)
    assert 100 * ratios.std() == pytest.approx(spread, abs=3 + chance)
    assert 100 * inside / observers == pytest.approx(covered, abs=3)

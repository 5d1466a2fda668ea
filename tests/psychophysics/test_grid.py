"""The posterior over a grid: priors, counts, quantiles."""

import itertools
import math

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import t as student

from study_app.psychophysics.adaptive import RATIOS, Staircase, converges_to
from study_app.psychophysics.families import CLIP, KAPPA, level_at, position, rise, success
from study_app.psychophysics.grid import (
    FREE_GUESSES,
    GROUP_LAPSES,
    MEAN_LAPSE,
    Grid,
    evenly,
    fit,
    geometric,
    group_lapse_weights,
    group_priors,
    lapse_prior,
    quantile,
)
from study_app.psychophysics.people import Expected, student_975

LEVELS = evenly(-1.5, 0.0, 6)


def grid(**changed):
    parts = {
        "family": "weibull",
        "thresholds": evenly(-1.5, 0.0, 11),
        "widths": geometric(0.5, 4.0, 5),
        "width_prior": (1.4, 1.5),
        "lapses": (0.0, 0.02, 0.04),
        "lapse_prior": (0.4, 0.4, 0.2),
        "guesses": (0.5,),
    }
    return Grid(**(parts | changed))


def test_the_prior_is_flat_in_the_threshold_log_normal_in_the_width_and_listed_for_the_lapse_rate():
    prior = grid()
    assert prior.prior.sum() == pytest.approx(1.0)
    assert prior.prior.sum(axis=(1, 2, 3)) == pytest.approx(1 / 11)
    assert prior.prior.sum(axis=(0, 1, 3)) == pytest.approx([0.4, 0.4, 0.2])
    widths = prior.prior.sum(axis=(0, 2, 3))
    z = np.log(np.array(prior.widths) / 1.4) / math.log(1.5)
    assert widths / widths.max() == pytest.approx(np.exp(-(z**2) / 2) / np.exp(-(z**2) / 2).max())
    assert grid(width_prior=None).prior.sum(axis=(0, 2, 3)) == pytest.approx(1 / 5)


@pytest.mark.parametrize("guesses", [(0.5,), None, FREE_GUESSES])
def test_the_posterior_is_the_product_of_prior_and_likelihood_of_each_cell(guesses):
    posterior_grid = grid(guesses=guesses)
    successes, failures = [1, 0, 3, 4, 9, 10], [3, 2, 2, 1, 1, 0]
    by_hand = np.empty(posterior_grid.shape)
    for t, w, lapse, g in itertools.product(*map(range, posterior_grid.shape)):
        rates = (
            (posterior_grid.lapses[lapse], posterior_grid.lapses[lapse])
            if guesses is None
            else (guesses[g], posterior_grid.lapses[lapse])
        )
        likelihood = 1.0
        for level, yes, no in zip(LEVELS, successes, failures, strict=True):
            p = success("weibull", level, posterior_grid.thresholds[t], posterior_grid.widths[w], *rates).clip(
                CLIP, 1 - CLIP
            )
            likelihood *= p**yes * (1 - p) ** no
        by_hand[t, w, lapse, g] = likelihood * posterior_grid.prior[t, w, lapse, g]
    assert fit(LEVELS, successes, failures, posterior_grid).weights == pytest.approx(by_hand / by_hand.sum(), rel=1e-9)


def test_the_prior_of_mean_lapse_rates_is_exponential_and_that_of_one_person_needs_no_group():
    weights = group_lapse_weights()
    assert weights.sum() == pytest.approx(1.0)
    assert weights @ GROUP_LAPSES == pytest.approx(MEAN_LAPSE, rel=0.03)
    assert weights[0] == pytest.approx(1 - math.exp(-0.006 / MEAN_LAPSE))  # up to half-way to the next
    lapses = (0.0, 0.01, 0.03, 0.09, 0.16)
    lapse_grid = grid(width_prior=None, lapses=lapses, lapse_prior=lapse_prior(lapses))
    (factors,) = group_priors([fit((), (), (), lapse_grid)], (1.4, 1.5)).factors
    of_lapse = (factors * lapse_grid.lapse_prior).sum(axis=0)
    assert of_lapse / of_lapse.sum() == pytest.approx(lapse_grid.lapse_prior)


def test_a_few_lapses_raise_the_lapse_rate_of_all_and_the_error_that_they_share():
    lapses = (0.0, 0.01, 0.03, 0.09, 0.16)
    lapse_grid = grid(width_prior=None, lapses=lapses, lapse_prior=lapse_prior(lapses))

    def priors(wrong_at_the_top):
        successes, failures = [10, 11, 14, 18, 20, 40 - wrong_at_the_top], [10, 9, 6, 2, 0, wrong_at_the_top]
        return group_priors([fit(LEVELS, successes, failures, lapse_grid)] * 10, (1.4, 1.5))

    none, many = priors(0), priors(3)
    mean_rates = [(posterior.factors[0] * lapse_grid.lapse_prior).sum(axis=0) @ lapses for posterior in (none, many)]
    assert mean_rates[0] < 0.01
    assert 0.04 < mean_rates[1] < 0.12  # 3 of 40
    assert min(none.below, none.above, many.below, many.above) >= 0.0
    assert none.below + none.above < many.below + many.above


def test_many_answers_find_the_planted_function():
    fine_grid = grid(thresholds=evenly(-1.5, 0.0, 61), widths=geometric(0.5, 4.0, 9))
    levels = evenly(-1.5, 0.0, 15)
    p = success("weibull", levels, -0.7, fine_grid.widths[4], 0.5, 0.02)
    fitted = fit(levels, 1e4 * p, 1e4 * (1 - p), fine_grid)
    weights = fitted.weights
    assert fitted.threshold == pytest.approx(-0.7, abs=0.01)
    assert weights.sum(axis=(0, 2, 3)).argmax() == 4
    assert weights.sum(axis=(0, 1, 3)).argmax() == 1


def test_one_answer_does_not_exclude_any_cell():
    certain = grid(guesses=(0.0,), lapses=(0.0,), lapse_prior=(1.0,), widths=(0.01, 0.02))
    weights = fit((-5.0, 5.0), (1, 0), (0, 1), certain).weights
    assert np.isfinite(weights).all()
    assert weights.sum() == pytest.approx(1.0)


def test_quantiles_are_interpolated_between_the_edges_of_the_cells():
    centres, weights = (0.0, 1.0, 2.0, 3.0), (0.1, 0.4, 0.4, 0.1)
    assert quantile(centres, weights, 0.5) == pytest.approx(1.5)
    assert quantile(centres, weights, 0.3) == pytest.approx(1.0)
    assert quantile(centres, weights, 0.0) == pytest.approx(-0.5)
    assert quantile(centres, weights, 1.0) == pytest.approx(3.5)


FAMILIES = ("weibull", "normal", "logistic")


@pytest.mark.parametrize("family", FAMILIES)
def test_threshold_is_the_middle_and_the_width_reaches_from_5_to_95_percent(family):
    assert rise(family, -0.7, -0.7, 1.3) == pytest.approx(0.5, abs=1e-12)
    low, high = (-0.7 + 1.3 * position(family, share) for share in (0.05, 0.95))
    assert high - low == pytest.approx(1.3, abs=1e-12)
    assert rise(family, [low, high], -0.7, 1.3) == pytest.approx([0.05, 0.95], abs=1e-12)


@pytest.mark.parametrize("family", FAMILIES)
def test_success_goes_from_guessing_to_lapsing_and_stays_finite(family):
    probabilities = success(family, [-1e6, 1e6], 0.0, 0.5, 0.25, 0.04)
    assert probabilities == pytest.approx([0.25, 0.96], abs=1e-12)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_level_at_a_percentage_is_where_the_function_has_it(family):
    u = level_at(family, 75.0, -0.5, 1.4, 0.5, 0.02)
    assert success(family, u, -0.5, 1.4, 0.5, 0.02) == pytest.approx(0.75, abs=1e-12)
    assert math.isnan(level_at(family, 99.0, -0.5, 1.4, 0.5, 0.02))
    assert math.isnan(level_at(family, 50.0, -0.5, 1.4, 0.5, 0.02))


def test_a_linear_observer_is_a_weibull_of_a_known_width():
    """A difference of ln(1 + w) with normal noise: the Weibull function has the same threshold within 2.4 %."""
    from scipy.optimize import curve_fit
    from scipy.special import ndtr

    w75 = 0.2
    u = np.linspace(math.log10(0.02), math.log10(0.6), 31)
    spread = math.log1p(w75) / 0.6744897501960817
    expected = ndtr(np.log1p(10.0**u) / spread)
    (threshold, width), _ = curve_fit(
        lambda at, middle, wide: success("weibull", at, middle, wide, 0.5, 0.0), u, expected, (-0.7, 1.4)
    )
    assert 10.0**threshold == pytest.approx(w75, rel=0.024)
    assert 1.4 <= width <= 1.7


@pytest.mark.parametrize("family", FAMILIES)
def test_forward_and_inverse_agree_to_rounding_and_are_those_of_scipy(family):
    from scipy import stats

    shares = np.linspace(0.001, 0.999, 201)
    x = np.array([position(family, float(share)) for share in shares])
    assert rise(family, -0.7 + 1.3 * x, -0.7, 1.3) == pytest.approx(shares, abs=1e-12)
    theirs = {
        "weibull": stats.weibull_min.cdf(10 ** (KAPPA * x), 1, scale=1 / math.log(2)),
        "normal": stats.norm.cdf(2 * stats.norm.ppf(0.95) * x),
        "logistic": stats.logistic.cdf(2 * math.log(19) * x),
    }
    assert theirs[family] == pytest.approx(shares, abs=1e-12)


# Beetles killed by carbon disulphide (Bliss 1935), and the threshold of maximum likelihood.
DOSES = (1.6907, 1.7242, 1.7552, 1.7842, 1.8113, 1.8369, 1.8610, 1.8839)
BEETLES = np.array([59, 60, 62, 56, 63, 59, 62, 60])
KILLED = np.array([6, 13, 18, 28, 52, 53, 61, 60])


def test_the_published_threshold_of_beetles():
    plain = Grid(
        family="logistic",
        thresholds=evenly(1.7, 1.85, 301),
        widths=geometric(0.02, 1.0, 40),
        width_prior=None,
        lapses=(0.0,),
        lapse_prior=(1.0,),
        guesses=(0.0,),
    )
    fitted = fit(DOSES, KILLED, BEETLES - KILLED, plain)
    assert fitted.threshold == pytest.approx(1.77172, abs=3e-4)
    assert 2 * math.log(19) / fitted.others[0] == pytest.approx(34.2703, rel=0.03)
    low, high = fitted.interval
    assert high - low == pytest.approx(0.0152, rel=0.05)  # Wald's, from the published errors


@pytest.mark.parametrize("freedom", [1, 2, 3, 9, 19, 99, 2000, 2001, 50_000])
def test_students_quantile_is_scipys(freedom):
    assert student_975(freedom) == pytest.approx(student.ppf(0.975, freedom), rel=1e-6)


def log10_of(percent):
    return math.log10(1 + percent / 100)


@pytest.mark.parametrize(
    ("participants", "trials", "percent"), [(10, 60, 27), (20, 60, 17), (20, 100, 15)]
)  # thresholds of people who differ by a factor of 1.2, with a standard deviation of 28 % at 60 trials
def test_a_groups_interval_is_students_over_errors_and_people(participants, trials, percent):
    expected = Expected(
        spacing="log", trials=60, standards=1, halves={}, spreads={"": 0.28 / math.log(10)}, threshold=0.2, decade=1.0
    )
    assert 100 * expected.group_half_width(participants, trials) == pytest.approx(percent, abs=1.5)


def test_the_min_sample_and_trials_for_a_precision():
    expected = Expected(spacing="log", trials=20, standards=1, halves={}, spreads={"": 0.2}, threshold=0.2, decade=1.0)
    people = expected.participants_for(0.15)
    assert expected.group_half_width(people) <= 0.15 < expected.group_half_width(people - 1)
    trials = expected.trials_for(0.15, 20)
    assert expected.group_half_width(20, trials) <= 0.15 < expected.group_half_width(20, trials - 10)
    assert expected.trials_for(0.05, 10) is None  # people differ by more
    assert expected.participants_for(0.001) is None
    assert expected.group_half_width(1) == math.inf


def test_percentages_are_those_of_garcia_perez():
    percentages = [100 * converges_to(n, ratio) for n, ratio in RATIOS.items()]
    assert percentages == pytest.approx([77.85, 80.35, 83.15, 85.84], abs=0.005)
    assert 100 * converges_to(2, 1.0) == pytest.approx(70.7, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("down_after", "ratio", "reached"),
    [
        (1, RATIOS[1], (78.1, 78.3, 78.7, 79.5)),
        (2, RATIOS[2], (80.4, 80.5, 80.7, 81.3)),
        (3, RATIOS[3], (83.2, 83.2, 83.3, 83.6)),
        (4, RATIOS[4], (85.8, 85.9, 86.0, 86.2)),
        (2, 1.0, (69.6, 68.5, 66.0, 61.0)),
        (3, 1.0, (79.0, 78.5, 77.7, 75.0)),
    ],
)
def test_percent_correct_at_the_mean_of_reversals_in_the_long_run(down_after, ratio, reached):
    """Percentages by the step up in observer SDs: those of equal steps depend on it, those of weighted steps hardly."""
    draw = np.random.default_rng(down_after)
    for step_up, percent in zip((0.25, 0.5, 1.0, 2.0), reached, strict=True):
        staircase = Staircase(down_after=down_after, step_up=step_up, ratio=ratio, low=-50.0, high=50.0, begin=0.5)
        u, run, before, reversals = 0.5, 0, 0, []
        for chance in draw.random(40_000):  # the rule itself, since `next` looks at all answers each time
            success = chance < 0.5 + 0.5 * ndtr(u)
            run = run + 1 if success else 0
            move = 1 if not success else -1 if run == down_after else 0
            run = 0 if move else run
            if move * before < 0:
                reversals.append(u)
            before = move or before
            u += staircase.step_up * move * (ratio if move < 0 else 1.0)
        assert 100 * (0.5 + 0.5 * ndtr(np.mean(reversals[2:]))) == pytest.approx(percent, abs=0.75)

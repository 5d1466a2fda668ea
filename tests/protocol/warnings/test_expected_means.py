"""What check expects of d′, d_a and exponents, against closed forms and simulated answers through the program."""

import math

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.levels.sensitivities import sensitivities
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.trials.designs import Rated, default_design
from study_app.protocol.trials.methods import Constant
from study_app.protocol.trials.stimuli import Stimulus
from study_app.protocol.warnings.expected_precision import (
    EstimationPlan,
    MeanPlan,
    RatingPlan,
    SensitivityPlan,
    expected_mean,
    mean_plan,
)
from study_app.psychophysics.detection import NORMAL, two_intervals
from study_app.psychophysics.people import ESTIMATE_NOISE

DESIGNS = ("2ifc", "3ifc", "4ifc", "abx", "oddity", "samedifferent", "yesno")
COMPARED = """
format = 2
study.name = "compared"
liquids.thin.drag = { law = "linear", damping_nspm = 8 }
liquids.thick.drag = { law = "linear", damping_nspm = 9 }
tasks.stir.kind = "follow"
blocks.pairs = { conditions = ["thin", "thick"], standard = "thin", design = "DESIGN", repetitions = REPEATED }
"""
RATED = """
format = 2
study.name = "rated"
liquids.thin.drag = { law = "linear", damping_nspm = 8 }
tasks.stir.kind = "follow"
scales.five.labels.en = ["very thin", "thin", "medium", "thick", "very thick"]
designs.rated = { kind = "rating", scale = "five" }
methods.few = { kind = "constant", levels = 4, repetitions = 12 }
blocks.rate = { stimulus = "damping", design = "rated", method = "few" }
stimuli.damping = { vary = "damping_nspm", STIMULUS }
"""


def study_of_comparisons(design: str = "2ifc", repetitions: int = 40, more: str = "") -> Protocol:
    return parse((COMPARED.replace("DESIGN", design).replace("REPEATED", str(repetitions)) + more).encode(), "x.toml")


def rated(more: str = "", stimulus: str = 'level = "value", levels = [1, 12]') -> Protocol:
    return parse((RATED.replace("STIMULUS", stimulus) + more).encode(), "x.toml")


def plan_of(protocol: Protocol, block: str = "pairs") -> MeanPlan:
    plan = mean_plan(protocol, protocol.blocks[block])
    assert plan is not None
    return plan


def test_the_spread_of_d_prime_is_that_of_the_binomial_counts() -> None:
    n, right = 20, NORMAL.cdf(1 / math.sqrt(2))  # an unbiased observer of two intervals, d′ = 1
    chances = [math.comb(n, k) * right**k * (1 - right) ** (n - k) for k in range(n + 1)]
    pairs = [
        (chances[hits] * chances[right_of_second], expectation.d_prime)
        for hits in range(n + 1)
        for right_of_second in range(n + 1)
        if (expectation := two_intervals(hits, n, n - right_of_second, n)) is not None
    ]
    mean = sum(chance * value for chance, value in pairs)
    exact = math.sqrt(sum(chance * (value - mean) ** 2 for chance, value in pairs))
    expectation = expected_mean(plan_of(study_of_comparisons()))
    assert (expectation.trials, expectation.threshold) == (40, 1.0)
    assert expectation.spread == pytest.approx(exact, rel=0.08)
    assert expectation.median == pytest.approx(1.96 * expectation.spread, rel=1e-4)


@pytest.mark.parametrize("roving", [False, True])
@pytest.mark.parametrize("design", DESIGNS)
def test_many_trials_recover_the_d_prime_of_every_design(design: str, *, roving: bool) -> None:
    plan = SensitivityPlan(default_design(design), 60_000, roving, "standard")
    for planted in (0.5, 1.0, 2.0):
        assert plan.estimates(np.array([planted]), np.random.default_rng(2))[0] == pytest.approx(planted, abs=0.05)


def test_the_spread_of_an_exponent_is_that_of_a_least_squares_slope() -> None:
    plan = plan_of(load("thickness"), "thickness")
    assert isinstance(plan, EstimationPlan)
    assert (len(plan.levels), plan.repetitions, plan.trials, plan.value) == (9, 4, 36, 0.44)
    x = np.log(plan.levels)
    exact = ESTIMATE_NOISE / math.sqrt(4 * ((x - x.mean()) ** 2).sum())
    assert expected_mean(plan).spread == pytest.approx(exact, rel=0.06)
    assert expected_mean(plan.with_trials(144)).spread == pytest.approx(exact / 2, rel=0.06)


def exact_spread(value: float, ratings: int) -> float:
    """Return the standard deviation of d_a from ungrouped normal observations, by that of the area under the ROC curve.

    The area's variance is that of Mann and Whitney's statistic (Hanley & McNeil 1982, Radiology 143, 29), with the
    shares of pairs that share an observation from 10⁶ draws.
    """
    area, draw = NORMAL.cdf(value / math.sqrt(2)), np.random.default_rng(4)
    signal, noise = draw.normal(value, 1, 10**6), draw.normal(0, 1, 10**6)
    both = [float(np.mean(_cdf(sample) ** 2)) - area**2 for sample in (signal, value - noise)]
    variance = (area * (1 - area) + (ratings - 1) * sum(both)) / ratings**2
    return math.sqrt(2 * variance) / NORMAL.pdf(NORMAL.inv_cdf(area))


def _cdf(x: np.ndarray) -> np.ndarray:
    return np.asarray(norm.cdf(x), float)


@pytest.mark.parametrize("ratings", [40, 160])
def test_the_spread_of_d_a_is_that_of_the_area_under_the_roc_curve(ratings: int) -> None:
    expectation = expected_mean(RatingPlan(11, ratings))
    assert (expectation.trials, expectation.threshold) == (ratings, 1.0)
    assert expectation.spread == pytest.approx(exact_spread(1.0, ratings), rel=0.08)
    assert expectation.median == pytest.approx(1.96 * expectation.spread, rel=1e-4)


@pytest.mark.slow
def test_the_spread_of_d_a_is_that_of_ratings_that_the_report_analyses() -> None:
    """People name the nearest of seven points, whatever the program assumes of criteria."""
    draw, people, ratings = np.random.default_rng(3), 400, 30
    points = [np.clip(np.round(4 + 1.6 * (draw.normal(mean, 1, (people, ratings)) - 0.5)), 1, 7) for mean in (0, 1)]
    rows = pd.concat(
        pd.DataFrame({"participant": np.repeat(np.arange(people), ratings), "value": some.ravel(), "level": level})
        for level, some in zip((1.0, 2.0), points, strict=True)
    ).assign(block="b", response="rated", analysed=True)
    stimulus = Stimulus(vary="damping_nspm", level="value", levels=(1, 2))
    block = LevelBlock("b", "Block", "main", Rated(scale="seven"), stimulus, (), Constant())
    estimates = [
        sensitivity.d_prime for sensitivity in sensitivities(block, rows) if sensitivity.participant is not None
    ]
    assert len(estimates) == people
    expected = expected_mean(RatingPlan(7, ratings))
    assert np.std([estimate for estimate in estimates if estimate is not None]) == pytest.approx(
        expected.spread, rel=0.12
    )


def test_d_a_is_not_expected_for_one_level_or_for_added_levels() -> None:
    single_level, weber = rated().model_copy(), rated(stimulus="levels = [0.1, 0.6], standards = [4, 8]")
    alone = {"few": Constant(levels=(2.0,), repetitions=12)}
    assert mean_plan(single_level.model_copy(update={"methods": alone}), single_level.blocks["rate"]) is None
    assert mean_plan(weber, weber.blocks["rate"]) is None


def test_an_unpublished_exponent_is_one_half_and_a_modulus_does_not_count_as_a_trial() -> None:
    thickness = load("thickness")
    number = thickness.designs["number"].model_copy(update={"modulus": {"level": 2, "number": 10}})
    changed = thickness.model_copy(update={"analysis": None, "designs": {"number": number}})
    plan = plan_of(changed, "thickness")
    assert (plan.trials, plan.value) == (36, 0.5)

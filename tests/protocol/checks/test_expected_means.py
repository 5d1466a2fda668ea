"""What check expects of d′ and of exponents, against closed forms and simulated answers through the program."""

from __future__ import annotations

import math

import numpy as np
import pytest

from study_app.protocol.checks.expected_means import (
    EstimationPlan,
    SensitivityPlan,
    expected_mean,
    mean_plan,
)
from study_app.protocol.checks.expected_precision import imprecise
from study_app.protocol.describe import describe
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.trials.kinds import default_design
from study_app.psychophysics.detection import NORMAL, two_intervals
from study_app.psychophysics.precision import ESTIMATE_NOISE
from study_app.validation.thresholds.estimated_exponents import planted_exponent, simulate_estimates

DESIGNS = ("2ifc", "3ifc", "4ifc", "abx", "oddity", "samedifferent", "yesno")
COMPARED = """
format = 2
study.name = "compared"
liquids.thin.drag = { law = "linear", damping_nspm = 8 }
liquids.thick.drag = { law = "linear", damping_nspm = 9 }
tasks.stir.kind = "follow"
blocks.pairs = { conditions = ["thin", "thick"], standard = "thin", design = "DESIGN", repetitions = REPEATED }
"""
PLANNED = "analysis = { participants = 10, precision = 0.1 }\n"


def compared(design: str = "2ifc", repetitions: int = 40, more: str = "") -> Protocol:
    return parse((COMPARED.replace("DESIGN", design).replace("REPEATED", str(repetitions)) + more).encode(), "x.toml")


def plan_of(protocol: Protocol, block: str = "pairs") -> SensitivityPlan | EstimationPlan:
    plan = mean_plan(protocol, protocol.blocks[block])
    assert plan is not None
    return plan


def test_the_spread_of_d_prime_is_that_of_the_binomial_counts() -> None:
    n, right = 20, NORMAL.cdf(1 / math.sqrt(2))  # an unbiased observer of two intervals, d′ = 1
    chances = [math.comb(n, k) * right**k * (1 - right) ** (n - k) for k in range(n + 1)]
    pairs = [
        (chances[hits] * chances[right_of_second], found.d_prime)
        for hits in range(n + 1)
        for right_of_second in range(n + 1)
        if (found := two_intervals(hits, n, n - right_of_second, n)) is not None
    ]
    mean = sum(chance * value for chance, value in pairs)
    exact = math.sqrt(sum(chance * (value - mean) ** 2 for chance, value in pairs))
    found = expected_mean(plan_of(compared()))
    assert (found.trials, found.threshold) == (40, 1.0)
    assert found.spread == pytest.approx(exact, rel=0.08)
    assert found.half == pytest.approx(1.96 * found.spread, rel=1e-4)


@pytest.mark.parametrize("roving", [False, True])
@pytest.mark.parametrize("design", DESIGNS)
def test_many_trials_recover_the_d_prime_of_every_design(design: str, *, roving: bool) -> None:
    plan = SensitivityPlan(default_design(design), 60_000, roving, "standard")
    for planted in (0.5, 1.0, 2.0):
        assert plan.estimates(np.array([planted]), np.random.default_rng(2))[0] == pytest.approx(planted, abs=0.05)


@pytest.mark.parametrize("design", ["2ifc", "abx", "oddity", "samedifferent"])
def test_four_times_the_trials_halve_the_spread(design: str) -> None:
    few, many = (
        expected_mean(SensitivityPlan(default_design(design), n, roving=False, of_each="")) for n in (120, 480)
    )
    assert many.spread == pytest.approx(few.spread / 2, rel=0.2)


def test_the_spread_of_an_exponent_is_that_of_a_least_squares_slope() -> None:
    plan = plan_of(load("thickness"), "thickness")
    assert isinstance(plan, EstimationPlan)
    assert (len(plan.levels), plan.repetitions, plan.trials, plan.value) == (9, 4, 36, 0.44)
    x = np.log(plan.levels)
    exact = ESTIMATE_NOISE / math.sqrt(4 * ((x - x.mean()) ** 2).sum())
    assert expected_mean(plan).spread == pytest.approx(exact, rel=0.06)
    assert expected_mean(plan.with_trials(144)).spread == pytest.approx(exact / 2, rel=0.06)


@pytest.mark.slow
def test_the_spread_is_that_of_exponents_from_simulated_answers() -> None:
    protocol = load("thickness")
    planted = planted_exponent("thickness", protocol)
    assert planted is not None
    found = np.concatenate([simulate_estimates(planted, number, seed=1).own for number in range(30)])
    expected = expected_mean(plan_of(protocol, "thickness"))
    assert found.std(ddof=1) == pytest.approx(expected.spread, rel=0.12)  # 300 participants: ±4 %
    means = found.reshape(-1, 10).mean(axis=1)
    assert means.std(ddof=1) == pytest.approx(expected.spread / math.sqrt(10), rel=0.4)  # equal people


def test_check_prints_the_intervals() -> None:
    said = " ".join(describe(load("thickness")).split())
    found = expected_mean(plan_of(load("thickness"), "thickness"))
    assert (
        f"Expected precision exponent of 0.44: one participant ±{found.half:.2g}; 20 participants "
        f"±{100 * found.of_group(20):.0f} % (95 % intervals)" in said
    )
    found = expected_mean(plan_of(compared()))
    said = " ".join(describe(compared(more=PLANNED)).split())
    half = f"{100 * found.of_group(10):.0f}"
    assert f"Expected precision at d′ = 1: one participant ±{found.half:.2g}; 10 participants ±{half} %" in said


def test_too_few_repetitions_for_the_planned_precision_are_a_warning() -> None:
    short = compared(more=PLANNED)
    found = expected_mean(plan_of(short))
    (sentence,) = imprecise(short, short.blocks["pairs"])
    assert sentence == (
        f"blocks.pairs.repetitions: 40 trials per comparison give ±{100 * found.of_group(10):.0f} % with 10 "
        f"participants, not ±10 %: {found.participants_for(0.1)} participants"
    )
    assert sentence in describe(short)
    thickness = load("thickness")
    assert thickness.analysis is not None
    wanted = thickness.analysis.model_copy(update={"precision": 0.05})
    (sentence,) = imprecise(thickness.model_copy(update={"analysis": wanted}), thickness.blocks["thickness"])
    assert sentence.startswith("methods.nine.repetitions: 36 trials give ±9 % with 20 participants, not ±5 %: ")


def test_an_exponent_that_was_not_published_is_one_half_and_a_modulus_is_no_trial() -> None:
    thickness = load("thickness")
    number = thickness.designs["number"].model_copy(update={"modulus": {"level": 2, "number": 10}})
    changed = thickness.model_copy(update={"analysis": None, "designs": {"number": number}})
    plan = plan_of(changed, "thickness")
    assert (plan.trials, plan.value) == (36, 0.5)


def test_blocks_of_statements_thresholds_and_ratings_have_neither() -> None:
    for name, block in (("rek2024", "delays"), ("viscosityjnd", "viscosity")):
        protocol = load(name)
        assert mean_plan(protocol, protocol.blocks[block]) is None

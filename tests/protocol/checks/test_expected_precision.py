"""What check says of the precision that a block's thresholds are expected to have."""

import math

import numpy as np
import pytest

from study_app.protocol.checks.expected_precision import (
    ThresholdPlan,
    expected,
    imprecise,
    precision_rows,
    threshold_plan,
)
from study_app.protocol.describe import describe
from study_app.protocol.load import examined, load, parse, read_document

TEXT = """
format = 2
study.name = "smallest"
liquids.damper.drag = { law = "linear", damping_nspm = 8 }
tasks.stir.kind = "follow"
stimuli.damping = { vary = "damping_nspm", levels = [0.02, 0.6] }
blocks.thicker = { stimulus = "damping", design = "DESIGN", method = "m"BLOCK }
methods.m = { METHOD }
"""
PLANNED = "analysis = { participants = 20, precision = 0.15 }\n"


def study(method='kind = "questplus"', more="", design="2ifc", block=""):
    text = TEXT.replace("METHOD", method).replace("DESIGN", design).replace("BLOCK", block) + more
    return parse(text.encode(), "smallest.toml")


def plan_of(protocol) -> ThresholdPlan:
    plan = threshold_plan(protocol, protocol.blocks["thicker"])
    assert plan is not None
    return plan


@pytest.mark.slow
def test_estimates_are_unbiased_and_as_precise_as_measured():
    plan = plan_of(study())  # 60 trials, a Weber fraction of 0.2: standard deviation 26 ± 3 %, coverage 98 ± 3 %
    truth = np.full(400, math.log10(0.2))
    found = plan.simulate(truth, np.random.default_rng(1))
    errors = (found.medians - truth) * math.log(10)
    assert abs(errors.mean()) < 0.05
    assert errors.std() == pytest.approx(0.27, abs=0.03)
    assert 0.93 <= ((found.lows < truth) & (truth < found.highs)).mean() <= 0.99


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("trials", [40, 80, 160])
def test_intervals_of_1000_observers_cover_their_thresholds(trials):
    plan, rng = plan_of(study(f'kind = "questplus", trials = {trials}')), np.random.default_rng(trials)
    truth = math.log10(0.2) + math.log10(1.2) * rng.standard_normal(1000)
    found = plan.simulate(truth, rng)
    assert 0.93 <= ((found.lows < truth) & (truth < found.highs)).mean() <= 0.99
    assert abs((found.medians - truth).mean() * math.log(10)) <= 0.05


@pytest.mark.variants(3)
@pytest.mark.slow
@pytest.mark.parametrize("method", ['kind = "questplus"', 'kind = "updown"', 'kind = "constant"'])
@pytest.mark.parametrize("design", ["2ifc", pytest.param("4ifc", marks=pytest.mark.nightly), "yesno"])
def test_more_trials_make_every_method_more_precise(method, design):
    plan = plan_of(study(method, design=design))
    few, many = (expected(plan.with_trials(trials)) for trials in (28, 140))
    assert few.trials == pytest.approx(28, abs=4)
    assert many.trials == pytest.approx(140, abs=4)
    assert many.spread < 0.8 * few.spread
    assert many.half < 0.8 * few.half
    assert 0.5 < few.spread * 1.96 / few.half < 1.5  # the intervals are as wide as the errors


def test_tracks_and_catch_trials_are_those_of_the_block():
    plan = plan_of(study('kind = "questplus", tracks = 2'))
    assert (plan.trials, plan.catch, plan.method.tracks) == (60, 0, 2)
    caught = plan_of(study(block=", catch = { share = 0.1 }"))
    assert caught.catch == 6
    assert caught.with_trials(30).catch == 3


@pytest.mark.slow
def test_long_tracks_are_scaled_from_shorter_ones():
    plan = plan_of(study('kind = "questplus", trials = 1000'))
    long, short = expected(plan), expected(plan.with_trials(200))
    assert long.trials == 1000
    assert long.spread == pytest.approx(short.spread / math.sqrt(5))


@pytest.mark.slow
def test_check_prints_the_intervals_of_one_participant_and_of_the_group():
    said = " ".join(describe(study(more=PLANNED)).split())
    found = expected(plan_of(study()))
    assert (
        f"Expected precision one participant ×/÷ {10**found.half:.1f}; 20 participants ±16 % (95 % intervals)" in said
    )
    said = " ".join(describe(load("viscosityjnd")).split())
    assert "participants ±" in said
    assert "over all standards (95 % intervals)" in said


@pytest.mark.slow
def test_check_prints_units_where_levels_are_not_spaced_by_logarithms():
    text = TEXT.replace("levels = [0.02, 0.6]", 'level = "difference", levels = [1, 8], spacing = "linear"')
    protocol = parse(
        text.replace("METHOD", 'kind = "questplus"').replace("DESIGN", "2ifc").replace("BLOCK", "").encode(), "x"
    )
    assert " N·s/m (95 % intervals)" in " ".join(describe(protocol).split())


@pytest.mark.slow
def test_too_few_trials_for_the_planned_precision_are_a_warning():
    short = study('kind = "questplus", trials = 20', PLANNED)
    (sentence,) = imprecise(short, short.blocks["thicker"])
    found = expected(plan_of(short))
    people, trials = found.participants_for(0.15), found.trials_for(0.15, 20)
    assert sentence == (
        f"methods.m.trials: 20 trials per standard give ±{100 * found.of_group(20):.0f} % with 20 planned "
        f"participants, not ±15 %: about {trials} trials or {people} participants would on average"
    )
    assert 22 < 100 * found.of_group(20) < 28
    assert 40 < people < 60
    assert sentence in describe(short)
    enough = study('kind = "questplus", trials = 120', PLANNED)
    assert not list(imprecise(enough, enough.blocks["thicker"]))


@pytest.mark.slow
def test_where_limits_clip_the_levels_no_precision_is_expected():
    for damping, what in (
        ("60", "the standard is"),
        ("52", "levels above 0.0192 are"),
        ("8, 52", "levels above 0.0192 of standard 52 are"),
        ("8, 60", "the standard 60 is"),
    ):
        text = TEXT.replace("0.6]", f"0.6], standards = [{damping}]").replace("BLOCK", "")
        text = text.replace("METHOD", 'kind = "questplus", trials = 20').replace("DESIGN", "2ifc") + PLANNED
        clipped, faults = examined(read_document(text.encode(), "clipped.toml")[0])
        assert faults
        assert list(imprecise(clipped, clipped.blocks["thicker"])) == [
            f"stimuli.damping.levels: ±15 % cannot be measured at a threshold of 0.11: {what} clipped"
        ]
        assert dict(precision_rows(clipped, clipped.blocks["thicker"])) == {
            "Expected precision": "none: the levels of most thresholds are clipped"
        }


@pytest.mark.slow
def test_a_precision_that_no_trials_reach_asks_for_participants_alone():
    short = study('kind = "questplus", trials = 20', "analysis = { participants = 4, precision = 0.05 }\n")
    (sentence,) = imprecise(short, short.blocks["thicker"])
    assert "trials, or" not in sentence
    assert sentence.endswith(" participants would on average")


@pytest.mark.parametrize("name", ["rek2024", "demo"])
def test_studies_of_statements_have_no_precision(name):
    assert "Expected precision" not in describe(load(name))

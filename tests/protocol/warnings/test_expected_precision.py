"""What check says of the precision that a block's thresholds are expected to have."""

import math
from dataclasses import replace

import numpy as np
import pytest

from study_app.protocol.load import parse, read_document, validate_document
from study_app.protocol.trials.stimuli import SESSION_SD
from study_app.protocol.warnings.expected_precision import (
    ThresholdPlan,
    expected,
    expected_of,
    imprecise,
    precision_rows,
    threshold_plan,
)

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


@pytest.mark.parametrize(("level", "unit"), [("weber", ""), ("difference", " N·s/m"), ("value", " N·s/m")])
def test_only_weber_fractions_lack_a_unit(level, unit):
    plan = plan_of(study())
    stimulus = plan.stimulus.model_copy(update={"level": level})
    assert replace(plan, stimulus=stimulus).unit == unit


def test_catch_and_noise_trials_have_neither_a_place_nor_an_interval():
    """Levels are 0.02 to 0.6; two of the observers nearly always notice 0.6, the last one only by chance or a lapse."""
    plan = plan_of(study('kind = "constant", repetitions = 9', design="yesno", block=", catch = { share = 0.1 }"))
    answered = plan.answers(np.log10([0.03, 0.05, 40.0]), np.random.default_rng(4))
    for answers, level in ((answered.catch, math.log10(0.6)), (answered.noise, -math.inf)):
        assert answers.levels.shape == answers.successes.shape
        assert answers.successes.shape[0] == 3
        assert answers.successes.shape[1] > 0
        assert np.unique(answers.levels).tolist() == [level]
        assert np.unique([answers.towards, answers.before]).tolist() == [0.0]
        assert np.unique(answers.done).tolist() == [0.5]
    notices = answered.catch.successes.mean(axis=1)
    assert min(notices[:2]) > 0.7 > notices[2]


@pytest.mark.slow
def test_estimates_are_unbiased_and_as_precise_as_measured():
    plan = plan_of(study())  # 60 trials, a Weber fraction of 0.2: standard deviation 26 ± 3 %, coverage 98 ± 3 %
    truth = np.full(400, math.log10(0.2))
    estimates = plan.simulate(truth, np.random.default_rng(1))
    errors = (estimates.medians - truth) * math.log(10)
    assert abs(errors.mean()) < 0.05
    assert errors.std() == pytest.approx(0.27, abs=0.03)
    assert 0.93 <= ((estimates.lows < truth) & (truth < estimates.highs)).mean() <= 0.99


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("trials", [40, 80, 160])
def test_intervals_of_1000_observers_cover_their_thresholds(trials):
    plan, rng = plan_of(study(f'kind = "questplus", trials = {trials}')), np.random.default_rng(trials)
    truth = math.log10(0.2) + math.log10(1.2) * rng.standard_normal(1000)
    in_the_session = truth + SESSION_SD * rng.standard_normal(1000)
    estimates = plan.simulate(in_the_session, rng)
    assert 0.93 <= ((estimates.lows < truth) & (truth < estimates.highs)).mean() <= 0.99
    assert abs((estimates.medians - truth).mean() * math.log(10)) <= 0.05


@pytest.mark.variants(3)
@pytest.mark.slow
@pytest.mark.parametrize("method", ['kind = "questplus"', 'kind = "updown"', 'kind = "constant"'])
@pytest.mark.parametrize("design", ["2ifc", pytest.param("4ifc", marks=pytest.mark.nightly), "yesno"])
def test_more_trials_make_every_method_more_precise(method, design):
    plan = plan_of(study(method, design=design))
    few, many = (expected(plan.with_trials(trials)) for trials in (28, 140))
    assert few.trials == pytest.approx(28, abs=4)
    assert many.trials == pytest.approx(140, abs=4)
    assert many.spread < 0.85 * few.spread
    assert many.worst[1] < 0.85 * few.worst[1]
    halves = np.concatenate([*few.halves.values()])
    assert 0.5 < few.spread * 1.96 / halves.mean() < 1.5  # the intervals are as wide as the errors


@pytest.mark.slow
def test_long_tracks_are_scaled_from_shorter_ones():
    plan = plan_of(study('kind = "questplus", trials = 1000'))
    long, short = expected(plan), expected(plan.with_trials(200))
    assert long.trials == 1000
    assert long.spread == pytest.approx(short.spread / math.sqrt(5))


@pytest.mark.slow
def test_no_precision_is_expected_if_limits_clip_the_levels():
    for damping, what in (
        ("60", "the standard is"),
        ("52", "levels above 0.0192 are"),
        ("8, 52", "levels above 0.0192 for standard 52 are"),
        ("8, 60", "the standard 60 is"),
    ):
        text = TEXT.replace("0.6]", f"0.6], standards = [{damping}]").replace("BLOCK", "")
        text = text.replace("METHOD", 'kind = "questplus", trials = 20').replace("DESIGN", "2ifc") + PLANNED
        clipped, faults = validate_document(read_document(text.encode(), "clipped.toml")[0])
        assert faults
        assert list(imprecise(clipped, clipped.blocks["thicker"])) == [
            "stimuli.damping.levels: a precision of ±15 % cannot be achieved at a threshold of 0.11, "
            f"because {what} clipped"
        ]
        assert dict(precision_rows(clipped, clipped.blocks["thicker"])) == {
            "Expected precision": "not available, because the levels for most thresholds are clipped"
        }


@pytest.mark.slow
@pytest.mark.parametrize("decided", [(31, 0.15), (31, None), (None, 0.2), (None, None)])
def test_the_planned_participants_are_said_before_those_a_precision_requires(decided):
    keys = {"participants": decided[0], "precision": decided[1]}
    table = ", ".join(f"{key} = {value}" for key, value in keys.items() if value is not None)
    protocol = study(more=f"analysis = {{ {table} }}\n")
    expectation = expected_of(plan_of(protocol))
    statement = dict(precision_rows(protocol, protocol.blocks["thicker"]))["Expected precision"]
    planned = f"; ±{100 * expectation.group_half_width(31):.0f} % for 31 participants"
    required = f"; ±20 % requires {expectation.participants_for(0.2)} participants"
    assert [text for text in (planned, required) if text in statement] == (
        [planned] if decided[0] else [required] if decided[1] else []
    )
    warned = list(imprecise(protocol, protocol.blocks["thicker"]))
    assert bool(warned) == (None not in decided and expectation.group_half_width(31) > 0.15)

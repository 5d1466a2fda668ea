"""The precision of thresholds over participants and trials: simulated studies, and what the command prints."""

import math
from concurrent.futures import Executor, Future
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.analysis.planning.threshold_studies import (
    BATCH,
    PrecisionResult,
    Precisions,
    _kind_sentences,
    plans,
    study_batch,
    sweep,
    threshold_markdown,
)
from study_app.cli import commands
from study_app.errors import AnalysisError
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.warnings.expected_precision import ThresholdPlan, expected_mean, mean_plan

TEXT = """
format = 2
study.name = "smallest"
liquids.damper.drag = { law = "linear", damping_nspm = 8 }
tasks.stir.kind = "follow"
stimuli.damping = { vary = "damping_nspm", levels = [0.02, 0.6], standards = [4, 8], steps = 15 }
blocks.thicker = { stimulus = "damping", design = "2ifc", method = "m" }
methods.m = { kind = "questplus", trials = 20 }
analysis = { participants = 20, precision = 0.3 }
"""


def study(*edits: tuple[str, str]) -> Protocol:
    text = TEXT
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    return parse(text.encode(), "smallest.toml")


class Here(Executor):
    def submit(self, function: Any, /, *words: Any, **options: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(function(*words, **options))
        return future


def swept(
    protocol: Protocol, trials: tuple[int, ...], sizes: tuple[int, ...], studies: int, seed: int = 1
) -> Precisions:
    *_, (finished_studies, results) = sweep(plans(protocol, trials), sizes, studies, seed, Here())
    return Precisions(protocol=protocol, sizes=sizes, studies=finished_studies, asked=studies, seed=seed, found=results)


def test_the_relative_precision_of_a_zero_mean_is_infinite() -> None:
    plan = SimpleNamespace(value=1.0, estimates=lambda truth, _rng: np.tile([-0.7, 0.7], len(truth) // 2))
    batch = study_batch(SimpleNamespace(plan=plan, seed=3), (2, 4))
    assert all((halves == math.inf).all() for halves in batch.halves)


@pytest.mark.slow
def test_thresholds_become_more_precise_with_trials_and_groups_with_participants_too() -> None:
    of = swept(study(), (10, 40), (5, 20), 20)
    few, many = of.found["thicker", 10], of.found["thicker", 40]
    assert few.spread > 1.3 * many.spread
    for result in (few, many):
        assert result.half(0) > 1.5 * result.half(1)
        assert result.within(0, 0.3) < result.within(1, 0.3)
    assert few.half(1) > many.half(1)
    assert few.within(1, 0.2) < many.within(1, 0.2)


@pytest.mark.slow
def test_the_errors_are_those_that_check_expects() -> None:
    from study_app.protocol.warnings.expected_precision import expected, threshold_plan

    protocol = study(("trials = 20", "trials = 50"))
    precisions = swept(protocol, (), (20,), 20).found["thicker", 50]
    plan = threshold_plan(protocol, protocol.blocks["thicker"])
    assert plan is not None
    alone = expected(plan)
    assert alone is not None
    assert precisions.spread == pytest.approx(alone.spread * math.log(10), rel=0.15)
    assert precisions.half(0) == pytest.approx(alone.group_half_width(20), rel=0.15)


def test_exponents_and_d_primes_have_the_spread_that_check_expects() -> None:
    compared = study(
        ('design = "2ifc", method = "m"', 'design = "2ifc", conditions = ["damper", "late"], standard = "damper"'),
        ('stimulus = "damping", ', ""),
        (
            'methods.m = { kind = "questplus", trials = 20 }',
            'conditions.damper.liquid = "damper"\nconditions.late = { liquid = "damper", delay_ms = 90 }',
        ),
        ('stimuli.damping = { vary = "damping_nspm", levels = [0.02, 0.6], standards = [4, 8], steps = 15 }\n', ""),
    )
    for protocol, block, trials in ((load("thickness"), "thickness", 36), (compared, "thicker", 60)):
        precisions = swept(protocol, (trials,), (2, 20), 2 * BATCH)
        plan = mean_plan(protocol, protocol.blocks[block])
        assert plan is not None
        alone = expected_mean(plan.with_trials(trials))
        assert precisions.found[block, trials].spread == pytest.approx(alone.spread / alone.threshold, rel=0.15)
        assert precisions.found[block, trials].half(1) == pytest.approx(alone.group_half_width(20), rel=0.15)
        assert precisions.found[block, trials].half(0) > 3 * precisions.found[block, trials].half(
            1
        )  # two have an interval
        page_text = threshold_markdown(precisions)
        assert f"mean {'exponent of 0.44' if block == 'thickness' else 'd′ of 1'}" in page_text
        assert f"| {'trials' if block == 'thickness' else 'trials per comparison'} | participants |" in page_text


def test_a_study_without_an_interval_is_wider_than_all_others() -> None:
    halves = [
        np.array([0.31, 0.27, math.nan]),
        np.array([math.nan, 0.42, math.nan]),
        np.array([math.nan, 0.58, math.nan]),
    ]
    result = PrecisionResult([np.array([[0.4], [-0.4]])] * 3, halves)
    assert math.isinf(result.half(0))
    assert result.half(1) == 0.42
    assert math.isnan(result.half(2)), "too few participants"
    some = PrecisionResult(result.errors, [np.array([math.nan]), np.array([0.84]), np.array([0.66])])
    assert some.half(0) == 0.84
    known = Precisions(protocol=study(), sizes=(5,), studies=3, asked=3, seed=1, found={("thicker", 20): some})
    assert "–" not in threshold_markdown(known).replace("Hartung–Knapp", "")
    few = PrecisionResult(result.errors, [half[:1] for half in halves])
    unknown = Precisions(protocol=study(), sizes=(5,), studies=3, asked=3, seed=1, found={("thicker", 20): few})
    assert "at least half of the simulated studies do not have an interval" in threshold_markdown(unknown)


def test_the_precision_of_each_type_of_participant_is_that_of_the_largest_group_with_the_most_trials() -> None:
    """The types alternate; studies of the first type have ±9, 10 and 14 %, those of each further type 20 % more."""
    plan = plans(study(), (40,))["thicker"][40]
    assert isinstance(plan, ThresholdPlan)
    kinds = [*plan.kinds]
    of_kinds = [np.array([0.97, of + 0.2 * place]) for of in (0.09, 0.14, 0.1) for place in range(len(kinds))]
    few = PrecisionResult([np.zeros((1, 2))], [np.array([0.8, 0.9])] * len(of_kinds))
    results = {("thicker", 20): few, ("thicker", 40): PrecisionResult([np.zeros((1, 2))] * len(of_kinds), of_kinds)}
    precisions = Precisions(protocol=study(), sizes=(5, 12), studies=9, asked=9, seed=1, found=results)
    middle, worst = len(kinds) // 2, len(kinds) - 1
    assert [*_kind_sentences(precisions, "thicker")] == [
        "",
        "With 12 participants and 40 trials, the precision depends on the type of participant: "
        f"±{10 + 20 * middle} % (median across types), ±{10 + 20 * worst} % at worst ({kinds[worst]}).",
    ]


@pytest.mark.slow
def test_ratings_have_the_spread_that_check_expects() -> None:
    text = (
        TEXT.replace('"2ifc"', '"rated"')
        .replace("[0.02, 0.6], standards = [4, 8]", '[1, 12], level = "value"')
        .replace('kind = "questplus", trials = 20', 'kind = "constant", levels = 4')
    ) + 'designs.rated = { kind = "rating", scale = "five" }\nscales.five.labels.en = ["a", "b", "c", "d", "e"]\n'
    protocol = parse(text.encode(), "rated.toml")
    precisions = swept(protocol, (15, 60), (5, 20), 2 * BATCH)
    for trials in (15, 60):
        plan = mean_plan(protocol, protocol.blocks["thicker"])
        assert plan is not None
        alone, of = expected_mean(plan.with_trials(trials)), precisions.found["thicker", trials]
        assert of.spread == pytest.approx(alone.spread, rel=0.15)
        assert of.half(1) == pytest.approx(alone.group_half_width(20), rel=0.15)
        assert of.half(0) > 1.5 * of.half(1)
    page_text = threshold_markdown(precisions)
    assert "mean d_a of 1" in page_text
    assert "5 points of the scale about equally often" in page_text
    assert "| trials per level | participants |" in page_text


def test_trials_are_rounded_to_a_multiple_of_levels_or_tracks() -> None:
    constant = study(('kind = "questplus", trials = 20', 'kind = "constant", levels = 7'))
    assert list(plans(constant, (30,))["thicker"]) == [28]
    two = study(("trials = 20", "trials = 20, tracks = 2"))
    assert list(plans(two, (31,))["thicker"]) == [32]
    assert list(plans(two, ())["thicker"]) == [20]
    with pytest.raises(AnalysisError, match="specify at least 7"):
        plans(constant, (3,))
    assert plans(load("rek2024"), (30,)) == {}


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("rek2024", "--trials", "30"), "rek2024 does not measure thresholds"),
        (("viscosityjnd", "--trials", "0"), "specify numbers of trials from 1 to 1000"),
        (("viscosityjnd", "--trials", "30,few"), "is not a list of numbers"),
    ],
)
def test_trials_that_make_no_sense_are_a_usage_error(words: tuple[str, ...], line: str) -> None:
    result = CliRunner().invoke(commands, ["power", *words])
    assert result.exit_code == 2
    assert line in " ".join(result.output.split())

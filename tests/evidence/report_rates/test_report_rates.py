"""How often verdicts are wrong: the simulated truth, and the quick way to the same verdicts."""

from dataclasses import replace
from typing import Any

import pytest

from study_app.analysis.evaluate import evaluate_block
from study_app.analysis.findings.delays import ContrastsWithControl, DetectionThreshold, LowestDelay
from study_app.analysis.findings.finding import answers_from_tables
from study_app.analysis.findings.recognition import LiquidRecognition
from study_app.analysis.findings.statement_tests import DelayTrend, MeanTests, Pairs, SettingsDiffer
from study_app.analysis.planning.simulated_studies import Plan, plan
from study_app.analysis.statistics.outcome import Interval
from study_app.analysis.statistics.thresholds import Threshold, detection_threshold
from study_app.evidence.report_rates import simulation as studies
from study_app.evidence.report_rates.simulation import (
    CLAIMED,
    COVERS,
    EXTENTS,
    GENERATORS,
    HALF,
    LOST,
    PRINTED,
    Cell,
    Generator,
    count_single,
    count_studies,
    report_rates_evidence,
    simulate_answers,
    true_effects,
)
from study_app.protocol.load import load
from study_app.protocol.simulated import TrialFeatures


@pytest.fixture(scope="module")
def rek() -> Plan:
    """Return the plan of the thesis' study with a made-up force for each liquid, without a rehearsal."""
    protocol = load("rek2024")
    force_n = {"water": 0.3, "honey": 1.2, "light_oil": 0.6}
    features = {
        (block.id, name): (
            TrialFeatures(
                force_mean_n=force_n.get(name, 0.3),
                force_peak_n=3 * force_n.get(name, 0.3),
                speed_rms_mps=0.1,
                push_share=0.05,
                roughness_n=0.1,
                delay_s=protocol.delay_s(name),
            ),
        )
        for block in protocol.main_blocks
        for name in block.conditions
    }
    return plan(protocol, features)


def test_each_generator_answers_in_its_own_way(rek: Plan) -> None:
    answers, other_answers = (simulate_answers(rek, generator, "full", 20, 3, 1) for generator in GENERATORS)
    assert all((first != second).any() for first, second in zip(answers, other_answers, strict=True))


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("participants", [5, 15])
def test_quick_verdicts_equal_those_of_the_whole_evaluation(rek: Plan, participants: int) -> None:
    people = tuple(f"P{number}" for number in range(participants))
    for extent in EXTENTS:
        answers = simulate_answers(rek, "ordinal probit", extent, participants, 5, 2)
        for block, values in zip(rek.blocks, answers, strict=True):
            single_ = {item.id: values[:, :, [column]] for column, item in enumerate(block.items)}
            whole, quick = (
                evaluate_block(
                    None, answers_from_tables(block, rek.decided, people, single_, verdicts_only=verdicts_only)
                )
                for verdicts_only in (False, True)
            )
            assert [contrast.verdict for contrast in ContrastsWithControl.value_in(quick)] == [
                contrast.verdict for contrast in ContrastsWithControl.value_in(whole)
            ]
            assert (SettingsDiffer.value_in(quick), Pairs.value_in(quick)) == (
                SettingsDiffer.value_in(whole),
                Pairs.value_in(whole),
            )
            assert [step.p_adjusted for step in DelayTrend.value_in(quick)] == [
                step.p_adjusted for step in DelayTrend.value_in(whole)
            ]
            assert (LowestDelay.value_in(quick), DetectionThreshold.value_in(quick), MeanTests.value_in(quick)) == (
                LowestDelay.value_in(whole),
                DetectionThreshold.value_in(whole),
                MeanTests.value_in(whole),
            )
            recognised = LiquidRecognition.value_in(whole), LiquidRecognition.value_in(quick)
            assert len({None if result is None else (result.verdict, result.found.p) for result in recognised}) == 1


@pytest.mark.slow
@pytest.mark.parametrize("generator", GENERATORS)
def test_every_kind_of_study_is_counted(rek: Plan, generator: Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(studies, "TRUTH", 200)
    cells = [Cell(generator, extent, 5) for extent in EXTENTS]
    rates = [rate for cell in cells for rate in count_studies(rek, cell, true_effects(rek, cell), 1, 0, 2)]
    assert {rate.studies for rate in rates} == {2}
    assert {rate.cell for rate in rates} == {f"{generator}, {extent}" for extent in EXTENTS}
    assert [rate.hits for rate in rates if rate.what == LOST[0]] == [0] * len(EXTENTS)
    assert sum(rate.what == CLAIMED for rate in rates) == 3
    assert not [rate for rate in rates if rate.limit == "at most 5 %" and rate.hits == 2]
    assert {"detection threshold printed (delays)", "equal liquids distinguished (liquids)"} <= {
        rate.what for rate in rates
    }
    assert rates == [rate for cell in cells for rate in count_studies(rek, cell, true_effects(rek, cell), 1, 0, 2)]
    files = report_rates_evidence(rates, "rates").files
    assert len(files["rates.md"].splitlines()) == len(files["rates.csv"].splitlines()) + 3 == len(rates) + 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("factor", "reach", "what"), [(1, 1, ""), (1.1, 1, COVERS), (0.9, 1, COVERS), (1, 0.7, COVERS), (1, 1.3, HALF)]
)
def test_another_estimator_of_noticed_delays_and_other_intervals_are_noticed(
    factor: float, reach: float, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def other(*arguments: Any) -> Threshold:
        original = detection_threshold(*arguments)
        if original.interval is None or original.effect is None:
            return original
        ends = [
            factor * (original.effect + reach * (end - original.effect))
            for end in (original.lower, original.upper)
            if end
        ]
        low, high = ends
        return replace(original, interval=Interval(low=low, high=high, level=0.95, method="other"))

    monkeypatch.setattr(studies, "detection_threshold", other)
    rates = count_single(("the same threshold for all", 12), 1, 0, 150 if reach == 1 else 800)
    assert [rate.holds for rate in rates if rate.what == what] == ["no"] * bool(what)
    assert what or "no" not in [rate.holds for rate in rates]


@pytest.mark.slow
def test_single_tests_are_counted() -> None:
    (leaning,) = count_single(("one participant in five differs by 5 points, the others by 0", 24), 1, 0, 4)
    assert (leaning.studies, leaning.limit) == (4, "at most 5 %")
    printed, covered, _ = count_single(("the same threshold for all", 12), 1, 0, 4)
    assert (printed.what, printed.hits, printed.studies, printed.limit) == (PRINTED, 4, 4, "at least 93 %")
    assert covered.hits >= 2
    (skewed,) = count_single(("individual trends, skewed with mean 0, so that ranks decrease", 30), 1, 0, 60)
    assert skewed.hits == 0

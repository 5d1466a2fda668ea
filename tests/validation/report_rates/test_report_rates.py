"""How often verdicts are wrong: rates and their limits, the simulated truth, and the quick way to the same verdicts."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from click.testing import CliRunner

from study_app.analysis.designs.block_tests import of_tables
from study_app.analysis.evaluate import found_in
from study_app.analysis.findings.contrast_with_control import FINDING as CONTRASTS
from study_app.analysis.findings.delay_trend import FINDING as TREND
from study_app.analysis.findings.detection_threshold import FINDING as THRESHOLD
from study_app.analysis.findings.liquid_recognition import FINDING as RECOGNITION
from study_app.analysis.findings.lowest_delay import FINDING as LOWEST
from study_app.analysis.findings.other_assumptions import FINDING as AGAIN
from study_app.analysis.findings.pair_comparison import FINDING as PAIRS
from study_app.analysis.findings.settings_differ import FINDING as OMNIBUS
from study_app.analysis.power.plan import plan
from study_app.cli import commands
from study_app.protocol.forms.simulated_observer import TrialFeatures
from study_app.protocol.load import load
from study_app.validation.report_rates import known_effects as studies
from study_app.validation.report_rates import simulation, single_test_rates
from study_app.validation.report_rates.known_effects import (
    EXTENTS,
    GENERATORS,
    Generator,
    Simulated,
    answers,
    simulated,
)
from study_app.validation.report_rates.rates import Limit, Rate, markdown, table
from study_app.validation.report_rates.simulation import validate
from study_app.validation.report_rates.study_rates import CLAIMED, LOST, Cell, count, truth


@pytest.fixture(scope="module")
def rek() -> Simulated:
    """The thesis' study as if each liquid had its own force, without any rehearsal."""
    protocol = load("rek2024")
    force_n = {"water": 0.3, "honey": 1.2, "light_oil": 0.6}
    felt = {
        (block.id, name): (
            TrialFeatures(force_n.get(name, 0.3), 3 * force_n.get(name, 0.3), 0.1, 0.05, 0.1, protocol.delay_s(name)),
        )
        for block in protocol.main_blocks
        for name in block.conditions
    }
    return simulated(protocol, plan(protocol, felt))


@pytest.mark.parametrize(
    ("limit", "hits", "studies", "holds"),
    [
        ("at most 5 %", 50, 1000, "yes"),
        ("at most 5 %", 62, 1000, "too few studies"),
        ("at most 5 %", 80, 1000, "no"),
        ("at most 5 %", 0, 20, "too few studies"),
        ("at least 93 %", 900, 1000, "no"),
        ("at most 83 %", 900, 1000, "no"),
        ("none", 0, 10, "yes"),
        ("none", 1, 1000, "no"),
        ("counted", 10, 10, "counted"),
    ],
)
def test_a_rate_holds_as_far_as_its_interval_tells(limit: Limit, hits: int, studies: int, holds: str) -> None:
    assert Rate("cell", 5, "what", limit, hits, studies).holds == holds


def test_each_generator_answers_in_its_own_way(rek: Simulated) -> None:
    one, other = (answers(rek, generator, "full", 20, 3, 1) for generator in GENERATORS)
    assert all((first != second).any() for first, second in zip(one, other, strict=True))


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("participants", [5, 15])
def test_verdicts_alone_are_those_of_the_whole_evaluation(rek: Simulated, participants: int) -> None:
    people = tuple(f"P{number}" for number in range(participants))
    for extent in EXTENTS:
        given = answers(rek, "ordinal probit", extent, participants, 5, 2)
        for block, values in zip(rek.blocks, given, strict=True):
            single_ = {item.id: values[:, :, [column]] for column, item in enumerate(block.items)}
            whole, quick = (
                found_in(
                    None, of_tables(block, rek.decided, people, single_, planning=False, verdicts_only=verdicts_only)
                )
                for verdicts_only in (False, True)
            )
            assert [one.verdict for one in CONTRASTS.of(quick)] == [one.verdict for one in CONTRASTS.of(whole)]
            assert (OMNIBUS.of(quick), PAIRS.of(quick)) == (OMNIBUS.of(whole), PAIRS.of(whole))
            assert [one.p_adjusted for one in TREND.of(quick)] == [one.p_adjusted for one in TREND.of(whole)]
            assert (LOWEST.of(quick), THRESHOLD.of(quick), AGAIN.of(quick).mixed) == (
                LOWEST.of(whole),
                THRESHOLD.of(whole),
                (),
            )
            recognised = RECOGNITION.of(whole), RECOGNITION.of(quick)
            assert len({None if one is None else (one.verdict, one.found.p) for one in recognised}) == 1


@pytest.mark.slow
@pytest.mark.parametrize("generator", GENERATORS)
def test_every_kind_of_study_is_counted(rek: Simulated, generator: Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(studies, "TRUTH", 200)
    cells = [Cell(generator, extent, 5) for extent in EXTENTS]
    rates = [rate for cell in cells for rate in count(rek, cell, truth(rek, cell), 1, 0, 2)]
    assert {rate.studies for rate in rates} == {2}
    assert {rate.cell for rate in rates} == {f"{generator}, {extent}" for extent in EXTENTS}
    assert [rate.hits for rate in rates if rate.what == LOST[0]] == [0, 0, 0]
    assert sum(rate.what == CLAIMED for rate in rates) == 2
    assert not [rate for rate in rates if rate.limit == "at most 5 %" and rate.hits == 2]
    assert {"detection threshold printed (delays)", "equal liquids distinguished (liquids)"} <= {
        one.what for one in rates
    }
    assert rates == [rate for cell in cells for rate in count(rek, cell, truth(rek, cell), 1, 0, 2)]
    assert len(markdown(rates).splitlines()) == len(table(rates).splitlines()) + 1 == len(rates) + 2


@pytest.mark.parametrize(
    ("hits", "code", "last"),
    [
        ((20, 0), 0, "every rate is within its limit"),
        ((62, 0), 4, "1 of 2 rates undecided: simulate more studies"),
        ((62, 300), 3, "1 of 2 rates exceed their limits, 1 undecided"),
        ((), 4, "no rate was counted"),
    ],
)
def test_the_command_tells_rates_that_are_undecided_from_rates_that_hold(
    hits: tuple[int, ...], code: int, last: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rates = tuple(Rate("cell", 5, f"what {at}", "at most 5 %", hit, 1000) for at, hit in enumerate(hits))
    rates += (Rate("cell", 5, "size", "counted", 7, 1000),) if rates else ()
    monkeypatch.setattr("study_app.session.simulated.trial_features.condition_features", lambda *_args, **_named: None)
    monkeypatch.setattr("study_app.analysis.power.plan.plan", lambda *_args: None)
    monkeypatch.setattr("study_app.validation.report_rates.known_effects.simulated", lambda *_args: None)
    monkeypatch.setattr(
        "study_app.validation.report_rates.simulation.validate", lambda *_args, **_named: [(1000, rates)]
    )
    done = CliRunner().invoke(commands, ["validate-report"])
    assert done.exit_code == code, done.output
    assert done.output.splitlines()[-1] == last


@pytest.mark.slow
def test_single_tests_are_counted() -> None:
    (leaning,) = single_test_rates.count(("one in five differs by 5 points, the others by 0", 24), 1, 0, 4)
    assert (leaning.studies, leaning.limit) == (4, "at most 5 %")
    printed, covered = single_test_rates.count(("one threshold for all", 12), 1, 0, 4)
    assert (printed.what, printed.hits, printed.studies, printed.limit) == (
        single_test_rates.PRINTED,
        4,
        4,
        "at least 93 %",
    )
    assert covered.hits >= 2


@pytest.fixture
def continued(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[tuple[int, int]]]:
    """Two cells without any study; the batches that are counted of each."""
    batches: dict[str, list[tuple[int, int]]] = {"clear": [], "unclear": []}

    def counted(name: str, hits_of_25: int) -> Callable[[int, int, int], tuple[Rate, ...]]:
        def count_(seed: int, batch: int, many: int) -> tuple[Rate, ...]:
            assert seed == 1
            batches[name].append((batch, many))
            return (Rate(name, 5, "what", "at most 5 %", hits_of_25 if batch < 12 else 0, many),)

        return count_

    monkeypatch.setattr(
        simulation, "cell_counts", lambda *_: {("clear", 5): counted("clear", 0), ("unclear", 5): counted("unclear", 2)}
    )
    return batches


def test_a_cell_is_continued_until_it_is_beyond_or_has_four_times_the_studies(
    rek: Simulated, continued: dict[str, list[tuple[int, int]]]
) -> None:
    told: list[str] = []
    with ThreadPoolExecutor(1) as executor:
        *_, (done, rates) = validate(rek, 10, executor, progress=told.append)
    assert [(rate.hits, rate.studies, rate.holds) for rate in rates] == [(0, 40, "too few studies"), (6, 30, "no")]
    assert continued == {"clear": [(batch, 10) for batch in range(4)], "unclear": [(batch, 10) for batch in range(3)]}
    assert done == 70
    assert len(told) == 5

"""Planned looks: how they share alpha, what a study file may state, and how a look is planned and reported."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import norm, skew, ttest_1samp
from scipy.stats import t as student

from study_app.analysis.data.blocks import Decided
from study_app.analysis.data.study_tables import load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.findings.statement_tests import DelayTrend, MeanTests
from study_app.analysis.planning.power_curves import power_markdown, powers
from study_app.analysis.planning.preregistration import preregistration
from study_app.analysis.planning.simulated_studies import FULL, count_findings, draw_opinions, plan
from study_app.analysis.report.first_page import first_page
from study_app.analysis.report.methods import methods
from study_app.analysis.statistics.outcome import alpha_of_looks, error_of_every_report, holm
from study_app.analysis.statistics.slope_tests import slope_test
from study_app.cli import commands
from study_app.errors import ProtocolError
from study_app.protocol.load import parse
from study_app.protocol.model import Spending
from study_app.protocol.participants.raters import PUBLISHED, TYPICAL
from study_app.protocol.source.files import source_bytes
from study_app.session.simulated.answers_only import rehearse_answers
from tests.analysis.made_up import delays, everybody, liquids, study
from tests.analysis.power.test_power import felt_in
from tests.studies import made_up

CONTRAST = '{ measure = "different", blocks = ["delays"], conditions = ["delay_150", "delay_0"], expected = "higher" }'
LOOKED = (
    source_bytes("rek2024")
    .decode()
    .replace("[analysis]\n", f"[analysis]\nparticipants = 12\nlooks = [6, 12]\ncontrasts = [{CONTRAST}]\n")
)


@pytest.mark.parametrize(
    ("spending", "bounds"),
    [
        ("obrien-fleming", (4.8769, 3.3569, 2.6803, 2.2898, 2.0310)),
        ("pocock", (2.4380, 2.4268, 2.4101, 2.3966, 2.3859)),
    ],
)
def test_bounds_are_those_of_the_program_ld98(spending: Spending, bounds: tuple[float, ...]) -> None:
    """Five equal looks, two-sided alpha of 0.05, as computed by the program ld98 of Reboussin, DeMets, Kim & Lan.

    The program is described in Control. Clin. Trials 21 (2000), 190-207.
    """
    computed_bounds = norm.isf(np.array(alpha_of_looks((5, 10, 15, 20, 25), 0.05, spending)) / 2)
    assert computed_bounds == pytest.approx(bounds, abs=3e-4)
    assert alpha_of_looks((7, 12), 0.05, spending)[0] < alpha_of_looks((9, 12), 0.05, spending)[0] < 0.05


@pytest.mark.parametrize("spending", ["obrien-fleming", "pocock"])
def test_the_cost_of_a_test_at_every_participant_is_that_of_simulated_studies(spending: Spending) -> None:
    looks, studies = (12, 18, 24), 40_000
    walks = np.random.default_rng(4).normal(size=(studies, 24)).cumsum(axis=1)[:, 11:] / np.sqrt(np.arange(12, 25))
    ends = norm.isf(np.repeat(alpha_of_looks(looks, 0.05, spending), (6, 6, 1)) / 2)
    claimed = float((np.abs(walks) >= ends).any(axis=1).mean())
    assert error_of_every_report(looks, 0.05, spending) == pytest.approx(claimed, abs=0.004)
    decided = Decided(
        made=True,
        changed=False,
        alpha=0.05,
        equivalence_bound=None,
        primary=(),
        names=(),
        rising=(),
        falling=(),
        noticed=None,
        looks=looks,
        spending=spending,
    )
    rate = f"{100 * error_of_every_report(looks, 0.05, spending):.1f} %"
    assert f"the false-positive rate would be {rate} instead of 5 %" in decided.at(13).look_text(13)


@pytest.mark.parametrize(
    ("looks", "said"),
    [
        ("[12]", "specify two or more numbers; the last must equal analysis.participants"),
        ("[6, 10]", "specify two or more numbers; the last must equal analysis.participants"),
        ("[12, 6, 12]", "each look needs more participants than the previous look"),
        ("[1, 12]", "looks"),
    ],
)
def test_looks_that_make_no_sense_are_refused(looks: str, said: str) -> None:
    with pytest.raises(ProtocolError, match=said):
        parse(LOOKED.replace("[6, 12]", looks).encode(), "looked.toml")


def p_for_skewness(differences: np.ndarray) -> float:
    """Return the one-sided p of Hall's transformation of t."""
    n, t = len(differences), ttest_1samp(differences, 0).statistic
    skewness = skew(differences, bias=False) / math.sqrt(n)
    return float(student.sf(t + skewness / 6 + skewness * t**2 / 3 + skewness**2 * t**3 / 27, n - 1))


@pytest.mark.slow
def test_a_look_is_planned_and_its_alpha_is_less_than_that_of_all() -> None:
    protocol = parse(LOOKED.encode(), "looked.toml")
    planned, (first, last) = plan(protocol, felt_in(protocol)), alpha_of_looks((6, 12), 0.05, "obrien-fleming")
    counts = count_findings(planned, (6, 12), 1, 0, 10)[TYPICAL]
    for place, level in enumerate((first, last)):
        alone = replace(planned, decided=replace(planned.decided, looks=(), alpha=level))
        once = count_findings(alone, (6, 12), 1, 0, 10)[TYPICAL]
        for what, detected in counts.items():
            if what[1] != "means":
                assert (
                    (detected[place] == once[what][place]).all() if place == 0 else (detected[1] >= once[what][1]).all()
                )
                assert (detected[1] >= detected[0]).all()
    (contrast,) = planned.contrasts
    here = [draw_opinions(planned, 12, 1, study)[1].answers(1.0, PUBLISHED[TYPICAL])[:6] for study in range(10)]
    names, items = (
        [setting.condition for setting in planned.blocks[1].settings],
        [statement.id for statement in planned.blocks[1].items],
    )
    late, prompt, item = names.index("delay_150"), names.index("delay_0"), items.index("different")
    differences = [answers[:, late, item] - answers[:, prompt, item] for answers in here]
    significant = sum(
        max(ttest_1samp(by, 0, alternative="greater").pvalue, p_for_skewness(by)) <= first for by in differences
    )
    assert counts[contrast.described(), "contrast"][0, FULL] == significant > 0
    text = preregistration(protocol, "0" * 64)
    assert "all tests are run when 6 and 12 participants have completed a valid session;" in text
    assert f"up to {first:.3g} and {last:.3g} are significant at these looks (O'Brien–Fleming alpha spending" in text


@pytest.mark.slow
def test_slopes_are_tested_if_the_study_plans_them() -> None:
    protocol = parse(LOOKED.replace("looks = [6, 12]", 'trends = "slopes"').encode(), "looked.toml")
    planned = plan(protocol, felt_in(protocol))
    counts = count_findings(planned, (10,), 1, 0, 10)[TYPICAL]["delays", "found"]
    items, x = planned.blocks[1].items, np.array(planned.blocks[1].delays_ms)[:, None] / 100
    times_shown = 0
    for number in range(10):
        ratings = draw_opinions(planned, 10, 1, number)[1].answers(1.0, PUBLISHED[TYPICAL])
        ps = [
            slope_test(ratings[:, :, at], x, planned.decided.direction(item.id)).p or 1.0
            for at, item in enumerate(items)
        ]
        times_shown += (holm(ps)[0] or 1.0) <= 0.05
    assert counts[0, FULL, 0] == times_shown > 0
    test_name = "Student's t test on the slopes from each participant's regression of answers on delays"
    assert test_name in preregistration(protocol, "0" * 64)
    assert test_name in power_markdown(powers(planned, (10,), 10, 10, 1, count_findings(planned, (10,), 1, 0, 10)))
    settings = delays((0, 50, 100))
    case_study = study(settings, list(everybody(settings, 12, lambda person, _s, code, _i: int(code[1]) + person % 3)))
    case_study = replace(case_study, decided=replace(case_study.decided, trends="slopes"))
    (block_result,) = (results := evaluate(case_study)).blocks
    assert {trend.outcome.test for trend in DelayTrend.value_in(block_result)} == {"t test of slopes"}
    assert not MeanTests.value_in(block_result), "each statement is tested once"
    assert f"Trends across delays were tested with {test_name} (one-sided" in methods(case_study, results)


@pytest.mark.parametrize(
    ("n", "said"),
    [
        (5, "None has been reached"),
        (6, "look 1 of 2"),
        (12, "look 2 of 2"),
        (9, "This look at 9 participants was unplanned; looks are planned at 6 and 12 participants."),
        (13, "This look at 13 participants was unplanned"),
    ],
)
def test_the_first_page_states_the_current_look(n: int, said: str) -> None:
    case_study = study(
        liquids(3), list(everybody(liquids(3), n, lambda person, _s, code, _i: 1 + int(code[1]) + person % 2))
    )
    decided = replace(case_study.decided, made=True, changed=False, looks=(6, 12))
    results = evaluate(replace(case_study, decided=decided.at(case_study.n)))
    assert said in first_page(results, ())
    assert results.decided.binding == (n >= 6)
    assert results.decided.alpha == pytest.approx(alpha_of_looks((6, 12), 0.05, "obrien-fleming")[int(n >= 12)])


@pytest.mark.slow
def test_the_look_is_that_of_the_sessions_on_disk(tmp_path: Path) -> None:
    file = tmp_path / "looked.toml"
    file.write_text(
        LOOKED.replace("participants = 12\nlooks = [6, 12]", "participants = 3\nlooks = [2, 3]"),
        encoding="utf-8",
        newline="\n",
    )
    folder = rehearse_answers(
        str(file), participants=2, seed=1, results=tmp_path / "study", features=made_up(str(file))
    )
    decided = load_study(folder).decided
    assert (decided.look, decided.planned_alpha, decided.alpha) == (1, 0.05, decided.alphas[0])


def test_the_sizes_of_power_are_the_looks(tmp_path: Path) -> None:
    file = tmp_path / "looked.toml"
    file.write_text(LOOKED, encoding="utf-8", newline="\n")
    result = CliRunner().invoke(commands, ["power", str(file), "--sizes", "5,10"])
    assert result.exit_code == 2
    assert "the study plans interim looks at 6, 12 participants: omit --sizes" in " ".join(result.output.split())

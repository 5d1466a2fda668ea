"""Contrasts: the tests of the hypotheses that a study file states."""

import math
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError
from scipy.stats import t as student
from scipy.stats import ttest_ind, ttest_rel

from study_app.analysis import contrasts
from study_app.analysis.contrasts import _direction_text, answer, contrast_section
from study_app.analysis.data.blocks import PlacedScore, QuestionPlace
from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.figures.level_figures import level_figure_tasks
from study_app.analysis.levels.thresholds import Thresholds, thresholds_compared
from study_app.analysis.levels.tracks import tracks
from study_app.analysis.page_layout import draw_figures
from study_app.analysis.planning.power_curves import Powers, power_markdown, powers
from study_app.analysis.planning.preregistration import preregistration
from study_app.analysis.planning.simulated_studies import count_findings, draw_opinions, plan, stacked_answers
from study_app.analysis.planning.smallest_differences import detectable_difference, smallest_differences
from study_app.analysis.planning.threshold_studies import PrecisionResult, Precisions, threshold_markdown
from study_app.analysis.report import write_report
from study_app.analysis.report.first_page import Presented, cards, first_page
from study_app.analysis.report.methods import methods
from study_app.analysis.report.sections import limits
from study_app.analysis.report.write_report import report
from study_app.analysis.results import ContrastResult, ContrastSide, Results
from study_app.analysis.statistics.effect_sizes import EffectSize
from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.mean_tests import equivalence_power, means_of, p_differs
from study_app.analysis.statistics.outcome import Interval
from study_app.analysis.statistics.thresholds import group_mean
from study_app.errors import ProtocolError
from study_app.number_text import counted
from study_app.protocol.load import parse
from study_app.protocol.model import OF_LEVELS, Contrast, Protocol
from study_app.protocol.participants.raters import PUBLISHED, TYPICAL
from study_app.protocol.questionnaires import Score
from study_app.protocol.source.files import source_bytes
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.unblinding import unblind
from tests.analysis.made_up import ITEMS, everybody, liquids, study
from tests.analysis.power.test_power import felt_in
from tests.analysis.report.read_report import seen
from tests.golden_values import page_lines
from tests.protocol.edited_studies import text_of
from tests.studies import quick_pdfs

pytestmark = pytest.mark.slow

DELAYED = """
format = 2
study.name = "delayed"
liquids.damper.drag = { law = "linear", damping_nspm = 8 }
conditions.prompt_one = { liquid = "damper" }
conditions.late_one = { liquid = "damper", delay_ms = 60 }
tasks.stir.kind = "follow"
stimuli.prompt = { vary = "damping_nspm", levels = [0.02, 0.6], condition = "prompt_one" }
stimuli.late = { vary = "damping_nspm", levels = [0.02, 0.6], condition = "late_one" }
blocks.prompt = { stimulus = "prompt", design = "2ifc", method = "m", task = "stir" }
blocks.late = { stimulus = "late", design = "2ifc", method = "m", task = "stir" }
methods.m = { kind = "questplus", trials = 20 }

[analysis]
participants = 6
contrasts = [{ measure = "threshold", blocks = ["late", "prompt"], expected = "higher", bound = 1.25 }]
"""


COMPARED = 'conditions = ["prompt_one", "late_one"], standard = "prompt_one"'


@pytest.fixture(scope="module")
def delayed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("delayed")
    (folder / "delayed.toml").write_text(DELAYED, encoding="utf-8", newline="\n")
    return rehearse_answers(folder / "delayed.toml", participants=6, seed=3, results=folder / "study", features={})


@pytest.mark.usefixtures("png_figures_only")
def test_two_thresholds_are_compared_once_the_key_is_open(delayed: Path, tmp_path: Path) -> None:
    assert load_study(delayed).contrasts == ()
    receipts = "".join(path.read_text("utf-8") for path in delayed.rglob("session.json"))
    assert "late_one" not in receipts
    assert '"contrasts"' not in receipts
    unblind(delayed, "AB", "to analyse")
    results = evaluate(load_study(delayed))
    (contrast_result,) = results.contrasts
    study = load_study(delayed)
    (late, prompt), shared = thresholds_compared(
        *sorted(study.levels, key=lambda level_block: level_block.id), tracks(study)
    )
    assert shared == 0, "blocks with the same levels and design have a width in common"
    expected = group_mean(
        [late[person].value - prompt[person].value for person in study.people],
        [late[person].variance + prompt[person].variance for person in study.people],
    )
    assert (contrast_result.n, contrast_result.dropped, contrast_result.left_out, contrast_result.effect_name) == (
        6,
        0,
        {},
        "ratio",
    )
    assert contrast_result.interval is not None
    assert (contrast_result.effect, contrast_result.interval.low, contrast_result.interval.high) == pytest.approx(
        (10**expected.mean, 10**expected.low, 10**expected.high)
    )
    error = (expected.high - expected.low) / 2 / student.ppf(0.975, 5)
    assert contrast_result.statistic == pytest.approx(expected.mean / error)
    assert contrast_result.p == pytest.approx(student.sf(expected.mean / error, 5))
    least = (
        detectable_difference(6, alpha=results.decided.alpha, expected="higher")[1]
        * error
        * math.log(10)
        * math.sqrt(6)
    )
    not_shown = replace(results, contrasts=(replace(contrast_result, verdict="not shown"),))
    ratios = f"at least {math.exp(least):.2f} (or at most {math.exp(-least):.2f})"
    detected = f"the true mean ratio must be {ratios} to be detected"
    assert any(detected in line for line in limits(study, not_shown))
    page = report(delayed, tmp_path / "report", failed=pytest.fail)[0].read_text(encoding="utf-8")
    first = page[page.index('class="first"') :].replace("\u00a0", " ")
    standard = (
        "the liquid was “damper”, with varied damping at the hand (standard: 8 N·s/m) and a visual delay of 60 ms."
    )
    assert f"In the block “Late” (two-interval forced choice, 20 trials per participant), {standard}" in first
    words, trials = methods(study, results), "(two-interval forced choice, 20 trials per participant)"
    for title, delay in (("Late", " with a visual delay of 60 ms"), ("Prompt", "")):
        message = (
            rf"In “{title}” {re.escape(trials)}, damping at the hand was judged at Weber fractions from \S+ to \S+ "
        )
        assert re.search(rf"{message}for a standard of 8 N·s/m{delay}; levels were chosen by ", words)
    apart = "Late (60 ms of visual delay) than in Prompt (no visual delay)"
    hypothesis = f"The threshold is higher in {apart}, with an equivalence bound of 1.25"
    assert first.index(hypothesis) < first.index("Prompt: ")
    assert f"; mean ratio {contrast_result.effect:.2f}, two-sided 95 % confidence interval" in first
    for side, own in zip(contrast_result.sides, (late, prompt), strict=True):
        assert side.values == pytest.approx({person: 10 ** own[person].value for person in study.people})
        half = math.log(side.high / side.low) / 2
        assert side.standard_error == pytest.approx(half / student.ppf(0.975, 5)), "of the mean, which is weighted"
    tables = "".join(contrast_section(replace(results, contrasts=(replace(contrast_result, standard_error=4.0),))))
    of_ratio = [line.split(" | ") for line in page_lines(tables) if line.startswith("Threshold: Late ÷ Prompt | 6 | ")]
    assert [of_ratio[0][-5], of_ratio[1][-1]] == ["4.00"] * 2, "tested, and described"


def test_methods_name_all_compared_conditions_with_their_delays(guessed: tuple[Study, Results]) -> None:
    study, words = guessed[0], methods(*guessed)
    counted_trials = study.trials[
        study.trials["counted"] & study.trials["block"].isin([level.id for level in study.levels])
    ]
    (trials,) = set(counted_trials.groupby(["participant", "block"]).size())
    design = f"(two-interval forced choice, {counted(trials, 'trial')} per participant)"
    assert f"{design}, damper and damper with a visual delay of 60 ms were compared." in words


def test_staircase_thresholds_include_everybody_and_name_those_without_a_block(tmp_path: Path) -> None:
    """A 3-down-1-up track stays above the threshold, which may therefore lie below all levels that a person met."""
    method = 'kind = "updown", rule = "3down1up", tracks = 2, trials = 24'
    text = DELAYED.replace('kind = "questplus", trials = 20', method).replace("participants = 6", "participants = 8")
    (tmp_path / "delayed.toml").write_text(text, encoding="utf-8", newline="\n")
    folder = rehearse_answers(tmp_path / "delayed.toml", participants=8, seed=5, results=tmp_path / "s", features={})
    unblind(folder, "AB", "to analyse")
    study = load_study(folder)
    met = tracks(study).groupby(["participant", "block"])["level"].min()
    below = [
        estimate
        for level in evaluate(study).levels
        for estimate in Thresholds.participant_rows(level)
        if estimate.threshold < met[estimate.participant, level.block]
    ]
    assert below, "some thresholds lie below all levels that the person met"
    assert {estimate.beyond for estimate in below if estimate.threshold > 0.02} == {None}, (
        "the stimulus has lower levels"
    )
    (contrast_result,) = evaluate(study).contrasts
    assert (contrast_result.n, contrast_result.dropped, contrast_result.left_out) == (8, 0, {})
    remaining_trials = study.trials[~((study.trials["participant"] == "P003") & (study.trials["block"] == "late"))]
    (contrast_result,) = (results := evaluate(replace(study, trials=remaining_trials))).contrasts
    assert (contrast_result.n, contrast_result.dropped, contrast_result.left_out) == (
        7,
        1,
        {"P003": "no threshold in Late"},
    )
    assert "Excluded: P003 (no threshold in Late)." in first_page(results, ())
    words = "Participants are included if both of their values are available, even if a threshold lies outside"
    assert words in preregistration(parse(text.encode(), "delayed.toml"), "0" * 64)


def test_equality_is_corrected_over_the_hypotheses_that_state_a_bound() -> None:
    first = Contrast(measure=ITEMS[0], blocks=("b",), conditions=("c2", "c1"), bound=1.0)
    second = Contrast(measure=ITEMS[1], blocks=("b",), conditions=("c2", "c1"), bound=1.0)
    third = Contrast(measure=ITEMS[1], blocks=("b",), conditions=("c3", "c1"))
    case_study = statements(first)
    alone, both = (
        evaluate(replace(case_study, contrasts=some)).contrasts for some in ((first,), (first, second, third))
    )
    # Of 20 participants none may belong to a minority of one in six, who shift the mean by a point: p = (5 / 6)^20.
    assert alone[0].p_equivalent == pytest.approx((5 / 6) ** 20)
    assert both[0].p_equivalent == pytest.approx(2 * (5 / 6) ** 20)
    assert (alone[0].equivalent, both[0].equivalent, both[2].equivalent) == (True, False, None)
    assert "the data do not rule out the possibility that up to" in answer(alone[0])


def statements(contrast: Contrast, shift: float = 0.0) -> Study:
    rng = np.random.default_rng(5)
    case_study = study(
        liquids(3),
        list(everybody(liquids(3), 20, lambda _p, _s, code, _i: round(rng.normal(4 + shift * (code == "L2"), 0.6)))),
    )
    return replace(case_study, contrasts=(contrast,))


def test_two_conditions_of_a_statement_are_compared_and_can_be_equivalent() -> None:
    contrast = Contrast(measure=ITEMS[0], blocks=("b",), conditions=("c2", "c1"), bound=1.0)
    (higher,) = evaluate(statements(contrast, 2.0)).contrasts
    assert higher.verdict == "shown"
    assert higher.effect == pytest.approx(2, abs=0.5)
    (same,) = evaluate(statements(contrast)).contrasts
    assert (same.verdict, same.equivalent) == ("equivalent", True)
    (narrow,) = evaluate(statements(contrast.model_copy(update={"bound": 0.01}))).contrasts
    assert (narrow.verdict, narrow.equivalent) == ("not shown", False)
    assert answer(narrow).endswith(
        "The sample is too small to show equivalence: at least 1796 participants are needed."
    )
    (beyond,) = evaluate(statements(contrast, 2.0)).contrasts
    assert beyond.interval is not None
    assert beyond.interval.low > 1.0
    assert "The whole confidence interval lies outside the equivalence bounds (not equivalent)." in answer(beyond)
    assert "do not show that" not in answer(beyond)


def test_a_difference_that_is_the_same_for_all_is_not_called_equivalent() -> None:
    contrast = Contrast(measure=ITEMS[0], blocks=("b",), conditions=("c2", "c1"), bound=1.0)
    case_study = study(liquids(3), list(everybody(liquids(3), 12, lambda _p, _s, code, _i: 2 + 2 * (code == "L2"))))
    (contrast_result,) = evaluate(replace(case_study, contrasts=(contrast,))).contrasts
    assert (contrast_result.effect, contrast_result.equivalent) == (2.0, False)
    assert "All differences lie outside the equivalence bounds (not equivalent)." in answer(contrast_result)


def test_the_methods_state_every_hypothesis_and_its_correction() -> None:
    contrast = Contrast(measure=ITEMS[0], blocks=("b",), conditions=("c2", "c1"), bound=1.0)
    other = Contrast(measure=ITEMS[1], blocks=("b",), conditions=("c3", "c1"), expected="higher")
    case_study = replace(statements(contrast), contrasts=(contrast, other))
    methods_lines = methods(case_study, evaluate(case_study))
    for place, (stated, item, sides) in enumerate([(contrast, ITEMS[0], "two"), (other, ITEMS[1], "one")], start=1):
        words = stated.described(measure=f"agreement with “{item.capitalize()}”", block="Block")
        assert f"Hypothesis {place} ({words}) was tested with a {sides}-sided paired t test." in methods_lines
    assert "The reported p value is the largest of the three, Holm-adjusted across 2 hypotheses." in methods_lines
    assert "Equivalence was tested with two one-sided t tests" in methods_lines
    assert "Means were used for the hypotheses" in methods_lines
    assert "never means" not in methods_lines
    rows = write_report.tests_csv(evaluate(statements(contrast))).decode().splitlines()
    assert "hypotheses" in rows[1]


_FORM = 'sequence = ["prompt", "load", "late", "load"]\nquestionnaires.load.instrument = "nasa-tlx"\n'
LOADED = (
    DELAYED.replace("trials = 20", "trials = 8")
    .replace("blocks.prompt =", f"{_FORM}blocks.prompt =")
    .replace('measure = "threshold"', 'measure = "raw", form = "load"')
    .replace(', expected = "higher", bound = 1.25', "")
)


def _shown(value: float) -> str:
    """Return a number below 100 with at most three digits, two of them decimals."""
    return f"{value:.{2 if abs(value) < 9.5 else 1}f}".replace("-", "−")


def test_the_score_of_a_form_after_each_block_is_a_hypothesis(tmp_path: Path) -> None:
    (tmp_path / "loaded.toml").write_text(LOADED, encoding="utf-8", newline="\n")
    folder = rehearse_answers(tmp_path / "loaded.toml", participants=6, seed=11, results=tmp_path / "s", features={})
    unblind(folder, "AB", "to analyse")
    (result,) = evaluate(load_study(folder)).contrasts

    files = sorted(folder.rglob("*responses_data.csv"))
    rows = pd.concat([pd.read_csv(file, na_values="n/a") for file in files])
    load = rows[rows["form"] == "load"].astype({"value": float})
    raw = load.pivot_table("value", "participant", "after_block", aggfunc="mean")  # mean of the six ratings
    assert load.groupby(["participant", "after_block"]).size().tolist() == [6] * 12
    expected, differences = ttest_rel(raw["late"], raw["prompt"]), raw["late"] - raw["prompt"]
    assert (result.statistic, result.p) == pytest.approx((expected.statistic, expected.pvalue))
    assert (result.effect, result.standard_error) == pytest.approx((differences.mean(), differences.sem()))
    with quick_pdfs():
        page = report(folder, tmp_path / "report")[0].read_text(encoding="utf-8")
    page_text, comparison = seen(page).replace("\u00a0", " "), "NASA-TLX raw score: Late − Prompt"
    apart = "The NASA-TLX raw score differs between Late (60 ms of visual delay) and Prompt (no visual delay)"
    assert f"Hypothesis: {apart} not significant" in page_text
    assert "The scale ranges from 0 to 100." in page_text
    ends = [_shown(end) for end in expected.confidence_interval()]
    tested = [
        _shown(expected.statistic),
        "5",
        *(f"{p:.3f}".removeprefix("0") for p in (expected.pvalue, result.largest_p)),
    ]
    bayes = f"{result.bayes_factor:.3g}"
    row = [
        comparison,
        "6",
        *tested,
        _shown(differences.mean()),
        _shown(differences.sem()),
        *ends,
        bayes,
        "not significant",
    ]
    assert " ".join(row) in page_text
    for name, values in (
        (comparison, differences),
        *((f"NASA-TLX raw score: {block.capitalize()}", raw[block]) for block in raw),
    ):
        assert (
            " ".join([name, "6", *map(_shown, (values.mean(), values.median(), values.std(), values.sem()))])
            in page_text
        )
    assert "NASA-TLX, after each block" in page_text
    assert "The mean NASA-TLX raw score was" not in page_text, "the hypothesis says it"
    assert "d<sub>z</sub>" in page
    assert "d_z" not in page
    assert "dz is the mean" in (tmp_path / "report" / "methods.txt").read_text("utf-8")
    assert (tmp_path / "report" / "hypothesis-1.svg").is_file()


def test_power_of_a_hypothesis_on_a_form_is_stated_in_standard_deviations() -> None:
    protocol = parse(LOADED.encode(), "loaded.toml")
    page_text = threshold_markdown(Precisions(protocol=protocol, sizes=(18,), studies=10, asked=10, seed=1, found={}))
    half, smallest = detectable_difference(18, alpha=0.05, expected=None)
    assert "“raw” (load) differs between Late and Prompt" in page_text
    assert f"| raw | 18 | 1 | ±{half:.2f} SD | ±{smallest:.2f} SD |" in page_text


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('"late", "load"]', '"late"]', "load does not always follow late"),
        ('measure = "raw"', 'measure = "raws"', '"load" does not have a numeric question or score raws'),
        ('measure = "raw"', 'measure = "threshold"', "compare its questions or scores"),
    ],
)
def test_a_form_that_blocks_do_not_have_in_common_is_refused(before: str, after: str, words: str) -> None:
    with pytest.raises(ProtocolError, match=words):
        parse(LOADED.replace(before, after).encode(), "loaded.toml")


def test_two_groups_are_compared_with_unequal_variances() -> None:
    contrast = Contrast(measure=ITEMS[0], blocks=("b",), groups=("one", "two"))
    case_study = statements(contrast)
    people = sorted(case_study.trials["participant"].unique())
    members = {person: "one" if number % 3 else "two" for number, person in enumerate(people)}
    case_study = replace(
        case_study,
        trials=case_study.trials.assign(group=case_study.trials["participant"].map(members).astype("string")),
    )
    (contrast_result,) = evaluate(case_study).contrasts
    rows = case_study.responses[case_study.responses["item"] == ITEMS[0]]
    means = rows["response"].astype(float).groupby(rows["participant"]).mean()
    first, second = (means[[person for person in people if members[person] == group]] for group in ("one", "two"))
    t = ttest_ind(first, second, equal_var=False).statistic
    assert (contrast_result.statistic, contrast_result.p) == pytest.approx(
        (t, 2 * student.sf(abs(t), min(len(first), len(second)) - 1))
    )
    assert contrast_result.effect == pytest.approx(first.mean() - second.mean())


def test_limits_of_the_study_are_the_power_of_its_hypotheses_and_groups_that_existed() -> None:
    contrast = Contrast(measure=ITEMS[0], blocks=("b",), groups=("one", "two"))
    paired = Contrast(measure=ITEMS[0], blocks=("b",), conditions=("c3", "c1"), expected="higher")
    case_study = replace(statements(contrast, 2.0), contrasts=(contrast, paired))
    people = sorted(case_study.trials["participant"].unique())
    members = {person: "one" if number % 3 else "two" for number, person in enumerate(people)}
    groups = {"groups": {"one": {}, "two": {}}, "study": {"group_assignment": "pre-existing"}}
    case_study = replace(
        case_study,
        protocol={**case_study.protocol, **groups},
        trials=case_study.trials.assign(group=case_study.trials["participant"].map(members).astype("string")),
    )
    limitation_lines = limits(case_study, results := evaluate(case_study))
    assert [result.verdict for result in results.contrasts] == ["not shown", "not shown"]
    rows = case_study.responses[case_study.responses["item"] == ITEMS[0]].assign(
        value=lambda it: it["response"].astype(float)
    )
    means = rows.groupby("participant")["value"].mean()
    first, second = (means[[person for person in people if members[person] == group]] for group in ("one", "two"))
    pooled = math.sqrt(((len(first) - 1) * first.var() + (len(second) - 1) * second.var()) / (len(people) - 2))
    settings = rows.pivot_table("value", "participant", "code")
    spread = (settings["L3"] - settings["L1"]).std()
    alpha = results.decided.alpha / 2
    leasts = (
        pooled * detectable_difference(len(first), len(second), alpha=alpha, expected=None)[1],
        spread * detectable_difference(len(people), alpha=alpha, expected="higher")[1],
    )
    for place, least in enumerate(leasts, start=1):
        line = next(
            line for line in limitation_lines if line.startswith(f"Hypothesis {place}: with {len(people)} participants")
        )
        assert f"must be at least {least:.2f} to be detected with 80 % power" in line
    assert any(line.startswith("Participants were not assigned to groups at random") for line in limitation_lines)


def test_a_hypothesis_names_titles_of_several_words_in_quotation_marks() -> None:
    interaction = Contrast(measure="d_prime", blocks=("prompt", "late"), groups=("novice", "expert"))
    difference = "the difference in sensitivity (d′) between “No delay” and “80 ms late”"
    description = interaction.described(within=("No delay", "80 ms late"))
    assert description == f"{difference} differs between novice and expert (interaction)"
    paired = Contrast(measure="sure", form="after", blocks=("prompt", "late"), expected="higher")
    words = paired.described(("No delay", "Late"), measure="“Sure” (Your impression)")
    assert words == "“Sure” (Your impression) is higher in “No delay” than in Late"


def test_an_interaction_compares_groups_in_the_difference_of_each_participant() -> None:
    contrast = Contrast(measure=ITEMS[0], blocks=("b",), conditions=("c2", "c1"), groups=("one", "two"))
    case_study = statements(contrast)
    people = sorted(case_study.trials["participant"].unique())
    members = {person: "one" if number % 3 else "two" for number, person in enumerate(people)}
    rows = case_study.responses["participant"].map(members).eq("one") & case_study.responses["code"].eq("L2")
    assert rows.any()
    value = case_study.responses["response"].astype(float) + 2.0 * rows.astype(float)
    shifted_answers = case_study.responses.assign(value=value, response=value.map("{:g}".format).astype("string"))
    case_study = replace(
        case_study,
        responses=shifted_answers,
        trials=case_study.trials.assign(group=case_study.trials["participant"].map(members).astype("string")),
    )
    (result,) = evaluate(case_study).contrasts

    answers = (
        shifted_answers[shifted_answers["item"] == ITEMS[0]].pivot_table("value", "participant", "code").astype(float)
    )
    differences = answers["L2"] - answers["L1"]
    first_group, second_group = (
        differences[[person for person in people if members[person] == group]] for group in ("one", "two")
    )
    t = ttest_ind(first_group, second_group, equal_var=False).statistic
    assert (result.statistic, result.p) == pytest.approx(
        (t, 2 * student.sf(abs(t), min(len(first_group), len(second_group)) - 1))
    )
    assert result.effect == pytest.approx(first_group.mean() - second_group.mean())
    assert result.verdict == "shown"
    difference = f"difference in agreement with “{ITEMS[0].capitalize()}” between c2 and c1 in Block"
    assert f"The {difference} was higher in one than in two" in answer(result)
    assert f"the {difference} differs between one and two" in methods(case_study, evaluate(case_study))
    assert [len(side.values) for side in result.sides] == [len(first_group), len(second_group)]
    figure = next(
        picture
        for picture in draw_figures(write_report.summary_figure_tasks(case_study, evaluate(case_study), {}, ("svg",)))
        if "hypothesis" in picture.name
    )
    tasks = list(
        write_report.summary_figure_tasks(replace(case_study, split="one"), evaluate(case_study), {}, ("svg",))
    )
    assert tasks == [], "the figures of one group do not compare it with the other"
    svg = figure.files["svg"].decode()
    assert ">Difference: c2 − c1<" in svg
    assert ">one − two<" in svg
    cells = [answers[code].loc[group.index] for group in (first_group, second_group) for code in ("L2", "L1")]
    assert [cell.mean for cell in result.cells] == pytest.approx([cell.mean() for cell in cells])
    (card, *_) = cards(evaluate(case_study), presented={"b": Presented("In B, honey was presented.")})
    means = [f"{cell.mean():.2f} [" for cell in cells]
    assert [card.badge, card.sentences[-1]] == ["significant", "In B, honey was presented."]
    for group, (first, second), sentence in zip(
        ("one", "two"), (means[:2], means[2:]), card.sentences[1:], strict=False
    ):
        assert sentence.startswith(f"Means in the group {group} (95 % intervals): {first}")
        assert f"] in c2 and {second}" in sentence


@pytest.mark.parametrize(
    "keys",
    [
        {"blocks": ("a", "b"), "conditions": ("c", "d"), "groups": ("one", "two")},
        {"blocks": ("a", "b"), "conditions": ("c", "d")},
        {"blocks": ("a", "a"), "groups": ("one", "two")},
        {"blocks": ("a", "b"), "groups": ("one", "one")},
        {"blocks": ("a",)},
    ],
)
def test_a_hypothesis_that_does_not_compare_two_sides_is_refused(keys: dict[str, tuple[str, ...]]) -> None:
    with pytest.raises(ValidationError):
        Contrast.model_validate({"measure": "d_prime", **keys})


def test_power_states_the_smallest_detectable_interaction() -> None:
    text = "\n".join(line for line in DELAYED.splitlines() if not line.startswith("contrasts"))
    protocol = grouped(text, "threshold", 'late", "prompt', '["late", "prompt"]')
    error = math.log(1.3) / math.sqrt(2)  # the SD of the two errors is ln 1.3
    results = {
        (block, 20): PrecisionResult([np.array([[error], [-error]])], [np.full(2, 0.2)]) for block in ("late", "prompt")
    }
    page_text = threshold_markdown(
        Precisions(protocol=protocol, sizes=(18,), studies=10, asked=10, seed=1, found=results)
    )
    spread = math.hypot(math.log(1.2), math.log(1.3), math.log(1.3))
    half, smallest = (math.exp(spread * end) for end in detectable_difference(12, 6, alpha=0.05, expected=None))
    assert "the difference in threshold between Late and Prompt differs between a and b (interaction)" in page_text
    assert f"| 20 | 18 | ×/÷ {math.exp(spread):.2f} | ×/÷ {half:.2f} | ×/÷ {smallest:.2f} |" in page_text
    text, _, rest = source_bytes("rek2024").decode().partition("sequence = ")
    sequence, _, rest = rest.partition("]")
    alone = grouped(text + rest, "different", "delays", f"{sequence}]")
    assert alone.analysis is not None
    first, second = alone.blocks["delays"].conditions[:2]
    (hypothesis,) = alone.analysis.contrasts
    both = hypothesis.model_copy(update={"conditions": (first, second)})
    protocol = alone.model_copy(update={"analysis": alone.analysis.model_copy(update={"contrasts": (both,)})})
    planned = plan(protocol, felt_in(protocol))
    name, kind = next(iter(planned.kinds.items()))
    powers_ = Powers(plan=planned, sizes=(18,), studies=1, asked=1, seed=1, kinds={name: ()})
    page_text = power_markdown(powers_)
    place = [block.id for block in planned.blocks].index("delays")
    block = planned.blocks[place]
    item = [item.id for item in block.items].index("different")
    opinions = draw_opinions(planned, 4000, 1, 0)[place].answers(1.0, kind)[:, :, item]
    rows = [[setting.condition for setting in block.settings].index(condition) for condition in (first, second)]
    spread = float((opinions[:, rows[0]] - opinions[:, rows[1]]).std(ddof=1))
    row = next(line for line in page_text.splitlines() if line.startswith("| different"))
    assert float(row.split("|")[3]) == pytest.approx(spread, rel=0.1)


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        (0.1741, -0.0011, ("means 0.174 [", " and −0.001 [", "mean difference 0.175,")),  # 0.17, 0.00 and 0.18
        (0.1741, -0.0061, ("means 0.17 [", " and −0.01 [", "mean difference 0.18,")),
        (0.6349, 0.4051, ("means 0.635 [", " and 0.405 [", "mean difference 0.230,")),
    ],
)
def test_a_difference_agrees_with_the_means_beside_it(first: float, second: float, said: tuple[str, ...]) -> None:
    contrast = Contrast(measure=ITEMS[0], blocks=("b",), conditions=("c2", "c1"))
    (contrast_result,) = evaluate(statements(contrast, 0.5)).contrasts
    means = (first, second)
    sides = tuple(replace(side, mean=mean) for side, mean in zip(contrast_result.sides, means, strict=True))
    sentence = answer(replace(contrast_result, sides=sides, effect=first - second))
    assert all(words in sentence for words in said), sentence


def test_hypotheses_are_corrected_together_and_say_why_they_are_not_tested() -> None:
    contrast = Contrast(measure=ITEMS[0], blocks=("b",), conditions=("c2", "c1"))
    alike = Contrast(measure=ITEMS[1], blocks=("b",), groups=("one", "two"))
    first, second = evaluate(replace(statements(contrast, 0.5), contrasts=(contrast, alike))).contrasts
    assert first.p is not None
    assert first.p_adjusted == pytest.approx(2 * max(first.p, first.p_bootstrap, first.p_skewed))
    match = re.search(r"; bootstrap p = (\.\d+); skewness-corrected t p = (\.\d+)$", first.method)
    assert match is not None
    assert [float(p) for p in match.groups()] == pytest.approx([first.p_bootstrap, first.p_skewed], abs=0.001)
    assert abs(first.p_bootstrap - first.p_skewed) > 0.005
    assert (second.verdict, second.p) == ("not tested", None)
    assert second.note.startswith("fewer than two participants have both values")
    assert pd.isna(second.statistic) or second.statistic is None


def grouped(text: str, measure: str, block: str, sequence: str, share: int = 2) -> Protocol:
    """Return a study that compares two groups in a measure; the first group is ``share`` times as large."""
    contrast = f'contrasts = [{{ measure = "{measure}", blocks = ["{block}"], groups = ["a", "b"] }}]'
    groups = f"\n[groups.a]\nshare = {share}\nsequence = {sequence}\n[groups.b]\nsequence = {sequence}\n"
    return parse((text.replace("[analysis]\n", f"[analysis]\n{contrast}\n") + groups).encode(), "grouped.toml")


@pytest.mark.parametrize(
    ("block", "measures"),
    [
        ("viscosity", {"threshold", "exponent", "d_prime"}),  # JNDs at two standards have a slope
        ("detect", {"threshold", "d_prime"}),
        ("rate", {"d_prime"}),
        ("number", {"exponent"}),
        ("match", {"pse"}),
        ("pairs", {"d_prime"}),  # conditions have no levels
    ],
)
def test_a_hypothesis_is_about_a_measure_that_the_design_determines(block: str, measures: set[str]) -> None:
    _, sequence, text = re.split("sequence = (.*)", text_of("every_design"), maxsplit=1)
    text = f"format = 2\n{text}\n[analysis]\n"
    for measure in OF_LEVELS:
        if measure in measures:
            grouped(text, measure, block, sequence)
        else:
            with pytest.raises(ProtocolError, match=f'block "{block}" does not measure {measure}'):
                grouped(text, measure, block, sequence)


def test_power_states_the_smallest_detectable_difference_between_groups() -> None:
    text = "\n".join(line for line in DELAYED.splitlines() if not line.startswith("contrasts"))
    error = math.log(1.3) / math.sqrt(2)  # the SD of the two errors is ln 1.3
    results = {("late", 20): PrecisionResult([np.array([[error], [-error]])], [np.full(2, 0.2)])}
    for share, sizes in (1, "Each group contains 50 %"), (2, "The two groups contain 67 % and 33 %"):
        protocol = grouped(text, "threshold", "late", '["late", "prompt"]', share)
        precisions = Precisions(protocol=protocol, sizes=(3, 18), studies=10, asked=10, seed=1, found=results)
        page_text = threshold_markdown(precisions)
        assert f"{sizes} of the participants." in page_text
    spread = math.hypot(math.log(1.2), math.log(1.3))
    assert f"| 20 | 3 | ×/÷ {math.exp(spread):.2f} | too few | too few |" in page_text
    half, smallest = (math.exp(spread * end) for end in detectable_difference(12, 6, alpha=0.05, expected=None))
    root = spread * math.sqrt(1 / 12 + 1 / 6)
    assert half == pytest.approx(math.exp(student.ppf(0.975, 5) * root))
    assert f"| 20 | 18 | ×/÷ {math.exp(spread):.2f} | ×/÷ {half:.2f} | ×/÷ {smallest:.2f} |" in page_text
    text, _, rest = source_bytes("rek2024").decode().partition("sequence = ")
    sequence, _, rest = rest.partition("]")
    protocol = grouped(text + rest, "different", "delays", f"{sequence}]")
    planned = plan(protocol, felt_in(protocol))
    kinds = dict.fromkeys(planned.kinds, ())
    page_text = power_markdown(Powers(plan=planned, sizes=(18,), studies=1, asked=1, seed=1, kinds=kinds))
    _, _, _, spread, _, smallest, _ = (cell.strip(" ±") for cell in page_text.splitlines()[-1].split("|"))
    first, second = np.split(np.random.default_rng(3).normal(size=(4000, 18)) * float(spread), [12], axis=1)
    means = means_of(first + float(smallest), group=1) - means_of(second, group=2)
    are_significant = np.max(p_differs(means, "two-sided"), axis=0) <= 0.05
    assert are_significant.mean() == pytest.approx(0.8, abs=0.03), "all three tests must show the difference"


@pytest.mark.parametrize(("n", "alpha", "expected"), [(9, 0.05, None), (26, 0.02, "lower"), (40, 0.0125, "higher")])
def test_80_percent_of_studies_detect_the_smallest_difference(n: int, alpha: float, expected: str | None) -> None:
    """The t test alone detects it more often: the bootstrap and the test corrected for skewness must agree with it."""
    half, smallest = detectable_difference(n, alpha=alpha, expected=expected)
    assert half == pytest.approx(student.ppf(0.975, n - 1) / math.sqrt(n))
    values = np.random.default_rng(n).normal(size=(4000, n)) + smallest
    p = p_differs(means_of(values), "greater" if expected else "two-sided")
    assert (np.max(p, axis=0) <= alpha).mean() == pytest.approx(0.8, abs=0.03)
    assert (p.t <= alpha).mean() > 0.83


def test_power_states_whether_the_planned_participants_suffice() -> None:
    contrast = Contrast(measure="d_prime", blocks=("late", "prompt"), groups=("a", "b"))

    def told(planned: int, mean: float) -> str:
        lines = smallest_differences(
            contrast, (5, 16, 26), 0.06, 2, [("20", "90%", 0.9)], "trials", "SD.", "±{:.2f}".format, (0.5, 0.5),
            planned=planned, assumed=("d′", mean), titles={"late": "Green part"},
        )  # fmt: skip
        return "\n".join(lines)

    half, least = (0.9 * end for end in detectable_difference(8, 8, alpha=0.03, expected=None))
    assert 1.3 < least < 1.9
    few = told(16, 1.3)
    assert (
        "## Contrast: the difference in sensitivity (d′) between “Green part” and prompt differs between a and" in few
    )
    assert f"**The planned 16 participants are too few to find a difference in d′ smaller than ±{least:.2f} with" in few
    assert "would detect even a decrease in d′ from 1.3 to 0 in one block of one group (a difference of 1.3)." in few
    assert f"| 20 | 16 (planned) | 90% | ±{half:.2f} | ±{least:.2f} |" in few
    assert "| 20 | 5 | 90% | too few | too few |" in few  # a t test of groups of 2 has one degree of freedom
    assert "“Too few” means that fewer than 80 % of studies would detect even a difference of 3 SD." in few
    assert "even a decrease" not in told(16, 1.9)
    points = smallest_differences(
        contrast, (16,), 0.06, 2, [("20", "90%", 0.9)], "trials", "SD.", "±{:.2f}".format, (0.5, 0.5), planned=16,
        unit=" points", titles={},
    )  # fmt: skip
    assert f"find a difference smaller than ±{least:.2f} points with 80 % power" in "\n".join(points)
    assert "**The planned 5 participants are too few to find a difference in d′ of 3 SD with 80 % power.**" in told(
        5, 1.3
    )


@pytest.mark.parametrize(
    ("kinds", "ways", "se"),
    [
        (["difference"], "differences are first minus second", "difference"),
        (["ratio"], "ratios are first divided by second", "difference, or of the mean logarithm for a ratio"),
    ],
)
def test_the_direction_of_each_kind_and_its_standard_error_are_stated(kinds: list[str], ways: str, se: str) -> None:
    direction_words = _direction_text(kinds)
    assert direction_words.startswith(f"In the text, figures and tables, {ways}, in the order of the hypothesis;")
    assert f"SE is the standard error of the mean {se}, and CI" in direction_words


@pytest.mark.parametrize(
    ("sizes", "expected", "of_t"), [((34,), None, 0.495), ((27,), "higher", 0.491), ((64, 64), None, 0.499)]
)
def test_the_smallest_difference_is_slightly_above_that_of_published_tables(
    sizes: tuple[int, ...], expected: str | None, of_t: float
) -> None:
    """Cohen 1988, tables 2.4.1, for the t test alone: d = 0.5 needs 34 pairs, or two groups of 64 (α = .05)."""
    assert of_t < detectable_difference(*sizes, alpha=0.05, expected=expected)[1] < 1.15 * of_t


def test_a_difference_of_more_than_3_sd_is_infinite_and_a_smaller_one_is_not() -> None:
    """Student's t of 5 pairs must exceed 8.61 at α = .001, a difference of 3.85 SD; of 8 pairs 3.00 at .02, 1.06 SD."""
    assert detectable_difference(5, alpha=0.001, expected=None)[1] == math.inf
    assert 1.06 < detectable_difference(8, alpha=0.02, expected=None)[1] < 3.0


@pytest.mark.parametrize("groups", [(9,), (30,), (12, 6)])
def test_so_many_studies_without_a_difference_show_equality(groups: tuple[int, ...]) -> None:
    """The t tests alone show it more often: the bootstrap must agree with them."""
    draw, bound = np.random.default_rng(8), {9: 1.1, 30: 0.6, 12: 1.4}[groups[0]]
    each = [means_of(draw.normal(size=(4000, n)), group=group) for group, n in enumerate(groups)]
    means = each[0] - each[1] if groups[1:] else each[0]
    p = np.array([(side.p_t(-bound), side.p_bootstrap(-bound)) for side in (means, means.opposite())])
    by_t, by_both = (p[:, 0].max(axis=0) <= 0.05).mean(), (p.max(axis=(0, 1)) <= 0.05).mean()
    assert 0.2 < by_both < by_t - 0.03
    assert equivalence_power(*groups, alpha=0.05, bound=bound) == pytest.approx(by_both, abs=0.025)


D_PRIMES = [
    (f'stimulus = "{stimulus}", design = "2ifc", method = "m"', f'design = "2ifc", {COMPARED}')
    for stimulus in ("prompt", "late")
]


@pytest.mark.parametrize(
    ("edits", "bound", "spread"),
    [
        ([], math.log(1.25), math.hypot(math.log(1.2), math.log(1.3), math.log(1.3))),
        ([*D_PRIMES, ('"threshold"', '"d_prime"'), ("1.25", "0.3")], 0.3, math.hypot(math.log(1.2), 0.2, 0.2)),
        (
            [
                *D_PRIMES,
                ('"threshold"', '"d_prime"'),
                ("1.25", "0.3"),
                ('"late_one"]', '"late_one", "later_one"]'),
                ("tasks.stir", 'conditions.later_one = { liquid = "damper", delay_ms = 90 }\ntasks.stir'),
            ],
            0.3,
            math.hypot(math.log(1.2), 0.2),
        ),
    ],
    ids=["thresholds", "one comparison", "mean over two comparisons"],
)
def test_power_plans_differences_and_equality_within_people(
    edits: list[tuple[str, str]], bound: float, spread: float
) -> None:
    text = DELAYED
    for old, new in edits:
        text = text.replace(old, new)
    errors = (0.2 if edits else math.log(1.3)) / math.sqrt(2)  # their SD is 0.2 or ln 1.3
    results = {
        (block, 20): PrecisionResult([np.array([[errors], [-errors]])], [np.full(2, 0.2)])
        for block in ("late", "prompt")
    }
    page_text = threshold_markdown(
        Precisions(
            protocol=parse(text.encode(), "delayed.toml"), sizes=(40,), studies=10, asked=10, seed=1, found=results
        )
    )
    half, least = (spread * end for end in detectable_difference(40, alpha=0.05, expected="higher"))
    ends = f"{spread:.2f} | ±{half:.2f} | {least:.2f}"  # a one-sided test detects one direction
    if not edits:
        ends = f"×/÷ {math.exp(spread):.2f} | ×/÷ {math.exp(half):.2f} | × {math.exp(least):.2f}"
    assert ("(a factor of 1.2), at a mean d′ of 1." if edits else "(a factor of 1.2).") in page_text
    assert "Equivalence requires at least 14 participants, at α = 0.05. Participants are included if both" in page_text
    assert "| smallest difference | shown to be equivalent if there is no difference |" in page_text
    assert page_text.strip().endswith(
        f"| {ends} | {100 * equivalence_power(40, alpha=0.05, bound=bound / spread):.0f} % |"
    )


def test_power_counts_studies_of_statements_that_show_equality() -> None:
    text = source_bytes("rek2024").decode()
    contrast = (
        'contrasts = [{ measure = "different", blocks = ["delays"], conditions = ["delay_50", "delay_0"], bound = 1 }]'
    )
    protocol = parse(text.replace("[analysis]\n", f"[analysis]\n{contrast}\n").encode(), "rek2024.toml")
    planned = plan(protocol, felt_in(protocol))
    counts = count_findings(planned, (12, 24), 1, 0, 20)
    opinions = [draw_opinions(planned, 24, 1, study) for study in range(20)]
    (at,) = (place for place, block in enumerate(planned.blocks) if block.id == "delays")
    item = [statement.id for statement in planned.blocks[at].items].index("different")
    answers = stacked_answers(opinions, at, (0.0,), PUBLISHED[TYPICAL])[0, :, :, :2, item]
    away = answers[..., 1] - answers[..., 0]
    equivalent = sum(tost(sample, 1.0).verdict == "equivalent" for sample in away - away.mean())
    assert 0 < equivalent < 20
    row = f"| *{planned.contrasts[0].described()}, if there is no difference* | 0 % | {100 * equivalent / 20:.0f} % ("
    assert row in power_markdown(powers(planned, (12, 24), 20, 20, 1, counts))


@pytest.fixture(scope="module")
def guessed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Results]:
    """A study of d′ with three simulated participants."""
    folder = tmp_path_factory.mktemp("guessed")
    text = DELAYED
    for old, new in [*D_PRIMES, ('"threshold"', '"d_prime"'), ("1.25", "0.3")]:
        text = text.replace(old, new)
    (folder / "delayed.toml").write_text(text, encoding="utf-8", newline="\n")
    study = rehearse_answers(folder / "delayed.toml", participants=3, seed=3, results=folder / "s")
    unblind(study, "AB", "to analyse")
    loaded_study = load_study(study)
    return loaded_study, evaluate(loaded_study)


@pytest.mark.parametrize(
    ("ends", "named"),
    [
        (((-0.1, 0.9), (0.2, 1.1)), "Prompt"),
        (((0.1, 0.9), (-0.2, 1.1)), "Late"),
        (((-0.3, 0.9), (-0.2, 1.1)), "Prompt and Late"),
        (((0.1, 0.9), (0.2, 1.1)), ""),
    ],
)
def test_a_mean_d_prime_that_may_be_chance_is_a_limit(
    guessed: tuple[Study, Results], ends: tuple[tuple[float, float], ...], named: str
) -> None:
    study, results = guessed
    (contrast,) = results.contrasts
    sides = tuple(
        replace(side, name=name, low=low, high=high)
        for side, name, (low, high) in zip(contrast.sides, ("Prompt", "Late"), ends, strict=True)
    )
    page = limits(study, replace(results, contrasts=(replace(contrast, sides=sides),)))
    lines = [line for line in page if "(chance)" in line]
    assert lines == [
        f"Hypothesis: the interval of the mean d′ in {named} includes 0 (chance). If the participants guessed, "
        "d′ cannot show a difference."
    ] * bool(named)
    limitation_lines = limits(study, replace(results, contrasts=(replace(contrast, sides=sides, verdict="shown"),)))
    assert not [line for line in limitation_lines if "(chance)" in line], "it has been detected"


def test_a_single_comparison_shows_participants_as_points(guessed: tuple[Study, Results]) -> None:
    study, results = guessed
    captions = [picture.caption for picture in draw_figures(level_figure_tasks(study, results.levels, forms=()))]
    assert len(captions) == 2
    assert all("; small points show individual participants. Other panels" in caption for caption in captions)


def test_an_order_that_is_the_same_for_all_is_a_limit_of_a_comparison_of_blocks(guessed: tuple[Study, Results]) -> None:
    guessed_study, results = guessed

    def told(**study: str) -> list[str]:
        protocol = {**guessed_study.protocol, "study": {**guessed_study.protocol["study"], **study}}
        return [line for line in limits(replace(guessed_study, protocol=protocol), results) if "completed" in line]

    assert told() == [
        "Hypothesis: all participants completed Prompt before Late, so the difference cannot be distinguished from "
        "effects of the order, such as practice."
    ]
    assert told(block_order="balanced") == []


def test_each_column_of_a_hypothesis_has_its_value_in_the_tables_and_in_the_report() -> None:
    values = {"first": {"P1": 2.0, "P2": 3.5, "P3": 9.0}, "second": {"P1": 1.0, "P2": 5.0, "P3": 3.0}}
    sides = (
        ContrastSide(name="c2", values=values["first"], mean=4.21, low=3.6, high=4.9, sd=1.61, standard_error=0.83),
        ContrastSide(name="c1", values=values["second"], mean=3.59, low=3.1, high=4.2, sd=1.42, standard_error=0.72),
    )
    warm = ContrastResult(
        test="contrast, paired t test", n=23, dropped=2, statistic_name="t", statistic=2.31, p=0.031, effect=0.62,
        method="two-sided", effect_name="difference", no_interval="", note="", compared=("c2", "c1"), ratio=False,
        interval=Interval(low=0.06, high=1.18, level=0.95, method="t(22)"), p_adjusted=0.074, members=2, higher=14,
        contrast=Contrast(measure="warm", blocks=("b",), conditions=("c2", "c1"), bound=1.5), verdict="not shown",
        equivalent=False, p_bootstrap=0.037, p_skewed=0.029, p_equivalent=0.21, not_excluded=None, sides=sides,
        left_out={"P7": "no answer", "P9": "asleep", "P8": "no answer"}, sd=1.29, bayes_factor=1.87,
        standardised=EffectSize(name="d_z", value=0.48, low=0.04, high=0.91, t=2.31), measure_name="warmth",
        ordinal=EffectSize(name="delta", value=0.35, low=-0.02, high=0.66), block_title="Oil", standard_error=0.27,
        freedom=22,
    )  # fmt: skip
    late = replace(
        warm, contrast=Contrast(blocks=("late", "prompt"), expected="higher"), compared=("Late", "Prompt"), ratio=True,
        interval=None, no_interval="all equal", note="too few", sides=(), standardised=None, ordinal=None, left_out={},
        verdict="shown", measure_name="",
    )  # fmt: skip
    results: Any = SimpleNamespace(contrasts=(warm, late), decided=SimpleNamespace(binding=True))
    rows = list(contrasts.contrast_rows(results))
    assert [[row[name] for row in rows] for name in ("block", "item", "interval", "note", "verdict")] == [
        ["b", "late"], ["warm", None], ["t(22)", "all equal"], [None, "too few"], ["not shown", "shown"],
    ]  # fmt: skip
    assert rows[0] == {
        "block": "b", "question": "Warmth differs between c2 and c1 in Oil, with an equivalence bound of 1.5",
        "item": "warm", "comparison": None, "test": "contrast, paired t test", "n": 23, "dropped": 2,
        "statistic_name": "t", "statistic": 2.31, "p": 0.031, "p_adjusted": 0.074, "smallest_p": None,
        "family": "hypotheses", "members": 2, "correction": "Holm", "primary": True, "verdict": "not shown",
        "effect_name": "difference", "effect": 0.62, "low": 0.06, "high": 1.18, "level": 0.95, "interval": "t(22)",
        "method": "two-sided", "note": None, "codes": "",
    }  # fmt: skip
    lines = list(page_lines("".join(contrast_section(results))))
    for line in (
        "Comparison | n | t | df | t-test p | p | adjusted p | equivalence p | mean difference or ratio | SE | 95 % CI "
        "lower | 95 % CI upper | BF₁₀ | Verdict",
        "1. Warmth: c2 − c1 | 23 | 2.31 | 22 | .031 | .037 | .074 | .210 | 0.62 | 0.27 | 0.06 | 1.18 | 1.87 | "
        "not significant",
        "2. Threshold: Late ÷ Prompt | 23 | 2.31 | 22 | .031 | .037 | .074 | .210 | 0.62 | 0.27 | – | – | 1.87 | "
        "significant",
        "1. Warmth: c2 − c1 | d z | 0.48 | 0.04 | 0.91",
        "1. Warmth: c2 − c1 | delta | 0.35 | −0.02 | 0.66",
        "1. Warmth: c2 | 3 | 4.21 | 3.50 | 1.61 | 0.83",
        "1. Warmth: c1 | 3 | 3.59 | 3.00 | 1.42 | 0.72",
        "1. Warmth: c2 − c1 | 3 | 0.62 | 1.00 | 1.29 | 0.27",
    ):
        assert line in lines
    excluded = "excluded P7, P8 (no answer); P9 (asleep)."
    assert any(line.endswith(f"equivalence bound of 1.5: {excluded}") for line in lines)


def test_the_measure_of_a_hypothesis_is_named_by_the_texts_of_its_own_block_or_form() -> None:
    def block(name: str, **shorts: str) -> Any:
        return SimpleNamespace(id=name, items=[SimpleNamespace(id=item, short=text) for item, text in shorts.items()])

    load, after = (QuestionPlace(name, name.capitalize(), True, ()) for name in ("load", "after"))
    score = Score(items=("calm",))
    others = SimpleNamespace(
        scores=[
            PlacedScore(where, "raw", instrument, score, ())
            for where, instrument in ((after, "sus"), (load, "nasa-tlx"))
        ],
        questions=[
            SimpleNamespace(where=form, id=name, short=f"{name} of {form.id}")
            for name in ("calm", "sure")
            for form in (after, load)
        ],
    )
    blocks = [block("a", warm="Hot"), block("b", thick="Thick", warm="Warm"), block("c", warm="Lukewarm")]
    study: Any = SimpleNamespace(blocks=blocks, others=others, levels=[])
    for hypothesis_keys, name in (
        ({"measure": "warm", "blocks": ("b",), "conditions": ("c2", "c1")}, "agreement with “Warm”"),
        ({"measure": "warm", "blocks": ("c",), "conditions": ("c2", "c1")}, "agreement with “Lukewarm”"),
        ({"measure": "raw", "form": "load", "blocks": ("a", "b")}, "NASA-TLX raw score"),
        ({"measure": "sure", "form": "load", "blocks": ("a", "b")}, "“sure of load” (Load)"),
        ({"measure": "threshold", "blocks": ("a", "b")}, ""),
    ):
        assert contrasts._measure_name(study, Contrast.model_validate(hypothesis_keys)) == name


@pytest.mark.parametrize(
    ("p", "adjusted", "verdict", "sentence"),
    [
        (0.031, 0.093, "not shown", " Before the adjustment for 3 hypotheses, p = .031."),
        (0.031, 0.031, "shown", ""),
        (0.062, 0.186, "not shown", ""),
        (0.013, 0.039, "not shown", ""),
        (None, None, "not tested", ""),
    ],
)
def test_p_before_the_adjustment_is_given_if_only_the_adjustment_makes_it_larger_than_5_percent(
    p: float | None, adjusted: float | None, verdict: str, sentence: str
) -> None:
    contrast: Any = SimpleNamespace(largest_p=p, p_adjusted=adjusted, verdict=verdict, members=3)
    assert contrasts._adjustment_text(contrast) == sentence

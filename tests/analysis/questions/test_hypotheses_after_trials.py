"""Hypotheses about sliders, ratings and scores that are answered after each trial."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from scipy.stats import ttest_1samp, ttest_ind, ttest_rel

from study_app.analysis.contrasts import contrast_results
from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.figures.summary_figures import numbers_of
from study_app.analysis.planning.power_estimates import estimate_markdown, estimate_power
from study_app.analysis.planning.preregistration import preregistration
from study_app.analysis.planning.simulated_studies import ConditionFeatures
from study_app.analysis.report.first_page import cards
from study_app.analysis.report.methods import methods
from study_app.errors import ProtocolError
from study_app.protocol.load import parse
from study_app.protocol.model import Contrast
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.unblinding import unblind
from tests.studies import made_up

pytestmark = pytest.mark.slow

PEOPLE = 9
FILE = """
format = 2
study = { name = "line", block_order = "balanced" }
liquids.honey.drag = { law = "linear", damping_nspm = 8 }
liquids.water.drag = { law = "linear", damping_nspm = 1 }
conditions.honey.liquid = "honey"
conditions.water.liquid = "water"
tasks.stir.kind = "follow"
scales.nine.labels.en = ["1", "2", "3", "4", "5", "6", "7", "8", "9"]
groups = { old = {}, new = {} }

[questionnaires.after]
intro = "How did it feel?"
items = [
  { id = "thick", kind = "slider", text = "How thick was it?", short = "Thickness", low = "thin", high = "thick" },
  { id = "warm", kind = "rating", scale = "nine", text = "How warm was it?", short = "Warmth" },
  { id = "hand", kind = "choice", text = "Which hand?", short = "Hand", options = [
    { id = "left", text = "Left" }, { id = "right", text = "Right" },
  ] },
]
scores.both = { items = ["thick", "warm"], combine = "sum" }

[blocks.first]
conditions = ["honey", "water"]
questionnaire = "after"
task = "stir"
repetitions = 2
order = "shuffled"

[blocks.second]
conditions = ["water"]
questionnaire = "after"
task = "stir"

[analysis]
participants = 9
contrasts = [
  { measure = "thick", blocks = ["first"], conditions = ["honey", "water"], expected = "higher", bound = 5 },
  { measure = "warm", blocks = ["first", "second"] },
  { measure = "both", blocks = ["first"], conditions = ["water", "honey"] },
  { measure = "thick", blocks = ["first"], groups = ["old", "new"] },
]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("line")
    file = place / "line.toml"
    file.write_text(FILE, encoding="utf-8", newline="\n")
    return rehearse_answers(file, participants=PEOPLE, seed=8, results=place / "results", features=made_up(file))


@pytest.fixture(scope="module")
def study(folder: Path) -> Study:
    unblind(folder, "AB", "to analyse")
    return load_study(folder)


@pytest.fixture(scope="module")
def answers(folder: Path, study: Study) -> pd.DataFrame:
    """Answers in the participants' files, with the condition of each trial."""
    files = sorted(folder.rglob("*responses_data.csv"))
    rows = pd.concat([pd.read_csv(file, na_values="n/a") for file in files])
    conditions = {
        (question.where.id, setting.code): setting.condition
        for question in study.others.questions
        for setting in question.where.settings
    }
    rows["condition"] = [conditions[place] for place in zip(rows["block"], rows["code"], strict=True)]
    return rows[rows["item"] != "hand"].astype({"value": float})


def _means(answers: pd.DataFrame, item: str, block: str = "first") -> pd.DataFrame:
    """Return the mean answer of each participant in each condition of a block."""
    rows = answers[(answers["item"] == item) & (answers["block"] == block)]
    return rows.pivot_table("value", "participant", "condition", aggfunc="mean")


def test_each_hypothesis_is_the_t_test_of_the_means_of_the_answers(study: Study, answers: pd.DataFrame) -> None:
    thickness, warmth, total, groups = evaluate(study).contrasts
    thick, warm = _means(answers, "thick"), _means(answers, "warm")
    assert thick.notna().to_numpy().all()
    assert len(thick) == PEOPLE

    test = ttest_rel(thick["honey"], thick["water"], alternative="greater")
    assert (thickness.statistic, thickness.p) == pytest.approx((test.statistic, test.pvalue))
    differences = thick["honey"] - thick["water"]
    t_tests = [
        ttest_1samp(differences, bound, alternative=side).pvalue for bound, side in ((-5, "greater"), (5, "less"))
    ]
    assert thickness.p_equivalent is not None
    assert thickness.p_equivalent >= max(t_tests) - 1e-9

    second = _means(answers, "warm", "second")["water"]
    test = ttest_rel(warm.mean(axis=1), second)
    assert (warmth.statistic, warmth.p) == pytest.approx((test.statistic, test.pvalue))

    both = thick + warm
    test = ttest_rel(both["water"], both["honey"])
    assert (total.statistic, total.p) == pytest.approx((test.statistic, test.pvalue))

    means, groups_of = thick.mean(axis=1), study.trials.groupby("participant")["group"].first()
    old, new = (means[[groups_of[person] == group for person in means.index]] for group in ("old", "new"))
    assert len(old) + len(new) == PEOPLE
    assert groups.statistic == pytest.approx(ttest_ind(old, new, equal_var=False).statistic)


def test_a_participant_without_an_answer_in_a_condition_is_excluded(study: Study) -> None:
    answered, contrast = study.answered.copy(), study.contrasts[0]
    codes = {setting.condition: setting.code for setting in study.others.questions[0].where.settings}
    is_thick = (answered["item"] == "thick") & (answered["block"] == "first")
    unanswered = is_thick & (answered["participant"] == "P004") & (answered["code"] == codes["water"])
    assert unanswered.sum() == 2
    answered.loc[unanswered, ["response", "value"]] = pd.NA
    partly_answered = replace(study, answered=answered)
    assert partly_answered.contrasts == study.contrasts

    paired, _, _, between = contrast_results(partly_answered, [], [])
    assert paired.contrast == contrast
    assert paired.left_out == {"P004": "an answer to thick is missing in water"}
    assert "P004" in between.left_out
    assert (paired.n, between.n) == (PEOPLE - 1, PEOPLE - 1)


def test_the_first_page_states_the_scale_and_shows_each_value_once(study: Study) -> None:
    results = evaluate(study)
    thickness, warmth, total, _, *others = cards(results, numbers=numbers_of(study))
    assert thickness.question == (
        "Hypothesis 1: “Thickness” is higher in honey than in water in First, with an equivalence bound of 5"
    )
    assert thickness.sentences[0].endswith("The scale ranges from 0 to 100.")
    assert warmth.question == "Hypothesis 2: “Warmth” differs between First and Second"
    assert warmth.sentences[0].endswith("The scale ranges from 1 to 9.")
    assert total.question == "Hypothesis 3: The both score differs between water and honey in First"
    assert total.sentences[0].endswith("The scale ranges from 1 to 109.")
    first, second = others
    assert not any("The mean both score" in sentence for sentence in first.sentences), "hypothesis 3 shows it"
    assert any("The mean both score" in sentence for sentence in second.sentences)


def test_the_preregistration_states_only_the_tested_hypotheses(study: Study) -> None:
    text = preregistration(parse(FILE.encode(), "line.toml"), "hash")
    assert "- Hypothesis: the both score differs between water and honey in block “First”." in text
    assert (
        "- We describe the answers to the questions in block “First” and block “Second”, but do not test them except "
        "in the hypotheses above." in text
    )
    assert text.count("participant (the mean of repeated answers).") == 2
    assert text.count("(the mean of repeated answers, averaged over the conditions of a block).") == 2
    assert "Friedman" not in text
    assert "agreement" not in text.partition("## The protocol in words")[0]


def test_the_methods_state_the_mean_over_conditions_only_where_blocks_are_compared(study: Study) -> None:
    results = evaluate(study)
    one_value = "contributed one value to each comparison (the mean of repeated answers to another question"
    assert f"{one_value} and the mean over the conditions of a block)" in methods(study, results)
    within_a_block = replace(results, contrasts=(results.contrasts[0],))
    assert f"{one_value})" in methods(study, within_a_block)


def test_power_is_stated_in_standard_deviations_without_simulated_studies() -> None:
    protocol = parse(FILE.encode(), "line.toml")

    def rehearse() -> ConditionFeatures:
        raise AssertionError("nothing is simulated")

    with ThreadPoolExecutor(1) as executor:
        (estimate,) = estimate_power(protocol, executor, sizes=(9,), rehearse=rehearse, progress=lambda _text: None)
    text = estimate_markdown(estimate)
    assert "SIMULATED" not in text
    assert "## Contrast: “thick” is higher in honey than in water in block first" in text
    assert "| thick | 9 (planned) | 1 |" in text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('measure = "both"', 'measure = "hand"'), "hand is a choice, but hypotheses compare numbers"),
        (('measure = "both"', 'measure = "none"'), 'block "first" does not measure none'),
        (
            ('conditions = ["water"]\nquestionnaire = "after"', 'conditions = ["water"]\nquestionnaire = "coarse"'),
            "the two blocks measure warm on different scales",
        ),
    ],
)
def test_a_measure_that_cannot_be_compared_is_refused(change: tuple[str, str], words: str) -> None:
    coarse = """
scales.three.labels.en = ["1", "2", "3"]
questionnaires.coarse.intro = "How did it feel?"
questionnaires.coarse.items = [
  { id = "warm", kind = "rating", scale = "three", text = "How warm was it?", short = "Warmth" },
]
groups ="""
    text = FILE.replace("\ngroups =", coarse).replace(*change)
    with pytest.raises(ProtocolError, match=words):
        parse(text.encode(), "line.toml")


@pytest.mark.parametrize(("combine", "is_refused"), [("sum", False), ("mean", True)])
def test_two_blocks_are_compared_by_a_score_only_if_it_is_computed_alike(combine: str, is_refused: bool) -> None:
    """The second block has the same questions in another questionnaire."""
    before, after = FILE.split("[questionnaires.after]")
    questions, blocks = after.split("[blocks.first]")
    other = f"[questionnaires.other]{questions}".replace('combine = "sum"', f'combine = "{combine}"')
    blocks = blocks.replace('["water"]\nquestionnaire = "after"', '["water"]\nquestionnaire = "other"')
    text = f"{before}[questionnaires.after]{questions}{other}[blocks.first]{blocks}"
    text = text.replace('measure = "warm", blocks', 'measure = "both", blocks')
    if is_refused:
        with pytest.raises(ProtocolError, match="the two blocks measure both on different scales"):
            parse(text.encode(), "line.toml")
    else:
        assert parse(text.encode(), "line.toml").blocks["second"].questionnaire == "other"


def test_only_statements_have_agreement() -> None:
    protocol = parse(FILE.encode(), "line.toml")
    slider = Contrast(measure="thick", blocks=("first",), conditions=("honey", "water"))
    assert not protocol.compares_statement(slider)
    assert protocol.measure_text(slider) == "“thick”"
    assert protocol.measure_text(Contrast(blocks=("first", "second"))) == "threshold"

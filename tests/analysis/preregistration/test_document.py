"""The preregistration's text: everything from the protocol, the same bytes each time."""

import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.analysis.contrasts import inclusion_text
from study_app.analysis.planning.preregistration import (
    FILE,
    _interval_lines,
    commitment,
    preregistration,
    read_commitment,
)
from study_app.analysis.planning.threshold_studies import BATCH, threshold_markdown
from study_app.cli import commands
from study_app.protocol.load import load, parse
from study_app.protocol.model import Contrast
from study_app.protocol.source.files import protocol_hash, shipped, source_bytes
from tests.analysis.power.test_threshold_power import swept
from tests.protocol.edited_studies import text_of
from tests.protocol.trials.level_studies import FIVE_POINTS, study

HEADS = (
    "Hypotheses and questions",
    "Design",
    "Participants",
    "Exclusions",
    "Analysis",
    "The protocol in words",
    "Values that the report checks",
)


def written_preregistration(*words: str) -> str:
    result = CliRunner().invoke(commands, ["preregister", *words])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_every_shipped_study_has_all_sections_and_its_hash(name: str, tmp_path: Path) -> None:
    text = written_preregistration(name)
    places = [text.index(f"\n## {head}\n") for head in HEADS]
    assert places == sorted(places)
    digest = protocol_hash(source_bytes(name))
    assert f"SHA-256 `{digest}`" in text
    assert "None" not in text
    questions = text[places[0] : places[1]].strip().splitlines()[2:]
    assert len(questions) >= 1
    assert all(line.startswith("- ") for line in questions)
    (tmp_path / FILE).write_text(text, encoding="utf-8", newline="\n")
    committed = read_commitment(tmp_path)
    assert committed == commitment(load(name), digest)
    assert committed is not None
    assert (committed.study, committed.protocol_hash) == (load(name).study.name, digest)


@pytest.mark.slow
def test_a_study_of_thresholds_states_levels_sample_size_and_catch_rule() -> None:
    text = preregistration(load("viscosityjnd"), "0" * 64)
    assert "Weber fraction for damping at the hand at 4, 8, 16 and 32 N·s/m?" in text
    assert "exponent 1, Weber's law" in text
    assert "Weber fraction 0.19, at 71 % correct, n = 10" in text
    assert "We plan to include 20 participants. The study ends when this number of participants have completed" in text
    assert (
        "are the data unblinded and tested. The goal is a 95 % interval for the group mean no wider than ±20 %." in text
    )
    assert "we simulated 50 trials per standard" in text
    assert (
        "- Block “Viscosity” compares levels of damping at the hand. The trial order is drawn for each session." in text
    )
    assert 'Rule "catch": a session with more than 25 % incorrect answers' in text
    assert "the trial is repeated, for up to 3 presentations in total" in text
    assert "Hartung–Knapp 95 % interval if there are at least 3 participants" in text
    assert "Power was not computed" not in preregistration(load("thickness"), "0" * 64)


@pytest.mark.parametrize(
    ("standards", "at"), [("[1]", "1 Pa·s"), ("[1, 2]", "1 and 2 Pa·s"), ("[1, 4, 2]", "1, 4 and 2 Pa·s")]
)
def test_the_exponent_is_asked_for_with_two_standards_or_more(standards: str, at: str) -> None:
    protocol = study(("standards = [1, 2]", f"standards = {standards}"))
    lines = list(_interval_lines(protocol, protocol.blocks["viscosity"]))
    assert lines[0].startswith(f"Block “Viscosity”: what is the Weber fraction for viscosity at {at}? ")
    assert ["proportional to the standard" in question for question in lines[1:]] == [True] * (at != "1 Pa·s")


def test_a_study_of_ratings_states_d_a_and_how_precise_it_is_expected_to_be() -> None:
    more = FIVE_POINTS + '\n[blocks.rate]\ntask = "stir"\nstimulus = "value"\ndesign = "rated"\nmethod = "few"\n'
    edits = [('sequence = ["viscosity"]', 'sequence = ["viscosity", "rate"]'), ("[0.2, 0.4, 0.8]", "[0.5, 0.6, 0.8]")]
    text = preregistration(study(*edits, ("part = 1\n", ""), ('code_prefix = "V"\n', ""), more=more), "0" * 64)
    assert "- Block “Rate”: we report d_a for each level relative to the lowest level, calculated from" in text
    assert "Block “Viscosity”: d_a" not in text
    assert "at d_a = 1: ±" in text


def test_a_study_of_statements_states_its_hypotheses_and_corrections() -> None:
    text = preregistration(load("rek2024"), "0" * 64)
    assert "Hypothesis, block “Delay effect”: agreement with" in text
    assert "(comfortable) decreases with the delay." in text
    assert "- Block “Baseline settings” compares water, honey and light_oil. The trial order" in text
    assert "within ±1 point?" in text
    assert "above chance (statements: “like_water” for water, “like_honey” for honey and “like_oil” for" in text
    assert "Alpha is 0.05. The p values of primary statements (all) are Holm-adjusted" in text
    assert "exploratory tests of means require at least 10 participants." in text
    assert "The number of participants has not been decided, and there is no stopping rule." in text
    assert "`liquid-study power rek2024 --to DIR`" in text


def test_a_study_without_questions_plans_no_test() -> None:
    study_text = """
format = 2
study.name = "reach"
liquids.damper.drag = { law = "linear", damping_nspm = 8 }
conditions = { prompt = { liquid = "damper" }, late = { liquid = "damper", delay_ms = 90 } }
tasks.stir = { kind = "follow", instruction = "Go." }
blocks.b = { conditions = ["prompt", "late"], order = "shuffled" }
analysis.participants = 7
"""
    text = preregistration(parse(study_text.encode(), "reach.toml"), "0" * 64)
    analysis = text.partition("## Analysis\n\n")[2].partition("\n\n## ")[0]
    assert analysis.startswith("- No test is planned. We report the medians and quartiles of duration, path length")


def test_the_tables_of_power_are_included(tmp_path: Path) -> None:
    (tmp_path / "power.md").write_text(
        "# Power for Feeling (rek2024 1.1)\n\n## Delays\n\n| n |\n", encoding="utf-8", newline="\n"
    )
    text = written_preregistration("rek2024", "--power", str(tmp_path))
    assert "\n### Power for Feeling (rek2024 1.1)\n\n#### Delays\n\n| n |\n\n## Exclusions\n" in text
    assert "Power was not computed" not in text


@pytest.mark.parametrize(
    ("content", "line"), [(None, "power.md cannot be read"), ("# Power for x (y 1)", "was not written for rek2024 1.1")]
)
def test_a_folder_without_this_studys_power_is_a_usage_error(content: str | None, line: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / "power.md").write_text(content, encoding="utf-8", newline="\n")
    result = CliRunner().invoke(commands, ["preregister", "rek2024", "--power", str(tmp_path)])
    assert result.exit_code == 2
    assert line in " ".join(result.output.split())


def test_a_preregistration_is_written_into_a_folder(tmp_path: Path) -> None:
    to = tmp_path / "results" / "demo"
    assert written_preregistration("demo", "--to", str(to)).strip() == str(to / FILE)
    assert (to / FILE).read_text(encoding="utf-8") == written_preregistration("demo")


DISCRIMINATION = """
format = 2
sequence = ["prompt", "after", "late", "after"]
study.name = "discrimination"
liquids.water = { density_kg_m3 = 998, viscosity_pa_s = 0.001 }
liquids.slime = { density_kg_m3 = 1030, viscosity_pa_s = 0.2 }
conditions.water.liquid = "water"
conditions.slime.liquid = "slime"
conditions.late_water = { liquid = "water", delay_ms = 70 }
conditions.late_slime = { liquid = "slime", delay_ms = 70 }
tasks.stir = { kind = "explore", min_s = 2, max_s = 6, instruction.en = "Stir." }
blocks.prompt = { design = "abx", conditions = ["water", "slime"], standard = "water", task = "stir", repetitions = 18 }
scales.seven.labels.en = ["1", "2", "3", "4", "5", "6", "7"]
analysis = { participants = 14, contrasts = [{ measure = "d_prime", blocks = ["prompt", "late"] }] }
[questionnaires.after]
scale = "seven"
intro.en = "Do you agree?"
items = [{ id = "easy", text.en = "It was easy.", short.en = "Easy" }]
[blocks.late]
design = "abx"
conditions = ["late_slime", "late_water"]
standard = "late_water"
task = "stir"
repetitions = 18
"""


def test_a_d_prime_preregistration_omits_other_measures_and_states_its_precision_once() -> None:
    protocol = parse(DISCRIMINATION.encode(), "discrimination.toml")
    text = preregistration(protocol, "0" * 64)
    assert "- Block “Prompt”: how well can slime be discriminated from water (d′)?" in text
    assert "- Block “Late”: how well can late_slime be discriminated from late_water (d′)?" in text
    assert "- We describe the answers to the questions in “After”, but do not test them. We report the mean" in text
    assert "maximum number of attempts to deliver an interval trial (3)" in text
    for other in ("threshold", "speed of the target", "delivered level", "delay difference", "Primary"):
        assert other not in text
    assert text.count("for 14 participants") == 2  # once for each block
    precisions = swept(protocol, (), (14,), BATCH)
    tables = preregistration(protocol, "0" * 64, threshold_markdown(precisions))
    assert "for 14 participants" not in tables
    assert f"| ±{100 * precisions.found['late', 18].half(0):.0f} % |" in tables


ADJUSTMENT = """
format = 2
sequence = ["training", "late"]
study.name = "late"
liquids.water.density_kg_m3 = 998
tasks.move = { kind = "explore", min_s = 2, max_s = 6, instruction = "Stir." }
stimuli.delay = { vary = "delay_ms", level = "value", levels = [1, 300], spacing = "linear" }
stimuli.clear = { vary = "delay_ms", standards = [0], levels = [50, 300] }
methods.few = { kind = "constant", levels = [200], repetitions = 10 }
designs.notice = { kind = "adjustment", standard = false }
designs.lag = { kind = "yesno", feedback = "always" }
blocks.late = { stimulus = "delay", design = "notice", method = "adjustment" }
[blocks.training]
phase = "practice"
stimulus = "clear"
design = "lag"
method = "few"
until = { right = 8, of = 10, missed = "end" }
"""


def test_settings_without_a_standard_and_the_practice_are_described() -> None:
    text = preregistration(parse(ADJUSTMENT.encode(), "late.toml"), "0" * 64)
    assert "Block “Late” compares levels of visual delay." in text
    assert (
        "The practice block “Training” has at most 14 trials, which are not analysed. The block ends as soon as 8 of "
        "the last 10 answers are correct; if this never happens, the session ends. Feedback is given after every trial."
    ) in text
    assert "for each participant, we report the mean of the settings, their standard deviation, and the diff" in text
    assert "Settings that the time limit ended, or that lie at an end of the range, are included" in text
    assert not [words for words in ("subjective equality", "constant error") if words in text]


def test_limits_of_levels_are_stated_if_levels_vary() -> None:
    text = preregistration(load("viscosityjnd"), "0" * 64)
    assert "speed of the target it follows (40 %)" in text
    assert "interval's delivered level (2 %)" in text
    assert "delay difference" not in text


LIQUIDS = """
format = 2
study = { name = "liquids", description = "Which liquid\\nfeels heavy?" }
conditions.water.liquid = "water"
conditions.oil.liquid = "oil"
conditions.honey.liquid = "honey"
liquids.water.density_kg_m3 = 998
liquids.oil.density_kg_m3 = 870
liquids.honey.density_kg_m3 = 1420
tasks.stir = { kind = "explore", min_s = 2, max_s = 6, instruction = "Stir." }
scales.seven.labels.en = ["1", "2", "3", "4", "5", "6", "7"]
[analysis]
participants = 9
[questionnaires.after]
scale = "seven"
intro = "Do you agree?"
items = [{ id = "heavy", text = "It was heavy.", short = "Heavy" }]
[blocks.two]
conditions = ["water", "honey"]
order = "latin"
questionnaire = "after"
[blocks.three]
conditions = ["water", "oil", "honey"]
order = "shuffled"
questionnaire = "after"
"""
NUMBER = '{ id = "heavy", kind = "number", text = "How heavy?", short = "Weight" }'
STATEMENT = '{ id = "heavy", text = "It was heavy.", short = "Heavy" }'
TWO_SESSIONS = 'format = 2\nsequences = [["two", "three"], ["three"]]'
FORM = "[questionnaires.after]"
HYPOTHESIS = '[[analysis.contrasts]]\nmeasure = "heavy"\nblocks = ["two"]\nconditions = ["honey", "water"]\n'
ONLY_WATER = ('["water", "oil", "honey"]', '["water"]')
SIGNED_RANKS = "we test each statement with Wilcoxon's signed-rank test."


@pytest.mark.parametrize(
    ("edits", "lines", "missing"),
    [
        (
            [],
            [
                f"- Block “Two”: {SIGNED_RANKS}",
                "- Block “Three”: we test each statement with Friedman's test (permutation). If a statement shows a "
                "difference, we compare pairs of conditions with Wilcoxon's signed-rank test, Holm-adjusted across all "
                "pairs in the block.",
                "- Block “Two” compares water and honey. The trial order follows a row of a Latin square, assigned by "
                "the number in the participant's ID.",
                "- Block “Three” compares water, oil and honey. The trial order is drawn for each session.",
                "We plan to include 9 participants. The study ends when this number of participants have completed a "
                "valid session; only then are the data unblinded and tested.",
                "Which liquid feels heavy?",
            ],
            ["seed, as", "We describe"],
        ),
        (
            [(', "oil", "honey"]', ', "oil"]'), ("format = 2", TWO_SESSIONS), ('"shuffled"', '"fixed"')],
            [
                f"- Blocks “Two” and “Three”: {SIGNED_RANKS}",
                "- Block “Three” compares water and oil. The trial order is the same for all participants.",
                "We plan to include 9 participants, with 2 sessions each. The study ends when this number of "
                "participants have completed all of their sessions with valid data; only then are the data unblinded "
                "and tested.",
            ],
            ["Friedman"],
        ),
        (
            [(STATEMENT, NUMBER), ("scale = \"seven\"\n", ""), ONLY_WATER, ("[analysis]\nparticipants = 9\n", "")],
            [
                "- No hypothesis is stated. The study describes the answers to the questions in block “Two” and block "
                "“Three”.",
                "- The protocol does not have an [analysis] table, so all results are exploratory.",
                "- Block “Three” presents water.",
            ],
            ["statement", "Alpha"],
        ),
        (
            [(STATEMENT, f"{STATEMENT}, {NUMBER.replace('heavy', 'mass', 1)}"), ONLY_WATER],
            ["- We describe the answers to the questions in block “Three” and to the questions other than statements "
             "in block “Two”, but do not test them."],
            ["except in the hypotheses"],
        ),
        (
            [(STATEMENT, NUMBER), ("scale = \"seven\"\n", ""), (FORM, HYPOTHESIS + FORM)],
            ["“Two” and block “Three”, but do not test them except in the hypotheses above.", "- Alpha is 0.05."],
            ["No hypothesis", "primary"],
        ),
    ],
)  # fmt: skip
def test_a_study_of_liquids_states_the_tests_and_orders_of_each_block(
    edits: list[tuple[str, str]], lines: list[str], missing: list[str]
) -> None:
    source = LIQUIDS
    for old, new in edits:
        assert source.count(old) == 1, old
        source = source.replace(old, new)
    text = preregistration(parse(source.encode(), "liquids.toml"), "0" * 64)
    assert [line for line in lines if line not in text] == []
    assert [words for words in missing if words in text] == []


@pytest.mark.parametrize(
    ("study", "block", "question", "sentence"),
    [
        (
            "every_design", "number", "what is the exponent of the power law for viscosity?",
            "mean across participants of their mean logarithmic answers, with a 95 % confidence interval (Student's "
            "t). The exponent is the slope of these logarithms on the logarithm of the level.",
        ),
        (
            "every_design", "rate", "how do ratings change with viscosity?",
            "mean across participants of their mean answers, with a 95 % confidence interval (Student's t).\n",
        ),
        (
            "matching", "matching", "which settings of damping at the hand match 6 N·s/m?",
            "for each participant and standard, we report the mean of the settings (the point of subjective equality)",
        ),
    ],
)  # fmt: skip
def test_the_analysis_of_a_block_of_levels_is_that_of_its_kind_of_answer(
    study: str, block: str, question: str, sentence: str
) -> None:
    text = preregistration(parse(text_of(study).encode(), "levels.toml"), "0" * 64)
    title = f"- Block “{block.capitalize()}”: "
    analysis = next(line for line in text.splitlines(keepends=True) if line.startswith(f"{title}for each"))
    assert f"{title}{question}\n" in text
    assert sentence in analysis


@pytest.mark.parametrize(
    ("contrasts", "available"),
    [
        ([{"groups": ("old", "young")}], "their value is available"),
        ([{"conditions": ("thin", "thick")}], "both of their values are available"),
        ([{"conditions": ("thin", "thick"), "groups": ("old", "young")}], "both of their values are available"),
        ([{"groups": ("old", "young")}, {"conditions": ("thin", "thick")}], "all of their compared values are"),
    ],
)
def test_participants_of_groups_contribute_one_value(contrasts: list[dict[str, Any]], available: str) -> None:
    stated = [Contrast.model_validate({"measure": "warm", "blocks": ("near",), **keys}) for keys in contrasts]
    assert f"Participants are included if {available}" in inclusion_text(stated)


def test_the_rules_of_staircases_are_stated() -> None:
    stairs = 'kind = "updown", tracks = 2, trials = 80, begin = [0.8, 0.2], stop = { reversals = 10, after = 20 }'
    levels = re.sub(
        r'kind = "constant"\n.*\n.*', stairs.replace(", ", "\n", 3).replace("], ", "]\n"), text_of("levels")
    )
    text = preregistration(parse(levels.encode(), "levels.toml"), "0" * 64)
    assert (
        "- Block “Viscosity”: levels are chosen in 2 interleaved tracks of at most 40 comparisons per standard, "
        "starting at 0.8 and 0.2, with steps up by a factor of 1.23 and down by a factor of 1.12, each ending after "
        "10 reversals and at least 20 answers."
    ) in text


CHOICES = """
format = 2
study.name = "choices"
liquids.water.density_kg_m3 = 998
liquids.slime.density_kg_m3 = 1200
tasks.stir = { kind = "explore", min_s = 2, max_s = 6, instruction = "Stir." }
[questionnaires.which]
intro = "Which one was it?"
[[questionnaires.which.items]]
id = "name"
kind = "choice"
text = "Which liquid was it?"
short = "Liquid"
options = [{ id = "water", text = "Water" }, { id = "slime", text = "Slime" }]
[blocks.identify]
conditions = ["water", "slime"]
questionnaire = "which"
order = "shuffled"
"""


def test_only_the_kinds_of_answers_in_the_study_are_summarised() -> None:
    text = preregistration(parse(CHOICES.encode(), "choices.toml"), "0" * 64)
    assert "but do not test them. We count how often each option is chosen." in text
    assert "Power was not computed" not in text
    sure = '[[questionnaires.which.items]]\nid = "sure"\nkind = "slider"\nlow = "No"\nhigh = "Yes"\n'
    sure += 'text = "Sure?"\nshort = "Sure"\n'
    contrast = (
        '[analysis]\ncontrasts = [{ measure = "sure", blocks = ["identify"], conditions = ["water", "slime"] }]\n'
    )
    tested = CHOICES.replace("[blocks.identify]", f"{sure}[blocks.identify]") + contrast
    text = preregistration(parse(tested.encode(), "choices.toml"), "0" * 64)
    assert "We report the mean of each rating and number across participants with its 95 % confidence interval" in text
    assert "mean score" not in text
    assert "`liquid-study power choices --to DIR` computes it" in text


def test_a_preference_is_not_called_discrimination() -> None:
    chosen = DISCRIMINATION.replace('design = "abx"', 'design = "2ifc"')
    text = preregistration(parse(chosen.encode(), "discrimination.toml"), "0" * 64)
    assert "- Block “Late”: how often is late_slime chosen rather than late_water (d′, which is negative if" in text
    assert "be discriminated from" not in text

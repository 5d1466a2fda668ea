"""A study whose only outcomes are forms after its blocks: its design, motion, hypotheses and groups in the report."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.figures.summary_figures import numbers_of
from study_app.analysis.report import sections
from study_app.analysis.report.first_page import cards, presented_in
from study_app.analysis.report.methods import methods
from study_app.analysis.report.motion_section import motion_section
from study_app.analysis.report.write_report import motion_csv, report
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.exclusions import exclude
from study_app.store.unblinding import unblind
from tests.golden_values import page_lines
from tests.studies import made_up

pytestmark = pytest.mark.slow

PEOPLE = 7
FILE = """
format = 2
study = { name = "late", block_order = "balanced", group_assignment = "pre-existing" }
sequence = ["about", "d0", "load", "d1", "load", "d2", "load"]
liquids.damper.drag = { law = "linear", damping_nspm = 8 }
conditions.c0.liquid = "damper"
conditions.c60 = { liquid = "damper", delay_ms = 60 }
conditions.c140 = { liquid = "damper", delay_ms = 140 }
groups = { old = {}, new = {} }

[tasks.reach]
kind = "reach"
targets_mm = [[-30, 0, 0], [30, 0, 0]]
radius_mm = 6
dwell_s = 0.2
count = 9
instruction = "Move."

[questionnaires.about]
title = "About"
intro = "About you"
items = [
  { id = "age", kind = "number", from = 18, to = 99, unit = "years", text = "How old are you?", short = "Age" },
  { id = "hand", kind = "choice", text = "Which hand?", short = "Hand", options = [
    { id = "left", text = "Left" }, { id = "right", text = "Right" },
  ] },
]

[questionnaires.load]
intro = "How was it?"
items = [{ id = "hard", kind = "slider", text = "How hard was it?", short = "Effort", low = "easy", high = "hard" }]

[blocks.d0]
title = "Prompt"
conditions = ["c0"]
repetitions = 2
[blocks.d1]
title = "Late"
conditions = ["c60"]
repetitions = 2
[blocks.d2]
title = "Very late"
conditions = ["c140"]
repetitions = 2

[analysis]
contrasts = [{ measure = "hard", form = "load", blocks = ["d2", "d0"], expected = "higher" }]
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    place = tmp_path_factory.mktemp("late")
    file = place / "late.toml"
    file.write_text(FILE, encoding="utf-8", newline="\n")
    folder = rehearse_answers(file, participants=PEOPLE, seed=8, results=place / "results", features=made_up(file))
    exclude(folder, "P003", 1, by="AK", reason="asleep")
    unblind(folder, "AB", "to analyse")
    return load_study(folder)


def test_methods_describe_blocks_without_statements(study: Study) -> None:
    text = methods(study, evaluate(study))
    for sentence in (
        "Seven participants (SIMULATED, not people) took part in “late”",
        ". 1 participant was excluded, so six participants were analysed, each in all conditions.",
        "The simulated liquid was damper (damping 8 N·s/m",
        "“Prompt”, “Late” and “Very late” each presented one condition twice (damper with a visual delay of 0, 60 and "
        "140 ms, respectively).",
        "In each trial, participants were asked to reach for 2 targets with a radius of 6 mm in turn, staying 0.2 s in "
        "each, until 9 are reached (at most ",
        "Conditions were identified only by codes until the key was opened.",
        "The blocks were presented in an order counterbalanced across participants (Williams design).",
        "is higher in “Very late” than in Prompt) was tested with a one-sided paired t test.",
        "Each participant contributed one value to each comparison. In addition",
    ):
        assert sentence in text
    assert "excluded session" not in text


def test_motion_and_delays_are_shown_for_blocks_without_statements(study: Study) -> None:
    durations = pd.array([1.25 + place for place in range(len(study.trials))], dtype="Float64")
    results = evaluate(replace(study, trials=study.trials.assign(duration_s=durations)))
    lines = list(page_lines("".join(motion_section(results))))
    rows = [line.split(" (")[0] for line in lines if line.startswith("Damper, ")]
    trials = study.trials.assign(duration_s=durations)[study.trials["counted"]]
    medians = trials.groupby(["block", "participant"])["duration_s"].median().groupby("block").median()
    assert rows == [f"Damper, {ms} ms | 6 | {medians[block]:.3g}" for block, ms in (("d0", 0), ("d1", 60), ("d2", 140))]
    assert '"Damper, 140 ms",duration_s,6,' in motion_csv(results).decode()
    conduct = " ".join(page_lines("".join(sections.conduct(study, results))))
    assert "Were the delays presented as specified?" in conduct
    assert "Late | Damper, 60 ms | 60 ms" in conduct
    assert "Block orders Six orders: " in conduct
    assert "each block occurred" in conduct


def test_a_study_without_questions_has_a_report_of_its_trials(tmp_path: Path) -> None:
    file = tmp_path / "reach.toml"
    text = FILE.replace('sequence = ["about", "d0", "load", "d1", "load", "d2", "load"]', "")
    head, tail = text.split("[questionnaires.about]")
    blocks = tail[tail.index("[blocks.d0]") : tail.index("[analysis]")]
    file.write_text(f"{head}{blocks}", encoding="utf-8", newline="\n")
    folder = rehearse_answers(file, participants=3, seed=5, results=tmp_path / "results", features=made_up(file))
    unblind(folder, "AB", "to analyse")
    page = report(folder, tmp_path / "report", failed=pytest.fail)[0].read_text(encoding="utf-8")
    assert "The study does not ask questions; the sections below show how participants moved." in page
    assert "Were the delays presented as specified?" in page
    assert "“Prompt”, “Late” and “Very late” each presented one condition twice" in page
    assert len((tmp_path / "report" / "motion.csv").read_text(encoding="utf-8").splitlines()) > 3


def test_hypotheses_name_blocks_by_their_titles(study: Study) -> None:
    results = evaluate(study)
    assert results.contrasts[0].compared == ("Very late", "Prompt")
    assert cards(results, numbers_of(study), presented_in(study))[0].question.endswith(
        "is higher in “Very late” (140 ms of visual delay) than in Prompt (no visual delay)"
    )


def test_background_is_shown_for_each_group_with_its_units(study: Study) -> None:
    members = study.participants.set_index("participant")["group"]
    ages = study.answered[study.answered["item"].eq("age") & study.answered["counted"]]
    ages = ages.assign(value=ages["value"].astype(float), group=ages["participant"].map(members))
    mean, sd, n = ages.groupby("group")["value"].agg(["mean", "std", "size"]).loc["old"]
    lines = list(page_lines("".join(sections.groups(study, evaluate(study)))))
    assert "Question | new | old" in lines
    (age_line,) = (line for line in lines if line.startswith("Age (years) | "))
    assert age_line.endswith(f"| {mean:.1f} ± {sd:.{1 if sd >= 10 else 2}f} (n = {n:.0f})")
    assert len([line for line in lines if line.startswith("Hand: ")]) == 2
    results = evaluate(study)
    (about,) = (card for card in cards(results, numbers_of(study)) if card.question == "About")
    assert f"The mean of “Age” was {ages['value'].mean():.1f} years (SD " in about.sentences[0]

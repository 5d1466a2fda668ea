"""The report of few participants, missing answers and odd input: honest, or one clear error."""

import json
import shutil
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from study_app.analysis.data.study_tables import group_counts, group_means, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.report.methods import methods
from study_app.analysis.report.sections import limits
from study_app.analysis.report.write_report import report
from study_app.errors import AnalysisError
from study_app.protocol.load import parse
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.simulated import NO_FEATURES
from study_app.protocol.source.files import source_bytes
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store import receipt
from study_app.store.exclusions import exclude, include
from study_app.store.unblinding import unblind
from study_app.store.verification import Discrepancy
from study_app.store.verification.whole_study import verify_study
from tests.analysis.conftest import SAMPLE, Results, make_results, twelve
from tests.protocol.groups.grouped import GROUPS, STUDY

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("png_figures_only")]


def test_methods_distinguish_primary_and_exploratory_statements(tmp_path: Path) -> None:
    text = (
        source_bytes("rek2024").decode().replace("\n[analysis]\n", '\n[analysis]\nprimary = ["immersive", "harder"]\n')
    )
    results = twelve(make_results(tmp_path / "some", parse(text.encode(), "rek2024.toml")), people=5)
    results.open()
    study = load_study(results.folder)
    methods_lines = methods(study, evaluate(study))
    both = (
        "Holm method across 1 primary statement and by the Benjamini-Hochberg method across {} exploratory statements"
    )
    assert both.format("eight") in methods_lines
    assert both.format("four") in methods_lines
    assert "and 90 % confidence intervals" in methods_lines, "two one-sided tests at 5 %"


@pytest.mark.parametrize(
    ("names", "start"),
    [
        (("a.csv",), "1 file is missing or has "),
        (("a.csv", "b.csv", "a.csv", "c.json"), "Three files are missing or have "),
    ],
)
def test_limits_count_the_files_that_have_changed(names: tuple[str, ...], start: str) -> None:
    study = load_study(SAMPLE.path)
    results = evaluate(study)
    assert not [line for line in limits(study, results) if "since recording" in line]
    doubts = tuple(Discrepancy(study.folder / name, "differs from its journal", "") for name in names)
    changed_file_limits = [line for line in limits(replace(study, doubts=doubts), results) if "since recording" in line]
    assert changed_file_limits == [
        f"{start}changed since recording, so numbers may be wrong. The command liquid-study verify RESULTS checks all "
        "files."
    ]


def test_a_changed_file_of_one_version_and_an_exclusion_after_unblinding_are_stated(
    small: Results, tmp_path: Path
) -> None:
    for number, who in enumerate("ABC"):
        place = small.add(who, lambda *_: 4).receipt
        receipt.write(place, {**receipt.read(place), "protocol_hash": f"{number // 2}" * 64})
    trial_numbers = [trial.number for trial in build_schedule(small.protocol, "A", seed=1).trials if trial.code == "L1"]
    for trial in trial_numbers:
        small.exclude("A", trial=trial)
    exclude(small.folder, "C", 1, by="AB", reason="late")
    small.open()
    later = datetime.now().astimezone() + timedelta(seconds=2)
    exclude(small.folder, "B", 1, by="AB", reason="the phone rang", now=later)
    include(small.folder, "C", 1, by="AB", reason="it was complete", now=later)
    report(small.folder, tmp_path / "report")
    methods_text = " ".join((tmp_path / "report" / "methods.txt").read_text("utf-8").split())
    assert (
        "from 2 different files). 1 participant was excluded, so two participants were analysed; at least one "
        "condition is missing for 1 participant, because individual trials were excluded." in methods_text
    )
    assert "For the other participants, the analysis does not include two excluded trials." in methods_text
    assert (
        f"Some decisions about exclusions were made after the key was opened: 1 of {len(trial_numbers) + 1} exclusions "
        "and the reversal of 1 exclusion."
    ) in methods_text
    rows = json.loads((tmp_path / "report" / "report.json").read_text("utf-8"))["exclusions"]
    assert [row["participant"] for row in rows if row["after_unblinding"]] == ["B"]


def test_another_study_mixed_in_or_an_empty_folder_is_one_clear_error(
    rek: Results, small: Results, tmp_path: Path
) -> None:
    twelve(rek, people=2)
    foreign = small.add("P077", lambda _condition, _item: 4)
    shutil.copytree(foreign.path.parent, rek.folder / "data" / "sub-P077")
    for _ in ("sealed", "opened"):
        with pytest.raises(AnalysisError, match=r"belongs to the study 'small', .* keep each study in a separate"):
            report(rek.folder, tmp_path / "report")
        shutil.move(rek.folder / "data" / "sub-P077", tmp_path / "sub-P077")
        rek.open()
        shutil.move(tmp_path / "sub-P077", rek.folder / "data" / "sub-P077")
    (tmp_path / "empty").mkdir()
    with pytest.raises(AnalysisError, match="does not contain any sessions"):
        report(tmp_path / "empty", tmp_path / "report")
    assert not (tmp_path / "report").exists()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a sealed study of six participants in two groups."""
    path = tmp_path_factory.mktemp("grouped")
    (path / "grouped.toml").write_text(STUDY + GROUPS, encoding="utf-8", newline="\n")
    features = {(block, condition): (NO_FEATURES,) for block in ("thin", "thick") for condition in ("water", "honey")}
    return rehearse_answers(path / "grouped.toml", participants=6, seed=2, results=path / "r", features=features)


def test_groups_are_reported_only_after_unblinding(folder: Path, tmp_path: Path) -> None:
    sealed = load_study(folder)
    assert group_counts(sealed) == {}
    assert list(group_means(sealed)) == []
    report(folder, tmp_path / "sealed")
    assert "<td>first_thin" not in (tmp_path / "sealed" / "report.html").read_text("utf-8")
    words = "randomised in permuted blocks to the groups first_thin and first_thick, with an allocation ratio of 1:1."
    assert words in (tmp_path / "sealed" / "methods.txt").read_text("utf-8")
    unblind(folder, "AB", "a test")
    study = load_study(folder)
    assert group_counts(study) == {"first_thick": 3, "first_thin": 3}
    rows = study.responses.merge(study.trials[["participant", "group"]].drop_duplicates(), on="participant")
    for mean in group_means(study):
        here = rows[(rows["block"] == mean.block) & (rows["code"] == mean.code) & (rows["group"] == mean.group)]
        each = here.groupby("participant")["response"].mean()
        assert (mean.n, mean.mean) == (len(each), pytest.approx(each.mean()))
        assert mean.sd == pytest.approx(each.std())
    assert len(list(group_means(study))) == 2 * 2 * 2
    report(folder, tmp_path / "opened")
    text = (tmp_path / "opened" / "report.html").read_text("utf-8")
    assert ">Groups</h2>" in text
    assert "first_thin" in text
    assert "Differences between groups are not tested.<" in text


COUNTED = """
format = 2
sequences = [["objects"], ["objects"]]
[study]
name = "counted"
title = { de = "Gezählt", en = "Counted" }
languages = ["de", "en"]
[liquids.soup]
density_kg_m3 = 1000
[liquids.stew]
density_kg_m3 = 1300
[tasks.explore]
kind = "explore"
min_s = 5
max_s = 20
instruction = { de = "Suche.", en = "Search." }
[questionnaires.count]
intro = { de = "Bitte zählen.", en = "Please count." }
[[questionnaires.count.items]]
id = "many"
kind = "number"
text = { de = "Wie viele?", en = "How many?" }
short = { de = "Anzahl", en = "Number" }
[blocks.objects]
title = { de = "Dinge", en = "Objects" }
conditions = ["soup", "stew"]
order = "shuffled"
repetitions = 3
questionnaire = "count"
[analysis]
participants = 4
[[analysis.contrasts]]
measure = "many"
blocks = ["objects"]
conditions = ["stew", "soup"]
"""


def test_a_study_without_statements_in_two_sessions_and_languages_is_described(tmp_path: Path) -> None:
    (tmp_path / "counted.toml").write_text(COUNTED, encoding="utf-8", newline="\n")
    features = {("objects", condition): (NO_FEATURES,) for condition in ("soup", "stew")}
    folder = rehearse_answers(
        tmp_path / "counted.toml", participants=4, seed=2, results=tmp_path / "r", features=features
    )
    report(folder, tmp_path / "sealed")
    text = " ".join((tmp_path / "sealed" / "methods.txt").read_text("utf-8").split())
    assert "Each participant attended two sessions. The participants' texts were in German (n = 4)." in text
    assert "presented in a random order for each participant, 3 times each in each session;" in text
    page = (tmp_path / "sealed" / "report.html").read_text("utf-8")
    assert "Languages of the participants&#39; texts: German (n = 4)." in page
    assert "Objects: questions<" in page
    assert "so there are no tests" not in page
    assert "Apart from any hypotheses, the answers to these questions are summarised but not tested." in page
    assert "Primary statements" not in page


def test_preexisting_groups_are_reported_before_unblinding_as_not_randomised(tmp_path: Path) -> None:
    head = 'study.name = "grouped"\nstudy.group_assignment = "pre-existing"\n'
    (tmp_path / "grouped.toml").write_text(
        (STUDY + GROUPS).replace('study.name = "grouped"\n', head), encoding="utf-8", newline="\n"
    )
    features = {(block, condition): (NO_FEATURES,) for block in ("thin", "thick") for condition in ("water", "honey")}
    study = rehearse_answers(
        tmp_path / "grouped.toml", participants=5, seed=2, results=tmp_path / "r", features=features
    )
    assert group_counts(load_study(study)) == {"first_thick": 2, "first_thin": 3}, "dealt in turn"
    report(study, tmp_path / "sealed")
    methods = (tmp_path / "sealed" / "methods.txt").read_text("utf-8")
    assert "to the groups first_thin (n = 3) and first_thick (n = 2) by an existing attribute" in methods
    assert "The analysis was not specified beforehand, so all results are exploratory (alpha = 0.05)." in methods
    page = (tmp_path / "sealed" / "report.html").read_text("utf-8")
    assert "Differences between groups are not tested. The groups were not randomised, so" in page
    assert "groups were not randomised" in methods
    assert "The groups were not randomised, so a difference may have other causes" in (
        tmp_path / "sealed" / "report.html"
    ).read_text("utf-8")
    unblind(study, "AB", "a test")
    assert group_counts(load_study(study)) == {"first_thick": 2, "first_thin": 3}
    trials = load_study(study).trials
    assert set(trials["group"]) == {"first_thick", "first_thin"}
    assert not verify_study(study).errors

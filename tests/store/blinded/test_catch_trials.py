"""Whoever answers too many catch trials incorrectly is excluded when the key is opened, and not before."""

import csv
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.exclusions import exclusions, include
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.journals.journal_events import TrialStarted
from study_app.store.unblinding import unblind
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.protocol.trials.level_studies import SHORT, text_of

pytestmark = [pytest.mark.nightly, pytest.mark.slow]

ADAPTIVE = ('kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 2', 'kind = "updown"\ntrials = 20')
CATCH = ("method =", "catch = { share = 0.5, wrong_most = 0.2 }\nmethod =")
UNNOTICED = ("levels = [0.1, 0.8]", "levels = [0.0001, 0.0002]")
PRACTISED = ('sequence = ["viscosity"]', 'sequence = ["easy", "hard", "viscosity"]')
PRACTICE = """
[stimuli.{name}]
condition = "oil"
vary = "viscosity_pa_s"
levels = {levels}

[blocks.{name}]
phase = "practice"
title = "Practice"
setting_label = "Pair"
task = "stir"
stimulus = "{name}"
design = "2ifc"
method = "brief"
"""
REASON = re.compile(r"(\d+) of (\d+) catch trials in (.+?) were answered incorrectly \(at most 20 % are permitted\)")
BRIEF = """
[methods.brief]
kind = "constant"
levels = 2
repetitions = 10
"""


def rehearsed(folder: Path, *edits: tuple[str, str], more: str = "") -> Path:
    (folder / "levels.toml").write_text(
        text_of(*SHORT, ADAPTIVE, CATCH, *edits, more=more), encoding="utf-8", newline="\n"
    )
    return rehearse(folder / "levels.toml", participants=2, seed=2, results=folder / "study", recordings=False)


@pytest.fixture(scope="module")
def inattentive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    easy, hard = PRACTICE.format(name="easy", levels=[1, 3]), PRACTICE.format(name="hard", levels=[0.0001, 0.0002])
    return rehearsed(tmp_path_factory.mktemp("inattentive"), UNNOTICED, PRACTISED, more=BRIEF + easy + hard)


@pytest.fixture
def study(inattentive: Path, tmp_path: Path) -> Path:
    shutil.copytree(inattentive, tmp_path / "study")
    return tmp_path / "study"


def test_inattentive_participants_are_excluded_only_after_unblinding(study: Path) -> None:
    assert exclusions(study) == ()
    result = CliRunner().invoke(commands, ["unblind", str(study), "--by", "AB", "--reason", "to analyse"])
    assert result.exit_code == 0
    rows = exclusions(study)
    assert {(row.participant, row.session, row.trial) for row in rows} == {("P001", 1, None), ("P002", 1, None)}
    assert {row.rule_or_person for row in rows} == {"catch"}
    counts = REASON.findall(rows[0].reason)
    assert sorted((block, of) for _, of, block in counts) == [("Practice (hard)", "10"), ("Viscosity", "20")]
    assert all(0.2 < int(wrong) / int(of) <= 1 for wrong, of, _ in counts)
    assert f"excluded  participant P001, session 1: {rows[0].reason}" in result.output
    verification = verify_study(study)
    assert [str(error) for error in verification.errors] == []


def test_a_repeated_unblinding_keeps_the_decisions_of_persons(study: Path) -> None:
    assert len(unblind(study, "AB", "to analyse").excluded) == 2
    assert unblind(study, "AB", "once more").excluded == ()
    include(study, "P001", 1, by="AB", reason="the task was understood late")
    assert unblind(study, "AB", "and again").excluded == ()
    assert [row.participant for row in exclusions(study)] == ["P002"]


def test_sessions_that_cannot_be_excluded_are_named(study: Path) -> None:
    exclusion_list = StudyFolder(study).exclusions
    exclusion_list.write_text("torn", encoding="utf-8", newline="\n")
    (warning,) = unblind(study, "AB", "to analyse").left
    assert warning.startswith("the rule “catch” was not applied (")
    assert exclusion_list.read_text("utf-8") == "torn"
    exclusion_list.unlink()
    assert len(unblind(study, "AB", "once more").excluded) == 2


def test_running_sessions_are_not_judged(study: Path) -> None:
    opening = lock_folder(StudyFolder(study).session("P001", 1).path)
    try:
        unblinding = unblind(study, "AB", "to analyse")
    finally:
        opening.release()
    assert [row.participant for row in unblinding.excluded] == ["P002"]
    assert [row.participant for row in unblind(study, "AB", "once more").excluded] == ["P001"]


def test_levels_of_a_study_with_catch_trials_follow_and_the_tables_name_them(study: Path) -> None:
    for session in StudyFolder(study).sessions():
        assert reproduce_session(session.path).followed[-1:] == [
            "viscosity: 60 of 60 levels are consistent with the answers"
        ]
        with next(session.path.rglob("*intervals*.csv")).open(encoding="utf-8") as file:
            assert "catch" not in next(csv.reader(file))
    unblind(study, "AB", "to analyse")
    session = StudyFolder(study).sessions()[0]
    with next(session.path.rglob("*intervals*.csv")).open(encoding="utf-8") as file:
        levels = [row["level"] for row in csv.DictReader(file) if (row["block"], row["catch"]) == ("viscosity", "true")]
    assert levels == ["0.0002"] * 2 * 20


def test_sessions_of_versions_without_catch_trials_are_reproduced_and_unblinded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fields_of(event: TrialStarted) -> dict[str, Any]:
        return {name: value for name, value in fields(event).items() if name != "catch"}

    fields = TrialStarted.fields
    monkeypatch.setattr(TrialStarted, "fields", fields_of)
    (tmp_path / "levels.toml").write_text(text_of(*SHORT), encoding="utf-8", newline="\n")
    study = rehearse(tmp_path / "levels.toml", participants=1, seed=2, results=tmp_path / "study", recordings=False)
    (session,) = StudyFolder(study).sessions()
    assert reproduce_session(session.path).followed == ["viscosity: 12 of 12 levels are consistent with the answers"]
    assert unblind(study, "AB", "to analyse").left == ()
    (path,) = session.path.rglob("*intervals*.csv")
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row.pop("catch") for row in rows} == {"n/a"}
    assert verify_study(study).errors == ()

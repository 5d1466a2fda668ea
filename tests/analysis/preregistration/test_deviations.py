"""Where a study left its preregistration."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.planning.preregistration import (
    CATCH,
    FILE,
    Commitment,
    Deviations,
    commitment_lines,
    deviations,
    deviations_section,
)
from study_app.analysis.report.write_report import report, report_files
from study_app.errors import AnalysisError
from study_app.store.exclusions import Exclusion, exclusion_bytes, exclusions
from study_app.store.files.folders import StudyFolder
from tests.analysis.conftest import Results

HASH = "ab" * 32


def receipts(results: Results, **changes: object) -> None:
    """Change the receipts of all sessions."""
    for session in StudyFolder(results.folder).sessions():
        content = json.loads(session.receipt.read_text(encoding="utf-8"))
        session.receipt.write_text(json.dumps(content | changes), encoding="utf-8", newline="\n")


@pytest.fixture
def answered_study(small: Results) -> Results:
    for person in ("P001", "P002", "P003"):
        small.add(person, lambda condition, item: 5)
    receipts(small, protocol_hash=HASH)
    return small


def save_preregistration(results: Results, participants: int | None = 3, **changes: object) -> Path:
    commitment = Commitment(
        study="small", version="2", protocol_hash=HASH, participants=participants, precision=None, rules=(CATCH,)
    )
    path = results.folder / FILE
    path.write_text(f"# Preregistration\n\n{commitment_lines(commitment)}", encoding="utf-8", newline="\n")
    return path


def evaluate_block(results: Results) -> tuple[str, ...]:
    study_deviations = deviations(load_study(results.folder))
    assert study_deviations is not None
    return study_deviations.found


def test_a_study_that_follows_its_preregistration_has_no_deviations(answered_study: Results) -> None:
    save_preregistration(answered_study)
    assert evaluate_block(answered_study) == ()
    text = " ".join(map(str, deviations_section(load_study(answered_study.folder))))
    assert "match the preregistration" in text
    assert HASH in text


@pytest.mark.slow
def test_fewer_participants_and_another_number_than_the_protocols_are_deviations(answered_study: Results) -> None:
    save_preregistration(answered_study, 12)
    assert evaluate_block(answered_study) == ("there are fewer participants than planned (3 instead of 12)",)
    save_preregistration(answered_study, 2)
    assert evaluate_block(answered_study) == ("there are more participants than planned (3 instead of 2)",)
    save_preregistration(answered_study, None)
    assert evaluate_block(answered_study) == ()


def test_sessions_under_another_protocol_are_named(answered_study: Results) -> None:
    save_preregistration(answered_study)
    (first, *_) = StudyFolder(answered_study.folder).sessions()
    content = json.loads(first.receipt.read_text(encoding="utf-8"))
    first.receipt.write_text(json.dumps(content | {"protocol_hash": "cd" * 32}), encoding="utf-8", newline="\n")
    (line,) = evaluate_block(answered_study)
    assert line.startswith("1 session used a protocol (version 2) that differs from the preregistered protocol")
    assert line.endswith("P001/1")


@pytest.mark.slow
def test_exclusions_by_other_rules_are_listed_and_those_by_its_own_are_not(answered_study: Results) -> None:
    save_preregistration(answered_study)
    answered_study.exclude("P001", trial=2, reason="sneezed")
    (line,) = evaluate_block(answered_study)
    assert line.startswith("there is an exclusion without a preregistered rule (")
    assert line.endswith("; sneezed; AB)")
    by_rule = Exclusion(
        participant="P002",
        session=1,
        trial=None,
        rule_or_person=CATCH,
        reason="4 of 8 wrong",
        excluded_at="2026-01-06T10:00:00.000+01:00",
    )
    all_exclusions = (*exclusions(answered_study.folder), by_rule)
    StudyFolder(answered_study.folder).exclusions.write_bytes(exclusion_bytes(all_exclusions))
    lines = evaluate_block(answered_study)
    assert lines[0] == "there are fewer participants than planned (2 instead of 3)"
    assert len(lines) == 2
    assert "sneezed" in lines[1]


def test_where_only_the_protocol_plans_participants_they_are_compared(answered_study: Results) -> None:
    (first, *_) = StudyFolder(answered_study.folder).sessions()
    protocol = json.loads(first.receipt.read_text(encoding="utf-8"))["protocol"]
    analysis = {
        "alpha": 0.05, "equivalence_bound": None, "primary": [], "names": [], "rising": [], "falling": [],
        "noticed": None, "participants": 20,
    }  # fmt: skip
    receipts(answered_study, protocol=protocol | {"analysis": analysis})
    assert deviations(load_study(answered_study.folder)) == Deviations(
        None, ("there are fewer participants than planned (3 instead of 20)",)
    )


def test_the_preregistration_of_a_rehearsal_is_in_the_folder_of_its_study(
    answered_study: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    rehearsal = answered_study.folder.rename(answered_study.folder.with_name("small-rehearsal-1"))
    (study := answered_study.folder.with_name("small")).mkdir()
    save_preregistration(replace(answered_study, folder=study), participants=7)
    compared = deviations(load_study(rehearsal))
    assert compared is not None
    assert compared.commitment is not None
    assert compared.found == ("there are fewer participants than planned (3 instead of 7)",)
    monkeypatch.chdir(rehearsal)
    assert deviations(load_study(Path())) == compared
    files, _ = report_files(load_study(Path()))
    assert json.loads(files["report.json"])["preregistration"]["found"] == list(compared.found)


def test_the_report_of_people_says_where_a_preregistration_is_missing(answered_study: Results) -> None:
    (first, *_) = StudyFolder(answered_study.folder).sessions()
    protocol = json.loads(first.receipt.read_text(encoding="utf-8"))["protocol"]
    analysis = {"alpha": 0.05, "equivalence_bound": None, "primary": [], "names": [], "rising": [], "falling": []}
    receipts(answered_study, protocol=protocol | {"analysis": analysis | {"noticed": None, "participants": 3}})
    study_of_answers = load_study(answered_study.folder)
    for simulated in (True, False):
        study = replace(study_of_answers, participants=study_of_answers.participants.assign(simulated=simulated))
        text = " ".join(map(str, deviations_section(study)))
        assert ("does not contain preregistration.md" in text) != simulated
        assert "Only the number of participants is compared" in text


@pytest.mark.parametrize("content", ["# nothing\n", "```json\n{}\n```\n", "```json\n{broken}\n```\n"])
def test_a_damaged_preregistration_is_one_line(answered_study: Results, content: str) -> None:
    (answered_study.folder / FILE).write_text(content, encoding="utf-8", newline="\n")
    with pytest.raises(AnalysisError, match="does not end with the block that `liquid-study preregister` writes"):
        deviations(load_study(answered_study.folder))


@pytest.mark.slow
@pytest.mark.usefixtures("png_figures_only")
def test_the_report_lists_deviations_and_hashes_the_file(answered_study: Results, tmp_path: Path) -> None:
    save_preregistration(answered_study, 12)
    written_to = tmp_path / "report"
    report(answered_study.folder, written_to)
    page = (written_to / "report.html").read_text(encoding="utf-8")
    assert "there are fewer participants than planned (3 instead of 12)" in page
    content = json.loads((written_to / "report.json").read_text(encoding="utf-8"))
    assert content["preregistration"]["found"] == ["there are fewer participants than planned (3 instead of 12)"]
    assert content["preregistration"]["commitment"]["protocol_hash"] == HASH
    assert FILE in content["files"]
    (answered_study.folder / FILE).unlink()
    report(answered_study.folder, written_to)
    content = json.loads((written_to / "report.json").read_text(encoding="utf-8"))
    assert "preregistration" not in content
    assert "Preregistration" not in (written_to / "report.html").read_text(encoding="utf-8")

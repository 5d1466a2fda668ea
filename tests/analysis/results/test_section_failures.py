"""A part of the report that fails is said in its place, in the JSON and in the exit code; the rest is written."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.findings.statement_tests import OverAll
from study_app.analysis.report.write_report import as_json_types
from study_app.cli import commands
from study_app.protocol.load import load
from tests.analysis.conftest import Results, make_results, twelve

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

TESTS = {
    "findings.statement_tests.friedman": ("liquids", "test of differences between conditions"),
    "findings.statement_tests.global_permutation": ("liquids", "test over all statements"),
    "findings.recognition.recognition": ("liquids", "recognition test"),
    "findings.statement_tests.slope_tests": ("liquids", "test of means"),
    "findings.statement_tests.trend": ("delays", "trend test"),
    "findings.delays.step_down": ("delays", "shortest delay with a trend"),
    "findings.delays.tost": ("delays", "equivalence test"),
    "findings.delays.detection_threshold": ("delays", "detection threshold"),
}
WRITING = {
    "figures.answer_figures.answers_picture": "figure liquids",
    "report.write_report.methods": "texts: methods",
    "report.write_report.sections.level_sentences": "texts: findings",
    "report.write_report.r_script": "report.R",
    "report.write_report.motion_csv": "motion.csv",
    "findings.delays.LowestDelay.section": "shortest delay with a trend",
    "report.write_report.sections.conduct": "section “How the study was run”",
}


def fail(*_args: object, **_named: object) -> None:
    raise ValueError("f(a) and f(b) must have different signs")


@pytest.fixture(scope="module")
def opened_study(tmp_path_factory: pytest.TempPathFactory) -> Results:
    results = twelve(make_results(tmp_path_factory.mktemp("failures") / "rek2024", load("rek2024")), people=10)
    results.open()
    return results


@pytest.mark.nightly
def test_a_failing_test_does_not_affect_the_others(opened_study: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(opened_study.folder)
    whole = evaluate(study)
    assert whole.failures == ()
    for broken, (block, what) in TESTS.items():
        with monkeypatch.context() as patch:
            patch.setattr(f"study_app.analysis.{broken}", fail)
            results = evaluate(study)
        failures = [failure for failure in results.failures if failure.block == block]
        assert [failure.what for failure in failures] == [what], broken
        block_result = next(block_results for block_results in results.blocks if block_results.id == block)
        (absent,) = (absence for absence in block_result.absent if absence.what == what)
        assert "ValueError: f(a) and f(b) must have different signs" in absent.why
        json.dumps(as_json_types(results), allow_nan=False)
        assert OverAll.value_in(block_result) is not None or "over all" in what
        assert results.performance is not None


def test_a_report_with_failures_is_written_and_ends_with_three(
    opened_study: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for broken in (*WRITING, "findings.delays.detection_threshold"):
        monkeypatch.setattr(f"study_app.analysis.{broken}", fail)
    to = tmp_path / "report"
    result = CliRunner().invoke(commands, ["report", str(opened_study.folder), "--to", str(to)])
    assert result.exit_code == 3, result.output
    content = json.loads((to / "report.json").read_bytes())
    failed = {failure["what"] for failure in content["failures"]}
    assert {*WRITING.values(), "detection threshold"} <= failed
    assert content["results"]["blocks"][1]["trends"]
    page = (to / "report.html").read_text(encoding="utf-8")
    for failure in content["failures"]:
        assert failure["what"] in result.output
    for title in (
        "Do answers change with the delay?",
        "Shortest delay with a trend",
        "How the study was run",
        "Not available: the computation failed",
    ):
        assert title in page
    names = {path.name for path in to.iterdir()}
    assert {"tests.csv", "recognition.png", "codebook.json", "methods.txt"} <= names
    assert not {"report.R", "motion.csv", "liquids.png"} & names

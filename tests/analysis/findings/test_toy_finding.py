"""A finding is one file: a report of a rehearsed study holds one that no file of the package names."""

import csv
import io
import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from study_app.analysis import findings
from study_app.analysis.evaluate import evaluate
from study_app.analysis.findings import all_findings
from study_app.analysis.report.write_report import report
from study_app.analysis.study_worker import carry_out
from study_app.analysis.tables.study_tables import load_study
from study_app.analysis.worker_messages import FigureDrawn, ReadStudy
from study_app.store.blinded.unblinding import unblind

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

TOY = Path(__file__).parent / "toy"
KEY = "highest_answers"
SAMPLE = Path(__file__).parents[3] / "results" / "sample-rek2024"
"""Rehearsed, and shipped sealed."""


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The folder of findings with one more file."""
    monkeypatch.setattr(findings, "__path__", [*findings.__path__, str(TOY)])
    all_findings.cache_clear()
    yield
    all_findings.cache_clear()
    del sys.modules[f"{findings.__name__}.{KEY}"]
    vars(findings).pop(KEY)


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("toy") / "sample"
    shutil.copytree(SAMPLE, folder)
    unblind(folder, by="AB", reason="a test")
    return folder


@pytest.mark.nightly
@pytest.mark.usefixtures("toy")
def test_a_finding_that_is_one_file_stands_in_every_output(rehearsed: Path, tmp_path: Path) -> None:
    report(rehearsed, tmp_path, failed=pytest.fail)
    written = json.loads((tmp_path / "report.json").read_bytes())
    study = load_study(rehearsed)
    rows = list(csv.DictReader(io.StringIO((tmp_path / "tests.csv").read_text("utf-8"))))
    page = (tmp_path / "report.html").read_text("utf-8")
    for block, told in zip(study.blocks, written["results"]["blocks"], strict=True):
        answers = study.answers(block)
        sevens = answers[answers["response"] == 7]
        counts = {item.id: int((sevens["item"] == item.id).sum()) for item in block.items}
        assert {one["item"]: one["outcome"]["statistic"] for one in told[KEY]} == counts
        here = [row for row in rows if row["block"] == block.id and row["question"] == "the highest answer is given"]
        assert {row["item"]: float(row["statistic"]) for row in here} == counts
        assert {"what": "count of lowest answers", "why": "nobody asked for it"} in told["absent"]
        assert any(f"{block.title} " in line and "highest answers were given" in line for line in written["findings"])
        assert f"The highest answers of {block.title} were counted." in written["methods"]
    assert page.count("<h3>&lt;Highest&gt; answers, counted</h3>") == len(study.blocks)
    assert page.count("Which statement got most highest answers?") == len(study.blocks)
    assert page.count("&lt;Highest&gt; answers, as shares.") == 2 * len(study.blocks)  # caption and text of the picture
    assert "<Highest>" not in page
    assert (tmp_path / "highest.svg").read_text("utf-8").startswith("<?xml")
    assert '# highest answers of "liquids"' in (tmp_path / "report.R").read_text("utf-8")


@pytest.mark.nightly
@pytest.mark.usefixtures("toy")
def test_the_window_of_results_shows_its_figure(rehearsed: Path) -> None:
    told: list[object] = []
    carry_out(ReadStudy(rehearsed), told.append, lambda: False)
    (figure,) = {one.title for one in told if isinstance(one, FigureDrawn) and one.name.startswith("highest")}
    assert figure == "<Highest> answers"


def test_without_its_file_nobody_knows_it(rehearsed: Path) -> None:
    assert KEY not in {finding.key for finding in all_findings()}
    assert KEY not in evaluate(load_study(rehearsed), planning=False).blocks[0].findings

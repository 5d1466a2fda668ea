"""A report of twelve participants, opened."""

from pathlib import Path

import pytest

from study_app.analysis.report.write_report import report
from study_app.protocol.load import load
from tests.analysis.conftest import make_results, twelve
from tests.studies import once


@pytest.fixture(scope="session")
def of_twelve(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of twelve, opened."""

    def make(folder: Path) -> None:
        results = twelve(make_results(folder / "rek2024", load("rek2024")))
        results.open()
        assert report(results.folder, folder / "report", failed=pytest.fail)[0].name == "report.html"

    return once(tmp_path_factory, "twelve", make) / "report"

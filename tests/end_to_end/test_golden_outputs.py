"""Every cell of the report and of every exported table of some studies, compared with files that people review.

``python -m pytest tests/end_to_end/test_golden_outputs.py --regenerate`` writes the files anew: read the difference.
"""

from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

from study_app.analysis.export_study import export
from study_app.analysis.report.write_report import report
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.csv_files import unguard_formula
from study_app.store.unblinding import unblind_folder
from tests.analysis.levels.level_studies import levels_file
from tests.analysis.outputs import figures_as_lines, sav_lines
from tests.golden import CHANGING, compare
from tests.golden_values import file_lines
from tests.studies import made_up, once

pytestmark = pytest.mark.slow

pytest.importorskip("pyreadstat", reason="the extra analysis is not installed")

GOLDEN = Path(__file__).parent / "golden"
FILES = {"levels": levels_file}
PEOPLE = {"rek2024": 12, "levels": 3}
OUTPUTS = ("report.html", "report.json", "report.R", "codebook.json", "tests.csv", "methods.txt")
IN_SPSS = ("responses", "wide", "thresholds", "settings")


@pytest.fixture(scope="module", params=PEOPLE)
def outputs(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report and the export of a study."""
    name: str = request.param

    def make(folder: Path) -> None:
        protocol = name if name not in FILES else str(FILES[name](folder))
        results = folder / "results"
        rehearse_answers(protocol, participants=PEOPLE[name], seed=7, results=results, features=made_up(protocol))
        unblind_folder(results, by="AB", reason="golden")
        with figures_as_lines():
            report(results, folder / "outputs", failed=pytest.fail)
        export(results, folder / "outputs", extras=["wide", "parquet", "sav"])

    return once(tmp_path_factory, f"golden-{name}", make)


def test_every_cell(outputs: Path, pytestconfig: pytest.Config) -> None:
    study = outputs.name.removeprefix("once-golden-")
    tables = [path.name.split("_")[1].removeprefix("description-") for path in outputs.glob("outputs/*_data.csv")]
    names = {*OUTPUTS, *(f"{name}.csv" for name in tables), *(f"{name}.sav" for name in tables if name in IN_SPSS)}
    for name in sorted(names):
        found = list(lines(outputs / "outputs", name)) or ["(no rows)"]
        compare(GOLDEN / study / f"{name}.txt", found, pytestconfig, mask=CHANGING)
    assert {path.name.removesuffix(".txt") for path in (GOLDEN / study).iterdir()} == names


def test_parquet_has_the_cells_of_the_csv_file(outputs: Path) -> None:
    for written in (outputs / "outputs").glob("*_data.csv"):
        cells = pd.read_csv(written, dtype=str, keep_default_na=False)
        frame = pd.read_parquet(written.with_suffix(".parquet"))
        assert list(frame) == list(cells)
        for column in frame:
            for cell, value in zip(cells[column], frame[column], strict=True):
                if isinstance(value, str):
                    assert unguard_formula(cell) == value
                elif pd.isna(value):
                    assert cell == "n/a"
                else:
                    assert float({"true": "1", "false": "0"}.get(cell, cell)) == value


def lines(folder: Path, name: str) -> Iterator[str]:
    """Yield the cells, labels and texts of an output."""
    stem, kind = name.split(".")
    (path,) = folder.glob(f"*_description-{stem}_data.{kind}") if not (folder / name).exists() else [folder / name]
    yield from sav_lines(path) if kind == "sav" else file_lines(path.name, path.read_bytes())

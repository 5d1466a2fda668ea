"""The words of each kind of file that a study's report and export write, compared with files that people review.

``python -m pytest tests/end_to_end/test_golden_outputs.py --regenerate`` writes the files anew: read the difference.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

from study_app.analysis.export_study import export
from study_app.analysis.report.write_report import report
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.files.csv_files import unguard_formula
from study_app.store.unblinding import unblind_folder
from tests.analysis.levels.level_studies import levels_file
from tests.analysis.outputs import figures_as_lines, sav_labels
from tests.golden import compare, each_once
from tests.golden_values import file_lines
from tests.studies import made_up, once

pytestmark = pytest.mark.slow

pytest.importorskip("pyreadstat", reason="the extra analysis is not installed")

GOLDEN = Path(__file__).parent / "golden"
FILES = {"levels": levels_file}
PEOPLE = {"rek2024": 12, "levels": 3}
OUTPUTS = ("report.html", "report.json", "codebook.json", "methods.txt", "responses.sav")


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


def test_the_words_of_each_kind_of_file(outputs: Path, pytestconfig: pytest.Config) -> None:
    study = outputs.name.removeprefix("once-golden-")
    for name in sorted(OUTPUTS):
        compare(GOLDEN / study / f"{name}.txt", each_once(lines(outputs / "outputs", name)), pytestconfig)
    tables = list[str]()
    for path in sorted(outputs.glob("outputs/*_data.csv")):
        frame = pd.read_csv(path, dtype=str, keep_default_na=False)
        assert frame.columns.is_unique
        tables.append(f"{path.name.split('_')[1].removeprefix('description-')}: {', '.join(frame)}")
    compare(GOLDEN / study / "tables.txt", tables, pytestconfig)
    assert {path.name for path in (GOLDEN / study).iterdir()} == {f"{name}.txt" for name in (*OUTPUTS, "tables")}


def test_aggregates_are_those_of_the_responses(outputs: Path) -> None:
    responses, aggregates = (
        pd.concat([pd.read_csv(path) for path in (outputs / "outputs").glob(f"*_description-{name}_data.csv")])
        for name in ("responses", "aggregate")
    )
    for row in aggregates.to_dict("records"):
        same = (responses["code"] == row["code"]) & (responses["item"] == row["item"])
        values = responses[same & (responses["block"] == row["block"]) & responses["counted"]]["response"].dropna()
        assert row["n"] == len(values)
        assert [row[f"count_{answer}"] for answer in range(1, 8)] == [
            (values == answer).sum() for answer in range(1, 8)
        ]
        quartiles = values.quantile([0.25, 0.5, 0.75]).tolist()
        assert [row["q1"], row["median"], row["q3"]] == pytest.approx(quartiles)
        assert row["agree_percent"] == pytest.approx(100 * (values > 4).mean())
    assert (len(aggregates) > 0) == outputs.name.endswith("rek2024")


def test_parquet_has_the_cells_of_the_csv_file(outputs: Path) -> None:
    for csv_file in (outputs / "outputs").glob("*_data.csv"):
        cells = pd.read_csv(csv_file, dtype=str, keep_default_na=False)
        frame = pd.read_parquet(csv_file.with_suffix(".parquet"))
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
    """Yield the words of an output: of a report in JSON the names of its values, of a file of SPSS the labels."""
    stem, kind = name.split(".")
    (path,) = folder.glob(f"*_description-{stem}_data.{kind}") if not (folder / name).exists() else [folder / name]
    if kind == "sav":
        yield from sav_labels(path)
    elif kind == "json" and stem == "report":
        yield from names_in(json.loads(path.read_bytes()))
    else:
        yield from file_lines(path.name, path.read_bytes())


def names_in(value: object, place: str = "") -> Iterator[str]:
    """Yield the place of each value of a content of JSON."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from names_in(inner, f"{place}.{name}" if place else name)
    elif isinstance(value, list):
        for inner in value:
            yield from names_in(inner, f"{place}[]")
    else:
        yield place

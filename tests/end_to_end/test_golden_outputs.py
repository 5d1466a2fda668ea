"""Every cell of the report and of every exported table of some studies, compared with files that people review.

``python -m pytest tests/end_to_end/test_golden_outputs.py --regenerate`` writes the files anew: read the difference.
"""

import html
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from study_app.analysis.export.export import export
from study_app.analysis.report.write_report import report
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.sites.unblind_sites import unblind_folder
from study_app.store.tables.formulas import unguarded
from tests.analysis.levels.level_studies import levels_file, matching_file
from tests.golden_text import alike
from tests.protocol.forms.mixed import mixed_file
from tests.studies import made_up, once, quick_pdfs

pytestmark = pytest.mark.slow

pyreadstat = pytest.importorskip("pyreadstat", reason="the extra spss is not installed")

GOLDEN = Path(__file__).parent / "golden"
FILES = {"mixed": mixed_file, "levels": levels_file, "matching": matching_file}
PEOPLE = {"mixed": 3, "rek2024": 12, "viscosityjnd": 2, "levels": 3, "matching": 3}
OUTPUTS = ("report.html", "report.json", "report.R", "codebook.json", "tests.csv", "methods.txt")
IN_SPSS = ("responses", "wide", "thresholds", "settings")
CHANGING = re.compile(
    r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:\d\d)?)?"
    r"|\b\d+\.\d+\.\d+\b|\b(?<!\.)[0-9a-f]{12,}\b"
)
"""Dates, versions and hashes."""


@pytest.fixture(scope="module", params=PEOPLE)
def outputs(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report and the export of a study."""
    name: str = request.param

    def make(folder: Path) -> None:
        protocol = name if name not in FILES else str(FILES[name](folder))
        results = folder / "results"
        rehearse_answers(protocol, participants=PEOPLE[name], seed=7, results=results, felt=made_up(protocol))
        unblind_folder(results, by="AB", reason="golden")
        with quick_pdfs():
            report(results, folder / "outputs", failed=pytest.fail)
        export(results, folder / "outputs", extras=["wide", "parquet", "sav"])

    return once(tmp_path_factory, f"golden-{name}", make)


def test_every_cell(outputs: Path, pytestconfig: pytest.Config) -> None:
    study = outputs.name.removeprefix("once-golden-")
    tables = [path.name.split("_")[1].removeprefix("description-") for path in outputs.glob("outputs/*_data.csv")]
    names = {*OUTPUTS, *(f"{name}.csv" for name in tables), *(f"{name}.sav" for name in tables if name in IN_SPSS)}
    for name in sorted(names):
        found = [CHANGING.sub("*", line) for line in lines(outputs / "outputs", name)]
        kept = GOLDEN / study / f"{name}.txt"
        if pytestconfig.getoption("regenerate"):
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_text("\n".join(found) + "\n", encoding="utf-8")
        expected = kept.read_text(encoding="utf-8").splitlines()
        different = [(a, b) for a, b in zip(expected, found, strict=False) if not alike(a, b)]
        assert (different[:5], len(found)) == ([], len(expected)), f"{kept}: review, then --regenerate"
    assert {path.name.removesuffix(".txt") for path in (GOLDEN / study).iterdir()} == names


def test_parquet_has_the_cells_of_the_csv_file(outputs: Path) -> None:
    for written in (outputs / "outputs").glob("*_data.csv"):
        cells = pd.read_csv(written, dtype=str, keep_default_na=False)
        frame = pd.read_parquet(written.with_suffix(".parquet"))
        assert list(frame) == list(cells)
        for column in frame:
            for cell, value in zip(cells[column], frame[column], strict=True):
                if isinstance(value, str):
                    assert unguarded(cell) == value
                elif pd.isna(value):
                    assert cell == "n/a"
                else:
                    assert float({"true": "1", "false": "0"}.get(cell, cell)) == value


def lines(folder: Path, name: str) -> Iterator[str]:
    """Yield the cells, labels and texts of an output."""
    stem, kind = name.split(".")
    (path,) = folder.glob(f"*_description-{stem}_data.{kind}") if not (folder / name).exists() else [folder / name]
    match kind:
        case "html":
            yield from page_lines(path.read_text(encoding="utf-8"))
        case "json":
            yield from leaves("", json.loads(path.read_bytes()))
        case "sav":
            frame, meta = pyreadstat.read_sav(str(path), user_missing=True)
            for column in frame:
                labels = meta.variable_value_labels.get(column, {})
                missing = meta.missing_ranges.get(column, [])
                kind = meta.variable_measure[column]
                yield f"{column}: {meta.column_names_to_labels[column]} {kind} {labels} {missing}"
            yield from frame.to_csv(index=False).splitlines()
        case _:
            yield from path.read_text(encoding="utf-8").splitlines()


def page_lines(text: str) -> Iterator[str]:
    """Yield a page's headings, paragraphs and rows of tables, without style and pictures."""
    body = re.sub(r"<style.*?</style>|<img[^>]*>", "", text, flags=re.S)
    for row in re.split(r"</?(?:tr|p|h\d|li|div|section|title|summary|details|caption|figcaption)\b[^>]*>", body):
        cells = [re.sub(r"<[^>]+>|\s+", " ", cell).strip() for cell in re.split(r"</t[dh]>", row)]
        if any(cells):
            yield html.unescape(" | ".join(cells).strip(" |"))


def leaves(place: str, value: Any) -> Iterator[str]:
    """Yield each value of a JSON text with its place; elements of lists by their name, if they have one."""
    if isinstance(value, list):
        named = all(isinstance(below, dict) and "name" in below for below in value)
        value = {below["name"] if named else number: below for number, below in enumerate(value)}
    if isinstance(value, dict) and value:
        for name, below in value.items():
            yield from leaves(f"{place}/{name}", below)
    else:
        yield f"{place}: {value!r}"

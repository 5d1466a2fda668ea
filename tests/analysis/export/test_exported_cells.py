"""Every cell of every exported file, against the rows that the sessions stored."""

import csv
import json
import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pyarrow import parquet

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.export.psychds_dataset import FOLDER
from study_app.analysis.export_study import export
from study_app.protocol.load import parse
from study_app.store.files.columns import RESPONSES, TRIALS
from study_app.store.files.csv_files import Column, csv_bytes, read_table
from study_app.store.verification.verify_session import Discrepancy
from tests.analysis.conftest import CANNOT_JUDGE, SMALL, Results, make_results

pytestmark = pytest.mark.slow

pyreadstat = pytest.importorskip("pyreadstat", reason="the extra analysis is not installed")

Rows = list[dict[str, Any]]
PLACES = [
    "study",
    "participant",
    "session",
    "simulated",
    "pilot",
    "trial",
    "attempt",
    "block",
    "phase",
    "part",
    "index",
    "code",
    "of",
]
ANSWERS = ["form", "after_block", "item", "kind", "number", "response", "value", "cannot_judge"]
TABLES = {"responses": RESPONSES, "trials": TRIALS}
SETTINGS = {"heavyzembla": ("zembla", 40.0), "lightquorn": ("quorn", 40.0), "learn": ("mud", 15.0)}
EXCLUDED = {"B": "spilled tea"}


def _drawn(column: Column, draw: random.Random) -> Any:
    """Return a value that the column permits; unless the column has few values, it is unique in the table."""
    if column.levels:
        return draw.choice(column.levels)[0]
    if column.may_miss and draw.random() < 0.2:
        return None
    if column.kind == "time":
        moment = datetime(2026, 1, 1, tzinfo=UTC) + timedelta(milliseconds=draw.randrange(10**10))
        return moment.isoformat(timespec="milliseconds")
    number = draw.randrange(1, 10**6)
    values = {"text": f"{column.name} {number}", "integer": number, "number": number / 1000}
    return values.get(column.kind, draw.random() < 0.5)


@pytest.fixture
def stored(tmp_path: Path) -> tuple[Results, dict[str, Rows]]:
    """A study whose key is open, and the rows of its sessions: all measured cells are drawn."""
    text = SMALL
    for condition, (liquid, delay_ms) in SETTINGS.items():
        text = text.replace(f'liquid = "{liquid}"', f'liquid = "{liquid}"\ndelay_ms = {delay_ms:g}')
        assert condition in text
    results = make_results(tmp_path / "small", parse(text.encode(), "small.toml"))
    draw = random.Random(2611)  # noqa: S311 - reproducible
    rows: dict[str, Rows] = {name: [] for name in TABLES}
    answers: tuple[Any, ...] = (1, 2, 3, 4, 5, 6, 7, CANNOT_JUDGE, None)
    for participant, results.simulated in (("C", True), ("A", False), ("B", True)):
        results.add(participant, lambda *_: draw.choice(answers))
        for name, columns in TABLES.items():
            file = getattr(results, name)(participant)
            table = read_table(file.read_bytes(), columns)
            for row in table:
                row |= {
                    column.name: _drawn(column, draw) for column in columns if column.name not in {*PLACES, *ANSWERS}
                }
            file.write_bytes(csv_bytes(columns, table))
            rows[name] += table
    for participant, reason in EXCLUDED.items():
        results.exclude(participant, reason=reason)
    results.open()
    return results, rows


def _expected(results: Results, rows: dict[str, Rows]) -> dict[str, Rows]:
    """Return the rows of the exported tables, computed from the stored ones."""
    errors = {
        tuple(row[name] for name in ("participant", "trial", "attempt")): row["delay_error_mean_ms"]
        for row in rows["trials"]
    }
    tables = {}
    for name, stored_rows in rows.items():
        tables[name] = []
        for row in stored_rows:
            reason = EXCLUDED.get(row["participant"])
            condition = results.key.condition(row["block"], row["code"])
            liquid, delay_ms = SETTINGS[condition]
            error_ms = errors[row["participant"], row["trial"], row["attempt"]]
            tables[name].append(
                {
                    **row,
                    "session_status": "completed",
                    "excluded": reason is not None,
                    "exclusion_reason": reason,
                    "counted": row["phase"] == "main" and reason is None,
                    "condition": condition,
                    "liquid": liquid,
                    "delay_ms": delay_ms,
                    "delay_achieved_ms": None if error_ms is None else round(error_ms + delay_ms, 6),
                }
            )
    counted_rows = [row for row in tables["responses"] if row["counted"]]
    return tables | {
        "aggregate": list(_aggregate(results, counted_rows)),
        "wide": list(_wide(rows["responses"], tables["trials"], counted_rows)),
    }


def _aggregate(results: Results, counted: Rows) -> Iterator[dict[str, Any]]:
    for code in results.key.codes["feel"]:
        for item, short in (("smooth", "Smooth"), ("warm", "Warm")):
            rows = [row for row in counted if (row["code"], row["item"]) == (code, item)]
            answers = [row["value"] for row in rows if row["value"] is not None]
            condition = results.key.condition("feel", code)
            liquid, delay_ms = SETTINGS[condition]
            q1, median, q3 = np.percentile(answers, [25, 50, 75])
            off = sum(row["cannot_judge"] for row in rows)
            yield {
                **{"study": "small", "simulated": True, "pilot": False, "block": "feel", "code": code},
                **{"condition": condition, "liquid": liquid, "delay_ms": delay_ms, "item": item, "short": short},
                "participants": len({row["participant"] for row in rows if row["value"] is not None}),
                **{"presented": len(rows), "presented_excluded": 0, "n": len(answers), "cannot_judge": off},
                "missing": len(rows) - len(answers) - off,
                **{f"count_{level}": answers.count(level) for level in range(1, 8)},
                **{"median": median, "q1": q1, "q3": q3},
                "agree_percent": 100 * sum(answer >= 5 for answer in answers) / len(answers),
            }


def _wide(stored_rows: Rows, trials: Rows, counted: Rows) -> Iterator[dict[str, Any]]:
    for participant in sorted({row["participant"] for row in counted}):
        own = [row for row in counted if row["participant"] == participant]
        medians = {}
        for condition in sorted(set(SETTINGS) - {"learn"}):
            for item in ("smooth", "warm"):
                answers = [row["value"] for row in own if (row["item"], row["condition"]) == (item, condition)]
                given_answers = [answer for answer in answers if answer is not None]
                medians[f"{item}__{condition}"] = np.median(given_answers) if given_answers else None
        simulated = {row["participant"]: row["simulated"] for row in stored_rows}[participant]
        groups = [row["group"] for row in trials if row["participant"] == participant and row["counted"]]
        group = next(group for group in reversed(groups) if group is not None)
        yield {"participant": participant, "simulated": simulated, "group": group, **medians}


def _text(cell: str) -> Any:
    """Return the value of a cell of a CSV file."""
    if cell in {"n/a", "true", "false"}:
        return {"n/a": None, "true": True, "false": False}[cell]
    try:
        return float(cell)
    except ValueError:
        return cell


def _csv(path: Path) -> Rows:
    with path.open(encoding="utf-8", newline="") as file:
        return [{name: _text(cell) for name, cell in row.items()} for row in csv.DictReader(file, strict=True)]


def _frame(frame: pd.DataFrame) -> Rows:
    """Return rows with None for missing values; in SPSS an empty text is also missing."""
    return [
        {str(name): None if pd.isna(value) or value == "" else value for name, value in row.items()}
        for row in frame.to_dict("records")
    ]


READERS: dict[str, Callable[[Path], Rows]] = {
    "csv": _csv,
    "parquet": lambda path: _frame(pd.read_parquet(path)),
    "sav": lambda path: _frame(pyreadstat.read_sav(str(path))[0]),
}


def _sorted(rows: Rows) -> Rows:
    names = [name for name in ("participant", "trial", "attempt", "code", "item") if name in rows[0]]
    return sorted(rows, key=lambda row: tuple(row[name] for name in names))


def test_every_cell_of_every_format_is_the_stored_one(stored: tuple[Results, dict[str, Rows]], tmp_path: Path) -> None:
    results, rows = stored
    expected = _expected(results, rows)
    assert {row["delay_achieved_ms"] is None for row in expected["trials"]} == {True, False}
    to = tmp_path / "out"
    exported_files = export(results.folder, to, extras=["wide", "parquet", "sav", "psych-ds"])
    files = [
        (path, path.stem.split("description-")[1].removesuffix("_data"), path.suffix[1:])
        for path in exported_files
        if "description-" in path.name and path.suffix[1:] in READERS
    ]
    own = [(name, form) for path, name, form in files if path.parent == to]
    assert sorted(own) == sorted(
        (name, form) for name in expected for form in READERS if form != "sav" or name in {"responses", "wide"}
    )
    assert sorted(name for path, name, _ in files if path.parent != to) == sorted(expected), FOLDER
    for path, table, form in files:
        cells = _sorted(READERS[form](path))
        assert [list(row) for row in cells[:1]] == [list(row) for row in expected[table][:1]], path
        for row, wanted in zip(cells, _sorted(expected[table]), strict=True):
            for name, cell in wanted.items():
                value, of = row[name], (path, row.get("participant"), row.get("trial"), name)
                if isinstance(cell, float):
                    assert value == pytest.approx(cell, rel=1e-12), of
                else:
                    assert value == (_text(cell) if form == "csv" and isinstance(cell, str) else cell), of


def _described(path: Path) -> dict[str, dict[str, str]]:
    """Return the description and unit of each column, as stated in the file or in its codebook."""
    if path.suffix == ".sav":
        labels = pyreadstat.read_sav(str(path), metadataonly=True)[1].column_names_to_labels
        parts = {name: label.removesuffix("]").rpartition(" [") for name, label in labels.items()}
        return {name: {"description": a or b, "unit": b if a else ""} for name, (a, _, b) in parts.items()}
    if path.suffix == ".parquet":
        stated: dict[str, dict[str, str]] = {}
        for field in parquet.read_schema(path):
            stated[field.name] = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
        return stated
    if path.parent.name == "data":
        variables = json.loads(path.with_suffix(".json").read_bytes())["variableMeasured"]
        return {variable["name"]: variable | {"unit": variable.get("unitText", "")} for variable in variables}
    files = json.loads((path.parent / "codebook.json").read_bytes())["files"]
    return {column["name"]: column for column in files[path.name]}


def test_every_format_has_the_unit_and_the_description_of_each_column(
    stored: tuple[Results, dict[str, Rows]], tmp_path: Path
) -> None:
    results, _ = stored
    exported_files = export(results.folder, tmp_path / "out", extras=["wide", "parquet", "sav", "psych-ds"])
    files = [path for path in exported_files if "description-" in path.name and path.suffix[1:] in READERS]
    for path in files:
        columns = _described(path)
        table = path.stem.split("description-")[1].removesuffix("_data")
        assert list(columns) == [*READERS[path.suffix[1:]](path)[0]], path
        if table in TABLES:
            assert {columns[name].get("unit") for name in ("delay_ms", "delay_achieved_ms")} == {"ms"}, path
        for column in TABLES.get(table, ()):
            label = columns[column.name]
            assert label.get("unit", "") == column.unit, (path, column.name)
            assert label["description"].startswith(column.description[:230]), (path, column.name)


def test_an_export_warns_of_each_file_that_differs(
    stored: tuple[Results, dict[str, Rows]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results, _ = stored
    doubts = tuple(
        Discrepancy(results.folder / f"{name}.csv", f"has {what}", f"restore {name}")
        for name, what in (("b", "9 rows"), ("a", "other values"))
    )
    study = replace(load_study(results.folder), doubts=doubts)
    monkeypatch.setattr("study_app.analysis.export_study.load_study", lambda _folder: study)
    warnings: list[str] = []
    export(results.folder, tmp_path / "out", warn=warnings.append)
    export(results.folder, tmp_path / "out")
    assert warnings == [
        f"warning: {results.folder / 'b.csv'} has 9 rows: restore b; the file is still used",
        f"warning: {results.folder / 'a.csv'} has other values: restore a; the file is still used",
    ]
    codebook = json.loads((tmp_path / "out" / "codebook.json").read_bytes())
    assert codebook["doubts"] == [
        {"file": "b.csv", "what": "has 9 rows"},
        {"file": "a.csv", "what": "has other values"},
    ]

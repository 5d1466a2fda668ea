"""What other programs make of exported tables: the documented line of pandas, and the levels of measurement of SPSS."""

import json
import re
from pathlib import Path

import pandas as pd
import pytest

from study_app import documentation
from study_app.analysis.export_study import export
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.blinding import read_key
from study_app.store.exclusions import exclude
from study_app.store.files.columns import RESPONSES
from study_app.store.files.csv_files import Column, csv_bytes, read_table
from study_app.store.files.folders import StudyFolder
from study_app.store.unblinding import unblind
from tests.protocol.forms.mixed import mixed_file

pytestmark = pytest.mark.slow

IDS = ["NA", "nan", "None", "NULL", "1E5", "TRUE", "007", "inf", "MAR1", "P1"]


def test_the_documented_line_of_pandas_keeps_ids_and_texts(tmp_path: Path) -> None:
    columns = (Column("participant", "text", "Id."), Column("words", "text", "Text."), Column("age", "number", "Age."))
    file = tmp_path / "table.csv"
    file.write_bytes(
        csv_bytes(
            columns, [{"participant": participant_id, "words": participant_id, "age": None} for participant_id in IDS]
        )
    )
    (line,) = re.findall(r"`(pandas\.read_csv\(FILE[^`]*)`", documentation.page("export"))
    frame = eval(" ".join(line.split()), {"pandas": pd, "FILE": file})  # noqa: S307 - the line that readers copy
    assert frame["participant"].tolist() == IDS
    assert frame["words"].tolist() == IDS
    assert frame["age"].isna().all()
    assert pd.read_csv(file)["participant"].isna().sum() == 4, "without these options"


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A study with questions of every kind, and its export; the trial of P003 with the thick liquid is excluded."""
    place = tmp_path_factory.mktemp("mixed")
    folder = rehearse_answers(str(mixed_file(place)), participants=3, seed=1, results=place / "results")
    rows = read_table(StudyFolder(folder).session("P003", 1).table("mixed", "responses").read_bytes(), RESPONSES)
    key = read_key(folder)
    (trial,) = {row["trial"] for row in rows if row["code"] and key.condition("stir", row["code"]) == "thick"}
    exclude(folder, "P003", 1, trial=trial, by="AB", reason="coughed")
    unblind(folder, "AB", "to analyse")
    export(folder, place / "out", extras=["wide", "sav"])
    return folder, place / "out"


def _wide_cells(results: Path, person: str) -> dict[str, str | None]:
    """Return the cells of a person's row in the wide table, from the stored answers."""
    cells: dict[str, str | None] = {}
    key = read_key(results)
    for row in read_table(StudyFolder(results).session(person, 1).table("mixed", "responses").read_bytes(), RESPONSES):
        name = f"{row['form']}__{row['item']}"
        if row["form"] is None:
            condition = key.condition("stir", row["code"])
            name = f"{'' if row['item'] == 'feels_liquid' else 'stir__'}{row['item']}__{condition}"
            row["response"] = None if (person, condition) == ("P003", "thick") else row["response"]
        cells[name] = row["response"]
    points = [int(cells[f"usability__sus{number}"] or 0) for number in range(1, 11)]
    load = [float(cells[name] or 0) for name in cells if name.startswith("load__")]
    cells["usability__sus"] = str(2.5 * (sum(points[::2]) - 5 + 25 - sum(points[1::2])))
    return cells | {"load__raw": str(sum(load) / 6), "start__since": None}


def test_wide_tables_contain_the_stored_answers_and_the_questions(mixed: tuple[Path, Path]) -> None:
    pyreadstat = pytest.importorskip("pyreadstat", reason="the extra analysis is not installed")
    folder, out = mixed
    (file,) = out.glob("*wide_data.csv")
    rows = pd.read_csv(file, dtype=str, keep_default_na=False).set_index("participant")
    sav_frame, about = pyreadstat.read_sav(str(file.with_suffix(".sav")), user_missing=True)
    coded = sav_frame.set_index("participant")
    used = {"left": "Left", "right": "Right", "both": "Both"}
    for person in ("P001", "P002", "P003"):
        cells = _wide_cells(folder, person)
        assert {*cells, "simulated"} == {*rows.columns} == {*coded.columns}
        for name, cell in cells.items():
            held, value = rows.loc[person, name], coded.loc[person, name]
            if cell is None:
                assert held == "n/a"
                assert value == 97 if name in about.variable_value_labels else pd.isna(value), name
            elif name.split("__")[1] in {"hand", "used", "comment"}:
                assert (held, about.variable_value_labels.get(name, {}).get(value, value)) == (
                    cell, used.get(cell, cell),
                )  # fmt: skip
            else:
                assert float(held) == value == pytest.approx(float(cell)), name
    book = json.loads((out / "codebook.json").read_bytes())
    columns = {column["name"]: column for column in book["files"][file.name]}
    for name, kind, description, bounds in (
        ("feels_liquid__thin", "integer", "It feels like a liquid. About Thin, in Stir.", (1, 7)),
        ("stir__thickness__thick", "integer", "How thick was it? In Stir. About Thick.", (1, 5)),
        ("stir__pleasant__thin", "integer", "How pleasant was it? In Stir. About Thin.", (0, 100)),
        ("start__age", "integer", "How old are you? In Start.", (16, 99)),
        ("start__hand", "text", "Which hand do you write with? In Start.", (None, None)),
        ("load__raw", "number", "Score raw of nasa-tlx, in NASA-TLX.", (None, None)),
    ):
        column = columns[name]
        assert (column["description"], column.get("minimum"), column.get("maximum")) == (description, *bounds)
        assert (about.column_names_to_labels[name], column["may_miss"], column["type"]) == (description, True, kind)
    questions = {question["id"]: question for question in book["questions"]}
    assert [(score["form"], score["name"], score["instrument"], score["items"]) for score in book["scores"]] == [
        ("load", "raw", "nasa-tlx", [*questions][6:12]), ("usability", "sus", "sus", [*questions][12:22]),
    ]  # fmt: skip
    assert [questions[name] for name in ("age", "hand", "since", "thickness")] == [
        {"form": "start", "id": "age", "kind": "number", "text": "How old are you?", "short": "Age", "range": [16, 99]},
        {
            "form": "start", "id": "hand", "kind": "choice", "text": "Which hand do you write with?", "short": "Hand",
            "levels": used,
        },
        {
            "form": "start", "id": "since", "kind": "number", "text": "Since when?", "short": "Since",
            "show_if": {"item": "hand", "is": "both", "at_least": None, "at_most": None},
        },
        {
            "block": "stir", "id": "thickness", "kind": "rating", "text": "How thick was it?", "short": "Thickness",
            "levels": {"1": "Not at all", "2": "Slightly", "3": "Somewhat", "4": "Rather", "5": "Very"},
            "cannot_judge": "Cannot judge", "range": [1, 5],
        },
    ]  # fmt: skip


def test_each_kind_of_question_has_its_level_of_measurement_in_sav(mixed: tuple[Path, Path]) -> None:
    pyreadstat = pytest.importorskip("pyreadstat", reason="the extra analysis is not installed")
    (file,) = mixed[1].glob("*wide_data.sav")
    about = pyreadstat.read_sav(str(file), metadataonly=True)[1]
    levels = {
        "start__age": "scale",
        "start__hand": "nominal",
        "start__used": "nominal",
        "end__comment": "nominal",
        "feels_liquid__thin": "ordinal",
        "stir__thickness__thin": "ordinal",
        "usability__sus1": "ordinal",
        "stir__pleasant__thin": "scale",
        "load__effort": "scale",
        "usability__sus": "scale",
    }
    assert {name: about.variable_measure[name] for name in levels} == levels

"""What other programs make of exported tables: the documented line of pandas, and the levels of measurement of SPSS."""

import re
from pathlib import Path

import pandas as pd
import pytest

from study_app import documentation
from study_app.analysis.export_study import export
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.files.csv_files import Column, csv_bytes
from study_app.store.unblinding import unblind
from tests.protocol.forms.mixed import mixed_file

pytestmark = pytest.mark.slow

IDS = ["NA", "nan", "None", "NULL", "1E5", "TRUE", "007", "inf", "MAR1", "P1"]


def test_the_documented_line_of_pandas_keeps_ids_and_texts(tmp_path: Path) -> None:
    columns = (Column("participant", "text", "Id."), Column("words", "text", "Text."), Column("age", "number", "Age."))
    file = tmp_path / "table.csv"
    file.write_bytes(csv_bytes(columns, [{"participant": one, "words": one, "age": None} for one in IDS]))
    (line,) = re.findall(r"`(pandas\.read_csv\(FILE[^`]*)`", documentation.page("export"))
    frame = eval(" ".join(line.split()), {"pandas": pd, "FILE": file})  # noqa: S307 - the line that readers copy
    assert frame["participant"].tolist() == IDS
    assert frame["words"].tolist() == IDS
    assert frame["age"].isna().all()
    assert pd.read_csv(file)["participant"].isna().sum() == 4, "without these options"


def test_each_kind_of_question_has_its_level_of_measurement_in_sav(tmp_path: Path) -> None:
    pyreadstat = pytest.importorskip("pyreadstat", reason="the extra analysis is not installed")
    folder = rehearse_answers(str(mixed_file(tmp_path)), participants=3, seed=1, results=tmp_path / "results")
    unblind(folder, "AB", "to analyse")
    export(folder, tmp_path / "out", extras=["wide", "sav"])
    (file,) = (tmp_path / "out").glob("*wide_data.sav")
    found, about = pyreadstat.read_sav(str(file))
    measure, labels = about.variable_measure, about.variable_value_labels
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
    assert {name: measure[name] for name in levels} == levels
    words = {code: label for code, label in labels["start__hand"].items() if code < 90}
    assert words == {1: "Left", 2: "Right", 3: "Both"}
    (file,) = (tmp_path / "out").glob("*wide_data.csv")
    written = pd.read_csv(file)["start__hand"].str.capitalize()
    assert [words[code] for code in found["start__hand"]] == [*written]

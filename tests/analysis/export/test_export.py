import csv
import json
import os
from pathlib import Path

import pandas as pd
import pytest

from study_app.analysis.export.table_files import table_bytes
from study_app.analysis.export.tables import ExportTable
from study_app.analysis.export_study import export
from study_app.errors import AnalysisError
from study_app.store.files.columns import SEALED
from study_app.store.files.csv_files import Column, unguard_formula
from study_app.store.files.output_files import write_files
from tests.analysis.conftest import Results

pytestmark = pytest.mark.slow

NAMES = {
    "study-rek2024_description-responses_data.csv",
    "study-rek2024_description-trials_data.csv",
    "study-rek2024_description-aggregate_data.csv",
    "codebook.json",
}


def rows(to: Path, name: str, study: str = "rek2024") -> list[dict[str, str]]:
    with (to / f"study-{study}_description-{name}_data.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, strict=True))


@pytest.fixture
def to(tmp_path: Path) -> Path:
    return tmp_path / "deep" / "out"


def test_columns_that_earlier_versions_wrote_in_clear_are_not_exported_before_unblinding(
    rek: Results, to: Path
) -> None:
    """Their tables contain columns that reveal conditions; exported files contain these only after unblinding."""
    rek.add("P001", lambda *_: 6, changes={"force_mean_n": 4.8151623})
    export(rek.folder, to, extras=("psych-ds", "wide"))
    contents = {path: path.read_bytes() for path in to.rglob("*") if path.is_file()}
    assert not [path for path, content in contents.items() if b"4.8151623" in content]
    assert set(json.loads((to / "codebook.json").read_text("utf-8"))["sealed_columns"]) == SEALED
    variables = json.loads((to / "psych-ds" / "dataset_description.json").read_text("utf-8"))["variableMeasured"]
    assert not SEALED & {variable["name"] for variable in variables}
    rek.open()
    export(rek.folder, to)
    assert {row["force_mean_n"] for row in rows(to, "trials")} == {"4.8151623"}


def test_excluded_sessions_and_trials_are_exported_with_their_reason_and_not_counted(rek: Results, to: Path) -> None:
    for participant in ("P001", "P002", "P003"):
        rek.add(participant, lambda *_: 6)
    trial = rek.trial("P002", "honey")
    rek.exclude("P001", reason='the phone rang, "twice"\nand 🌊')
    rek.exclude("P002", trial=trial, reason="spilled tea")
    export(rek.folder, to)
    for name in ("responses", "trials"):
        exported_rows = rows(to, name)
        assert {row["participant"] for row in exported_rows} == {"P001", "P002", "P003"}
        for row in exported_rows:
            excluded = row["participant"] == "P001" or (row["participant"], row["trial"]) == ("P002", str(trial))
            reason = {"P001": 'the phone rang, "twice"\nand 🌊', "P002": "spilled tea"}.get(row["participant"], "")
            assert (row["excluded"], row["exclusion_reason"]) == (("true", reason) if excluded else ("false", "n/a"))
            assert row["counted"] == ("true" if row["phase"] == "main" and not excluded else "false")
    honey = rek.code("honey", "liquids")
    for row in rows(to, "aggregate"):
        expected = ("1", "1", "1") if row["code"] == honey else ("2", "0", "2")
        assert (row["n"], row["presented_excluded"], row["presented"]) == expected
        assert row["missing"] == "0"
    codebook = json.loads((to / "codebook.json").read_text("utf-8"))
    assert (codebook["study"]["participants"], codebook["study"]["sessions"]) == (2, 3)
    assert (codebook["study"]["sessions_excluded"], codebook["study"]["sessions_left_out"]) == (1, 0)
    assert {"condition", "liquid", "delay_ms"}.isdisjoint(codebook["blocks"][0]["settings"][0])
    assert codebook["exclusions"][1] == {
        "participant": "P002",
        "session": 1,
        "trial": trial,
        "rule_or_person": "AB",
        "reason": "spilled tea",
        "excluded_at": "2026-01-06T10:00:00.000+01:00",
        "key_open": None,
    }
    rek.open()
    export(rek.folder, to)
    blocks = json.loads((to / "codebook.json").read_text("utf-8"))["blocks"]
    names = {
        setting["condition"]: (setting["liquid"], setting["delay_ms"], setting["code"])
        for block_table in blocks
        for setting in block_table["settings"]
    }
    assert names["delay_50"] == ("water", 50, rek.code("delay_50", "delays"))
    assert names["honey"] == ("honey", 0, honey)


def test_the_codebook_counts_answers_that_were_given(small: Results, to: Path) -> None:
    answer_counts = []
    for participant, answer in (("A", None), ("B", 5)):
        small.add(participant, lambda *_, answer=answer: answer)
        export(small.folder, to)
        (block,) = json.loads((to / "codebook.json").read_text("utf-8"))["blocks"]
        answer_counts.append((block["answers_per_participant_setting_and_item"], block["sessions"]))
    assert answer_counts == [([0, 0], []), ([2, 2], [1])], "each setting is presented twice"


def test_texts_are_guarded_against_spreadsheet_formulas_and_negative_numbers_stay_numbers(
    rek: Results, to: Path
) -> None:
    rek.add("P001", lambda *_: 6)
    rek.exclude("P001", reason="=1+1")
    export(rek.folder, to)
    trial_rows = rows(to, "trials")
    assert {row["exclusion_reason"] for row in trial_rows} == {"'=1+1"}
    assert {unguard_formula(row["exclusion_reason"]) for row in trial_rows} == {"=1+1"}
    frame = pd.DataFrame({"text": ["-1"], "number": [-1.5]})
    columns = (Column("text", "text", ""), Column("number", "number", ""))
    assert table_bytes(ExportTable("numbers", columns, frame)) == b"text,number\n'-1,-1.5\n"


def test_an_export_replaces_the_one_before_it_and_leaves_other_files(rek: Results, to: Path) -> None:
    rek.add("P001", lambda *_: 6)
    export(rek.folder, to)
    (to / "mine.txt").write_text("kept", encoding="utf-8", newline="\n")
    rek.add("P002", lambda *_: 6)
    export(rek.folder, to)
    assert len(rows(to, "responses")) == 124
    assert (to / "mine.txt").read_text("utf-8") == "kept"


def test_a_damaged_results_folder_is_not_exported(rek: Results, to: Path) -> None:
    rek.add("P001", lambda *_: 6)
    rek.responses("P001").write_text("x", encoding="utf-8", newline="\n")
    with pytest.raises(AnalysisError):
        export(rek.folder, to)
    assert not to.exists()


def test_a_file_in_the_place_of_the_folder_is_refused(rek: Results, tmp_path: Path) -> None:
    rek.add("P001", lambda *_: 6)
    (tmp_path / "taken").write_text("x", encoding="utf-8", newline="\n")
    with pytest.raises(AnalysisError, match=r"taken cannot be written \(it is a file, not a folder\): .*--to"):
        export(rek.folder, tmp_path / "taken")
    assert (tmp_path / "taken").read_text("utf-8") == "x"


def test_halves_of_a_killed_export_go_with_the_next_one(rek: Results, to: Path) -> None:
    rek.add("P001", lambda *_: 6)
    to.mkdir(parents=True)
    half = to / ".codebook.json.0123abcd.tmp"
    half.touch()
    os.utime(half, (0, 0))
    export(rek.folder, to)
    assert {path.name for path in to.iterdir()} == NAMES


def test_where_one_file_cannot_be_written_the_others_stay_as_they_were(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("old", encoding="utf-8", newline="\n")
    with pytest.raises(AnalysisError, match="cannot be written"):
        write_files(tmp_path, {"a.csv": b"new", "x" * 300: b"too long a name"})
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
    assert (tmp_path / "a.csv").read_text("utf-8") == "old"
    with pytest.raises(AnalysisError):
        write_files(tmp_path / "made", {"x" * 300: b""})
    assert not (tmp_path / "made").exists()

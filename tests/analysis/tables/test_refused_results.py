"""Results that are refused: missing, changed, torn, foreign, under another key."""

from pathlib import Path

import pytest

from study_app.analysis.tables import typed_files
from study_app.analysis.tables.study_tables import load_study
from study_app.errors import AnalysisError, StoreError
from study_app.store.tables.column import header
from study_app.store.tables.columns import RESPONSES, TRIALS
from study_app.store.tables.csv_files import csv_bytes, read_table
from tests.analysis.conftest import Results, make_results
from tests.analysis.tables.differing_answers import by_condition, refusal
from tests.store.earlier import TRIALS_HEADER

pytestmark = pytest.mark.slow


def test_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    assert "nowhere is not a folder" in refusal(tmp_path / "nowhere")


def test_an_empty_or_foreign_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "holiday.txt").write_text("x")
    assert "holds no sessions" in refusal(tmp_path)


def test_the_folder_above_the_studies_names_them(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    message = refusal(rek.folder.parent)
    assert f"give {rek.folder}" in message


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (",immersive,2,4,", ",immersive,2,8,", "column response: '8' is not a whole number from 1 to 7 or n/a"),
        (",immersive,2,4,", ",immersive,2,good,", "column response: 'good'"),
        (",immersive,2,4,", ",immersive,", "cells instead of"),
        (",immersive,2,4,", ",imersive,2,4,", "knows no statement 'imersive'"),
        (",L1,immersive,", ",L9,immersive,", "setting 'L9'"),
        (",L1,immersive,", ",L1,feels_liquid,", "stands there twice"),
        ("study,participant", "study,person", "does not begin with the columns"),
        ("rek2024,P001,1,", "rek2024,P007,1,", "column participant: 'P007' instead of 'P001'"),
        ("rek2024,P001,1,", "other,P001,1,", "column study: 'other' instead of 'rek2024'"),
        (",false,false,2,", ",maybe,false,2,", "column simulated: 'maybe' is not true or false"),
        (",main,", ",mian,", "column phase: 'mian' is not one of main, practice, baseline"),
    ],
)
def test_a_changed_table_is_refused_with_file_row_and_value(real: Results, old: str, new: str, says: str) -> None:
    real.add("P001", lambda *_: 4)
    path = real.responses("P001")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    message = refusal(real.folder)
    assert says in message
    assert str(path) in message


def test_a_table_of_an_earlier_version_is_read_as_if_its_later_columns_held_nothing(rek: Results) -> None:
    rek.add("P001", by_condition)
    before = load_study(rek.folder).trials
    path = rek.trials("P001")
    earlier = tuple(column for column in TRIALS if column.name in TRIALS_HEADER.split(","))
    path.write_bytes(csv_bytes(earlier, read_table(path.read_bytes(), earlier)))
    assert path.read_text(encoding="utf-8").startswith(TRIALS_HEADER + "\n")
    trials = load_study(rek.folder).trials
    assert trials[["withheld_share", "limiter_estimator"]].isna().all(axis=None)
    assert trials["force_mean_n"].equals(before["force_mean_n"])
    lacking = [column for column in earlier if column.name != "valid"]
    path.write_bytes(csv_bytes(lacking, read_table(path.read_bytes(), lacking)))
    assert "does not begin with the columns" in refusal(rek.folder)


def test_bytes_that_are_no_text_are_refused(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    rek.responses("P001").write_bytes(b"\xff\xfe\x00")
    assert "is damaged" in refusal(rek.folder)


def test_a_missing_table_is_refused(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    rek.trials("P001").unlink()
    assert "cannot be read (No such file" in refusal(rek.folder)


@pytest.mark.parametrize("content", [b"", b"[1]", b"{}", b'{"protocol": {"study": 3}}'])
def test_a_broken_receipt_is_refused(rek: Results, content: bytes) -> None:
    session = rek.add("P001", lambda *_: 4)
    session.receipt.write_bytes(content)
    assert str(session.receipt) in refusal(rek.folder)


def test_sessions_under_another_key_are_not_pooled(rek: Results, tmp_path: Path) -> None:
    rek.add("P001", lambda *_: 4)
    session = rek.add("P002", lambda *_: 4)
    session.receipt.write_text(session.receipt.read_text().replace(rek.key.hash, "0" * 64))
    assert "different sealed keys" in refusal(rek.folder)


def test_sessions_that_were_asked_other_statements_are_not_pooled(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    session = rek.add("P002", lambda *_: 4)
    session.receipt.write_text(session.receipt.read_text().replace('"like_tar"', '"like_glue"'))
    path = rek.responses("P002")
    path.write_text(path.read_text().replace("like_tar", "like_glue"))
    assert "other statements" in refusal(rek.folder)


def test_an_opened_key_that_was_changed_is_refused(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    rek.open()
    make_results(rek.folder.parent / "other", rek.protocol)
    (rek.folder / "blinding" / "key.sealed").write_bytes(b"e30=")
    with pytest.raises(StoreError, match=r"key\.sealed"):
        load_study(rek.folder)


def test_a_bad_cell_is_found_in_whichever_file_and_row_it_stands(rek: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are read some at a time, and the row is counted in its own file."""
    monkeypatch.setattr(typed_files, "AT_ONCE", 2)
    for number in range(1, 6):
        rek.add(f"P{number:03d}", lambda *_: 4)
    path = rek.responses("P004")
    lines = path.read_text(encoding="utf-8").split("\n")
    cells = lines[7].split(",")
    cells[header(RESPONSES).index("changes")] = "99999999999999999999"
    path.write_text("\n".join([*lines[:7], ",".join(cells), *lines[8:]]), encoding="utf-8")
    with pytest.raises(
        AnalysisError, match=r"subject-P004.*row 7, column changes: '99999999999999999999' is not a whole"
    ):
        load_study(rek.folder)


def test_a_foreign_row_is_found_in_whichever_file_it_stands(rek: Results) -> None:
    for number in range(1, 4):
        rek.add(f"P{number:03d}", lambda *_: 4)
    path = rek.trials("P003")
    head, *rows, end = path.read_text(encoding="utf-8").split("\n")
    rows[4] = rows[4].replace("P003", "P002", 1)
    path.write_text("\n".join([head, *rows, end]), encoding="utf-8")
    with pytest.raises(AnalysisError, match=r"subject-P003.*row 5, column participant: 'P002' instead of 'P003'"):
        load_study(rek.folder)

"""The cells of tables: report and `verify` read the same, and every way a file can be damaged is refused."""

import csv
import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.data.session_files import tables
from study_app.errors import AnalysisError
from study_app.store.tables.csv_files import MISSING, Column, problems

COLUMNS = (
    Column("who", "text", "Text."),
    Column("when", "time", "Time.", may_miss=True),
    Column("count", "integer", "Whole number.", may_miss=True),
    Column("size", "number", "Number.", minimum=0, may_miss=True),
    Column("kept", "flag", "Flag.", may_miss=True),
)
NAMES = [column.name for column in COLUMNS]


def written(path: Path, rows: list[list[str]], *, quoted: bool = False) -> Path:
    text = io.StringIO()
    style = csv.QUOTE_ALL if quoted else csv.QUOTE_MINIMAL
    csv.writer(text, lineterminator="\n", quoting=style).writerows([NAMES, *rows])  # type: ignore[arg-type]
    path.write_text(text.getvalue(), encoding="utf-8")
    return path


def drawn(count: int, seed: int) -> list[list[str]]:
    draw = np.random.default_rng(seed)
    return [
        [
            str(draw.choice(["P001", "größer", "", "NA", "null", "x;y", "1.5"])),
            str(draw.choice(["2026-11-21T20:00:00.000+01:00", MISSING])),
            str(draw.choice(["0", "-7", "9007199254740993", MISSING])),
            str(draw.choice([repr(float(draw.random())), "1e-300", "3", MISSING])),
            str(draw.choice(["true", "false", MISSING])),
        ]
        for _ in range(count)
    ]


def test_quotes_change_nothing(tmp_path: Path) -> None:
    rows = [drawn(200, 1), [], drawn(300, 2)]
    plain = [written(tmp_path / f"{number}.csv", some) for number, some in enumerate(rows)]
    quoted = [written(tmp_path / f"{number}q.csv", some, quoted=True) for number, some in enumerate(rows)]
    (found, lengths), (other, counts) = tables(plain, COLUMNS), tables(quoted, COLUMNS)
    assert lengths.tolist() == counts.tolist() == [200, 0, 300]
    pd.testing.assert_frame_equal(found, other)
    cells = [row for some in rows for row in some]
    assert found["who"].tolist() == [row[0] for row in cells]
    assert found["count"].isna().tolist() == [row[2] == MISSING for row in cells]
    assert found["size"].fillna(-1).tolist() == [-1 if row[3] == MISSING else float(row[3]) for row in cells]
    assert {str(kind) for kind in found.dtypes} == {"string", "Int64", "Float64", "boolean"}


def test_a_table_without_rows_and_no_table_at_all_have_typed_columns(tmp_path: Path) -> None:
    for paths in ([], [written(tmp_path / "a.csv", [])]):
        found, lengths = tables(paths, COLUMNS)
        assert (len(found), lengths.sum(), list(found)) == (0, 0, NAMES)
        assert str(found["count"].dtype) == "Int64"


def test_a_sealed_column_that_a_file_lacks_is_missing(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", drawn(3, 1))
    found, _ = tables([path], (*COLUMNS, Column("level", "number", "Level.", sealed=True, may_miss=True)))
    assert found["level"].isna().tolist() == [True] * 3


@pytest.mark.parametrize("quoted", [False, True])
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("5,true", "5", "row 3 has 4 cells, not 5"),
        ("5,true", "5,true,", "row 3 has 6 cells, not 5"),
        ("P2,", "\nP2,", "row 3 has 0 cells, not 5"),
        ("who", "whom", "does not begin with the columns"),
        ("P2", '"P2"x', "is not CSV in UTF-8"),
    ],
)
def test_a_damaged_file_is_refused_with_its_row(tmp_path: Path, quoted: bool, old: str, new: str, says: str) -> None:
    first = '"P1"' if quoted else "P1"
    text = f"{','.join(NAMES)}\n{first},n/a,1,2,true\nP2,n/a,1,5,true\n"
    assert old in text
    (tmp_path / "a.csv").write_text(text.replace(old, new))
    with pytest.raises(AnalysisError, match=r"a\.csv") as refused:
        tables([written(tmp_path / "b.csv", drawn(4, 1)), tmp_path / "a.csv"], COLUMNS)
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("column", "cell", "permitted"),
    [
        ("count", "1_000", "a whole number or n/a"),
        ("count", " 5", "a whole number or n/a"),
        ("count", "9" * 20, "a whole number or n/a"),
        ("size", "-5", "a number of at least 0 or n/a"),
        ("size", "nan", "a number of at least 0 or n/a"),
        ("size", "1e999", "a number of at least 0 or n/a"),
        ("when", "yesterday", "a time with zone or n/a"),
        ("when", "٢٠٢٦-11-21T20:00:00.000+01:00", "a time with zone or n/a"),
        ("kept", "True", "true or false or n/a"),
    ],
)
def test_report_and_verify_refuse_the_same_cells_in_the_same_row(
    tmp_path: Path, column: str, cell: str, permitted: str
) -> None:
    rows = drawn(2, 1)
    rows[1][NAMES.index(column)] = cell
    path = written(tmp_path / "a.csv", rows)
    with pytest.raises(AnalysisError, match=r"a\.csv") as refused:
        tables([path], COLUMNS)
    sentence = f"{column}: {cell!r} is not {permitted}"
    assert f"row 3, column {sentence}; " in str(refused.value)
    assert list(problems(path.read_bytes(), COLUMNS)) == [f"row 3, {sentence}"]

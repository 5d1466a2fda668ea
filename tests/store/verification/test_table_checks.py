import pytest

from study_app.store.tables.column import Column, header
from study_app.store.verification.table_checks import problems

COLUMNS = (
    Column("name", "text", "A name."),
    Column("count", "integer", "How many.", minimum=1, maximum=99),
    Column("speed", "number", "How fast.", "m/s", minimum=0, may_miss=True),
    Column("real", "flag", "Whether."),
    Column("level", "text", "Which.", levels=(("low", "little"), ("high", "much")), may_miss=True),
    Column("at", "time", "When."),
)
RIGHT = ["x", "7", "0.5", "true", "low", "2026-03-01T10:00:00.000+01:00"]


def found(*rows: list[str], names: tuple[str, ...] = header(COLUMNS)) -> list[str]:
    text = "".join(f"{','.join(row)}\n" for row in (list(names), *rows))
    return list(problems(text.encode(), COLUMNS))


def with_cell(column: str, cell: str) -> list[str]:
    index = header(COLUMNS).index(column)
    return [*RIGHT[:index], cell, *RIGHT[index + 1 :]]


@pytest.mark.parametrize(
    ("column", "cells"),
    [
        ("name", ["", "n/a", '"two\nlines, ""quoted"""', "=1", "🌊"]),
        ("count", ["1", "99"]),
        ("speed", ["0", "0.0", "1e-05", "12.25", "n/a", "3e+20"]),
        ("real", ["true", "false"]),
        ("level", ["low", "high", "n/a"]),
        ("at", ["2026-03-01T10:00:00.000+01:00", "1999-12-31T23:59:59.999-11:30"]),
    ],
)
def test_what_the_dictionary_permits_is_right(column: str, cells: list[str]) -> None:
    assert found(*(with_cell(column, cell) for cell in cells)) == []


@pytest.mark.parametrize(
    ("column", "cell", "sentence"),
    [
        ("count", "0", "'0' is not a whole number from 1 to 99"),
        ("count", "100", "'100' is not a whole number from 1 to 99"),
        ("count", "n/a", "'n/a' is not a whole number from 1 to 99"),
        ("count", "7.0", "'7.0' is not a whole number from 1 to 99"),
        ("count", "", "'' is not a whole number from 1 to 99"),
        ("speed", "-0.5", "'-0.5' is not a number of at least 0 or n/a"),
        ("speed", "nan", "'nan' is not a number of at least 0 or n/a"),
        ("speed", '"0,5"', "'0,5' is not a number of at least 0 or n/a"),
        ("real", "True", "'True' is not true or false"),
        ("level", "middle", "'middle' is not one of low, high or n/a"),
        ("at", "2026-03-01 10:00", "'2026-03-01 10:00' is not a time with zone"),
        ("at", "x" * 99, f"'{'x' * 39}…' is not a time with zone"),
    ],
)
def test_what_it_does_not_permit_is_named_with_its_row(column: str, cell: str, sentence: str) -> None:
    assert found(RIGHT, with_cell(column, cell), with_cell(column, cell)) == [f"row 3, {column}: {sentence}"]


def test_columns_are_those_of_the_dictionary_in_its_order() -> None:
    names = header(COLUMNS)
    assert found(names=names[1:]) == ["columns are missing: name"]
    assert found(names=(*names, "mood")) == ["columns are unknown: mood"]
    assert found(names=(names[1], names[0], *names[2:])) == ["columns are in another order or duplicated"]
    assert found(names=(*names, "name")) == ["columns are in another order or duplicated"]
    assert found(RIGHT, RIGHT[:-1]) == ["row 3 has 5 cells, not 6"]


@pytest.mark.parametrize("content", [b"", b"\xff", b'name,"count\n'])
def test_what_is_no_table_is_named(content: bytes) -> None:
    (problem,) = problems(content, COLUMNS)
    assert problem.startswith(("columns are missing", "is not CSV in UTF-8"))

"""Cells that a column does not permit, named with their rows; what is refused there is never read."""

import pytest

from study_app.store.tables.csv_files import Column, header, problems, read_table

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


@pytest.mark.parametrize(
    ("column", "cell"),
    [("count", "1_0"), ("count", " 5"), ("count", "9" * 20), ("speed", "1_000"), ("at", "yesterday"), ("real", "yes")],
)
def test_a_cell_that_is_refused_is_not_read(column: str, cell: str) -> None:
    """Reports read tables by the same rules as `verify` checks them."""
    table = "".join(f"{','.join(row)}\n" for row in (header(COLUMNS), with_cell(column, cell)))
    assert len(list(problems(table.encode(), COLUMNS))) == 1
    with pytest.raises(ValueError, match="is not"):
        read_table(table.encode(), COLUMNS)

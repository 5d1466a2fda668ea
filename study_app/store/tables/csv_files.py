"""CSV files: tables with the columns of ``columns``, and columns of numbers to their last digit."""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from study_app.errors import StudyError
from study_app.store.atomic import write_file
from study_app.store.tables.column import MISSING, Column, header
from study_app.store.tables.columns import LATER, columns_held
from study_app.store.tables.formulas import guarded, unguarded

Row: TypeAlias = dict[str, Any]


def csv_bytes(columns: Sequence[Column], rows: Iterable[Mapping[str, Any]]) -> bytes:
    """Return the table as CSV: comma, UTF-8, RFC 4180 quoting, one line feed a record, ``n/a`` where nothing is known.

    Numbers are written in full (the shortest text that reads back as the same number). A text that a spreadsheet would
    compute has an apostrophe before it (``formulas``); half a surrogate pair, which no file can hold, becomes a
    question mark.
    """
    return b"".join([header_bytes(columns), *records(columns, rows)])


def header_bytes(columns: Sequence[Column]) -> bytes:
    """Return the first record of a table."""
    return f"{','.join(header(tuple(columns)))}\n".encode()


def records(columns: Sequence[Column], rows: Iterable[Mapping[str, Any]]) -> Iterator[bytes]:
    """Yield each row of a table as `csv_bytes` writes it."""
    names = header(tuple(columns))
    for row in rows:
        yield f"{','.join([cell_text(row[name]) for name in names])}\n".encode("utf-8", "replace")


def read_table(table: bytes, columns: Sequence[Column]) -> list[Row]:
    """Return the rows of a table that `csv_bytes` wrote, in these of its columns; None is what is missing.

    Raises
    ------
    ValueError, csv.Error
        It is not such a table.
    """
    found = list(csv.reader(io.StringIO(table.decode("utf-8"), newline=""), strict=True)) or [[]]
    places = [(column, found[0].index(column.name)) for column in columns]
    if any(len(row) != len(found[0]) for row in found):
        raise ValueError("its rows differ in length")
    return [{column.name: _value(column, row[place]) for column, place in places} for row in found[1:]]


def _value(column: Column, cell: str) -> Any:
    if cell == MISSING:
        return None
    match column.kind:
        case "integer" | "number":
            return int(cell) if cell.removeprefix("-").isdigit() else float(cell)
        case "flag":
            return cell == "true"
    return unguarded(cell)


def in_columns_of(
    held: bytes, table: bytes, columns: Sequence[Column], may_lack: frozenset[str] = LATER
) -> tuple[bytes, tuple[Column, ...]]:
    """Return ``table``, whose columns are ``columns``, with those that the table ``held`` must have; and these columns.

    ``held`` may lack ``may_lack``, columns that its version did not write, and ``table`` those that are sealed. Where
    ``held`` has the same texts without apostrophes, as earlier versions wrote them, it is returned itself.
    """
    names, ours = (one.partition(b"\n")[0].decode("utf-8", "replace").split(",") for one in (held, table))
    there = tuple(column for column in columns if column.name in ours)
    kept = columns_held(names, there, may_lack)
    table = table if kept == there else csv_bytes(kept, read_table(table, kept))
    return (held if b"'" in table and held == _without_guards(table) else table), kept


def _without_guards(table: bytes) -> bytes:
    """Return a table that `csv_bytes` wrote without the apostrophes before texts that a spreadsheet would compute."""
    rows = csv.reader(io.StringIO(table.decode("utf-8"), newline=""))
    return "".join(f"{','.join([_quoted(unguarded(cell)) for cell in row])}\n" for row in rows).encode()


def cell_text(value: Any) -> str:
    """Return a cell as text in a table."""
    kind = type(value)
    if value is None or (kind is float and not math.isfinite(value)):
        return MISSING
    if kind is int or kind is float:
        return repr(value)
    if kind is bool:
        return "true" if value else "false"
    return _quoted(guarded(str(value)))


def _quoted(text: str) -> str:
    if "," in text or '"' in text or "\n" in text or "\r" in text or text != text.strip():
        return '"' + text.replace('"', '""') + '"'
    return text


def write_columns(path: Path, table: np.recarray[Any, Any]) -> None:
    """Write a table of named columns as CSV, every number to its last digit; either the whole file or nothing.

    Raises
    ------
    StudyError
        A number is not finite, or the file cannot be written; one that was there is untouched.
    """
    names = table.dtype.names or ()
    for name in names:
        if not (finite := np.isfinite(table[name])).all():
            row = int(np.argmin(finite))
            raise StudyError(
                f"{path} is not written: {name} is {table[name][row]} in row {row + 1}; it must be finite: reduce "
                "positions, speeds or parameters"
            )
    write_file(path, csv_text_of([names, *zip(*(table[name].tolist() for name in names), strict=True)]).encode())


def csv_text_of(rows: Iterable[Iterable[Any]]) -> str:
    """Return rows of cells, the first the columns' names, as CSV: comma, one line feed a record."""
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()

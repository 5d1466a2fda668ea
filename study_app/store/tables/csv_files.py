"""Tables as CSV: comma, UTF-8, RFC 4180 quoting, one line feed a record, ``n/a`` where nothing is known.

Numbers are written in full; a text that a spreadsheet would compute has an apostrophe before it (``formulas``).
"""

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
from study_app.store.tables.formulas import guarded, unguarded

Row: TypeAlias = dict[str, Any]


def csv_bytes(columns: Sequence[Column], rows: Iterable[Mapping[str, Any]]) -> bytes:
    """Return a table; half a surrogate pair, which no file can hold, becomes a question mark."""
    return b"".join([header_bytes(columns), *records(columns, rows)])


def header_bytes(columns: Sequence[Column]) -> bytes:
    """Return the first record of a table."""
    return f"{','.join(header(tuple(columns)))}\n".encode()


def records(columns: Sequence[Column], rows: Iterable[Mapping[str, Any]]) -> Iterator[bytes]:
    """Yield each row of a table as `csv_bytes` writes it."""
    for row in rows:
        yield f"{','.join([cell_text(row[column.name]) for column in columns])}\n".encode("utf-8", "replace")


def cell_text(value: Any) -> str:
    """Return a cell as text in a table."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return MISSING
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, int | float) else _quoted(guarded(str(value)))


def _quoted(text: str) -> str:
    if "," in text or '"' in text or "\n" in text or "\r" in text or text != text.strip():
        return '"' + text.replace('"', '""') + '"'
    return text


def _lines(rows: Iterable[Iterable[str]]) -> bytes:
    return "".join(f"{','.join(map(_quoted, row))}\n" for row in rows).encode()


def cells(table: bytes) -> list[list[str]]:
    """Return the records of a table as texts, the header first.

    Raises
    ------
    ValueError
        It is not CSV in UTF-8, or its records differ in length.
    """
    try:
        found = list(csv.reader(io.StringIO(table.decode("utf-8"), newline=""), strict=True)) or [[]]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"is not CSV in UTF-8 ({error})") from error
    for number, row in enumerate(found[1:], start=2):
        if len(row) != len(found[0]):
            raise ValueError(f"row {number} has {len(row)} cells, not {len(found[0])}")
    return found


def read_table(table: bytes, columns: Sequence[Column]) -> list[Row]:
    """Return the rows of a table that `csv_bytes` wrote, in these of its columns; None is what is missing.

    Raises
    ------
    ValueError
        It is not such a table.
    """
    names, *rows = cells(table)
    places = [(column, names.index(column.name)) for column in columns]
    return [{one.name: None if row[at] == MISSING else one.value(row[at]) for one, at in places} for row in rows]


def problems(table: bytes, columns: Sequence[Column]) -> Iterator[str]:
    """Yield what is wrong with a table, a sentence each; a column's first bad cell stands for all of them."""
    expected = header(tuple(columns))
    try:
        names, *rows = cells(table)
    except ValueError as error:
        yield str(error)
        return
    if tuple(names) != expected:
        missing = [name for name in expected if name not in names]
        unknown = [name for name in names if name not in expected]
        if missing:
            yield f"columns are missing: {', '.join(missing)}"
        if unknown:
            yield f"columns are unknown: {', '.join(unknown)}"
        if not missing and not unknown:
            yield "columns are in another order or duplicated"
        return
    for column, texts in zip(columns, zip(*rows, strict=True), strict=True) if rows else ():
        for text in dict.fromkeys(texts):
            try:
                column.value(text)
            except ValueError as error:
                yield f"row {texts.index(text) + 2}, {column.name}: {error}"
                break


def in_columns_of(held: bytes, table: bytes, columns: Sequence[Column]) -> tuple[bytes, tuple[Column, ...]]:
    """Return ``table``, whose columns are ``columns``, with those that the table ``held`` must have; and these columns.

    ``held`` may lack later columns, which its version did not write, and ``table`` those that are sealed. Where
    ``held`` has the same texts without apostrophes, as earlier versions wrote them, it is returned itself.
    """
    names, ours = (one.partition(b"\n")[0].decode("utf-8", "replace").split(",") for one in (held, table))
    there = tuple(column for column in columns if column.name in ours)
    kept = tuple(column for column in there if column.name in names or not column.later)
    if kept != there:
        places = [ours.index(column.name) for column in kept]
        table = _lines([row[place] for place in places] for row in cells(table))
    if b"'" in table and held == _lines(map(unguarded, row) for row in cells(table)):
        return held, kept
    return table, kept


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

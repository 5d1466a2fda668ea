"""The cells of a table of a results folder, as text: each column as the texts that occur and the place of each cell."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import pyarrow as pa  # type: ignore[import-untyped]
from pyarrow import csv as arrow_csv

from study_app.errors import AnalysisError
from study_app.store.atomic import read_regular
from study_app.store.tables.column import MISSING, Column, header
from study_app.store.tables.columns import LATER, columns_held

TEXTS: Final = pa.dictionary(pa.int32(), pa.string())


def cells(paths: Sequence[Path], columns: tuple[Column, ...]) -> tuple[Any, list[int]]:
    """Read the cells of the same table of many sessions.

    Returns
    -------
    pyarrow.Table, list of int
        The cells of all files in their order, each column dictionary-encoded in the order of first occurrence, and how
        many rows each file holds. Columns that the version which wrote a file did not have yet, or that are sealed,
        hold n/a.

    Raises
    ------
    AnalysisError
        A file cannot be read, or its header or the length of a row is not that of the dictionary.
    """
    tables = [_file(path, columns) for path in paths]
    empty = pa.schema([(column.name, TEXTS) for column in columns]).empty_table()
    return pa.concat_tables([empty, *tables]).unify_dictionaries(), [len(table) for table in tables]


def again(path: Path) -> str:
    """Return how a session's table is made again."""
    return f"make it again from the journal: liquid-study rebuild {path.parent}"


def _file(path: Path, columns: tuple[Column, ...]) -> Any:
    try:
        data = read_regular(path)
    except OSError as error:
        why = error.strerror or type(error).__name__
        raise AnalysisError(f"{path} cannot be read ({why}): {again(path)}, or correct its permissions") from error
    table = _unquoted(data, path, columns)
    return table if table is not None else _parsed(data, path, columns)


def _unquoted(data: bytes, path: Path, columns: tuple[Column, ...]) -> Any | None:
    """Return the cells of a file without quotes and empty lines, by the compiled parser; None if damaged, too."""
    if not data or any(byte in data for byte in (b'"', b"\r", b"\0", b"\n\n")):
        return None
    try:
        names = data.partition(b"\n")[0].decode("utf-8").split(",")
        held = _held(names, path, columns)
        table = arrow_csv.read_csv(
            pa.BufferReader(data),
            arrow_csv.ReadOptions(use_threads=False, block_size=min(len(data) + 1, 1 << 30)),
            arrow_csv.ParseOptions(quote_char=False, ignore_empty_lines=False),
            arrow_csv.ConvertOptions(column_types={column.name: TEXTS for column in held}, null_values=[]),
        )
    except ValueError:  # pyarrow's errors, too: the slower parser finds the row
        return None
    return _complete(table, columns)


def _parsed(data: bytes, path: Path, columns: tuple[Column, ...]) -> Any:
    """Return the cells of any file."""
    try:
        found = list(csv.reader(io.StringIO(data.decode("utf-8"), newline=""), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise AnalysisError(f"{path} is damaged ({error}): {again(path)}") from error
    held = _held(found[0] if found else (), path, columns)
    del found[0]
    for number, row in enumerate(found, start=1):
        if len(row) != len(held):
            raise AnalysisError(
                f"{path}, row {number}: {len(row)} cells instead of {len(held)}: the file was cut off or changed; "
                f"{again(path)}"
            )
    columnwise = zip(*found, strict=True) if found else ((),) * len(held)
    arrays = [pa.array(texts, pa.string()).dictionary_encode() for texts in columnwise]
    return _complete(pa.table(arrays, names=list(header(held))), columns)


def _held(names: Sequence[str], path: Path, columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Return the columns of a file with these names, which must be those of the dictionary in its order."""
    held = columns_held(names, columns, LATER | {column.name for column in columns if column.sealed})
    expected = header(held)
    if tuple(names) != expected:
        raise AnalysisError(
            f"{path} does not begin with the columns of this table: it was changed, or written by another version of "
            f"the program (expected {', '.join(expected[:4])} …, {len(expected)} columns); {again(path)}"
        )
    return held


def _complete(table: Any, columns: tuple[Column, ...]) -> Any:
    """Return all columns, in the order of the dictionary; n/a in those that the file lacks."""
    known = set(table.column_names)
    lacking = pa.DictionaryArray.from_arrays(pa.array([0] * len(table), pa.int32()), pa.array([MISSING], pa.string()))
    arrays = [table[column.name] if column.name in known else lacking for column in columns]
    return pa.table(arrays, schema=pa.schema([(column.name, TEXTS) for column in columns]))

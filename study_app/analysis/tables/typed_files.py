"""Reading files of a results folder into typed columns, or saying exactly what is wrong with one and where."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from study_app.errors import AnalysisError
from study_app.store.atomic import read_regular
from study_app.store.journals.parsing import parse_json
from study_app.store.tables.column import MISSING, Column, Kind, header
from study_app.store.tables.columns import LATER, columns_held
from study_app.store.tables.formulas import unguarded

_ARRAYS: Final[dict[str, tuple[Any, Callable[[Any, Any], Any]]]] = {
    "integer": (np.int64, pd.arrays.IntegerArray),
    "number": (np.float64, pd.arrays.FloatingArray),
    "flag": (np.bool_, pd.arrays.BooleanArray),
}
AT_ONCE: Final = 250
"""Files whose cells are held as text at the same time."""

Whole: TypeAlias = NDArray[np.int64]


def tables(paths: Sequence[Path], columns: tuple[Column, ...]) -> tuple[pd.DataFrame, Whole]:
    """Read one table of many sessions; every column typed by the dictionary, ``n/a`` as missing.

    Returns
    -------
    DataFrame, (files,) array
        The rows of all files in their order, and how many each holds.

    Raises
    ------
    AnalysisError
        A file cannot be read, or is not the table the dictionary describes: names the file, the row (1 is the first
        below the header), the column and the value.
    """
    lengths: list[int] = []
    frames: list[pd.DataFrame] = []
    for first in range(0, max(len(paths), 1), AT_ONCE):
        files = {path: rows(path, columns) for path in paths[first : first + AT_ONCE]}
        lengths += map(len, files.values())
        frames.append(_typed(files, columns))
    return pd.concat(frames, ignore_index=True), np.array(lengths, dtype=np.int64)


def rows(path: Path, columns: tuple[Column, ...]) -> list[list[str]]:
    """Read the cells of a table, whose header and row lengths must be those of the dictionary.

    Columns that the version which wrote it did not have yet, or that are sealed, hold n/a.

    Raises
    ------
    AnalysisError
        They are not, or the file cannot be read.
    """
    try:
        text = read_regular(path).decode("utf-8")
        found = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    except OSError as error:
        why = error.strerror or type(error).__name__
        raise AnalysisError(f"{path} cannot be read ({why}): {_again(path)}, or mend the permissions") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise AnalysisError(f"{path} is damaged ({error}): {_again(path)}") from error
    may_lack = LATER | {column.name for column in columns if column.sealed}
    held = columns_held(found[0] if found else (), columns, may_lack)
    names = header(held)
    if not found or tuple(found[0]) != names:
        raise AnalysisError(
            f"{path} does not begin with the columns of this table: it was changed, or written by another version of "
            f"the program (expected {', '.join(names[:4])} …, {len(names)} columns); {_again(path)}"
        )
    del found[0]
    for number, row in enumerate(found, start=1):
        if len(row) != len(names):
            raise AnalysisError(
                f"{path}, row {number}: {len(row)} cells instead of {len(names)}: the file was cut off or changed; "
                f"{_again(path)}"
            )
    if held != columns:
        at = {name: index for index, name in enumerate(names)}
        found = [[row[at[it.name]] if it.name in at else MISSING for it in columns] for row in found]
    return found


def document(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises
    ------
    AnalysisError
        It cannot be read or is none.
    """
    try:
        found = parse_json(read_regular(path))
    except OSError as error:
        raise unreadable(path, error) from error
    except ValueError as error:
        raise AnalysisError(f"{path} is damaged ({error}): restore it from a copy") from error
    if not isinstance(found, dict):
        raise AnalysisError(f"{path} is damaged (no JSON object): restore it from a copy")
    return found


def unreadable(path: Path, error: OSError) -> AnalysisError:
    """Return the error for a file that cannot be read."""
    why = error.strerror or type(error).__name__
    return AnalysisError(f"{path} cannot be read ({why}): restore it from a copy, or mend the permissions")


def _again(path: Path) -> str:
    """Say how a session's table comes to be what it was."""
    return f"make it again from the journal: liquid-study rebuild {path.parent}"


def _typed(files: Mapping[Path, list[list[str]]], columns: tuple[Column, ...]) -> pd.DataFrame:
    """Turn the cells of files into typed columns; every text that occurs is understood once."""
    columnwise = zip(*chain.from_iterable(files.values()), strict=True)
    held = {column.name: cells for column, cells in zip(columns, columnwise, strict=False)}
    typed = {}
    for column in columns:
        cells = held.get(column.name, ())
        values: dict[str, Any] = {}
        for cell in dict.fromkeys(cells):
            try:
                values[cell] = _cell(column, cell, _PARSERS[column.kind])
            except ValueError as error:
                path, number = _place(files, cells.index(cell))
                raise AnalysisError(
                    f"{path}, row {number}, column {column.name}: {cell!r} is not {_permitted(column)}; {_again(path)}"
                ) from error
        typed[column.name] = _array(column.kind, [values[cell] for cell in cells])
    return pd.DataFrame(typed)


def _array(kind: Kind, values: list[Any]) -> Any:
    """Return values, None where one is missing, as an array of pandas."""
    if kind in {"text", "time"}:
        return pd.array(values, dtype="string")
    plain, make = _ARRAYS[kind]
    missing = np.fromiter((value is None for value in values), dtype=bool, count=len(values))
    known = np.fromiter((0 if value is None else value for value in values), dtype=plain, count=len(values))
    return make(known, missing)


def _place(files: Mapping[Path, list[list[str]]], index: int) -> tuple[Path, int]:
    """Return the file of the row at ``index`` over all files, and its number there."""
    for path, found in files.items():
        if index < len(found):
            return path, index + 1
        index -= len(found)
    raise AssertionError("the row is in none of the files")


def _cell(column: Column, cell: str, parse: Callable[[str], Any]) -> Any:
    if cell == MISSING:
        if not column.may_miss:
            raise ValueError(cell)
        return None
    value = parse(cell)
    if column.minimum is not None and value < column.minimum:
        raise ValueError(cell)
    if column.maximum is not None and value > column.maximum:
        raise ValueError(cell)
    if column.levels and cell not in dict(column.levels):
        raise ValueError(cell)
    return value


def _number(cell: str) -> float:
    value = float(cell)
    if not math.isfinite(value):
        raise ValueError(cell)
    return value


def _integer(cell: str) -> int:
    value = int(cell)
    if not -(2**63) <= value < 2**63:
        raise ValueError(cell)
    return value


def _flag(cell: str) -> bool:
    if cell not in ("true", "false"):
        raise ValueError(cell)
    return cell == "true"


_PARSERS: Final[dict[str, Callable[[str], Any]]] = {
    "text": unguarded,
    "time": str,
    "integer": _integer,
    "number": _number,
    "flag": _flag,
}


def _permitted(column: Column) -> str:
    """Say in words what a cell of the column may be."""
    if column.levels:
        words = "one of " + ", ".join(level for level, _ in column.levels)
    else:
        words = {"integer": "a whole number", "number": "a number", "flag": "true or false"}.get(column.kind, "a text")
        if column.minimum is not None and column.maximum is not None:
            words += f" from {column.minimum:g} to {column.maximum:g}"
        elif column.minimum is not None:
            words += f" of at least {column.minimum:g}"
    return f"{words} or {MISSING}" if column.may_miss else words

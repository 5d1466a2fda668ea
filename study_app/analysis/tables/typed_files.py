"""Reading files of a results folder into typed columns, or saying exactly what is wrong with one and where."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from study_app.analysis.tables.table_cells import again, cells
from study_app.errors import AnalysisError
from study_app.store.atomic import read_regular
from study_app.store.journals.parsing import parse_json
from study_app.store.tables.column import MISSING, Column, Kind
from study_app.store.tables.formulas import unguarded

_ARRAYS: Final[dict[str, tuple[Any, Callable[[Any, Any], Any]]]] = {
    "integer": (np.int64, pd.arrays.IntegerArray),
    "number": (np.float64, pd.arrays.FloatingArray),
    "flag": (np.bool_, pd.arrays.BooleanArray),
}
AT_ONCE: Final = 250
"""Files whose cells are held at the same time."""

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
        files = paths[first : first + AT_ONCE]
        read, rows = cells(files, columns)
        lengths += rows
        frames.append(_typed(read, columns, files, rows))
    return pd.concat(frames, ignore_index=True), np.array(lengths, dtype=np.int64)


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
    return AnalysisError(f"{path} cannot be read ({why}): restore it from a copy, or correct its permissions")


def _typed(cells: Any, columns: tuple[Column, ...], paths: Sequence[Path], lengths: Sequence[int]) -> pd.DataFrame:
    """Turn the cells of files into typed columns; every text that occurs is understood once."""
    typed = {}
    for column in columns:
        texts = cells[column.name].combine_chunks()
        which = texts.indices.to_numpy()
        values: list[Any] = []
        for number, cell in enumerate(texts.dictionary.to_pylist()):
            try:
                values.append(_cell(column, cell, _PARSERS[column.kind]))
            except ValueError as error:
                path, row = _place(paths, lengths, int(np.flatnonzero(which == number)[0]))
                raise AnalysisError(
                    f"{path}, row {row}, column {column.name}: {cell!r} is not {_permitted(column)}; {again(path)}"
                ) from error
        typed[column.name] = _array(column.kind, values, which)
    return pd.DataFrame(typed)


def _array(kind: Kind, values: list[Any], which: Whole) -> Any:
    """Return ``values[which]``, None where one is missing, as an array of pandas."""
    if kind in {"text", "time"}:
        return pd.array(np.array(values, dtype=object)[which], dtype="string")
    plain, make = _ARRAYS[kind]
    missing = np.array([value is None for value in values], dtype=bool)
    known = np.array([0 if value is None else value for value in values], dtype=plain)
    return make(known[which], missing[which])


def _place(paths: Sequence[Path], lengths: Sequence[int], index: int) -> tuple[Path, int]:
    """Return the file of the row at ``index`` over all files, and its number there."""
    for path, length in zip(paths, lengths, strict=True):
        if index < length:
            return path, index + 1
        index -= length
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

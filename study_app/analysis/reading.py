"""Reading one file of a results folder into typed columns, or saying exactly what is wrong with it and where."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import pandas as pd

from study_app.errors import AnalysisError
from study_app.store.columns import MISSING, Column, header

_TYPES: Final = {"text": "string", "time": "string", "integer": "Int64", "number": "Float64", "flag": "boolean"}


def table(path: Path, columns: tuple[Column, ...]) -> pd.DataFrame:
    """Read a table; every column typed by the dictionary, ``n/a`` as missing.

    Raises
    ------
    AnalysisError
        The file cannot be read, or is not the table the dictionary describes: names the file, the row (1 is the first
        below the header), the column and the value.
    """
    try:
        text = path.read_bytes().decode("utf-8")
        rows = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    except OSError as error:
        why = error.strerror or type(error).__name__
        raise AnalysisError(f"{path} cannot be read ({why}): {_again(path)}, or mend the permissions") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise AnalysisError(f"{path} is damaged ({error}): {_again(path)}") from error
    names = header(columns)
    if not rows or tuple(rows[0]) != names:
        raise AnalysisError(
            f"{path} does not begin with the columns of this table: it was changed, or written by another version of "
            f"the program (expected {', '.join(names[:4])} …, {len(names)} columns); {_again(path)}"
        )
    for number, row in enumerate(rows[1:], start=1):
        if len(row) != len(names):
            raise AnalysisError(
                f"{path}, row {number}: {len(row)} cells instead of {len(names)}: the file was cut off or changed; "
                f"{_again(path)}"
            )
    cells = zip(*rows[1:], strict=True) if len(rows) > 1 else ([] for _ in names)
    return pd.DataFrame(
        {column.name: _typed(path, column, values) for column, values in zip(columns, cells, strict=True)}
    )


def document(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises
    ------
    AnalysisError
        It cannot be read or is none.
    """
    try:
        found = json.loads(path.read_bytes())
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


def _typed(path: Path, column: Column, cells: Sequence[str]) -> pd.Series[Any]:
    parse = _PARSERS[column.kind]
    values = []
    for number, cell in enumerate(cells, start=1):
        try:
            values.append(_cell(column, cell, parse))
        except ValueError as error:
            raise AnalysisError(
                f"{path}, row {number}, column {column.name}: {cell!r} is not {_permitted(column)}; {_again(path)}"
            ) from error
    return pd.Series(values, dtype=_TYPES[column.kind], name=column.name)


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


def _flag(cell: str) -> bool:
    if cell not in ("true", "false"):
        raise ValueError(cell)
    return cell == "true"


_PARSERS: Final[dict[str, Callable[[str], Any]]] = {
    "text": str,
    "time": str,
    "integer": int,
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

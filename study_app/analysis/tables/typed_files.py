"""Reading files of a results folder into typed columns, or saying exactly what is wrong with one and where."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from study_app.errors import AnalysisError
from study_app.store.atomic import parse_json, read_regular
from study_app.store.tables.csv_files import MISSING, Column, cells, header

DTYPES: Final[dict[str, Any]] = {
    "text": "string",
    "time": "string",
    "integer": "Int64",
    "number": "Float64",
    "flag": "boolean",
}

Whole: TypeAlias = NDArray[np.int64]


def tables(paths: Sequence[Path], columns: tuple[Column, ...]) -> tuple[pd.DataFrame, Whole]:
    """Read one table of many sessions; every column typed by the dictionary, ``n/a`` as missing.

    Returns
    -------
    DataFrame, (files,) array
        The rows of all files in their order, and how many each holds. Columns that the version which wrote a file did
        not have yet, or that are sealed, are missing.

    Raises
    ------
    AnalysisError
        A file cannot be read, or is not the table the dictionary describes: names the file, the row (1 is the
        header), the column and the value.
    """
    values: dict[str, list[Any]] = {column.name: [] for column in columns}
    known: dict[str, dict[str, Any]] = {column.name: {} for column in columns}
    lengths = []
    for path in paths:
        texts, rows = _texts(path, columns)
        lengths.append(rows)
        for column in columns:
            of_file = texts.get(column.name, [MISSING] * rows)
            values[column.name] += _values(column, of_file, known[column.name], path)
    typed = {column.name: pd.array(values[column.name], dtype=DTYPES[column.kind]) for column in columns}
    return pd.DataFrame(typed), np.array(lengths, dtype=np.int64)


def _texts(path: Path, columns: tuple[Column, ...]) -> tuple[Mapping[str, Sequence[str]], int]:
    """Return the cells of a file by column, and how many rows it has."""
    try:
        names, *rows = cells(read_regular(path))
    except OSError as error:
        raise unreadable(path, error, _again(path)) from error
    except ValueError as error:
        raise AnalysisError(f"{path} {error}: it was cut off or changed; {_again(path)}") from error
    held = tuple(column for column in columns if column.name in names or not (column.later or column.sealed))
    if tuple(names) != header(held):
        raise AnalysisError(
            f"{path} does not begin with the columns of this table: it was changed, or written by another version of "
            f"the program (expected {', '.join(header(held)[:4])} …, {len(held)} columns); {_again(path)}"
        )
    return (dict(zip(names, zip(*rows, strict=True), strict=True)) if rows else {}), len(rows)


def _values(column: Column, texts: Sequence[str], known: dict[str, Any], path: Path) -> list[Any]:
    """Return the values of a column in a file; ``known`` keeps the value of each text of all files."""
    for text in dict.fromkeys(texts):
        try:
            if text not in known:
                known[text] = None if text == MISSING and column.sealed else column.value(text)
        except ValueError as error:
            row = texts.index(text) + 2
            raise AnalysisError(f"{path}, row {row}, column {column.name}: {error}; {_again(path)}") from error
    return [known[text] for text in texts]


def _again(path: Path) -> str:
    return f"make it again from the journal: liquid-study rebuild {path.parent}"


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


def unreadable(path: Path, error: OSError, remedy: str = "restore it from a copy") -> AnalysisError:
    """Return the error for a file that cannot be read."""
    return AnalysisError(
        f"{path} cannot be read ({error.strerror or type(error).__name__}): {remedy}, or correct its permissions"
    )

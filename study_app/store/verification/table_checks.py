"""Whether a table holds what the column dictionary says: header, kinds, ranges, levels."""

import csv
import io
import math
import re
from collections.abc import Callable, Iterator, Sequence
from functools import cache

from study_app.store.tables.cells import cell_pattern
from study_app.store.tables.column import MISSING, Column, header

Check = Callable[[str], bool]


def problems(content: bytes, columns: Sequence[Column]) -> Iterator[str]:
    """Yield what is wrong with a table, a sentence each; a column's first bad cell stands for all of them."""
    try:
        names, *rows = list(csv.reader(io.StringIO(content.decode("utf-8"), newline=""), strict=True)) or [[]]
    except (UnicodeDecodeError, csv.Error) as error:
        yield f"is not CSV in UTF-8 ({error})"
        return
    if tuple(names) != header(tuple(columns)):
        yield from _header_problems(names, columns)
        return
    for number, row in enumerate(rows, start=2):
        if len(row) != len(names):
            yield f"row {number} has {len(row)} cells, not {len(names)}"
            return
    for index, column in enumerate(columns):
        is_right = _check(column)
        bad = next((number for number, row in enumerate(rows, start=2) if not is_right(row[index])), None)
        if bad is not None:
            yield f"row {bad}, {column.name}: {_short(rows[bad - 2][index])} is not {_expected(column)}"


def _header_problems(names: list[str], columns: Sequence[Column]) -> Iterator[str]:
    expected = header(tuple(columns))
    missing, unknown = [n for n in expected if n not in names], [n for n in names if n not in expected]
    if missing:
        yield f"columns are missing: {', '.join(missing)}"
    if unknown:
        yield f"columns are unknown: {', '.join(unknown)}"
    if not missing and not unknown:
        yield "columns are in another order or duplicated"


@cache
def _check(column: Column) -> Check:
    """Return the test of a column's cells."""
    pattern = re.compile(cell_pattern(column))
    low = -math.inf if column.minimum is None else column.minimum
    high = math.inf if column.maximum is None else column.maximum
    bounded = column.kind in ("integer", "number") and not (math.isinf(low) and math.isinf(high))

    def is_right(cell: str) -> bool:
        if pattern.fullmatch(cell) is None:
            return False
        return not bounded or cell == MISSING or low <= float(cell) <= high

    return is_right


def _expected(column: Column) -> str:
    if column.levels:
        words = "one of " + ", ".join(level for level, _ in column.levels)
    else:
        words = {"integer": "a whole number", "flag": "true or false", "time": "a time with zone"}.get(
            column.kind, f"a {column.kind}"
        )
    if column.minimum is not None and column.maximum is not None:
        words += f" from {column.minimum:g} to {column.maximum:g}"
    elif column.minimum is not None:
        words += f" of at least {column.minimum:g}"
    return words + (f" or {MISSING}" if column.may_miss else "")


def _short(cell: str) -> str:
    return repr(cell if len(cell) <= 40 else f"{cell[:39]}…")

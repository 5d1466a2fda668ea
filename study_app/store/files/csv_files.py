"""Tables as CSV: their columns, the values of their cells, and the files.

Files are UTF-8 with commas, RFC 4180 quoting and one line feed per record. Missing values are ``n/a``. Numbers have
full precision. A text that a spreadsheet would evaluate is preceded by an apostrophe, so that it is shown unchanged
(OWASP, "CSV Injection"). Numbers are exempt, so that a negative number stays a number.
"""

import csv
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, TypeAlias

import numpy as np

from study_app.errors import StudyError
from study_app.store.files.atomic import write_file

COMPUTED: Final = "= + - @"
_FORMULA = re.compile("'*[=+\\-@\t\r＝＋－＠]")
Kind: TypeAlias = Literal["text", "integer", "number", "flag", "time"]
MISSING = "n/a"
Row: TypeAlias = dict[str, Any]


def guard_formula(text: str) -> str:
    """Return a cell's text, preceded by an apostrophe if a spreadsheet would evaluate it as a formula."""
    return f"'{text}" if _FORMULA.match(text) else text


def unguard_formula(cell: str) -> str:
    """Return a cell's text without the apostrophe that `guard_formula` added."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


class _CellFormat(NamedTuple):
    description: str
    pattern: str
    read: Callable[[str], Any]


def _parse_number(cell: str) -> float:
    """Return a cell's number, as int if it has no fraction, so that it is written back exactly as it was read."""
    return int(cell) if re.fullmatch("-?[0-9]{1,15}", cell) else float(cell)


_KINDS: Final[dict[Kind, _CellFormat]] = {
    "text": _CellFormat("a text", r"[\s\S]*", unguard_formula),
    "integer": _CellFormat("a whole number", r"-?[0-9]{1,18}", int),
    "number": _CellFormat("a number", r"-?[0-9]+(\.[0-9]+)?(e[+-]?[0-9]+)?", _parse_number),
    "flag": _CellFormat("true or false", "true|false", "true".__eq__),
    "time": _CellFormat(
        "a time with a time zone", r"[0-9]{4}(-[0-9]{2}){2}T[0-9]{2}(:[0-9]{2}){2}\.[0-9]{3}[+-][0-9]{2}:[0-9]{2}", str
    ),
}


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its name, the kind of its cells, and their meaning.

    ``kind``: flags are ``true`` or ``false``, times ISO 8601 with zone. ``levels`` are all permitted values, if they
    are few, each with its meaning. With ``may_miss``, a cell can be ``n/a``. A ``sealed`` column can reveal the
    condition, and tables omit it until the study's key is opened. ``of_trial`` tells how a trial's value is computed
    from its intervals.
    """

    name: str
    kind: Kind
    description: str
    _: KW_ONLY
    unit: str = ""
    levels: tuple[tuple[str, str], ...] = ()
    minimum: float | None = None
    maximum: float | None = None
    may_miss: bool = False
    sealed: bool = False
    of_trial: Literal["sum", "max", "mean"] = "sum"

    def value(self, cell: str) -> Any:
        """Return the value of a cell, or None for a missing value.

        Raises
        ------
        ValueError
            The column does not permit this cell.
        """
        if cell == MISSING and self.may_miss:
            return None
        if re.fullmatch(self.pattern, cell):
            value = _KINDS[self.kind].read(cell)
            low, high = (-math.inf if self.minimum is None else self.minimum), self.maximum
            is_numeric = self.kind in {"integer", "number"}
            if not is_numeric or (low <= value <= (math.inf if high is None else high) and math.isfinite(value)):
                return value
        raise ValueError(f"{(cell if len(cell) <= 40 else cell[:39] + '…')!r} is not {self.permitted}")

    @property
    def pattern(self) -> str:
        """The regular expression of a cell that is not missing."""
        return "|".join(level for level, _ in self.levels) or _KINDS[self.kind].pattern

    @property
    def permitted(self) -> str:
        """The permitted values, as a phrase for messages."""
        levels = ", ".join(level for level, _ in self.levels)
        text = f"one of {levels}" if levels else _KINDS[self.kind].description
        if self.maximum is not None:
            text += f" from {self.minimum:g} to {self.maximum:g}"
        elif self.minimum is not None:
            text += f" of at least {self.minimum:g}"
        return f"{text} or {MISSING}" if self.may_miss else text

    @property
    def variable(self) -> dict[str, Any]:
        """The column as a schema.org PropertyValue."""
        meanings = "; ".join(f"{level}: {meaning}" for level, meaning in self.levels)
        entry = {
            "@type": "PropertyValue",
            "name": self.name,
            "description": f"{self.description} Levels: {meanings}." if meanings else self.description,
        }
        optional_entries = {"unitText": self.unit or None, "minValue": self.minimum, "maxValue": self.maximum}
        return entry | {name: value for name, value in optional_entries.items() if value is not None}


optional = partial(Column, may_miss=True)
"""A column in which a cell can be ``n/a``."""


def unsealed_columns(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Return the columns that are not sealed."""
    return tuple(column for column in columns if not column.sealed)


def header(columns: tuple[Column, ...]) -> tuple[str, ...]:
    """Return the column names in file order."""
    return tuple(column.name for column in columns)


def csv_bytes(columns: Sequence[Column], rows: Iterable[Mapping[str, Any]]) -> bytes:
    """Return a table as CSV in UTF-8; a lone surrogate, which UTF-8 cannot encode, becomes a question mark."""
    names = header(tuple(columns))
    lines = [",".join(names), *(",".join([_cell_text(row[name]) for name in names]) for row in rows), ""]
    return "\n".join(lines).encode("utf-8", "replace")


def _cell_text(value: Any) -> str:
    """Return a cell as text in a table."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return MISSING
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, int | float) else _quote_cell(guard_formula(str(value)))


def _quote_cell(text: str) -> str:
    if "," in text or '"' in text or "\n" in text or "\r" in text or text != text.strip():
        return '"' + text.replace('"', '""') + '"'
    return text


def read_cells(table: bytes) -> list[list[str]]:
    """Return the records of a table as texts, the header first.

    Raises
    ------
    ValueError
        The table is not CSV in UTF-8, or its records differ in length.
    """
    try:
        rows = list(csv.reader(io.StringIO(table.decode("utf-8"), newline=""), strict=True)) or [[]]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"is not a valid UTF-8 CSV file ({error})") from error
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(rows[0]):
            raise ValueError(f"row {number} has {len(row)} cells, not {len(rows[0])}")
    return rows


def read_table(table: bytes, columns: Sequence[Column]) -> list[Row]:
    """Return the rows of a table written by `csv_bytes`, with the given columns; missing values are None."""
    names, *rows = read_cells(table)
    indices = [(column, names.index(column.name)) for column in columns]
    return [
        {column.name: None if row[at] == MISSING else column.value(row[at]) for column, at in indices} for row in rows
    ]


def table_problems(table: bytes, columns: Sequence[Column]) -> Iterator[str]:
    """Yield a sentence on each problem of a table, but only the first invalid cell of each column."""
    expected = header(tuple(columns))
    try:
        names, *rows = read_cells(table)
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
            yield "columns are in a different order or duplicated"
        return
    for column, texts in zip(columns, zip(*rows, strict=True), strict=True) if rows else ():
        for text in dict.fromkeys(texts):
            try:
                column.value(text)
            except ValueError as error:
                yield f"row {texts.index(text) + 2}, {column.name}: {error}"
                break


def has_same_cells(held: bytes, table: bytes) -> bool:
    """Return whether ``table`` has the columns of the table ``held`` with the same cells.

    Cells that a spreadsheet would evaluate may lack the apostrophe of `guard_formula`, as in tables of 0.1.
    """
    try:
        (held_names, *held_rows), (names, *rows) = read_cells(held), read_cells(table)
    except ValueError:
        return False
    if not set(held_names) <= set(names):
        return False
    indices = [names.index(name) for name in held_names]
    return [[unguard_formula(row[index]) for index in indices] for row in rows] == [
        [unguard_formula(cell) for cell in row] for row in held_rows
    ]


def write_columns(path: Path, table: np.recarray[Any, Any]) -> None:
    """Write a table of named columns as CSV in full precision, atomically.

    Raises
    ------
    StudyError
        A number is not finite, or the file cannot be written; an existing file is untouched.
    """
    names = table.dtype.names or ()
    for name in names:
        if not (finite := np.isfinite(table[name])).all():
            row = int(np.argmin(finite))
            raise StudyError(
                f"{path} was not written, because {name} is {table[name][row]} in row {row + 1}; it must be finite: "
                "use smaller positions, speeds or parameter values"
            )
    write_file(path, csv_text_of([names, *zip(*(table[name].tolist() for name in names), strict=True)]).encode())


def csv_text_of(rows: Iterable[Iterable[Any]]) -> str:
    """Return rows of cells, the header first, as CSV text with commas and line feeds."""
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()

"""Tables of numbers that people and instruments write as text: their encoding, separator, fields and decimal sign.

A table is read if this can be done in one way. Columns are separated by commas, semicolons or tabs; a decimal comma is
read if no number has a decimal point. Everything else is refused with the first line that has it.
"""

import codecs
import csv
import io
import math
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Final, NamedTuple

from study_app.number_text import counted, readings_of, unclear_number

SHOWN: Final = 200  # characters of a bad value shown in messages
_SEPARATORS: Final = (",", ";", "\t")
_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_UTF_16: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


class Line(NamedTuple):
    """The fields of a row, and the line number in the file at which it begins (from 1)."""

    number: int
    fields: tuple[str, ...]


class TextTable(NamedTuple):
    """The names of the columns, and the rows that are not completely empty."""

    names: tuple[str, ...]
    lines: tuple[Line, ...]


def decoded(content: bytes, first_line: int = 1) -> str:
    """Decode a UTF-8 text without its byte order mark; ``first_line`` is the number of its first line in the file.

    Raises
    ------
    ValueError
        The content has another encoding.
    """
    if content.startswith(_UTF_16) or b"\0" in content:
        raise ValueError("it is not UTF-8 text but seems to be UTF-16: save it as CSV in UTF-8")
    try:
        return content.removeprefix(codecs.BOM_UTF8).decode("utf-8")
    except UnicodeDecodeError as error:
        line = first_line + content.count(b"\n", 0, error.start)
        raise ValueError(f"it is not UTF-8 text in line {line}: save it as CSV in UTF-8") from error


def separator_of(header: str, names: Collection[str]) -> str:
    """Return the separator that gives a header most of these names; the comma in a tie."""
    return max(_SEPARATORS, key=lambda separator: len({*_fields_of(header, separator)} & {*names}))


def _names_of(header: str, separator: str) -> tuple[str, ...]:
    """Return the names in a header, without empty columns at its end."""
    names = _fields_of(header, separator)
    while names and not names[-1]:
        names = names[:-1]
    return names


def _fields_of(line: str, separator: str) -> tuple[str, ...]:
    """Return the fields of one line, without spaces around them."""
    return tuple(field.strip() for field in next(csv.reader([line], delimiter=separator), []))


def split(text: str, names: Collection[str], *, comment: str = "") -> TextTable:
    """Return the rows of a table; the permitted column names determine the separator.

    Lines that begin with ``comment`` are ignored.

    Raises
    ------
    ValueError
        A quotation mark is not closed, or is within a field.
    """
    kept = ["\n" if comment and line.startswith(comment) else line for line in io.StringIO(text, newline="")]
    header = next((line for line in kept if line.strip()), "")
    separator = separator_of(header, names)
    reader = csv.reader(kept, delimiter=separator, strict=True)
    lines: list[Line] = []
    begin = 1
    try:
        for row in reader:
            if any(fields := tuple(field.strip() for field in row)):
                lines.append(Line(begin, fields))
            begin = reader.line_num + 1
    except csv.Error as error:
        raise ValueError(f"line {begin} is not valid CSV ({error})") from error
    return TextTable(_names_of(header, separator), tuple(lines[1:]))


def wrong_length(fields: Sequence[str], columns: int) -> str:
    """Return what is wrong with a row's number of fields, or ""; empty fields at its end are ignored."""
    if len(fields) < columns:
        return f"has {counted(len(fields), 'field')}, fewer than the {columns} in the header"
    if any(fields[columns:]):
        hint = "write decimal points" if len(fields) == 2 * columns else "remove the extra fields or add column names"
        return f"has {len(fields)} fields, more than the {columns} in the header: {hint}"
    return ""


def decimal_sign_of(lines: Iterable[Line], places: Collection[int]) -> str:
    """Return the decimal sign of the numbers in these columns.

    Raises
    ------
    ValueError
        There are decimal commas and points, or only commas that could separate thousands.
    """
    fields = [(line.number, field) for line in lines for field in _at(line.fields, places)]
    commas = [(number, field) for number, field in fields if "," in field and readings_of(field)]
    if not commas:
        return "."
    for number, field in fields:
        if "." in field and readings_of(field):
            other, comma = commas[0]
            raise ValueError(
                f"line {number}: {_shown(field)} has a decimal point, but {_shown(comma)} in line {other} has a "
                "decimal comma"
            )
    if all(len(readings_of(field)) == 2 for _, field in commas):
        number, field = commas[0]
        raise ValueError(f"line {number}: {unclear_number(field)}")
    return ","


def number_in(field: str, decimal_sign: str = ".") -> float | None:
    """Return the finite number in a field, or None."""
    plain = field.replace(decimal_sign, ".")
    if _NUMBER.fullmatch(plain) is None:
        return None
    return value if math.isfinite(value := float(plain)) else None


def _numbers_at(line: Line, places: Sequence[int], columns: int, decimal_sign: str = ".") -> list[float]:
    """Return the numbers of a row at these places.

    Raises
    ------
    ValueError
        The number of fields differs from ``columns``, or one of these fields is not a finite number.
    """
    if wrong := wrong_length(line.fields, columns):
        raise ValueError(f"line {line.number}: {wrong}")
    numbers = []
    for field in _at(line.fields, places):
        if (number := number_in(field, decimal_sign)) is None:
            hint = "write a decimal point" if "," in field else "correct it or remove the row"
            raise ValueError(f"line {line.number}: {_shown(field)} is not a finite number; {hint}")
        numbers.append(number)
    return numbers


def rows_of(table: TextTable, places: Sequence[int]) -> list[list[float]]:
    """Return the numbers of all rows at these places.

    Raises
    ------
    ValueError
        A row is invalid (the first one is named), or the decimal sign is ambiguous.
    """
    columns, sign = len(table.names), "."
    for line in table.lines:
        if wrong := wrong_length(line.fields, columns):
            raise ValueError(f"line {line.number}: {wrong}")
    if table.lines:
        first = table.lines[0]
        if not any(map(readings_of, _at(first.fields, places))):
            texts = ", ".join(map(_shown, _at(first.fields, places)))
            raise ValueError(
                f"line {first.number} does not contain a number ({texts}): if it is a row of units, remove it and use "
                "SI units"
            )
        sign = decimal_sign_of(table.lines, places)
    return [_numbers_at(line, places, columns, sign) for line in table.lines]


def _at(fields: Sequence[str], places: Iterable[int]) -> Iterator[str]:
    return (fields[place] for place in places)


def _shown(field: str) -> str:
    return repr(field[:SHOWN])

"""Values and outputs of the program as lines of text, for golden files."""

import csv
import html
import io
import json
import re
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import MISSING, fields, is_dataclass
from difflib import SequenceMatcher
from typing import Any

import numpy as np

from tests.golden import CHANGING, NUMBER

WIDTH = 120
"""Most characters of a line that holds a value with parts."""
MOST = 16
"""Most numbers of an array that are listed; of more the count, the ends and two sums are."""
RECORDS = 4
"""Fewest records of a list that are written as the columns of a table."""
CELLS = 12
"""Most cells of a column that are listed; of more the first and last ones and what all add up to are."""
NOTHING = {"n/a", "", "None"}
"""Cells without a value."""


def number(value: float, digits: int = 7, decimals: int = 14) -> str:
    """Return a number as text; 1e-15 and -0 become 0."""
    return f"{round(float(value), decimals) + 0.0:.{digits}g}"


def numbers(values: Any, digits: int = 5, decimals: int = 7) -> str:
    """Return numbers as text; of more than ``MOST``: count, range, sum and sum weighted by index."""
    flat = np.ma.filled(np.ma.asarray(values, float), np.nan).ravel()
    if len(flat) > MOST:
        known = np.nan_to_num(flat)
        flat = [len(flat), known.min(), known.max(), known.sum(), known @ np.arange(len(known)) / len(known)]
    return " ".join(number(value, digits, decimals) for value in flat)


def parts_of(value: Any) -> dict[str, Any] | None:
    """Return the parts of a mapping or record; of a dataclass, named tuple or model, those that are not defaults."""
    if isinstance(value, Mapping):
        return {str(name): part for name, part in value.items()}
    if isinstance(value, np.ndarray | np.void) and value.dtype.names and value.shape in ((), (1,)):
        return {name: value.reshape(())[name][()] for name in value.dtype.names}
    if is_dataclass(value) and not isinstance(value, type):
        defaults: dict[str, Any] = {field.name: field.default for field in fields(value)}
    elif hasattr(value, "_asdict"):
        defaults = dict.fromkeys(value._fields, MISSING) | value._field_defaults
    elif hasattr(type(value), "model_fields"):
        defaults = {name: field.default for name, field in type(value).model_fields.items()}
    else:
        return None
    parts = {name: getattr(value, name) for name in defaults}
    return {name: part for name, part in parts.items() if not _equal(part, defaults[name])}


def _equal(value: Any, default: Any) -> bool:
    return value is default or (default is not MISSING and type(value) is type(default) and bool(value == default))


def one_line(value: Any) -> str:
    """Return a value in one line: numbers with 7 digits, paths joined with dots, neither defaults nor addresses."""
    parts = parts_of(value)
    if parts is not None:
        inner = ", ".join(f"{name}: {one_line(part)}" for name, part in parts.items())
        return f"{type(value).__name__}({inner})" if _is_typed(value) else f"{{{inner}}}"
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    match value:
        case float():
            return number(value)
        case tuple() if value and isinstance(value[0], str) and all(map(_is_step, value)):
            return ".".join(map(str, value))
        case tuple() | list():
            if len(value) > MOST and all(isinstance(item, int | float) for item in value):
                return f"[{numbers(value, 7, 14)}]"
            return f"[{', '.join(map(one_line, value))}]"
        case Set():
            return f"{{{', '.join(sorted(map(one_line, value)))}}}"
    return re.sub(r" at 0x\w+", "", repr(value)).replace("\n", " / ")


def _is_typed(value: Any) -> bool:
    return not isinstance(value, Mapping | np.ndarray | np.void)


def _is_step(value: Any) -> bool:
    return isinstance(value, int) or (isinstance(value, str) and re.fullmatch(r"[\w-]+", value) is not None)


def value_lines(value: Any, name: str = "", depth: int = 0) -> Iterator[str]:
    """Yield a value in one line if it is short, otherwise its parts, indented; plain parts of a mapping in one line.

    Mappings of a list are written as a table if they are many.
    """
    line, below, parts = one_line(value), list[tuple[str, Any]](), parts_of(value)
    is_table = False
    if len(line) > WIDTH and _is_nested(value):
        if parts is None:
            line, below = "", [("", item) for item in value]
            is_table = len(value) >= RECORDS and all(isinstance(item, Mapping) for item in value)
        elif _is_typed(value):
            line, below = type(value).__name__, list(parts.items())
        else:
            below = [(key, part) for key, part in parts.items() if _is_nested(part)]
            plain = {key: part for key, part in parts.items() if not _is_nested(part)}
            line = one_line(plain) if plain else ""
    if head := ": ".join(filter(None, (name, line))):
        yield "  " * depth + head
    depth += bool(head)
    if is_table:
        yield from (f"{'  ' * depth}{head}: {column}" for head, column in _columns(value))
    else:
        for key, part in below:
            yield from value_lines(part, key, depth)


def _columns(records: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    rows = [_flat(record) for record in records]
    for key in dict.fromkeys(key for row in rows for key in row):
        yield key, _column([CHANGING.sub("*", row.get(key, "")) for row in rows])


def _flat(value: Mapping[str, Any], place: str = "") -> dict[str, str]:
    """Return the plain parts of a mapping by their place in it."""
    parts: dict[str, str] = {}
    for key, part in value.items():
        parts |= _flat(part, f"{place}{key}.") if isinstance(part, Mapping) else {f"{place}{key}": one_line(part)}
    return parts


def _is_nested(value: Any) -> bool:
    return parts_of(value) not in (None, {}) or (isinstance(value, tuple | list) and any(map(_is_nested, value)))


def changed(before: Sequence[str], after: Sequence[str], *, numbered: bool = False) -> Iterator[str]:
    """Yield new lines, and of each block of removed lines the first 60 characters and the number of others.

    Where it matters at which place a line comes, ``numbered`` adds its number.
    """
    for how, start, end, first, last in SequenceMatcher(None, before, after).get_opcodes():
        at = f"{first + 1}" if numbered else ""
        if how != "equal" and end > start:
            more = f" … {end - start - 1} more" if end - start > 1 else ""
            yield f"-{at} {before[start][:60]}{more}"
        if how != "equal":
            yield from (f"+{at} {line}" for line in after[first:last])


def page_lines(text: str) -> Iterator[str]:
    """Yield a page's headings, paragraphs and rows of tables, without style and pictures."""
    body = re.sub(r"<style.*?</style>|<svg.*?</svg>|<img[^>]*>", "", text, flags=re.S)
    for row in re.split(r"</?(?:tr|p|h\d|li|div|section|title|summary|details|caption|figcaption)\b[^>]*>", body):
        cells = [re.sub(r"<[^>]+>|\s+", " ", cell).strip() for cell in re.split(r"</t[dh]>", row)]
        if any(cells):
            yield html.unescape(" | ".join(cells).strip(" |"))


def table_lines(text: str) -> Iterator[str]:
    """Yield the columns of a table without dates, versions and hashes; those that are empty are left out."""
    for head, *cells in zip(*csv.reader(io.StringIO(CHANGING.sub("*", text))), strict=True):
        if not NOTHING.issuperset(cells):
            yield f"{head}: {_column(cells)}"


def _column(cells: Sequence[str]) -> str:
    """Return a column in one line: a constant cell, few cells, or some with numbers that reveal other changes.

    Of numbers that are the count, ends, sum, sum by place, and sum of logarithms, which a small one changes as well.
    """
    kinds = Counter(cells)
    if len(kinds) == 1:
        return f"{cells[0]} (all {len(cells)})"
    if len(cells) <= CELLS:
        return " | ".join(cells)
    if len(kinds) <= CELLS // 2:
        distinct_cells = sorted(kinds)
        order = _digest(" ".join(str(distinct_cells.index(cell)) for cell in cells))
        rest = f"{', '.join(f'{kinds[cell]} times {cell}' for cell in distinct_cells)}, in order {order}"
    else:
        values = np.array([text for cell in cells for text in NUMBER.findall(cell)], float)
        rest = f"{numbers(values, 7)} {number(np.log(np.abs(values[values != 0])).sum())}"
        if any(NUMBER.sub("", cell) for cell in cells if cell not in NOTHING):
            rest += f" and {_digest(NUMBER.sub('', ' '.join(cells)))}"
    return f"{' | '.join(cells[: CELLS // 3])} | … | {cells[-1]} ({len(cells)}: {rest})"


def _digest(text: str) -> str:
    """Return a short digest of a text."""
    return f"{zlib.crc32(text.encode()):08x}".translate(str.maketrans("0123456789", "ghijklmnop"))


def file_lines(name: str, content: bytes) -> Iterator[str]:
    """Yield the texts, cells and values of an output."""
    text = content.decode()
    match name.rpartition(".")[2]:
        case "html":
            yield from page_lines(text)
        case "json":
            yield from value_lines(json.loads(text))
        case "csv":
            yield from table_lines(text)
        case _:
            yield from text.splitlines()

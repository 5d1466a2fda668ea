"""A series of elements: copies of one that differ in one number, each with that number in its id and title."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from study_app.designer.document.additions import duplicated
from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import Row, refused_at, row_at, rows, why_not
from study_app.designer.document.names import references_to
from study_app.designer.document.writer.edits import Edit, Insert, Set
from study_app.designer.document.writer.refused import Refused
from study_app.ids import MAX_ID, free_id
from study_app.number_text import MINUS, exact_text, number_of
from study_app.protocol.source.document import Path, names, value_at

MOST: Final = 24
"""Greatest number of values of a series; code letters end at Z."""
NUMBERS: Final = frozenset({"number", "whole number"})
"""Kinds of rows with one number."""
_DEEPEST: Final = 2


def number_rows(document: Mapping[str, Any], path: Path) -> tuple[Row, ...]:
    """Return the numbers of an element of which there can be a series, in the order of its form.

    Pages differ only in their texts, so there is no series of them.
    """
    section = row_at(document, path[:1])
    if len(path) != 2 or path[0] == "pages" or section is None or section.kind != "tables":
        return ()
    return tuple(_numbers(document, path, _DEEPEST)) if isinstance(value_at(document, path), Mapping) else ()


def _numbers(document: Mapping[str, Any], path: Path, deepest: int) -> Iterator[Row]:
    refused = refused_at(document, path)
    below: list[Path] = []
    for row in rows(document, path):
        if row.kind == "table" and isinstance(row.value, Mapping) and deepest > 1:
            below.append(row.path)
        elif row.kind in NUMBERS and (row.value is not None or row.path[-1] not in refused):
            known = isinstance(row.value, int | float) and not isinstance(row.value, bool)
            yield row if known else replace(row, value=None)
    for inner in below:
        yield from _numbers(document, inner, deepest - 1)


def number_row(document: Mapping[str, Any], path: Path, field: Path) -> Row:
    """Return the number of an element that differs in a series.

    Raises
    ------
    Refused
        It is not a number of the element.
    """
    found = next((row for row in number_rows(document, path) if row.path == field), None)
    if found is None:
        raise Refused("choose a number of this element")
    return found


def check_values(document: Mapping[str, Any], row: Row, values: Sequence[float]) -> None:
    """Refuse values that copies of an element cannot have.

    Raises
    ------
    Refused
        A value is not permitted, is there twice or is the element's own, or there are none or more than `MOST`.
    """
    known = [row.value]
    for value in values:
        if why := why_not(document, row, value):
            raise Refused(f"{exact_text(value)} is not permitted: {row.label} is {why}")
        if value in known:
            raise Refused(f"{exact_text(value)} is there twice, or is the value of the original")
        known.append(value)
    if not 0 < len(values) <= MOST:
        raise Refused(f"a series has 1 to {MOST} copies")


def copy_with(study: Study, path: Path, row: Row, value: float) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy an element with another number in its id and titles, and the path of the copy."""
    word = _word(value)
    stem = str(path[1]).removesuffix("" if row.value is None else f"_{_word(row.value)}")
    name = f"{stem[: MAX_ID - len(word) - 1]}_{word}"
    edits, copy = duplicated(study, path, free_id(names(study.document, str(path[0])), name))
    titles = (Set((*copy, *place), text) for place, text in titles_with(study.document, path, row, value))
    return (*edits, Set((*copy, *row.path[2:]), value), *titles), copy


def listings(study: Study, path: Path, copy: Path) -> Iterator[Edit]:
    """Yield the edits that list a copy after its original, in each block that lists the original."""
    for place in references_to(study.document, path):
        if place[0] == "blocks" and isinstance(place[-1], int):
            yield Insert((*place[:-1], place[-1] + 1), copy[1])


def titles_with(document: Mapping[str, Any], path: Path, row: Row, value: float) -> Iterator[tuple[Path, str]]:
    """Yield the titles of a copy below it: the element's number at their end is replaced, else the new one added."""
    number = re.compile(rf"(?:(?<!\w)[-{MINUS}])?\d+(?:[.,]\d+)?(?=\s*(?:{re.escape(row.unit)})?\s*$)")
    title = value_at(document, (*path, "title"))
    for language, text in title.items() if isinstance(title, Mapping) else (("", title),):
        if isinstance(text, str) and text.strip():
            last = number.search(text)
            replaces = last is not None and number_of(last[0]) == row.value
            new = number.sub(exact_text(value), text) if replaces else f"{text}, {exact_text(value)} {row.unit}"
            yield ("title", *filter(None, [language])), new.rstrip()


def _word(value: float) -> str:
    """Return a number as a part of an id: "0_5", "minus_60"."""
    return exact_text(value).replace("-", "minus_").replace(".", "_")[: MAX_ID // 2]

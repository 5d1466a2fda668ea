"""A series of elements: copies of one that differ in one number, each with that number in its id and title."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from study_app.authoring.additions import duplicated
from study_app.authoring.edited_study import Study
from study_app.authoring.fields import Row, label_of, refused_at, row_at, rows, why_not
from study_app.authoring.names import references_to, renamed
from study_app.authoring.outline import title_of
from study_app.authoring.writer.edits import Edit, Insert, Set
from study_app.authoring.writer.refused import Refused
from study_app.ids import MAX_ID
from study_app.number_text import MINUS, exact_text, number_of, typed_numbers
from study_app.protocol.source.document import Path, names, value_at
from study_app.protocol.source.problems import Fault

MOST: Final = 24
"""Greatest number of values of a series; code letters end at Z."""
NUMBERS: Final = frozenset({"number", "whole number"})
"""Kinds of rows with one number."""
_DEEPEST: Final = 2
_ALIKE: Final = frozenset({"pages"})
"""Sections whose tables differ only in their texts, so that a series makes no sense."""


@dataclass(frozen=True, slots=True)
class Member:
    """One element of a series.

    Attributes
    ----------
    value : int or float
        Its number.
    name : str
        Its id.
    titles : tuple of (path, str)
        Its titles, one in each language, each with its place below the element.
    """

    value: int | float
    name: str
    titles: tuple[tuple[Path, str], ...] = ()

    @property
    def title(self) -> str:
        """Its displayed name: its title in the first language, else its id in words."""
        return next((text for _, text in self.titles), label_of(self.name))


def is_element(document: Mapping[str, Any], path: Path) -> bool:
    """Return whether there is a table of a section there whose copies may differ in a number."""
    if len(path) != 2 or path[0] in _ALIKE or not isinstance(value_at(document, path), Mapping):
        return False
    section = row_at(document, path[:1])
    return section is not None and section.kind == "tables"


def number_rows(document: Mapping[str, Any], path: Path) -> tuple[Row, ...]:
    """Return the numbers of an element of which there can be a series, in the order of its form."""
    return tuple(_numbers(document, path, _DEEPEST)) if is_element(document, path) else ()


def series_starts(document: Mapping[str, Any], path: Path) -> tuple[Path, ...]:
    """Return the possible first elements of a series: the one at ``path``; for a section, each one with a number."""
    row = row_at(document, path) if len(path) == 1 else None
    inside = (
        [(*path, name) for name in names(document, str(path[0]))] if row is not None and row.kind == "tables" else []
    )
    return tuple(one for one in inside or [path] if number_rows(document, one))


def number_row(document: Mapping[str, Any], path: Path, field: Path) -> Row:
    """Return the number that differs in a series.

    Raises
    ------
    Refused
        It is not a number of the element.
    """
    found = next((row for row in number_rows(document, path) if row.path == field), None)
    if found is None:
        raise Refused("choose a number of this element")
    return found


def members(study: Study, path: Path, row: Row, text: str) -> tuple[Member, ...]:
    """Return the elements of a series, of which the first one is the element at ``path``.

    Parameters
    ----------
    study : Study
        The study.
    path : tuple of str or int
        The element.
    row : Row
        The number that differs, one of `number_rows`.
    text : str
        The values, separated by spaces, semicolons, lines, or commas with spaces; each may be followed by the unit.

    Raises
    ------
    Refused
        A value is not a number that is permitted there, or is given twice, there are fewer than two or too many, or
        a title is that of another element.
    """
    typed = typed_values(study.document, row, text)
    if why := next((why for _, why in typed if why), ""):
        raise Refused(why)
    if len(typed) < 2:
        raise Refused("a series has two values or more")
    if len(typed) > MOST:
        raise Refused(f"a series has at most {MOST} values")
    return members_of(study, path, row, [value for value, _ in typed])


def members_of(study: Study, path: Path, row: Row, values: Sequence[int | float]) -> tuple[Member, ...]:
    """Return the elements of a series with these values, as `members` does.

    Raises
    ------
    Refused
        A title is that of another element.
    """
    document, name = study.document, str(path[1])
    taken = {*names(document, str(path[0]))} - {name}
    ending = "" if row.value is None else f"_{_word(row.value)}"
    own = bool(ending) and name.endswith(ending)
    found: list[Member] = []
    for at, value in enumerate(values):
        chosen = _free(taken, name.removesuffix(ending), _word(value)) if at or own else name
        taken.add(chosen)
        found.append(Member(value, chosen, tuple(_titles(document, path, value, row, first=at == 0))))
    _refuse_known_titles(document, path, found)
    return tuple(found)


def first_edits(study: Study, path: Path, row: Row, member: Member) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that make an element the first one of a series, and its path after them."""
    edits: list[Edit] = []
    if member.name != path[1]:
        edits += renamed(study.document, path, member.name)
    after = (path[0], member.name)
    return (*edits, *_given(member, after, path, row)), after


def next_edits(study: Study, previous: Path, row: Row, member: Member) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that make the next element of a series, and its path; blocks list it after the one before."""
    edits, copy = duplicated(study, previous, member.name)
    after, _ = study.edited(*edits)
    listing = (place for place in references_to(after.document, previous) if place[0] == "blocks")
    ends = {place[:-1]: place[-1] for place in listing if isinstance(place[-1], int)}
    listed = (Insert((*place, at + 1), copy[1]) for place, at in ends.items() if isinstance(at, int))
    return (*edits, *_given(member, copy, previous, row), *listed), copy


def problem_made(before: Study, after: Study, original: Path, made: Sequence[Path]) -> tuple[str, Path]:
    """Return the first problem that a series adds to a study, in words, and its place; "" if it adds none.

    Copies may have problems that the original already had, such as a missing text.

    Parameters
    ----------
    before, after : Study
        The study without and with the series.
    original : tuple of str or int
        The element before it became the first one of the series.
    made : sequence of path
        The elements of the series.
    """
    known = {_as_before(fault, original, ()) for fault in before.faults}
    for fault in after.faults:
        if _as_before(fault, original, made) not in known:
            inside = (label_of(step) for step in fault.path[2:] if isinstance(step, str))
            where = ", ".join((title_of(after.document, fault.path[:2]), *inside))
            return f"{where}: {fault.message}", fault.path
    return "", ()


def _as_before(fault: Fault, original: Path, made: Sequence[Path]) -> tuple[Path, str]:
    """Return a problem as that of the original element: with its id instead of a copy's, without list indices."""
    path = original + fault.path[2:] if fault.path[:2] in made else fault.path
    message = fault.message
    for _, name in made:
        message = message.replace(f'"{name}"', f'"{original[1]}"')
    return tuple(step for step in path if isinstance(step, str)), message


def _given(member: Member, path: Path, before: Path, row: Row) -> Iterator[Edit]:
    """Yield the edits that give an element its number and titles."""
    yield Set((*path, *row.path[len(before) :]), member.value)
    for inner, text in member.titles:
        yield Set((*path, *inner), text)


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


def typed_values(document: Mapping[str, Any], row: Row, text: str) -> tuple[tuple[int | float, str], ...]:
    """Return the values that are typed, each with the reason why it cannot be one of the series, "" for none.

    Raises
    ------
    Refused
        There is no value, or one is not a number.
    """
    try:
        typed = typed_numbers(text, row.unit)
    except ValueError as unclear:
        raise Refused(str(unclear)) from unclear
    found: list[tuple[int | float, str]] = []
    for word, value in typed:
        why = why_not(document, row, value)
        twice = any(value == earlier for earlier, _ in found)
        reason = f"{word} is not permitted: {row.label} is {why}" if why else f"{word} is there twice" if twice else ""
        found.append((value, reason))
    return tuple(found)


def _word(value: float) -> str:
    """Return a number as a part of an id: "0_5", "minus_60"."""
    return exact_text(value).replace("-", "minus_").replace(".", "_")[: MAX_ID // 2]


def _free(taken: set[str], stem: str, word: str) -> str:
    """Return an id with a number at its end that is free."""
    name, again = f"{stem[: MAX_ID - len(word) - 1]}_{word}", 1
    while name in taken:
        again += 1
        ending = f"_{word}_{again}"
        name = f"{stem[: MAX_ID - len(ending)]}{ending}"
    return name


def _titles(
    document: Mapping[str, Any], path: Path, value: float, row: Row, *, first: bool
) -> Iterator[tuple[Path, str]]:
    """Yield an element's titles with a number: replacing the last one, else at the end, except the first."""
    number = re.compile(rf"(?:(?<!\w)[-{MINUS}])?\d+(?:[.,]\d+)?(?=\s*(?:{re.escape(row.unit)})?\s*$)")
    for place, text in _texts(document, path):
        last = number.search(text)
        if last is not None and number_of(last[0]) == row.value:
            yield place, f"{text[: last.start()]}{exact_text(value)}{text[last.end() :]}"
        elif not first:
            yield place, f"{text}, {exact_text(value)} {row.unit}".rstrip()


def _texts(document: Mapping[str, Any], path: Path) -> Iterator[tuple[Path, str]]:
    """Yield the titles of an element as they are, each with its place below the element."""
    title = value_at(document, (*path, "title"))
    for language, text in title.items() if isinstance(title, Mapping) else (("", title),):
        if isinstance(text, str) and text.strip():
            yield ("title", *filter(None, [language])), text


def _refuse_known_titles(document: Mapping[str, Any], path: Path, made: list[Member]) -> None:
    """Refuse a title that another element of the section has."""
    others = (one for one in names(document, str(path[0])) if one != path[1])
    known = {text: name for name in others for text in _texts(document, (path[0], name))}
    for text in (text for one in made for text in one.titles):
        if text in known:
            raise Refused(f'"{known[text]}" has the title "{text[1]}" already')

"""The rows of the outline: the study itself, its session in order, its parts, and its settings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

from study_app.designer.document.elements import (
    FIRST,
    LABEL,
    Element,
    FoundField,
    brief,
    found,
    found_in_elements,
    outline,
    title_of,
)
from study_app.designer.document.fields import singular
from study_app.designer.document.study import Study
from study_app.number_text import counted, duration
from study_app.protocol.source.document import Path, entries, names, value_at

ICONS: Final = {
    "pages": "file", "blocks": "layers", "tasks": "route", "questionnaires": "list", "liquids": "drop",
    "conditions": "columns", "scales": "scale", "stimuli": "pulse", "designs": "columns", "methods": "bars",
    "groups": "people", "study": "file", "device": "device", "scene": "drop", "limits": "check", "analysis": "bars",
}  # fmt: skip
"""The icon of each section; a section that is not listed has a ring."""
PAGES: Final[Mapping[Any, str]] = {"consent": "pen", "break": "pause", "debrief": "flag"}
"""The icon of a page by its kind, where it is not that of every page."""
SECTIONS: Final = ("Session, in order", "Parts it is made of", "Settings")
"""The headings; above them is the study itself, with its title, description and languages."""
SESSION, PARTS, SETTINGS = SECTIONS
FORCE_LIMIT: Final = ("device", "force_limit_n")

ElementPath: TypeAlias = Path
"""The path of an element, as windows hand it on."""


@dataclass(frozen=True, slots=True)
class OutlineRow:
    """One row of the outline."""

    path: Path  # () for the heading of a section
    title: str
    icon: str = ""
    note: str = ""  # at its right: a time, a count, or its `brief` fact
    depth: int = 0  # below the heading of its section
    faults: int = 0  # within it
    name: str = ""  # what a screen reader says of it
    step: Path = ()  # its entry in the list that orders it; () where it cannot be moved
    field: Path = ()  # the field of it that was found, () where none was looked for
    named: bool = False  # whether what was looked for is in its title or id


def outline_rows(study: Study, times_s: Mapping[str, float], find: str = "") -> tuple[OutlineRow, ...]:
    """Return the outline of a study; with words to find only the elements that hold them.

    ``times_s``: how long each step takes [s], by its id; empty while the study has faults; ``find``: what an element's
    title, id or one of its texts must hold, or the label or a choice of one of its fields.
    """
    if study.unreadable:
        only = Element(FIRST, title_of({}, FIRST), FIRST[0], faults=len(study.faults))
        return (_row(study, only, {}, in_session=False),)
    shown, words = outline(study), find.strip()
    fields = found_in_elements(study, words)
    rows: list[OutlineRow] = []
    titles = _titles((*shown.parts, *shown.session, *shown.study))
    settings = [one for one in shown.study if one.path != FIRST]
    own = [one for one in shown.study if one.path == FIRST]
    for heading, elements in (("", own), (SESSION, shown.session), (PARTS, shown.parts), (SETTINGS, settings)):
        named = [replace(one, title=titles[one.path]) for one in elements]
        inner = [_row(study, element, times_s, in_session=heading == SESSION) for element in named]
        if words:
            inner = [row for row in inner if len(row.path) > 1 or heading in {"", SETTINGS}]
            inner = [kept for row in inner if (kept := _found(study, row, words, fields.get(row.path))) is not None]
        total = duration(sum(times_s.values())) if times_s and heading == SESSION else ""
        if inner:
            rows += [*([OutlineRow((), heading, note=total, name=heading)] if heading else []), *inner]
    return tuple(rows)


def _titles(elements: Sequence[Element]) -> dict[Path, str]:
    """Return the name of each element: its title, with its id if an earlier element of the section has this title."""
    first: dict[tuple[Path, str], Path] = {}
    for one in elements:
        first.setdefault((one.path[:-1], one.title), one.path)
    mine = {one.path: first[one.path[:-1], one.title] == one.path for one in elements}
    return {one.path: one.title if mine[one.path] else f"{one.title} ({one.id})" for one in elements}


def _found(study: Study, row: OutlineRow, words: str, field: FoundField | None) -> OutlineRow | None:
    """Return a row where its element was found, with the label of the field that was; else None."""
    named = found(study.document, row.path, words, named=True)
    if field is not None and (field.rank == LABEL or not named):
        title, name = f"{row.title} · {field.label}", f"{row.name}, field {field.label}"
        return replace(row, title=title, name=name, field=field.field, named=named)
    return replace(row, named=named) if named or found(study.document, row.path, words) else None


def icon_of(path: Path, document: Mapping[str, Any]) -> str:
    """Return the icon of an element."""
    if len(path) == 2 and path[0] == "pages":
        value = value_at(document, path)
        return PAGES.get(value.get("kind"), ICONS["pages"]) if isinstance(value, Mapping) else ICONS["pages"]
    return "list" if "items" in path else ICONS.get(str(path[0]), "ring") if path else "ring"


def _row(study: Study, element: Element, times_s: Mapping[str, float], *, in_session: bool) -> OutlineRow:
    path, note, kind = element.path, "", str(element.path[0])
    if in_session and element.depth == 0:
        note = duration(times_s[element.id]) if element.id in times_s else ""
    elif in_session:
        note = brief(study.document, path)
    elif element.depth == 0 and kind in SECTIONS_OF_TABLES:
        count = len(names(study.document, kind))
        note = str(count) if count else "none"
    elif path == FIRST:
        note = " ".join(str(code).upper() for _, code in entries(study.document, "study.languages.*"))
    elif path == ("device",) and isinstance(limit := value_at(study.document, FORCE_LIMIT), int | float):
        note = f"{limit:g} N"
    faults = counted(element.faults, "problem") if element.faults else ""
    sort = singular(kind) if len(path) == 2 else "question" if "items" in path else ""
    at = ""
    if element.step and isinstance(element.step[-1], int):
        count = len(_at(study.document, element.step[:-1]))
        at = f"{'question' if 'items' in path else 'step'} {element.step[-1] + 1} of {count}"
        sort = "" if "items" in path else sort
    name = ", ".join(filter(None, (element.title, sort, note, at, faults)))
    title, step = element.title, element.step
    return OutlineRow(path, title, icon_of(path, study.document), note, element.depth + 1, element.faults, name, step)


def _at(document: Any, path: Path) -> Any:
    for step in path:
        document = document[step]
    return document


SECTIONS_OF_TABLES: Final = frozenset(ICONS) - {"study", "device", "scene", "limits", "analysis"}

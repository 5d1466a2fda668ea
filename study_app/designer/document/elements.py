"""The outline of a study: its session in order, the parts it is made of, and the study itself."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import label_of, rows
from study_app.designer.document.names import named_at
from study_app.protocol.groups import sequences_in
from study_app.protocol.source.document import Path, entries, has, value_at

TITLES: Final = ("title", "short", "text")
"""Keys of texts that an element is called by, the first that it has."""


@dataclass(frozen=True, slots=True)
class Element:
    """One line of the outline.

    Attributes
    ----------
    path : tuple of str or int
        Where it is.
    title, id : str
        What it is called, and its name in the file.
    depth : int
        How far it is indented.
    faults : int
        How many faults are within it.
    step : tuple of str or int
        Its entry in the list that orders it: the session's or a questionnaire's; () without an order.
    """

    path: Path
    title: str
    id: str
    depth: int = 0
    faults: int = 0
    step: Path = ()


@dataclass(frozen=True, slots=True)
class Outline:
    """The three sections of the outline; parts are sections of tables, each followed by its elements."""

    session: tuple[Element, ...]
    parts: tuple[Element, ...]
    study: tuple[Element, ...]


def outline(study: Study) -> Outline:
    """Return the outline of a study, sound or not."""
    of_root = rows(study.document, ())
    named = [row.path for row in of_root if row.kind == "tables"]
    tables = [row.path for row in of_root if row.kind == "table"]
    parts = (
        element(study, path, depth)
        for section in named
        for path, depth in ((section, 0), *((path, 1) for path, _ in entries(study.document, f"{section[0]}.*")))
    )
    return Outline(tuple(_session(study)), tuple(parts), tuple(element(study, path) for path in tables))


def element(study: Study, path: Path, depth: int = 0) -> Element:
    """Return one line of the outline."""
    faults = sum(fault.path[: len(path)] == path for fault in study.faults)
    value: Any = study.document
    for step in path:
        value = value[step] if has(value, step) else None
    name = value.get("id", path[-1]) if isinstance(value, Mapping) else path[-1]
    return Element(path, title_of(study.document, path), str(name), depth, faults)


def title_of(document: Mapping[str, Any], path: Path) -> str:
    """Return what an element is called: its title in the first language, else its id with blanks and a capital."""
    value: Any = document
    for step in path:
        value = value[step] if has(value, step) else None
    if not isinstance(value, Mapping) or len(path) == 1:
        return label_of(path[-1])
    return _called(document, value) or label_of(str(value.get("id", path[-1])))


def study_title(document: Mapping[str, Any]) -> str:
    """Return the title of a study in its first language; "" where it has none."""
    head = document.get("study")
    return _called(document, head) if isinstance(head, Mapping) else ""


def _called(document: Mapping[str, Any], value: Mapping[str, Any]) -> str:
    text = next((value[key] for key in TITLES if key in value), None)
    language = next((name for _, name in entries(document, "study.languages.*")), None)
    if isinstance(text, Mapping):
        text = text.get(language) or next(iter(text.values()), None)
    return text if isinstance(text, str) and text.strip() else ""


def found(document: Mapping[str, Any], path: Path, words: str, *, named: bool = False) -> bool:
    """Return whether title, id or any text of an element holds what is looked for, in any language.

    ``named`` leaves the texts out, but the title.
    """
    texts = () if named else _texts(value_at(document, path))
    return any(words.casefold() in text.casefold() for text in (str(path[-1]), title_of(document, path), *texts))


def _session(study: Study) -> Iterator[Element]:
    """Yield every step of every sequence, blocks with what they name, questionnaires with their items."""
    document = study.document
    steps: list[Path] = [(*place, index) for place, listed in sequences_in(document) for index in range(len(listed))]
    things = [(named_at(document, step), step) for step in steps]
    for thing, step in things or [(path, ()) for path, _ in entries(document, "blocks.*")]:
        if thing is not None:
            inner = [named_at(document, (*thing, row.path[-1])) for row in rows(document, thing)]
            below: list[Element] = []
            for part in dict.fromkeys((thing, *(path for path in inner if path is not None))):
                items = [path for path, _ in entries(document, f"{part[0]}.{part[1]}.items.*")]
                if items or (part != thing and part[0] == "tasks"):
                    below.append(element(study, part, 1))
                below += [replace(element(study, item, 2), step=item) for item in items]
            own = element(study, thing)
            contained = sum(one.faults for one in below if one.depth == 1 and one.path != thing)
            yield replace(own, step=step, faults=own.faults + contained)
            yield from below


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for inner in value.values():
            yield from _texts(inner)
    elif isinstance(value, tuple):
        for inner in value:
            yield from _texts(inner)

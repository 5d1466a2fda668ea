"""What can be added to a study where one is."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

from study_app.designer.document.additions import number_rows
from study_app.designer.document.changes import languages_of
from study_app.designer.document.elements import found_fields, title_of
from study_app.designer.document.fields import Row, label_of, node_at, row_at, rows, singular, tags
from study_app.designer.document.names import named_at
from study_app.designer.document.study import Study
from study_app.designer.outline.outline_rows import icon_of
from study_app.designer.place.requests import AddElement, AddInstrument, ChangeLanguage, Do, GoTo
from study_app.protocol.formats import TABLES, is_second
from study_app.protocol.questionnaires import instrument, instruments
from study_app.protocol.source.document import Path, names, value_at
from study_app.protocol.wording.languages import LANGUAGES

MOST_FIELDS: Final = 12
QUESTIONNAIRES: Final = "questionnaires"
HELP: Final = {"designs": "2IFC and other trial designs"}
"""What a section is for, where its name does not say it."""
SERIES: Final = "Copies at several levels of one number: {}"


@dataclass(frozen=True, slots=True)
class Addable:
    """One thing that can be added, or a field to go to: its words and icon, what is asked for, and a line of help."""

    words: str
    icon: str
    asks: AddElement | AddInstrument | ChangeLanguage | Do | GoTo
    help: str = ""


def addable(study: Study, selected: Path) -> tuple[Addable, ...]:
    """Return what can be added: to lists of the selected element, to its section, then to the other sections."""
    document = study.document
    around = selected[:2] if len(selected) > 1 else ()
    lists = [row.path for row in rows(document, around) if row.kind == "list"] if around else []
    second = is_second(document)
    sections = [
        row.path for row in rows(document, ()) if row.kind == "tables" and (second or row.path[0] not in TABLES)
    ]
    sections.sort(key=lambda path: path[:1] != selected[:1])
    found = [one for path in lists for one in _of_list(study, path)]
    found += [
        Addable(
            label_of(singular(path[0])),
            icon_of(path, study.document),
            AddElement(path),
            HELP.get(str(path[0]), f"To {label_of(path[0]).lower()}"),
        )
        for path in sections
    ]
    found += _questions(study, around) if not any(path[0] == QUESTIONNAIRES for path in lists) else ()
    found += _series(study, selected)
    found += _instruments() if second else ()
    there = languages_of(study)
    found += [
        Addable(f"Language: {words.english_name}", "info", ChangeLanguage("add", code), "To every text of the study")
        for code, words in LANGUAGES.items()
        if code not in there
    ]
    return tuple(found)


def _questions(study: Study, around: Path) -> Iterator[Addable]:
    """Yield a question for each questionnaire to which one can be added: for the one that the element names alone.

    Where there are several, each says of which it is.
    """
    named = value_at(study.document, (*around, "questionnaire")) if around else None
    tables = names(study.document, QUESTIONNAIRES)
    every = [one for one in tables if value_at(study.document, (QUESTIONNAIRES, one, "instrument")) is None]
    for name in (named,) if named in every else every:
        first = next(_of_list(study, (QUESTIONNAIRES, str(name), "items")))
        title = title_of(study.document, (QUESTIONNAIRES, str(name)))
        yield first if len(every) == 1 else replace(first, words=f"{first.words} of {title}")


def _series(study: Study, selected: Path) -> Iterator[Addable]:
    """Yield a series of the selected element, and of those that its lists name, where there can be one."""
    lists = (row for row in rows(study.document, selected) if row.kind == "references" and len(selected) == 2)
    listed = (named_at(study.document, place) for row in lists for place in _entries(row))
    for path in dict.fromkeys((selected, *(one for one in listed if one is not None))):
        if numbers := number_rows(study.document, path):
            words, help_ = f"Series of {title_of(study.document, path)} …", ", ".join(row.label for row in numbers)
            yield Addable(words, "bars", Do("series", (path,)), SERIES.format(help_))


def fields_to_go_to(study: Study, words: str, selected: Path) -> tuple[Addable, ...]:
    """Return the fields whose labels or choices have words that begin so, those of the selected element first."""
    found = sorted(found_fields(study, words), key=lambda one: (one.rank, one.element != selected))
    offered = []
    for one in found[:MOST_FIELDS]:
        path, title = one.element, title_of(study.document, one.element)
        kind = singular(path[-2]) if isinstance(path[-1], int) else singular(path[0]) if len(path) > 1 else ""
        named = f"{one.label} of {' '.join(filter(None, (label_of(kind).lower(), title)))}"
        asks = GoTo(path, one.field)
        choice = f", {one.choice}" if one.choice else ""
        offered.append(Addable(f"{named}{choice}", icon_of(path, study.document), asks, one.help))
    return tuple(offered)


@cache
def _instruments() -> tuple[Addable, ...]:
    """Return the standard questionnaires, with who published each and under which licence its texts are."""
    found = []
    for name in instruments():
        source = instrument(name)
        texts = "" if source["languages"] else ". Its texts are not included: write them in the study"
        help_ = f"{source['source']}. Licence: {source['licence']}{texts}"
        words = f"Instrument: {name.upper()}, {len(source['items'])} questions"
        found.append(Addable(words, "list", AddInstrument(name), help_))
    return tuple(found)


def _entries(row: Row) -> Iterator[Path]:
    """Yield the place of each entry of a list."""
    yield from ((*row.path, at) for at in range(len(row.value if isinstance(row.value, tuple) else ())))


def _of_list(study: Study, path: Path) -> Iterator[Addable]:
    """Yield what can be added to a list: where its tables are of several kinds, one of each."""
    words = label_of(singular(path[-1]))
    to = f"To {title_of(study.document, path[:2])}"
    key, kinds = tags(node_at(study.document, (*path, 0)))
    if not kinds or not is_second(study.document):
        yield Addable(words, icon_of(path, study.document), AddElement(path), to)
        return
    row = row_at(study.document, (*path, 0, key))
    choices = sorted(() if row is None else row.choices, key=lambda choice: choice.value is not None)
    for choice in choices:
        named = words if choice.value is None else f"{words}: {label_of(choice.value).lower()}"
        asks = AddElement(path, () if choice.value is None else (key, choice.value))
        yield Addable(named, icon_of(path, study.document), asks, f"{to}. {choice.sentence}")

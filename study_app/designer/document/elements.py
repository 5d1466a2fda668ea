"""Elements of a study: the outline, titles, uses, order, and the search for fields."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final

from study_app.designer.document.fields import (
    CONTRASTS,
    EXCLUSIONS,
    ITEMS,
    Row,
    all_references,
    counted_elements,
    element_noun,
    label_of,
    name_label,
    referenced_element,
    refused_at,
    row_at,
    rows,
)
from study_app.designer.document.study import Study
from study_app.number_text import counted, exact_duration
from study_app.protocol.participants import sequences_in
from study_app.protocol.questionnaires import Instrument
from study_app.protocol.source import Path, entries, has, names, value_at
from study_app.protocol.wording import languages_of

_TITLE_KEYS: Final = ("title", "short", "text")
"""Keys of the texts that can be the title of an element; the first one that it has is used."""
_MAX_TITLE_TEXTS: Final = 3
"""Greatest number of its texts that form the title of an entry without one."""
FIRST: Final = ("study",)
"""The element that is selected if no other one can be."""
SEQUENCE: Final = ("sequence",)
STUDY_LANGUAGES: Final = ("study", "languages")
"""The languages; the element of this path is the list of texts to write or translate."""


@dataclass(frozen=True, slots=True)
class Element:
    """One line of the outline."""

    path: Path
    title: str
    id: str  # its name in the file
    depth: int = 0  # level of indentation
    faults: int = 0  # number of faults in it
    step: Path = ()  # its entry in the list that orders it: the session's or a questionnaire's; () without an order


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline:
    """The three sections of the outline; parts are sections of tables, each followed by its elements."""

    session: tuple[Element, ...]
    parts: tuple[Element, ...]
    study: tuple[Element, ...]


def outline(study: Study) -> Outline:
    """Return the outline of a study, valid or not."""
    root_rows = rows(study.document, ())
    sections = [row.path for row in root_rows if row.kind == "tables"]
    tables = [row.path for row in root_rows if row.kind == "table"]
    parts = (
        make_element(study, path, depth)
        for section in sections
        for path, depth in ((section, 0), *((path, 1) for path, _ in entries(study.document, f"{section[0]}.*")))
    )
    orders = [path for path in (SEQUENCE, ("sequences",)) if value_at(study.document, path)]
    session = (*(make_element(study, path) for path in orders), *_session_elements(study))
    return Outline(session=session, parts=tuple(parts), study=tuple(make_element(study, path) for path in tables))


def make_element(study: Study, path: Path, depth: int = 0) -> Element:
    """Return the outline's line for the element at ``path``."""
    faults = sum(fault.path[: len(path)] == path for fault in study.shown_faults)
    value = value_at(study.document, path)
    name = value.get("id", path[-1]) if isinstance(value, Mapping) else path[-1]
    return Element(path, title_of(study.document, path), str(name), depth, faults)


def title_of(document: Mapping[str, Any], path: Path) -> str:
    """Return an element's title in the first language, or its capitalised ID with spaces.

    A list entry without a title and an ID is named by its first texts.
    """
    value = value_at(document, path)
    if not isinstance(value, Mapping) or len(path) == 1:
        return label_of(path[-1])
    if title := _title_text(document, value):
        return title
    if path[0] == "questionnaires" and isinstance(instrument := value.get("instrument"), str):
        return Instrument(instrument).published_name
    if path[:2] == EXCLUSIONS and isinstance(rule := value.get("rule"), str):
        return label_of(rule)
    if isinstance(path[-1], int) and "id" not in value:
        texts = [text for entry in value.values() for text in (entry if isinstance(entry, tuple | list) else (entry,))]
        return ", ".join([text for text in texts if isinstance(text, str)][:_MAX_TITLE_TEXTS]) or str(path[-1] + 1)
    return name_label(str(value.get("id", path[-1])))


def distinct_title(document: Mapping[str, Any], path: Path) -> str:
    """Return an element's title, followed by its ID in parentheses if another element of its table has this title."""
    title = title_of(document, path)
    titles = (title_of(document, (*path[:-1], name)) for name in names(document, str(path[0])) if name != path[-1])
    return f"{title} ({path[-1]})" if title in titles else title


def study_title(document: Mapping[str, Any]) -> str:
    """Return the title of a study in its first language; "" if it has none."""
    study_table = document.get("study")
    return _title_text(document, study_table) if isinstance(study_table, Mapping) else ""


def _title_text(document: Mapping[str, Any], table: Mapping[str, Any]) -> str:
    text = next((table[key] for key in _TITLE_KEYS if key in table), None)
    if isinstance(text, Mapping):
        text = text.get(languages_of(document)[0]) or next(iter(text.values()), None)
    return text if isinstance(text, str) and text.strip() else ""


def has_text(document: Mapping[str, Any], path: Path, sought: str, *, titles_only: bool = False) -> bool:
    """Return whether the title, the ID or any text of an element, in any language, contains ``sought``.

    With ``titles_only`` only the title and the ID are searched.
    """
    texts = () if titles_only else _all_texts(value_at(document, path))
    return any(sought.casefold() in text.casefold() for text in (str(path[-1]), title_of(document, path), *texts))


def _session_elements(study: Study) -> Iterator[Element]:
    """Yield the steps of every sequence: blocks with the tables that they use, questionnaires with their items."""
    document = study.document
    steps: list[Path] = [(*place, index) for place, listed in sequences_in(document) for index in range(len(listed))]
    step_elements = [(referenced_element(document, step), step) for step in steps]
    for element_path, step in step_elements or [(path, ()) for path, _ in entries(document, "blocks.*")]:
        if element_path is not None:
            used_tables = [
                referenced_element(document, (*element_path, row.path[-1])) for row in rows(document, element_path)
            ]
            inner_elements: list[Element] = []
            for part in dict.fromkeys((element_path, *(path for path in used_tables if path is not None))):
                items = [path for path, _ in entries(document, f"{part[0]}.{part[1]}.items.*")]
                if items or (part != element_path and part[0] == "tasks"):
                    inner_elements.append(make_element(study, part, 1))
                inner_elements += [replace(make_element(study, item, 2), step=item) for item in items]
            step_element = make_element(study, element_path)
            inner_faults = sum(
                element.faults for element in inner_elements if element.depth == 1 and element.path != element_path
            )
            yield replace(step_element, step=step, faults=step_element.faults + inner_faults)
            yield from inner_elements


def main_block_rows(document: Mapping[str, Any]) -> tuple[Row, ...]:
    """Return the form rows that concern all main blocks: their order, if there are several, and the hypotheses."""
    blocks = [block for _, block in entries(document, "blocks.*") if isinstance(block, Mapping)]
    several = sum(block.get("phase", "main") == "main" for block in blocks) > 1
    places = [("study", "block_order")] * several + [CONTRASTS]
    return tuple(row for place in places if (row := row_at(document, place)) is not None)


def _all_texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for inner in value.values():
            yield from _all_texts(inner)
    elif isinstance(value, tuple):
        for inner in value:
            yield from _all_texts(inner)


def element_of(study: Study, path: Path) -> Path:
    """Return the path of the outline's element that contains a path of the document."""
    if not path or not has(study.document, path[0]):
        return path[:1] or FIRST
    section = row_at(study.document, path[:1])
    tables = section is not None and section.kind == "tables"
    if len(path) >= 4 and path[2] == "items" and isinstance(path[3], int):
        return path[:4]
    return path[:2] if tables and has(study.document[str(path[0])], path[1] if len(path) > 1 else "") else path[:1]


def step_of(document: Mapping[str, Any], path: Path) -> Path | None:
    """Return the path that orders an element: its own list entry, or the session step that names it."""
    if path and isinstance(path[-1], int):
        return path
    for place, steps in sequences_in(document):
        for index in range(len(steps)):
            if referenced_element(document, (*place, index)) == path:
                return (*place, index)
    return None


def position_of(document: Mapping[str, Any], path: Path) -> tuple[int, int] | None:
    """Return an element's position in its list (from 1) and the length of the list; None if the order is irrelevant."""
    step = step_of(document, path) if len(path) > 1 else None
    if step is None or not isinstance(step[-1], int):
        return None
    return step[-1] + 1, len(value_at(document, step[:-1]))


def first_element(document: Mapping[str, Any]) -> Path:
    """Return the path of the initially selected element: the first session step, else the study's table."""
    steps = ((*place, 0) for place, listed in sequences_in(document) if listed)
    return next((named for step in steps if (named := referenced_element(document, step)) is not None), FIRST)


_USED: Final = frozenset(
    {"liquids", "conditions", "tasks", "questionnaires", "scales", "stimuli", "designs", "methods"}
)
"""Sections whose elements are used by others; pages and blocks are steps of the session."""


def kind_of(path: Path) -> str:
    """Return the kind of an element, such as "Block"; "" for a table that is the only one of its kind."""
    if isinstance(path[-1], int):
        return label_of(element_noun(path[-2]))
    return label_of(element_noun(path[0])) if len(path) > 1 else ""


def kind_and_title(document: Mapping[str, Any], path: Path) -> str:
    """Return kind and title, such as "Condition Water", or only the title if it contains the kind."""
    kind, title = kind_of(path), title_of(document, path)
    return title if title.casefold().startswith(kind.casefold()) else f"{kind} {title}"


def unique_name(document: Mapping[str, Any], path: Path) -> str:
    """Return kind and title of an element, or kind and ID if another one has the same kind and title."""
    name = kind_and_title(document, path)
    others = ((*path[:1], other) for other in names(document, str(path[0]))) if len(path) == 2 else ()
    alike = any(other != path and kind_and_title(document, other) == name for other in others)
    return f"{kind_of(path)} {path[1]}" if alike else name


def place_text(path: Path, line: int | None) -> str:
    """Return a path as text, with its line if known: "blocks.liquids.order · line 385"."""
    place = ".".join(str(step + 1) if isinstance(step, int) else step for step in path)
    return " · ".join(filter(None, (place, "" if line is None else f"line {line}")))


def short_note(document: Mapping[str, Any], path: Path) -> str:
    """Return the duration of a task or the number of questions of a questionnaire; "" for other elements."""
    value = value_at(document, path)
    if not isinstance(value, Mapping) or len(path) != 2:
        return ""
    if path[0] == "questionnaires" and isinstance(items := value.get("items"), tuple | list):
        return counted(len(items), "question")
    if path[0] != "tasks":
        return ""
    numbers = {key: number for key, number in value.items() if isinstance(number, int | float)}
    for minimum, maximum in (("min_s", "max_s"), ("duration_s", "duration_s")):
        if minimum in numbers and maximum in numbers:
            return exact_duration(numbers[minimum], numbers[maximum])
    return f"{numbers['count']:g} targets" if "count" in numbers else ""


def usage_text(document: Mapping[str, Any], path: Path) -> str:
    """Return the number of uses of an element as text: "used by 3 conditions", "not used".

    It is "" for steps and settings.
    """
    if len(path) != 2 or path[0] not in _USED:
        return ""
    users = {
        (place[:4] if place[2:3] == (ITEMS,) else place[:2]) for place, used in all_references(document) if used == path
    }
    counts = Counter(user[-2] for user in users)
    using = (
        counted(count, "step") if section == "sequence" else counted_elements(count, section)
        for section, count in sorted(counts.items())
    )
    return f"used by {', '.join(using)}" if counts else "not used"


_MIN_SEARCH_LENGTH: Final = 3
"""Number of letters from which on fields are searched."""
LABEL, CHOSEN, OTHER, SENTENCE = range(4)
_DEEPEST: Final = 3


@dataclass(frozen=True, slots=True)
class FoundField:
    """A field that matches a search."""

    element: Path
    field: Path
    label: str
    rank: int = LABEL  # what matches: LABEL, the CHOSEN value, an OTHER choice, or only the SENTENCE of a choice


def search_words(text: str) -> list[str]:
    """Return the search words, each without a plural "s"."""
    return [part.removesuffix("s") if len(part) > _MIN_SEARCH_LENGTH else part for part in text.casefold().split()]


def find_fields(study: Study, text: str) -> tuple[FoundField, ...]:
    """Return the fields whose labels or choices have words that begin with the search words, labels first.

    Unselected choices are searched only if no label and no selected choice matches, and sentences only after those.
    """
    parts = search_words(text)
    if not parts or len(text.strip()) < _MIN_SEARCH_LENGTH:
        return ()
    fields = [match for field in _searchable_fields(study) for match in _matches_in_field(field, parts)]
    best_rank = min((match.rank for match in fields), default=0)
    return tuple(
        sorted((match for match in fields if match.rank <= max(best_rank, CHOSEN)), key=lambda match: match.rank)
    )


def first_match_by_element(study: Study, text: str) -> Mapping[Path, FoundField]:
    """Return the first matching field of each element."""
    first: dict[Path, FoundField] = {}
    for field in find_fields(study, text):
        first.setdefault(field.element, field)
    return first


@lru_cache(maxsize=2)
def _searchable_fields(study: Study) -> tuple[tuple[Path, Row, str], ...]:
    study_outline = outline(study)
    parts = [element.path for element in (*study_outline.session, *study_outline.parts) if len(element.path) > 1]
    elements = dict.fromkeys((*parts, *(element.path for element in study_outline.study)))
    blocks = entries(study.document, "blocks.*")
    main = (path for path, block in blocks if isinstance(block, Mapping) and block.get("phase", "main") == "main")
    owner = SEQUENCE if value_at(study.document, SEQUENCE) else next(main, None)  # groups have their own sequences
    block_rows = () if owner is None else main_block_rows(study.document)  # listed only once
    fields: dict[Path, tuple[Path, Row, str]] = {row.path: (owner or FIRST, row, row.label) for row in block_rows}
    for element in elements:
        for row, label in _fields_of_table(study, element, ""):
            fields.setdefault(row.path, (element, row, label))
    return tuple(fields.values())


def _fields_of_table(study: Study, path: Path, above: str, depth: int = 0) -> Iterator[tuple[Row, str]]:
    refused = refused_at(study.document, path)
    for row in rows(study.document, path):
        if row.value is None and row.path[-1] in refused:
            continue
        label = f"{above}{row.label}"
        yield row, label
        if row.kind == "table" and isinstance(row.value, Mapping) and depth < _DEEPEST:
            yield from _fields_of_table(study, row.path, f"{label}, ", depth + 1)


def _matches_in_field(field: tuple[Path, Row, str], parts: list[str]) -> Iterator[FoundField]:
    """Yield the field if its label matches, else once for each matching choice."""
    element, row, label = field
    if _has_words(label, parts):
        yield FoundField(element, row.path, label)
        return
    for choice in row.choices if row.kind in {"choice", "choices", "kind"} else ():
        name = label_of(choice.value or "")
        searched_text = f"{label} {name} {choice.sentence}"
        if choice.value and _has_words(searched_text, parts):
            current = row.default if row.value is None else row.value
            name_rank = CHOSEN if choice.value == current else OTHER
            rank = name_rank if any(_has_words(name, [part]) for part in parts) else SENTENCE
            yield FoundField(element, row.path, label, rank)


def _has_words(text: str, parts: list[str]) -> bool:
    """Return whether each part is the beginning of a word in a text."""
    spaced = " " + " ".join(text.casefold().replace("-", " ").replace(",", " ").replace("(", " ").split())
    return all(f" {part}" in spaced for part in parts)


def existing_path(document: Mapping[str, Any], path: Path) -> Path:
    """Return the longest existing part of a path; the study's own table if there is none."""
    value: Any = document
    known = path[:1] if path and row_at(document, path[:1]) is not None else FIRST
    for length, step in enumerate(path):
        if not has(value, step):
            return path[:length] if length > 1 else known
        value = value[step]
    return path or FIRST

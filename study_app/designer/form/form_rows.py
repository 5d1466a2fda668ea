"""The form of one element of a study: its rows in sections, with their faults, places and entries."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import Choice, Row, label_of, refused_at, row_at, rows, sections_of
from study_app.designer.document.initial_values import singular
from study_app.designer.document.languages import is_copied
from study_app.designer.document.names import named_at
from study_app.designer.document.series import number_rows
from study_app.designer.form.element_facts import brief, kind_of, place_words, used_by
from study_app.designer.form.facts import FACTS
from study_app.designer.form.facts.questions import QuestionLines, question_lines
from study_app.designer.measures.participant_texts import copied_texts, texts_by_language
from study_app.designer.outline.outline_rows import FIRST, icon_of
from study_app.protocol.groups import sequences_in
from study_app.protocol.source.document import Path, Places, entries, places_of, value_at
from study_app.protocol.wording.languages import LANGUAGES, language_name

STUDY_LANGUAGES: Final = ("study", "languages")
ENTRIES: Final = "Entries"
DEEPEST: Final = 3
"""So many tables within each other are shown in one form."""
NO_QUESTIONS: Final = QuestionLines((), ())
UNREADABLE: Final = "Correct the text in the tab File"
LEAST, MOST = "at least ", "at most "
BELOW: Final = 2
"""Where the keys of an element begin in a path, after its section and its id."""

WITH_LIQUIDS = ("liquids", "conditions", "blocks")
"""Sections whose elements the lab opens."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One entry of a list, or one table of a section: where it is, what it is called, and how many faults it has.

    ``target`` is the element that it opens: what a reference names, else itself.
    """

    path: Path
    title: str
    note: str = ""
    faults: int = 0
    target: Path = ()


@dataclass(frozen=True, slots=True)
class FormRow:
    """One row of the form.

    Attributes
    ----------
    row : Row
        What is edited and how.
    place : str
        Its place in the file, such as ``blocks.liquids.order``, with its line.
    faults : tuple of str
        What is wrong with it, in the words of ``check``.
    languages : tuple of (str, str)
        Code and name of each language of the study, for texts.
    entries : tuple of Entry
        What a list holds, or what references name.
    target : tuple of str or int or None
        What a reference names.
    notes : tuple of (str, str)
        Elements that a reference can name, each with its `brief` fact.
    number : int or None
        Of alternatives ("either"), which one the value is.
    instead : tuple of (str, str)
        Keys of which exactly one is given, with their labels: this row's and the other one.
    facts : object
        What its special editor shows beyond the value; None where it has none.
    """

    row: Row
    place: str
    faults: tuple[str, ...] = ()
    languages: tuple[tuple[str, str], ...] = ()
    entries: tuple[Entry, ...] = ()
    target: Path | None = None
    notes: tuple[tuple[str, str], ...] = ()
    number: int | None = None
    instead: tuple[tuple[str, str], ...] = ()
    facts: Any = None

    @property
    def copied(self) -> tuple[str, ...]:
        """The languages in which a text is still that of the first language."""
        texts = self.row.value if isinstance(self.row.value, Mapping) else {}
        return tuple(name for code, name in self.languages[1:] if is_copied(texts, code, self.languages[0][0]))

    @property
    def removable(self) -> bool:
        """Whether the file holds the key and would be complete without it."""
        path = self.row.path
        given = self.row.value is not None and isinstance(path[-1], str)
        section = (len(path) == 1 and self.row.kind == "tables") or path == STUDY_LANGUAGES
        return given and not (self.row.required or self.instead or section)

    @property
    def bounds(self) -> str:
        """What is permitted, in one line."""
        return ", ".join(self.row.bounds)

    @property
    def range(self) -> str:
        """What numbers are permitted, as short as can be: "1 to 100"."""
        bounds = self.row.bounds
        if len(bounds) == 2 and bounds[0].startswith(LEAST) and bounds[1].startswith(MOST):
            return f"{bounds[0].removeprefix(LEAST)} to {bounds[1].removeprefix(MOST)}"
        return self.bounds


@dataclass(frozen=True, slots=True)
class Section:
    """Rows under one heading ("" for those of the element itself), keys that can be added, and faults of no row."""

    path: Path
    title: str
    rows: tuple[FormRow, ...]
    absent: tuple[Row, ...] = ()
    faults: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Form:
    """The form of one element.

    Attributes
    ----------
    path : tuple of str or int
        The element.
    title, icon, kind : str
        What it is called, the name of its icon, and what it is: "Block".
    id : str or None
        Its name in the file, None where it has none of its own.
    sections : tuple of Section
        Its rows.
    faults, id_faults : tuple of str
        What is wrong with it that belongs to no row, and what is wrong with its id.
    position : tuple of int or None
        Its place in the session or list and how many there are, from 1; None where it has no order.
    questions : QuestionLines
        The questions of the questionnaire that it is in, itself included; none where it is no question.
    around : tuple of (path, str)
        The section and the elements that it is in, with their titles, and itself.
    feel : str
        What the button says that opens the lab with its liquids, "" where it has none.
    series : bool
        Whether there can be a series of it: elements that differ in one of its numbers.
    used : str
        How many other elements use it (`used_by`); "" where that is not said.
    unreadable : bool
        Whether nothing can be edited but the text of the file, in which the study cannot be read.
    """

    path: Path
    title: str
    icon: str
    kind: str
    id: str | None = None
    sections: tuple[Section, ...] = ()
    faults: tuple[str, ...] = ()
    id_faults: tuple[str, ...] = ()
    position: tuple[int, int] | None = None
    questions: QuestionLines = NO_QUESTIONS
    around: tuple[tuple[Path, str], ...] = ()
    feel: str = ""
    series: bool = False
    used: str = ""
    unreadable: bool = False

    @property
    def rows(self) -> tuple[FormRow, ...]:
        """Every row."""
        return tuple(row for section in self.sections for row in section.rows)


def form(study: Study, path: Path) -> Form:
    """Return the form of the element at ``path``."""
    if study.unreadable:
        lines = [f"Line {one.line}: " if one.line else "" for one in study.problems]
        said = [_sentence(one.message, one.hint) for one in study.problems]
        why = tuple(map("".join, zip(lines, said, strict=True)))
        return Form(FIRST, title_of({}, FIRST), icon_of(FIRST, {}), UNREADABLE, faults=why, unreadable=True)
    document, places = study.document, places_of(study.text)
    own_row = row_at(document, path) if len(path) == 1 else None
    if own_row is not None and own_row.kind == "tables":
        own_row = replace(own_row, label=ENTRIES)
        sections: tuple[Section, ...] = (Section(path, "", (_form_row(study, own_row, places),)),)
    else:
        sections = tuple(_sections(study, path, places, 0))
    shown = {row.row.path for section in sections for row in section.rows}
    shown |= {section.path for section in sections if section.path != path}
    within = [fault for fault in study.faults if fault.path[: len(path)] == path]
    within = [fault for fault in within if not any(fault.path[: len(one)] == one for one in shown)]
    own = tuple(_sentence(one.message, one.hint) for one in within if one.path != (*path, "id"))
    of_id = tuple(_sentence(one.message, one.hint) for one in within if one.path == (*path, "id"))
    value = value_at(document, path)
    name = value.get("id") if isinstance(value, Mapping) else None
    if name is None and len(path) == 2 and isinstance(value, Mapping):
        name = str(path[1])
    if name is None and of_id:
        name = ""
    title = title_of(document, path)
    return Form(
        path, title, icon_of(path, document), kind_of(path) or "Section of the file",
        None if name is None else str(name), sections, own, of_id, position_of(document, path),
        question_lines(study, path[:-1]) if path[2:3] == ("items",) else NO_QUESTIONS,
        tuple((path[:length], title_of(document, path[:length])) for length in (1, 2, 4) if length <= len(path)),
        f"Feel {title}" if len(path) == 2 and path[0] in WITH_LIQUIDS else "",
        bool(number_rows(document, path)),
        used_by(document, path),
    )  # fmt: skip


def step_of(document: Mapping[str, Any], path: Path) -> Path | None:
    """Return the place of an element in the list that orders it: its own entry, or the step that names it."""
    if path and isinstance(path[-1], int):
        return path
    for place, steps in sequences_in(document):
        for index in range(len(steps)):
            if named_at(document, (*place, index)) == path:
                return (*place, index)
    return None


def position_of(document: Mapping[str, Any], path: Path) -> tuple[int, int] | None:
    """Return the place of an element among its neighbours, from 1, and how many there are; None without an order."""
    step = step_of(document, path) if len(path) > 1 else None
    if step is None or not isinstance(step[-1], int):
        return None
    return step[-1] + 1, len(value_at(document, step[:-1]))


def first_element(document: Mapping[str, Any]) -> Path:
    """Return what is selected first: the first step of the session, else the study's own table."""
    steps = ((*place, 0) for place, listed in sequences_in(document) if listed)
    return next((named for step in steps if (named := named_at(document, step)) is not None), FIRST)


def _sections(study: Study, path: Path, places: Places, depth: int) -> Iterator[Section]:
    whole = row_at(study.document, path) if len(path) == 1 else None
    if whole is not None and whole.kind not in {"table", "tables"}:
        yield Section(path, "", (_form_row(study, whole, places),))
        return
    shown: list[FormRow] = []
    absent: list[Row] = []
    below: list[Path] = []
    of_table, refused = rows(study.document, path), refused_at(study.document, path)
    other = {row.path[-1]: row for row in of_table}
    for row in of_table:
        faulty = any(fault.path[: len(row.path)] == row.path for fault in study.faults)
        if row.kind == "table" and row.value is not None and depth < DEEPEST and isinstance(row.value, Mapping):
            below.append(row.path)
        elif (
            row.kind == "tables"
            and (row.model, row.path[-1]) not in FACTS
            and depth < DEEPEST
            and len(row.path) > 1
            and isinstance(row.value, Mapping)
            and not any(isinstance(value, Mapping) for value in row.value.values())
        ):
            shown += [
                _form_row(study, replace(inner, label=f"{row.label}, {inner.label}"), places)
                for key in row.value
                if (inner := row_at(study.document, (*row.path, key))) is not None
            ]
        elif row.instead and not _given(other[row.instead]) and (_given(row) or faulty):
            both = tuple((str(key), one.label) for key, one in other.items() if key in {row.path[-1], row.instead})
            shown.append(replace(_form_row(study, row, places), instead=both))
        elif (row.value is None and not faulty and row.path[-1] in refused) or (
            row.instead and _given(other[row.instead]) and not _given(row)
        ):
            continue
        elif row.value is None and _optional(row) and not (row.required or faulty):
            absent.append(row)
        elif row.path[-1] != "id" or len(path) < 3:
            shown.append(_form_row(study, row, places))
    title = "" if depth == 0 else label_of(path[-1])
    inside = {row.row.path for row in shown}
    faults = tuple(
        _sentence(fault.message, fault.hint)
        for fault in study.faults
        if depth
        and fault.path[: len(path)] == path
        and not any(fault.path[: len(one)] == one for one in inside)
        and not any(fault.path[: len(one)] == one for one in below)
    )
    rest = (title, tuple(row.path[-1] for row in (*(one.row for one in shown), *absent)))
    for words, keys in (*sections_of(study.document, path), rest):
        own = tuple(row for key in keys for row in shown if row.row.path[len(path)] == key)
        missing = tuple(row for key in keys for row in absent if row.path[-1] == key)
        shown = [row for row in shown if row not in own]
        absent = [row for row in absent if row not in missing]
        if own or missing:
            yield Section(path, words, own, missing, faults)
            faults = ()
    for table in below:
        yield from _sections(study, table, places, depth + 1)


def _given(row: Row) -> bool:
    return row.value not in (None, ())


def _optional(row: Row) -> bool:
    """Return whether a key that the file lacks is offered below its section, not shown with what counts without it."""
    return row.kind == "table" or (row.default in (None, [], {}) and row.kind not in {"kind", "switch"})


def _form_row(study: Study, row: Row, places: Places) -> FormRow:
    document, path = study.document, row.path
    faults = tuple(_sentence(fault.message, fault.hint) for fault in study.faults if fault.path[: len(path)] == path)
    if path == STUDY_LANGUAGES:
        row = replace(row, choices=tuple(Choice(code, language_name(code)) for code in LANGUAGES))
    codes = [str(code) for _, code in entries(document, "study.languages.*")] or ["en"]
    number = None
    if row.kind == "either":
        number = next((index for index, one in enumerate(row.either) if _fits(one, row.value)), 0)
    return FormRow(
        row,
        place_words(path, places.line(path)),
        faults,
        tuple((code, language_name(code)) for code in codes) if row.kind in {"localised", "paragraphs"} else (),
        tuple(_entries(study, row)),
        named_at(document, path) if row.kind == "reference" and isinstance(row.value, str) else None,
        tuple(_notes(document, row)),
        number,
        facts=facts.of(study, row) if (facts := FACTS.get((row.model, str(path[-1])))) is not None else None,
    )


def _notes(document: Mapping[str, Any], row: Row) -> Iterator[tuple[str, str]]:
    if row.kind == "reference":
        for choice in row.choices:
            facts = (brief(document, (section, str(choice.value))) for section in row.sections)
            yield str(choice.value), next(filter(None, facts), "")


def _entries(study: Study, row: Row) -> Iterator[Entry]:
    if row.path == STUDY_LANGUAGES:
        counts, copied = texts_by_language(study), copied_texts(study)
        for at, code in enumerate(row.value if isinstance(row.value, tuple) else ()):
            (there, wanted), alike = counts.get(str(code), (0, 0)), copied.get(str(code), 0)
            note = f"{there - alike} of {wanted} texts" + (f", {alike} to translate" if alike else "")
            yield Entry((*row.path, at), language_name(str(code)), note, wanted - there)
    if row.kind in {"list", "tables", "references"} and isinstance(row.value, tuple | Mapping):
        keys = row.value if isinstance(row.value, Mapping) else range(len(row.value))
        for key in keys:
            path = (*row.path, key)
            faults = sum(fault.path[: len(path)] == path for fault in study.faults)
            if row.kind == "references":
                named = named_at(study.document, path)
                title = str(row.value[key]) if named is None else title_of(study.document, named)
                note = "" if named is None or isinstance(named[-1], int) else named[-1]
                yield Entry(path, title, note, faults, named or ())
            else:
                inner = value_at(study.document, path)
                note = inner.get("id", "") if isinstance(inner, Mapping) else ""
                yield Entry(path, title_of(study.document, path), str(note), faults, path)


def _fits(row: Row, value: Any) -> bool:
    """Return whether a value is of the kind that a row edits."""
    if row.kind in {"number", "whole number"}:
        return isinstance(value, int | float) and not isinstance(value, bool)
    if isinstance(value, tuple):
        return row.kind in {"numbers", "vector", "points", "texts", "choices", "references", "list"}
    if isinstance(value, Mapping):
        return row.kind in {"table", "tables", "localised"}
    return row.kind not in {"numbers", "vector", "points", "texts", "choices", "references", "list", "table", "tables"}


def _sentence(message: str, hint: str) -> str:
    sentence = f"{message[:1].upper()}{message[1:]}"
    return f"{sentence} ({hint})" if hint else sentence


def shape_of(form: Form) -> object:
    """Return what makes other editors necessary, beside the rows: other questions, sections, keys to add."""
    others = [line for line in form.questions.lines if line.path != form.path]
    return (
        others,
        form.questions.languages,
        [
            (one.path[BELOW:], one.title, tuple(row.path[BELOW:] for row in one.absent), one.faults)
            for one in form.sections
        ],
    )


def added_row(form: Form, before: Form) -> Path | None:
    """Return the path of the first row that the form did not have before; None where it had each."""
    known = {row.row.path for row in before.rows}
    return next((row.row.path for row in form.rows if row.row.path not in known), None)


def is_right_to_left(code: str) -> bool:
    """Return whether a language is written from right to left."""
    return code in LANGUAGES and LANGUAGES[code].right_to_left


def new_words(section: str) -> str:
    """Return what the choice is called that adds an element to a section and names it."""
    return f"New {label_of(singular(section)).lower()} …"


def choice_words(choice: Choice, default: object) -> str:
    """Return what a choice is called: its value in words, marked where it counts without being written."""
    if choice.value is None:
        return "Not set"
    words = label_of(str(choice.value)) if not str(choice.value).isdigit() else str(choice.value)
    return f"{words} (default)" if choice.value == default else words

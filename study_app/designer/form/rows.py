"""The content of a form: its rows in sections, their texts, and the lines of a questionnaire."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

from study_app.designer.document.elements import STUDY_LANGUAGES
from study_app.designer.document.fields import Choice, Row, element_noun, label_of, name_label
from study_app.designer.document.steps import Request
from study_app.designer.document.study import Study
from study_app.protocol.questions import STATEMENT
from study_app.protocol.source import Path, value_at
from study_app.protocol.warnings import UntranslatedText
from study_app.protocol.wording import LANGUAGES, language_name, languages_of

_ICONS: Final = {"rating": "scale", "slider": "slider", "number": "number", "choice": "list", "text": "letter"}


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionLine:
    """The line of one question in a list."""

    path: Path
    number: int  # position in the questionnaire, from 1
    kind: str
    icon: str  # the name of the icon
    texts: tuple[str, ...]  # its text in each language of the study, "" if missing
    note: str = ""  # the condition under which it is shown, "" if always
    faults: int = 0  # number of faults


@dataclass(frozen=True, slots=True)
class QuestionLines:
    """Names of the study's languages, and the lines of its questions."""

    languages: tuple[str, ...]
    lines: tuple[QuestionLine, ...]


def question_lines(study: Study, path: Path) -> QuestionLines:
    """Return the lines of all questions in the list at ``path``."""
    codes = languages_of(study.document)
    value = value_at(study.document, path)
    items = value if isinstance(value, tuple) else ()
    numbers = {str(item.get("id")): index for index, item in enumerate(items, start=1) if isinstance(item, Mapping)}
    lines = tuple(
        _question_line(study, (*path, index), item, codes, numbers)
        for index, item in enumerate(items)
        if isinstance(item, Mapping)
    )
    return QuestionLines(tuple(language_name(code) for code in codes), lines)


def _question_line(
    study: Study, path: Path, item: Mapping[str, Any], codes: Sequence[str], numbers: Mapping[str, int]
) -> QuestionLine:
    kind, text = str(item.get("kind", STATEMENT)), item.get("text", "")
    texts = [text.get(code, "") for code in codes] if isinstance(text, Mapping) else [text, *[""] * (len(codes) - 1)]
    faults = sum(fault.path[: len(path)] == path for fault in study.shown_faults)
    stripped = tuple(text.strip() if isinstance(text, str) else "" for text in texts)
    number = path[-1] + 1 if isinstance(path[-1], int) else 0
    return QuestionLine(
        path=path,
        number=number,
        kind=kind,
        icon=_ICONS.get(kind, "scale"),
        texts=stripped,
        note=_show_if_note(item, numbers),
        faults=faults,
    )


def _show_if_note(item: Mapping[str, Any], numbers: Mapping[str, int]) -> str:
    rule = item.get("show_if")
    if not isinstance(rule, Mapping):
        return ""
    name, values = str(rule.get("item")), rule.get("is", ())
    labels = [name_label(str(value)) for value in (values if isinstance(values, tuple) else (values,))]
    limits = [f"{label_of(key).lower()} {rule[key]:g}" for key in ("at_least", "at_most")
              if isinstance(rule.get(key), int | float)]  # fmt: skip
    return f"shown if {numbers.get(name, name)} is {' or '.join(labels) if labels else ' and '.join(limits)}"


NO_QUESTIONS: Final = QuestionLines((), ())
AT_LEAST, AT_MOST = "at least ", "at most "


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a list, or a table of a section: path, title, note, and number of faults.

    ``target`` is the path of the element that it opens: the target of a reference, or the entry itself.
    """

    path: Path
    title: str
    note: str = ""
    faults: int = 0
    target: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FormRow(Row):
    """One row of the form."""

    place: str = ""  # its path and line in the file, such as ``blocks.liquids.order · line 385``
    faults: tuple[str, ...] = ()  # the sentences of ``check`` on its faults
    unfinished: bool = False  # whether its entry is still being edited, so that its faults are only hints
    faulty_languages: tuple[
        str, ...
    ] = ()  # languages whose texts have these faults; () if other parts have faults, too
    languages: tuple[tuple[str, str], ...] = ()  # code and name of each language of the study, for texts
    entries: tuple[Entry, ...] = ()  # the entries of a list, or the targets of references
    target: Path | None = None  # the element to which a reference refers
    notes: tuple[tuple[str, str], ...] = ()  # IDs that a reference can have, each with its `short_note`
    additions: tuple[tuple[str, Request], ...] = ()  # label and request of each element that can be added here
    number: int | None = None  # for kind "either", the index of the alternative that the value has
    # with `instead`, both keys with their labels
    keys: tuple[tuple[str, str], ...] = ()
    untranslated: tuple[UntranslatedText, ...] = ()  # the texts that are not translated yet, one per language
    facts: Any = None  # the facts that its special editor shows; None without one

    @property
    def is_removable(self) -> bool:
        path = self.path
        is_stated = self.value is not None and isinstance(path[-1], str)
        is_section = len(path) == 1 or path == STUDY_LANGUAGES
        return is_stated and not (self.required or self.keys or is_section)

    @property
    def permitted(self) -> str:
        return ", ".join(self.bounds)

    @property
    def range(self) -> str:
        bounds = self.bounds
        if len(bounds) == 2 and bounds[0].startswith(AT_LEAST) and bounds[1].startswith(AT_MOST):
            return f"{bounds[0].removeprefix(AT_LEAST)} to {bounds[1].removeprefix(AT_MOST)}"
        return self.permitted


def values_of(row: Row) -> dict[str, Any]:
    """Return the field values of a row by name."""
    return {field.name: getattr(row, field.name) for field in fields(Row)}


@dataclass(frozen=True, slots=True)
class Section:
    """Rows under a heading, or "" for the rows of the element itself; keys that can be added; faults without a row."""

    path: Path
    title: str
    rows: tuple[FormRow, ...]
    absent: tuple[Row, ...] = ()
    faults: tuple[str, ...] = ()
    unfinished: bool = False  # whether the faults are only hints


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """The form of one element."""

    path: Path  # the element
    title: str
    icon: str  # the name of the icon
    kind: str  # such as "Block"
    id: str | None = None  # its name in the file, None if it has none
    sections: tuple[Section, ...] = ()
    faults: tuple[str, ...] = ()  # faults that belong to no row
    unfinished: bool = False  # whether these faults are only hints
    id_faults: tuple[str, ...] = ()  # faults of its ID
    # its position in the session or list, from 1, and the length of that; None without an order
    position: tuple[int, int] | None = None
    questions: QuestionLines = NO_QUESTIONS  # for a question, all questions of its questionnaire
    # path and title of the section and the elements that contain it, and of itself
    around: tuple[tuple[Path, str], ...] = ()
    feel: str = ""  # the label of the button that opens its liquids in the lab, "" without liquids
    series: bool = False  # whether a series of copies that differ in one number is possible
    used: str = ""  # the number of elements that use it (`usage_text`); "" if that is not shown
    asks: tuple[tuple[str, Request], ...] = ()  # label and request of each way to add a questionnaire to the session
    lists_texts: bool = False  # whether it lists texts to write or translate; Enter then leads to the next one
    unreadable: bool = False  # whether the file cannot be read as a study, so that only its text can be edited

    @property
    def rows(self) -> tuple[FormRow, ...]:
        return tuple(row for section in self.sections for row in section.rows)


def added_row(form: Form, before: Form) -> Path | None:
    """Return the path of the first new row of a form; None if there is none."""
    known = {row.path for row in before.rows}
    return next((row.path for row in form.rows if row.path not in known), None)


def is_right_to_left(code: str) -> bool:
    """Return whether a language is written from right to left."""
    return code in LANGUAGES and LANGUAGES[code].right_to_left


def new_element_label(section: str) -> str:
    """Return the label of the choice that adds an element to a section and refers to it."""
    return f"New {label_of(element_noun(section)).lower()}…"


def choice_label(choice: Choice, default: object) -> str:
    """Return the label of a choice, in which the default is marked."""
    if choice.value is None:
        return "Not set"
    package, _, name = str(choice.value).rpartition(":")
    text = f"{label_of(name)} ({package})" if package else label_of(name)
    return f"{text} (default)" if choice.value == default else text

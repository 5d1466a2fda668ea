"""The rows of the outline, and what can be added to a study where one is, as a list that is filtered by typing."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final, TypeAlias

from PySide6.QtCore import QEvent, QObject, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QLineEdit, QListWidget, QListWidgetItem, QWidget

from study_app.designer.document.additions import number_rows
from study_app.designer.document.elements import (
    FIRST,
    LABEL,
    SEQUENCE,
    Element,
    FoundField,
    brief,
    found,
    found_fields,
    found_in_elements,
    outline,
    title_of,
    words_sought,
)
from study_app.designer.document.fields import label_of, node_at, row_at, rows, singular, tags
from study_app.designer.document.names import languages_of, named_at
from study_app.designer.document.steps import AddElement, AddInstrument, ChangeLanguage, Do, GoTo
from study_app.designer.document.study import Study
from study_app.gui.theme.icons import icon
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import vbox
from study_app.gui.widgets.labels import label
from study_app.number_text import counted, duration
from study_app.protocol.checks.cross_references import OWN
from study_app.protocol.formats import TABLES, is_second
from study_app.protocol.questionnaires import instrument, instruments
from study_app.protocol.source.document import Path, names, value_at
from study_app.protocol.wording.languages import LANGUAGES

ICONS: Final = {
    "pages": "file", "blocks": "layers", "tasks": "route", "questionnaires": "list", "liquids": "drop",
    "conditions": "columns", "scales": "scale", "stimuli": "pulse", "designs": "columns", "methods": "bars",
    "sequence": "bars", "sequences": "bars", "groups": "people", "study": "file", "device": "device", "scene": "drop",
    "limits": "check", "analysis": "bars",
}  # fmt: skip
"""The icon of each section; a section that is not listed has a ring."""
PAGES: Final[Mapping[Any, str]] = {"consent": "pen", "break": "pause", "debrief": "flag"}
"""The icon of a page by its kind, where it is not that of every page."""
SECTIONS: Final = ("Session, in order", "Parts it is made of", "Settings")
"""The headings; above them is the study itself, with its title, description and languages."""
SESSION, PARTS, SETTINGS = SECTIONS
QUESTIONNAIRES: Final = "questionnaires"
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
            inner = [row for row in inner if len(row.path) > 1 or heading != PARTS]
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
    if in_session and len(path) == 1:
        listed = value_at(study.document, path)
        note = counted(len(listed), "step" if path == SEQUENCE else "session") if isinstance(listed, tuple) else ""
    elif in_session and element.depth == 0:
        note = duration(times_s[element.id]) if element.id in times_s else ""
    elif in_session:
        note = brief(study.document, path)
    elif element.depth == 0 and kind in SECTIONS_OF_TABLES:
        count = len(names(study.document, kind))
        note = str(count) if count else "none"
    elif path == FIRST:
        note = " ".join(languages_of(study.document)).upper()
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


SECTIONS_OF_TABLES: Final = frozenset(ICONS) - {*OWN, "study", "device", "scene", "limits", "analysis"}


MOST_FIELDS: Final = 12
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
    there = languages_of(study.document)
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
    listed = (
        named_at(study.document, (*row.path, at))
        for row in lists
        for at in range(len(row.value if isinstance(row.value, tuple) else ()))
    )
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


WIDTH, HIGHEST, ROW_PX, HELP_PX = 360, 520, 34, 78
MOVES = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)


class AddList(Themed, QFrame):
    """A list over the place; ``chosen`` carries an `Addable`, ``typed`` the words that it is filtered by."""

    chosen = Signal(object)
    typed = Signal(str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setAccessibleName("Add")
        self.setProperty("role", "card")
        self._every: tuple[Addable, ...] = ()
        self._fields: tuple[Addable, ...] = ()
        self.words = QLineEdit()
        self.words.setFont(font("label", weight=400))
        self.words.setProperty("dense", "true")
        self.words.setFixedHeight(36)
        self.words.setPlaceholderText("Type to filter")
        self.words.setAccessibleName("Filter what can be added")
        self.list = QListWidget()
        self.list.setAccessibleName("What can be added")
        self.list.setProperty("role", "links")
        self.list.setFont(font("label"))
        self.list.setFrameShape(QFrame.Shape.NoFrame)
        self.list.setIconSize(QSize(18, 18))
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.help = label("", "small", "text2", wraps=True)
        self.help.setMinimumHeight(HELP_PX)
        self.help.setAlignment(Qt.AlignmentFlag.AlignTop)
        vbox(self.words, (self.list, 1), self.help, spacing=8, margins=10, parent=self)
        self.words.textChanged.connect(self._type)
        self.words.installEventFilter(self)
        self.list.currentItemChanged.connect(lambda item: self.help.setText(item.toolTip() if item else ""))
        self.list.itemClicked.connect(lambda _item: self._choose())
        self.list.itemActivated.connect(lambda _item: self._choose())

    def open(self, every: tuple[Addable, ...], above: QPoint) -> None:
        """Show what can be added, with its lower left corner at a place of the screen."""
        self._every = every
        self.words.clear()
        self._type("")
        height = min(HIGHEST, 82 + HELP_PX + ROW_PX * len(every))
        screen = self.screen().availableGeometry()
        at = QPoint(min(above.x(), screen.right() - WIDTH), max(screen.top(), above.y() - height))
        self.setGeometry(at.x(), at.y(), WIDTH, height)
        self.show()
        self.words.setFocus(Qt.FocusReason.PopupFocusReason)

    def offer_fields(self, fields: tuple[Addable, ...]) -> None:
        """Take the fields that have the words that were ``typed``; they come last."""
        self._fields = fields

    def _type(self, words: str) -> None:
        self._fields = ()
        self.typed.emit(words)
        wanted = words_sought(words)
        self.list.clear()
        fitting = [one for one in self._every if all(part in f"{one.words} {one.help}".casefold() for part in wanted)]
        typed = words.casefold().split()
        fitting.sort(key=lambda one: one.words.casefold().split()[: len(typed)] != typed)  # whole words come first
        for one in (*fitting, *self._fields):
            item = QListWidgetItem(icon(one.icon, self.theme.text2, 18), one.words)
            item.setData(Qt.ItemDataRole.UserRole, one)
            item.setToolTip(one.help)
            item.setData(Qt.ItemDataRole.AccessibleDescriptionRole, one.help)
            item.setSizeHint(QSize(WIDTH - 40, ROW_PX))
            self.list.addItem(item)
        self.list.setCurrentRow(0)
        if not self.list.count():
            self.help.setText("Nothing that can be added here has this name")

    def _choose(self) -> None:
        if (item := self.list.currentItem()) is not None:
            self.close()
            self.chosen.emit(item.data(Qt.ItemDataRole.UserRole))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            if event.key() in MOVES:
                self.list.keyPressEvent(event)
                return True
            if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
                self._choose()
                return True
        return super().eventFilter(watched, event)

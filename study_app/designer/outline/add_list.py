"""What can be added to a study where one is, as a list that is filtered by typing."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

from PySide6.QtCore import QEvent, QObject, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QLineEdit, QListWidget, QListWidgetItem, QWidget

from study_app.designer.document.additions import number_rows
from study_app.designer.document.changes import languages_of
from study_app.designer.document.elements import found_fields, title_of, words_sought
from study_app.designer.document.fields import label_of, node_at, row_at, rows, singular, tags
from study_app.designer.document.names import named_at
from study_app.designer.document.steps import AddElement, AddInstrument, ChangeLanguage, Do, GoTo
from study_app.designer.document.study import Study
from study_app.designer.outline.outline_rows import icon_of
from study_app.gui.theme.icons import icon
from study_app.gui.theme.theme import Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import vbox
from study_app.gui.widgets.labels import label
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

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        row = f"border-radius: 6px; color: {theme.text};"
        chosen = f"background: {theme.selected}; color: {theme.accent};"
        self.list.setStyleSheet(f"QListWidget::item {{ {row} }} QListWidget::item:selected {{ {chosen} }}")

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

"""Cards over the place: questions before a step."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QSignalBlocker, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QHeaderView, QScrollArea, QTableWidget, QTableWidgetItem, QWidget

from study_app.designer.document.additions import check_values, number_row, number_rows, titles_with
from study_app.designer.document.elements import element_of, kind_and_title, title_of
from study_app.designer.document.fields import label_of, left_without, references_to, with_references
from study_app.designer.document.steps import DeleteElement, MakeSeries, index_of, titles_of
from study_app.designer.document.study import Study
from study_app.designer.document.toml_text import Refused
from study_app.designer.place.segments import dense
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.labels import label
from study_app.number_text import exact_text, typed_numbers
from study_app.protocol.source.document import Path, names, value_at

HIGHEST = 560
PLACES_PX = 200
TABLE_PX = 190


class Prompt(Card):
    """A question with a way back; ``answered`` carries what was chosen, ``given_up`` comes at Cancel and Esc."""

    answered = Signal(object)
    given_up = Signal()

    def __init__(self, title: str, explanation: str) -> None:
        super().__init__(title, padding=20, gap=10)
        self.setAccessibleName(title)
        self.setMaximumHeight(HIGHEST)
        said = label(explanation, "body", "text2", wraps=True)
        self.column.addWidget(said)
        self.cancel = ActionButton("", "Cancel", height=40)
        self.cancel.clicked.connect(self.given_up)
        self.buttons = hbox(self.cancel, STRETCH, spacing=10)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.given_up.emit()
        else:
            super().keyPressEvent(event)


@dataclass(frozen=True, slots=True)
class DeletePrompt:
    """What refers to an element that is to be deleted."""

    path: Path  # the element
    title: str  # what it is called
    references: tuple[str, ...]  # the places that name it, in words
    others: tuple[tuple[str, str], ...] = ()  # id and title of what could be named in its place
    also: tuple[Path, ...] = ()  # others that are deleted with it
    together: tuple[str, ...] = ()  # elements that cannot be without it, with kind and title


def delete_prompt(study: Study, paths: Sequence[Path]) -> DeletePrompt:
    """Return what names elements that are to be deleted, and what could be named in the place of a single one."""
    document, path = study.document, paths[0]
    named = (place for one in paths for place in references_to(document, one))
    places = (*named, *left_without(document, paths))
    outside = [place for place in places if not any(place[: len(one)] == one for one in paths)]
    references = (f"{kind_and_title(document, element_of(study, place))}: {_field(study, place)}" for place in outside)
    gone = {one: None for each in paths for one in with_references(document, each, study.needs)}
    elements = (one for one in gone if one not in paths and len(one) == 2 and isinstance(one[1], str))
    together = tuple(kind_and_title(document, one) for one in elements)
    others = (name for name in names(document, str(path[0])) if name != path[-1] and len(path) == 2)
    titles = tuple((name, title_of(document, (path[0], name))) for name in others) if len(paths) == 1 else ()
    words = tuple(dict.fromkeys(references))
    return DeletePrompt(path, titles_of(study, paths), words, titles, tuple(paths[1:]), together)


def _field(study: Study, place: Path) -> str:
    inside = ", ".join(label_of(step) for step in place[len(element_of(study, place)) :])
    if value_at(study.document, place) is None:
        return f"{inside} (the only one)"
    return inside or f"entry {index_of(place) + 1}"


class DeleteCard(Prompt):
    """What names an element that is to be deleted, and what becomes of it."""

    def __init__(self, asked: DeletePrompt) -> None:
        count = len(asked.references)
        places = "It is used in 1 place:" if count == 1 else f"It is used in {count} places:"
        super().__init__(f"Delete {asked.title}?", places)
        inside = QWidget()
        vbox(*(label(words, "label") for words in asked.references), margins=0, parent=inside)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        area.setWidget(inside)
        area.setFixedHeight(min(PLACES_PX, inside.sizeHint().height()))
        self.column.addWidget(area)
        if asked.together:
            self.column.addWidget(label(f"Also deletes: {', '.join(asked.together)}.", "label", wraps=True))
        self.all = ActionButton("trash", "Delete them too", role="danger", height=40)
        self.all.clicked.connect(lambda: self.answered.emit(DeleteElement(asked.path, "all", also=asked.also)))
        self.gaps = ActionButton("", "Leave the gaps", height=40)
        self.gaps.clicked.connect(lambda: self.answered.emit(DeleteElement(asked.path, "gaps", also=asked.also)))
        self.other = dense(Choice(), "Use another one in its place", 40)
        self.other.setPlaceholderText("Use another …")
        self.other.setMinimumWidth(180)
        for name, title in asked.others:
            self.other.addItem(f"{title} ({name})", name)
        self.other.setCurrentIndex(-1)
        self.other.activated.connect(
            lambda at: self.answered.emit(DeleteElement(asked.path, "other", self.other.itemData(at)))
        )
        add_parts(self.buttons, self.gaps, self.other, self.all)
        add_layout(self.column, self.buttons)
        self.other.setVisible(bool(asked.others))
        self.first: QWidget = self.all


class ConfirmCard(Prompt):
    """Whether something is done that breaks or loses something; ``answered`` comes where it is."""

    def __init__(self, title: str, explanation: str, action: str, icon: str = "", breaks: Sequence[str] = ()) -> None:
        super().__init__(title, explanation)
        add_parts(self.column, *(label(f"•  {words}", "label", wraps=True) for words in breaks))
        self.go_on = ActionButton(icon, action, role="danger", height=40)
        self.go_on.clicked.connect(lambda: self.answered.emit(action))
        self.buttons.addWidget(self.go_on)
        add_layout(self.column, self.buttons)
        self.first: QWidget = self.cancel


@dataclass(frozen=True, slots=True)
class SeriesPrompt:
    """The element that is copied, its title, and the path and label with unit of each of its numbers."""

    path: Path
    title: str
    fields: tuple[tuple[Path, str], ...]


def series_prompt(study: Study, path: Path) -> SeriesPrompt | None:
    """Return what the prompt for a series shows; None for an element without numbers."""
    fields = []
    for row in number_rows(study.document, path):
        words = ", ".join(label_of(step) for step in row.path[2:])
        fields.append((row.path, f"{words} [{row.unit}]" if row.unit else words))
    return SeriesPrompt(path, title_of(study.document, path), tuple(fields)) if fields else None


def series_titles(study: Study, asked: MakeSeries) -> tuple[tuple[str, ...], str]:
    """Return the title of each copy of a series; where there can be no copies with these values, why."""
    row = number_row(study.document, asked.path, asked.field)
    try:
        check_values(study.document, row, asked.values)
    except Refused as refusal:
        return (), f"{str(refusal)[:1].upper()}{str(refusal)[1:]}."
    own = title_of(study.document, asked.path)
    shown = []
    for value in asked.values:
        titles = dict(titles_with(study.document, asked.path, row, value))
        shown.append(next(iter(titles.values()), f"{own}, {exact_text(value)} {row.unit}".rstrip()))
    return tuple(shown), ""


class SeriesCard(Prompt):
    """Which number of an element differs in its copies, and a table with a line for each copy, filled in by the user.

    A value in the last line adds a line; several values in one cell fill the lines below. ``titles`` returns the
    titles of the copies, or none and why there can be none.
    """

    def __init__(self, asked: SeriesPrompt, titles: Callable[[MakeSeries], tuple[tuple[str, ...], str]]) -> None:
        super().__init__(
            f"Series of {asked.title}",
            f"Type a value for each copy of {asked.title}; copies are listed in the blocks that list the original.",
        )
        self.asked, self._titles = asked, titles
        self.number = dense(Choice(), "Number that differs")
        self.number.addItems([words for _, words in asked.fields])
        self.table = QTableWidget(1, 2)
        self.table.setFont(font("label"))
        self.table.setAccessibleName("Values of the copies")
        self.table.setFixedHeight(TABLE_PX)
        self.table.setTabKeyNavigation(False)
        self.table.setEditTriggers(QTableWidget.EditTrigger.AllEditTriggers)
        self.table.setFrameShape(QFrame.Shape.StyledPanel)
        self.table.setShowGrid(True)
        self.table.verticalHeader().hide()
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        add_layout(self.column, hbox(self.number, STRETCH, spacing=10))
        self.column.addWidget(self.table)
        self.refusal = label("", "label", "bad", wraps=True)
        self.column.addWidget(self.refusal)
        self.make = ActionButton("bars", "Make the copies", role="primary", height=40)
        self.make.clicked.connect(lambda: self.answered.emit(self._request()))
        self.buttons.addWidget(self.make)
        add_layout(self.column, self.buttons)
        self.table.cellChanged.connect(self._fill_in)
        self.number.activated.connect(lambda _at: self._show())
        self.first: QWidget = self.table
        self._show()
        QTimer.singleShot(0, self.table, lambda: self.table.setCurrentCell(0, 0))  # opens its editor

    def _cell(self, row: int) -> str:
        item = self.table.item(row, 0)
        return "" if item is None else item.text().strip()

    def _fill_in(self, row: int, _column: int) -> None:
        """Put several values into lines of their own, and go to the next line."""
        try:
            several = [words for words, _ in typed_numbers(self._cell(row))] or [""]
        except ValueError:
            several = [self._cell(row)]
        with QSignalBlocker(self.table):
            self.table.setRowCount(max(self.table.rowCount(), row + len(several)))
            for at, words in enumerate(several):
                self.table.setItem(row + at, 0, QTableWidgetItem(words))
        self._show()
        self.table.setCurrentCell(min(row + len(several), self.table.rowCount() - 1), 0)

    def _request(self) -> MakeSeries:
        cells = filter(None, map(self._cell, range(self.table.rowCount())))
        values = tuple(value for words in cells for _, value in typed_numbers(words))
        return MakeSeries(self.asked.path, self.asked.fields[self.number.currentIndex()][0], values)

    def _show(self) -> None:
        titles: tuple[str, ...] = ()
        why, filled = "", [row for row in range(self.table.rowCount()) if self._cell(row)]
        try:
            if filled:
                titles, why = self._titles(self._request())
        except ValueError as unclear:
            why = f"{unclear}."
        with QSignalBlocker(self.table):
            if len(filled) == self.table.rowCount():
                self.table.insertRow(len(filled))
            self.table.setHorizontalHeaderLabels([self.number.currentText(), "Copy"])
            shown = dict(zip(filled, titles, strict=True)) if titles else {}
            for row in range(self.table.rowCount()):
                title = QTableWidgetItem(shown.get(row, ""))
                title.setFlags(Qt.ItemFlag.ItemIsEnabled)
                self.table.setItem(row, 1, title)
        self.refusal.setText(why)
        self.table.setAccessibleDescription(why)
        self.make.setEnabled(bool(titles))

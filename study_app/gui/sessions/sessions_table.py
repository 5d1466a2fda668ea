"""A table of sessions: who, which study, when, how it ended, whether it kept to the limits, how much of it is there."""

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, Qt, Signal
from PySide6.QtWidgets import QWidget

from study_app.gui.sessions.session_facts import (
    Column,
    SessionFacts,
    answers_words,
    incidents,
    started_words,
    status_chip,
    validity_chip,
)
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import vbox
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.row_table import BELOW_ROLE, CARE_ROLE, CHIP_ROLE, MARGIN, Index, Table

NOWHERE = QModelIndex()


class SessionsModel(QAbstractTableModel):
    """Sessions as rows of a table; only those that match are in it."""

    def __init__(self, columns: Sequence[Column]) -> None:
        super().__init__()
        self.columns = tuple(columns)
        self._every: tuple[SessionFacts, ...] = ()
        self._matches: Callable[[SessionFacts], bool] = lambda _facts: True
        self._now = datetime.now().astimezone()
        self.shown: tuple[SessionFacts, ...] = ()

    def show(self, found: Sequence[SessionFacts], now: datetime) -> None:
        self._every, self._now = tuple(found), now
        self.keep(self._matches)

    def keep(self, matches: Callable[[SessionFacts], bool]) -> None:
        """Show the sessions alone that match, now and later."""
        self.beginResetModel()
        self._matches = matches
        self.shown = tuple(filter(matches, self._every))
        self.endResetModel()

    def rowCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(self.shown)

    def columnCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(self.columns)

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Return a column's heading; of a row, whose session it is."""
        if role == Qt.ItemDataRole.DisplayRole:
            return self.columns[section].heading if orientation == Qt.Orientation.Horizontal else None
        return None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        facts, name = self.shown[index.row()], self.columns[index.column()].name
        chip = {"status": status_chip, "validity": validity_chip}.get(name)
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return chip(facts)[2] if chip else self._words(facts, name)
            case Qt.ItemDataRole.AccessibleTextRole:
                words = chip(facts)[2] if chip else self._words(facts, name)
                return ", ".join(filter(None, (words, self._below(facts, name))))
            case Qt.ItemDataRole.ToolTipRole:
                if name == "version" and facts.version:
                    return f"Show what changed in the study since version {facts.version}"
                if name == "validity" and facts.excluded is not None:
                    return f"Excluded from the analysis: {facts.excluded}"
                said = f"{facts.name}: began {started_words(facts.started, self._now)}, {answers_words(facts)} answers"
                return ", ".join(filter(None, (said, incidents(facts))))
            case Qt.ItemDataRole.FontRole if name == "participant":
                return font("label", weight=600, scale=1.08)
            case Qt.ItemDataRole.FontRole if name == "version":
                face = font("label", weight=400, tabular=True)
                face.setUnderline(True)
                return face
            case _ if role == CHIP_ROLE:
                return chip(facts) if chip else None
            case _ if role == BELOW_ROLE:
                return self._below(facts, name)
            case _ if role == CARE_ROLE:
                return facts.needs_care
        return None

    def _below(self, facts: SessionFacts, name: str) -> str:
        """Return the small words below a cell's: its kind of session, and what happened to its device or outlets."""
        if name == "status" and facts.reconnected:
            return "device reconnected"
        if name == "status" and facts.outlets_lost:
            return "outlet failed"
        return facts.kind if name == "study" else ""

    def _words(self, facts: SessionFacts, name: str) -> str:
        match name:
            case "participant":
                return facts.name
            case "study":
                return facts.study
            case "started":
                return started_words(facts.started, self._now)
            case "version":
                return facts.version
        return answers_words(facts)


class SessionsTable(QWidget):
    """The table of sessions, or a sentence in its place; ``opened`` carries the `SessionFacts` of a row.

    ``version_asked`` carries those of the row whose version was clicked; ``chosen_changed`` comes when another row, or
    none, is chosen.

    Parameters
    ----------
    none : the sentence in place of rows where there are none
    """

    opened = Signal(object)
    version_asked = Signal(object)
    chosen_changed = Signal()

    def __init__(self, columns: Sequence[Column], none: str) -> None:
        super().__init__()
        self.model = SessionsModel(columns)
        self.table = Table(self.model, [(column.width, column.least) for column in columns], "Sessions")
        self.none = label(none, "body", "text2", wraps=True)
        self.none.setContentsMargins(MARGIN, MARGIN, MARGIN, MARGIN)
        vbox(self.none, (self.table, 1), spacing=0, margins=0, parent=self)
        self.table.opened.connect(lambda index: self.opened.emit(self.model.shown[index.row()]))
        self.table.clicked.connect(self._click)
        self.table.selectionModel().selectionChanged.connect(lambda *_changes: self.chosen_changed.emit())
        self.model.modelReset.connect(self._tell_rows)
        self._tell_rows()

    @property
    def shown(self) -> tuple[SessionFacts, ...]:
        return self.model.shown

    @property
    def chosen(self) -> SessionFacts | None:
        row = self.table.chosen_row
        return None if row is None else self.model.shown[row]

    def show_rows(self, found: Sequence[SessionFacts], now: datetime) -> None:
        """Show these sessions in place of those before; the one that was chosen stays so."""
        before = self.chosen
        self.model.show(found, now)
        self._choose(before)

    def show_matching(self, matches: Callable[[SessionFacts], bool]) -> None:
        before = self.chosen
        self.model.keep(matches)
        self._choose(before)

    def open_chosen(self) -> None:
        if self.chosen is not None:
            self.opened.emit(self.chosen)

    def ask_for_version(self) -> None:
        if self.chosen is not None and self.chosen.version:
            self.version_asked.emit(self.chosen)

    def _click(self, index: Index) -> None:
        facts = self.model.shown[index.row()]
        if self.model.columns[index.column()].name == "version" and facts.version:
            self.version_asked.emit(facts)

    def _choose(self, before: SessionFacts | None) -> None:
        places = [one.folder for one in self.shown]
        if before is not None and before.folder in places:
            self.table.selectRow(places.index(before.folder))
        self.chosen_changed.emit()

    def _tell_rows(self) -> None:
        self.none.setVisible(not self.shown)
        self.table.setVisible(bool(self.shown))

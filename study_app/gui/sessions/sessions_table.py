"""The table of sessions: participant, study, start, status, validity and answers."""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QWidget

from study_app.gui.sessions.session_facts import (
    Column,
    SessionFacts,
    answers_text,
    incidents_text,
    start_time_text,
    status_chip,
    validity_chip,
)
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import vbox
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.row_table import BELOW_ROLE, CARE_ROLE, CHIP_ROLE, MARGIN, Index, Rows, Table

_ROLE = Qt.ItemDataRole


def _session_cell(facts: SessionFacts, name: str, now: datetime) -> dict[int, Any]:
    """Return the values of a session's cell in the column ``name``, by their roles."""
    chip = {"status": status_chip, "validity": validity_chip}.get(name)
    incident = "device reconnected" if facts.reconnected else "outlet failed" if facts.outlets_lost else ""
    missing = facts.missing
    incident = missing.brief if missing else incident
    below = {"participant": facts.group, "status": incident, "study": facts.kind}.get(name, "")
    began = start_time_text(facts.started, now)
    summary = f"{facts.name}: began {began}, {answers_text(facts)} answers"
    tip, face = ", ".join(filter(None, (summary, str(missing or ""), incidents_text(facts)))), None
    match name:
        case "participant":
            text, face = facts.name, font("label", weight=600, scale=1.08)
        case "study":
            text = facts.study
        case "started":
            text = began
        case "version":
            text, face = facts.version, font("label", weight=400, tabular=True)
            face.setUnderline(True)
            tip = f"Show what has changed in the study since version {text}" if text else tip
        case _:
            text = answers_text(facts) if chip is None else chip(facts)[2]
    if name == "validity" and facts.excluded is not None:
        tip = f"Excluded from the analysis: {facts.excluded}"
    return {
        _ROLE.DisplayRole: text,
        _ROLE.AccessibleTextRole: ", ".join(filter(None, (text, below))),
        _ROLE.ToolTipRole: tip,
        _ROLE.FontRole: face,
        CHIP_ROLE: None if chip is None else chip(facts),
        BELOW_ROLE: below,
        CARE_ROLE: facts.needs_care,
    }


class SessionsTable(QWidget):
    """The table of sessions, or a sentence if there are none; ``opened`` carries the `SessionFacts` of a row.

    ``version_asked`` carries those of a row whose version was clicked; ``chosen_changed`` is emitted when another row,
    or none, is selected.

    Parameters
    ----------
    none : the sentence shown if there are no rows
    """

    opened = Signal(object)
    version_asked = Signal(object)
    chosen_changed = Signal()

    def __init__(self, columns: Sequence[Column], none: str) -> None:
        super().__init__()
        self._names = [column.name for column in columns]
        self._now = datetime.now().astimezone()
        headings: dict[str, str] = {column.name: column.heading for column in columns}
        self.model = Rows(headings, lambda facts, name: _session_cell(facts, name, self._now))
        self.table = Table(self.model, [(column.width, column.least) for column in columns], "Sessions")
        self.none = label(none, "body", "text2", wraps=True)
        self.none.setContentsMargins(MARGIN, MARGIN, MARGIN, MARGIN)
        vbox(self.none, (self.table, 1), spacing=0, margins=0, parent=self)
        self.table.opened.connect(lambda index: self.opened.emit(self.shown[index.row()]))
        self.table.clicked.connect(self._open_version)
        self.table.selectionModel().selectionChanged.connect(lambda *_changes: self.chosen_changed.emit())
        self.model.modelReset.connect(self._update_visibility)
        self._update_visibility()

    @property
    def shown(self) -> tuple[SessionFacts, ...]:
        return self.model.rows

    @property
    def chosen(self) -> SessionFacts | None:
        row = self.table.chosen_row
        return None if row is None else self.shown[row]

    def show_rows(self, sessions: Iterable[SessionFacts], now: datetime) -> None:
        """Show sessions, and keep the selection."""
        selected, self._now = self.chosen, now
        self.model.show(sessions)
        folders = [session.folder for session in self.shown]
        if selected is not None and selected.folder in folders:
            self.table.selectRow(folders.index(selected.folder))
        self.chosen_changed.emit()

    def open_chosen(self) -> None:
        if self.chosen is not None:
            self.opened.emit(self.chosen)

    def ask_for_version(self) -> None:
        if self.chosen is not None and self.chosen.version:
            self.version_asked.emit(self.chosen)

    def _open_version(self, index: Index) -> None:
        if self._names[index.column()] == "version":
            self.ask_for_version()

    def _update_visibility(self) -> None:
        self.none.setVisible(not self.shown)
        self.table.setVisible(bool(self.shown))

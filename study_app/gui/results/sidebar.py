"""The sidebar of the figures: the sessions with their filters, and what is excluded from the analysis."""

from collections.abc import Sequence
from datetime import datetime

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import QLineEdit, QScrollArea, QSizePolicy, QWidget

from study_app.gui.sessions.sessions_table import SessionsTable
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import apply_theme_within, remove_widget
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Rule
from study_app.gui.widgets.controls import ActionButton, Choice, IconButton
from study_app.gui.widgets.labels import label
from study_app.viewmodels.results import LeftOut, in_figures
from study_app.viewmodels.session.columns import Column, matching, states_of
from study_app.viewmodels.sessions import SessionFacts, started_words

COLUMNS = (
    Column("participant", "Participant", 90, 76),
    Column("status", "Status", 120, 112),
    Column("validity", "Validity", 110, 114),
    Column("version", "Version", 60, 60),
)
EVERY = "All states"


class SessionsCard(Card):
    """The study's sessions; below, how many are in the figures and why the others are not."""

    def __init__(self) -> None:
        super().__init__(gap=8, padding=14)
        self.column.setContentsMargins(12, self.column.contentsMargins().top(), 12, 14)
        self.search = QLineEdit()
        self.search.setPlaceholderText("Participant")
        self.search.setAccessibleName("Search by participant")
        self.search.setClearButtonEnabled(True)
        self.search.setFont(font("body"))
        self.state = Choice()
        self.state.setAccessibleName("State")
        self.state.setFont(font("body"))
        self.state.addItem(EVERY, "")
        self._none = ""
        self.rows = SessionsTable(COLUMNS, "")
        self.head = label("", "label")
        self.head.setFont(font("label", weight=600, tabular=True))
        self.why = label("", "small", "text2", wraps=True)
        self.details = IconButton("file", "Details of the selected session", size=36, role="plain")
        self.details.setEnabled(False)
        self.details.clicked.connect(self.rows.open_chosen)
        words = "What changed in the study since the selected session"
        self.version = IconButton("designer", words, size=36, role="plain")
        self.version.setEnabled(False)
        self.version.clicked.connect(self.rows.ask_for_version)
        self.rows.chosen_changed.connect(self._enable)
        filters = hbox((self.search, 1), (self.state, 1), self.details, self.version, spacing=8)
        foot = vbox(self.head, self.why, spacing=2, margins=(10, 2, 10, 0))
        add_parts(self.column, filters, (self.rows, 1), Rule(), foot)
        self.search.textChanged.connect(self._filter)
        self.state.currentIndexChanged.connect(self._filter)

    def _enable(self) -> None:
        chosen = self.rows.chosen
        self.details.setEnabled(chosen is not None)
        self.version.setEnabled(chosen is not None and bool(chosen.version))

    def show_sessions(self, found: Sequence[SessionFacts], none: str = "No sessions.") -> None:
        """Show these sessions in place of those before, or the words ``none`` in their place; the filters stay."""
        self._none = none
        self.rows.show_rows(found, datetime.now().astimezone())
        chosen = self.state.currentData()
        with QSignalBlocker(self.state):
            self.state.clear()
            self.state.addItem(EVERY, "")
            for state, words in states_of(found):
                self.state.addItem(words, state)
            self.state.setCurrentIndex(max(0, self.state.findData(chosen)))
        head, why = in_figures(found)
        self.head.setText(head)
        self.why.setText(why)
        self.why.setVisible(bool(why))
        self._filter()

    def _filter(self) -> None:
        state = str(self.state.currentData() or "")
        filtered = bool(state or self.search.text().strip())
        self.rows.none.setText("No session matches." if filtered else self._none)
        self.rows.show_matching(matching(self.search.text(), state))


class ExclusionsCard(Card):
    """What is left out, each with its reason.

    ``leave_out_asked`` is to leave out more, ``take_back_asked`` carries the `LeftOut` that is to count again.
    """

    leave_out_asked = Signal()
    take_back_asked = Signal(object)
    list_asked = Signal()

    def __init__(self) -> None:
        self.leave_out = ActionButton("minus", "Exclude …", height=36)
        super().__init__("Excluded", self.leave_out, padding=14, gap=6)
        self.none = label("Nothing is excluded from the analysis.", "label", "text2", wraps=True)
        self.none.setFont(font("label", weight=400))
        self.open = ActionButton("file", "Open the list", role="plain", height=30)
        self.leave_out.clicked.connect(self.leave_out_asked)
        self.open.clicked.connect(self.list_asked)
        inside = QWidget()
        self._rows = vbox(STRETCH, spacing=8, margins=0, parent=inside)
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.area.setWidget(inside)
        self.area.setAccessibleName("Excluded")
        self.area.setMinimumHeight(96)
        self.lines: list[QWidget] = []
        add_parts(self.column, self.none, (self.area, 1), hbox(STRETCH, self.open))
        self.show_left_out(())

    def show_left_out(self, listed: Sequence[LeftOut]) -> None:
        """Show what is left out, the last decision first; the keyboard does not leave with a line."""
        at = self.window().focusWidget()
        if at is not None and any(line.isAncestorOf(at) for line in self.lines):
            self.leave_out.setFocus()
        for line in self.lines:
            remove_widget(line)
        self.lines = [self._line(one) for one in reversed(listed)]
        for place, line in enumerate(self.lines):
            apply_theme_within(line, self.theme)
            self._rows.insertWidget(place, line)
        self.none.setVisible(not listed)
        for part in (self.area, self.open):
            part.setVisible(bool(listed))
        grows = QSizePolicy.Policy.Preferred if listed else QSizePolicy.Policy.Maximum
        self.setSizePolicy(QSizePolicy.Policy.Preferred, grows)

    def _line(self, one: LeftOut) -> QWidget:
        """Return one decision with the way to take it back."""
        back = ActionButton("undo", "Include again …", role="plain", height=30)
        back.setAccessibleName(f"Include again: {one.what}")
        back.clicked.connect(lambda: self.take_back_asked.emit(one))
        return _line(one, back)


def _line(one: LeftOut, back: ActionButton) -> QWidget:
    """Return one decision: what, why, who and when."""
    made = QWidget()
    what = label(one.what, "label", wraps=True)
    what.setFont(font("label", weight=600))
    why = label(one.reason, "label", "text2", wraps=True)
    why.setFont(font("label", weight=400))
    now = datetime.now().astimezone()
    when = "" if one.at is None else f", {started_words(one.at.astimezone(now.tzinfo), now)}"
    who = label(f"{one.by}{when}", "small", "text2")
    vbox(hbox((what, 1), back), why, who, spacing=0, margins=(0, 0, 6, 0), parent=made)
    made.setAccessibleName(f"{one.what}: {one.reason} ({one.by}{when})")
    return made

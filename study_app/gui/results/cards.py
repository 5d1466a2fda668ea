"""The cards beside the figures: the study's sessions, and its exclusions."""

from collections.abc import Sequence
from datetime import datetime

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import QLineEdit, QScrollArea, QSizePolicy, QWidget

from study_app.gui.results.figures import exclusion_text, figure_counts, time_of
from study_app.gui.sessions.session_facts import Column, SessionFacts, occurring_states, session_filter, start_time_text
from study_app.gui.sessions.sessions_table import SessionsTable
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import remove_widget
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Rule
from study_app.gui.widgets.controls import ActionButton, Choice, IconButton
from study_app.gui.widgets.labels import label
from study_app.store.exclusions import Exclusion

_COLUMNS = (
    Column("participant", "Participant", 108, 98),
    Column("status", "Status", 112, 108),
    Column("validity", "Validity", 100, 102),
    Column("version", "Version", 60, 56),
)
_ALL_STATES = "All states"


class SessionsCard(Card):
    """The card with the study's sessions, how many are in the figures, and why others are not."""

    def __init__(self) -> None:
        super().__init__(gap=8, padding=14)
        self.column.setContentsMargins(12, self.column.contentsMargins().top(), 12, 14)
        self.search = QLineEdit(placeholderText="Participant", clearButtonEnabled=True)
        self.search.setAccessibleName("Search by participant")
        self.search.setFont(font("body"))
        self.state = Choice()
        self.state.setAccessibleName("State")
        self.state.setFont(font("body"))
        self.state.addItem(_ALL_STATES, "")
        self._none = ""
        self._sessions: tuple[SessionFacts, ...] = ()
        self._now = datetime.now().astimezone()
        self.rows = SessionsTable(_COLUMNS, "")
        self.head = label("", "label", weight=600, tabular=True)
        self.why = label("", "small", "text2", wraps=True)
        self.details = IconButton("file", "Details of the selected session", size=36, role="plain")
        self.details.setEnabled(False)
        self.details.clicked.connect(self.rows.open_chosen)
        tip = "Changes in the study since the selected session"
        self.version = IconButton("designer", tip, size=36, role="plain")
        self.version.setEnabled(False)
        self.version.clicked.connect(self.rows.ask_for_version)
        self.rows.chosen_changed.connect(self._update_buttons)
        filters = hbox((self.search, 1), (self.state, 1), self.details, self.version, spacing=8)
        foot = vbox(self.head, self.why, spacing=2, margins=(10, 2, 10, 0))
        add_parts(self.column, filters, (self.rows, 1), Rule(), foot)
        self.search.textChanged.connect(self._apply_filter)
        self.state.currentIndexChanged.connect(self._apply_filter)

    def _update_buttons(self) -> None:
        chosen = self.rows.chosen
        self.details.setEnabled(chosen is not None)
        self.version.setEnabled(chosen is not None and bool(chosen.version))

    def show_sessions(self, sessions: Sequence[SessionFacts], none: str = "No sessions.") -> None:
        """Show the sessions, or the text ``none`` if there are none; the filters are kept."""
        self._none = none
        self._sessions, self._now = tuple(sessions), datetime.now().astimezone()
        has_groups = any(session.group for session in sessions)
        self.search.setPlaceholderText("Participant or group" if has_groups else "Participant")
        chosen = self.state.currentData()
        with QSignalBlocker(self.state):
            self.state.clear()
            self.state.addItem(_ALL_STATES, "")
            for state, text in occurring_states(sessions):
                self.state.addItem(text, state)
            self.state.setCurrentIndex(max(0, self.state.findData(chosen)))
        head, why = figure_counts(sessions)
        self.head.setText(head)
        self.why.setText(why)
        self.why.setVisible(bool(why))
        self._apply_filter()

    def _apply_filter(self) -> None:
        state = str(self.state.currentData() or "")
        filtered = bool(state or self.search.text().strip())
        self.rows.none.setText("No session matches." if filtered else self._none)
        self.rows.show_rows(filter(session_filter(self.search.text(), state), self._sessions), self._now)


class ExclusionsCard(Card):
    """The card with the exclusions and their reasons.

    ``take_back_asked`` carries the `Exclusion` to reverse, or a proposed one to reject; ``exclude_asked`` carries a
    proposed one to accept.
    """

    take_back_asked = Signal(object)
    exclude_asked = Signal(object)

    def __init__(self) -> None:
        self.leave_out = ActionButton("minus", "Exclude…", height=36)
        super().__init__("Excluded", self.leave_out, padding=14, gap=6)
        self.summary = label("", "label", "text2", wraps=True, weight=400)
        self.open = ActionButton("file", "Open the list", role="plain", height=30)
        inside = QWidget()
        self._rows = vbox(STRETCH, spacing=8, margins=0, parent=inside)
        self.area = QScrollArea(widgetResizable=True)
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.area.setWidget(inside)
        self.area.setAccessibleName("Excluded")
        self.area.setMinimumHeight(96)
        self.lines: list[QWidget] = []
        add_parts(self.column, self.summary, (self.area, 1), hbox(STRETCH, self.open))
        self.show_left_out(())

    def show_left_out(
        self, listed: Sequence[Exclusion], proposed: Sequence[Exclusion] = (), rules: Sequence[str] = ()
    ) -> None:
        """Show sentences about planned rules, then the exclusions: proposed ones first, then the latest.

        If a line with the focus is removed, the button *Exclude* gets the focus.
        """
        self.open.setVisible(bool(listed))
        listed = (*listed, *reversed(proposed))
        focused = self.window().focusWidget()
        if focused is not None and any(line.isAncestorOf(focused) for line in self.lines):
            self.leave_out.setFocus()
        for line in self.lines:
            remove_widget(line)
        self.lines = [self._exclusion_row(exclusion) for exclusion in reversed(listed)]
        for index, line in enumerate(self.lines):
            self._rows.insertWidget(index, line)
        none = () if listed else ("Nothing is excluded from the analysis.",)
        self.summary.setText("\n".join((*none, *rules)))
        self.summary.setVisible(bool(self.summary.text()))
        self.area.setVisible(bool(listed))
        policy = QSizePolicy.Policy.Preferred if listed else QSizePolicy.Policy.Maximum
        self.setSizePolicy(QSizePolicy.Policy.Preferred, policy)

    def _exclusion_row(self, exclusion: Exclusion) -> QWidget:
        """Return the row of an exclusion: its subject, reason, author and time, or the rule that proposes it."""
        proposed = not exclusion.excluded_at
        back = ActionButton("undo", "Keep…" if proposed else "Include again…", role="plain", height=30)
        back.setAccessibleName(f"{'Keep' if proposed else 'Include again'}: {exclusion_text(exclusion)}")
        back.clicked.connect(lambda: self.take_back_asked.emit(exclusion))
        buttons = [back]
        if proposed:
            out = ActionButton("minus", "Exclude…", role="plain", height=30)
            out.setAccessibleName(f"Exclude: {exclusion_text(exclusion)}")
            out.clicked.connect(lambda: self.exclude_asked.emit(exclusion))
            buttons.insert(0, out)
        row = QWidget()
        subject = label(exclusion_text(exclusion), "label", wraps=True, weight=600)
        why = label(exclusion.reason, "label", "text2", wraps=True, weight=400)
        now, excluded_at = datetime.now().astimezone(), time_of(exclusion.excluded_at)
        by = exclusion.rule_or_person + ("" if excluded_at is None else f", {start_time_text(excluded_at, now)}")
        by = f"Proposed by the rule “{by.replace('_', ' ')}”; not yet decided" if proposed else by
        who = label(by, "small", "text2")
        vbox(hbox((subject, 1), *buttons), why, who, spacing=0, margins=(0, 0, 6, 0), parent=row)
        row.setAccessibleName(f"{exclusion_text(exclusion)}: {exclusion.reason} ({by})")
        return row

"""The sessions that were held, in all studies, by what they are; the newest of them."""

from collections.abc import Sequence
from datetime import datetime

from PySide6.QtCore import QSignalBlocker, Signal

from study_app.gui.sessions.sessions_table import SessionsTable
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import add_parts, hbox
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.labels import Elided, label
from study_app.number_text import counted
from study_app.viewmodels.session.columns import Column
from study_app.viewmodels.sessions import KINDS, SessionFacts

COLUMNS = (
    Column("participant", "Participant", 110, 62),
    Column("study", "Study", 130, 72),
    Column("started", "Started", 140, 74),
    Column("status", "Status", 140, 136),
    Column("validity", "Validity", 130, 134),
    Column("answers", "Answers", 80, 78),
)
EVERY = "every"
NONE = {
    "": "No sessions of participants yet. The first one appears here when it begins.",
    "pilot": "No pilot sessions.",
    "simulated": "No simulated sessions.",
    "sample": "No sample sessions.",
    EVERY: "No sessions yet. The first one appears here when it begins.",
}


class SessionsCard(Card):
    """The table, newest first; a row that needs care stands above all.

    ``all_asked`` is for all results, ``open_asked`` carries the `SessionFacts` of a session.
    """

    all_asked = Signal()
    open_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__(gap=8, padding=20)
        self.column.setContentsMargins(14, self.column.contentsMargins().top(), 14, 14)
        self._found: tuple[SessionFacts, ...] = ()
        self._now = datetime.now().astimezone()
        self.where = Elided("small", "text2")
        self.kind = Choice()
        self.kind.setAccessibleName("Sessions shown")
        self.kind.setFont(font("label"))
        self.kind.setProperty("dense", "true")
        self.kind.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToContents)
        self.details = ActionButton("file", "Details", role="plain", height=34)
        self.all = ActionButton("chevron", "All results", role="plain", height=34)
        self.all.clicked.connect(self.all_asked)
        parts = (label("Sessions", "card"), self.kind, (self.where, 1), self.details, self.all)
        self.rows = SessionsTable(COLUMNS, NONE[""])
        add_parts(self.column, hbox(*parts, spacing=12, margins=(12, 0, 12, 0)), (self.rows, 1))
        self.none = self.rows.none
        self.kind.currentIndexChanged.connect(self._filter)
        self.rows.opened.connect(self.open_asked)
        self.rows.chosen_changed.connect(lambda: self.details.setEnabled(self.rows.chosen is not None))
        self.details.clicked.connect(self.rows.open_chosen)
        self.details.setEnabled(False)
        self.details.setAccessibleName("Details of the selected session")
        self._show_kinds()
        self.setMinimumHeight(200)

    @property
    def shown(self) -> tuple[SessionFacts, ...]:
        """The sessions whose rows stand there."""
        return self.rows.shown

    def show_sessions(self, found: Sequence[SessionFacts], where: str, now: datetime) -> None:
        """Show these sessions in place of those before; ``where`` names the results folder."""
        self._found, self._now = tuple(found), now
        self.where.show_text(f"in {where}")
        self._show_kinds()
        self.rows.show_rows(self._found, now)
        self._filter()

    def show_kind(self, kind: str) -> None:
        """Show the sessions of a kind: "" for participants', one of `KINDS`, or `EVERY`."""
        self.kind.setCurrentIndex(self.kind.findData(kind))

    def _show_kinds(self) -> None:
        chosen = self.kind.currentData() or ""
        with QSignalBlocker(self.kind):
            self.kind.clear()
            for kind, words in KINDS.items():
                count = sum(one.kind == kind for one in self._found)
                self.kind.addItem(f"{words} ({count})", kind)
            self.kind.addItem(f"All ({len(self._found)})", EVERY)
            self.kind.setCurrentIndex(self.kind.findData(chosen))

    def _filter(self) -> None:
        kind = str(self.kind.currentData() or "")
        self.rows.show_matching(lambda one: kind in (one.kind, EVERY))
        hidden = [
            counted(count, f"{other or 'participant'} session")
            for other in KINDS
            if (count := sum(one.kind == other for one in self._found))
        ]
        self.none.setText(f"{NONE[kind]} Not shown: {', '.join(hidden)}." if hidden else NONE[kind])

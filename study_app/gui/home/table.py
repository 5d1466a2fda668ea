"""The sessions that were held, in all studies; the newest of them."""

from __future__ import annotations

from datetime import datetime

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout

from study_app.gui.cards import Card
from study_app.gui.controls import ActionButton
from study_app.gui.labels import Elided, label
from study_app.gui.sessions.facts import SessionFacts
from study_app.gui.sessions.rows import Column, SessionLine, SessionRows

SHOWN = 200
COLUMNS = (
    Column("participant", "Participant", 110, 55),
    Column("study", "Study", 130, 65),
    Column("started", "Started", 140, 70),
    Column("status", "Status", 160, 160),
    Column("validity", "Validity", 130, 130),
    Column("answers", "Answers", 80, 80),
)


class SessionsCard(Card):
    """The table, newest first; a row that needs care stands above all."""

    all_asked = Signal()

    def __init__(self) -> None:
        super().__init__(gap=8, padding=20)
        self.column.setContentsMargins(14, self.column.contentsMargins().top(), 14, 14)
        self.where = Elided("small", "text2")
        self.all = ActionButton("chevron", "All results", role="plain", height=34)
        self.all.clicked.connect(self.all_asked)
        head = QHBoxLayout()
        head.setContentsMargins(12, 0, 12, 0)
        head.setSpacing(12)
        head.addWidget(label("Sessions", "card"))
        head.addWidget(self.where, 1)
        head.addWidget(self.all)
        self.column.addLayout(head)
        self.rows = SessionRows(COLUMNS, "No session yet. The first one appears here when it begins.")
        self.column.addWidget(self.rows, 1)
        self.none = self.rows.none
        self.setMinimumHeight(200)

    @property
    def lines(self) -> list[SessionLine]:
        """The rows that stand there."""
        return self.rows.lines

    def show_sessions(self, found: tuple[SessionFacts, ...], where: str, now: datetime) -> None:
        """Show these sessions in place of those before; ``where`` names the results folder."""
        self.where.show_text(f"in {where}")
        self.rows.show_rows(found[:SHOWN], now)

"""The sessions that were held: who, which study, when, how it ended, and how much of it is there."""

from __future__ import annotations

from datetime import datetime

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QGridLayout, QScrollArea, QVBoxLayout, QWidget

from study_app.gui.cards import Card, Chip, Tone
from study_app.gui.controls import ActionButton
from study_app.gui.home.facts import SessionFacts, started_words
from study_app.gui.labels import Elided, figures, label
from study_app.gui.theme import RADIUS_CONTROL, font
from study_app.gui.themed import Themed, dress

ROW_HEIGHT = 43
MARGIN = 12
SHOWN = 200
COLUMNS = (("Participant", 110), ("Study", 130), ("Started", 140), ("Status", 160), ("Validity", 130), ("Answers", 80))

STATUS: dict[str, tuple[Tone, str, str]] = {
    "completed": ("ok", "check", "Complete"),
    "unfinished": ("warn", "clock", "Interrupted"),
    "withdrawn": ("neutral", "cross", "Withdrawn"),
    "aborted": ("neutral", "cross", "Ended early"),
    "broken": ("bad", "warning", "Stopped by fault"),
    "damaged": ("bad", "warning", "Journal damaged"),
}
VALIDITY: dict[str | None, tuple[Tone, str, str]] = {
    "valid": ("ok", "check", "Valid"),
    "invalid": ("warn", "warning", "Out of limits"),
    None: ("neutral", "ring", "Open"),
}


def _columns(widget: QWidget) -> QGridLayout:
    grid = QGridLayout(widget)
    grid.setContentsMargins(MARGIN, 0, MARGIN, 0)
    grid.setHorizontalSpacing(8)
    for column, (_, width) in enumerate(COLUMNS):
        grid.setColumnMinimumWidth(column, width if column in {3, 4, 5} else width // 2)
        grid.setColumnStretch(column, width)
    return grid


def _verdict(facts: SessionFacts) -> tuple[Tone, str, str]:
    """Return what the chip says of a session's limits, or that it does not count at all."""
    if facts.excluded is not None:
        return "neutral", "cross", "Excluded"
    return VALIDITY[None if facts.needs_care else facts.validity]


def _study(facts: SessionFacts) -> QWidget:
    """Return the study's name, and under it what the session is where it is no participant's."""
    cell = QWidget()
    column = QVBoxLayout(cell)
    column.setContentsMargins(0, 0, 0, 0)
    column.setSpacing(0)
    column.addStretch()
    name = Elided("label", "text2")
    name.show_text(facts.study)
    column.addWidget(name)
    if facts.kind:
        column.addWidget(label(facts.kind, "small", "text2"))
    column.addStretch()
    return cell


class SessionLine(Themed, QWidget):
    """One session."""

    def __init__(self, facts: SessionFacts, now: datetime) -> None:
        super().__init__()
        self._tinted = facts.needs_care
        self.setFixedHeight(ROW_HEIGHT)
        who = Elided("body")
        who.setFont(font("label", weight=600, scale=1.08))
        who.show_text(facts.participant if facts.session == 1 else f"{facts.participant}, session {facts.session}")
        when = Elided("label", "text2")
        when.setFont(font("label", weight=400, tabular=True))
        when.show_text(started_words(facts.started, now))
        whole = f" of {facts.answers_of}" if facts.answers_of is not None else ""
        self.status = Chip(*STATUS.get(facts.status, ("neutral", "ring", facts.status.capitalize())), small=True)
        self.validity = Chip(*_verdict(facts), small=True)
        if facts.excluded is not None:
            self.validity.setToolTip(f"Left out of the analysis: {facts.excluded}")
        self.answers = figures(f"{facts.answers}{whole}", "label")
        grid = _columns(self)
        for column, cell in enumerate((who, _study(facts), when, self.status, self.validity, self.answers)):
            grid.addWidget(cell, 0, column)
        words = (facts.participant, facts.study, facts.kind, self.status.word, self.validity.word)
        self.setAccessibleName(", ".join([*filter(None, words), f"{self.answers.text()} answers"]))

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the tint of a row that needs care, and the hairline under the row."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self._tinted:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(self.theme.hover))
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(0, 1, 0, -2), RADIUS_CONTROL, RADIUS_CONTROL)
        painter.setPen(QPen(QColor(self.theme.grid), 1))
        painter.drawLine(12, self.height() - 1, self.width() - 12, self.height() - 1)


class SessionsCard(Card):
    """The table, newest first; a row that needs care stands above all."""

    all_asked = Signal()

    def __init__(self) -> None:
        self.where = Elided("small", "text2")
        super().__init__(gap=8, padding=20)
        self.column.setContentsMargins(14, self.column.contentsMargins().top(), 14, 14)
        title = label("Sessions", "card")
        head = QWidget()
        grid = _columns(head)
        self.all = ActionButton("", "All results  ›", role="plain", height=34)
        self.all.clicked.connect(self.all_asked)
        grid.addWidget(title, 0, 0)
        grid.addWidget(self.where, 0, 1, 1, 3)
        grid.addWidget(self.all, 0, 4, 1, 2, Qt.AlignmentFlag.AlignRight)
        for column, (name, _) in enumerate(COLUMNS):
            word = Elided("small", "text2")
            word.show_text(name)
            grid.addWidget(word, 1, column)
        grid.setVerticalSpacing(10)
        self.column.addWidget(head)
        self.lines: list[SessionLine] = []
        self.none = label("No session yet. The first one appears here when it begins.", "body", "text2", wraps=True)
        self.none.setContentsMargins(12, 12, 12, 12)
        inside = QWidget()
        self._rows = QVBoxLayout(inside)
        self._rows.setContentsMargins(0, 0, 0, 0)
        self._rows.setSpacing(0)
        self._rows.addWidget(self.none)
        self._rows.addStretch()
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        area.setWidget(inside)
        # The heads stay above their columns when the scroll bar takes some room.
        bar = area.verticalScrollBar()
        bar.rangeChanged.connect(
            lambda _least, most: grid.setContentsMargins(MARGIN, 0, MARGIN + (bar.sizeHint().width() if most else 0), 0)
        )
        self.column.addWidget(area, 1)
        self.setMinimumHeight(200)

    def show_sessions(self, found: tuple[SessionFacts, ...], where: str, now: datetime) -> None:
        """Show these sessions in place of those before; ``where`` names the results folder."""
        self.where.show_text(f"in {where}")
        for line in self.lines:
            line.setParent(None)
            line.deleteLater()
        self.lines = [SessionLine(facts, now) for facts in found[:SHOWN]]
        self.none.setVisible(not self.lines)
        for index, line in enumerate(self.lines):
            dress(line, self.theme)
            self._rows.insertWidget(index, line)

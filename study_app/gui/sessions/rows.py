"""Sessions as rows: who, which study, when, how it ended, whether it kept to the limits, how much of it is there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from typing import Literal, NamedTuple, TypeAlias

from PySide6.QtCore import QRectF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QFocusEvent, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QGridLayout, QScrollArea, QVBoxLayout, QWidget

from study_app.gui.cards import Chip, Tone
from study_app.gui.labels import Elided, figures, label
from study_app.gui.sessions.facts import SessionFacts, started_words
from study_app.gui.theme import RADIUS_CONTROL, font
from study_app.gui.themed import Themed, dress, take_away

ROW_HEIGHT = 43
MARGIN = 12
AT_ONCE = 16
"""So many rows are made at a time: between them the window answers."""

Name: TypeAlias = Literal["participant", "study", "started", "status", "validity", "answers"]

STATUS: dict[str, tuple[Tone, str, str]] = {
    "completed": ("ok", "check", "Complete"),
    "unfinished": ("warn", "clock", "Interrupted"),
    "withdrawn": ("neutral", "cross", "Withdrawn"),
    "aborted": ("neutral", "cross", "Ended early"),
    "broken": ("bad", "warning", "Fault"),
    "damaged": ("bad", "warning", "Damaged"),
}
VALIDITY: dict[str | None, tuple[Tone, str, str]] = {
    "valid": ("ok", "check", "Valid"),
    "invalid": ("warn", "warning", "Out of limits"),
    None: ("neutral", "ring", "Open"),
}


class Column(NamedTuple):
    """What a column holds, its heading, and its share of the width; at least ``least`` px of it."""

    name: Name
    heading: str
    width: int
    least: int


def status_chip(facts: SessionFacts) -> tuple[Tone, str, str]:
    """Return what the chip says of how a session ended."""
    return STATUS.get(facts.status, ("neutral", "ring", facts.status.capitalize()))


def validity_chip(facts: SessionFacts) -> tuple[Tone, str, str]:
    """Return what the chip says of a session's limits, or that it does not count at all."""
    if facts.excluded is not None:
        return "neutral", "cross", "Excluded"
    return VALIDITY[None if facts.needs_care else facts.validity]


def columns_of(widget: QWidget, columns: Sequence[Column]) -> QGridLayout:
    """Give a widget the columns of a table's rows."""
    grid = QGridLayout(widget)
    grid.setContentsMargins(MARGIN, 0, MARGIN, 0)
    grid.setHorizontalSpacing(8)
    for place, column in enumerate(columns):
        grid.setColumnMinimumWidth(place, column.least)
        grid.setColumnStretch(place, column.width)
    return grid


class SessionLine(Themed, QWidget):
    """One session; ``picked`` says that it was clicked or reached by the keyboard, where rows can be chosen."""

    picked = Signal()
    moved = Signal(int)

    def __init__(self, facts: SessionFacts, now: datetime, columns: Sequence[Column], *, chosen_from: bool) -> None:
        super().__init__()
        self.facts = facts
        self._chosen_from = chosen_from
        self._chosen = False
        self.setFixedHeight(ROW_HEIGHT)
        self.status = Chip(*status_chip(facts), small=True)
        self.validity = Chip(*validity_chip(facts), small=True)
        if facts.excluded is not None:
            self.validity.setToolTip(f"Left out of the analysis: {facts.excluded}")
        whole = f" of {facts.answers_of}" if facts.answers_of is not None else ""
        self.answers = figures(f"{facts.answers}{whole}", "label")
        made: dict[Name, Callable[[], QWidget]] = {
            "participant": lambda: _who(facts),
            "study": lambda: _study(facts),
            "started": lambda: _when(facts, now),
            "status": lambda: self.status,
            "validity": lambda: self.validity,
            "answers": lambda: self.answers,
        }
        grid = columns_of(self, columns)
        for place, column in enumerate(columns):
            cell = made[column.name]()
            if isinstance(cell, Chip):  # aligned: or its width would hold its column's
                grid.addWidget(cell, 0, place, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
            else:
                grid.addWidget(cell, 0, place)
        words = (facts.participant, facts.study, facts.kind, self.status.word, self.validity.word)
        self.setAccessibleName(", ".join([*filter(None, words), f"{self.answers.text()} answers"]))
        if chosen_from:
            self.setToolTip(f"{facts.name}: began {started_words(facts.started, now)}, {facts.answers} answers")
            self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
            self.setCursor(Qt.CursorShape.PointingHandCursor)

    @property
    def chosen(self) -> bool:
        """Whether it is the row that is chosen."""
        return self._chosen

    def choose(self, yes: bool) -> None:
        """Be the row that is chosen, or not any more; the keyboard comes to the chosen one."""
        self._chosen = yes
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus if yes else Qt.FocusPolicy.ClickFocus)
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802 - Qt's name
        """Be chosen."""
        super().mousePressEvent(event)
        if self._chosen_from:
            self.picked.emit()

    def focusInEvent(self, event: QFocusEvent) -> None:  # noqa: N802 - Qt's name
        """Show where the keyboard is."""
        super().focusInEvent(event)
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:  # noqa: N802 - Qt's name
        """Show that the keyboard is elsewhere."""
        super().focusOutEvent(event)
        self.update()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802 - Qt's name
        """Lead the keyboard to the row above or below."""
        steps = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}
        if self._chosen_from and event.key() in steps:
            self.moved.emit(steps[Qt.Key(event.key())])
        else:
            super().keyPressEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the tint of a row that is chosen or needs care, the ring of the keyboard, and the hairline below."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        body = QRectF(self.rect()).adjusted(0, 1, 0, -2)
        if self._chosen or self.facts.needs_care:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(self.theme.selected if self._chosen else self.theme.hover))
            painter.drawRoundedRect(body, RADIUS_CONTROL, RADIUS_CONTROL)
        painter.setPen(QPen(QColor(self.theme.grid), 1))
        painter.drawLine(12, self.height() - 1, self.width() - 12, self.height() - 1)
        if self.hasFocus():
            painter.setPen(QPen(QColor(self.theme.accent), 2))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(body.adjusted(1, 1, -1, -1), RADIUS_CONTROL, RADIUS_CONTROL)


class SessionRows(Themed, QWidget):
    """The rows under their headings; ``picked`` carries the `SessionFacts` of a row that was chosen.

    Parameters
    ----------
    columns
        What the rows show.
    none
        The sentence in place of rows where there are none.
    chosen_from
        Whether a row can be chosen, by the pointer and by Up and Down.
    after
        What Tab leads to the rows from.
    """

    picked = Signal(object)

    def __init__(
        self, columns: Sequence[Column], none: str, *, chosen_from: bool = False, after: QWidget | None = None
    ) -> None:
        super().__init__()
        self._after = after
        self._columns = columns
        self._chosen_from = chosen_from
        self._waiting: list[SessionFacts] = []
        self._now = datetime.now().astimezone()
        self._matches: Callable[[SessionFacts], bool] = lambda _facts: True
        self.lines: list[SessionLine] = []
        self.none = label(none, "body", "text2", wraps=True)
        self.none.setContentsMargins(MARGIN, MARGIN, MARGIN, MARGIN)
        self._later = QTimer(self)
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._make_more)
        self._lay_out()

    def _lay_out(self) -> None:
        head = QWidget()
        grid = columns_of(head, self._columns)
        for place, shown in enumerate(self._columns):
            word = Elided("small", "text2")
            word.show_text(shown.heading)
            grid.addWidget(word, 0, place)
        inside = QWidget()
        self._rows = QVBoxLayout(inside)
        self._rows.setContentsMargins(0, 0, 0, 0)
        self._rows.setSpacing(0)
        self._rows.addWidget(self.none)
        self._rows.addStretch()
        self._area = QScrollArea()
        self._area.setWidgetResizable(True)
        self._area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._area.setWidget(inside)
        # The heads stay above their columns when the scroll bar takes some room.
        bar = self._area.verticalScrollBar()
        bar.rangeChanged.connect(
            lambda _least, most: grid.setContentsMargins(MARGIN, 0, MARGIN + (bar.sizeHint().width() if most else 0), 0)
        )
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(8)
        column.addWidget(head)
        column.addWidget(self._area, 1)

    @property
    def chosen(self) -> SessionFacts | None:
        """The session whose row is chosen; None where none is."""
        return next((line.facts for line in self.lines if line.chosen), None)

    def show_rows(self, found: Sequence[SessionFacts], now: datetime) -> None:
        """Show these sessions in place of those before."""
        for line in self.lines:
            take_away(line)
        self.lines = []
        self._now, self._waiting = now, list(found)
        self._make_more()

    def show_matching(self, matches: Callable[[SessionFacts], bool]) -> None:
        """Show the rows alone that match, now and later."""
        self._matches = matches
        for line in self.lines:
            line.setVisible(matches(line.facts))
        self._tell_rows()

    def _make_more(self) -> None:
        """Make the next rows; the others follow once the window has answered."""
        made, self._waiting = self._waiting[:AT_ONCE], self._waiting[AT_ONCE:]
        for facts in made:
            line = SessionLine(facts, self._now, self._columns, chosen_from=self._chosen_from)
            line.picked.connect(lambda line=line: self._choose(line))
            line.moved.connect(lambda steps, line=line: self._move(line, steps))
            dress(line, self.theme)
            self._rows.insertWidget(len(self.lines), line)
            line.setVisible(self._matches(facts))
            before = self.lines[-1] if self.lines else self._after
            if before is not None:
                QWidget.setTabOrder(before, line)
            self.lines.append(line)
        self._tell_rows()
        if self._waiting:
            self._later.start(0)

    def _tell_rows(self) -> None:
        """Keep a way in for the keyboard among the rows that are shown; where there is none, say so."""
        shown = [line for line in self.lines if not line.isHidden()]
        self.none.setVisible(not self._waiting and not shown)
        reached = any(line.focusPolicy() & Qt.FocusPolicy.TabFocus for line in shown)
        if self._chosen_from and shown and not reached:
            shown[0].setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def _choose(self, chosen: SessionLine) -> None:
        for line in self.lines:
            line.choose(line is chosen)
        self._area.ensureWidgetVisible(chosen, 0, 0)
        self.picked.emit(chosen.facts)

    def _move(self, line: SessionLine, steps: int) -> None:
        shown = [other for other in self.lines if not other.isHidden()]
        place = min(max(shown.index(line) + steps, 0), len(shown) - 1)
        self._choose(shown[place])
        shown[place].setFocus(Qt.FocusReason.OtherFocusReason)


def matching(words: str, status: str) -> Callable[[SessionFacts], bool]:
    """Return whether a session's participant holds ``words`` and its state is ``status`` ("" for any).

    ``status`` is one of `STATUS`, "excluded" or "invalid".
    """
    wanted = words.strip().lower()

    def matches(facts: SessionFacts) -> bool:
        if wanted not in facts.participant.lower():
            return False
        if status == "excluded":
            return facts.excluded is not None
        return status in {"", facts.status} or (status == "invalid" and facts.validity == "invalid")

    return matches


def states_of(found: Iterable[SessionFacts]) -> list[tuple[str, str]]:
    """Return the states that occur among sessions, with their words, in the order of `STATUS`."""
    there = list(found)
    states = [(status, word) for status, (_, _, word) in STATUS.items() if any(one.status == status for one in there)]
    if any(one.validity == "invalid" for one in there):
        states.append(("invalid", VALIDITY["invalid"][2]))
    if any(one.excluded is not None for one in there):
        states.append(("excluded", "Excluded"))
    return states


def _who(facts: SessionFacts) -> QWidget:
    who = Elided("body")
    who.setFont(font("label", weight=600, scale=1.08))
    who.show_text(facts.name)
    return who


def _when(facts: SessionFacts, now: datetime) -> QWidget:
    when = Elided("label", "text2")
    when.setFont(font("label", weight=400, tabular=True))
    when.show_text(started_words(facts.started, now))
    return when


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

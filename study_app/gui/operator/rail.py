"""Where we are: part, trial, time in the trial, and all steps of the session with their states."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QScrollArea, QSizePolicy, QVBoxLayout, QWidget

from study_app.gui.cards import Bar, Card, Rule
from study_app.gui.icons import draw_icon
from study_app.gui.labels import Elided, figures, label, set_ink
from study_app.gui.operator.view import OperatorView, StepRow, minutes
from study_app.gui.theme import TypeRole, font
from study_app.gui.themed import Themed

WIDTH, NARROW = 318, 248
ROW_HEIGHT = 44
LEAST_ROW_HEIGHT = 32
DOT = 11


class StepLine(Themed, QWidget):
    """One step: a dot on the line that joins all steps, its name, and its time or place."""

    def __init__(self) -> None:
        super().__init__()
        self.row = StepRow("", "open", "")
        self.first = self.last = False
        self.name = Elided("body")
        self.note = figures("", "label", "text2")
        layout = QHBoxLayout(self)
        layout.setContentsMargins(37, 0, 0, 0)
        layout.addWidget(self.name, 1)
        layout.addWidget(self.note)
        self.setMinimumHeight(LEAST_ROW_HEIGHT)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)

    def sizeHint(self) -> QSize:  # noqa: N802 - Qt's name
        """Return the room that a row likes; where there are many, each takes less."""
        return QSize(super().sizeHint().width(), ROW_HEIGHT)

    def show_row(self, row: StepRow, *, first: bool, last: bool) -> None:
        """Show a step's state."""
        if (row, first, last) == (self.row, self.first, self.last):
            return
        self.row, self.first, self.last = row, first, last
        self.name.show_text(row.label)
        self.note.setText(row.note)
        self.name.setFont(font("body", weight=600 if row.state == "now" else 400, scale=0.94))
        set_ink(self.name, "text2" if row.state == "open" else "text")
        set_ink(self.note, "accent" if row.state == "now" else "text2")
        self.setAccessibleName(f"{row.label}, {row.state} {row.note}".strip())
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the line and the dot."""
        t = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle = QPointF(12, self.height() / 2)
        reached = self.row.state != "open"
        if not self.first:
            painter.setPen(QPen(QColor(t.ok if reached else t.border), 1.6))
            painter.drawLine(QPointF(12, 0), QPointF(12, middle.y() - DOT))
        if not self.last:
            painter.setPen(QPen(QColor(t.ok if self.row.state == "done" else t.border), 1.6))
            painter.drawLine(QPointF(12, middle.y() + DOT), QPointF(12, self.height()))
        if self.row.state == "done":
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.ok_bg))
            painter.drawEllipse(middle, DOT, DOT)
            draw_icon(painter, "check", QRectF(5, middle.y() - 7, 14, 14), t.ok, 2.6)
        elif self.row.state == "now":
            painter.setPen(QPen(QColor(t.accent), 1.8))
            painter.setBrush(QColor(t.selected))
            painter.drawEllipse(middle, DOT, DOT)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.accent))
            painter.drawEllipse(middle, 4.5, 4.5)
        else:
            painter.setPen(QPen(QColor(t.ctl), 1.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(middle, 7, 7)


class Rail(Card):
    """The card at the left."""

    def __init__(self) -> None:
        super().__init__(gap=6)
        self.narrow(False)
        self.part = Elided("label", "text2")
        self.heading = label("", "display")
        self.heading.setMinimumWidth(1)
        self.setting = label("", "body", "text2", wraps=True)
        self.elapsed_word = label("Elapsed", "label", "text2")
        self.elapsed = figures("", "label")
        self.bar = Bar()
        keep = self.bar.sizePolicy()
        keep.setRetainSizeWhenHidden(True)
        self.bar.setSizePolicy(keep)
        self.least = figures("", "small", "text2")
        self.lines: list[StepLine] = []
        self.counts: list[tuple[QLabel, QLabel]] = []
        self._steps = QWidget()
        self._steps_column = QVBoxLayout(self._steps)
        self._steps_column.setContentsMargins(0, 0, 8, 0)
        self._steps_column.setSpacing(0)
        self._steps_column.addStretch(1)
        self._scroll = QScrollArea()
        self._scroll.setWidgetResizable(True)
        self._scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._scroll.setWidget(self._steps)
        self._counts_column = QVBoxLayout()
        self._counts_column.setSpacing(8)
        self.beyond = label("", "small", "warn", wraps=True)
        self._lay_out()

    def _lay_out(self) -> None:
        for widget in (self.part, self.heading, self.setting):
            self.column.addWidget(widget)
        self.column.addSpacing(6)
        row = QHBoxLayout()
        row.addWidget(self.elapsed_word)
        row.addStretch()
        row.addWidget(self.elapsed)
        self.column.addLayout(row)
        self.column.addWidget(self.bar)
        self.column.addWidget(self.least)
        self.column.addSpacing(4)
        self.column.addWidget(Rule())
        self.column.addSpacing(6)
        self.column.addWidget(self._scroll, 1)
        self.column.addSpacing(6)
        self.column.addWidget(Rule())
        self.column.addSpacing(6)
        self.column.addLayout(self._counts_column)
        self.column.addWidget(self.beyond)

    def narrow(self, yes: bool) -> None:
        """Take less room in a small window."""
        self.setFixedWidth(NARROW if yes else WIDTH)

    def show_view(self, view: OperatorView) -> None:
        """Show where the session is."""
        self.part.show_text(view.part_line)
        self._show_heading(view.heading)
        self.setting.setText(view.setting_line)
        self._show_time(view)
        self._show_steps(view.steps)
        self._show_counts(view.counts)
        self._show_beyond(view.beyond)

    def _show_heading(self, text: str) -> None:
        if text == self.heading.text():
            return
        self.heading.setText(text)
        self._fit_heading()

    def _fit_heading(self) -> None:
        room = self.width() - 50
        roles: tuple[TypeRole, ...] = ("display", "title", "title_dense", "card")
        for role in roles:
            self.heading.setFont(font(role, tabular=True))
            if self.heading.fontMetrics().horizontalAdvance(self.heading.text()) <= room:
                break

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802 - Qt's name
        """Let the heading be as large as it fits, and keep the present step in sight."""
        super().resizeEvent(event)
        self._fit_heading()
        for line in self.lines:
            if line.row.state == "now":
                self._scroll.ensureWidgetVisible(line, 0, LEAST_ROW_HEIGHT)

    def _show_time(self, view: OperatorView) -> None:
        time = view.trial_time
        self.elapsed_word.setText("Elapsed" if time else "")
        self.elapsed.setText(time.words if time else "")
        self.bar.setVisible(time is not None and bool(time.most_s))
        if time is None or not time.most_s:
            self.least.setText("")
            return
        self.bar.show_share(time.elapsed_s / time.most_s, time.least_s / time.most_s if time.least_s else None)
        self.least.setText(f"at least {minutes(time.least_s)}" if time.least_s else "")

    def _show_steps(self, rows: tuple[StepRow, ...]) -> None:
        while len(self.lines) < len(rows):
            line = StepLine()
            line.wear(self.theme)
            self.lines.append(line)
            self._steps_column.insertWidget(len(self.lines) - 1, line)
        for index, (line, row) in enumerate(zip(self.lines, rows, strict=True)):
            arrived = row.state == "now" != line.row.state
            line.show_row(row, first=index == 0, last=index == len(rows) - 1)
            if arrived:
                self._scroll.ensureWidgetVisible(line, 0, 2 * LEAST_ROW_HEIGHT)

    def _show_counts(self, counts: tuple[tuple[str, str], ...]) -> None:
        while len(self.counts) < len(counts):
            name, value = label("", "label", "text2"), figures("", "label")
            value.setFont(font("label", weight=600, tabular=True))
            row = QHBoxLayout()
            row.addWidget(name)
            row.addStretch()
            row.addWidget(value)
            self._counts_column.addLayout(row)
            self.counts.append((name, value))
        for (name, value), (word, number) in zip(self.counts, counts, strict=True):
            name.setText(word)
            value.setText(number)

    def _show_beyond(self, beyond: tuple[str, ...]) -> None:
        """Show which limit the newest trial out of limits broke; the tip tells all of them."""
        self.beyond.setVisible(bool(beyond))
        self.beyond.setText(f"{beyond[0]}." if beyond else "")
        self.beyond.setToolTip("\n".join(beyond) if len(beyond) > 1 else "")

"""The known answer of a template: the planted threshold, and what simulated studies find of it."""

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from study_app.designer.new_study.template_choices import Recovery
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed

TICKS = 4


class RecoveryBar(Themed, QWidget):
    """An axis from 0 with the middle 90 % of what is found as a bar, and the planted value as a line."""

    def __init__(self) -> None:
        super().__init__()
        self.shown: Recovery | None = None
        self.setFixedHeight(46)
        self.setAccessibleName("Known answer")

    def show_recovery(self, shown: Recovery) -> None:
        self.shown = shown
        self.setAccessibleDescription(shown.sentence)
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.shown is None:
            return
        t, painter, shown = self.theme, QPainter(self), self.shown
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        left, wide = 12.0, self.width() - 44.0

        def place(value: float) -> float:
            return left + wide * value / shown.most

        painter.setPen(QPen(QColor(t.border), 1))
        painter.drawLine(QPointF(left, 28), QPointF(left + wide, 28))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(t.accent))
        painter.setOpacity(0.45)
        painter.drawRoundedRect(QRectF(place(shown.low), 9, max(4.0, place(shown.high) - place(shown.low)), 12), 6, 6)
        painter.setOpacity(1)
        painter.setPen(QPen(QColor(t.text), 2, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(place(shown.planted), 3), QPointF(place(shown.planted), 28))
        painter.setFont(font("small", tabular=True))
        painter.setPen(QColor(t.text2))
        for tick in range(TICKS + 1):
            value = shown.most * tick / TICKS
            words = f"{value:g} {shown.unit}" if tick == TICKS else f"{value:g}"
            painter.drawText(QRectF(place(value) - 30, 30, 60, 16), Qt.AlignmentFlag.AlignCenter, words)

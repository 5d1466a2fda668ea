"""The middle of the operator's window: lateness of ticks, the hand's position, and the force that stays hidden."""

from __future__ import annotations

import math

from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.cards import Card, Chip
from study_app.gui.icons import draw_icon
from study_app.gui.labels import label
from study_app.gui.operator.health import TRACE_WINDOW_S, ServoHealth
from study_app.gui.plots import LatenessPlot, TracePlot
from study_app.gui.theme import RADIUS_CONTROL, font
from study_app.gui.themed import Themed


class LatenessCard(Card):
    """Histogram of the last minute's ticks."""

    def __init__(self, limit_s: float) -> None:
        super().__init__("Tick lateness", label("last 60 s", "small", "text2"), padding=16, gap=4)
        self.plot = LatenessPlot(limit_s * 1e6)
        axes = label("lateness, µs (log), ticks per bin (log)", "small", "text2")
        axes.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        self.column.addWidget(self.plot, 1)
        self.column.addWidget(axes)

    def show_health(self, health: ServoHealth) -> None:
        """Draw the ticks as of now."""
        edges, counts = health.lateness_histogram()
        p99 = health.vitals().lateness_p99_s
        self.plot.show_histogram(edges, counts, None if p99 is None else p99 * 1e6)


class PositionCard(Card):
    """The hand along x, y and z over the last ten seconds; with the mouse, the pointer."""

    def __init__(self, reach_m: float, *, pointer: bool) -> None:
        title = "Position of the pointer" if pointer else "Position of the hand"
        super().__init__(title, label(f"last {TRACE_WINDOW_S:.0f} s, mm", "small", "text2"), padding=16, gap=4)
        self.plot = TracePlot(TRACE_WINDOW_S, reach_m * 1000)
        self.column.addWidget(self.plot, 1)

    def show_health(self, health: ServoHealth, now_s: float) -> None:
        """Draw the curves as of now."""
        times, positions = health.trace(now_s)
        self.plot.show_traces(times, positions * 1000)


class HiddenForceCard(Card):
    """In the place and size of the force's plot while the study is double-blind: nothing about the force."""

    def __init__(self) -> None:
        super().__init__("Force", Chip("neutral", "eye_off", "Hidden", small=True), padding=16, gap=8)
        self.column.addWidget(_Hatched(), 1)


class _Hatched(Themed, QWidget):
    """A hatched field with a lock and one line why."""

    TITLE = "Hidden while the study is double-blind"
    WHY = "A trace would show which liquid this is."

    def __init__(self) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName(f"{self.TITLE}. {self.WHY}")

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the field."""
        t = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        field = QPainterPath()
        field.addRoundedRect(QRectF(self.rect()), RADIUS_CONTROL, RADIUS_CONTROL)
        painter.fillPath(field, QColor(t.sunk))
        painter.save()
        painter.setClipPath(field)
        painter.setPen(QPen(QColor(t.border), 1))
        height = self.height()
        for x in range(-height, self.width(), 20):
            painter.drawLine(QLineF(x, height, x + height, 0))
        painter.restore()
        title_font, why_font = font("card", scale=0.94), font("label", weight=400)
        block = min(150.0, height - 16.0)
        top = (height - block) / 2
        middle = self.width() / 2
        radius = min(26.0, max(0.0, (block - 70) / 2))
        if radius > 12:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.surface))
            painter.drawEllipse(QRectF(middle - radius, top, 2 * radius, 2 * radius))
            draw_icon(painter, "lock", QRectF(middle - 11, top + radius - 11, 22, 22), t.text)
        lines_top = top + 2 * radius + 14
        painter.setPen(QColor(t.text))
        painter.setFont(title_font)
        wrap = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap
        box = QRectF(12, lines_top, self.width() - 24, height - lines_top)
        used = painter.boundingRect(box, int(wrap), self.TITLE)
        painter.drawText(box, int(wrap), self.TITLE)
        painter.setPen(QColor(t.text2))
        painter.setFont(why_font)
        painter.drawText(box.adjusted(0, math.ceil(used.height()) + 8, 0, 0), int(wrap), self.WHY)

"""The hand's motion in one trial: its place along three axes over time."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.accessible import describe_plot

HEIGHT = 150
LEFT, RIGHT, TOP, BOTTOM = 52.0, 52.0, 8.0, 22.0
NAMES = ("x right", "y up", "z near")
LEAST_MM = 5.0


class MotionPlot(Themed, QWidget):
    """Three curves [mm] over the trial's time [s], or a sentence in their place."""

    def __init__(self) -> None:
        super().__init__()
        self.setFixedHeight(HEIGHT)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        describe_plot(self, "Motion of the hand", "")
        self._times_s = np.empty(0)
        self._mm = np.empty((0, 3))
        self._sentence = ""

    @property
    def points(self) -> int:
        """How many points each curve has."""
        return len(self._times_s)

    def show_motion(self, times_s: NDArray[np.float64], positions_m: NDArray[np.float64]) -> None:
        """Draw positions (n, 3) [m] over times (n,) [s]."""
        self._times_s, self._mm, self._sentence = times_s, positions_m * 1e3, ""
        if len(times_s):
            low, high = np.nanmin(self._mm, axis=0), np.nanmax(self._mm, axis=0)
            ranges = ", ".join(f"{n} {a:.0f} to {b:.0f}" for n, a, b in zip(NAMES, low, high, strict=True))
            self.setAccessibleDescription(f"Position of the hand over {times_s[-1]:.0f} s in mm: {ranges}.")
        self.update()

    def show_sentence(self, sentence: str) -> None:
        self._times_s, self._mm, self._sentence = np.empty(0), np.empty((0, 3)), sentence
        self.setAccessibleDescription(sentence)
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        theme = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(font("small", tabular=True))
        if not len(self._times_s):
            painter.setPen(QColor(theme.text2))
            words = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(QRectF(self.rect()), words, self._sentence)
            return
        room = QRectF(LEFT, TOP, self.width() - LEFT - RIGHT, HEIGHT - TOP - BOTTOM)
        reach = max(LEAST_MM, float(np.nanmax(np.abs(self._mm))))
        for value in (reach, 0.0, -reach):
            y = room.center().y() - value / reach * room.height() / 2
            painter.setPen(QPen(QColor(theme.grid), 1))
            painter.drawLine(QPointF(room.left(), y), QPointF(room.right(), y))
            painter.setPen(QColor(theme.text3))
            number = f"{value:.0f} mm".replace("-", "\u2212")
            painter.drawText(QRectF(0, y - 8, LEFT - 6, 16), Qt.AlignmentFlag.AlignRight, number)
        lasts_s = max(1e-9, float(self._times_s[-1]))
        for share, side in ((0.0, Qt.AlignmentFlag.AlignLeft), (1.0, Qt.AlignmentFlag.AlignRight)):
            under = QRectF(room.left(), room.bottom() + 4, room.width(), 16)
            painter.drawText(under, side, f"{share * lasts_s:.0f} s")
        names_y = []
        traces = (theme.trace_x, theme.trace_y, theme.trace_z)
        styles = (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine, Qt.PenStyle.DotLine)
        for axis, (ink, style) in enumerate(zip(traces, styles, strict=True)):
            x_px = room.left() + self._times_s / lasts_s * room.width()
            y_px = room.center().y() - self._mm[:, axis] / reach * room.height() / 2
            here = np.isfinite(y_px)
            painter.setPen(QPen(QColor(ink), 1.6, style))
            painter.drawPolyline(QPolygonF([QPointF(a, b) for a, b in zip(x_px[here], y_px[here], strict=True)]))
            names_y.append((float(y_px[here][-1]) if here.any() else room.center().y(), axis, ink))
        below = -1e9
        for end_px, axis, ink in sorted(names_y):
            below = max(min(max(end_px, room.top() + 7), room.bottom() - 7 - 28), below + 14)
            painter.setPen(QColor(ink))
            painter.drawText(QRectF(room.right() + 6, below - 8, RIGHT, 16), Qt.AlignmentFlag.AlignLeft, NAMES[axis])

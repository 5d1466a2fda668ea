"""What stands where something must not be seen: as large as what it hides, so that its shape tells nothing."""

import math

from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import RADIUS_CONTROL, font
from study_app.gui.theme.themed import Themed


class MaskedPanel(Themed, QWidget):
    """A hatched field with a lock, what is hidden here, and one line why."""

    def __init__(self, title: str, why: str) -> None:
        super().__init__()
        self._title, self._why = title, why
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName(f"{title}. {why}")

    def paintEvent(self, _event: QPaintEvent) -> None:
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
        used = painter.boundingRect(box, int(wrap), self._title)
        painter.drawText(box, int(wrap), self._title)
        painter.setPen(QColor(t.text2))
        painter.setFont(why_font)
        painter.drawText(box.adjusted(0, math.ceil(used.height()) + 8, 0, 0), int(wrap), self._why)

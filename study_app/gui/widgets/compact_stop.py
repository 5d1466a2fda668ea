"""The force stop where there is no room for the cockpit's large one."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent
from PySide6.QtWidgets import QPushButton, QSizePolicy, QStyle, QStyleOptionButton, QStylePainter

from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed

HEIGHT = 44


class CompactStop(Themed, QPushButton):
    """Stop force, in the force stop's own colour; it acts when pressed, not when released, and is never disabled.

    Where the stop ends more than the force, ``words`` say so.
    """

    def __init__(self, words: str = "Stop force") -> None:
        super().__init__()
        self.words = words
        self.setProperty("role", "stop")
        self.setAccessibleName(f"{words}. Holding Esc does the same.")
        self.setToolTip(f"{words} (or hold Esc)")
        self.setFixedHeight(HEIGHT)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self._font = font("strong", scale=0.96)

    def sizeHint(self) -> QSize:  # noqa: N802 - Qt's name
        """Return the room for octagon and words."""
        return QSize(round(QFontMetricsF(self._font).horizontalAdvance(self.words)) + 62, HEIGHT)

    def minimumSizeHint(self) -> QSize:  # noqa: N802 - Qt's name
        """Return the same: it is never cut."""
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the button, its octagon and its words."""
        painter = QStylePainter(self)
        option = QStyleOptionButton()
        self.initStyleOption(option)
        painter.drawControl(QStyle.ControlElement.CE_PushButtonBevel, option)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        ink = QColor(self.theme.on_stop)
        draw_icon(painter, "stop", QRectF(17, self.height() / 2 - 10, 20, 20), ink, 2.0)
        painter.setPen(ink)
        painter.setFont(self._font)
        painter.drawText(QRectF(46, 0, self.width() - 46, self.height()), Qt.AlignmentFlag.AlignVCenter, self.words)

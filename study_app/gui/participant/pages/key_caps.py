"""Key caps, and the one filled button that goes on: what the participant's pages share."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QEnterEvent, QFocusEvent, QFontMetricsF, QKeyEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractButton, QPushButton, QSizePolicy, QWidget

from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, font

CENTRE = int(Qt.AlignmentFlag.AlignCenter)
ARROWS = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Left, Qt.Key.Key_Right)
RING = 4.0  # room around a button for its focus ring [logical px]
KEYBOARD = (Qt.FocusReason.TabFocusReason, Qt.FocusReason.BacktabFocusReason, Qt.FocusReason.ShortcutFocusReason)

if TYPE_CHECKING:
    Button = QAbstractButton
else:
    Button = object  # Qt permits one class of its own in a class


def key_size(text: str, scale: float = 1.0) -> tuple[float, float]:
    """Return width and height [px] of a key cap."""
    metrics = QFontMetricsF(font("key", scale=scale))
    height = round(metrics.height() + 5 * scale)
    return max(height, round(metrics.horizontalAdvance(text) + 12 * scale)), height


def draw_key(
    painter: QPainter,
    left: float,
    middle: float,
    text: str,
    scale: float = 1.0,
    *,
    ink: str = PARTICIPANT.text2,
    edge: str = PARTICIPANT.ctl,
    strength: float = 1.0,
) -> float:
    """Draw a key cap from ``left`` around the line ``middle``, its edge at ``strength``; return its width [px]."""
    width, height = key_size(text, scale)
    cap = QRectF(round(left) + 0.5, round(middle - height / 2) + 0.5, width - 1, height - 1)
    line = QColor(edge)
    line.setAlphaF(strength)
    painter.setPen(QPen(line, 1))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRoundedRect(cap, 4 * scale, 4 * scale)
    painter.setFont(font("key", scale=scale))
    painter.setPen(QColor(ink))
    way = painter.layoutDirection()
    painter.setLayoutDirection(Qt.LayoutDirection.LeftToRight)  # "1–7" is so on every keyboard
    painter.drawText(cap, CENTRE, text)
    painter.setLayoutDirection(way)
    return width


class KeyCap(QWidget):
    """A key cap as a widget, in a language's direction."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._text = ""
        self._scale = 1.0

    def show_key(self, text: str, scale: float) -> None:
        self._text, self._scale = text, scale
        width, height = key_size(text, scale)
        self.setFixedSize(round(width) + 2, round(height) + 2)
        self.setVisible(bool(text))
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        draw_key(painter, 1, self.height() / 2, self._text, self._scale)
        painter.end()


class LitButton(Button):
    """A button that lights up under the pointer, and has a ring where the keyboard led to it."""

    ringed = False

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show the ring where the keyboard led here; a page that begins here has its key cap to say so."""
        self.ringed = event.reason() in KEYBOARD
        super().focusInEvent(event)

    def enterEvent(self, event: QEnterEvent) -> None:
        super().enterEvent(event)
        self.update()

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self.update()


class GoButton(LitButton, QPushButton):
    """The filled button of a participant's page, with the key that presses it; never disabled."""

    def __init__(self, text: str, key: str, parent: QWidget | None = None) -> None:
        super().__init__(text, parent)
        self._key = key
        self._scale = 1.0
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.setAutoDefault(False)
        self.set_scale(1.0)

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        self._scale = scale
        self.setFont(font("card", scale=scale * 1.0625, weight=500))
        self.setFixedSize(self.sizeHint())
        self.update()

    def sizeHint(self) -> QSize:
        scale = self._scale
        label = QFontMetricsF(self.font()).horizontalAdvance(self.text())
        cap, _ = key_size(self._key, scale)
        width = max(150 * scale, label + cap + (36 + 12 + 28) * scale)
        return QSize(round(width + 2 * RING), round(48 * scale + 2 * RING))

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        scale, theme = self._scale, PARTICIPANT
        body = QRectF(self.rect()).adjusted(RING, RING, -RING, -RING)
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        radius = RADIUS_CONTROL * scale
        lit = self.underMouse() and not self.isDown()
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.accent_hover if lit else theme.accent))
        painter.drawRoundedRect(body, radius, radius)
        if self.hasFocus() and self.ringed:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(theme.text), 2))
            painter.drawRoundedRect(body.adjusted(-3, -3, 3, 3), radius + 3, radius + 3)
        label = QFontMetricsF(self.font()).horizontalAdvance(self.text())
        cap, _ = key_size(self._key, scale)
        start = body.center().x() - (label + 12 * scale + cap) / 2
        words_at, cap_at = (start + cap + 12 * scale, start) if flip else (start, start + label + 12 * scale)
        painter.setFont(self.font())
        painter.setPen(QColor(theme.on_accent))
        painter.drawText(QRectF(words_at - 1, body.top(), label + 2, body.height()), CENTRE, self.text())
        ink = theme.on_accent
        draw_key(painter, cap_at, body.center().y(), self._key, scale, ink=ink, edge=ink, strength=0.5)
        painter.end()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave arrows to the page: they scroll or move there, and must not lead the keyboard away."""
        if event.key() in ARROWS:
            event.ignore()
        else:
            super().keyPressEvent(event)

"""One answer that can be chosen."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPoint, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QEnterEvent, QFontMetricsF, QInputDevice, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QRadioButton, QWidget

from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.participant.pages.questionnaire_grid import POINTS
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, font

CENTRE = int(Qt.AlignmentFlag.AlignCenter)
NO_VALUE = "–"


class Cell(QRadioButton):
    """One answer: the whole rectangle is clickable; chosen is told by shape, fill and a check mark."""

    entered = Signal(int)
    left = Signal()

    def __init__(self, column: int, name: str, statement: str, parent: QWidget) -> None:
        super().__init__(parent)
        self._column = column
        self._scale = 1.0
        self._pointed = False
        self.setAccessibleName(name)
        self.setAccessibleDescription(statement)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)  # the row holds the keyboard
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    @property
    def column(self) -> int:
        """Place in the row, 0 … 6; 7 is "cannot judge"."""
        return self._column

    @property
    def value(self) -> int | None:
        """What choosing this cell answers."""
        return None if self._column == POINTS else self._column + 1

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        self._scale = scale
        self.update()

    def point(self, pointed: bool) -> None:
        """Show that the pointer, or the keyboard's own pointer, is here."""
        if pointed != self._pointed:
            self._pointed = pointed
            self.update()

    def hitButton(self, position: QPoint) -> bool:  # noqa: N802
        """Take clicks anywhere in the rectangle."""
        return self.rect().contains(position)

    def enterEvent(self, event: QEnterEvent) -> None:  # noqa: N802
        """Tell that the pointer is here."""
        super().enterEvent(event)
        self.entered.emit(self._column)

    def leaveEvent(self, event: QEvent) -> None:  # noqa: N802
        """Tell that it is no longer."""
        super().leaveEvent(event)
        self.left.emit()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """Let a finger that is lifted point at nothing any more."""
        super().mouseReleaseEvent(event)
        if event.device().type() == QInputDevice.DeviceType.TouchScreen:
            self.left.emit()

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802
        """Draw the cell."""
        painter = page_painter(self)
        theme, scale = PARTICIPANT, self._scale
        text = NO_VALUE if self._column == POINTS else str(self._column + 1)
        if self.isChecked():
            self._paint_chosen(painter, "" if self._column == POINTS else text)
            painter.end()
            return
        strong = self._pointed
        inset = 0.75 if strong else 0.5
        body = QRectF(self.rect()).adjusted(inset, inset, -inset, -inset)
        edge = QPen(QColor(theme.text if strong else theme.ctl), 1.5 if strong else 1.0)
        if self._column == POINTS and not strong:
            edge.setDashPattern([3, 3])
        painter.setPen(edge)
        fill = theme.hover if strong else theme.surface
        painter.setBrush(Qt.BrushStyle.NoBrush if self._column == POINTS and not strong else QColor(fill))
        painter.drawRoundedRect(body, RADIUS_CONTROL * scale, RADIUS_CONTROL * scale)
        painter.setFont(font("cell", scale=scale))
        painter.setPen(QColor(theme.text if strong or self._focused() else theme.text2))
        painter.drawText(QRectF(self.rect()), CENTRE, text)
        painter.end()

    def _focused(self) -> bool:
        row = self.parentWidget()
        return row is not None and row.hasFocus()

    def _paint_chosen(self, painter: QPainter, text: str) -> None:
        theme, scale = PARTICIPANT, self._scale
        body = QRectF(self.rect())
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.accent))
        painter.drawRoundedRect(body, body.height() / 2, body.height() / 2)
        face = font("chosen", scale=scale)
        mark = min(19 * scale, body.width() * 0.34)
        width = QFontMetricsF(face).horizontalAdvance(text) if text else 0.0
        gap = min(6 * scale, body.width() * 0.06) if text else 0.0
        left = body.center().x() - (mark + gap + width) / 2
        draw_icon(painter, "check", QRectF(left, body.center().y() - mark / 2, mark, mark), theme.on_accent, 2.4)
        painter.setFont(face)
        painter.setPen(QColor(theme.on_accent))
        painter.drawText(QRectF(left + mark + gap, 0, width + 2, body.height()), CENTRE, text)

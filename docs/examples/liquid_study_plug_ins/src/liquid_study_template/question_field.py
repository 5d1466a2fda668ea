"""The field of a grid question on the participant's page."""

from typing import ClassVar

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.forms.question_field import QuestionField
from study_app.gui.theme.theme import PARTICIPANT, font

STEPS = {Qt.Key.Key_Left: (-1, 0), Qt.Key.Key_Right: (1, 0), Qt.Key.Key_Up: (0, 1), Qt.Key.Key_Down: (0, -1)}


class Cells(QWidget):
    """The cells; a click or an arrow key chooses one."""

    def __init__(self, field: "GridField") -> None:
        super().__init__(field)
        self.field = field
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(field.view.text)

    def minimumSizeHint(self) -> QSize:
        return QSize(*[round(300 * self.field.scale)] * 2)

    def place(self) -> QRectF:
        """Return the square of the cells, with room for the words around it [px]."""
        room, side = 24 * self.field.scale, min(self.width(), self.height())
        return QRectF((self.width() - side) / 2, 0, side, side).adjusted(room, room, -room, -room)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        square, count = self.place(), self.field.view.cells
        x = int((event.position().x() - square.left()) / square.width() * count)
        y = int((square.bottom() - event.position().y()) / square.height() * count)
        if 0 <= x < count and 0 <= y < count:
            self.field.give_answer(f"{x + 1} {y + 1}")

    def keyPressEvent(self, event: QKeyEvent) -> None:
        count = self.field.view.cells
        step = STEPS.get(Qt.Key(event.key()))
        if step is None:
            super().keyPressEvent(event)
            return
        here = map(int, str(self.field.value).split()) if self.field.value else ((count + 1) // 2,) * 2
        x, y = (min(max(one + by, 1), count) for one, by in zip(here, step, strict=True))
        self.field.give_answer(f"{x} {y}")

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter, square, view = QPainter(self), self.place(), self.field.view
        side = square.width() / view.cells
        painter.setPen(QColor(PARTICIPANT.ctl))
        for x in range(view.cells):
            for y in range(view.cells):
                chosen = self.field.value == f"{x + 1} {y + 1}"
                painter.setBrush(QColor(PARTICIPANT.accent if chosen else PARTICIPANT.surface))
                painter.drawRect(QRectF(square.left() + x * side, square.bottom() - (y + 1) * side, side, side))
        painter.setPen(QColor(PARTICIPANT.text))
        painter.setFont(font("label", scale=self.field.scale))
        painter.translate(square.center())
        half, room = square.width() / 2, square.top()
        outside = -half - room
        for words, turn, y in zip(view.edges, (-90, 90, 0, 0), (outside, outside, half, outside), strict=True):
            painter.rotate(turn)
            painter.drawText(QRectF(-half, y, 2 * half, room), Qt.AlignmentFlag.AlignCenter, words)
            painter.rotate(-turn)
        painter.end()


class GridField(QuestionField):
    """A grid, answered by a click or the arrow keys."""

    widget_id: ClassVar[str] = "liquid-study-template:grid"

    def __init__(self, view, words, parent) -> None:
        super().__init__(view, words, parent)
        self.cells = Cells(self)
        self.setFocusProxy(self.cells)
        self.put_answer_part(self.cells)

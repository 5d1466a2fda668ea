"""Targets in the tank, seen from the front or from above: drag them, or move the chosen one by the arrow keys."""

from typing import Final, Literal

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QKeyEvent, QLinearGradient, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.designer.form.facts.targets import Point, TargetsInTank
from study_app.gui.theme.theme import RADIUS_CONTROL, TANK, font
from study_app.gui.theme.themed import Themed

FAR_MM, STEP_MM = 5.0, 1.0
EDGE_PX, HEAD_PX = 6, 18
STEPS: Final = {
    Qt.Key.Key_Left: (-1, 0), Qt.Key.Key_Right: (1, 0), Qt.Key.Key_Up: (0, 1), Qt.Key.Key_Down: (0, -1),
}  # fmt: skip


class TankView(Themed, QWidget):
    """Draws targets, one of them chosen.

    Signals: ``moved`` (number of the target, its point [mm], whether by keys), ``picked`` (number), ``came``.
    """

    moved = Signal(int, object, bool)
    picked = Signal(int)
    came = Signal()

    def __init__(self, side: Literal["front", "above"]) -> None:
        super().__init__()
        self.side = side
        self.down = 1 if side == "front" else 2
        """The axis that is drawn vertically: y of the front, z from above, where it points down."""
        self.shown = TargetsInTank((1.0, 1.0, 1.0), 1.0, ())
        self.chosen = 0
        self._dragged: Point | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def show_targets(self, shown: TargetsInTank, chosen: int) -> None:
        self.shown, self.chosen = shown, min(chosen, max(0, len(shown.points) - 1))
        self._dragged = None
        self._say()
        self.updateGeometry()
        self.update()

    def _say(self) -> None:
        points = self.shown.points
        self.setAccessibleName(f"Targets in the tank, {'from the front' if self.side == 'front' else 'from above'}")
        point = points[self.chosen] if points else None
        where = "no targets" if point is None else f"target {self.chosen + 1} of {len(points)} at {written(point)}"
        self.setAccessibleDescription(f"{where}; arrow keys move it, Page Up and Page Down choose another one")

    def sizeHint(self) -> QSize:
        return QSize(200, 138)

    def minimumSizeHint(self) -> QSize:
        return QSize(120, 138)

    # places

    def _tank(self) -> QRectF:
        room = QRectF(self.rect()).adjusted(EDGE_PX, HEAD_PX, -EDGE_PX, -EDGE_PX)
        wide, high = self.shown.size_mm[0], self.shown.size_mm[self.down]
        scale = min(room.width() / wide, room.height() / high)
        tank = QRectF(0, 0, wide * scale, high * scale)
        tank.moveCenter(room.center())
        return tank

    def place(self, point: Point) -> QPointF:
        """Return where a point is drawn [px]."""
        tank = self._tank()
        scale = tank.width() / self.shown.size_mm[0]
        up = point[self.down] * (-1 if self.side == "front" else 1)
        return tank.center() + QPointF(point[0] * scale, up * scale)

    def _point(self, at: QPointF, before: Point) -> Point:
        tank = self._tank()
        scale = tank.width() / self.shown.size_mm[0]
        away = at - tank.center()
        moved = list(before)
        moved[0], moved[self.down] = away.x() / scale, away.y() / scale * (-1 if self.side == "front" else 1)
        return self.shown.within((moved[0], moved[1], moved[2]))

    def _at(self, number: int) -> Point | None:
        return self._dragged if self._dragged is not None and number == self.chosen else self.shown.points[number]

    # mouse and keys

    def mousePressEvent(self, event: QMouseEvent) -> None:
        away = [
            ((self.place(point) - event.position()).manhattanLength(), number)
            for number, point in enumerate(self.shown.points)
            if point is not None
        ]
        if event.button() == Qt.MouseButton.LeftButton and away:
            self.picked.emit(min(away)[1])

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        point = self.shown.points[self.chosen] if self.shown.points else None
        if event.buttons() & Qt.MouseButton.LeftButton and point is not None:
            self._dragged = self._point(event.position(), self._dragged or point)
            self.update()

    def mouseReleaseEvent(self, _event: QMouseEvent) -> None:
        if (point := self._dragged) is not None:
            self._dragged = None
            self.moved.emit(self.chosen, point, False)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key, count = Qt.Key(event.key()), len(self.shown.points)
        if key == Qt.Key.Key_Escape and self._dragged is not None:
            self._dragged = None
            self.update()
        elif key in (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown) and count:
            self.picked.emit((self.chosen + (1 if key == Qt.Key.Key_PageDown else -1)) % count)
        elif key in STEPS and count and (point := self.shown.points[self.chosen]) is not None:
            far = FAR_MM if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else STEP_MM
            right, up = STEPS[key]
            moved = list(point)
            moved[0] += far * right
            moved[self.down] += far * up * (1 if self.side == "front" else -1)
            self.moved.emit(self.chosen, self.shown.within((moved[0], moved[1], moved[2])), True)
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.came.emit()
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        t, painter, tank = self.theme, QPainter(self), self._tank()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QColor(t.text2))
        painter.setFont(font("small"))
        words = "Front: x right, y up" if self.side == "front" else "From above: x right, z down"
        painter.drawText(QRectF(tank.left(), 0, self.width() - tank.left(), HEAD_PX - 2), words)
        water = QLinearGradient(tank.topLeft(), tank.bottomLeft())
        water.setColorAt(0, QColor(TANK.water_light))
        water.setColorAt(1, QColor("#142E40") if self.side == "front" else QColor(TANK.water_light))
        painter.setPen(QPen(QColor(t.accent if self.hasFocus() else t.ctl), 2 if self.hasFocus() else 1))
        painter.setBrush(water)
        painter.drawRoundedRect(tank, RADIUS_CONTROL, RADIUS_CONTROL)
        radius = self.shown.radius_mm * tank.width() / self.shown.size_mm[0]
        for number in range(len(self.shown.points)):
            if (point := self._at(number)) is not None:
                self._paint_target(painter, self.place(point), max(radius, 3.0), number)

    def _paint_target(self, painter: QPainter, at: QPointF, radius: float, number: int) -> None:
        lit = number == self.chosen
        style = Qt.PenStyle.SolidLine if lit else Qt.PenStyle.DashLine
        painter.setPen(QPen(QColor(TANK.lit if lit else TANK.dim), 2.4 if lit else 1.6, style))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(at, radius, radius)
        painter.setPen(QColor(TANK.lit if lit else TANK.dim))
        painter.setFont(font("small", weight=700 if lit else 500))
        painter.drawText(QRectF(at.x() - 12, at.y() - 9, 24, 18), Qt.AlignmentFlag.AlignCenter, str(number + 1))


def written(point: Point) -> str:
    """Return a point in words."""
    return ", ".join(f"{axis} {at:g}" for axis, at in zip("xyz", point, strict=True)) + " mm"

"""Targets of a task: drawn in the tank, with a row of x, y and z for each."""

from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QKeyEvent, QLinearGradient, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QBoxLayout, QGridLayout, QSizePolicy, QWidget

from study_app.designer.document.fields import Row, row_at
from study_app.designer.document.steps import AddEntry, RemoveKey, SetValue
from study_app.designer.document.study import Study
from study_app.designer.form.fields import Field, SpecialEditor, add_button, kept
from study_app.designer.form.rows import FormRow
from study_app.designer.form.typed_fields import FIELD_PX, TypedLine
from study_app.gui.theme.theme import RADIUS_CONTROL, TANK, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import add_layout, hbox
from study_app.gui.widgets.boxes import grid as grid_of
from study_app.gui.widgets.cards import smooth_painter
from study_app.gui.widgets.controls import IconButton
from study_app.gui.widgets.labels import figures, label
from study_app.number_text import number_of
from study_app.protocol.source.document import Path

Point: TypeAlias = tuple[float, float, float]
TANK_MM: Final = (100.0, 60.0, 60.0)


@dataclass(frozen=True, slots=True)
class TargetsInTank:
    """Targets in the hand frame [mm]."""

    size_mm: Point  # full size of the tank in x (right), y (up) and z (toward the participant)
    radius_mm: float  # radius of a target
    points: tuple[Point | None, ...]  # centre of each target; None where the file holds no point

    def within(self, point: Point) -> Point:
        """Return the nearest point, in whole millimetres, at which a target is inside the tank."""
        x, y, z = (_clamped(at, size / 2 - self.radius_mm) for at, size in zip(point, self.size_mm, strict=True))
        return x, y, z


def _clamped(at: float, most: float) -> float:
    most = max(0.0, most)
    return min(max(float(round(at)), -most), most)


def targets_in_tank(study: Study, row: Row) -> TargetsInTank:
    """Return the targets of a row with the tank that they are in."""
    size = _point(_value(study, ("device", "workspace_mm"))) or TANK_MM
    radius = _value(study, (*row.path[:-1], "radius_mm"))
    points = row.value if isinstance(row.value, tuple) else ()
    radius_mm = float(radius) if isinstance(radius, int | float) and radius > 0 else 1.0
    return TargetsInTank(size, radius_mm, tuple(map(_point, points)))


def _value(study: Study, path: Path) -> Any:
    row = row_at(study.document, path)
    return None if row is None else row.default if row.value is None else row.value


def _point(value: Any) -> Point | None:
    if not isinstance(value, tuple | list) or len(value) != 3:
        return None
    if not all(isinstance(part, int | float) and not isinstance(part, bool) for part in value):
        return None
    x, y, z = map(float, value)
    return x, y, z


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
        points = self.shown.points
        self.setAccessibleName(f"Targets in the tank, {('from the front' if self.side == 'front' else 'from above')}")
        point = points[self.chosen] if points else None
        where = "no targets" if point is None else f"target {self.chosen + 1} of {len(points)} at {written(point)}"
        self.setAccessibleDescription(f"{where}; arrow keys move it, Page Up and Page Down choose another one")
        self.updateGeometry()
        self.update()

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
        t, painter, tank = self.theme, smooth_painter(self), self._tank()
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


AXES: Final = ("x", "y", "z")


class TargetsField(Field):
    """The tank from the front and from above, and the numbers."""

    caption = "mm of the hand; drag, or arrow keys"

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.chosen = 0
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.front, self.above = TankView("front"), TankView("above")
        for view in (self.front, self.above):
            view.moved.connect(self._move)
            view.picked.connect(self._pick)
            view.came.connect(self.came)
        add_layout(self.box, hbox(self.front, self.above, spacing=8))
        grid = grid_of(6, 6)
        for column, axis in enumerate(AXES, start=1):
            grid.addWidget(label(axis, "small", "text2"), 0, column)
        self.lines: list[list[TypedLine]] = []
        for number in range(len(row.facts.points)):
            self._add_line(grid, number)
        add_layout(self.box, grid)
        self.add = add_button(f"Add to {row.row.label}", "Target")
        self.add.clicked.connect(lambda: self.asked.emit(AddEntry(self.row.row.path)))
        self.box.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        self.setFocusProxy(self.front)
        self.show_value()

    def _add_line(self, grid: QGridLayout, number: int) -> None:
        name = f"Target {number + 1}"
        grid.addWidget(figures(str(number + 1), "label", "text2"), number + 1, 0)
        lines = []
        for column, axis in enumerate(AXES, start=1):
            line = TypedLine(f"{name}, {axis} in mm")
            line.setAlignment(Qt.AlignmentFlag.AlignRight)
            line.typed.connect(lambda text, at=column - 1: self._take(number, at, text))
            line.came.connect(lambda: self._come(number))
            grid.addWidget(line, number + 1, column)
            lines.append(line)
        away = IconButton("cross", f"Remove {name}", size=FIELD_PX, role="plain")
        away.clicked.connect(lambda: self.asked.emit(RemoveKey((*self.row.row.path, number))))
        grid.addWidget(away, number + 1, 4)
        self.lines.append(lines)

    def show_value(self) -> None:
        self.chosen = min(self.chosen, max(0, len(self.lines) - 1))
        for view in (self.front, self.above):
            view.show_targets(self.row.facts, self.chosen)
        for lines, point in zip(self.lines, self.row.facts.points, strict=True):
            for axis, line in enumerate(lines):
                if not (self.refusal and line.property("state")):
                    line.show_text("" if point is None else f"{point[axis]:g}")

    def _pick(self, number: int) -> None:
        self.chosen = number
        self.show_value()

    def _come(self, number: int) -> None:
        if number != self.chosen:
            self._pick(number)
        self.came.emit()

    def _move(self, number: int, point: Point, by_keys: bool) -> None:
        value = [int(at) if at.is_integer() else at for at in point]
        self.asked.emit(SetValue((*self.row.row.path, number), value, by_keys))

    def _take(self, number: int, axis: int, text: str) -> None:
        value = number_of(text)
        point = self.row.facts.points[number] or (0.0, 0.0, 0.0)
        self.refusal = "" if value is not None else f"“{text}” is not a number. {kept(point[axis])}"
        self.lines[number][axis].show_refused(value is None)
        self.came.emit()
        if value is not None:
            before = [int(at) if at.is_integer() else at for at in point]
            before[axis] = value
            self.asked.emit(SetValue((*self.row.row.path, number), before, typing=True))


TARGETS: Final = SpecialEditor(
    (("Reach", "targets_mm"),),
    TargetsField,
    wide=True,
    structure=lambda row: len(row.facts.points),
    facts=targets_in_tank,
)

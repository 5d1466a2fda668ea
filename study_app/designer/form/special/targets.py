"""The targets of a reaching task: drawn in the tank, with a row of x, y and z for each below."""

from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QBoxLayout, QGridLayout

from study_app.designer.form.facts.targets import Point
from study_app.designer.form.form_rows import FormRow
from study_app.designer.form.row_fields import Field, add_button, kept
from study_app.designer.form.special_editor import SpecialEditor
from study_app.designer.form.tank_view import TankView
from study_app.designer.form.typed_fields import FIELD_PX, TypedLine
from study_app.designer.place.requests import AddEntry, RemoveKey, SetValue
from study_app.gui.widgets.boxes import add_layout, hbox
from study_app.gui.widgets.controls import IconButton
from study_app.gui.widgets.labels import figures, label
from study_app.number_text import number_of

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
        grid = QGridLayout()
        grid.setSpacing(6)
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
                if not line.property("state"):
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


EDITOR: Final = SpecialEditor((("Reach", "targets_mm"),), TargetsField, wide=True)

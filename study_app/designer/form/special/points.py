"""The points of a scale from end to end, with their words in each language."""

from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QBoxLayout, QGridLayout

from study_app.designer.form.form_rows import FormRow, is_right_to_left
from study_app.designer.form.row_fields import Field, add_button
from study_app.designer.form.special_editor import SpecialEditor
from study_app.designer.form.typed_fields import FIELD_PX, TypedLine
from study_app.designer.place.requests import AddEntry, RemoveKey, Request, SetValue, Several
from study_app.gui.widgets.boxes import add_layout
from study_app.gui.widgets.controls import IconButton
from study_app.gui.widgets.labels import figures, label


class PointsField(Field):
    """A line for each point, a column for each language."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        grid = QGridLayout()
        grid.setSpacing(6)
        for column, (_code, language) in enumerate(row.facts.languages, start=1):
            grid.addWidget(label(language, "small", "text2"), 0, column)
        self.lines: list[list[TypedLine]] = []
        count = len(row.facts.points)
        for at in range(count):
            self._add_line(grid, at, {0: "lowest", count - 1: "highest"}.get(at, ""))
        add_layout(self.box, grid)
        self.add = add_button("Add a point", "Point")
        self.add.clicked.connect(self._ask_to_add)
        self.box.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        self.setFocusProxy(self.lines[0][0] if self.lines else self.add)
        self.show_value()

    def _add_line(self, grid: QGridLayout, at: int, end: str) -> None:
        grid.addWidget(figures(f"{at + 1}  {end}".strip(), "label", "text2"), at + 1, 0)
        lines = []
        for column, (code, language) in enumerate(self.row.facts.languages, start=1):
            line = TypedLine(f"Point {at + 1}, {language}")
            line.setPlaceholderText(f"Missing in {language}")
            line.typed.connect(lambda text, code=code: self._take(at, code, text))
            line.came.connect(self.came)
            if is_right_to_left(code):
                line.setLayoutDirection(Qt.LayoutDirection.RightToLeft)
            grid.addWidget(line, at + 1, column)
            lines.append(line)
        away = IconButton("cross", f"Remove point {at + 1}", size=FIELD_PX, role="plain")
        away.clicked.connect(lambda: self._ask_to_remove(at))
        grid.addWidget(away, at + 1, len(lines) + 1)
        self.lines.append(lines)

    def show_value(self) -> None:
        for lines, words in zip(self.lines, self.row.facts.points, strict=True):
            for line, text in zip(lines, words, strict=True):
                line.show_text(text)

    def _written(self, code: str) -> int:
        """Return how many points the file has in a language."""
        return len((self.row.row.value or {}).get(code, ()))

    def _take(self, at: int, code: str, text: str) -> None:
        path, there = (*self.row.row.path, code), self._written(code)
        if at < there:
            self.asked.emit(SetValue((*path, at), text, typing=True))
        else:
            missing = [*((self.row.row.value or {}).get(code, ())), *[""] * (at - there), text]
            self.asked.emit(SetValue(path, missing, typing=True))

    def _ask_to_add(self) -> None:
        path, number = self.row.row.path, len(self.lines) + 1
        added: list[Request] = [
            AddEntry((*path, code), f"Point {number}") for code, _ in self.row.facts.languages if self._written(code)
        ]
        self.asked.emit(Several("Add point", tuple(added)))

    def _ask_to_remove(self, at: int) -> None:
        path = self.row.row.path
        gone: list[Request] = [
            RemoveKey((*path, code, at)) for code, _ in self.row.facts.languages if at < self._written(code)
        ]
        self.asked.emit(Several(f"Remove point {at + 1}", tuple(gone)))


def _shown(row: FormRow) -> object:
    return row.facts.languages, len(row.facts.points)


EDITOR: Final = SpecialEditor((("Scale", "labels"),), PointsField, wide=True, structure=_shown)

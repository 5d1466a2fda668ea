"""One statement of a questionnaire and its cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QFont, QFontMetricsF, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from study_app.gui.icons import draw_icon
from study_app.gui.pages.cells import Cell
from study_app.gui.pages.grid import POINTS, Grid
from study_app.gui.theme import PARTICIPANT, font
from study_app.session.pages import ItemView

if TYPE_CHECKING:
    from study_app.protocol.words import Words

WRAP_LEFT = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)


class Row(QWidget):
    """A statement with its cells: one stop of the Tab key.

    1 … 7 choose; left and right move a pointer of the keyboard's own, Space chooses there; the mouse chooses anywhere.
    ``chosen(changed, by_key)`` comes when a choice is made; ``wandered(column)`` is the column pointed at, -1 for none;
    ``seen`` comes with the first painting on a screen.
    """

    chosen = Signal(bool, bool)
    wandered = Signal(int)
    seen = Signal()

    def __init__(
        self, item: ItemView, labels: tuple[str, ...], judge: str | None, words: Words, parent: QWidget
    ) -> None:
        super().__init__(parent)
        self.item = item
        self.answered = False
        self.value: int | None = None
        self.missing = False
        self._words = words
        self._labels = labels
        self._grid: Grid | None = None
        self._seen = False
        self._last = False
        self._wandering = -1
        names = [f"{point} {label}" for point, label in enumerate(labels, start=1)]
        self.cells = tuple(
            Cell(column, name, self) for column, name in enumerate([*names, judge] if judge is not None else names)
        )
        for cell in self.cells:
            cell.clicked.connect(lambda _=False, cell=cell: self._clicked(cell))
            cell.entered.connect(self._wander)
            cell.left.connect(lambda: self._wander(-1))
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._name()

    def answer(self, value: int | None) -> None:
        """Show ``value`` as chosen, without telling anyone."""
        self.answered, self.value, self.missing = True, value, False
        for cell in self.cells:
            cell.setChecked(cell.value == value)
        self._name()
        self.update()

    def ask(self, missing: bool) -> None:
        """Mark the statement as still to be answered."""
        self.missing = missing and not self.answered
        self._name()
        self.update()

    def place(self, places: Grid, top: float, *, last: bool) -> None:
        """Put the row at ``top`` and its cells where the grid says; ``last`` has no line under it."""
        self._grid, self._last = places, last
        left = places.margin - 16 * places.scale
        self.setGeometry(round(left), round(top), round(places.row_width), round(top + places.pitch) - round(top))
        y = round((self.height() - places.cell_height) / 2)
        for cell in self.cells:
            x, width = places.cell(cell.column)
            cell.set_scale(places.scale)
            cell.setGeometry(round(x), y, round(width), round(places.cell_height))

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        """Choose with 1 … 7 and with Space, wander with left and right; the rest is the page's."""
        point = event.key() - Qt.Key.Key_0
        if 1 <= point <= POINTS and not event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            if not event.isAutoRepeat():
                self._choose(point, by_key=True)
        elif event.key() in (Qt.Key.Key_Left, Qt.Key.Key_Right):
            self._step(1 if event.key() == Qt.Key.Key_Right else -1)
        elif event.key() == Qt.Key.Key_Space and self._wandering >= 0 and not event.isAutoRepeat():
            self._choose(self.cells[self._wandering].value, by_key=True)
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:  # noqa: N802
        """Show the ring."""
        super().focusInEvent(event)
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:  # noqa: N802
        """Hide the ring and the keyboard's pointer."""
        super().focusOutEvent(event)
        self._wander(-1)
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """Take the keyboard where the mouse clicks beside the cells."""
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        event.accept()

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802
        """Draw number, statement, marks and ring."""
        if self._grid is None:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._paint_ground(painter, self._grid)
        self._paint_statement(painter, self._grid)
        painter.end()
        if not self._seen and self.window().isVisible():
            self._seen = True
            self.seen.emit()

    def _paint_ground(self, painter: QPainter, places: Grid) -> None:
        theme, scale = PARTICIPANT, places.scale
        ring = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        focus = self.hasFocus()
        if focus or self.missing:
            painter.setPen(QPen(QColor(theme.accent), 2) if focus else Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.selected))
            painter.drawRoundedRect(ring, 10 * scale, 10 * scale)
        elif not self._last:
            painter.setPen(QPen(QColor(theme.grid), 1))
            margin, y = 16 * scale, self.height() - 0.5
            painter.drawLine(QPointF(margin, y), QPointF(self.width() - margin, y))
        if self.missing:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.warn))
            bar = QRectF(4 * scale, self.height() * 0.19, 4 * scale, self.height() * 0.62)
            painter.drawRoundedRect(bar, 2 * scale, 2 * scale)
        if places.rule is not None:
            painter.setPen(QPen(QColor(theme.border), 1))
            x = round(places.rule) + 0.5
            half = places.cell_height * 0.4
            middle = self.height() / 2
            painter.drawLine(QPointF(x, middle - half), QPointF(x, middle + half))

    def _paint_statement(self, painter: QPainter, places: Grid) -> None:
        theme, scale = PARTICIPANT, places.scale
        note = self._note()
        face, note_face, height, note_height = self._fitted(places, note)
        top = (self.height() - height - note_height) / 2
        width = places.statement_width
        line = QFontMetricsF(face).height()
        painter.setFont(font("cell", scale=scale * 0.9, weight=700 if self.missing else 400))
        painter.setPen(QColor(theme.warn if self.missing else theme.text3))
        painter.drawText(
            QRectF(16 * scale, top, 28 * scale, line), Qt.AlignmentFlag.AlignVCenter, str(self.item.number)
        )
        painter.setFont(face)
        painter.setPen(QColor(theme.text))
        painter.drawText(QRectF(places.statement_left, top, width, height + 4), WRAP_LEFT, self.item.text)
        if not note:
            return
        mark = note_height
        ink = theme.warn if self.missing else theme.text3
        left = places.statement_left
        if self.missing:
            draw_icon(painter, "warning", QRectF(left, top + height + 1, mark, mark - 1), ink, 2.0)
            left += mark + 5 * scale
        painter.setFont(note_face)
        painter.setPen(QColor(ink))
        painter.drawText(QRectF(left, top + height, width, note_height), Qt.AlignmentFlag.AlignVCenter, note)

    def _note(self) -> str:
        """Return the small line under the statement."""
        if self.missing:
            words = self._words
            return f"{words.please_answer} · {words.press_keys}" if self.hasFocus() else words.please_answer
        return "" if self.item.required else self._words.optional

    def _fitted(self, places: Grid, note: str) -> tuple[QFont, QFont, float, float]:
        """Return the largest fonts with which statement and note fit the row, and their heights [px]."""
        room = self.height() - 3 * places.scale
        for shrink in (1.0, 0.94, 0.88, 0.82, 0.76):
            weight = 500 if self.missing or self.hasFocus() else 400
            face = font("statement", scale=places.scale * shrink, weight=weight)
            note_face = font("label", scale=places.scale * max(shrink, 0.88), weight=600)
            bounds = QFontMetricsF(face).boundingRect(
                QRectF(0, 0, places.statement_width, 1e4), WRAP_LEFT, self.item.text
            )
            note_height = QFontMetricsF(note_face).height() if note else 0.0
            if bounds.height() + note_height <= room:
                break
        return face, note_face, bounds.height(), note_height

    def _clicked(self, cell: Cell) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        self._choose(cell.value, by_key=False)

    def _choose(self, value: int | None, *, by_key: bool) -> None:
        changed = not self.answered or value != self.value
        self.answer(value)
        if changed or by_key:
            self.chosen.emit(changed, by_key)

    def _step(self, by: int) -> None:
        start = self._wandering
        if start < 0:
            checked = next((cell.column for cell in self.cells if cell.isChecked()), None)
            start = checked if checked is not None else (-1 if by > 0 else len(self.cells))
        self._wander(min(max(start + by, 0), len(self.cells) - 1))

    def _wander(self, column: int) -> None:
        self._wandering = column
        for cell in self.cells:
            cell.point(cell.column == column)
        self.wandered.emit(column)

    def _name(self) -> None:
        """Give the row its name and state for a screen reader."""
        words = self._words
        self.setAccessibleName(f"{self.item.number}. {self.item.text}")
        if not self.answered:
            state = f"{words.please_answer}, {words.press_keys}" if self.missing else words.not_answered
        else:
            chosen = next(cell.accessibleName() for cell in self.cells if cell.value == self.value)
            state = f"{words.chosen}: {chosen}"
        self.setAccessibleDescription(state)

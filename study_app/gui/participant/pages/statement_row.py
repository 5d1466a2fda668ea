"""One statement of a questionnaire and its cells."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QFont, QFontMetricsF, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QGroupBox, QWidget

from study_app.gui.participant.pages.answer_cell import Cell
from study_app.gui.participant.pages.page_widget import mirrored, page_painter
from study_app.gui.participant.pages.questionnaire_grid import NUMBER, POINTS, Grid
from study_app.gui.participant.pages.screen_reader import point_at, say
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.session.pages import ItemView

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

LINE = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
SHRINKING = (1.0, 0.94, 0.88, 0.82, 0.76)  # of words that are larger than they must be, in a window that is too small
WRAP_LEFT = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)


Fitted: TypeAlias = tuple[QFont, QFont, float, float]


class Row(QGroupBox):
    """A statement with its cells: one stop of the Tab key, and for a screen reader a group of radio buttons.

    1 … 7 choose; left and right move a pointer of the keyboard's own, Space chooses there; mouse and touch choose
    anywhere. What is pointed at with the keyboard and what is chosen is said to a screen reader.
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
            Cell(column, name, item.text, self)
            for column, name in enumerate([*names, judge] if judge is not None else names)
        )
        for cell in self.cells:
            cell.clicked.connect(lambda _=False, cell=cell: self._clicked(cell))
            cell.toggled.connect(lambda on, cell=cell: self._toggled(cell, on=on))
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

    def fits(self, places: Grid, note: str) -> bool:
        """Return whether statement and ``note`` can be read in a row of these places, no smaller than they must."""
        return self._fitted(places, note) is not None

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
            cell.set_scale(places.text)
            cell.setGeometry(round(x), y, round(width), round(places.cell_height))

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        """Choose with 1 … 7 and with Space, wander with left and right; the rest is the page's."""
        point = event.key() - Qt.Key.Key_0
        if 1 <= point <= POINTS and not event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            if not event.isAutoRepeat():
                self._choose(point, by_key=True)
        elif event.key() in (Qt.Key.Key_Left, Qt.Key.Key_Right):
            self._step(1 if event.key() == Qt.Key.Key_Right else -1)  # the scale's order is the same in every language
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
        painter = page_painter(self)
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
            bar = self._placed(QRectF(4 * scale, self.height() * 0.19, 4 * scale, self.height() * 0.62))
            painter.drawRoundedRect(bar, 2 * scale, 2 * scale)
        if places.rule is not None:
            painter.setPen(QPen(QColor(theme.border), 1))
            x = round(places.rule) + 0.5
            half = places.cell_height * 0.4
            middle = self.height() / 2
            painter.drawLine(QPointF(x, middle - half), QPointF(x, middle + half))

    def _paint_statement(self, painter: QPainter, places: Grid) -> None:
        theme, text = PARTICIPANT, places.text
        note = self._note()
        face, note_face, height, note_height = self._fitted(places, note) or self._smallest(places, note)
        top = (self.height() - height - note_height) / 2
        left, width = places.statement_left, places.statement_width
        line = QFontMetricsF(face).height()
        painter.setFont(font("cell", scale=text * 0.9, weight=700 if self.missing else 400))
        painter.setPen(QColor(theme.warn if self.missing else theme.text3))
        painter.drawText(QRectF(places.number_left, top, NUMBER * text, line), LINE, str(self.item.number))
        painter.setFont(face)
        painter.setPen(QColor(theme.text))
        painter.drawText(QRectF(left, top, width, height + 4), WRAP_LEFT, self.item.text)
        if not note:
            return
        ink = theme.warn if self.missing else theme.text3
        taken = 0.0
        if self.missing:
            mark = QRectF(left, top + height + 1, note_height, note_height - 1)
            if self._mirrored:
                mark.moveRight(left + width)
            draw_icon(painter, "warning", mark, ink, 2.0)
            taken = note_height + 5 * places.scale
        painter.setFont(note_face)
        painter.setPen(QColor(ink))
        beside = QRectF(left if self._mirrored else left + taken, top + height, width - taken, note_height)
        painter.drawText(beside, LINE, note)

    @property
    def _mirrored(self) -> bool:
        return self.layoutDirection() == Qt.LayoutDirection.RightToLeft

    def _placed(self, place: QRectF) -> QRectF:
        return mirrored(place, self.width()) if self._mirrored else place

    def _note(self) -> str:
        """Return the small line under the statement."""
        if self.missing:
            words = self._words
            return f"{words.please_answer} · {words.press_keys}" if self.hasFocus() else words.please_answer
        return "" if self.item.required else self._words.optional

    def _fitted(self, places: Grid, note: str) -> Fitted | None:
        """Return the largest fonts with which statement and note fit the row, and their heights [px]; None if none do.

        Words that must be so large (``places.text`` beyond ``places.scale``) are not made smaller; a note may be.
        """
        room = math.floor(places.pitch) - 3 * places.scale
        must = places.text > places.scale
        sizes = ((1.0, 1.0), (1.0, places.scale / places.text)) if must else ((s, max(s, 0.88)) for s in SHRINKING)
        for shrink, note_shrink in sizes:
            fitted = self._measured(places, note, shrink, note_shrink)
            if fitted[2] + fitted[3] <= room:
                return fitted
        return None

    def _smallest(self, places: Grid, note: str) -> Fitted:
        """Return fonts for a row that is alone on its page and still too low."""
        room = math.floor(places.pitch) - 3 * places.scale
        for percent in range(95, 30, -5):
            fitted = self._measured(places, note, percent / 100, percent / 100)
            if fitted[2] + fitted[3] <= room:
                break
        return fitted

    def _measured(self, places: Grid, note: str, shrink: float, note_shrink: float) -> Fitted:
        weight = 500 if self.missing or self.hasFocus() else 400
        face = font("statement", scale=places.text * shrink, weight=weight)
        note_face = font("label", scale=places.text * note_shrink, weight=600)
        room = QRectF(0, 0, places.statement_width, 1e4)
        height = QFontMetricsF(face).boundingRect(room, WRAP_LEFT, self.item.text).height()
        return face, note_face, height, QFontMetricsF(note_face).height() if note else 0.0

    def _toggled(self, cell: Cell, *, on: bool) -> None:
        """Hear a screen reader, which checks a button without a click."""
        if on and not (self.answered and self.value == cell.value):
            self._clicked(cell)

    def _clicked(self, cell: Cell) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        self._choose(cell.value, by_key=False)

    def _choose(self, value: int | None, *, by_key: bool) -> None:
        changed = not self.answered or value != self.value
        self.answer(value)
        if changed:
            say(self, self.accessibleDescription())
            point_at(next(cell for cell in self.cells if cell.value == value))
        if changed or by_key:
            self.chosen.emit(changed, by_key)

    def _step(self, by: int) -> None:
        start = self._wandering
        if start < 0:
            checked = next((cell.column for cell in self.cells if cell.isChecked()), None)
            start = checked if checked is not None else (-1 if by > 0 else len(self.cells))
        self._wander(min(max(start + by, 0), len(self.cells) - 1))
        say(self.cells[self._wandering], self.cells[self._wandering].accessibleName())

    def _wander(self, column: int) -> None:
        if column == self._wandering:
            return
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

"""Two texts side by side: they scroll together, and what differs is marked by colour and sign."""

from __future__ import annotations

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QFont, QFontDatabase, QPainter, QPaintEvent, QResizeEvent, QTextCursor
from PySide6.QtWidgets import QFrame, QPlainTextEdit, QTextEdit, QWidget

from study_app.gui.designer.pane.text_lines import visible_lines
from study_app.gui.theme.theme import Theme
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.cards import Rule
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import Elided, figures
from study_app.viewmodels.designer.versions.side_by_side import Hunk, SideBySide, SideLine

LETTERS_PX = 12
SIGNS = {"changed": "~", "gone": "\u2212", "new": "+"}
MOST_SPANS = 400  # so many changed lines are marked letter by letter


class _Numbers(QWidget):
    """Numbers of the lines and the signs of those that differ."""

    def __init__(self, side: _Side) -> None:
        super().__init__(side)
        self._side = side

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint numbers and signs."""
        self._side.paint_numbers(QPainter(self))


class _Side(Themed, QPlainTextEdit):
    """One of the texts, to be read and copied."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.lines: tuple[SideLine, ...] = ()
        self._chosen = range(0)
        fixed = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
        fixed.setPixelSize(LETTERS_PX)
        fixed.setStyleHint(QFont.StyleHint.Monospace)
        self.setFont(fixed)
        self.setAccessibleName(name)
        self.setReadOnly(True)
        self.setTextInteractionFlags(
            Qt.TextInteractionFlag.TextSelectableByMouse | Qt.TextInteractionFlag.TextSelectableByKeyboard
        )
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.setTabChangesFocus(True)
        self.setStyleSheet(
            "QPlainTextEdit, QPlainTextEdit:focus { border: none; padding: 0; background: transparent; }"
            "QAbstractScrollArea::corner { background: transparent; border: none; }"
        )
        self._numbers = _Numbers(self)
        self.updateRequest.connect(lambda _rect, _by: self._numbers.update())

    def show_lines(self, lines: tuple[SideLine, ...]) -> None:
        """Show other lines."""
        if lines == self.lines:
            return
        self.lines = lines
        scrolled = self.verticalScrollBar().value()
        self.setPlainText("\n".join(line.text for line in lines))
        self.verticalScrollBar().setValue(scrolled)
        self._mark_letters()
        self._place_numbers()

    def show_chosen(self, rows: range) -> None:
        """Mark the rows of the difference that is chosen."""
        self._chosen = rows
        self._numbers.update()

    def apply_theme(self, theme: Theme) -> None:
        """Take the colours of ``theme``."""
        super().apply_theme(theme)
        self._mark_letters()

    def _mark_letters(self) -> None:
        """Mark the letters that differ within changed lines."""
        found = []
        document = self.document()
        for row in [row for row, line in enumerate(self.lines) if line.spans][:MOST_SPANS]:
            for first, last in self.lines[row].spans:
                one = QTextEdit.ExtraSelection()
                cursor = QTextCursor(document.findBlockByNumber(row))
                start, text = cursor.position(), self.lines[row].text
                cursor.setPosition(start + _units(text[:first]))
                cursor.setPosition(start + _units(text[:last]), QTextCursor.MoveMode.KeepAnchor)
                one.cursor = cursor  # type: ignore[attr-defined]  # missing in the stubs
                one.format.setFontWeight(QFont.Weight.Bold)  # type: ignore[attr-defined]
                one.format.setForeground(QColor(self.theme.accent))  # type: ignore[attr-defined]
                found.append(one)
        self.setExtraSelections(found)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the marks of lines, then the text."""
        t, painter = self.theme, QPainter(self.viewport())
        tints = {"changed": t.selected, "gone": t.bad_bg, "new": t.ok_bg, "gap": t.sunk}
        for row, top, height in visible_lines(self):
            if (tint := tints.get(self.lines[row].mark)) is not None:
                painter.fillRect(QRectF(0, top, self.viewport().width(), height), QColor(tint))
        painter.end()
        super().paintEvent(event)

    def paint_numbers(self, painter: QPainter) -> None:
        """Paint the numbers of the lines in view, with signs and a bar at the part that is chosen."""
        t, width = self.theme, self._numbers.width()
        inks = {"changed": t.accent, "gone": t.bad, "new": t.ok}
        painter.setFont(self.font())
        for row, top, height in visible_lines(self):
            line = self.lines[row]
            painter.setPen(QColor(inks.get(line.mark, t.text2)))
            right, middle = Qt.AlignmentFlag.AlignRight, Qt.AlignmentFlag.AlignVCenter
            if line.number is not None:
                painter.drawText(QRectF(0, top, width - 22, height), right | middle, str(line.number))
            painter.drawText(QRectF(width - 18, top, 12, height), middle, SIGNS.get(line.mark, ""))
            if row in self._chosen:
                painter.fillRect(QRectF(0, top, 3, height), QColor(t.accent))

    def _place_numbers(self) -> None:
        width = 30 + self.fontMetrics().horizontalAdvance("9") * max(2, len(str(len(self.lines))))
        self.setViewportMargins(width, 0, 0, 0)
        inside = self.contentsRect()
        self._numbers.setGeometry(inside.left(), inside.top(), width, inside.height())

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802 - Qt's name
        """Place the numbers."""
        super().resizeEvent(event)
        self._place_numbers()


class SideBySideView(QWidget):
    """Draws a `SideBySide`; ``revert_asked`` carries the `Hunk` that is to be as it was."""

    revert_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.shown = SideBySide()
        self._at = 0
        self.before, self.after = _Side("Text of the version"), _Side("Text of the study")
        self.heading = Elided("small", "text2")
        self.place = figures("", "small", "text2")
        self.previous = IconButton("arrow_up", "Previous difference", size=34)
        self.next = IconButton("arrow_down", "Next difference", size=34)
        self.revert = ActionButton("undo", "Revert this part", height=34)
        self.revert.setProperty("dense", "true")
        bar = hbox((self.heading, 1), self.place, self.previous, self.next, self.revert, spacing=8)
        vbox(bar, Rule(), (hbox((self.before, 1), (self.after, 1), spacing=10), 1), spacing=6, margins=0, parent=self)
        for one, other in ((self.before, self.after), (self.after, self.before)):
            one.verticalScrollBar().valueChanged.connect(other.verticalScrollBar().setValue)
            one.horizontalScrollBar().valueChanged.connect(other.horizontalScrollBar().setValue)
        self.heading.show_text("Left: the version. Right: the study now.")
        self.previous.clicked.connect(lambda: self.go(self._at - 1))
        self.next.clicked.connect(lambda: self.go(self._at + 1))
        self.revert.clicked.connect(self._revert)

    @property
    def hunk(self) -> Hunk | None:
        """The difference that is chosen."""
        return self.shown.hunks[self._at] if self._at < len(self.shown.hunks) else None

    def show_sides(self, sides: SideBySide, *, can_revert: bool) -> None:
        """Show other texts."""
        fresh = sides.left != self.shown.left
        self.shown = sides
        self.before.show_lines(sides.left)
        self.after.show_lines(sides.right)
        self.revert.setVisible(can_revert)
        self._at = min(self._at, max(0, len(sides.hunks) - 1))
        self._mark()
        if fresh and self.isVisible():
            self.go(self._at)

    def go(self, at: int) -> None:
        """Show a difference, by its number from 0."""
        if self.shown.hunks:
            self._at = at % len(self.shown.hunks)
            row = self.shown.hunks[self._at].row
            self.after.verticalScrollBar().setValue(max(0, row - 4))
            for side in (self.before, self.after):
                side.setTextCursor(QTextCursor(side.document().findBlockByNumber(row)))
        self._mark()

    def _mark(self) -> None:
        hunk, count = self.hunk, len(self.shown.hunks)
        self.place.setText(f"{self._at + 1} of {count}" if count else "no difference")
        height = 0 if hunk is None else max(len(hunk.before), hunk.last - hunk.first)
        for side in (self.before, self.after):
            side.show_chosen(range(0) if hunk is None else range(hunk.row, hunk.row + height))
        for button in (self.previous, self.next, self.revert):
            button.setEnabled(bool(count))

    def _revert(self) -> None:
        if self.hunk is not None:
            self.revert_asked.emit(self.hunk)


def _units(text: str) -> int:
    """Return how many places of a text document a text takes: letters beyond the basic plane take two."""
    return len(text.encode("utf-16-le")) // 2

"""Fields that are typed in: what is typed is handed on within moments, at Enter, and on leaving the field."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QMimeData, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QKeySequence, QResizeEvent, QTextCursor
from PySide6.QtWidgets import QApplication, QLineEdit, QPlainTextEdit, QWidget

from study_app.gui.kit.commands import keys_of
from study_app.gui.theme.theme import font

HAND_ON_MS = 150
"""What is typed is handed on so long after the first key [ms]: typing without a rest is kept as well."""
CLICK_MS = 10
"""How often it is looked whether the click is done that the keyboard left a field by [ms]."""
FIELD_PX = 34
MOST_LINES, SENTENCE_EDGE_PX = 6, 16
"""How many lines a sentence has at most, and what its field needs above and below them [px]."""
LINE_BREAK = re.compile(r"\s*[\r\n\u2028\u2029]+\s*")
KEYS_OF_PLACE = (QKeySequence.StandardKey.Undo, QKeySequence.StandardKey.Redo, QKeySequence.StandardKey.Save)


def removes_key(event: QKeyEvent) -> bool:
    """Return whether a key removes the field's key from the file."""
    return QKeySequence(event.keyCombination()) == QKeySequence(keys_of("remove")[0])


if TYPE_CHECKING:
    _Base = QWidget
else:
    _Base = object  # mixed into fields of Qt


class _Typed(_Base):
    """What a line and a field of several lines share; ``typed`` carries the text, ``left`` follows when it is left."""

    typed: Any
    came: Any
    left: Any
    rests = True
    """Whether what is typed is handed on while typing, not only at Enter and on leaving."""
    beside: Sequence[_Typed] = ()
    """The fields of all languages of a text in several languages."""

    def begin(self) -> None:
        self.pending = False
        self._before = ""
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.timeout.connect(self._flush_after_click)

    def note(self) -> None:
        self.pending = True
        if self.rests and not self._rest.isActive():
            self._rest.start(HAND_ON_MS)

    def flush(self) -> None:
        self._rest.stop()
        if self.pending:
            self.pending = False
            self.typed.emit(self.words())

    def _flush_after_click(self) -> None:
        """Hand on what was typed, once no button is pressed and no list is open: another form would take it away."""
        if QApplication.mouseButtons() == Qt.MouseButton.NoButton and QApplication.activePopupWidget() is None:
            self.flush()
            if not self.hasFocus():
                self.left.emit()
        else:
            self._rest.start(CLICK_MS)

    def accept(self) -> None:
        """Hand on what was typed; Esc restores it from now on, unless it is refused."""
        self.flush()
        if self.property("state") != "refused":
            self._before = self.words()

    def words(self) -> str:
        raise NotImplementedError

    def nothing_to_delete(self) -> bool:
        """Return whether all of the text is marked, or nothing is and the caret is at its end.

        Of a text in several languages, each must be empty or marked: no key removes a text that is not.
        """
        start, end, length = self.marked()
        others = (one.marked() for one in self.beside)
        return end == length and start in {0, end} and all((0, one[2]) == one[:2] for one in others)

    def marked(self) -> tuple[int, int, int]:
        """Return from where to where the text is marked (twice the caret where it is not), and its length.

        All are in the units of Qt: some letters have two.
        """
        raise NotImplementedError

    def take_over(self, before: _Typed, marked: tuple[int, int, int]) -> None:
        """Take the keyboard of a field of the same name, with its caret and what Esc restores."""
        self.setFocus(Qt.FocusReason.OtherFocusReason)
        self.mark(*marked[:2])
        self._before = before._before

    def mark(self, start: int, end: int) -> None:
        """Mark the text from a place to another; the caret comes to the end."""
        raise NotImplementedError

    def begin_value(self) -> None:
        """Take what is shown as the value of another element: nothing is refused, and Esc restores it."""
        self.show_refused(False)
        self._before = self.words()

    def restore(self) -> None:
        """Hand on what was there when the keyboard came."""
        self._rest.stop()
        self.pending = False
        if self.words() != self._before:
            self.show_text(self._before)
            self.typed.emit(self._before)

    def show_text(self, text: str) -> None:
        """Show a text, unless something else is being typed."""
        raise NotImplementedError

    def show_refused(self, yes: bool) -> None:
        """Give the field the edge of one whose text is refused, or take it away."""
        state = "refused" if yes else ""
        if (self.property("state") or "") != state:
            self.setProperty("state", state)
            self.style().unpolish(self)
            self.style().polish(self)

    def leaves_to_place(self, event: QEvent) -> bool:
        """Return whether a key is the place's, whose undo is for the whole study."""
        if event.type() != QEvent.Type.ShortcutOverride or not isinstance(event, QKeyEvent):
            return False
        if not any(event.matches(key) for key in KEYS_OF_PLACE):
            return False
        self.flush()
        event.ignore()
        return True

    def event(self, event: QEvent) -> bool:
        return True if self.leaves_to_place(event) else super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.restore()
        elif removes_key(event) and self.nothing_to_delete():
            event.ignore()  # its row removes the key
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if self.property("state") != "refused":
            self._before = self.words()
        self.came.emit()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if event.reason() != Qt.FocusReason.MouseFocusReason:
            self.flush()
            QTimer.singleShot(0, self, self.left.emit)  # once the keyboard is elsewhere: the form may be made anew
        else:
            self._rest.start(CLICK_MS)


class TypedLine(_Typed, QLineEdit):
    """One line; ``stepped`` says that an arrow key counts up (1) or down (-1)."""

    stepped = Signal(int)
    typed = Signal(str)
    came = Signal()
    left = Signal()

    def __init__(self, name: str) -> None:
        super().__init__()
        self.begin()
        self.setAccessibleName(name)
        self.setProperty("dense", "true")
        self.setFont(font("label", weight=400))
        self.setFixedHeight(FIELD_PX)
        self.textEdited.connect(lambda _text: self.note())
        self.returnPressed.connect(self.accept)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        steps = {Qt.Key.Key_Up: 1, Qt.Key.Key_Down: -1}
        if event.key() in steps and not event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier:
            self.flush()
            self.stepped.emit(steps[Qt.Key(event.key())])
        else:
            super().keyPressEvent(event)

    def words(self) -> str:
        return self.text()

    def marked(self) -> tuple[int, int, int]:
        at, length = self.cursorPosition(), len(self.text().encode("utf-16-le", "surrogatepass")) // 2
        return (self.selectionStart(), self.selectionEnd(), length) if self.hasSelectedText() else (at, at, length)

    def mark(self, start: int, end: int) -> None:
        if start == end:
            self.setCursorPosition(end)
        else:
            self.setSelection(start, end - start)

    def show_text(self, text: str) -> None:
        if not self.pending and text != self.text():
            at = self.cursorPosition()
            self.setText(text)
            self.setCursorPosition(at if self.hasFocus() else 0)  # Qt leaves the caret at the end of a shorter text


class TypedText(_Typed, QPlainTextEdit):
    """Several lines; Tab leaves the field."""

    typed = Signal(str)
    came = Signal()
    left = Signal()

    def __init__(self, name: str) -> None:
        super().__init__()
        self.begin()
        self.setAccessibleName(name)
        self.setTabChangesFocus(True)
        self.setUndoRedoEnabled(False)
        self.setFont(font("label", weight=400))
        self.setFixedHeight(118)
        self._known, self._showing = "", False
        self.textChanged.connect(self._note_change)

    def _note_change(self) -> None:
        """Note what was typed; Qt says so of another font or margin, too."""
        if self.words() != self._known:
            self._known = self.words()
            if not self._showing:
                self.note()

    def words(self) -> str:
        return self.document().toRawText().replace("\u2029", "\n")

    def marked(self) -> tuple[int, int, int]:
        at = self.textCursor()
        return at.selectionStart(), at.selectionEnd(), self.document().characterCount() - 1  # a separator ends it

    def mark(self, start: int, end: int) -> None:
        cursor, last = self.textCursor(), self.document().characterCount() - 1
        cursor.setPosition(min(start, last))
        cursor.setPosition(min(end, last), QTextCursor.MoveMode.KeepAnchor)
        self.setTextCursor(cursor)

    def sizeHint(self) -> QSize:
        return QSize(120, 118)

    def show_text(self, text: str) -> None:
        if not self.pending and text != self.words():
            self._showing = True
            self.setPlainText(text)  # Qt makes a paragraph of each separator of lines: the words may be others
            self._showing = False


class TypedSentence(TypedText):
    """A sentence in as many lines as it takes, as far as there is room for them; Enter accepts it."""

    def __init__(self, name: str, *, most_lines: int = MOST_LINES) -> None:
        super().__init__(name)
        self._most_lines = most_lines
        self.setProperty("dense", "true")
        self.document().setDocumentMargin(0)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.textChanged.connect(self._fit)
        self._fit()

    def _fit(self) -> None:
        block, needed = self.document().firstBlock(), 0.0
        while block.isValid():
            needed += self.document().documentLayout().blockBoundingRect(block).height()
            block = block.next()
        most = self._most_lines * self.fontMetrics().lineSpacing()
        scrolls = Qt.ScrollBarPolicy.ScrollBarAsNeeded if needed > most else Qt.ScrollBarPolicy.ScrollBarAlwaysOff
        self.setVerticalScrollBarPolicy(scrolls)
        self.setFixedHeight(max(FIELD_PX, min(most, math.ceil(needed)) + SENTENCE_EDGE_PX))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def sizeHint(self) -> QSize:
        return QSize(120, self.height())

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if event.reason() in {Qt.FocusReason.TabFocusReason, Qt.FocusReason.BacktabFocusReason}:
            self.selectAll()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
            self.accept()
        else:
            super().keyPressEvent(event)

    def insertFromMimeData(self, source: QMimeData) -> None:
        self.insertPlainText(LINE_BREAK.sub(" ", source.text()))

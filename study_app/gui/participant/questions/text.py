"""A text that is typed."""

from __future__ import annotations

import unicodedata
from typing import TYPE_CHECKING, ClassVar, Final

from PySide6.QtCore import Qt
from PySide6.QtGui import QFontMetricsF, QKeyEvent
from PySide6.QtWidgets import QPlainTextEdit, QWidget

from study_app.gui.participant.forms.question_field import target_px
from study_app.gui.participant.forms.typed_field import ENTER, EntryKeys, TypedField
from study_app.gui.theme.theme import font
from study_app.protocol.questions import ItemView, TextView, Value
from study_app.protocol.table import UNPRINTABLE

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

WAIT_MS = 600
FRAME = 20.0  # of a field around its lines


class Entry(EntryKeys, QPlainTextEdit):
    """The field; Tab leaves it, and in a single line Enter is the page's."""

    def __init__(self, lines: int, parent: QWidget) -> None:
        super().__init__(parent)
        self._lines = lines
        self.setTabChangesFocus(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        if lines == 1:
            self.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
            self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def leaves_to_page(self, event: QKeyEvent) -> bool:
        """Return whether a key is the page's: of several lines only Ctrl+Enter."""
        if self._lines == 1:
            return super().leaves_to_page(event)
        return event.key() in ENTER and bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)


class TextField(TypedField):
    """A text of one line or several."""

    widget_id: ClassVar[str] = "text"

    def __init__(self, view: ItemView, words: Words, parent: QWidget) -> None:
        assert isinstance(view, TextView)  # noqa: S101 - the registry names this widget
        self._shown = view
        super().__init__(view, words, parent)
        self.entry = Entry(view.lines, self)
        self.entry.setAccessibleName(view.text)
        self.entry.textChanged.connect(self._edit)
        self.put(self.entry)
        self.type_into(self.entry, WAIT_MS, self.finish)

    def show_answer(self, value: Value) -> None:
        self.kept(value)
        self.entry.blockSignals(True)
        self.entry.setPlainText(str(value))
        self.entry.blockSignals(False)

    def clear(self) -> None:
        """Empty the field."""
        self.entry.blockSignals(True)
        self.entry.clear()
        self.entry.blockSignals(False)
        self._timer.stop()

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        super().set_scale(scale)
        face = font("statement", scale=scale)
        self.entry.setFont(face)
        height = self._shown.lines * QFontMetricsF(face).lineSpacing() + FRAME * scale
        self.entry.setFixedHeight(round(max(target_px(scale), height)))

    def finish(self) -> bool:
        """Take the text; an empty one is no answer."""
        self._timer.stop()
        text = self.entry.toPlainText().strip()
        if text:
            self.give(text)
        else:
            self.take_back()
        return True

    def typed(self) -> str:
        """Return what was typed."""
        return self.entry.toPlainText()

    def _edit(self) -> None:
        """Keep the text within its length, and free of what cannot be printed."""
        text = self.entry.toPlainText()
        kept = "".join(one for one in text if one == "\n" or unicodedata.category(one) not in UNPRINTABLE)
        kept = kept[: self._shown.longest]
        if self._shown.lines == 1:
            kept = kept.replace("\n", " ")
        if kept != text:
            place = min(self.entry.textCursor().position(), len(kept))
            self.entry.blockSignals(True)
            self.entry.setPlainText(kept)
            self.entry.blockSignals(False)
            cursor = self.entry.textCursor()
            cursor.setPosition(place)
            self.entry.setTextCursor(cursor)
        self._timer.start()


FIELD: Final = TextField

"""A question that is answered by typing: what numbers and texts have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QFocusEvent, QKeyEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.forms.question_field import QuestionField, question_of

ENTER = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
VERTICAL = (Qt.Key.Key_Up, Qt.Key.Key_Down)

if TYPE_CHECKING:
    Widget = QWidget
else:
    Widget = object  # Qt permits one class of its own in a class


class EntryKeys(Widget):
    """A widget to type into that leaves Esc to the window and other keys to the page, and shows its question's ring."""

    def leaves_to_page(self, event: QKeyEvent) -> bool:
        """Return whether a key is the page's: it means nothing while one types."""
        return event.key() in (*ENTER, *VERTICAL)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        escape = event.key() == Qt.Key.Key_Escape
        if escape and (question := question_of(self)) is not None:
            question.finish()  # before the page gives way to a pause
        if escape or self.leaves_to_page(event):
            event.ignore()
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if (question := question_of(self)) is not None:
            question.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if (question := question_of(self)) is not None:
            question.finish()
            question.update()


class TypedField(QuestionField):
    """What is typed is taken when typing pauses, and at the latest when the question is left."""

    def type_into(self, entry: QWidget, wait_ms: int, take: Callable[[], object]) -> None:
        """Give the keyboard to ``entry``; call ``take`` this time after the last key."""
        self.setFocusProxy(entry)
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(wait_ms)
        self._timer.timeout.connect(take)

    def typed(self) -> str:
        """Return what was typed."""
        raise NotImplementedError

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in ENTER and self.typed():
            if not event.isAutoRepeat() and self.finish():
                self.left.emit()
        else:
            super().keyPressEvent(event)

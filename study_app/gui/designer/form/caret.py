"""Where the keyboard is in a form: it goes on there in the editors that replace those before."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLineEdit, QPlainTextEdit, QWidget


@dataclass(frozen=True, slots=True)
class Caret:
    """The name of an editor of text, and before which of its letters the next one is typed."""

    editor: str
    at: int

    @classmethod
    def of(cls, editor: QWidget | None) -> Caret | None:
        """Return where the keyboard is; None where no text is edited."""
        if isinstance(editor, QLineEdit):
            return cls(editor.accessibleName(), editor.cursorPosition())
        if isinstance(editor, QPlainTextEdit):
            return cls(editor.accessibleName(), editor.textCursor().position())
        return None

    def put_into(self, row: QWidget) -> None:
        """Give the keyboard to the editor of that name in a row; where there is none, nothing changes."""
        for editor in row.findChildren(QWidget):
            if isinstance(editor, QLineEdit | QPlainTextEdit) and editor.accessibleName() == self.editor:
                editor.setFocus(Qt.FocusReason.OtherFocusReason)
                if isinstance(editor, QLineEdit):
                    editor.setCursorPosition(self.at)
                else:
                    cursor = editor.textCursor()
                    cursor.setPosition(min(self.at, editor.document().characterCount() - 1))
                    editor.setTextCursor(cursor)

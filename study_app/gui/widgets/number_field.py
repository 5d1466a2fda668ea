"""A field for one number: what is typed stays until it is understood, and one line says what is wrong with it."""

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QLineEdit

from study_app.gui.theme.theme import font
from study_app.number_text import MINUS, number_of

NUMERALS = set("0123456789.,+-eE \u00a0\u2009\u202f" + MINUS)


def read_number(text: str) -> float | None:
    """Return the number that a text says, with comma or point, real minus or hyphen; None where it says none."""
    found = number_of(text)
    return None if found is None else float(found)


def write_number(value: float, decimals: int) -> str:
    """Return a number with at most so many decimals, without empty ones, with a real minus."""
    text = f"{value:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    if text.strip("-0.") == "":
        text = "0" if value == 0 else f"{value:.2g}"
    return text.replace("-", MINUS)


class NumberField(QLineEdit):
    """A low field for a number; Return or leaving it takes it, Esc goes back, Up and Down step; Return tries again.

    ``entered(value)`` comes once for what was typed; ``unread(text)`` where it is not a number; ``abandoned()`` at Esc;
    ``stepped(steps)`` at Up and Down. While something is typed, `show_text` does not touch it.
    """

    entered = Signal(float)
    unread = Signal(str)
    abandoned = Signal()
    stepped = Signal(int)

    def __init__(self) -> None:
        super().__init__()
        self._shown = ""
        self._state = ""
        self.setProperty("dense", "true")
        self.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.setFont(font("label", tabular=True))
        self.returnPressed.connect(self._try)

    @property
    def state(self) -> str:
        """What the field's edge says: "", "changed" or "refused"."""
        return self._state

    def show_text(self, text: str) -> None:
        self._shown = text
        if not self.isModified() and text != self.text():
            self.setText(text)
            self.setCursorPosition(0)

    def show_state(self, state: str) -> None:
        """Give the field the edge of ``state``; changed and refused numbers are bold."""
        if state == self._state:
            return
        self._state = state
        self.setProperty("state", state)
        self.setFont(font("label", weight=600 if state else None, tabular=True))
        self.style().unpolish(self)
        self.style().polish(self)

    def put_back(self) -> None:
        self.setText(self._shown)
        self.setModified(False)

    def event(self, event: QEvent) -> bool:
        """Leave to the window the keys that mean nothing in a number, so that its shortcuts work from here."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            undoes = event.matches(QKeySequence.StandardKey.Undo) or event.matches(QKeySequence.StandardKey.Redo)
            plain = event.modifiers() in {Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier}
            if (undoes and not self.isModified()) or (
                plain and event.text().isalpha() and not self._writes(event.text())
            ):
                event.ignore()
                return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Up:
            self.stepped.emit(1)
        elif event.key() == Qt.Key.Key_Down:
            self.stepped.emit(-1)
        elif event.key() == Qt.Key.Key_Escape and (self.text() != self._shown or self._state == "refused"):
            self.put_back()
            self.abandoned.emit()
        elif event.text().isalpha() and not self._writes(event.text()):
            event.ignore()
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if event.reason() in {Qt.FocusReason.TabFocusReason, Qt.FocusReason.BacktabFocusReason}:
            self.selectAll()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.flush()

    @staticmethod
    def _writes(text: str) -> bool:
        return bool(text) and set(text) <= NUMERALS

    def _try(self) -> None:
        """Take what was typed, a refused number once more: what was in its way may be gone."""
        if self._state == "refused":
            self.setModified(True)
        self.flush()

    def flush(self) -> None:
        """Say what was typed, once; it stays where it is not a number."""
        if not self.isModified():
            return
        value = read_number(self.text())
        if value is None:
            self.unread.emit(self.text())
            return
        self.setModified(False)
        self.entered.emit(value)

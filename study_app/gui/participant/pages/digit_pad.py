"""Digits on the screen, for mouse and touch: they type into a field."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QFont
from PySide6.QtWidgets import QGridLayout, QLineEdit, QPushButton, QWidget

DIGITS = ("1", "2", "3", "4", "5", "6", "7", "8", "9", "0")
DELETE = "⌫"


class DigitPad(QWidget):
    """Keys in rows of ``across``, in the same order in every language; ``more`` come after the digits."""

    def __init__(self, field: QLineEdit, more: tuple[str, ...], across: int, delete_name: str, parent: QWidget) -> None:
        super().__init__(parent)
        self._field = field
        self.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self.keys = [QPushButton(text, self) for text in (*DIGITS, *more, DELETE)]
        for place, key in enumerate(self.keys):
            key.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            key.setAccessibleName(delete_name if key.text() == DELETE else key.text())
            key.clicked.connect(lambda _=False, key=key: self._press(key.text()))
            self._grid.addWidget(key, place // across, place % across)

    def set_size(self, width: int, height: int, gap: int, face: QFont) -> None:
        """Give every key its size [px]."""
        self._grid.setSpacing(gap)
        for key in self.keys:
            key.setFont(face)
            key.setStyleSheet(f"padding: 0; min-height: {height - 2}px;")
            key.setFixedSize(width, height)

    def _press(self, text: str) -> None:
        self._field.setFocus(Qt.FocusReason.MouseFocusReason)
        if text == DELETE:
            self._field.backspace()
        else:
            self._field.insert(text)

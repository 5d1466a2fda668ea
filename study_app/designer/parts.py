"""Small parts of the designer: segments, small buttons, elided texts, lists that keys open."""

from collections.abc import Mapping, Sequence
from typing import TypeVar

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QFontMetricsF, QKeyEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.theme import Themed, TypeRole, font, remove_widget
from study_app.gui.widgets import ActionButton, Choice, Elided, Ink, PressedByEnter, hbox, plain_tip

SEGMENTS_MARGIN_PX, SEGMENT_GAP_PX, SEGMENT_PX = 3, 4, 28
_ARROWS = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}


class _Segment(PressedByEnter):
    def __init__(self) -> None:
        super().__init__()
        self.setCheckable(True)
        self.setProperty("role", "segment")
        self.setFont(font("label"))
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Minimum, QSizePolicy.Policy.Fixed)

    def show_label(self, text: str) -> None:
        if text != self.text():
            self.setText(text)
            self.setAccessibleName(text)

    def nextCheckState(self) -> None:
        """Do nothing: `Segments` decides which segment is checked."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in _ARROWS:
            event.ignore()  # else Qt moves the focus; `Segments` also chooses the next segment
        else:
            super().keyPressEvent(event)

    def sizeHint(self) -> QSize:
        return QSize(round(QFontMetricsF(font("label", weight=600)).horizontalAdvance(self.text())) + 18, SEGMENT_PX)


class Segments(Themed, QWidget):
    """A choice of one of few values side by side; ``chosen`` carries it; ``tips`` are tool tips by value."""

    chosen = Signal(object)

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setProperty("role", "segments")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._name = name
        self._values: tuple[object, ...] = ()
        self.tips: Mapping[object, str] = {}
        self.buttons: list[_Segment] = []
        self._row = hbox(spacing=SEGMENT_GAP_PX, margins=SEGMENTS_MARGIN_PX, parent=self)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._add_button()

    def show_values(self, values: Sequence[tuple[object, str]], chosen: object) -> None:
        while len(self.buttons) > max(1, len(values)):
            remove_widget(self.buttons.pop())
        while len(self.buttons) < len(values):
            self._add_button()
        self._values = tuple(value for value, _ in values)
        for button, (value, text) in zip(self.buttons, values, strict=False):
            button.show_label(text)
            button.setChecked(value == chosen)
            button.setToolTip(plain_tip(self.tips.get(value, "")))
            button.update()
        self.setFocusProxy(next((button for button in self.buttons if button.isChecked()), self.buttons[0]))

    def _add_button(self) -> None:
        button, index = _Segment(), len(self.buttons)
        button.setAccessibleName(self._name)  # until it has a label
        button.setAccessibleDescription(self._name)
        button.clicked.connect(lambda: self.chosen.emit(self._values[index]))
        self._row.addWidget(button)
        self.buttons.append(button)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        step = _ARROWS.get(Qt.Key(event.key()), 0)
        index = next((number for number, button in enumerate(self.buttons) if button.hasFocus()), None)
        if step and index is not None and 0 <= index + step < len(self.buttons):
            self.buttons[index + step].setFocus(Qt.FocusReason.TabFocusReason)
            self.chosen.emit(self._values[index + step])
        else:
            super().keyPressEvent(event)


FIELD_PX, LABEL_PX = 34, 116
"""Height of a field and width of its label in the form [px]."""
_W = TypeVar("_W", bound=QWidget)


def make_dense(part: _W, name: str, height: int = FIELD_PX) -> _W:
    """Give a field or list the designer's small height and an accessible name; return it."""
    part.setAccessibleName(name)
    part.setProperty("dense", "true")
    part.setFont(font("label", weight=400))
    part.setFixedHeight(height)
    return part


def small_button(icon: str, label: str, *, cap: str = "", role: str = "", height: int = 34) -> ActionButton:
    """Return a button with a small margin around its text."""
    button = ActionButton(icon, label, cap=cap, role=role, height=height)
    button.setProperty("dense", "true")
    button.setFont(font("label"))
    return button


def cut_text(text: str, role: TypeRole = "small", ink: Ink = "text2", *, right: bool = False) -> Elided:
    """Return a line of text that is elided if it is too long, aligned left or right."""
    line = Elided(role, ink)
    line.show_text(text)
    if right:
        line.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
    return line


_OPENING_KEYS = {
    Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown, Qt.Key.Key_Home, Qt.Key.Key_End,
    Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space, Qt.Key.Key_F4,
}  # fmt: skip


class KeysOpenList(Choice):
    """A list that arrow keys and letters open without changing the choice; Enter or a click selects an entry."""

    def showPopup(self) -> None:
        super().showPopup()
        if self.currentIndex() < 0:
            self.view().setCurrentIndex(self.model().index(0, self.modelColumn()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        shift_or_pad = Qt.KeyboardModifier.KeypadModifier | Qt.KeyboardModifier.ShiftModifier
        letter = event.text().strip() if event.text().isprintable() else ""
        if (event.key() in _OPENING_KEYS or letter) and not event.modifiers() & ~shift_or_pad:
            self.showPopup()
            if letter:
                self.view().keyboardSearch(letter)
        else:
            event.ignore()

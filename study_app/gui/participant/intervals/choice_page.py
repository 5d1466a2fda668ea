"""Two to four large buttons: one press answers and continues."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QLabel, QPushButton, QWidget

from study_app.gui.participant.intervals.answer_page import AnswerPage, sized
from study_app.gui.participant.pages.key_caps import KeyCap
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox
from study_app.session.pages import ChoicePage

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

BUTTON_PX = (160, 96)
GAP_PX = 24
TEXT_PX = 22
ARROWS = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}


class ChoiceWidget(AnswerPage):
    """The answers in temporal order; digits choose by number, the arrows by position on the screen.

    Nothing is preselected. Of two answers ← is the left one and → the right; of more the arrows go to a button, which
    Enter presses.
    """

    def __init__(
        self,
        page: ChoicePage,
        words: Words,
        clock: Callable[[], float],
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
    ) -> None:
        super().__init__(page, words, clock, parent, text_scale=text_scale)
        self.buttons: list[QPushButton] = []
        self._values = [value for value, _ in page.item.options]
        for value, text in page.item.options:
            button = QPushButton(text, self)
            button.setAccessibleName(text)
            button.setAccessibleDescription(page.item.text)
            button.setAutoDefault(False)
            button.pressed.connect(lambda value=value: self.answer(value))
            button.installEventFilter(self)
            self.buttons.append(button)
        self._cap, self._hint = KeyCap(self), QLabel(words.key_answer, self)
        self._hint.setStyleSheet(f"color: {PARTICIPANT.text2}; background: transparent;")
        row = hbox(STRETCH, *self.buttons, STRETCH, spacing=GAP_PX)
        add_parts(self._column, row, 28, hbox(STRETCH, self._cap, self._hint, STRETCH), (STRETCH, 3))

    def lay_out(self, scale: float) -> None:
        """Make the buttons as large as they must be at least."""
        super().lay_out(scale)
        for button in self.buttons:
            button.setMinimumSize(*(round(side * scale) for side in BUTTON_PX))
            button.setFont(sized(TEXT_PX * self.words_scale))
        self._cap.show_key(self.page.item.keys, self.words_scale)
        self._hint.setFont(font("body", scale=self.words_scale))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress and self._take(event):
            return True
        return super().eventFilter(watched, event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if not self._take(event):
            super().keyPressEvent(event)

    def _take(self, event: QKeyEvent) -> bool:
        """Take a key of the page; a key that is held is pressed once."""
        number = event.key() - Qt.Key.Key_1
        away = ARROWS.get(Qt.Key(event.key()))
        if event.isAutoRepeat():
            return True
        if 0 <= number < len(self.buttons):
            self.answer(self._values[number])
        elif away is not None:
            self._go(-away if self.mirrored else away)
        elif event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
            focused = [one for one in self.buttons if one.hasFocus()]
            if focused:
                focused[0].pressed.emit()
        else:
            return False
        return True

    def _go(self, step: int) -> None:
        """Choose the first or the last of two answers; of more go to the next button."""
        if len(self.buttons) == 2:
            self.answer(self._values[0 if step < 0 else 1])
            return
        at = next((place for place, one in enumerate(self.buttons) if one.hasFocus()), -1 if step > 0 else 0)
        self.buttons[(at + step) % len(self.buttons)].setFocus()

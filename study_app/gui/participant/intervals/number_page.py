"""A number above 0: one large field, digits on the screen for fingers, and Enter."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QLabel, QLineEdit, QWidget

from study_app.gui.participant.intervals.answer_page import AnswerPage, sized
from study_app.gui.participant.pages.digit_pad import DigitPad
from study_app.gui.participant.pages.key_caps import GoButton
from study_app.gui.participant.pages.screen_reader import say
from study_app.gui.theme.theme import PARTICIPANT
from study_app.gui.widgets.boxes import STRETCH, add_parts
from study_app.gui.widgets.number_field import read_number
from study_app.protocol.questions import plain_number
from study_app.session.pages import NumberPage

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

FIELD_PX = (400, 96)
KEY_PX = (60, 52)
KEY_GAP_PX = 8
ACROSS = 6
TEXT_PX = 40
LONGEST = 12
CENTRED = Qt.AlignmentFlag.AlignHCenter


class NumberWidget(AnswerPage):
    """A field for a number, with point or comma; anything but a number above 0 is reported and not accepted."""

    def __init__(
        self,
        page: NumberPage,
        words: Words,
        clock: Callable[[], float],
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
    ) -> None:
        super().__init__(page, words, clock, parent, text_scale=text_scale)
        self._permits = page.item.permits
        self.field = QLineEdit(self)
        self.field.setMaxLength(LONGEST)
        self.field.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.field.setAccessibleName(page.item.text)
        self.field.setAccessibleDescription(words.number_wanted)
        self.wrong = QLabel("", self)
        self.wrong.setStyleSheet(f"color: {PARTICIPANT.warn}; background: transparent;")
        self.field.textChanged.connect(lambda _text: self.wrong.clear())
        self._pad = DigitPad(self.field, (".",), ACROSS, words.delete_digit, self)
        self.keys = self._pad.keys
        self.button = GoButton(words.continue_, words.enter_key, self)
        self.button.clicked.connect(self._confirm)
        above = ((widget, 0, CENTRED) for widget in (self.field, self.wrong, self._pad))
        add_parts(self._column, *above, 24, (self.button, 0, CENTRED), (STRETCH, 3))

    def lay_out(self, scale: float) -> None:
        """Make field and keys as large as they must be at least."""
        super().lay_out(scale)
        words = self.words_scale
        self.field.setFixedSize(*(round(side * scale) for side in FIELD_PX))
        self.field.setFont(sized(TEXT_PX * scale))
        self.wrong.setFont(sized(18 * words))
        self.button.set_scale(words)
        width, height = (round(side * scale) for side in KEY_PX)
        self._pad.set_size(width, height, round(KEY_GAP_PX * scale), sized(20 * scale))

    def focus_first(self) -> None:
        """Put the keyboard into the field."""
        self.field.setFocus()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if not event.isAutoRepeat():
                self._confirm()
        else:
            super().keyPressEvent(event)

    def _confirm(self) -> None:
        """Answer with the number in the field, or report what is wrong with it."""
        number = read_number(self.field.text())
        if number is not None and self._permits(number):
            self.answer(plain_number(number))
            return
        self.wrong.setText(self._words.number_wanted)
        say(self.field, self._words.number_wanted)
        self.field.setFocus()
        self.field.selectAll()

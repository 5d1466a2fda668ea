"""A number: a field, and digits on the screen for mouse and touch."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final

from PySide6.QtWidgets import QLabel, QLineEdit, QPushButton, QWidget

from study_app.gui.participant.forms.question_field import target_px
from study_app.gui.participant.forms.typed_field import EntryKeys, TypedField
from study_app.gui.participant.pages.digit_pad import DigitPad
from study_app.gui.participant.pages.screen_reader import say
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.number_field import read_number, write_number
from study_app.protocol.questions import ItemView, NumberView, Value, plain_number

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

ACROSS = 6
WAIT_MS = 400
FIELD_WIDTH = 120.0


class Entry(EntryKeys, QLineEdit):
    """The field."""


class NumberField(TypedField):
    """Point or comma; an entry that is not a permitted number is reported and not taken."""

    widget_id: ClassVar[str] = "number"

    def __init__(self, view: ItemView, words: Words, parent: QWidget) -> None:
        assert isinstance(view, NumberView)  # noqa: S101 - the registry names this widget
        self._number = view
        super().__init__(view, words, parent)
        self.entry = Entry(self)
        self.entry.setAccessibleName(" ".join(filter(None, (view.text, view.unit))))
        self.entry.setMaxLength(20)
        self.entry.textChanged.connect(self._edit)
        self._unit = QLabel(view.unit)
        self._unit.setStyleSheet(f"color: {PARTICIPANT.text2}; background: transparent;")
        more = (*(() if view.whole else (".",)), *self._signs())
        self._pad = DigitPad(self.entry, more, ACROSS, words.delete_digit, self)
        self._wrong = QLabel()
        self._wrong.setWordWrap(True)
        self._wrong.setStyleSheet(f"color: {PARTICIPANT.warn}; background: transparent;")
        self._wrong.hide()
        self._row = hbox(self.entry, self._unit, (STRETCH, 1), self._pad)
        area = QWidget(self)
        vbox(self._row, self._wrong, margins=0, parent=area)
        self.put(area)
        self.type_into(self.entry, WAIT_MS, self._take)

    @property
    def keys(self) -> list[QPushButton]:
        """The keys on the screen."""
        return self._pad.keys

    @property
    def problem(self) -> str:
        """What is wrong with the entry; "" where nothing is."""
        return self._wrong.text()

    def show_answer(self, value: Value) -> None:
        self.kept(value)
        if isinstance(value, int | float):
            self._write(write_number(value, 9))

    def clear(self) -> None:
        """Empty the field."""
        self._timer.stop()
        self._write("")
        self._say("")

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        super().set_scale(scale)
        side = round(target_px(scale))
        self.entry.setFont(font("cell", scale=scale, tabular=True))
        self.entry.setFixedSize(round(FIELD_WIDTH * scale), side)
        self._unit.setFont(font("body", scale=scale))
        self._wrong.setFont(font("label", scale=scale, weight=600))
        self._row.setSpacing(round(10 * scale))
        self._pad.set_size(side, side, round(6 * scale), font("cell", scale=scale))

    def height_in(self, width: int, room: int) -> int:
        """Return the height [px] that the question needs where its entry is reported as wrong, too."""
        problem = self._wrong.text()
        self._wrong.setText(problem or self._expected())
        self._wrong.show()
        height = super().height_in(width, room)
        self._wrong.setText(problem)
        self._wrong.setVisible(bool(problem))
        return height

    def typed(self) -> str:
        """Return what was typed."""
        return self.entry.text()

    def finish(self) -> bool:
        """Take the entry; say what is wrong with it."""
        self._timer.stop()
        text = self.entry.text().strip()
        if not text:
            self._say("")
            self.take_back()
            return True
        number = read_number(text)
        if number is None or not self._number.permits(number):
            self._say(self._expected())
            self.take_back()
            return False
        self._say("")
        self.give(plain_number(number))
        return True

    def _signs(self) -> tuple[str, ...]:
        below = self._number.least is None or self._number.least < 0
        return ("-",) if below else ()

    def _write(self, text: str) -> None:
        self.entry.blockSignals(True)
        self.entry.setText(text)
        self.entry.blockSignals(False)

    def _edit(self) -> None:
        self._say("")
        self._timer.start()

    def _take(self) -> None:
        """Take what was typed so far if it is a number; while one types, nothing is reported."""
        number = read_number(self.entry.text())
        if number is not None and self._number.permits(number):
            self.give(plain_number(number))
        else:
            self.take_back()

    def _expected(self) -> str:
        """Return which number is permitted."""
        words, view = self._words, self._number
        kind = words.whole_number if view.whole else words.any_number
        least, most = (None if one is None else write_number(one, 9) for one in (view.least, view.most))
        if least is not None and most is not None:
            return words.number_between.format(kind=kind, least=least, most=most)
        if least is not None:
            return words.number_from.format(kind=kind, least=least)
        if most is not None:
            return words.number_to.format(kind=kind, most=most)
        return words.number_needed.format(kind=kind)

    def _say(self, problem: str) -> None:
        self._wrong.setText(problem)
        self._wrong.setVisible(bool(problem))
        self.entry.setProperty("state", "refused" if problem else "")
        self.entry.style().unpolish(self.entry)
        self.entry.style().polish(self.entry)
        self.entry.setAccessibleDescription(problem)
        if problem:
            say(self.entry, problem)


FIELD: Final = NumberField

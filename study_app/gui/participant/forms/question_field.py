"""What the widgets of all kinds of questions have in common: the words at one side, the answer at the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QAccessible, QColor, QFocusEvent, QFont, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QGridLayout, QWidget

from study_app.gui.participant.forms.question_words import QuestionWords
from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.participant.pages.screen_reader import say
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.accessible import give_role
from study_app.protocol.questions import ItemView, Value

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

LEAST_TARGET = 44.0  # of what is hit with mouse or finger [logical px]


def target_px(scale: float) -> float:
    """Return how high and wide at least what is hit is, however small words become [logical px]."""
    return LEAST_TARGET * max(1.0, scale)


WORDS_SHARE, ANSWER_SHARE = 5, 6
MARGIN = 16.0
NUMBER_WIDTH = 32.0
NOTE_GAP = 5.0


class QuestionField(QWidget):
    """A question and its answer: one stop of the Tab key, and for a screen reader a group with its answers.

    ``answered(value)`` comes when an answer is given or changed, ``retracted`` where an entry was emptied, ``left``
    when a key answered it so that the next question can have the keyboard; ``seen`` comes with the first painting.
    """

    ANSWER: ClassVar[int] = 2
    """The column of the answer in ``grid``."""
    widget_id: ClassVar[str] = ""
    last = False
    """Whether no line is drawn under it."""

    answered = Signal(object)
    retracted = Signal()
    left = Signal()
    seen = Signal()

    def __init__(self, view: ItemView, words: Words, parent: QWidget) -> None:
        super().__init__(parent)
        self.view = view
        self.value: Value = None
        self.is_answered = False
        self.missing = False
        self._words = words
        self._seen = False
        self._answer: QWidget | None = None
        self.scale = 1.0
        give_role(self, QAccessible.Role.Grouping)
        self.statement = QuestionWords(view.number, view.text, self)
        self.grid = QGridLayout(self)
        self.grid.setHorizontalSpacing(0)
        self.grid.addWidget(self.statement, 0, 0)
        self.grid.setColumnStretch(0, WORDS_SHARE)
        self.grid.setColumnStretch(self.ANSWER, ANSWER_SHARE)
        self.setAccessibleName(f"{view.number}. {view.text}")
        self._tell()

    @property
    def note(self) -> str:
        """The small line under the words."""
        if self.missing:
            return self._words.please_answer
        return "" if self.view.required else self._words.optional

    @property
    def answer_keys(self) -> str:
        """The keys that answer it, as they stand on their caps."""
        return self.view.keys

    def put(self, answer: QWidget) -> None:
        """Put the part with which the question is answered after its words."""
        self._answer = answer
        self.grid.addWidget(answer, 0, self.ANSWER, Qt.AlignmentFlag.AlignVCenter)

    def show_answer(self, value: Value) -> None:
        raise NotImplementedError

    def spoken(self) -> str:
        """Return the answer as a screen reader says it."""
        return str(self.value)

    def finish(self) -> bool:
        """Take what is being typed; return False where that is not an answer."""
        return True

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        self.scale = scale
        self.set_fonts(font("statement", scale=scale), font("label", scale=scale, weight=600), scale)
        margin, gap = self.horizontal_margin, round(8 * scale)
        self.grid.setContentsMargins(margin, gap, margin, gap)
        self.set_words_columns(NUMBER_WIDTH * scale, 24 * scale)

    @property
    def horizontal_margin(self) -> int:
        """From the row's edges to what is in it [px]."""
        return round(MARGIN * self.scale)

    def set_fonts(self, statement: QFont, note: QFont, scale: float) -> None:
        """Write statement and note in these fonts, and the number as large as in all rows of a page."""
        number = font("cell", scale=scale * 0.9, weight=700 if self.missing else 400)
        self.statement.set_fonts(statement, note, number, NOTE_GAP * scale)

    def set_words_columns(self, number: float, after: float) -> None:
        """Give the number its width, and keep so much room after the words [px]."""
        self.statement.set_number_width(round(number))
        self.grid.setColumnMinimumWidth(1, round(after))

    def height_in(self, width: int, room: int) -> int:
        """Return the height [px] that words, note and answer need in a width; there is ``room`` for so much."""
        self.statement.show_note(self.note or self._words.please_answer, missing=True)  # once Continue is pressed
        if self._answer is not None:
            self._answer.updateGeometry()  # the layout keeps what it asked for before
        self.grid.invalidate()
        height = self.grid.totalHeightForWidth(width)
        self._tell()
        return height

    def point(self, place: int) -> None:
        """Point at an answer, at none with -1; what is typed cannot be pointed at."""

    def ask(self, *, missing: bool) -> None:
        """Mark the question as still to be answered."""
        self.missing = missing and not self.is_answered
        self._tell()

    def give(self, value: Value) -> None:
        """Take an answer, and say it where it is another one."""
        changed = not self.is_answered or value != self.value
        self.value, self.is_answered, self.missing = value, True, False
        self._tell()
        if changed:
            say(self, self.accessibleDescription())
            self.answered.emit(value)

    def take_back(self) -> None:
        """Have no answer again."""
        if self.is_answered:
            self.value, self.is_answered = None, False
            self._tell()
            self.retracted.emit()

    def forget(self) -> None:
        """Have no answer again, without saying so: another answer hid the question."""
        self.value, self.is_answered, self.missing = None, False, False
        self.clear()
        self._tell()

    def clear(self) -> None:
        """Show no answer."""
        raise NotImplementedError

    def kept(self, value: Value) -> None:
        """Have an answer without saying so."""
        self.value, self.is_answered, self.missing = value, True, False
        self._tell()

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        self._paint_ground(painter)
        painter.end()
        if not self._seen and self.window().isVisible():
            self._seen = True
            self.seen.emit()

    def _holds_keyboard(self) -> bool:
        focused = self.window().focusWidget()
        return focused is not None and (focused is self or self.isAncestorOf(focused))

    def _paint_ground(self, painter: QPainter) -> None:
        theme, scale = PARTICIPANT, self.scale
        ring = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        focus = self._holds_keyboard()
        if focus or self.missing:
            painter.setPen(QPen(QColor(theme.accent), 2) if focus else Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.selected))
            painter.drawRoundedRect(ring, 10 * scale, 10 * scale)
        elif not self.last:
            painter.setPen(QPen(QColor(theme.grid), 1))
            y = self.height() - 0.5
            painter.drawLine(round(MARGIN * scale), round(y), round(self.width() - MARGIN * scale), round(y))
        if self.missing:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.warn))
            flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
            left = self.width() - 8 * scale if flip else 4 * scale
            bar = QRectF(left, self.height() * 0.19, 4 * scale, self.height() * 0.62)
            painter.drawRoundedRect(bar, 2 * scale, 2 * scale)

    def _tell(self) -> None:
        words = self._words
        self.statement.show_note(self.note, missing=self.missing)
        if self.is_answered:
            state = f"{words.chosen}: {self.spoken()}"
        else:
            state = (self.note or words.please_answer) if self.missing else words.no_answer_yet
        if self.note and not self.missing:
            state = f"{self.note}, {state}"
        self.setAccessibleDescription(state)
        self.update()


def question_of(part: QWidget) -> QuestionField | None:
    """Return the question that a widget is part of."""
    above: QWidget | None = part
    while above is not None and not isinstance(above, QuestionField):
        above = above.parentWidget()
    return above

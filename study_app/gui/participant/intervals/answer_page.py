"""Pages with a single question, the feedback page, and the controls of an adjustment."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QEvent, QObject, QRectF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QKeyEvent, QPainter, QPen, QShowEvent, QWheelEvent
from PySide6.QtWidgets import QLineEdit, QPushButton, QWidget

from study_app.gui.key_presses import digit_of
from study_app.gui.participant.pages.page_widget import (
    DigitPad,
    GoButton,
    KeyCap,
    PageContext,
    PageWidget,
    ProgressLine,
)
from study_app.gui.participant.pages.text_page import Badge
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.accessible import HeadingLabel, PlainLabel, announce, button_text
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.numbers import read_number
from study_app.protocol.questions import Value, plain_number
from study_app.protocol.wording import Words
from study_app.session.pages import ChoicePage, DesignPage, FeedbackPage, Interval, NumberPage, TaskPage
from study_app.session.transitions.events import STEP_S, Chosen, ItemShown, Stepped, Submitted

_QUESTION_PX = 26
_ASKING = 0.8  # filled fraction of the current trial's bar


class _AnswerPage(PageWidget):
    """A page with the progress, a question and space for its answer, which can be given only once."""

    def __init__(self, page: DesignPage, context: PageContext) -> None:
        super().__init__(context)
        self.page = page
        self._answered = False
        self._progress = ProgressLine(page.progress, context.words, _ASKING, self)
        self.question = PlainLabel(page.item.text, self, wraps=True, alignment=Qt.AlignmentFlag.AlignCenter)
        self.setAccessibleName(page.item.text)
        self._column = vbox(self._progress, (STRETCH, 2), self.question, 36, parent=self)

    def lay_out(self, scale: float) -> None:
        margin = round((40 if self.width() >= 1100 else 24) * scale)
        self._column.setContentsMargins(margin, round(20 * scale), margin, margin)
        self._progress.set_scale(self.font_scale)
        self.question.setFont(_body_font(_QUESTION_PX * self.font_scale))

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.event_made.emit(ItemShown(self._clock(), self.page.item.id))

    def answer(self, value: Value) -> None:
        """Answer and continue; later answers are ignored."""
        if self._answered:
            return
        self._answered = True
        self.event_made.emit(Chosen(self._clock(), self.page.item.id, value))
        self.event_made.emit(Submitted(self._clock()))


def _body_font(pixels: float) -> QFont:
    """Return the body font with a size in logical px."""
    body_font = font("body")
    body_font.setPixelSize(round(pixels))
    return body_font


_CHOICE_BUTTON_PX = (160, 96)
_CHOICE_GAP_PX = 24
_CHOICE_TEXT_PX = 22
_ARROWS = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}


class ChoiceWidget(_AnswerPage):
    """A page with a button for each answer, in temporal order; digits choose by number, arrows by position.

    No answer is preselected. With two answers, ← chooses the left one and → the right one; with more, the arrows focus
    a button, which Enter presses.
    """

    def __init__(self, page: ChoicePage, context: PageContext) -> None:
        super().__init__(page, context)
        self.buttons: list[QPushButton] = []
        self._values = [value for value, _ in page.item.options]
        for value, text in page.item.options:
            button = QPushButton(button_text(text), self, autoDefault=False)
            button.setAccessibleName(text)
            button.setAccessibleDescription(page.item.text)
            button.pressed.connect(lambda value=value: self.answer(value))
            button.installEventFilter(self)
            self.buttons.append(button)
        self._cap, self._hint = KeyCap(self), PlainLabel(self._words.key_answer, self)
        self._hint.setStyleSheet(f"color: {PARTICIPANT.text2}; background: transparent;")
        row = hbox(STRETCH, *self.buttons, STRETCH, spacing=_CHOICE_GAP_PX)
        add_parts(self._column, row, 28, hbox(STRETCH, self._cap, self._hint, STRETCH), (STRETCH, 3))

    def lay_out(self, scale: float) -> None:
        super().lay_out(scale)
        for button in self.buttons:
            button.setMinimumSize(*(round(side * scale) for side in _CHOICE_BUTTON_PX))
            button.setFont(_body_font(_CHOICE_TEXT_PX * self.font_scale))
        self._cap.show_key(self.page.item.keys, self.font_scale)
        self._hint.setFont(font("body", scale=self.font_scale))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress and self._handle_key(event):
            return True
        return super().eventFilter(watched, event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if not self._handle_key(event):
            super().keyPressEvent(event)

    def _handle_key(self, event: QKeyEvent) -> bool:
        """Handle a key of the page; a repeated arrow does nothing."""
        number = digit_of(event)
        direction = _ARROWS.get(Qt.Key(event.key()))
        if event.isAutoRepeat():
            return True
        if number is not None and 1 <= number <= len(self.buttons):
            self.answer(self._values[number - 1])
        elif direction is not None:
            self._move_choice(-direction if self.mirrored else direction)
        elif event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
            focused = [button for button in self.buttons if button.hasFocus()]
            if focused:
                focused[0].pressed.emit()
        else:
            return False
        return True

    def _move_choice(self, step: int) -> None:
        """Choose the first or last of two answers; if there are more, focus the next button."""
        if len(self.buttons) == 2:
            self.answer(self._values[0 if step < 0 else 1])
            return
        focused = next((i for i, button in enumerate(self.buttons) if button.hasFocus()), -1 if step > 0 else 0)
        self.buttons[(focused + step) % len(self.buttons)].setFocus()


_BADGE_SCALE = 1.6
_CENTRED = Qt.AlignmentFlag.AlignHCenter


class FeedbackWidget(PageWidget):
    """A page with a check mark and "Right", or a dash and "Not right"."""

    def __init__(self, page: FeedbackPage, context: PageContext) -> None:
        super().__init__(context)
        self._text = self._words.right if page.right else self._words.not_right
        self.setAccessibleName(self._text)
        sign, colour = ("check", PARTICIPANT.ok) if page.right else ("minus", PARTICIPANT.text2)
        self._badge, self._word = Badge(sign, colour, self), HeadingLabel(self._text)
        self._word.setStyleSheet(f"color: {PARTICIPANT.text}; background: transparent;")
        badge, word = (self._badge, 0, _CENTRED), (self._word, 0, _CENTRED)
        self._column = vbox((STRETCH, 2), badge, word, (STRETCH, 3), parent=self)

    def lay_out(self, _scale: float) -> None:
        self._badge.set_scale(_BADGE_SCALE * self.font_scale)
        self._word.setFont(font("display", scale=self.font_scale))
        self._column.setSpacing(round(14 * self.font_scale))

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        announce(self, self._text)


_SQUARE = 16.0
_GAP = 10.0


def interval_width(interval: Interval, wording: Words, scale: float) -> float:
    """Return the width of the interval's text and squares [px]."""
    return _text_width(interval, wording, scale) + _GAP * scale + interval.of * (_SQUARE + _GAP) * scale


def _text_width(interval: Interval, wording: Words, scale: float) -> float:
    text = wording.reached.format(reached=interval.number, of=interval.of)
    return QFontMetricsF(font("statement", scale=scale, weight=600)).horizontalAdvance(text) + 4


def draw_interval(
    painter: QPainter, width: float, middle: float, interval: Interval, wording: Words, scale: float
) -> None:
    """Draw the number of an interval as text and squares, centred in a page of ``width`` at the height ``middle`` [px].

    In a rest, no square is filled. In a right-to-left language, the first square is at the right.
    """
    text = wording.reached.format(reached=interval.number, of=interval.of)
    side, gap = _SQUARE * scale, _GAP * scale
    painter.save()
    painter.setFont(font("statement", scale=scale, weight=600))
    text_width = _text_width(interval, wording, scale)
    x = (width - interval_width(interval, wording, scale)) / 2
    painter.setPen(QColor(PARTICIPANT.text))
    text_area = QRectF(x, middle - 20 * scale, text_width, 40 * scale)
    if wording.right_to_left:
        text_area.moveRight(width - x)
    painter.drawText(text_area, int(Qt.AlignmentFlag.AlignCenter), text)
    painter.setPen(QPen(QColor(PARTICIPANT.text), 2 * scale))
    for number in range(1, interval.of + 1):
        place = QRectF(x + text_width + gap + (number - 1) * (side + gap), middle - side / 2, side, side)
        if wording.right_to_left:
            place.moveRight(width - place.left())
        filled = number == interval.number and not interval.resting
        painter.setBrush(QColor(PARTICIPANT.text) if filled else Qt.BrushStyle.NoBrush)
        painter.drawRect(place)
    painter.restore()


_FIELD_PX = (400, 96)
_KEY_PX = (60, 52)
_KEY_GAP_PX = 8
_KEYS_PER_ROW = 6
_NUMBER_TEXT_PX = 40
_LONGEST = 12


class NumberWidget(_AnswerPage):
    """A page with a field for a number, with point or comma; a text that is not one permitted number is rejected."""

    def __init__(self, page: NumberPage, context: PageContext) -> None:
        super().__init__(page, context)
        self._permits = page.item.permits
        self.field = QLineEdit(self, maxLength=_LONGEST, alignment=Qt.AlignmentFlag.AlignCenter)
        self.field.setContextMenuPolicy(Qt.ContextMenuPolicy.NoContextMenu)  # Qt's menu is in English
        self.field.setAccessibleName(page.item.text)
        self.field.setAccessibleDescription(self._words.number_wanted)
        self.wrong = PlainLabel("", self)
        self.wrong.setStyleSheet(f"color: {PARTICIPANT.warn}; background: transparent;")
        self.field.textChanged.connect(lambda _text: self.wrong.clear())
        self._pad = DigitPad(self.field, (self._words.decimal_sign,), _KEYS_PER_ROW, self._words.delete_digit, self)
        self.keys = self._pad.keys
        self.button = GoButton(self._words.continue_, self._words.enter_key, self)
        self.button.clicked.connect(self._confirm)
        centred = ((widget, 0, _CENTRED) for widget in (self.field, self.wrong, self._pad))
        add_parts(self._column, *centred, 24, (self.button, 0, _CENTRED), (STRETCH, 3))

    def lay_out(self, scale: float) -> None:
        super().lay_out(scale)
        font_scale = self.font_scale
        self.field.setFixedSize(*(round(side * scale) for side in _FIELD_PX))
        self.field.setFont(_body_font(_NUMBER_TEXT_PX * scale))
        self.wrong.setFont(_body_font(18 * font_scale))
        self.button.set_scale(font_scale)
        width, height = (round(side * scale) for side in _KEY_PX)
        self._pad.set_size(width, height, round(_KEY_GAP_PX * scale), _body_font(20 * scale))

    def focus_first(self) -> None:
        self.field.setFocus()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._confirm()
        else:
            super().keyPressEvent(event)

    def _confirm(self) -> None:
        """Answer with the number in the field, or show its problem."""
        text = self.field.text()
        number = read_number(text, self._words.decimal_sign)
        if number is not None and self._permits(number):
            self.answer(plain_number(number))
            return
        problem = self._words.unclear_number(text) or self._words.number_wanted
        self.wrong.setText(problem)
        announce(self.field, problem)
        self.field.setFocus()
        self.field.selectAll()


_STEP_MS: Final = round(1000 * STEP_S)
_NOTCH: Final = 120  # turn of a wheel per notch [eighths of a degree]
_BUTTON_PX: Final = (120, 48)
_GAP_PX: Final = 16
_LEAST_PX: Final = 44
_TEXT_PX: Final = 18
_KEYS: Final = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}


class SettingControls(QWidget):
    """Controls with which the participant adjusts and confirms the level; shown only while it can be adjusted.

    The left key and button mean less in every language. A held key or button makes a step every `_STEP_MS`.
    ``event_made`` carries the session's events. Without ``buttons``, if no pointer is shown, only keys and the wheel
    work.
    """

    event_made = Signal(object)

    def __init__(
        self, page: TaskPage, wording: Words, clock: Callable[[], float], parent: QWidget, *, buttons: bool
    ) -> None:
        super().__init__(parent)
        self._room = parent
        self._clock = clock
        self._adjusts = page.adjusts
        self._buttons = buttons
        self._held = 0
        self._turned = 0
        self._timer = QTimer(self, interval=_STEP_MS)
        self._timer.timeout.connect(lambda: self._emit_steps(self._held))
        self.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.less, self.more = (QPushButton(text, self) for text in (f"← {wording.less}", f"{wording.more} →"))
        self.done = GoButton(wording.done, wording.enter_key, self)
        hbox(self.less, self.more, self.done, spacing=_GAP_PX, margins=0, parent=self)
        for button, name, direction in ((self.less, wording.less, -1), (self.more, wording.more, 1)):
            button.setAccessibleName(name)
            button.setAccessibleDescription(page.question)
            button.setAutoRepeat(True)
            button.setAutoRepeatDelay(_STEP_MS)
            button.setAutoRepeatInterval(_STEP_MS)
            button.clicked.connect(lambda _=False, direction=direction: self._emit_steps(direction))
        self.done.clicked.connect(self._confirm)
        for control in (self.less, self.more, self.done):
            control.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setVisible(self._adjusts and buttons)

    def show_interval(self, page: TaskPage) -> None:
        """Show the controls if the level of the interval can be adjusted."""
        self._adjusts = page.adjusts
        self.stop_stepping()
        self.setVisible(self._adjusts and self._buttons)

    def lay_out_controls(self, scale: float, middle: float) -> None:
        """Place the controls at the tank's foot, above the pause hint if both do not fit side by side."""
        width, height = (round(side * scale) for side in _BUTTON_PX)
        for button in (self.less, self.more):
            button.setFont(_body_font(_TEXT_PX * scale))
            button.setStyleSheet("padding: 0 12px; min-height: 0;")
            button.setFixedHeight(max(height, _LEAST_PX))
            button.setMinimumWidth(width)
        self.done.set_scale(scale)
        self.adjustSize()
        x, y = (self._room.width() - self.width()) / 2, middle - self.height() / 2
        self.move(round(x), round(min(y, self._room.height() - self.height() - 4)))
        self.raise_()

    def press_key(self, event: QKeyEvent) -> bool:
        """Handle a key press; return whether the key belongs to these controls."""
        direction = _KEYS.get(Qt.Key(event.key()), 0)
        if not self._adjusts or (not direction and event.key() not in (Qt.Key.Key_Return, Qt.Key.Key_Enter)):
            return False
        if not event.isAutoRepeat():
            if direction:
                self._held = direction
                self._emit_steps(direction)
                self._timer.start()
            else:
                self._confirm()
        return True

    def release_key(self, event: QKeyEvent) -> None:
        if _KEYS.get(Qt.Key(event.key()), 0) == self._held:
            self.stop_stepping()

    def turn_wheel(self, event: QWheelEvent) -> None:
        """Make a step for each notch of the wheel; forwards increases the level."""
        self._turned += event.angleDelta().y()
        steps = int(self._turned / _NOTCH)
        self._turned -= steps * _NOTCH
        self._emit_steps(steps)

    def stop_stepping(self) -> None:
        """Stop stepping, also for a deactivated window, which never receives the release of the key."""
        self._held = self._turned = 0
        self._timer.stop()

    def _emit_steps(self, steps: int) -> None:
        if self._adjusts and steps:
            self.event_made.emit(Stepped(self._clock(), steps))

    def _confirm(self) -> None:
        self.stop_stepping()
        if self._adjusts:
            self.event_made.emit(Submitted(self._clock()))

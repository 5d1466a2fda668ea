"""The question fields of a form, one class for each kind of question."""

from __future__ import annotations

import unicodedata
from typing import ClassVar, Final

from PySide6.QtCore import QPointF, QRectF, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QFontMetricsF, QKeyEvent, QMouseEvent, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import QLineEdit, QPlainTextEdit, QPushButton, QSizePolicy, QSlider, QWidget

from study_app.gui.participant.forms.question_field import (
    ENTER,
    CheckOption,
    EntryKeys,
    OptionsField,
    QuestionField,
    RadioOption,
    ScaleField,
    TypedField,
    question_of,
    target_px,
)
from study_app.gui.participant.pages.page_widget import DigitPad, page_painter, point_screen_reader_at
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.accessible import PlainLabel, announce
from study_app.gui.widgets.boxes import STRETCH, grid, hbox, vbox
from study_app.gui.widgets.labels import set_property
from study_app.gui.widgets.numbers import read_number, write_number
from study_app.protocol.questions import (
    ChoiceView,
    ItemView,
    NumberView,
    RatingView,
    SliderView,
    TextView,
    Value,
    plain_number,
)
from study_app.protocol.source import UNPRINTABLE, characters
from study_app.protocol.wording import Words

_SHORT = 12  # options with at most this many letters are three in a row
_MEDIUM = 28  # options with at most this many letters are two in a row
_MAX_COLUMNS = 4


class _ChoiceField(OptionsField):
    """A question with a grid of options; if several are possible, a key or click adds or removes one."""

    widget_id: ClassVar[str] = "choice"

    def __init__(self, view: ItemView, wording: Words, parent: QWidget) -> None:
        assert isinstance(view, ChoiceView)  # noqa: S101 - the registry names this widget
        self.several = view.several
        self._ids = [option for option, _ in view.options]
        self._texts = dict(view.options)
        super().__init__(view, wording, parent)
        kind = CheckOption if view.several else RadioOption
        self.set_options([kind(text, text, view.text, self) for _, text in view.options])
        longest = max(len(text) for _, text in view.options)
        self._columns = min(len(self.options), 3 if longest <= _SHORT else 2 if longest <= _MEDIUM else 1)
        area = QWidget(self)
        self._cells = grid(margins=0, parent=area)
        self._arrange_options(self._columns)
        self.put_answer_part(area)

    @property
    def note(self) -> str:
        note = super().note
        return " · ".join(filter(None, (self._words.several_possible, note))) if self.several else note

    @property
    def forward(self) -> int:
        return -1 if self.layoutDirection() == Qt.LayoutDirection.RightToLeft else 1

    @property
    def chosen(self) -> tuple[int, ...]:
        answers = self.value if isinstance(self.value, tuple) else (self.value,)
        return tuple(place for place, option in enumerate(self._ids) if option in answers)

    def value_at(self, place: int) -> Value:
        return self._ids[place]

    def spoken_answer(self) -> str:
        return self._words.joined([self._texts[self._ids[place]] for place in self.chosen])

    def height_in(self, width: int, room: int) -> int:
        """Return the height at a width [px], with more options side by side if there is too little space."""
        for columns in range(self._columns, min(_MAX_COLUMNS, len(self.options)) + 1):
            self._arrange_options(columns)
            if (height := super().height_in(width, room)) <= room:
                return height
        return height

    def _arrange_options(self, columns: int) -> None:
        for number, option in enumerate(self.options):
            self._cells.addWidget(option, number // columns, number % columns)
        for column in range(_MAX_COLUMNS):
            self._cells.setColumnStretch(column, 1 if column < columns else 0)

    def set_scale(self, scale: float) -> None:
        super().set_scale(scale)
        self._cells.setSpacing(round(8 * scale))

    def choose(self, place: int, *, by_key: bool) -> None:
        """Answer with an option; if several are possible, add or remove it."""
        if not self.several:
            super().choose(place, by_key=by_key)
            return
        chosen = self.chosen
        if answer := tuple(
            option for number, option in enumerate(self._ids) if (number in chosen) != (number == place)
        ):
            self.give_answer(answer)
        else:
            self.retract_answer()
        self._check()
        point_screen_reader_at(self.options[place])


_KEYS_PER_ROW = 6
_WAIT_MS = 400
_FIELD_WIDTH = 120.0


class Entry(EntryKeys, QLineEdit):
    """A line edit without Qt's context menu, which would be in English."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.NoContextMenu)


class _NumberField(TypedField):
    """A question with a number, with point or comma; other entries are rejected with a reason."""

    widget_id: ClassVar[str] = "number"

    def __init__(self, view: ItemView, wording: Words, parent: QWidget) -> None:
        assert isinstance(view, NumberView)  # noqa: S101 - the registry names this widget
        self._number = view
        super().__init__(view, wording, parent)
        self.entry = Entry(self)
        self.entry.setAccessibleName(" ".join(filter(None, (view.text, view.unit))))
        self.entry.setMaxLength(20)
        self.entry.textChanged.connect(self._restart_wait)
        self._unit = PlainLabel(view.unit)
        self._unit.setStyleSheet(f"color: {PARTICIPANT.text2}; background: transparent;")
        more = (*(() if view.whole else (wording.decimal_sign,)), *self._sign_keys())
        self._pad = DigitPad(self.entry, more, _KEYS_PER_ROW, wording.delete_digit, self)
        self._wrong = PlainLabel(wraps=True)
        self._wrong.setStyleSheet(f"color: {PARTICIPANT.warn}; background: transparent;")
        self._wrong.hide()
        self._row = hbox(self.entry, self._unit, (STRETCH, 1), self._pad)
        area = QWidget(self)
        vbox(self._row, self._wrong, margins=0, parent=area)
        self.put_answer_part(area)
        self.set_entry(self.entry, _WAIT_MS, self._accept_number)

    @property
    def keys(self) -> list[QPushButton]:
        return self._pad.keys

    @property
    def problem(self) -> str:
        """The problem of the entry; "" if there is none."""
        return self._wrong.text()

    def show_answer(self, value: Value) -> None:
        self.set_answer(value)
        if isinstance(value, int | float):
            self._write_text(write_number(value, 9, self._words.decimal_sign))

    def clear_answer(self) -> None:
        self._timer.stop()
        self._write_text("")
        self._show_problem("")

    def set_scale(self, scale: float) -> None:
        super().set_scale(scale)
        side = round(target_px(scale))
        self.entry.setFont(font("cell", scale=scale, tabular=True))
        self.entry.setFixedSize(round(_FIELD_WIDTH * scale), side)
        self._unit.setFont(font("body", scale=scale))
        self._wrong.setFont(font("label", scale=scale, weight=600))
        self._row.setSpacing(round(10 * scale))
        self._pad.set_size(side, side, round(6 * scale), font("cell", scale=scale))

    def height_in(self, width: int, room: int) -> int:
        """Return the height of the question with the longest problem [px]."""
        problem = self._wrong.text()
        unclear = self._words.unclear_number("888,888") or self._words.unclear_number("888.888")
        self._wrong.setText(problem or max(unclear, self._expected_sentence(), key=len))
        self._wrong.show()
        height = super().height_in(width, room)
        self._wrong.setText(problem)
        self._wrong.setVisible(bool(problem))
        return height

    def typed_text(self) -> str:
        return self.entry.text()

    def finish(self) -> bool:
        """Accept the entry, or show its problem."""
        self._timer.stop()
        text = self.entry.text().strip()
        if not text:
            self._show_problem("")
            self.retract_answer()
            return True
        number = read_number(text, self._words.decimal_sign)
        if number is None or not self._number.permits(number):
            self._show_problem(self._words.unclear_number(text) or self._expected_sentence())
            self.retract_answer()
            return False
        self._show_problem("")
        self.give_answer(plain_number(number))
        return True

    def _sign_keys(self) -> tuple[str, ...]:
        allows_negative = self._number.least is None or self._number.least < 0
        return ("-",) if allows_negative else ()

    def _write_text(self, text: str) -> None:
        with QSignalBlocker(self.entry):
            self.entry.setText(text)

    def _restart_wait(self) -> None:
        self._show_problem("")
        self._timer.start()

    def _accept_number(self) -> None:
        """Accept the text typed so far if it is a valid number; no problem is shown while typing."""
        number = read_number(self.entry.text(), self._words.decimal_sign)
        if number is not None and self._number.permits(number):
            self.give_answer(plain_number(number))
        else:
            self.retract_answer()

    def _expected_sentence(self) -> str:
        wording, view = self._words, self._number
        kind = wording.whole_number if view.whole else wording.any_number
        minimum, maximum = (
            None if bound is None else write_number(bound, 9, wording.decimal_sign) for bound in (view.least, view.most)
        )
        if minimum is not None and maximum is not None:
            return wording.number_between.format(kind=kind, least=minimum, most=maximum)
        if minimum is not None:
            return wording.number_from.format(kind=kind, least=minimum)
        if maximum is not None:
            return wording.number_to.format(kind=kind, most=maximum)
        return wording.number_needed.format(kind=kind)

    def _show_problem(self, problem: str) -> None:
        self._wrong.setText(problem)
        self._wrong.setVisible(bool(problem))
        set_property(self.entry, "state", "refused" if problem else "")
        self.entry.setAccessibleDescription(problem)
        if problem:
            announce(self.entry, problem)


_JUDGE_SHARE = 2  # stretch of "cannot judge"; each point has 1
_ALL_NAMED = 5  # points up to which all have a label; otherwise the ends and the middle, or the one pointed at


class _RatingField(ScaleField):
    """A question with a rating scale, whose labels are above its points."""

    widget_id: ClassVar[str] = "rating"

    def __init__(self, view: ItemView, wording: Words, parent: QWidget) -> None:
        assert isinstance(view, RatingView)  # noqa: S101 - the registry names this widget
        super().__init__(view, wording, parent)
        self.build_options(view.labels, view.cannot_judge, view.cannot_judge)
        scale, area = QWidget(self), QWidget(self)
        scale.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        self.cells = grid(margins=0, parent=scale)
        self.row = hbox((scale, len(self.points)), margins=0, parent=area)
        if self.judge is not None:
            self.row.addWidget(self.judge, _JUDGE_SHARE, Qt.AlignmentFlag.AlignBottom)
        self.put_answer_part(area)
        self._labels = [PlainLabel() for _ in self._label_columns()]
        for (first, last), label, side in zip(
            self._label_columns(), self._labels, self._label_alignments(), strict=True
        ):
            label.setWordWrap(True)
            label.setAlignment(side | Qt.AlignmentFlag.AlignAbsolute | Qt.AlignmentFlag.AlignBottom)
            self.cells.addWidget(label, 0, first, 1, last - first + 1)
        for place, point in enumerate(self.points):
            self.cells.addWidget(point, 1, place)
            self.cells.setColumnStretch(place, 1)
        self.pointed_at.connect(self._show_labels)
        self._show_labels()

    def set_scale(self, scale: float) -> None:
        super().set_scale(scale)
        self.cells.setSpacing(round(6 * scale))
        self.row.setSpacing(round(14 * scale))
        widest = max(point.sizeHint().width() for point in self.points)
        for point in self.points:
            point.setMinimumWidth(widest)
        for label in self._labels:
            label.setFont(font("label", scale=scale, weight=600))

    def _label_columns(self) -> list[tuple[int, int]]:
        """Return the first and last column of each label."""
        points = len(self.labels)
        if points <= _ALL_NAMED:
            return [(place, place) for place in range(points)]
        end = points // 3
        return [(0, end - 1), (end, points - end - 1), (points - end, points - 1)]

    def _label_alignments(self) -> list[Qt.AlignmentFlag]:
        centre = Qt.AlignmentFlag.AlignHCenter
        if len(self.labels) <= _ALL_NAMED:
            return [centre] * len(self.labels)
        return [Qt.AlignmentFlag.AlignLeft, centre, Qt.AlignmentFlag.AlignRight]

    def _show_labels(self, _place: int = -1) -> None:
        """Show all labels of a short scale, or the ends of a long one and the pointed label in the middle."""
        texts = list(self.labels)
        if len(texts) > _ALL_NAMED:
            middle = self.labels[len(texts) // 2] if len(texts) % 2 else ""
            if 0 < self.pointed < len(texts) - 1:
                middle = f"{self.pointed + 1} {self.labels[self.pointed]}"
            texts = [self.labels[0], middle, self.labels[-1]]
        for place, (label, text) in enumerate(zip(self._labels, texts, strict=True)):
            is_pointed = self.pointed == place if len(self.labels) <= _ALL_NAMED else place == 1 and self.pointed > 0
            ink = PARTICIPANT.accent if is_pointed else PARTICIPANT.text2
            label.setStyleSheet(f"color: {ink}; background: transparent;")
            label.setText(text)


_ABSOLUTE = Qt.AlignmentFlag.AlignAbsolute
_KNOB = 12.0  # radius of the handle
_TRACK = 6.0
_PAGE_STEPS = 10
_STEP_KEYS = {
    Qt.Key.Key_Left: -1,
    Qt.Key.Key_Right: 1,
    Qt.Key.Key_PageDown: -_PAGE_STEPS,
    Qt.Key.Key_PageUp: _PAGE_STEPS,
}


class _Line(QSlider):
    """A slider; ``set_to(step)`` is emitted when a key or click moves the handle, and when the handle is released."""

    set_to = Signal(int)

    def __init__(self, steps: int, parent: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal, parent)
        self.touched = False
        self._scale = 1.0
        self.setRange(0, steps)
        self.setPageStep(_PAGE_STEPS)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.valueChanged.connect(self._handle_step)

    def set_scale(self, scale: float) -> None:
        self._scale = scale
        self.setFixedHeight(round(target_px(scale)))

    def sizeHint(self) -> QSize:
        return QSize(round(240 * self._scale), round(target_px(self._scale)))

    def show_step(self, step: int) -> None:
        """Set the handle to a step without a signal."""
        self.touched = True
        with QSignalBlocker(self):
            self.setValue(step)
        self.update()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the handle by steps or to the ends; the first key puts it in the middle or at an end."""
        if event.key() in (Qt.Key.Key_Home, Qt.Key.Key_End):
            self._move_to(self.minimum() if event.key() == Qt.Key.Key_Home else self.maximum())
        elif (by := _STEP_KEYS.get(Qt.Key(event.key()))) is not None:
            self._move_to(self.value() + by if self.touched else self.maximum() // 2)
        else:
            event.ignore()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.setSliderDown(True)
            self._drag(event.position().x())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self.isSliderDown():
            self._drag(event.position().x())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Release the handle, whose position is the answer."""
        if self.isSliderDown():
            self._drag(event.position().x())
            self.setSliderDown(False)
            self.set_to.emit(self.value())

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Ignore the wheel, which would change answers by accident."""
        event.ignore()

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self._repaint_question()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self._repaint_question()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        theme, scale = PARTICIPANT, self._scale
        left, right, middle = self._left_edge(), self.width() - self._left_edge(), self.height() / 2
        painter.setPen(QPen(QColor(theme.ctl), 1.5))
        for x in (left, right):
            painter.drawLine(QPointF(x, middle - _KNOB * scale), QPointF(x, middle + _KNOB * scale))
        painter.setPen(QPen(QColor(theme.ctl), 1))
        painter.setBrush(QColor(theme.sunk))
        half = _TRACK * scale / 2
        painter.drawRoundedRect(QRectF(left, middle - half, right - left, 2 * half), half, half)
        if self.touched:
            x = left + (right - left) * (self.value() / max(1, self.maximum()))
            painter.setPen(QPen(QColor(theme.text), 2))
            painter.setBrush(QColor(theme.accent))
            painter.drawEllipse(QPointF(x, middle), _KNOB * scale, _KNOB * scale)
        painter.end()

    def _left_edge(self) -> float:
        return (_KNOB + 3) * self._scale

    def _drag(self, x: float) -> None:
        width = max(1.0, self.width() - 2 * self._left_edge())
        share = min(1.0, max(0.0, (x - self._left_edge()) / width))
        self.touched = True
        self.setValue(round(share * self.maximum()))
        self.update()

    def _move_to(self, step: int) -> None:
        self.touched = True
        with QSignalBlocker(self):
            self.setValue(step)
        self.update()
        self.set_to.emit(self.value())

    def _handle_step(self, step: int) -> None:
        if not self.isSliderDown():
            self.touched = True
            self.update()
            self.set_to.emit(step)

    def _repaint_question(self) -> None:
        if (question := question_of(self)) is not None:
            question.update()


class SliderField(QuestionField):
    """A question with a slider: arrows move it by one step, Page keys by ten, Home and End to the ends."""

    widget_id: ClassVar[str] = "slider"

    def __init__(self, view: ItemView, wording: Words, parent: QWidget) -> None:
        assert isinstance(view, SliderView)  # noqa: S101 - the registry names this widget
        self._slider = view
        super().__init__(view, wording, parent)
        area = QWidget(self)
        area.setLayoutDirection(Qt.LayoutDirection.LeftToRight)  # a scale has the same order in every language
        self.line = _Line(view.steps, area)
        self.line.setAccessibleName(view.text)
        self.line.set_to.connect(lambda step: self.give_answer(view.at(step)))
        self._ends = (PlainLabel(view.low), PlainLabel(wording.no_answer_yet), PlainLabel(view.high))
        for end, side in zip(self._ends, (Qt.AlignmentFlag.AlignLeft, None, Qt.AlignmentFlag.AlignRight), strict=True):
            end.setWordWrap(side is not None)
            end.setAlignment((side or Qt.AlignmentFlag.AlignHCenter) | _ABSOLUTE | Qt.AlignmentFlag.AlignTop)
            end.setStyleSheet(f"color: {PARTICIPANT.text2 if side else PARTICIPANT.text3}; background: transparent;")
        names = hbox(*((end, 1) for end in self._ends))
        vbox(self.line, names, spacing=0, margins=0, parent=area)
        self.put_answer_part(area)
        self.setFocusProxy(self.line)
        self._update_line()

    def show_answer(self, value: Value) -> None:
        self.set_answer(value)
        if isinstance(value, int | float):
            self.line.show_step(round((value - self._slider.least) / self._slider.step))
        self._update_line()

    def clear_answer(self) -> None:
        self.line.touched = False
        self.line.update()
        self._update_line()

    def give_answer(self, value: Value) -> None:
        super().give_answer(value)
        self._update_line()

    def set_scale(self, scale: float) -> None:
        super().set_scale(scale)
        self.line.set_scale(scale)
        for end in self._ends:
            end.setFont(font("label", scale=scale, weight=600))

    def _update_line(self) -> None:
        self._ends[1].setText("" if self.is_answered else self._words.no_answer_yet)
        self.line.setAccessibleDescription(f"{self._slider.low} – {self._slider.high}, {self.accessibleDescription()}")


_TEXT_WAIT_MS = 600
_FRAME = 20.0  # height of a field in addition to its lines [px at scale 1]


class _TextEntry(EntryKeys, QPlainTextEdit):
    """A text edit without a menu; Tab leaves it, and with a single line the page handles Enter."""

    def __init__(self, lines: int, parent: QWidget) -> None:
        super().__init__(parent)
        self._lines = lines
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.NoContextMenu)
        self.setTabChangesFocus(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        if lines == 1:
            self.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
            self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def is_left_to_page(self, event: QKeyEvent) -> bool:
        """Return whether the page handles a key; with several lines, only Ctrl+Enter."""
        if self._lines == 1:
            return super().is_left_to_page(event)
        return event.key() in ENTER and bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)


class TextField(TypedField):
    """A question with a text of one or several lines."""

    widget_id: ClassVar[str] = "text"

    def __init__(self, view: ItemView, wording: Words, parent: QWidget) -> None:
        assert isinstance(view, TextView)  # noqa: S101 - the registry names this widget
        self._shown = view
        super().__init__(view, wording, parent)
        self.entry = _TextEntry(view.lines, self)
        self.entry.setAccessibleName(view.text)
        self.entry.textChanged.connect(self._clean_text)
        self.put_answer_part(self.entry)
        self.set_entry(self.entry, _TEXT_WAIT_MS, self.finish)

    @property
    def answer_keys(self) -> str:
        return self._words.letter_keys

    def show_answer(self, value: Value) -> None:
        self.set_answer(value)
        with QSignalBlocker(self.entry):
            self.entry.setPlainText(str(value))

    def clear_answer(self) -> None:
        with QSignalBlocker(self.entry):
            self.entry.clear()
        self._timer.stop()

    def set_scale(self, scale: float) -> None:
        super().set_scale(scale)
        face = font("statement", scale=scale)
        self.entry.setFont(face)
        height = self._shown.lines * QFontMetricsF(face).lineSpacing() + _FRAME * scale
        self.entry.setFixedHeight(round(max(target_px(scale), height)))

    def finish(self) -> bool:
        """Accept the text; an empty text retracts the answer."""
        self._timer.stop()
        text = self.entry.toPlainText().strip()
        if text:
            self.give_answer(text)
        else:
            self.retract_answer()
        return True

    def typed_text(self) -> str:
        return self.entry.toPlainText()

    def _clean_text(self) -> None:
        """Remove unprintable characters, and text beyond the maximum length."""
        text, cursor = self.entry.toPlainText(), self.entry.textCursor()
        clean = "".join(characters(self._printable(text))[: self._shown.longest])
        if clean != text:
            before_cursor = _utf16(text)[: 2 * cursor.position()].decode("utf-16-le", "surrogatepass")
            position = min(len(_utf16(self._printable(before_cursor))), len(_utf16(clean))) // 2
            with QSignalBlocker(self.entry):
                self.entry.setPlainText(clean)
            cursor = self.entry.textCursor()
            cursor.setPosition(position)
            self.entry.setTextCursor(cursor)
        self._timer.start()

    def _printable(self, text: str) -> str:
        """Return a text without unprintable characters; a field of one line has no line breaks."""
        printable = "".join(
            character for character in text if character == "\n" or unicodedata.category(character) not in UNPRINTABLE
        )
        return printable.replace("\n", " ") if self._shown.lines == 1 else printable


def _utf16(text: str) -> bytes:
    """Return a text in UTF-16, since Qt counts positions in units of two bytes."""
    return text.encode("utf-16-le", "surrogatepass")


FIELDS: Final[dict[str, type[QuestionField]]] = {
    kind.widget_id: kind for kind in (_ChoiceField, _NumberField, _RatingField, SliderField, TextField)
}
"""The question fields by their widget ID, which questions name."""

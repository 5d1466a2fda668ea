"""Number fields and sliders."""

import math
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QPointF, QRectF, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QKeyEvent, QKeySequence, QMouseEvent, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import QLineEdit, QSizePolicy, QSlider

from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.cards import smooth_painter
from study_app.gui.widgets.labels import set_property
from study_app.number_text import MINUS, number_of

_NUMERALS = set("0123456789.,+-eE' \u00a0\u2009\u202f" + MINUS)


def read_number(text: str, decimal_sign: str = ".") -> float | None:
    """Return the number in a text (`number_of`) as a float; None if there is none or it is ambiguous."""
    number = number_of(text, decimal_sign)
    return None if number is None else float(number)


def write_number(value: float, decimals: int, decimal_sign: str = ".") -> str:
    """Return a number with at most ``decimals`` decimals, without trailing zeros, with a minus sign."""
    text = f"{value:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    if text.strip("-0.") == "":
        text = "0" if value == 0 else f"{value:.2g}"
    return text.replace("-", MINUS).replace(".", decimal_sign)


class NumberField(QLineEdit):
    """A compact field for a number; Return or leaving it submits, Esc reverts, Up and Down step.

    ``entered(value)`` is emitted once for a typed number, ``unread(text)`` if the text is not a single number,
    ``abandoned()`` at Esc, and ``stepped(steps)`` at Up and Down. Return submits a rejected number again. `show_text`
    does not change text that is being typed.
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
        self.returnPressed.connect(self._submit_typed)

    @property
    def state(self) -> str:
        """The state of the field's edge: "", "changed" or "refused"."""
        return self._state

    def show_text(self, text: str) -> None:
        self._shown = text
        if not self.isModified() and text != self.text():
            self.setText(text)
            self.setCursorPosition(0)

    def show_state(self, state: str) -> None:
        """Set the state of the field's edge; changed and refused numbers are bold."""
        if state == self._state:
            return
        self._state = state
        self.setFont(font("label", weight=600 if state else None, tabular=True))
        set_property(self, "state", state)

    def restore_text(self) -> None:
        self.setText(self._shown)
        self.setModified(False)

    def event(self, event: QEvent) -> bool:
        """Leave keys that a number cannot contain to the window, so that its shortcuts work."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            is_undo = event.matches(QKeySequence.StandardKey.Undo) or event.matches(QKeySequence.StandardKey.Redo)
            has_no_modifier = event.modifiers() in {Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier}
            if (is_undo and not self.isModified()) or (
                has_no_modifier and event.text().isalpha() and not self._is_numeric(event.text())
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
            self.restore_text()
            self.abandoned.emit()
        elif event.text().isalpha() and not self._is_numeric(event.text()):
            event.ignore()
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if event.reason() in {Qt.FocusReason.TabFocusReason, Qt.FocusReason.BacktabFocusReason}:
            self.selectAll()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.emit_typed()

    @staticmethod
    def _is_numeric(text: str) -> bool:
        return bool(text) and set(text) <= _NUMERALS

    def _submit_typed(self) -> None:
        """Submit the typed text; retry a rejected number, since the reason may have disappeared."""
        if self._state == "refused":
            self.setModified(True)
        self.emit_typed()

    def emit_typed(self) -> None:
        """Emit the typed text once; it is kept if it is not a number."""
        if not self.isModified():
            return
        value = read_number(self.text())
        if value is None:
            self.unread.emit(self.text())
            return
        self.setModified(False)
        self.entered.emit(value)


_STEPS = 200
_PAGE = 20
_SIGNIFICANT_DIGITS = 3  # significant digits of a slider's number: more would be false precision
_KNOB = 7.5
_TRACK = 4.0
MARGIN = _KNOB + 4  # space for the knob and its focus ring at both ends


@dataclass(frozen=True, slots=True)
class Range:
    """The range of a slider, from ``least`` to ``most``; ``whole`` means that all values are integers."""

    least: float
    most: float
    logarithmic: bool = False
    whole: bool = False

    @property
    def steps(self) -> int:
        if self.whole and not self.logarithmic:
            return max(1, min(_STEPS, round(self.most - self.least)))
        return _STEPS

    def fraction_of_range(self, value: float) -> float:
        """Return the position of a number on the track, 0 to 1; numbers outside the range are at its ends."""
        if self.most <= self.least:
            return 0.0
        value = min(max(value, self.least), self.most)
        if self._is_logarithmic:
            return math.log(value / self.least) / math.log(self.most / self.least)
        return (value - self.least) / (self.most - self.least)

    def value_at(self, share: float) -> float:
        """Return the number at a position, with as many digits as a slider can resolve."""
        if share <= 0.0 or self.most <= self.least:
            return self.least
        if share >= 1.0:
            return self.most
        if self._is_logarithmic:
            number = self.least * (self.most / self.least) ** share
            digits = _SIGNIFICANT_DIGITS - 1 - math.floor(math.log10(abs(number)))
        else:
            number = self.least + share * (self.most - self.least)
            digits = _SIGNIFICANT_DIGITS - math.floor(math.log10(self.most - self.least))
        number = round(number) if self.whole else round(number, digits)
        return min(max(float(number), self.least), self.most)

    @property
    def _is_logarithmic(self) -> bool:
        return self.logarithmic and self.least > 0


class Slider(Themed, QSlider):
    """A slider on a `Range`; the wheel scrolls the page, not the slider.

    ``slid(value, held)`` is emitted when mouse or keyboard move it: ``held`` while the knob is dragged, and once more,
    not held, when it is released. Double click or Delete requests the tick's value.
    """

    slid = Signal(float, bool)

    def __init__(self, span: Range | None = None) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._span = span or Range(0.0, 1.0)
        self._value = self._span.least
        self._tick: float | None = None
        self._dragged = False
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setRange(0, self._span.steps)
        self.valueChanged.connect(self._follow_step)

    @property
    def number(self) -> float:
        return self._value

    @property
    def tick(self) -> float | None:
        return self._tick

    @property
    def dragged(self) -> bool:
        return self._dragged

    def show_number(self, span: Range, value: float, tick: float | None = None) -> None:
        """Show ``value`` within ``span``, with a tick at ``tick``, without a signal."""
        if (span, value, tick) == (self._span, self._value, self._tick):
            return
        self._span, self._value, self._tick = span, value, tick
        self._update_accessible_value()
        self.update()

    def release_knob(self) -> None:
        """Release the knob without a signal, even while the mouse holds it."""
        self._dragged = False
        self.update()

    def step(self, steps: int) -> None:
        self._move_to(self._value_after(steps), held=False)

    def sizeHint(self) -> QSize:
        return QSize(110, 32)

    def minimumSizeHint(self) -> QSize:
        return QSize(64, 32)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        keys = Qt.Key
        page = max(1, self._span.steps // (_STEPS // _PAGE))
        steps = {
            keys.Key_Left: -1, keys.Key_Down: -1, keys.Key_Right: 1, keys.Key_Up: 1,
            keys.Key_PageDown: -page, keys.Key_PageUp: page,
        }.get(keys(event.key()))  # fmt: skip
        if steps is not None:
            self.step(steps)
        elif event.key() == keys.Key_Home:
            self._move_to(self._span.least, held=False)
        elif event.key() == keys.Key_End:
            self._move_to(self._span.most, held=False)
        elif event.key() in {keys.Key_Delete, keys.Key_Backspace} and self._tick is not None:
            self._move_to(self._tick, held=False)
        else:
            event.ignore()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._dragged = True
            self._move_to(self._value_at(event.position().x()), held=True)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._dragged:
            self._move_to(self._value_at(event.position().x()), held=True)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self._dragged:
            self._dragged = False
            self.slid.emit(self._value, False)
            self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self._tick is not None:
            self._move_to(self._tick, held=False)

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = smooth_painter(self)
        middle, x = self.height() / 2, self._position_of(self._value)
        painter.setPen(Qt.PenStyle.NoPen)
        for colour, end in ((t.border, self.width() - MARGIN + _KNOB), (t.accent if self.isEnabled() else t.ctl, x)):
            painter.setBrush(QColor(colour))
            track = QRectF(MARGIN - _KNOB, middle - _TRACK / 2, end - MARGIN + _KNOB, _TRACK)
            painter.drawRoundedRect(track, _TRACK / 2, _TRACK / 2)
        if self._tick is not None:
            at = self._position_of(self._tick)
            painter.setPen(QPen(QColor(t.text3), 1.6))
            painter.drawLine(QPointF(at, middle - 8), QPointF(at, middle + 8))
        painter.setPen(QPen(QColor(t.accent if self.isEnabled() else t.ctl), 2))
        painter.setBrush(QColor(t.selected if self._dragged else t.surface))
        painter.drawEllipse(QPointF(x, middle), _KNOB - 1, _KNOB - 1)
        if self.hasFocus():
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(QPointF(x, middle), _KNOB + 2.5, _KNOB + 2.5)

    def _position_of(self, value: float) -> float:
        return MARGIN + self._span.fraction_of_range(value) * (self.width() - 2 * MARGIN)

    def _value_at(self, x: float) -> float:
        return self._span.value_at((x - MARGIN) / max(1.0, self.width() - 2 * MARGIN))

    def _value_after(self, steps: int) -> float:
        """Return the number ``steps`` steps away; it differs from the current one unless the end is reached."""
        share = self._span.fraction_of_range(self._value)
        value = self._span.value_at(share + steps / self._span.steps)
        if self._span.whole and value == self._value:
            value = min(max(self._value + math.copysign(1, steps), self._span.least), self._span.most)
        return value

    def _move_to(self, value: float, *, held: bool) -> None:
        if value == self._value:
            return
        self._value = value
        self._update_accessible_value()
        self.update()
        self.slid.emit(value, held)

    def _follow_step(self, step: int) -> None:
        """Follow a change that neither mouse nor keyboard caused, such as one by a screen reader."""
        self._move_to(self._span.value_at(step / self._span.steps), held=False)

    def _update_accessible_value(self) -> None:
        with QSignalBlocker(self):
            self.setRange(0, self._span.steps)
            self.setValue(round(self._span.fraction_of_range(self._value) * self._span.steps))

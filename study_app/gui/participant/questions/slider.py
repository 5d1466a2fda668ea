"""A slider between two words; it has no handle before it is first touched."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QKeyEvent, QMouseEvent, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import QLabel, QSizePolicy, QSlider, QWidget

from study_app.gui.participant.forms.question_field import QuestionField, question_of, target_px
from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.protocol.questions import ItemView, SliderView, Value

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

ABSOLUTE = Qt.AlignmentFlag.AlignAbsolute
KNOB = 12.0  # radius
TRACK = 6.0
PAGE_STEPS = 10
STEP_KEYS = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1, Qt.Key.Key_PageDown: -PAGE_STEPS, Qt.Key.Key_PageUp: PAGE_STEPS}


class Line(QSlider):
    """The line and its handle; ``set_to(step)`` comes with a click, a key, and where the handle is let go."""

    set_to = Signal(int)

    def __init__(self, steps: int, parent: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal, parent)
        self.touched = False
        self._scale = 1.0
        self.setRange(0, steps)
        self.setPageStep(PAGE_STEPS)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.valueChanged.connect(self._hear)

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        self._scale = scale
        self.setFixedHeight(round(target_px(scale)))

    def sizeHint(self) -> QSize:
        return QSize(round(240 * self._scale), round(target_px(self._scale)))

    def show_step(self, step: int) -> None:
        """Put the handle at a step without a signal."""
        self.touched = True
        self.blockSignals(True)
        self.setValue(step)
        self.blockSignals(False)
        self.update()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move by steps, or to the ends; the first key puts the handle into the middle, or to an end."""
        if event.key() in (Qt.Key.Key_Home, Qt.Key.Key_End):
            self._move(self.minimum() if event.key() == Qt.Key.Key_Home else self.maximum())
        elif (by := STEP_KEYS.get(Qt.Key(event.key()))) is not None:
            self._move(self.value() + by if self.touched else self.maximum() // 2)
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
        """Let the handle go: that is the answer."""
        if self.isSliderDown():
            self._drag(event.position().x())
            self.setSliderDown(False)
            self.set_to.emit(self.value())

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Leave the wheel alone: it changes no answer by accident."""
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
        left, right, middle = self._left(), self.width() - self._left(), self.height() / 2
        painter.setPen(QPen(QColor(theme.ctl), 1.5))
        for x in (left, right):
            painter.drawLine(QPointF(x, middle - KNOB * scale), QPointF(x, middle + KNOB * scale))
        painter.setPen(QPen(QColor(theme.ctl), 1))
        painter.setBrush(QColor(theme.sunk))
        half = TRACK * scale / 2
        painter.drawRoundedRect(QRectF(left, middle - half, right - left, 2 * half), half, half)
        if self.touched:
            x = left + (right - left) * (self.value() / max(1, self.maximum()))
            painter.setPen(QPen(QColor(theme.text), 2))
            painter.setBrush(QColor(theme.accent))
            painter.drawEllipse(QPointF(x, middle), KNOB * scale, KNOB * scale)
        painter.end()

    def _left(self) -> float:
        return (KNOB + 3) * self._scale

    def _drag(self, x: float) -> None:
        width = max(1.0, self.width() - 2 * self._left())
        share = min(1.0, max(0.0, (x - self._left()) / width))
        self.touched = True
        self.setValue(round(share * self.maximum()))
        self.update()

    def _move(self, step: int) -> None:
        self.touched = True
        self.blockSignals(True)
        self.setValue(step)
        self.blockSignals(False)
        self.update()
        self.set_to.emit(self.value())

    def _hear(self, step: int) -> None:
        """Hear a screen reader, which sets the value itself."""
        if not self.isSliderDown():
            self.touched = True
            self.update()
            self.set_to.emit(step)

    def _repaint_question(self) -> None:
        if (question := question_of(self)) is not None:
            question.update()


class SliderField(QuestionField):
    """Arrows move one step, Page ten, Home and End to the ends; a click or a finger puts the handle anywhere."""

    widget_id: ClassVar[str] = "slider"

    def __init__(self, view: ItemView, words: Words, parent: QWidget) -> None:
        assert isinstance(view, SliderView)  # noqa: S101 - the registry names this widget
        self._slider = view
        super().__init__(view, words, parent)
        area = QWidget(self)
        area.setLayoutDirection(Qt.LayoutDirection.LeftToRight)  # a scale has the same order in every language
        self.line = Line(view.steps, area)
        self.line.setAccessibleName(view.text)
        self.line.set_to.connect(lambda step: self.give(view.at(step)))
        self._ends = (QLabel(view.low), QLabel(words.no_answer_yet), QLabel(view.high))
        for end, side in zip(self._ends, (Qt.AlignmentFlag.AlignLeft, None, Qt.AlignmentFlag.AlignRight), strict=True):
            end.setWordWrap(side is not None)
            end.setAlignment((side or Qt.AlignmentFlag.AlignHCenter) | ABSOLUTE | Qt.AlignmentFlag.AlignTop)
            end.setStyleSheet(f"color: {PARTICIPANT.text2 if side else PARTICIPANT.text3}; background: transparent;")
        names = hbox(*((end, 1) for end in self._ends))
        vbox(self.line, names, spacing=0, margins=0, parent=area)
        self.put(area)
        self.setFocusProxy(self.line)
        self._tell_line()

    def show_answer(self, value: Value) -> None:
        """Put the handle where it was."""
        self.kept(value)
        if isinstance(value, int | float):
            self.line.show_step(round((value - self._slider.least) / self._slider.step))
        self._tell_line()

    def clear(self) -> None:
        """Take the handle away."""
        self.line.touched = False
        self.line.update()
        self._tell_line()

    def give(self, value: Value) -> None:
        """Take the place of the handle."""
        super().give(value)
        self._tell_line()

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        super().set_scale(scale)
        self.line.set_scale(scale)
        for end in self._ends:
            end.setFont(font("label", scale=scale, weight=600))

    def _tell_line(self) -> None:
        self._ends[1].setText("" if self.is_answered else self._words.no_answer_yet)
        self.line.setAccessibleDescription(f"{self._slider.low} – {self._slider.high}, {self.accessibleDescription()}")


FIELD: Final = SliderField

"""Small parts of the designer: a choice between few words side by side, small buttons, texts that are cut."""

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QEvent, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QKeyEvent, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractButton, QSizePolicy, QWidget

from study_app.gui.theme.theme import RADIUS_CONTROL, TypeRole, font
from study_app.gui.theme.themed import Themed, remove_widget
from study_app.gui.widgets.boxes import hbox
from study_app.gui.widgets.cards import fill_rounded, smooth_painter
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Elided, Ink

INSIDE, BETWEEN, SEGMENT_PX = 3, 4, 28


class _Segment(Themed, QAbstractButton):
    def __init__(self) -> None:
        super().__init__()
        self.setCheckable(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Minimum, QSizePolicy.Policy.Fixed)

    def show_words(self, words: str) -> None:
        if words != self.text():
            self.setText(words)
            self.setAccessibleName(words)

    def event(self, event: QEvent) -> bool:
        strip = self.parentWidget()
        if event.type() in (QEvent.Type.FocusIn, QEvent.Type.FocusOut) and strip is not None:
            strip.update()
        return super().event(event)

    def nextCheckState(self) -> None:
        """Leave it to `Segments` which is chosen."""

    def sizeHint(self) -> QSize:
        return QSize(round(QFontMetricsF(font("label", weight=600)).horizontalAdvance(self.text())) + 18, SEGMENT_PX)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        t, painter = self.theme, smooth_painter(self)
        body = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        if self.isChecked():
            painter.setPen(QPen(QColor(t.accent if self.isEnabled() else t.ctl), 1.2))
            painter.setBrush(QColor(t.surface if self.isEnabled() else t.sunk))
            painter.drawRoundedRect(body, RADIUS_CONTROL - 2, RADIUS_CONTROL - 2)
        painter.setPen(QColor(t.text if self.isChecked() else t.text2))
        painter.setFont(font("label", weight=600 if self.isChecked() else 500))
        painter.drawText(QRectF(self.rect()), Qt.AlignmentFlag.AlignCenter, self.text())


class Segments(Themed, QWidget):
    """One of few values; ``chosen`` carries the value that a press or an arrow key asks for; ``tips`` are of values."""

    chosen = Signal(object)

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self._name = name
        self._values: tuple[object, ...] = ()
        self.tips: Mapping[object, str] = {}
        self.buttons: list[_Segment] = []
        self._row = hbox(spacing=BETWEEN, margins=INSIDE, parent=self)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._add_button()

    def show_values(self, values: Sequence[tuple[object, str]], chosen: object) -> None:
        while len(self.buttons) > max(1, len(values)):
            remove_widget(self.buttons.pop())
        while len(self.buttons) < len(values):
            self._add_button()
        self._values = tuple(value for value, _ in values)
        for button, (value, words) in zip(self.buttons, values, strict=False):
            button.show_words(words)
            button.setChecked(value == chosen)
            button.setToolTip(self.tips.get(value, ""))
            button.update()
        self.setFocusProxy(next((button for button in self.buttons if button.isChecked()), self.buttons[0]))

    def _add_button(self) -> None:
        made, at = _Segment(), len(self.buttons)
        made.setAccessibleName(self._name)  # until it has words
        made.setAccessibleDescription(self._name)
        made.clicked.connect(lambda: self.chosen.emit(self._values[at]))
        self._row.addWidget(made)
        self.buttons.append(made)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        step = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}.get(Qt.Key(event.key()), 0)
        at = next((number for number, button in enumerate(self.buttons) if button.hasFocus()), None)
        if at is not None and event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.buttons[at].click()
        elif step and at is not None and 0 <= at + step < len(self.buttons):
            self.buttons[at + step].setFocus(Qt.FocusReason.TabFocusReason)
            self.chosen.emit(self._values[at + step])
        else:
            super().keyPressEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        fill_rounded(painter, QRectF(self.rect()), RADIUS_CONTROL, self.theme.sunk)
        for button in self.buttons:
            if button.hasFocus():
                painter.setPen(QPen(QColor(self.theme.accent), 2))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                ring = QRectF(button.geometry()).adjusted(-2, -2, 2, 2)
                painter.drawRoundedRect(ring, RADIUS_CONTROL, RADIUS_CONTROL)


def small_button(icon: str, words: str, *, cap: str = "", role: str = "", height: int = 34) -> ActionButton:
    """Return a button with little room around its words."""
    made = ActionButton(icon, words, cap=cap, role=role, height=height)
    made.setProperty("dense", "true")
    made.setFont(font("label"))
    return made


def cut_text(text: str, role: TypeRole = "small", ink: Ink = "text2", *, right: bool = False) -> Elided:
    """Return a line of text that ends in "…" where there is too little room, at the left or at the right."""
    made = Elided(role, ink)
    made.show_text(text)
    if right:
        made.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
    return made

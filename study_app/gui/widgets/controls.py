"""Controls that the style sheet alone cannot draw: buttons with icon and key cap, choices, check and radio marks."""

from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QFontMetricsF,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QValidator,
    QWheelEvent,
)
from PySide6.QtWidgets import (
    QAbstractButton,
    QCheckBox,
    QComboBox,
    QPushButton,
    QRadioButton,
    QSizePolicy,
    QSpinBox,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionButton,
    QStyleOptionComboBox,
    QStylePainter,
    QToolTip,
    QWidget,
)

from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.accessible import PlainLabel, plain_tip
from study_app.gui.widgets.cards import smooth_painter

_STOP_HEIGHT = 44


class PressedByEnter(QPushButton):
    """A button that Enter presses like Space, also in dialogs, where Enter would press the default button."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.click()
        else:
            super().keyPressEvent(event)


class Cap(Themed, QWidget):
    """A key cap."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.words = text
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        return _cap_size(self.words)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        _paint_cap(painter, QPointF(), self.words, self.theme.text, self.theme.ctl)


def _cap_size(text: str) -> QSize:
    """Return the size of a key cap; its width is 0 if ``text`` is empty."""
    return QSize(max(20, round(QFontMetricsF(font("key")).horizontalAdvance(text)) + 10) if text else 0, 20)


def _paint_cap(painter: QPainter, at: QPointF, text: str, ink: str, edge: str) -> None:
    """Paint a key cap with its upper left corner at ``at``."""
    body = QRectF(at, _cap_size(text).toSizeF())
    painter.setPen(QPen(QColor(edge), 1))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRoundedRect(body.adjusted(0.5, 0.5, -0.5, -0.5), 5, 5)
    painter.setPen(QColor(ink))
    painter.setFont(font("key"))
    painter.drawText(body, Qt.AlignmentFlag.AlignCenter, text)


class ActionButton(Themed, PressedByEnter):
    """A button with an icon before its text and, if it has a key, the key cap after it.

    ``key`` presses the button anywhere in its window; ``cap`` is only drawn, for a key that is handled elsewhere.
    """

    def __init__(self, icon: str, text: str, *, key: str = "", cap: str = "", role: str = "", height: int = 44) -> None:
        super().__init__(text)
        self._icon, self._key, self.cap, self._role = icon, key, cap or key, role
        self.setProperty("role", role)
        self.setFont(font("strong", scale=0.96))
        self.setMinimumHeight(height)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        if key:
            self.setShortcut(key)

    def show_action(self, icon: str, text: str) -> None:
        if (icon, text) == (self._icon, self.text()):
            return
        self._icon = icon
        self.setText(text)
        if self._key:
            self.setShortcut(self._key)  # setText clears it
        self.updateGeometry()  # the same text needs no layout, but an icon that appears or disappears does
        self.update()

    @property
    def role(self) -> str:
        """The role: "primary" is filled."""
        return self._role

    def set_role(self, role: str) -> None:
        if role != self._role:
            self._role = role
            self.setProperty("role", role)
            self.style().polish(self)
            self.update()

    def sizeHint(self) -> QSize:
        return QSize(round(self._content_width()) + 36, self.minimumHeight())

    def minimumSizeHint(self) -> QSize:
        return QSize(round(self._content_width()) + 20, self.minimumHeight())

    def _content_width(self) -> float:
        width = QFontMetricsF(self.font()).horizontalAdvance(self.text())
        icon = (28 if self.text() or self.cap else 20) if self._icon else 0
        return width + icon + (12 + _cap_size(self.cap).width() if self.cap else 0)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QStylePainter(self)
        option = QStyleOptionButton()
        self.initStyleOption(option)
        option.text = ""  # type: ignore[attr-defined]  # missing in the stubs
        painter.drawControl(QStyle.ControlElement.CE_PushButtonBevel, option)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        ink = QColor(self._ink())
        x = (self.width() - self._content_width()) / 2
        middle = self.height() / 2
        if self._icon:
            draw_icon(painter, self._icon, QRectF(x, middle - 10, 20, 20), ink, 1.9)
            x += 28
        painter.setPen(ink)
        painter.setFont(self.font())
        text_width = QFontMetricsF(self.font()).horizontalAdvance(self.text())
        painter.drawText(QRectF(x, 0, text_width + 2, self.height()), Qt.AlignmentFlag.AlignVCenter, self.text())
        if self.cap:
            edge = self._ink() if self._role == "primary" else self.theme.ctl
            _paint_cap(painter, QPointF(x + text_width + 11, middle - 10), self.cap, self._ink(), edge)

    def _ink(self) -> str:
        if not self.isEnabled():
            return self.theme.text2 if self._role == "primary" else self.theme.text3
        return {"primary": self.theme.on_accent, "danger": self.theme.bad, "plain": self.theme.text2}.get(
            self._role, self.theme.text
        )


class CompactStop(Themed, QPushButton):
    """The button that stops the force, in its reserved colour; it acts when pressed, not when released.

    It is never disabled. ``text`` names what else it stops, and ``cap`` is the key cap after it.
    """

    def __init__(self, text: str = "Stop force", cap: str = "") -> None:
        super().__init__()
        self.words, self.cap = text, cap
        self.setProperty("role", "stop")
        self.setAccessibleName(f"{text}. Holding Esc does the same.")
        self.setToolTip(f"{text} (or hold Esc)")
        self.setFixedHeight(_STOP_HEIGHT)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self._font = font("strong", scale=0.96)

    def sizeHint(self) -> QSize:
        keys = _cap_size(self.cap).width() + 10 if self.cap else 0
        return QSize(round(QFontMetricsF(self._font).horizontalAdvance(self.words)) + 62 + keys, _STOP_HEIGHT)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QStylePainter(self)
        option = QStyleOptionButton()
        self.initStyleOption(option)
        painter.drawControl(QStyle.ControlElement.CE_PushButtonBevel, option)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        ink = QColor(self.theme.on_stop)
        draw_icon(painter, "stop", QRectF(17, self.height() / 2 - 10, 20, 20), ink, 2.0)
        painter.setPen(ink)
        painter.setFont(self._font)
        painter.drawText(QRectF(46, 0, self.width() - 46, self.height()), Qt.AlignmentFlag.AlignVCenter, self.words)
        if self.cap:
            at = QPointF(self.width() - 16 - _cap_size(self.cap).width(), self.height() / 2 - 10)
            _paint_cap(painter, at, self.cap, self.theme.on_stop, self.theme.on_stop)


class IconButton(Themed, PressedByEnter):
    """A square button with only an icon; its text is the accessible name and the tip."""

    def __init__(self, icon: str, name: str, tip: str = "", *, size: int = 44, role: str = "") -> None:
        super().__init__()
        self._icon, self._role = icon, role
        self.setProperty("role", role)
        if size < 42:
            self.setProperty("dense", "true")
        self.setFixedSize(size, size)
        self.setAccessibleName(name)
        self.setToolTip(plain_tip(tip or name))
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def minimumSizeHint(self) -> QSize:
        return self.minimumSize()

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        ink = {"danger": self.theme.bad, "plain": self.theme.text3}.get(self._role, self.theme.text)
        middle, half = QRectF(self.rect()).center(), 10 if self.width() >= 40 else 8
        body = QRectF(middle.x() - half, middle.y() - half, 2 * half, 2 * half)
        painter = QPainter(self)
        if not self.isEnabled():
            ink = self.theme.ctl
            painter.setOpacity(0.5)
        draw_icon(painter, self._icon, body, ink, 2.0)


class Choice(Themed, QComboBox):
    """A drop-down list with a chevron; the wheel scrolls the page, not the choice.

    Text that is too long is elided; the list and the tip show it in full. On Linux, screen readers take the chosen
    entry for the name of the list, and read the real name only from a label, which is invisible here.
    """

    def __init__(self) -> None:
        super().__init__()
        self._name_label = PlainLabel()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)  # by default, scrolling past it with the wheel would focus it
        self.setItemDelegate(QStyledItemDelegate(self))  # the style sheet sets its lines' height

    def setAccessibleName(self, name: str) -> None:
        super().setAccessibleName(name)
        self._name_label.setText(name)
        self._name_label.setBuddy(self)

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ParentChange:
            self._name_label.setParent(self.parentWidget())
            self._name_label.hide()
        return super().event(event)

    def showPopup(self) -> None:
        view = self.view()
        view.setMinimumWidth(max(self.width(), view.sizeHintForColumn(0) + 24))
        super().showPopup()

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()

    def fitted(self, text: str, room_px: int) -> str:
        return self.fontMetrics().elidedText(text, Qt.TextElideMode.ElideRight, room_px)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QStylePainter(self)
        option = QStyleOptionComboBox()
        self.initStyleOption(option)
        painter.drawComplexControl(QStyle.ComplexControl.CC_ComboBox, option)
        text = self.currentText() or self.placeholderText()
        field = QStyle.SubControl.SC_ComboBoxEditField
        width = self.style().subControlRect(QStyle.ComplexControl.CC_ComboBox, option, field, self).width()
        shown_text = self.fitted(text, width + 1)  # Qt rounds the width of the longest entry, perhaps down
        option.currentText = shown_text  # type: ignore[attr-defined]  # missing in the stubs
        painter.drawControl(QStyle.ControlElement.CE_ComboBoxLabel, option)
        self.setToolTip(plain_tip(text if shown_text != text else ""))
        draw_icon(
            painter, "chevron_down", QRectF(self.width() - 30, self.height() / 2 - 8, 16, 16), self.theme.text2, 2.0
        )


class Number(QSpinBox):
    """A whole number that is typed or changed by the arrow keys; the wheel scrolls the page, not the number.

    Qt ignores keys that a whole number cannot contain, so that "2,5" would become 25. This field accepts them; Enter
    rejects such a text, and leaving the field restores the previous number. Both show the reason.
    """

    def __init__(self, lowest: int, highest: int, value: int) -> None:
        super().__init__()
        self._previous = value
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setRange(lowest, highest)
        self.setValue(value)
        self.setFont(font("body", tabular=True))
        self.setButtonSymbols(QSpinBox.ButtonSymbols.NoButtons)

    def validate(self, text: str, position: int) -> object:
        digits = text.removesuffix(self.suffix())
        if digits and not (digits.isascii() and digits.isdecimal()):
            return QValidator.State.Intermediate, text, position
        return super().validate(text, position)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not self.hasAcceptableInput():
            self._show_refusal()
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        self._previous = self.value()
        super().focusInEvent(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()

    def fixup(self, _text: str) -> str:
        self._show_refusal()
        return f"{self._previous}{self.suffix()}"

    @property
    def refusal(self) -> str:
        """The reason why the text in the field is rejected; "" if it is valid."""
        if self.hasAcceptableInput():
            return ""
        return f"“{self.cleanText()}” is not a whole number from {self.minimum()} to {self.maximum()}"

    def _show_refusal(self) -> None:
        QToolTip.showText(self.mapToGlobal(self.rect().bottomLeft()), self.refusal, self)


class Check(Themed, QCheckBox):
    """A check box; both mark and text can be clicked."""

    def sizeHint(self) -> QSize:
        return _marked_size(self)

    def hitButton(self, _place: QPoint) -> bool:
        return True

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter, mark = _begin_mark(self, self.theme)
        painter.setBrush(QColor(self.theme.accent if self.isChecked() else self.theme.surface))
        painter.drawRoundedRect(mark, 5, 5)
        if self.isChecked():
            draw_icon(painter, "check", mark.adjusted(2, 2, -2, -2), self.theme.on_accent, 3.0)


class Toggle(Check):
    """A switch that takes effect at once; both switch and text can be clicked."""

    def sizeHint(self) -> QSize:
        return QSize(round(QFontMetricsF(self.font()).horizontalAdvance(self.text())) + 50, 32)

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = smooth_painter(self)
        painter.setPen(QColor(t.text if self.isEnabled() else t.text3))
        painter.setFont(self.font())
        room = QRectF(46, 0, self.width() - 46, self.height())
        painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, self.text())
        track = QRectF(4, self.height() / 2 - 9, 32, 18)
        painter.setPen(QPen(QColor(t.accent if self.isChecked() else t.ctl), 1.4))
        painter.setBrush(QColor(t.accent if self.isChecked() else t.surface))
        painter.drawRoundedRect(track, 9, 9)
        knob = QRectF(track.right() - 15 if self.isChecked() else track.left() + 3, track.top() + 3, 12, 12)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(t.on_accent if self.isChecked() else t.ctl))
        painter.drawEllipse(knob)
        if self.hasFocus():
            painter.setPen(QPen(QColor(t.accent), 2))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(track.adjusted(-3, -3, 3, 3), 12, 12)


class Radio(Themed, QRadioButton):
    """A radio button; both mark and text can be clicked."""

    def sizeHint(self) -> QSize:
        return _marked_size(self)

    def hitButton(self, _place: QPoint) -> bool:
        return True

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter, mark = _begin_mark(self, self.theme)
        painter.setBrush(QColor(self.theme.surface))
        painter.drawEllipse(mark)
        if self.isChecked():
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(self.theme.accent))
            painter.drawEllipse(mark.center(), 5, 5)


def _marked_size(button: QAbstractButton) -> QSize:
    return QSize(round(QFontMetricsF(button.font()).horizontalAdvance(button.text())) + 36, 32)


def _begin_mark(button: QAbstractButton, theme: Theme) -> tuple[QPainter, QRectF]:
    """Paint the button's text; return the painter with the mark's pen, and the mark's rectangle."""
    painter = QPainter(button)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QColor(theme.text if button.isEnabled() else theme.text3))
    painter.setFont(button.font())
    room = QRectF(32, 0, button.width() - 32, button.height())
    painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, button.text())
    mark = QRectF(4, button.height() / 2 - 9, 18, 18)
    if button.hasFocus():
        painter.setPen(QPen(QColor(theme.accent), 2))
        painter.drawRoundedRect(mark.adjusted(-3, -3, 3, 3), 8, 8)
    painter.setPen(QPen(QColor(theme.accent if button.isChecked() else theme.ctl), 1.4))
    return painter, mark

"""The base of the participant's pages: scale, reading direction, and shared widgets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QAccessible,
    QAccessibleEvent,
    QColor,
    QEnterEvent,
    QFocusEvent,
    QFont,
    QFontMetricsF,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QResizeEvent,
)
from PySide6.QtWidgets import QAbstractButton, QGroupBox, QLineEdit, QPushButton, QRadioButton, QSizePolicy, QWidget

from study_app.gui.key_presses import digit_of
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, font
from study_app.gui.widgets.accessible import button_text
from study_app.gui.widgets.boxes import grid
from study_app.gui.widgets.cards import fill_rounded
from study_app.protocol.wording import Words, words
from study_app.session.pages import Progress

if TYPE_CHECKING:
    Button = QAbstractButton
else:
    Button = object  # Qt permits only one Qt base class

_DESIGNED_FOR = (1366.0, 768.0)
_MOST_SCALE = 2.4
_MOST_TEXT = 2.0


def page_scale(width: float, height: float) -> float:
    """Return the scale of a page in a window of this size [logical px], at least 1."""
    return min(max(min(width / _DESIGNED_FOR[0], height / _DESIGNED_FOR[1]), 1.0), _MOST_SCALE)


def font_scale(width: float, height: float, text_scale: float) -> float:
    """Return the scale of text in a window of this size [logical px]: ``text_scale`` or the page's scale if larger.

    A window smaller than the design size cannot hold text at 200 %; there the text is enlarged as far as possible.
    """
    largest = _MOST_TEXT * min(width / _DESIGNED_FOR[0], height / _DESIGNED_FOR[1])
    return max(page_scale(width, height), min(text_scale, largest))


def _layout_direction(wording: Words) -> Qt.LayoutDirection:
    """Return the layout direction of a language."""
    return Qt.LayoutDirection.RightToLeft if wording.right_to_left else Qt.LayoutDirection.LeftToRight


def line_start(widget: QWidget) -> Qt.AlignmentFlag:
    """Return the alignment of the start of lines in a widget's language."""
    right = widget.layoutDirection() == Qt.LayoutDirection.RightToLeft
    return Qt.AlignmentFlag.AlignAbsolute | (Qt.AlignmentFlag.AlignRight if right else Qt.AlignmentFlag.AlignLeft)


def mirror_rectangle(place: QRectF, width: float) -> QRectF:
    """Return ``place`` mirrored about the middle of a page of ``width``."""
    return QRectF(width - place.right(), place.top(), place.width(), place.height())


def page_painter(widget: QWidget) -> QPainter:
    """Return an antialiasing painter with the widget's layout direction."""
    painter = QPainter(widget)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setLayoutDirection(widget.layoutDirection())
    return painter


@dataclass(frozen=True, slots=True)
class PageContext:
    """The context in which a page is shown.

    Attributes
    ----------
    clock : returns the time of an event when the key or button is pressed [s]
    text_scale : minimum scale of text for this screen and viewing distance
    by_mouse : whether the mouse is the device
    """

    words: Words
    clock: Callable[[], float]
    parent: QWidget | None = None
    text_scale: float = 1.0
    by_mouse: bool = False


class PageWidget(QWidget):
    """A page that fills the participant's window, mirrored in a right-to-left language.

    ``event_made`` carries the session's events.
    """

    event_made = Signal(object)

    def __init__(self, context: PageContext) -> None:
        super().__init__(context.parent)
        self._words = context.words
        self._clock = context.clock
        self._text_scale = context.text_scale
        self.setLayoutDirection(_layout_direction(context.words))
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)

    @property
    def mirrored(self) -> bool:
        return self.layoutDirection() == Qt.LayoutDirection.RightToLeft

    @property
    def font_scale(self) -> float:
        return font_scale(self.width(), self.height(), self._text_scale)

    def lay_out(self, scale: float) -> None:
        """Lay out all parts for the current size; overridden by pages."""

    def focus_first(self) -> None:
        self.setFocus()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.lay_out(page_scale(self.width(), self.height()))

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(PARTICIPANT.window))
        painter.end()


BEGINNING = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)  # mirrored by the painter
_BAR = (40.0, 6.0, 8.0)  # width, height, gap [logical px at scale 1]


def _progress_texts(progress: Progress, wording: Words) -> tuple[str, str]:
    """Return the texts "Part 2 of 2" and "Delay setting 3 of 7"; a single part or setting has no number."""
    has_parts = progress.part is not None and progress.parts > 1
    part = wording.part.format(part=progress.part, parts=progress.parts) if has_parts else ""
    has_settings = progress.label and progress.of > 1
    template = wording.setting_at_most if progress.at_most else wording.setting
    setting = template.format(label=progress.label, of=progress.of) if has_settings else progress.label
    return part, setting


def draw_progress(
    painter: QPainter, room: QRectF, progress: Progress, wording: Words, *, scale: float = 1.0, share: float = 0.5
) -> float:
    """Draw text and bars from the start of a line in ``room``; return the width [px].

    ``share`` is the filled fraction of the current bar: the task is its first half, the questionnaire its second. Bars
    without room are omitted, since the text has the same content, and the text shrinks to fit ``room``.
    """
    flip = wording.right_to_left
    part, setting = _progress_texts(progress, wording)
    x = 0.0
    texts = [
        (text, weight, colour)
        for text, weight, colour in ((part, 600, PARTICIPANT.text), (setting, 400, PARTICIPANT.text2))
        if text
    ]
    widths = [
        QFontMetricsF(font("statement", scale=scale, weight=weight)).horizontalAdvance(text)
        for text, weight, _ in texts
    ]
    if texts:
        scale *= min(1.0, room.width() / (sum(widths) + 14 * scale * len(texts)))
    painter.save()
    painter.setLayoutDirection(Qt.LayoutDirection.RightToLeft if flip else Qt.LayoutDirection.LeftToRight)
    for text, weight, colour in texts:
        painter.setFont(font("statement", scale=scale, weight=weight))
        painter.setPen(QColor(colour))
        wide = QFontMetricsF(painter.font()).horizontalAdvance(text)
        painter.drawText(_rectangle_from_start(room, x, wide + 2, room.height(), flip=flip), BEGINNING, text)
        x += wide + 14 * scale
    x += 10 * scale
    if progress.of > 1 and x + _bars_width(progress.of, scale) <= room.width():
        x = _draw_bars(painter, room, x, progress, scale=scale, share=share, flip=flip)
    painter.restore()
    return x


def _draw_bars(
    painter: QPainter, room: QRectF, x: float, progress: Progress, *, scale: float, share: float, flip: bool
) -> float:
    """Draw a bar for each setting, starting at ``x``; return their end [px from the start of the line]."""
    width, height, gap = (size * scale for size in _BAR)
    painter.setPen(Qt.PenStyle.NoPen)
    for index in range(1, progress.of + 1):
        bar = _rectangle_from_start(room, x, width, height, flip=flip)
        painter.setBrush(QColor(PARTICIPANT.text if index < progress.index else PARTICIPANT.sunk))
        painter.drawRoundedRect(bar, height / 2, height / 2)
        if index == progress.index and share > 0:
            painter.setBrush(QColor(PARTICIPANT.accent))
            filled = _rectangle_from_start(room, x, max(height, width * share), height, flip=flip)
            painter.drawRoundedRect(filled, height / 2, height / 2)
        x += width + gap
    return x - gap


def _bars_width(count: int, scale: float) -> float:
    width, _, gap = (size * scale for size in _BAR)
    return count * (width + gap) - gap


def _rectangle_from_start(room: QRectF, x: float, width: float, height: float, *, flip: bool) -> QRectF:
    """Return a vertically centred rectangle, ``x`` px from the start of the line."""
    left = room.right() - x - width if flip else room.left() + x
    return QRectF(left, room.center().y() - height / 2, width, height)


class ProgressLine(QWidget):
    """The progress at the top of a page, or an empty line of the same height."""

    def __init__(self, progress: Progress | None, wording: Words, share: float, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._progress = progress
        self._words = wording
        self._share = share
        self._scale = 1.0
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        if progress is not None:
            self.setAccessibleName(" · ".join(filter(None, _progress_texts(progress, wording))))
        self.set_scale(1.0)

    def set_scale(self, scale: float) -> None:
        self._scale = scale
        self.setFixedHeight(round(QFontMetricsF(font("statement", scale=scale)).height()))
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self._progress is None:
            return
        painter = page_painter(self)
        draw_progress(painter, QRectF(self.rect()), self._progress, self._words, scale=self._scale, share=self._share)
        painter.end()


_CENTRE = int(Qt.AlignmentFlag.AlignCenter)
_ARROWS = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Left, Qt.Key.Key_Right)
_RING = 4  # space around a button for its focus ring [logical px]
_KEYBOARD_REASONS = (
    Qt.FocusReason.TabFocusReason,
    Qt.FocusReason.BacktabFocusReason,
    Qt.FocusReason.ShortcutFocusReason,
)


def key_size(text: str, scale: float = 1.0) -> tuple[float, float]:
    """Return width and height [px] of a key cap."""
    metrics = QFontMetricsF(font("key", scale=scale))
    height = round(metrics.height() + 5 * scale)
    return max(height, round(metrics.horizontalAdvance(text) + 12 * scale)), height


def draw_key(
    painter: QPainter,
    left: float,
    middle: float,
    text: str,
    scale: float = 1.0,
    *,
    ink: str = PARTICIPANT.text2,
    edge: str = PARTICIPANT.ctl,
    strength: float = 1.0,
) -> float:
    """Draw a key cap from ``left`` around the line ``middle``, its edge at ``strength``; return its width [px]."""
    width, height = key_size(text, scale)
    cap = QRectF(round(left) + 0.5, round(middle - height / 2) + 0.5, width - 1, height - 1)
    line = QColor(edge)
    line.setAlphaF(strength)
    painter.setPen(QPen(line, 1))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRoundedRect(cap, 4 * scale, 4 * scale)
    painter.setFont(font("key", scale=scale))
    painter.setPen(QColor(ink))
    direction = painter.layoutDirection()
    painter.setLayoutDirection(Qt.LayoutDirection.LeftToRight)  # "1–7" is not mirrored
    painter.drawText(cap, _CENTRE, text)
    painter.setLayoutDirection(direction)
    return width


class KeyCap(QWidget):
    """A key cap as a widget."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._text = ""
        self._scale = 1.0

    def show_key(self, text: str, scale: float) -> None:
        self._text, self._scale = text, scale
        width, height = key_size(text, scale)
        self.setFixedSize(round(width) + 2, round(height) + 2)
        self.setVisible(bool(text))
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        draw_key(painter, 1, self.height() / 2, self._text, self._scale)
        painter.end()


class _LitButton(Button):
    """A button that lights up under the pointer and has a focus ring if the keyboard has focused it."""

    ringed = False

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show the focus ring only after keyboard navigation; on a new page, the key cap is sufficient."""
        self.ringed = event.reason() in _KEYBOARD_REASONS
        super().focusInEvent(event)

    def enterEvent(self, event: QEnterEvent) -> None:
        super().enterEvent(event)
        self.update()

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self.update()


class GoButton(_LitButton, QPushButton):
    """The filled button of a participant's page, with its key; never disabled."""

    def __init__(self, text: str, key: str, parent: QWidget | None = None) -> None:
        super().__init__(button_text(text), parent)
        self._label = text
        self._key = key
        self._scale = 1.0
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.setAutoDefault(False)
        self.set_scale(1.0)

    def set_scale(self, scale: float) -> None:
        self._scale = scale
        self.setFont(font("card", scale=scale * 1.0625, weight=500))
        self.setFixedSize(self.sizeHint())
        self.update()

    def sizeHint(self) -> QSize:
        scale = self._scale
        label = QFontMetricsF(self.font()).horizontalAdvance(self._label)
        cap, _ = key_size(self._key, scale)
        width = max(150 * scale, label + cap + (36 + 12 + 28) * scale)
        return QSize(round(width + 2 * _RING), round(48 * scale + 2 * _RING))

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        scale, theme = self._scale, PARTICIPANT
        body = QRectF(self.rect()).adjusted(_RING, _RING, -_RING, -_RING)
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        radius = RADIUS_CONTROL * scale
        lit = self.underMouse() and not self.isDown()
        fill_rounded(painter, body, radius, theme.accent_hover if lit else theme.accent)
        if self.hasFocus() and self.ringed:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(theme.text), 2))
            painter.drawRoundedRect(body.adjusted(-3, -3, 3, 3), radius + 3, radius + 3)
        label = QFontMetricsF(self.font()).horizontalAdvance(self._label)
        cap, _ = key_size(self._key, scale)
        start = body.center().x() - (label + 12 * scale + cap) / 2
        text_x, cap_x = (start + cap + 12 * scale, start) if flip else (start, start + label + 12 * scale)
        painter.setFont(self.font())
        painter.setPen(QColor(theme.on_accent))
        painter.drawText(QRectF(text_x - 1, body.top(), label + 2, body.height()), _CENTRE, self._label)
        ink = theme.on_accent
        draw_key(painter, cap_x, body.center().y(), self._key, scale, ink=ink, edge=ink, strength=0.5)
        painter.end()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave arrow keys to the page, where they scroll or move, instead of moving the focus."""
        if event.key() in _ARROWS:
            event.ignore()
        else:
            super().keyPressEvent(event)


_LEAST_HEIGHT = 44


class LanguageButton(_LitButton, QRadioButton):
    """The button of a language, with a check mark if the page is in it; Enter and Space choose it."""

    def __init__(self, language: str, parent: QWidget) -> None:
        super().__init__(words(language).name, parent)
        self.language = language
        self._scale = 1.0
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setLayoutDirection(
            Qt.LayoutDirection.RightToLeft if words(language).right_to_left else Qt.LayoutDirection.LeftToRight
        )

    def set_scale(self, scale: float) -> None:
        self._scale = scale
        self.setFont(font("body", scale=scale, weight=600 if self.isChecked() else 500))
        self.setFixedSize(self.sizeHint())

    def sizeHint(self) -> QSize:
        wide = QFontMetricsF(self.font()).horizontalAdvance(self.text()) + (30 + 24 * self.isChecked()) * self._scale
        return QSize(round(wide) + 2 * _RING, round(_LEAST_HEIGHT * self._scale) + 2 * _RING)

    def hitButton(self, _place: object) -> bool:
        return True

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.click()
        else:
            super().keyPressEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        theme, scale, radius = PARTICIPANT, self._scale, RADIUS_CONTROL * self._scale
        body = QRectF(self.rect()).adjusted(_RING + 0.5, _RING + 0.5, -_RING - 0.5, -_RING - 0.5)
        painter.setPen(QPen(QColor(theme.text if self.isChecked() else theme.ctl), 1))
        painter.setBrush(QColor(theme.hover if self.underMouse() else theme.surface))
        painter.drawRoundedRect(body, radius, radius)
        if self.hasFocus() and self.ringed:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(theme.accent), 2))
            painter.drawRoundedRect(body.adjusted(-3, -3, 3, 3), radius + 3, radius + 3)
        name = QRectF(body)
        if self.isChecked():
            side = 18 * scale
            mark = QRectF(body.left() + 14 * scale, body.center().y() - side / 2, side, side)
            name.setLeft(mark.right())
            if self.layoutDirection() == Qt.LayoutDirection.RightToLeft:
                mark.moveRight(body.right() - 14 * scale)
                name = QRectF(body.left(), body.top(), mark.left() - body.left(), body.height())
            draw_icon(painter, "check", mark, theme.accent, 2.4)
        painter.setFont(self.font())
        painter.setPen(QColor(theme.text if self.isChecked() else theme.text2))
        painter.drawText(name, _CENTRE, self.text())
        painter.end()


class LanguageSwitch(QGroupBox):
    """A line of buttons for the languages: Tab focuses that of the page, arrows choose a neighbour.

    ``chosen`` carries the code of a language other than the page's.
    """

    chosen = Signal(str)

    def __init__(self, languages: tuple[str, ...], current: str, name: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.buttons = tuple(LanguageButton(language, self) for language in languages)
        for button in self.buttons:
            button.setChecked(button.language == current)
            policy = Qt.FocusPolicy.StrongFocus if button.isChecked() else Qt.FocusPolicy.ClickFocus
            button.setFocusPolicy(policy)  # Qt does this only for buttons checked later
            button.clicked.connect(lambda _=False, code=button.language: self._choose(code, current))

    def set_scale(self, scale: float) -> None:
        x = 0
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        for button in reversed(self.buttons) if flip else self.buttons:
            button.set_scale(scale)
            button.move(x, 0)
            x += button.width() + round(4 * scale)
        self.resize(x - round(4 * scale), self.buttons[0].height())

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint nothing, since the buttons paint themselves."""

    def _choose(self, code: str, current: str) -> None:
        if code != current:
            self.chosen.emit(code)


_DIGITS = ("1", "2", "3", "4", "5", "6", "7", "8", "9", "0")
_DELETE = "⌫"


class DigitPad(QWidget):
    """Keys for digits, then for ``more`` characters, in rows of ``across``, in the same order in every language.

    The keyboard's digit row types digits into ``field`` in every layout; a minus is typed if ``more`` has it.
    """

    def __init__(self, field: QLineEdit, more: tuple[str, ...], across: int, delete_name: str, parent: QWidget) -> None:
        super().__init__(parent)
        self._field = field
        self._characters = (*_DIGITS, *more)
        field.installEventFilter(self)
        self.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        self._grid = grid(margins=0, parent=self)
        self.keys = [QPushButton(text, self) for text in (*self._characters, _DELETE)]
        for index, key in enumerate(self.keys):
            key.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            key.setAccessibleName(delete_name if key.text() == _DELETE else key.text())
            key.clicked.connect(lambda _=False, key=key: self._press_key(key.text()))
            self._grid.addWidget(key, index // across, index % across)

    def set_size(self, width: int, height: int, gap: int, face: QFont) -> None:
        """Set the size of the keys [px]."""
        self._grid.setSpacing(gap)
        for key in self.keys:
            key.setFont(face)
            key.setStyleSheet(f"padding: 0; min-height: {height - 2}px;")
            key.setFixedSize(width, height)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            digit = digit_of(event)
            if digit is not None and event.text() not in self._characters:
                self._field.insert(str(digit))
                return True
        return super().eventFilter(watched, event)

    def _press_key(self, text: str) -> None:
        self._field.setFocus(Qt.FocusReason.MouseFocusReason)
        if text == _DELETE:
            self._field.backspace()
        else:
            self._field.insert(text)


def point_screen_reader_at(widget: QWidget) -> None:
    """Make screen readers announce ``widget``, its name and whether it is checked, although it has no focus."""
    if QAccessible.isActive():
        QAccessible.updateAccessibility(QAccessibleEvent(widget, QAccessible.Event.Focus))

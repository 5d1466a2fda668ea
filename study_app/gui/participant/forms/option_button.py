"""An answer that can be chosen: a radio button, or a check box where several can be."""

from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

from PySide6.QtCore import QEvent, QPoint, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QEnterEvent,
    QFontMetricsF,
    QImage,
    QInputDevice,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
)
from PySide6.QtWidgets import QCheckBox, QRadioButton, QSizePolicy, QWidget

from study_app.gui.participant.forms.question_field import question_of, target_px
from study_app.gui.participant.pages.key_caps import Button
from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, font

CENTRE = int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap)
MARK = 19.0
ROOM = 14.0  # between edge and words
TAKEN = MARK + 6 + ROOM  # of the width, by mark and room
NO_WORDS = "–"
GROWS = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Minimum)
Look: TypeAlias = Literal["words", "point", "off scale"]
"""Words that can be chosen, a point of a scale, or an answer off it, with an edge of dashes."""


@lru_cache(maxsize=1024)
def widest_word(words: str, scale: float) -> float:
    """Return the width of the widest word of an answer [px]; the points of all rows of a page are alike."""
    metrics = QFontMetricsF(font("chosen", scale=scale))
    return max((metrics.horizontalAdvance(word) for word in words.split()), default=0.0)


@lru_cache(maxsize=1024)
def size_of(words: str, scale: float) -> QSize:
    """Return a size that can be hit, as wide as the longest word [px]."""
    least = target_px(scale)
    return QSize(round(max(least, widest_word(words, scale) + TAKEN * scale)), round(least))


@lru_cache(maxsize=1024)
def height_of(words: str, scale: float, width_px: float) -> float:
    """Return the height of an answer that is wrapped at a width [px]."""
    room = QRectF(0, 0, width_px, 1e4)
    return QFontMetricsF(font("chosen", scale=scale)).boundingRect(room, CENTRE, words).height()


class OpenLook(NamedTuple):
    """How an answer looks that is not chosen: in a size [px], perhaps pointed at, or with strong words."""

    words: str
    look: Look
    scale: float
    width: int
    height: int
    pointed: bool
    strong: bool

    def paint(self, painter: QPainter) -> None:
        """Draw it."""
        theme, scale, pointed = PARTICIPANT, self.scale, self.pointed
        inset = 0.75 if pointed else 0.5
        body = QRectF(0, 0, self.width, self.height).adjusted(inset, inset, -inset, -inset)
        edge = QPen(QColor(theme.text if pointed else theme.ctl), 1.5 if pointed else 1.0)
        open_ = self.look == "off scale" and not pointed
        if open_:
            edge.setDashPattern([3, 3])
        painter.setPen(edge)
        painter.setBrush(Qt.BrushStyle.NoBrush if open_ else QColor(theme.hover if pointed else theme.surface))
        painter.drawRoundedRect(body, RADIUS_CONTROL * scale, RADIUS_CONTROL * scale)
        painter.setFont(font("cell", scale=scale))
        painter.setPen(QColor(theme.text if self.strong else theme.text2))
        painter.drawText(body.adjusted(4, 0, -4, 0), CENTRE, self.words)


@lru_cache(maxsize=256)
def picture_of(look: OpenLook, ground: str) -> QImage:
    """Return the picture of an answer on a ground of one colour."""
    made = QImage(look.width, look.height, QImage.Format.Format_RGB32)
    made.fill(QColor(ground))
    painter = QPainter(made)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    look.paint(painter)
    painter.end()
    return made


class OptionLook(Button):
    """How an answer looks: the whole rectangle is clickable; shape, fill and a check mark show that it is chosen.

    ``place`` is its number among the answers of its question, which is notified when the pointer enters and leaves.
    """

    place = -1

    def prepare(self, text: str, name: str, description: str, look: Look = "words") -> None:
        """Show ``text``; a screen reader says ``name`` and ``description``."""
        self._words = text
        self._look = look
        self._scale = 1.0
        self.pointed = False
        self.setAccessibleName(name)
        self.setAccessibleDescription(description)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)  # the question holds the keyboard
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(GROWS)

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        self._scale = scale
        self.updateGeometry()
        self.update()

    def point(self, pointed: bool) -> None:
        """Show that the pointer, or the keyboard's own pointer, is here."""
        if pointed != self.pointed:
            self.pointed = pointed
            self.update()

    def hitButton(self, position: QPoint) -> bool:
        return self.rect().contains(position)

    def sizeHint(self) -> QSize:
        return size_of(self._words, self._scale)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def hasHeightForWidth(self) -> bool:
        """Return that words wrap; points are short."""
        return self._look != "point"

    def heightForWidth(self, width: int) -> int:
        needed = height_of(self._words, self._scale, max(1.0, width - TAKEN * self._scale))
        return round(max(target_px(self._scale), needed + 12 * self._scale))

    def enterEvent(self, event: QEnterEvent) -> None:
        super().enterEvent(event)
        self._tell_pointed(self.place)

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self._tell_pointed(-1)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        super().mouseReleaseEvent(event)
        if event.device().type() == QInputDevice.DeviceType.TouchScreen:
            self._tell_pointed(-1)

    def _tell_pointed(self, place: int) -> None:
        if (question := question_of(self)) is not None:
            question.point(place)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw the answer; a point looks like those of other questions and is drawn once for all of them."""
        painter = page_painter(self)
        in_focus = self._in_focus()
        strong = self._look == "words" or self.pointed or in_focus
        look = OpenLook(self._words, self._look, self._scale, self.width(), self.height(), self.pointed, strong)
        if self.isChecked():
            self._paint_chosen(painter)
        elif self._look == "point" and self.devicePixelRatioF() == 1 and self.window().graphicsProxyWidget() is None:
            question = question_of(self)
            lit = in_focus or (question is not None and question.missing)
            painter.drawImage(0, 0, picture_of(look, PARTICIPANT.selected if lit else PARTICIPANT.window))
        else:
            look.paint(painter)
        painter.end()

    def _in_focus(self) -> bool:
        focused = self.window().focusWidget()
        return focused is not None and focused.isAncestorOf(self)

    def _paint_chosen(self, painter: QPainter) -> None:
        theme, scale = PARTICIPANT, self._scale
        text = "" if self._words == NO_WORDS else self._words
        body = QRectF(self.rect())
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.accent))
        radius = body.height() / 2 if self._look != "words" else min(body.height() / 2, target_px(scale) / 2)
        painter.drawRoundedRect(body, radius, radius)
        face = font("chosen", scale=scale)
        mark = min(MARK * scale, body.width() * 0.34)
        gap = min(6 * scale, body.width() * 0.06) if text else 0.0
        room = QRectF(0, 0, max(1.0, body.width() - mark - gap - ROOM * scale), body.height())
        words = QFontMetricsF(face).boundingRect(room, CENTRE, text).width()
        left = body.center().x() - (mark + gap + words) / 2
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        x_mark, x_words = (left + words + gap, left) if flip else (left, left + mark + gap)
        draw_icon(painter, "check", QRectF(x_mark, body.center().y() - mark / 2, mark, mark), theme.on_accent, 2.4)
        painter.setFont(face)
        painter.setPen(QColor(theme.on_accent))
        painter.drawText(QRectF(x_words - 1, 0, words + 2, body.height()), CENTRE, text)


class RadioOption(OptionLook, QRadioButton):
    """One of several answers."""

    def __init__(
        self, text: str, name: str, description: str, parent: QWidget | None = None, *, look: Look = "words"
    ) -> None:
        super().__init__(parent)
        self.prepare(text, name, description, look)


class CheckOption(OptionLook, QCheckBox):
    """One of several answers that can be given together."""

    def __init__(
        self, text: str, name: str, description: str, parent: QWidget | None = None, *, look: Look = "words"
    ) -> None:
        super().__init__(parent)
        self.prepare(text, name, description, look)

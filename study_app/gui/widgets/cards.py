"""Cards and their contents: hairlines, icons, chips and bars; scroll areas."""

import math

from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import QLayout, QScrollArea, QSizePolicy, QWidget

from study_app.gui.theme.icons import draw_icon, draw_logo
from study_app.gui.theme.theme import RADIUS_CARD, RADIUS_CONTROL, SHADOW, Theme, Tone, font
from study_app.gui.theme.themed import Themed, give_ground
from study_app.gui.widgets.boxes import STRETCH, add_layout, hbox, vbox
from study_app.gui.widgets.labels import Ink, label

QWIDGETSIZE_MAX = (1 << 24) - 1
"""Qt's constant, which PySide does not export."""
_SHADOW_ALPHAS = (5, 5, 4)


class Card(Themed, QWidget):
    """A rounded surface with a column for its content and an optional title, with ``aside`` at its right."""

    def __init__(self, title: str = "", aside: QWidget | None = None, *, padding: int = 20, gap: int = 12) -> None:
        super().__init__()
        side_margin = padding + SHADOW
        top_margin = padding - 2 + SHADOW
        self.column = vbox(spacing=gap, margins=(side_margin, top_margin, side_margin, top_margin), parent=self)
        if title:
            self.heading = label(title, "card")
            self.title_row = hbox(self.heading, STRETCH, *([] if aside is None else [aside]))
            add_layout(self.column, self.title_row)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        body = QRectF(self.rect()).adjusted(SHADOW, SHADOW - 1, -SHADOW, -SHADOW - 1).adjusted(0.5, 0.5, -0.5, -0.5)
        if body.adjusted(RADIUS_CARD, RADIUS_CARD, -RADIUS_CARD, -RADIUS_CARD).contains(QRectF(event.rect())):
            painter.fillRect(event.rect(), QColor(self.theme.surface))
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not self.theme.dark:
            painter.setPen(Qt.PenStyle.NoPen)
            for spread, alpha in enumerate(_SHADOW_ALPHAS, start=1):
                painter.setBrush(QColor(0, 0, 0, alpha))
                grown = body.adjusted(-spread, -spread + 1, spread, spread + 1)
                painter.drawRoundedRect(grown, RADIUS_CARD + spread, RADIUS_CARD + spread)
        painter.setPen(QPen(QColor(self.theme.border), 1))
        painter.setBrush(QColor(self.theme.surface))
        painter.drawRoundedRect(body, RADIUS_CARD, RADIUS_CARD)


def scrolled(content: QWidget | QLayout) -> QScrollArea:
    """Return ``content`` in a scroll area that scrolls only vertically."""
    if isinstance(content, QLayout):
        widget = QWidget()
        widget.setLayout(content)
    else:
        widget = content
    area = QScrollArea(widgetResizable=True)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    area.setWidget(widget)
    return area


def smooth_painter(widget: QWidget) -> QPainter:
    """Return an antialiasing painter for a widget."""
    painter = QPainter(widget)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    return painter


def fill_rounded(painter: QPainter, body: QRectF, radius: float, colour: str) -> None:
    """Fill a rectangle with rounded corners, without an outline."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(colour))
    painter.drawRoundedRect(body, radius, radius)


def paint_ground(widget: QWidget, colour: str) -> None:
    """Paint the background of a widget with rounded corners."""
    fill_rounded(smooth_painter(widget), QRectF(widget.rect()), RADIUS_CONTROL, colour)


class Rule(QWidget):
    """A hairline between groups."""

    def __init__(self) -> None:
        super().__init__()
        give_ground(self, "rule")
        self.setFixedHeight(1)


class Icon(Themed, QWidget):
    """An icon in the colour of a role."""

    def __init__(self, name: str, ink: Ink = "text2", size: int = 20) -> None:
        super().__init__()
        self.name, self.ink = name, ink
        self.setFixedSize(size, size)

    def show_icon(self, name: str, ink: Ink) -> None:
        if (name, ink) != (self.name, self.ink):
            self.name, self.ink = name, ink
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        draw_icon(QPainter(self), self.name, QRectF(self.rect()), getattr(self.theme, self.ink), 2.0)


class Chip(Themed, QWidget):
    """A state as colour, icon and text."""

    def __init__(self, tone: Tone = "neutral", icon: str = "ring", word: str = "", *, small: bool = False) -> None:
        super().__init__()
        self._small = small
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.tone, self.icon, self.word = tone, icon, word
        self.setAccessibleName(word)

    def show_state(self, tone: Tone, icon: str, word: str) -> None:
        if (tone, icon, word) == (self.tone, self.icon, self.word):
            return
        widened = len(word) != len(self.word) or word.rstrip("0123456789. ") != self.word.rstrip("0123456789. ")
        self.tone, self.icon, self.word = tone, icon, word
        self.setAccessibleName(word)
        if widened:
            self.updateGeometry()
        self.update()

    def sizeHint(self) -> QSize:
        return chip_size(self.word, small=self._small)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        body = QRectF(QPointF(), self.sizeHint().toSizeF())
        paint_chip(painter, body, self.theme, self.tone, self.icon, self.word, small=self._small)


def _chip_font(*, small: bool) -> QFont:
    return font("small" if small else "label", weight=500, tabular=True)


def chip_size(word: str, *, small: bool) -> QSize:
    """Return the size of a chip's icon and text."""
    return QSize(round(QFontMetricsF(_chip_font(small=small)).horizontalAdvance(word)) + 40, 24 if small else 28)


def paint_chip(painter: QPainter, body: QRectF, t: Theme, tone: Tone, icon: str, word: str, *, small: bool) -> None:
    """Paint a chip's background, icon and text into ``body``."""
    fills = {"ok": t.ok_bg, "warn": t.warn_bg, "bad": t.bad_bg, "accent": t.selected, "neutral": t.sunk}
    inks = {"ok": t.ok, "warn": t.warn, "bad": t.bad, "accent": t.accent, "neutral": t.text2}
    fill_rounded(painter, body, body.height() / 2, fills[tone])
    draw_icon(painter, icon, QRectF(body.left() + 10, body.center().y() - 7, 14, 14), inks[tone], 2.2)
    painter.setPen(QColor(inks[tone]))
    painter.setFont(_chip_font(small=small))
    painter.drawText(body.adjusted(29, 0, 0, 0), Qt.AlignmentFlag.AlignVCenter, word)


class Bar(Themed, QWidget):
    """A bar that shows a fraction, with an optional tick at the required minimum."""

    def __init__(self, height: int = 8) -> None:
        super().__init__()
        self.share = 0.0
        self.tick: float | None = None
        self._bar = height
        self.setFixedHeight(height + 6)

    def show_share(self, share: float, tick: float | None = None) -> None:
        """Fill ``share`` of the bar (0 to 1); ``tick`` is a position on it (0 to 1) or None."""
        self.share, self.tick = min(1.0, max(0.0, share)), tick
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        painter.setPen(Qt.PenStyle.NoPen)
        track = QRectF(0, 3, self.width(), self._bar)
        radius = self._bar / 2
        painter.setBrush(QColor(self.theme.sunk))
        painter.drawRoundedRect(track, radius, radius)
        if self.share > 0:
            painter.setBrush(QColor(self.theme.accent))
            filled = QRectF(track)
            filled.setWidth(max(self._bar, self.share * self.width()))
            painter.drawRoundedRect(filled, radius, radius)
        if self.tick is not None:
            painter.setPen(QPen(QColor(self.theme.text), 1.6))
            x = self.tick * self.width()
            painter.drawLine(QPointF(x, 0), QPointF(x, self.height()))


class Logo(Themed, QWidget):
    """The program's logo."""

    def __init__(self, size: int = 32) -> None:
        super().__init__()
        self.setFixedSize(size, size)

    def paintEvent(self, _event: QPaintEvent) -> None:
        draw_logo(QPainter(self), QRectF(self.rect()), self.theme.accent, self.theme.on_accent)


class MaskedPanel(Themed, QWidget):
    """A hatched area with a lock, the name of the hidden content, and the reason."""

    def __init__(self, title: str, why: str) -> None:
        super().__init__()
        self._title, self._why = title, why
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName(f"{title}. {why}")

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = smooth_painter(self)
        field = QPainterPath()
        field.addRoundedRect(QRectF(self.rect()), RADIUS_CONTROL, RADIUS_CONTROL)
        painter.fillPath(field, QColor(t.sunk))
        painter.save()
        painter.setClipPath(field)
        painter.setPen(QPen(QColor(t.border), 1))
        height = self.height()
        for x in range(-height, self.width(), 20):
            painter.drawLine(QLineF(x, height, x + height, 0))
        painter.restore()
        title_font, why_font = font("card", scale=0.94), font("label", weight=400)
        block = min(150.0, height - 16.0)
        top = (height - block) / 2
        middle = self.width() / 2
        radius = min(26.0, max(0.0, (block - 70) / 2))
        if radius > 12:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.surface))
            painter.drawEllipse(QRectF(middle - radius, top, 2 * radius, 2 * radius))
            draw_icon(painter, "lock", QRectF(middle - 11, top + radius - 11, 22, 22), t.text)
        lines_top = top + 2 * radius + 14
        painter.setPen(QColor(t.text))
        painter.setFont(title_font)
        wrap = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap
        box = QRectF(12, lines_top, self.width() - 24, height - lines_top)
        title_box = painter.boundingRect(box, int(wrap), self._title)
        painter.drawText(box, int(wrap), self._title)
        painter.setPen(QColor(t.text2))
        painter.setFont(why_font)
        painter.drawText(box.adjusted(0, math.ceil(title_box.height()) + 8, 0, 0), int(wrap), self._why)

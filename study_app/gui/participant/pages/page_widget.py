"""What the participant's pages have in common: how large they are drawn, and in which direction they are read."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.theme.theme import PARTICIPANT

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

DESIGNED_FOR = (1366.0, 768.0)
MOST_SCALE = 2.4
MOST_TEXT = 2.0


def page_scale(width: float, height: float) -> float:
    """Return how much larger than designed a page is drawn in a window of this size [logical px]; never smaller."""
    return min(max(min(width / DESIGNED_FOR[0], height / DESIGNED_FOR[1]), 1.0), MOST_SCALE)


def words_scale(width: float, height: float, text_scale: float) -> float:
    """Return how much larger than designed words are in a window [logical px]: as large as they must be read.

    A window that is smaller than designed holds words of 200 % no more: there they grow as far as it can hold them.
    """
    most = MOST_TEXT * min(width / DESIGNED_FOR[0], height / DESIGNED_FOR[1])
    return max(page_scale(width, height), min(text_scale, most))


def direction(words: Words) -> Qt.LayoutDirection:
    """Return in which direction pages in a language are laid out."""
    return Qt.LayoutDirection.RightToLeft if words.right_to_left else Qt.LayoutDirection.LeftToRight


def beginning(widget: QWidget) -> Qt.AlignmentFlag:
    """Return where lines begin in a widget, in whatever language their words are."""
    right = widget.layoutDirection() == Qt.LayoutDirection.RightToLeft
    return Qt.AlignmentFlag.AlignAbsolute | (Qt.AlignmentFlag.AlignRight if right else Qt.AlignmentFlag.AlignLeft)


def mirrored(place: QRectF, width: float) -> QRectF:
    """Return a place as a mirror in the middle of ``width`` shows it."""
    return QRectF(width - place.right(), place.top(), place.width(), place.height())


def page_painter(widget: QWidget) -> QPainter:
    """Return a painter of a widget that smooths edges and writes in the widget's direction."""
    painter = QPainter(widget)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setLayoutDirection(widget.layoutDirection())
    return painter


class PageWidget(QWidget):
    """A page that fills the participant's window, mirrored in a language that is read from right to left.

    ``event_made`` carries the session's events; their times are ``clock()`` [s] at the moment of the key or the click.
    ``text_scale`` is how much larger than designed words must be at least, for this screen at this distance.
    """

    event_made = Signal(object)

    def __init__(
        self, words: Words, clock: Callable[[], float], parent: QWidget | None = None, *, text_scale: float = 1.0
    ) -> None:
        super().__init__(parent)
        self._words = words
        self._clock = clock
        self._text_scale = text_scale
        self.setLayoutDirection(direction(words))
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)

    @property
    def mirrored(self) -> bool:
        """Whether the page is read from right to left."""
        return self.layoutDirection() == Qt.LayoutDirection.RightToLeft

    @property
    def words_scale(self) -> float:
        """How much larger than designed words are."""
        return words_scale(self.width(), self.height(), self._text_scale)

    def lay_out(self, scale: float) -> None:
        """Place everything for the present size."""

    def focus_first(self) -> None:
        """Put the keyboard where the page begins."""
        self.setFocus()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.lay_out(page_scale(self.width(), self.height()))

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(PARTICIPANT.window))
        painter.end()

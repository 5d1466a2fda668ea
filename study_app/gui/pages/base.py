"""What the participant's pages have in common: they grow with the window and say what happened."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.theme import PARTICIPANT

if TYPE_CHECKING:
    from study_app.protocol.words import Words

DESIGNED_FOR = (1366.0, 768.0)
MOST_SCALE = 2.4


def page_scale(width: float, height: float) -> float:
    """Return how much larger than designed a page is drawn in a window of this size [logical px]; never smaller."""
    return min(max(min(width / DESIGNED_FOR[0], height / DESIGNED_FOR[1]), 1.0), MOST_SCALE)


class PageWidget(QWidget):
    """A page that fills the participant's window.

    ``event_made`` carries the session's events; their times are ``clock()`` [s] at the moment of the key or the click.
    """

    event_made = Signal(object)

    def __init__(self, words: Words, clock: Callable[[], float], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._words = words
        self._clock = clock
        self.setAutoFillBackground(False)

    def lay_out(self, scale: float) -> None:
        """Place everything for the present size."""

    def focus_first(self) -> None:
        """Put the keyboard where the page begins."""
        self.setFocus()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Lay the page out anew."""
        super().resizeEvent(event)
        self.lay_out(page_scale(self.width(), self.height()))

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802
        """Fill the page."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(PARTICIPANT.window))
        painter.end()

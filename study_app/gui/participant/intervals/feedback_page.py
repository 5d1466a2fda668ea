"""Whether an answer was correct: a sign and a word, where the question was; it ends by time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.pages.page_widget import PageWidget
from study_app.gui.participant.pages.reading_page import Badge
from study_app.gui.participant.pages.screen_reader import say
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.accessible import HeadingLabel
from study_app.gui.widgets.boxes import STRETCH, vbox
from study_app.session.pages import FeedbackPage

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

BADGE_SCALE = 1.6
CENTRED = Qt.AlignmentFlag.AlignHCenter


class FeedbackWidget(PageWidget):
    """A check mark and "Right", or a dash and "Not right"."""

    def __init__(
        self,
        page: FeedbackPage,
        words: Words,
        clock: Callable[[], float],
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
    ) -> None:
        super().__init__(words, clock, parent, text_scale=text_scale)
        self._text = words.right if page.right else words.not_right
        self.setAccessibleName(self._text)
        sign, colour = ("check", PARTICIPANT.ok) if page.right else ("minus", PARTICIPANT.text2)
        self._badge, self._word = Badge(sign, colour, self), HeadingLabel(self._text)
        self._word.setStyleSheet(f"color: {PARTICIPANT.text}; background: transparent;")
        badge, word = (self._badge, 0, CENTRED), (self._word, 0, CENTRED)
        self._column = vbox((STRETCH, 2), badge, word, (STRETCH, 3), parent=self)

    def lay_out(self, _scale: float) -> None:
        """Grow with the page."""
        self._badge.set_scale(BADGE_SCALE * self.words_scale)
        self._word.setFont(font("display", scale=self.words_scale))
        self._column.setSpacing(round(14 * self.words_scale))

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        say(self, self._text)

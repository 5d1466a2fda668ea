"""What the pages of one question have in common: the question in the middle, and one answer, given once."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QFont, QShowEvent
from PySide6.QtWidgets import QLabel, QWidget

from study_app.gui.participant.pages.page_widget import PageWidget
from study_app.gui.participant.pages.progress_line import ProgressLine
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, vbox
from study_app.protocol.questions import Value
from study_app.session.pages import DesignPage
from study_app.session.transitions.events import Chosen, ItemShown, Submitted

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

QUESTION_PX = 26
ASKING = 0.8  # share of the present trial's bar that is full


class AnswerPage(PageWidget):
    """The progress, a question and room for its answer below it; ``answer`` answers and continues, once."""

    def __init__(
        self,
        page: DesignPage,
        words: Words,
        clock: Callable[[], float],
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
    ) -> None:
        super().__init__(words, clock, parent, text_scale=text_scale)
        self.page = page
        self._answered = False
        self._progress = ProgressLine(page.progress, words, ASKING, self)
        self.question = QLabel(page.item.text, self)
        self.question.setWordWrap(True)
        self.question.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.setAccessibleName(page.item.text)
        self._column = vbox(self._progress, (STRETCH, 2), self.question, 36, parent=self)

    def lay_out(self, scale: float) -> None:
        """Write the question as large as words must be read."""
        margin = round((40 if self.width() >= 1100 else 24) * scale)
        self._column.setContentsMargins(margin, round(20 * scale), margin, margin)
        self._progress.set_scale(self.words_scale)
        self.question.setFont(sized(QUESTION_PX * self.words_scale))

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.event_made.emit(ItemShown(self._clock(), self.page.item.id))

    def answer(self, value: Value) -> None:
        """Answer and continue; whatever is pressed later is no answer."""
        if self._answered:
            return
        self._answered = True
        self.event_made.emit(Chosen(self._clock(), self.page.item.id, value))
        self.event_made.emit(Submitted(self._clock()))


def sized(pixels: float) -> QFont:
    """Return the font of words of that height [logical px]."""
    made = font("body")
    made.setPixelSize(round(pixels))
    return made

"""On how many parts a page of questions stands: its own layout says so."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.forms.question_form import FormWidget
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.session.pages import QuestionnairePage

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

SMALL_SCREEN: Final = (1366, 768)


def parts_of(page: QuestionnairePage, words: Words, size_px: tuple[int, int] = SMALL_SCREEN) -> int:
    """Return on how many parts a page of questions stands in a window of a size."""
    kind = QuestionnaireWidget if page.labels else FormWidget
    made = kind(page, words, time.monotonic)
    made.resize(*size_px)
    QApplication.sendEvent(made, QResizeEvent(QSize(*size_px), QSize()))  # it is never shown
    found = len(made.parts)
    made.deleteLater()
    return found

"""Which widget draws a page."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize
from PySide6.QtGui import QPixmap, QResizeEvent
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.forms.questions_page import FormWidget
from study_app.gui.participant.intervals.answer_page import ChoiceWidget, FeedbackWidget, NumberWidget
from study_app.gui.participant.pages.page_widget import PageWidget
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.pages.text_page import NoticeWidget, PauseWidget, TextWidget
from study_app.session.pages import (
    ChoicePage,
    EndPage,
    FeedbackPage,
    NumberPage,
    PausePage,
    QuestionnairePage,
    TextPage,
    TroublePage,
)

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

WithoutTank = TextPage | QuestionnairePage | ChoicePage | NumberPage | FeedbackPage | PausePage | TroublePage | EndPage


def page_widget(
    page: WithoutTank,
    words: Words,
    clock: Callable[[], float],
    parent: QWidget,
    old: QWidget,
    text_scale: float,
    *,
    by_mouse: bool,
) -> PageWidget:
    """Return the widget of a page that is not a tank; a pause lies on a picture of the ``old`` one."""
    match page:
        case QuestionnairePage(labels=()):
            return FormWidget(page, words, clock, parent, text_scale=text_scale)
        case QuestionnairePage():
            return QuestionnaireWidget(page, words, clock, parent, text_scale=text_scale)
        case ChoicePage():
            return ChoiceWidget(page, words, clock, parent, text_scale=text_scale)
        case NumberPage():
            return NumberWidget(page, words, clock, parent, text_scale=text_scale)
        case FeedbackPage():
            return FeedbackWidget(page, words, clock, parent, text_scale=text_scale)
        case TextPage():
            return TextWidget(page, words, clock, parent, text_scale=text_scale)
        case PausePage():
            under = _picture(old)
            return PauseWidget(page, words, clock, under=under, parent=parent, text_scale=text_scale, by_mouse=by_mouse)
        case TroublePage() | EndPage():
            return NoticeWidget(page, words, clock, parent, text_scale=text_scale, by_mouse=by_mouse)


def _picture(widget: QWidget) -> QPixmap | None:
    """Return what a page looks like, for the pause to lie on; a pause on a pause shows the first one's ground."""
    if isinstance(widget, PauseWidget):
        return widget.under
    return widget.grab() if widget.width() > 0 else None


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

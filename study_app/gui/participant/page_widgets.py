"""Which widget draws a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.forms.questions_page import FormWidget
from study_app.gui.participant.intervals.answer_page import ChoiceWidget, FeedbackWidget, NumberWidget
from study_app.gui.participant.pages.page_widget import PageContext, PageWidget
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

WithoutTank = TextPage | QuestionnairePage | ChoicePage | NumberPage | FeedbackPage | PausePage | TroublePage | EndPage
WIDGETS: Final[Mapping[type[WithoutTank], Callable[[Any, PageContext], PageWidget]]] = {
    ChoicePage: ChoiceWidget,
    NumberPage: NumberWidget,
    FeedbackPage: FeedbackWidget,
    TextPage: TextWidget,
    TroublePage: NoticeWidget,
    EndPage: NoticeWidget,
}


def page_widget(page: WithoutTank, context: PageContext, old: QWidget) -> PageWidget:
    """Return the widget of a page that is not a tank; a pause lies on a picture of the ``old`` one."""
    if isinstance(page, PausePage):
        return PauseWidget(page, context, _picture(old))
    if isinstance(page, QuestionnairePage):
        return (QuestionnaireWidget if page.labels else FormWidget)(page, context)
    return WIDGETS[type(page)](page, context)


def _picture(widget: QWidget) -> QPixmap | None:
    """Return what a page looks like, for the pause to lie on; a pause on a pause shows the first one's ground."""
    if isinstance(widget, PauseWidget):
        return widget.under
    return widget.grab() if widget.width() > 0 else None

"""The widgets of questions by their ids, found by importing the modules of one folder."""

from typing import Final

from study_app.discovery import modules_of
from study_app.gui.participant import questions
from study_app.gui.participant.forms.question_field import QuestionField

FIELDS: Final[dict[str, type[QuestionField]]] = {
    module.FIELD.widget_id: module.FIELD for module in modules_of(questions) if hasattr(module, "FIELD")
}
"""Every widget by the id that a question names it by."""

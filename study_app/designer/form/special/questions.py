"""The questions of a questionnaire, with their texts in each language side by side."""

from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QBoxLayout

from study_app.designer.form.form_rows import FormRow
from study_app.designer.form.question_rows import QuestionRows
from study_app.designer.form.row_fields import Field, add_button
from study_app.designer.form.special_editor import SpecialEditor
from study_app.designer.place.requests import AddElement
from study_app.gui.kit.commands import with_key


class QuestionsField(Field):
    """The questions, in their order; each is moved, copied and deleted in its own form."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.rows = QuestionRows(row.facts.lines, row.facts.languages)
        self.rows.write_asked.connect(self.write_asked)
        self.rows.join_asked.connect(self.join_asked)
        self.add = add_button(f"Add to {row.row.label}", "Question")
        self.add.setToolTip(with_key("Add a question", "add"))
        self.add.clicked.connect(lambda: self.asked.emit(AddElement(self.row.row.path)))
        self.box.addWidget(self.rows)
        self.box.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        self.setFocusProxy(self.rows.rows[0].open if self.rows.rows else self.add)

    def show_value(self) -> None:
        """Do nothing: other questions make another field."""


def _shown(row: FormRow) -> object:
    return row.facts


EDITOR: Final = SpecialEditor((("Questionnaire", "items"),), QuestionsField, wide=True, structure=_shown)

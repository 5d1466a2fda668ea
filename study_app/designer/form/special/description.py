"""The description of the study: a plain text in as many lines as it takes, at most three."""

from typing import Final

from study_app.designer.form.form_rows import FormRow
from study_app.designer.form.row_fields import Field
from study_app.designer.form.special_editor import SpecialEditor
from study_app.designer.form.typed_fields import TypedSentence


class DescriptionField(Field):
    """A plain text; what is longer than three lines scrolls."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.line = TypedSentence(row.row.label, most_lines=3)
        self.line.typed.connect(lambda text: self.set_value(text, typing=True))
        self.line.came.connect(self.came)
        self.box.addWidget(self.line)
        self.setFocusProxy(self.line)
        self.show_value()

    def show_value(self) -> None:
        value = self.row.row.value
        self.line.show_text(value if isinstance(value, str) else "")


EDITOR: Final = SpecialEditor((("StudyHead", "description"),), DescriptionField)

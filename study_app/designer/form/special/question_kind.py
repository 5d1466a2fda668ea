"""The kind of a question: all kinds side by side where there is room, else in a list."""

from typing import Any, Final

from PySide6.QtCore import QSize
from PySide6.QtGui import QResizeEvent

from study_app.designer.form.facts.questions import STATEMENT
from study_app.designer.form.form_rows import FormRow, choice_words
from study_app.designer.form.row_fields import ChoiceField
from study_app.designer.form.special.long_texts import QUESTIONS
from study_app.designer.form.special_editor import SpecialEditor
from study_app.designer.place.segments import Segments

NARROWEST = 120


class KindField(ChoiceField):
    """A statement has no kind in the file."""

    def __init__(self, row: FormRow) -> None:
        self.all: Segments | None = None
        super().__init__(row)
        self.all = Segments(row.row.label)
        self.all.chosen.connect(self._choose_other)
        self.box.addWidget(self.all)
        self.box.addStretch()
        self.show_value()
        self._make_room()

    def words(self, choice: Any) -> str:
        """Return what a kind is called."""
        return STATEMENT.capitalize() if choice.value is None else choice_words(choice, None)

    def show_value(self) -> None:
        super().show_value()
        if self.all is not None:
            kinds = [(choice.value, self.words(choice)) for choice in self.row.row.choices]
            self.all.show_values(kinds, self.row.row.value)

    def _choose_other(self, kind: Any) -> None:
        if kind != self.row.row.value:
            self._choose(kind)

    def _make_room(self) -> None:
        if self.all is not None and self.list is not None:
            fits = self.width() >= self.all.sizeHint().width()
            self.all.setVisible(fits)
            self.list.setVisible(not fits)
            self.setFocusProxy(self.all if fits else self.list)

    def minimumSizeHint(self) -> QSize:
        return QSize(NARROWEST, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._make_room()


EDITOR: Final = SpecialEditor(tuple((kind, "kind") for kind in QUESTIONS), KindField, wide=True, labelled=False)

"""Editors of values that may be of several kinds, and which editor a row has."""

from dataclasses import replace

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QBoxLayout

from study_app.designer.form.entries import EntriesField, EntryList, LanguageListField, LinesField
from study_app.designer.form.form_rows import STUDY_LANGUAGES, FormRow
from study_app.designer.form.languages_field import LanguagesField
from study_app.designer.form.row_fields import ChecksField, ChoiceField, Field, LineField, SwitchField, UnknownField
from study_app.designer.place.segments import Segments

KINDS = {
    "numbers": "Numbers", "vector": "Numbers", "number": "One number", "whole number": "One number", "text": "Text",
    "choices": "Chosen", "choice": "Automatic", "texts": "Texts", "references": "Named", "reference": "Named",
    "table": "Table", "list": "List", "points": "Points", "localised": "Text", "switch": "Yes or no",
}  # fmt: skip
"""What the kinds of a value that may be of several are called."""


class EitherField(Field):
    """A value of one of several kinds: the kind, then its editor."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.kinds = Segments(f"{row.row.label}, kind")
        self.kinds.chosen.connect(self._switch)
        self.box.addWidget(self.kinds, 0, Qt.AlignmentFlag.AlignLeft)
        self.inner = field(self._chosen(row))
        self.inner.asked.connect(self.asked)
        self.inner.open_asked.connect(self.open_asked)
        self.inner.copy_asked.connect(self.copy_asked)
        if isinstance(self.inner, EntryList):
            self.inner.changes.connect(lambda asked, _after: self.asked.emit(asked))
        self.inner.came.connect(self.came)
        self.box.addWidget(self.inner)
        self.setFocusProxy(self.inner)
        self.show_value()

    def show_row(self, row: FormRow) -> None:
        """Show the value in the editor of its kind."""
        self.inner.show_row(self._chosen(row))
        super().show_row(row)

    def show_value(self) -> None:
        """Show which kind the value is of."""
        values = [(at, KINDS.get(one.kind, one.kind)) for at, one in enumerate(self.row.row.either)]
        self.kinds.show_values(values, self.row.number)

    def _chosen(self, row: FormRow) -> FormRow:
        return replace(row, row=row.row.either[row.number or 0])

    def _switch(self, at: int) -> None:
        """Ask for a value of another kind, made of the one there is as far as that goes."""
        if at == self.row.number:
            return
        to, value = self.row.row.either[at], self.row.row.value
        first = value[0] if isinstance(value, tuple) and value else value
        if to.kind in {"choice", "reference"}:
            self.set_value(to.choices[0].value if to.choices else "")
        elif to.kind == "choices":
            self.set_value([choice.value for choice in to.choices][:1])
        elif to.kind in {"number", "whole number"}:
            self.set_value(first if isinstance(first, int | float) else 1)
        elif to.kind in {"numbers", "vector"}:
            self.set_value([value] if isinstance(value, int | float) else [1])
        else:
            self.set_value(str(first))


def field(row: FormRow) -> Field:
    """Return the editor of a row."""
    kind = row.row.kind
    if kind in {"localised", "paragraphs"}:
        return LanguagesField(row)
    if kind == "switch":
        return SwitchField(row)
    if kind in {"choice", "kind", "reference"}:
        return ChoiceField(row)
    if kind == "choices":
        return ChecksField(row)
    if row.row.path == STUDY_LANGUAGES:
        return LanguageListField(row)
    if kind in {"texts", "points"}:
        return LinesField(row)
    if kind in {"references", "list", "tables"}:
        return EntriesField(row)
    if kind == "either":
        return EitherField(row)
    return LineField(row) if kind not in {"unknown", "table"} else UnknownField(row)


def structure(row: FormRow) -> object:
    """Return what makes another editor of a row necessary."""
    inner = row.row.either[row.number or 0].kind if row.row.either else ""
    count = len(row.row.value) if isinstance(row.row.value, tuple) and (row.row.kind, inner) != ("", "") else 0
    counted = count if row.row.kind in {"texts", "points"} or inner in {"texts", "points"} else 0
    choices = tuple(choice.value for choice in row.row.choices) if row.row.kind != "reference" else ()
    within = (row.row.path[:1], row.row.path[2:])  # a renamed element keeps its editors
    return within, row.row.kind, inner, counted, choices, row.languages, row.entries, row.removable, row.instead

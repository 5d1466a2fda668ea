"""Editors of lists: entries that are opened, moved, removed and added; and of values that may be of several kinds."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QBoxLayout

from study_app.gui.designer.form.entry_row import EntryRow
from study_app.gui.designer.form.language_list import LanguageListField
from study_app.gui.designer.form.languages_field import LanguagesField
from study_app.gui.designer.form.row_fields import (
    ChecksField,
    ChoiceField,
    Field,
    LineField,
    LinesField,
    SwitchField,
    UnknownField,
    add_button,
)
from study_app.gui.designer.form.typed_fields import FIELD_PX
from study_app.gui.designer.segments import Segments
from study_app.gui.theme.theme import font
from study_app.gui.widgets.controls import Choice
from study_app.viewmodels.designer.form_rows import STUDY_LANGUAGES, Entry, FormRow, new_words
from study_app.viewmodels.designer.requests import AddElement, AddEntry, AddNamed, MoveEntry, Paste, RemoveKey

KINDS = {
    "numbers": "Numbers", "vector": "Numbers", "number": "One number", "whole number": "One number", "text": "Text",
    "choices": "Chosen", "choice": "Automatic", "texts": "Texts", "references": "Named", "reference": "Named",
    "table": "Table", "list": "List", "points": "Points", "localised": "Text", "switch": "Yes or no",
}  # fmt: skip
"""What the kinds of a value that may be of several are called."""


class EntriesField(Field):
    """References, tables in a list, or tables by name."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.setSpacing(6)
        self.rows: list[EntryRow] = []
        kind, count = row.row.kind, len(row.entries)
        for at, entry in enumerate(row.entries):
            shown = self.entry_row(entry, f"{row.row.label}, {entry.title}, {at + 1} of {count}", grip=kind != "tables")
            shown.dragged.connect(lambda y, at=at: self._drag(at, y))
            shown.dropped.connect(lambda at=at: self._drop(at))
            shown.copy_asked.connect(lambda path=entry.path: self.copy_asked.emit(path))
            shown.pasted.connect(lambda text, path=entry.path: self.asked.emit(Paste(path, text)))
            shown.moved.connect(lambda by, path=entry.path, at=at: self._move(path, at + by))
            if kind != "tables":
                for by, icon, word in ((-1, "arrow_up", "up"), (1, "arrow_down", "down")):
                    button = shown.button(icon, f"Move {entry.title} {word}")
                    button.setEnabled(0 <= at + by < count)
                    button.clicked.connect(
                        lambda _checked=False, path=entry.path, to=at + by: self.asked.emit(MoveEntry(path, to))
                    )
            opens = shown.button("arrow_right", f"Open {entry.title}")
            opens.clicked.connect(lambda _checked=False, path=entry.path: self.open_asked.emit(path))
            if kind != "tables":
                away = shown.button("cross", f"Remove {entry.title} from {row.row.label}")
                away.clicked.connect(lambda _checked=False, path=entry.path: self.asked.emit(RemoveKey(path)))
            self.rows.append(shown)
            self.box.addWidget(shown)
        self.add = add_button(f"Add to {row.row.label}", "Add")
        self.names = Choice()
        self.names.setProperty("dense", "true")
        self.names.setFont(font("label", weight=400))
        self.names.setFixedHeight(FIELD_PX)
        self.names.setAccessibleName(f"Add to {row.row.label}")
        self.names.setPlaceholderText("Add …")
        self.names.activated.connect(self._add_name)
        chooses = kind == "references"
        self.box.addWidget(self.names if chooses else self.add, 0, Qt.AlignmentFlag.AlignLeft)
        (self.add if chooses else self.names).setParent(None)
        self.add.clicked.connect(lambda: self.asked.emit(AddElement(self.row.row.path)))
        self._target: int | None = None
        if chooses:
            self.names.addItems([str(choice.value) for choice in row.row.choices])
            for section in row.row.sections:
                self.names.addItem(new_words(section), section)
            self.names.setCurrentIndex(-1)
            self.names.setEnabled(bool(self.names.count()))
        self.setFocusProxy(self.names if chooses else self.add)
        self.show_value()

    def entry_row(self, entry: Entry, words: str, *, grip: bool) -> EntryRow:
        """Return the row of an entry, to which its buttons are added."""
        return EntryRow(entry, words, grip=grip)

    def show_value(self) -> None:
        """Do nothing: other entries make another field."""

    def _add_name(self, at: int) -> None:
        name, section = self.names.itemText(at), self.names.itemData(at)
        self.names.setCurrentIndex(-1)
        path = self.row.row.path
        self.asked.emit(AddEntry(path, name) if section is None else AddNamed(path, section))

    def _move(self, path: tuple[str | int, ...], to: int) -> None:
        if 0 <= to < len(self.rows):
            self.asked.emit(MoveEntry(path, to))

    def _drag(self, _at: int, y: int | None) -> None:
        """Show where a dragged entry would come; None cancels."""
        self._target = None if y is None else sum(row.geometry().center().y() < y for row in self.rows)
        self.update()

    def _drop(self, at: int) -> None:
        target, self._target = self._target, None
        self.update()
        if target is not None and target not in {at, at + 1}:
            self._move(self.row.entries[at].path, target - (target > at))

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the line where a dragged entry would come."""
        if self._target is not None and self.rows:
            last = self._target == len(self.rows)
            row = self.rows[-1 if last else self._target].geometry()
            y = row.bottom() + 3 if last else row.top() - 3
            QPainter(self).fillRect(QRectF(0, y - 1, self.width(), 2), QColor(self.rows[0].theme.accent))


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
    return row.row.path, row.row.kind, inner, counted, choices, row.languages, row.entries, row.removable, row.instead

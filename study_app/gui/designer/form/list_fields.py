"""Editors of lists: entries that are opened, moved, removed and added; and of values that may be of several kinds."""

from contextlib import suppress
from dataclasses import replace
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QBoxLayout

from study_app.gui.designer.form.entry_list import EntryList
from study_app.gui.designer.form.entry_row import EntryRow
from study_app.gui.designer.form.language_list import LanguageListField
from study_app.gui.designer.form.languages_field import LanguagesField
from study_app.gui.designer.form.row_fields import (
    ChecksField,
    ChoiceField,
    Field,
    LineField,
    SwitchField,
    UnknownField,
    add_button,
    kept,
    written,
)
from study_app.gui.designer.form.typed_fields import FIELD_PX, TypedLine
from study_app.gui.designer.segments import Segments
from study_app.gui.theme.theme import font
from study_app.gui.widgets.controls import Choice
from study_app.number_text import typed_numbers
from study_app.viewmodels.designer.form.form_rows import STUDY_LANGUAGES, Entry, FormRow
from study_app.viewmodels.designer.form.form_words import new_words
from study_app.viewmodels.designer.requests import AddElement, AddEntry, AddNamed, SetValue, Several

KINDS = {
    "numbers": "Numbers", "vector": "Numbers", "number": "One number", "whole number": "One number", "text": "Text",
    "choices": "Chosen", "choice": "Automatic", "texts": "Texts", "references": "Named", "reference": "Named",
    "table": "Table", "list": "List", "points": "Points", "localised": "Text", "switch": "Yes or no",
}  # fmt: skip
"""What the kinds of a value that may be of several are called."""


class EntriesField(EntryList):
    """References, tables in a list, or tables by name."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        kind, count = row.row.kind, len(row.entries)
        for at, entry in enumerate(row.entries):
            words = f"{row.row.label}, {entry.title}, {at + 1} of {count}"
            shown = self.entry_row(entry, words, grip=kind != "tables")
            if kind != "tables":
                for by, icon, word in ((-1, "arrow_up", "up"), (1, "arrow_down", "down")):
                    button = shown.button(icon, f"Move {entry.title} {word}", word)
                    button.setEnabled(0 <= at + by < count)
                    to = at - 1 if by < 0 else at + 2
                    button.clicked.connect(lambda _checked=False, at=at, to=to: self.move_entries((at,), to))
            opens = shown.button("arrow_right", f"Open {entry.title}", "open entry")
            opens.setEnabled(bool(entry.target))
            opens.clicked.connect(lambda _checked=False, at=at: self._open(at))
            shown.opened.connect(lambda at=at: self._open(at))
            if kind != "tables":
                away = shown.button("cross", f"Remove {entry.title} from {row.row.label}", "delete")
                away.clicked.connect(lambda _checked=False, at=at: self.remove((at,)))
            self.add_row(shown)
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

    def place(self, at: int) -> tuple[str | int, ...]:
        """Return the place of an entry in the study."""
        return self.row.entries[at].path

    def _open(self, at: int) -> None:
        if target := self.row.entries[at].target:
            self.open_asked.emit(target)

    def _add_name(self, at: int) -> None:
        name, section = self.names.itemText(at), self.names.itemData(at)
        self.names.setCurrentIndex(-1)
        path = self.row.row.path
        self.asked.emit(AddEntry(path, name) if section is None else AddNamed(path, section))


class LinesField(EntryList):
    """Texts, or points, one in each line, with a button that adds one."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.lines: list[TypedLine] = []
        count = len(row.row.value or ())
        for at in range(count):
            name = f"{row.row.label} {at + 1}"
            shown = EntryRow(Entry((*row.row.path, at), ""), f"{name} of {count}", grip=True)
            shown.title.hide()
            line = TypedLine(name)
            line.typed.connect(lambda text, at=at: self._take(at, text))
            line.came.connect(self.came)
            shown.row.addWidget(line, 1)
            away = shown.button("cross", f"Remove {name}", "delete")
            away.clicked.connect(lambda _checked=False, at=at: self.remove((at,)))
            self.add_row(shown)
            self.lines.append(line)
        self.add = add_button(f"Add to {row.row.label}")
        self.add.clicked.connect(lambda: self.asked.emit(AddEntry(self.row.row.path)))
        self.box.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        self.setFocusProxy(self.lines[0] if self.lines else self.add)
        self.show_value()

    def show_value(self) -> None:
        for line, value in zip(self.lines, self.row.row.value or (), strict=False):
            if not line.property("state"):
                line.show_text(written(value))

    def copy(self, indexes: tuple[int, ...]) -> None:
        """Put entries on the clipboard, one in each line."""
        QGuiApplication.clipboard().setText("\n".join(self.lines[at].words() for at in indexes))

    def paste(self, at: int, text: str) -> None:
        """Ask to add each line of a text after an entry."""
        del at
        with suppress(ValueError):  # another text than points
            added = tuple(AddEntry(self.row.row.path, self._value(line)) for line in text.splitlines() if line.strip())
            after = tuple(range(len(self.lines), len(self.lines) + len(added)))
            self.changes.emit(Several(f"Paste into {self.row.row.label}", added), after)

    def _value(self, text: str) -> Any:
        """Return the value that a line says; a ValueError says why it is not a point."""
        if self.row.row.kind == "texts":
            return text
        return [number for _, number in typed_numbers(text)]

    def _take(self, at: int, text: str) -> None:
        self.refusal, value = "", None
        try:
            value = self._value(text)
        except ValueError as unclear:
            self.refusal = f"{unclear}. {kept(self.row.row.value[at])}"
        self.lines[at].show_refused(bool(self.refusal))
        self.came.emit()
        if not self.refusal:
            self.asked.emit(SetValue((*self.row.row.path, at), value, typing=True))


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
        self.inner.show_row(self._chosen(row))
        super().show_row(row)

    def show_value(self) -> None:
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

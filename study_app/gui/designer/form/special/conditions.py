"""The conditions of a block, each with its liquid, its delay and its force."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from PySide6.QtCore import Qt

from study_app.gui.designer.form.entry_row import EntryRow
from study_app.gui.designer.form.list_fields import EntriesField
from study_app.gui.designer.form.special_editor import SpecialEditor
from study_app.gui.widgets.labels import Elided, figures
from study_app.viewmodels.designer.form.form_rows import Entry
from study_app.viewmodels.designer.special.conditions import CAPTION, ConditionLine

FORCE_PX = 52


class ConditionRow(EntryRow):
    """One condition: title, liquid and delay, force, and a button that opens the liquid."""

    def __init__(self, entry: Entry, words: str, *, grip: bool) -> None:
        super().__init__(replace(entry, note=""), words, grip=grip)
        self.note, self.force = Elided("small", "text2"), figures()
        self.force.setMinimumWidth(FORCE_PX)
        self.force.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.note.setAlignment(self.force.alignment())
        self.row.addWidget(self.note)  # whole: the title gives way
        self.row.addWidget(self.force)
        self.liquid = self.button("drop", f"Open the liquid of {entry.title}")

    def show_line(self, line: ConditionLine) -> None:
        """Show what is known of the condition."""
        self.note.show_text(line.note)
        self.force.setText(f"{line.force}, clipped" if line.clipped else line.force)
        self.liquid.setEnabled(line.liquid is not None)


class ConditionsField(EntriesField):
    """The conditions, in their order."""

    caption = CAPTION

    def entry_row(self, entry: Entry, words: str, *, grip: bool) -> EntryRow:
        """Return the row of a condition."""
        made, at = ConditionRow(entry, words, grip=grip), len(self.rows)
        made.liquid.clicked.connect(lambda: self.open_asked.emit(self.row.facts[at].liquid))
        return made

    def show_value(self) -> None:
        """Show what is known of each condition."""
        for shown, line in zip(self.rows, self.row.facts, strict=True):
            if isinstance(shown, ConditionRow):
                shown.show_line(line)


EDITOR: Final = SpecialEditor((("Block", "conditions"),), ConditionsField, wide=True)

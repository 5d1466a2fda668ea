"""The conditions of a block, each with its liquid, its delay and its force."""

from dataclasses import replace
from typing import Final

from PySide6.QtCore import Qt

from study_app.gui.designer.form.entry_row import EntryRow
from study_app.gui.designer.form.list_fields import EntriesField
from study_app.gui.designer.form.row_fields import add_button
from study_app.gui.designer.form.special_editor import SpecialEditor
from study_app.gui.widgets.boxes import STRETCH, add_layout, hbox
from study_app.gui.widgets.labels import Elided, figures
from study_app.viewmodels.designer.form.form_rows import Entry, FormRow
from study_app.viewmodels.designer.keys import tip
from study_app.viewmodels.designer.requests import AskSeries
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
        self.note.show_text(line.note)
        self.force.setText(f"{line.force}, clipped" if line.clipped else line.force)
        self.liquid.setEnabled(line.liquid is not None)


class ConditionsField(EntriesField):
    """The conditions, in their order."""

    caption = CAPTION

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.series = add_button(f"Series of {row.row.label.lower()}", "Series …")
        self.series.setToolTip(tip("series"))
        self.series.setEnabled(bool(row.entries))
        self.series.clicked.connect(self._ask_for_series)
        self.box.removeWidget(self.names)
        add_layout(self.box, hbox(self.names, self.series, STRETCH))

    def _ask_for_series(self) -> None:
        """Ask for a series of the selected condition, or of the last one."""
        path = self.row.entries[self.chosen[0] if len(self.chosen) == 1 else -1].target
        if path:
            self.asked.emit(AskSeries(path))

    def entry_row(self, entry: Entry, words: str, *, grip: bool) -> EntryRow:
        """Return the row of a condition."""
        made, at = ConditionRow(entry, words, grip=grip), len(self.rows)
        made.liquid.clicked.connect(lambda: self.open_asked.emit(self.row.facts[at].liquid))
        return made

    def show_value(self) -> None:
        for shown, line in zip(self.rows, self.row.facts, strict=True):
            if isinstance(shown, ConditionRow):
                shown.show_line(line)


EDITOR: Final = SpecialEditor((("Block", "conditions"),), ConditionsField, wide=True)

"""A measured number with its unit: typed, taken if it is in range, and forgotten where the field is emptied."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.labels import label, set_ink
from study_app.gui.widgets.number_field import NumberField, write_number

LEAST_WORDS = 280  # narrower, wrapped words would ask for room that they do not need


class Measure(QWidget):
    """A name, a field and a unit, and a line below; ``entered`` carries the number, None where it was emptied."""

    entered = Signal(object)

    def __init__(self, name: str, unit: str, limits: tuple[float, float]) -> None:
        super().__init__()
        self.name, self.unit, self.limits = name, unit, limits
        self._hint = ""
        self.field = NumberField()
        self.field.setFixedWidth(96)
        self.field.setAccessibleName(f"{name} in {unit}")
        named = label(name, "label", "text")
        named.setBuddy(self.field)
        self.below = label("", "small", "text2", wraps=True)
        behind = label(unit, "label", "text2")
        behind.setFixedWidth(28)
        row = hbox((named, 1), self.field, behind, spacing=8)
        vbox(row, self.below, spacing=2, margins=0, parent=self)
        self.below.setFont(font("small"))
        self.below.setMinimumWidth(LEAST_WORDS)
        self.field.entered.connect(self._take)
        self.field.unread.connect(self._unread)
        self.field.abandoned.connect(lambda: self._say("", bad=False))

    def show_value(self, value: float | None, hint: str) -> None:
        """Show a number, or an empty field; ``hint`` stands below."""
        self._hint = hint
        self.field.show_text("" if value is None else write_number(value, 1))
        if self.field.state != "refused":
            self._say("", bad=False)

    def _take(self, value: float) -> None:
        least, most = self.limits
        if not least <= value <= most:
            self._refuse()
            return
        self._say("", bad=False)
        self.entered.emit(value)

    def _unread(self, text: str) -> None:
        if text.strip():
            self._refuse()
            return
        self.field.setModified(False)
        self._say("", bad=False)
        self.entered.emit(None)

    def _refuse(self) -> None:
        least, most = self.limits
        self._say(f"A number from {least:g} to {most:g} {self.unit}; leave empty if unknown.", bad=True)

    def _say(self, words: str, *, bad: bool) -> None:
        self.field.show_state("refused" if bad else "")
        self.below.setText(words or self._hint)
        set_ink(self.below, "bad" if bad else "text2")
        self.below.setVisible(bool(words or self._hint))

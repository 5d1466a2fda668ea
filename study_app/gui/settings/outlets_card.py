"""The card of the machine's place that sets what sessions send to other programs."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QLineEdit

from study_app.gui.settings.measured_number import LEAST_WORDS
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import add_parts
from study_app.gui.widgets.cards import Card, Rule
from study_app.gui.widgets.controls import Choice, Toggle
from study_app.gui.widgets.labels import label, set_ink
from study_app.outlets.session_outlets import is_port
from study_app.store.workstation import MachineSettings

SAMPLES = (
    ("off", "Off"),
    ("single-blind", "On, but off in double-blind studies"),
    ("always", "On, also in double-blind studies"),
)
HINT = "One byte per event: serial:/dev/ttyUSB0, serial:COM3 or parallel:/dev/parport0. Leave empty for none."


class OutletsCard(Card):
    """Markers and samples over the Lab Streaming Layer, and the port of triggers."""

    changed = Signal(str, object)

    def __init__(self) -> None:
        super().__init__("Other programs", gap=10)
        self.markers = Toggle("Markers over the Lab Streaming Layer (LSL)")
        self.markers.setFont(font("body"))
        self.samples = Choice()
        self.samples.setFont(font("body"))
        for choice, words in SAMPLES:
            self.samples.addItem(words, choice)
        self.triggers = QLineEdit()
        self.triggers.setFont(font("body"))
        self.below = label("", "small", "text2", wraps=True)
        self.below.setMinimumWidth(LEAST_WORDS)
        named = [label(words, "label", "text2") for words in ("Samples of position and force over LSL", "Trigger port")]
        for name, field in zip(named, (self.samples, self.triggers), strict=True):
            name.setBuddy(field)
            field.setAccessibleName(name.text())
        self.markers.clicked.connect(lambda on: self.changed.emit("lsl_markers", on))
        self.samples.activated.connect(lambda _index: self.changed.emit("lsl_samples", self.samples.currentData()))
        self.triggers.editingFinished.connect(self._take)
        add_parts(self.column, self.markers, named[0], self.samples, Rule(), named[1], self.triggers, self.below)

    def show_settings(self, settings: MachineSettings) -> None:
        """Show what is set."""
        self.markers.setChecked(settings.lsl_markers)
        self.samples.setCurrentIndex(self.samples.findData(settings.lsl_samples))
        if not self.triggers.isModified():
            self.triggers.setText(settings.triggers)
            self._say(refused=False)

    def _take(self) -> None:
        """Set the port that was typed, or say that it is not the address of one."""
        if not self.triggers.isModified():
            return
        typed = self.triggers.text().strip()
        understood = not typed or is_port(typed)
        self._say(refused=not understood)
        if understood:
            self.triggers.setModified(False)
            self.changed.emit("triggers", typed)

    def _say(self, *, refused: bool) -> None:
        self.below.setText(f"This is not the address of a port. {HINT}" if refused else HINT)
        set_ink(self.below, "bad" if refused else "text2")
        self.triggers.setProperty("state", "refused" if refused else "")
        self.triggers.style().unpolish(self.triggers)
        self.triggers.style().polish(self.triggers)

"""A row for each device: whether it is the one to begin with, its state, what it can do, and why it cannot be used."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.cards import Card, Chip, Rule
from study_app.gui.widgets.controls import ActionButton, Radio
from study_app.gui.widgets.labels import label, set_ink
from study_app.viewmodels.device_list import DeviceShown

LEAST_WORDS = 280  # narrower, wrapped words would ask for room that they do not need
INSET = 30  # behind a radio's mark


class DeviceRow(QWidget):
    """One device; ``diagnose_asked`` carries its name."""

    diagnose_asked = Signal(str)

    def __init__(self, shown: DeviceShown) -> None:
        super().__init__()
        self.name = shown.name
        self.title: Radio | QLabel = Radio(shown.title) if shown.choosable else label(shown.title, "strong")
        self.title.setFont(font("strong"))
        self.chip = Chip(small=True)
        self.can = _words("text2")
        self.why = _words("warn")
        self.by = _words("text3", small=True)
        self.diagnose = ActionButton("pulse", "Diagnose …", height=36)
        self.diagnose.setAccessibleName(f"Diagnose {shown.title}")
        self.diagnose.setVisible(shown.diagnosable)
        self.diagnose.clicked.connect(lambda: self.diagnose_asked.emit(self.name))
        head = QHBoxLayout()
        head.setSpacing(10)
        if not shown.choosable:
            head.addSpacing(INSET)
        head.addWidget(self.title)
        head.addStretch()
        head.addWidget(self.chip)
        words = QVBoxLayout()
        words.setSpacing(4)
        for line in (self.can, self.why, self.by):
            words.addWidget(line)
        words.addStretch()
        below = QHBoxLayout()
        below.setContentsMargins(INSET, 0, 0, 0)
        below.setSpacing(16)
        below.addLayout(words, 1)
        below.addWidget(self.diagnose, 0, Qt.AlignmentFlag.AlignTop)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 6, 0, 6)
        column.setSpacing(2)
        column.addLayout(head)
        column.addLayout(below)
        self.show_device(shown)

    def show_device(self, shown: DeviceShown) -> None:
        """Show a device as it was found."""
        self.chip.show_state(shown.tone, shown.sign, shown.word)
        ways = shown.ways if len(shown.ways) > 1 else ()
        for line, words in (
            (self.can, shown.can),
            (self.why, shown.why),
            (self.by, "   ·   ".join(f"{way.by}: {way.state}" for way in ways)),
        ):
            line.setText(words)
            line.setVisible(bool(words))
        set_ink(self.why, "warn" if shown.tone == "warn" else "text2")
        self.title.setAccessibleName(f"{shown.title}. {shown.word}. {shown.can} {shown.why}".strip())


class DeviceList(Card):
    """Devices under each other; ``chosen`` carries the name of the one to begin with: one of all in the ``group``."""

    chosen = Signal(str)
    diagnose_asked = Signal(str)

    def __init__(self, title: str, group: QButtonGroup) -> None:
        super().__init__(title, gap=6)
        self.rows: dict[str, DeviceRow] = {}
        self._group = group

    def show_devices(self, shown: tuple[DeviceShown, ...]) -> None:
        """Show devices; rows of those that are there already stay, with the keyboard in them."""
        for device in shown:
            if device.name in self.rows:
                self.rows[device.name].show_device(device)
            else:
                self._add(device)

    def mark(self, kind: str) -> None:
        """Mark the device that sessions begin with."""
        for name, row in self.rows.items():
            if isinstance(row.title, Radio):
                row.title.setChecked(name == kind)

    def _add(self, device: DeviceShown) -> None:
        if self.rows:
            self.column.addWidget(Rule())
        row = DeviceRow(device)
        self.rows[device.name] = row
        self.column.addWidget(row)
        row.diagnose_asked.connect(self.diagnose_asked)
        if isinstance(row.title, Radio):
            self._group.addButton(row.title)
            row.title.clicked.connect(lambda: self.chosen.emit(device.name))


def _words(ink: str, *, small: bool = False) -> QLabel:
    made = label("", "small" if small else "label", ink, wraps=True)  # type: ignore[arg-type]
    made.setFont(font("small" if small else "label", weight=400))
    made.setMinimumWidth(LEAST_WORDS)
    return made

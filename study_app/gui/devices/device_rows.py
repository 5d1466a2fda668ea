"""A row for each device: whether it is the one to begin with, its state, what it can do, and why it cannot be used."""

from collections.abc import Mapping
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QButtonGroup, QLabel, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Card, Chip, Rule
from study_app.gui.widgets.controls import ActionButton, Radio
from study_app.gui.widgets.labels import label, set_ink
from study_app.viewmodels.devices.bench import BenchShown
from study_app.viewmodels.devices.list_view import DeviceShown

LEAST_WORDS = 280  # narrower, wrapped words would ask for room that they do not need
INSET = 30  # behind a radio's mark


class DeviceRow(QWidget):
    """One device; ``diagnose_asked`` carries its name, ``report_asked`` the path of the report of its last bench."""

    diagnose_asked = Signal(str)
    report_asked = Signal(Path)

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
        self.bench = _words("text2")
        self.report = ActionButton("file", "Bench report", height=36)
        self.report.setAccessibleName(f"Bench report of {shown.title}")
        self.report.clicked.connect(lambda: self.report_asked.emit(self._report))
        self._report: Path | None = None
        inset = () if shown.choosable else (INSET,)
        head = hbox(*inset, self.title, STRETCH, self.chip, spacing=10)
        words = vbox(self.can, self.why, self.by, self.bench, STRETCH, spacing=4)
        buttons = vbox(self.diagnose, self.report, STRETCH, spacing=8)
        below = hbox((words, 1), buttons, spacing=16, margins=(INSET, 0, 0, 0))
        vbox(head, below, spacing=2, margins=(0, 6, 0, 6), parent=self)
        self.show_device(shown)
        self.show_bench(None)

    def show_device(self, shown: DeviceShown) -> None:
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

    def show_bench(self, bench: BenchShown | None) -> None:
        """Show the last bench of the device; None: it was not measured."""
        self._report = None if bench is None else bench.report
        self.bench.setText("" if bench is None else bench.words)
        self.bench.setVisible(bench is not None)
        self.report.setVisible(self._report is not None)


class DeviceList(Card):
    """Devices under each other; ``chosen`` carries the name of the one to begin with: one of all in the ``group``."""

    chosen = Signal(str)
    diagnose_asked = Signal(str)
    report_asked = Signal(Path)

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

    def show_benches(self, benches: Mapping[str, BenchShown]) -> None:
        for name, row in self.rows.items():
            row.show_bench(benches.get(name.partition(":")[0]))

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
        row.report_asked.connect(self.report_asked)
        if isinstance(row.title, Radio):
            self._group.addButton(row.title)
            row.title.clicked.connect(lambda: self.chosen.emit(device.name))


def _words(ink: str, *, small: bool = False) -> QLabel:
    made = label("", "small" if small else "label", ink, wraps=True)  # type: ignore[arg-type]
    made.setFont(font("small" if small else "label", weight=400))
    made.setMinimumWidth(LEAST_WORDS)
    return made

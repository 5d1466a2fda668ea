"""The device's card: what the participant feels with, whether it answers, and the way to its diagnoses."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QGridLayout, QLabel

from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox
from study_app.gui.widgets.cards import Card, Chip, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Elided, label
from study_app.viewmodels.operator import DeviceView

ALL_ROWS = 99


class DeviceCard(Card):
    """Name, state and rows; ``diagnose_asked`` when the operator wants to know what is wrong with it."""

    diagnose_asked = Signal()

    def __init__(self) -> None:
        super().__init__(padding=16, gap=10)
        self.icon = Icon("device", "text2", 22)
        self.name = label("", "card")
        self.chip = Chip("neutral", "ring", "Waiting", small=True)
        self.diagnose = ActionButton("pulse", "Diagnose …", key="D", height=36)
        self.diagnose.setToolTip("Turns the force off and pauses first")
        self.diagnose.clicked.connect(self.diagnose_asked)
        self._most = ALL_ROWS
        self._view: DeviceView | None = None
        row = hbox(self.icon, self.name, STRETCH, self.chip, spacing=10)
        add_layout(self.column, row)
        self._grid = QGridLayout()
        self._grid.setVerticalSpacing(8)
        self._grid.setHorizontalSpacing(12)
        self._grid.setColumnStretch(1, 1)
        add_parts(self.column, self._grid, self.diagnose)
        self.rows: list[tuple[QLabel, Elided]] = []

    def show_rows(self, most: int) -> None:
        """Show so many rows at most; the rest is in the card's tip."""
        self._most = most
        if self._view is not None:
            self.show_device(self._view)

    def show_device(self, device: DeviceView) -> None:
        self._view = device
        self.icon.show_icon(device.icon, "text2")
        self.name.setText(device.name)
        self.chip.show_state(*(("ok", "check", "Ready") if device.ready else ("bad", "warning", "Fault")))
        while len(self.rows) < len(device.rows):
            name, value = label("", "label", "text2"), Elided("label")
            value.setFont(font("label", weight=600, tabular=True))
            value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self._grid.addWidget(name, len(self.rows), 0)
            self._grid.addWidget(value, len(self.rows), 1)
            self.rows.append((name, value))
        for index, ((name, value), (word, said)) in enumerate(zip(self.rows, device.rows, strict=True)):
            name.setText(word)
            value.show_text(said)
            for part in (name, value):
                part.setVisible(index < self._most)
        self.setToolTip("\n".join(f"{word}: {said}" for word, said in device.rows[self._most :]))

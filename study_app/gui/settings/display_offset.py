"""What a photodiode said of the display: its offset, how much it varies, and how that was measured."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QGridLayout, QWidget

from study_app.gui.settings.measured_number import LEAST_WORDS
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Icon
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.number_field import NumberField, read_number, write_number
from study_app.store.workstation import OFFSET_MS, SPREAD_MS, DisplayOffset

HOWS = ("photodiode", "high-speed camera", "data sheet")
DECIMALS = 2


class OffsetForm(QWidget):
    """Two numbers and a way; ``kept(mean [ms], spread [ms], how)``, and ``forgotten``."""

    kept = Signal(float, float, str)
    forgotten = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.mean, self.spread = NumberField(), NumberField()
        self.how = Choice()
        self.how.setProperty("dense", "true")
        self.how.setFont(font("label"))
        self.how.setMaximumWidth(220)
        for way in HOWS:
            self.how.addItem(way.capitalize(), way)
        self.said = label("", "label", "text2", wraps=True)
        self.said.setFont(font("label", weight=400, tabular=True))
        self.said.setMinimumWidth(LEAST_WORDS)
        self.sign = Icon("warning", "bad", 16)
        self.why = label("", "label", "bad", wraps=True)
        self.keep = ActionButton("save", "Save offset", height=38)
        self.forget = ActionButton("", "Forget", height=38)
        for button in (self.keep, self.forget):
            button.setAutoDefault(False)
        self._lay_out()
        self.keep.clicked.connect(self._keep)
        self.forget.clicked.connect(self.forgotten)
        for field in (self.mean, self.spread):
            field.setFixedWidth(88)
            field.textEdited.connect(lambda: self._refuse(""))
            field.returnPressed.connect(self._keep)
        self._refuse("")

    def _lay_out(self) -> None:
        grid = QGridLayout()
        grid.setHorizontalSpacing(12)
        grid.setVerticalSpacing(6)
        named = (("Mean, ms", self.mean), ("Spread, ms", self.spread), ("Measured by", self.how))
        for column, (name, field) in enumerate(named):
            over = label(name, "label", "text2")
            over.setBuddy(field)
            field.setAccessibleName(f"Display offset: {name}")
            grid.addWidget(over, 0, column)
            grid.addWidget(field, 1, column)
        grid.setColumnStretch(2, 1)
        grid.setColumnStretch(3, 2)
        trouble = hbox((self.sign, 0, Qt.AlignmentFlag.AlignTop), (self.why, 1), spacing=6)
        foot = hbox(self.keep, self.forget, STRETCH, spacing=12)
        vbox(self.said, grid, trouble, foot, spacing=8, margins=0, parent=self)

    def show_offset(self, offset: DisplayOffset | None, screen: str) -> None:
        """Show what was measured; of another screen than ``screen`` it is said so."""
        self.forget.setEnabled(offset is not None)
        self.said.setText(offset_words(offset, screen))
        if offset is None:
            return
        for field, value in ((self.mean, offset.mean_ms), (self.spread, offset.spread_ms)):
            field.show_text(write_number(value, DECIMALS))
        self.how.setCurrentIndex(max(0, self.how.findData(offset.how)))

    def _keep(self) -> None:
        """Say what was typed, or why it cannot be."""
        found = []
        for name, field, (least, most) in (("Mean", self.mean, OFFSET_MS), ("Spread", self.spread, SPREAD_MS)):
            value = read_number(field.text() or "0") if field is self.spread else read_number(field.text())
            good = value is not None and least <= value <= most
            field.show_state("" if good else "refused")
            if value is None or not good:
                self._refuse(f"{name} must be a number from {least:g} to {most:g} ms.")
                field.setFocus()
                return
            found.append(value)
        self._refuse("")
        for field in (self.mean, self.spread):
            field.setModified(False)
        self.kept.emit(*found, self.how.currentData())

    def _refuse(self, why: str) -> None:
        self.why.setText(why)
        self.why.setVisible(bool(why))
        self.sign.setVisible(bool(why))


def offset_words(offset: DisplayOffset | None, screen: str) -> str:
    """Return what is known of a screen's offset, in a sentence."""
    if offset is None:
        return (
            "Not measured. The screen shows each frame slightly later; the delay is recorded as “not measured” in "
            "every receipt."
        )
    text = f"{write_number(offset.mean_ms, DECIMALS)} ± {write_number(offset.spread_ms, DECIMALS)} ms"
    when = f", {offset.measured}" if offset.measured else ""
    where = "" if offset.screen == screen else f" for another screen ({offset.screen}): not used here"
    return f"{text} by {offset.how}{when}{where}."

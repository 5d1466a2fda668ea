"""The devices' place: every device, which one sessions begin with, and what is wrong with one.

It draws values and says what is asked for; it opens no device.
"""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QButtonGroup, QLabel, QWidget

from study_app.devices.descriptor import DeviceOption
from study_app.gui.kit.devices import DeviceShown, remembered_options
from study_app.gui.kit.fields import LEAST_WORDS, Editor, Field, file_of
from study_app.gui.theme.theme import SHADOW, font
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, Card, Chip, Rule, scrolled
from study_app.gui.widgets.controls import ActionButton, Radio
from study_app.gui.widgets.labels import label, set_ink
from study_app.gui.widgets.main_view import Place

INSET = 30  # behind a radio's mark


class DeviceRow(QWidget):
    """One device; ``ask`` is given what is asked for of it."""

    def __init__(self, shown: DeviceShown, ask: Callable[..., object]) -> None:
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
        self.diagnose.clicked.connect(lambda: ask("diagnose", self.name))
        inset = () if shown.choosable else (INSET,)
        head = hbox(*inset, self.title, STRETCH, self.chip, spacing=10)
        words = vbox(self.can, self.why, self.by, STRETCH, spacing=4)
        below = hbox((words, 1), (self.diagnose, 0, Qt.AlignmentFlag.AlignTop), spacing=16, margins=(INSET, 0, 0, 0))
        vbox(head, below, spacing=2, margins=(0, 6, 0, 6), parent=self)
        self.show_device(shown)

    def show_device(self, shown: DeviceShown) -> None:
        self.chip.show_state(shown.tone, shown.sign, shown.word)
        ways = shown.ways if len(shown.ways) > 1 else ()
        for line, words in ((self.can, shown.can), (self.why, shown.why), (self.by, "   ·   ".join(ways))):
            line.setText(words)
            line.setVisible(bool(words))
        set_ink(self.why, "warn" if shown.tone == "warn" else "text2")
        self.title.setAccessibleName(f"{shown.title}. {shown.word}. {shown.can} {shown.why}".strip())


def _words(ink: str, *, small: bool = False) -> QLabel:
    made = label("", "small" if small else "label", ink, wraps=True)  # type: ignore[arg-type]
    made.setFont(font("small" if small else "label", weight=400))
    made.setMinimumWidth(LEAST_WORDS)
    return made


STACKED_BELOW = 1000
COLUMN_PX = 340
NONE = "No file chosen"


class OptionCard(Card):
    """The file of a device's option; an empty field is none."""

    def __init__(self, option: DeviceOption) -> None:
        super().__init__(option.title, gap=8)
        about = label(option.about, "label", "text2", wraps=True, weight=400)
        about.setMinimumWidth(LEAST_WORDS)
        exists = partial(file_of, option.name)
        field = Field(option.name, "File", "file", (), placeholder=NONE, file_filter=option.file_filter, parse=exists)
        self.editor = Editor(field)
        add_parts(self.column, about, self.editor)


class HelpCard(Card):
    """What to do next with a Falcon: the words that need no window."""

    def __init__(self) -> None:
        super().__init__("Before the first session", gap=8)
        for words in (
            "Connect the USB cable and the power adapter, then press “Refresh”.",
            "“Diagnose …” finds, opens, loads, homes and tests the device without force, and says what is wrong.",
            "“liquid-study devices calibrate” measures its force with a known weight.",
            "“liquid-study devices bench” measures any device with force in ten minutes.",
        ):
            line = label(words, "label", "text2", wraps=True, weight=400)
            line.setMinimumWidth(LEAST_WORDS)
            self.column.addWidget(line)


class DevicesPlace(Place):
    """Every device with its state.

    ``asked(what, detail)``: to "look" at the machine again, to "choose" a device by its name, to "diagnose" one; of
    an "option" its name and a path or None; "leave" where the place is left.
    """

    asked = Signal(str, object)

    def __init__(self) -> None:
        super().__init__()
        self._group = QButtonGroup(self)
        self.lists = {False: Card("Input devices", gap=6), True: Card("Simulated devices", gap=6)}
        self.rows: dict[str, DeviceRow] = {}
        self.options = {option.name: OptionCard(option) for option in remembered_options()}
        self.help = HelpCard()
        self.refresh = ActionButton("repeat", "Refresh", key="F5")
        self.refresh.clicked.connect(lambda: self.asked.emit("look", None))
        for card in self.options.values():
            card.editor.changed.connect(lambda name, path: self.asked.emit("option", {name: path}))
        self._lay_out()

    def _lay_out(self) -> None:
        about = label("New sessions use the selected device.", "body", "text2", wraps=True)
        titles = vbox(label("Devices", "title"), about, spacing=4)
        head = hbox((titles, 1), self.refresh, margins=(SHADOW, 0, SHADOW, 0))
        lists = vbox(*self.lists.values(), STRETCH, spacing=18)
        column = vbox(*self.options.values(), self.help, STRETCH, spacing=18)
        self._body = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._body.setSpacing(18)
        add_parts(self._body, (lists, 1), column)
        inside = QWidget()
        vbox(head, (self._body, 1), spacing=20, margins=(30, 30, 30, 22), parent=inside)
        self._area = scrolled(inside)
        vbox(self._area, margins=0, parent=self)

    def enter(self) -> None:
        """Look at the machine again: something may have been plugged in."""
        self.asked.emit("look", None)

    def leave(self) -> None:
        """Tell that the place is left, so that a running examination releases its device."""
        self.asked.emit("leave", None)

    def show_devices(self, shown: tuple[DeviceShown, ...], preferred: str) -> None:
        """Show devices; rows of those that are there already stay, with the keyboard in them."""
        for device in shown:
            if device.name in self.rows:
                self.rows[device.name].show_device(device)
            else:
                self._add(device)
        self._group.setExclusive(False)  # or what is marked could not lose its mark
        for name, row in self.rows.items():
            if isinstance(row.title, Radio):
                row.title.setChecked(name == preferred.partition(":")[0])
        self._group.setExclusive(True)

    def _add(self, device: DeviceShown) -> None:
        card = self.lists[device.simulated]
        row = self.rows[device.name] = DeviceRow(device, self.asked.emit)
        add_parts(card.column, *([Rule()] if card.findChild(DeviceRow) else []), row)
        if isinstance(row.title, Radio):
            self._group.addButton(row.title)
            row.title.clicked.connect(lambda: self.asked.emit("choose", device.name))

    def show_options(self, values: Mapping[str, Path]) -> None:
        for name, card in self.options.items():
            card.editor.show_value(values.get(name, ""))

    def show_looking(self, looking: bool) -> None:
        self.refresh.setEnabled(not looking)
        self.refresh.show_action("repeat", "Looking …" if looking else "Refresh")

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        stacked = self.width() < STACKED_BELOW
        way = QBoxLayout.Direction.TopToBottom if stacked else QBoxLayout.Direction.LeftToRight
        self._body.setDirection(way)
        for card in (*self.options.values(), self.help):
            card.setMinimumWidth(0 if stacked else COLUMN_PX)
            card.setMaximumWidth(QWIDGETSIZE_MAX if stacked else COLUMN_PX)

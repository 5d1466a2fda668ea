"""The page of devices: their states, the device of new sessions, and diagnoses; it opens no device itself."""

from collections.abc import Callable, Sequence
from functools import partial

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QButtonGroup, QLabel, QWidget

from study_app.devices.descriptor import Backend, DeviceOption
from study_app.devices.registry import backends
from study_app.gui.devices.diagnosis_dialog import DiagnosisDialog, open_diagnosis
from study_app.gui.kit.devices import DeviceShown, devices_shown, remembered_options
from study_app.gui.kit.fields import MIN_TEXT_WIDTH, Editor, Field, typed_file
from study_app.gui.theme.theme import SHADOW, font
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, Card, Chip, Rule, scrolled
from study_app.gui.widgets.controls import ActionButton, Radio
from study_app.gui.widgets.labels import label, set_ink
from study_app.gui.widgets.main_view import Place
from study_app.store.workstation import DEFAULTS, MachineSettings

_INSET = 30  # indentation by the width of a radio button


class _DeviceRow(QWidget):
    """A row with a device; ``diagnose`` is called with its name."""

    def __init__(self, shown: DeviceShown, diagnose: Callable[[str], object]) -> None:
        super().__init__()
        self.name = shown.name
        self.title: Radio | QLabel = Radio(shown.title) if shown.choosable else label(shown.title, "strong")
        self.title.setFont(font("strong"))
        self.chip = Chip(small=True)
        self.can = _text_label("text2")
        self.why = _text_label("warn")
        self.by = _text_label("text3", small=True)
        self.diagnose = ActionButton("pulse", "Diagnose…", height=36)
        self.diagnose.setAccessibleName(f"Diagnose {shown.title}")
        self.diagnose.setVisible(shown.diagnosable)
        self.diagnose.clicked.connect(lambda: diagnose(self.name))
        inset = () if shown.choosable else (_INSET,)
        head = hbox(*inset, self.title, STRETCH, self.chip, spacing=10)
        text = vbox(self.can, self.why, self.by, STRETCH, spacing=4)
        below = hbox((text, 1), (self.diagnose, 0, Qt.AlignmentFlag.AlignTop), spacing=16, margins=(_INSET, 0, 0, 0))
        vbox(head, below, spacing=2, margins=(0, 6, 0, 6), parent=self)
        self.show_device(shown)

    def show_device(self, shown: DeviceShown) -> None:
        self.chip.show_state(shown.tone, shown.sign, shown.word)
        libraries = shown.ways if len(shown.ways) > 1 else ()
        for line, text in ((self.can, shown.can), (self.why, shown.why), (self.by, "   ·   ".join(libraries))):
            line.setText(text)
            line.setVisible(bool(text))
        set_ink(self.why, "warn" if shown.tone == "warn" else "text2")
        self.title.setAccessibleName(f"{shown.title}. {shown.word}. {shown.can} {shown.why}".strip())


def _text_label(ink: str, *, small: bool = False) -> QLabel:
    text_label = label("", "small" if small else "label", ink, wraps=True)  # type: ignore[arg-type]
    text_label.setFont(font("small" if small else "label", weight=400))
    text_label.setMinimumWidth(MIN_TEXT_WIDTH)
    return text_label


_STACKED_BELOW = 1000
_COLUMN_PX = 340
_NONE = "No file chosen"
PATIENCE_S = 5.0


class _OptionCard(Card):
    """The card with the file of a device option; the field may be empty."""

    def __init__(self, option: DeviceOption) -> None:
        super().__init__(option.title, gap=8)
        about = label(option.about, "label", "text2", wraps=True, weight=400)
        about.setMinimumWidth(MIN_TEXT_WIDTH)
        exists = partial(typed_file, option.name)
        field = Field(option.name, "File", "file", (), placeholder=_NONE, file_filter=option.file_filter, parse=exists)
        self.editor = Editor(field)
        add_parts(self.column, about, self.editor)


class _HelpCard(Card):
    """The card with the steps before the first session with a Falcon."""

    def __init__(self) -> None:
        super().__init__("Before the first session", gap=8)
        for paragraph in (
            "Connect the USB cable and the power adapter, then press “Refresh”.",
            "“Diagnose…” opens the device, loads its firmware, homes it, tests it without force and reports any "
            "faults.",
            "“liquid-study devices calibrate” measures the device's force with a known weight.",
            "“liquid-study devices bench” tests any force-feedback device and takes ten minutes.",
        ):
            line = label(paragraph, "label", "text2", wraps=True, weight=400)
            line.setMinimumWidth(MIN_TEXT_WIDTH)
            self.column.addWidget(line)


class DevicesPlace(Place):
    """The page with all devices and their states, which are searched for when it is shown and on request.

    ``looked`` is emitted after a search, ``changed`` with a setting and its new value, and ``troubled`` with a title
    and a sentence if a search failed.
    """

    looked = Signal()
    changed = Signal(dict)
    troubled = Signal(str, str)

    def __init__(self, settings: MachineSettings = DEFAULTS, look: Callable[[], Sequence[Backend]] = backends) -> None:
        super().__init__()
        self._settings, self.backends = settings, look
        self.looking = Background(self, refusals=Exception)  # an exception in a driver must be reported, too
        self.looking.done.connect(self._show_search_result)
        self.looking.failed.connect(self._show_search_error)
        self._ended = False
        self.shown: tuple[DeviceShown, ...] = ()
        self.dialog: DiagnosisDialog | None = None
        self._group = QButtonGroup(self)
        self.lists = {False: Card("Input devices", gap=6), True: Card("Simulated devices", gap=6)}
        self.rows: dict[str, _DeviceRow] = {}
        self.options = {option.name: _OptionCard(option) for option in remembered_options()}
        self.help = _HelpCard()
        self.refresh = ActionButton("repeat", "Refresh", key="F5")
        self.refresh.clicked.connect(self.look_for_devices)
        for card in self.options.values():
            card.editor.changed.connect(lambda name, path: self.changed.emit({name: path}))
        self._lay_out()
        self.show_settings(settings)

    def _lay_out(self) -> None:
        about = label("New sessions use the selected device.", "body", "text2", wraps=True)
        titles = vbox(label("Devices", "title"), about, spacing=4)
        head = hbox((titles, 1), self.refresh, margins=(SHADOW, 0, SHADOW, 0))
        lists = vbox(*self.lists.values(), STRETCH, spacing=18)
        column = vbox(*self.options.values(), self.help, STRETCH, spacing=18)
        self._body = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._body.setSpacing(18)
        add_parts(self._body, (lists, 1), column)
        content = QWidget()
        vbox(head, (self._body, 1), spacing=20, margins=(30, 30, 30, 22), parent=content)
        self._area = scrolled(content)
        vbox(self._area, margins=0, parent=self)

    def enter(self) -> None:
        """Search for devices again, since one may have been plugged in."""
        self.look_for_devices()

    def leave(self) -> None:
        """End a running diagnosis, so that it releases its device."""
        self.end_diagnosis()

    def look_for_devices(self) -> None:
        if not self.looking.busy and not self._ended:
            self.show_looking(True)
            self.looking.run(lambda: devices_shown(self.backends()))

    def stop_looking(self, patience_s: float = PATIENCE_S) -> None:
        """Wait for a running search, ignore its result, and start no other, because the windows close."""
        self._ended = True
        self.looking.wait(min(patience_s, PATIENCE_S))

    def diagnose(self, name: str) -> None:
        """Open the diagnosis of a device, with the preferred argument (such as a serial number) of the settings."""
        preferred = self._settings.device
        device = preferred if preferred.partition(":")[0] == name else name
        self.end_diagnosis()
        self.dialog = open_diagnosis(self.window(), self.theme, device, self._settings)
        self.dialog.finished.connect(self._forget_dialog)
        self.dialog.show()

    def end_diagnosis(self) -> None:
        if self.dialog is not None:
            self.dialog.reject()

    def _forget_dialog(self) -> None:
        self.dialog = None

    def _show_search_result(self, devices: tuple[DeviceShown, ...]) -> None:
        if not self._ended:
            self.show_looking(False)
            self.show_devices(devices)
            self.looked.emit()

    def _show_search_error(self, error: Exception) -> None:
        if not self._ended:
            self.show_looking(False)
            self.troubled.emit("This machine could not be checked", f"{error}.")

    def show_devices(self, shown: tuple[DeviceShown, ...]) -> None:
        """Show the devices; existing rows are kept, with their focus."""
        self.shown = shown
        for device in shown:
            if device.name in self.rows:
                self.rows[device.name].show_device(device)
            else:
                self._add_row(device)
        self._group.setExclusive(False)  # otherwise the checked button could not be unchecked
        for name, row in self.rows.items():
            if isinstance(row.title, Radio):
                row.title.setChecked(name == self._settings.device.partition(":")[0])
        self._group.setExclusive(True)

    def _add_row(self, device: DeviceShown) -> None:
        card = self.lists[device.simulated]
        row = self.rows[device.name] = _DeviceRow(device, self.diagnose)
        add_parts(card.column, *([Rule()] if card.findChild(_DeviceRow) else []), row)
        if isinstance(row.title, Radio):
            self._group.addButton(row.title)
            row.title.clicked.connect(lambda: self.changed.emit({"device": device.name}))

    def show_settings(self, settings: MachineSettings) -> None:
        self._settings = settings
        for name, card in self.options.items():
            card.editor.show_value(settings.device_options.get(name, ""))
        self.show_devices(self.shown)

    def show_looking(self, looking: bool) -> None:
        self.refresh.setEnabled(not looking)
        self.refresh.show_action("repeat", "Looking…" if looking else "Refresh")

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        stacked = self.width() < _STACKED_BELOW
        self._body.setDirection(QBoxLayout.Direction.TopToBottom if stacked else QBoxLayout.Direction.LeftToRight)
        for card in (*self.options.values(), self.help):
            card.setMinimumWidth(0 if stacked else _COLUMN_PX)
            card.setMaximumWidth(QWIDGETSIZE_MAX if stacked else _COLUMN_PX)

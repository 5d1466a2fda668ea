"""The header's button that plays the study from here, and the list of devices to play with."""

from PySide6.QtCore import Signal
from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QMenu, QWidget

from study_app.designer.participant.play import PlayDevices
from study_app.gui.kit.commands import keys_of, tip
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import hbox
from study_app.gui.widgets.controls import ActionButton, IconButton

PLAY, PLAY_NARROW = "Play from here", "Play"


class PlayControls(QWidget):
    """Signals: ``asked``, ``device_chosen`` (name)."""

    asked = Signal()
    device_chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.devices = PlayDevices()
        self.play = ActionButton("play", PLAY, key=keys_of("play")[0])
        self.play.setAccessibleName(PLAY)
        self.play.setToolTip(tip("play"))
        self.device = IconButton("device", "Device to play with")
        self.menu = QMenu(self)
        self.menu.setFont(font("label"))
        hbox(self.play, self.device, spacing=6, margins=0, parent=self)
        self.play.clicked.connect(self.asked)
        self.device.clicked.connect(self._show_menu)

    def show_devices(self, devices: PlayDevices) -> None:
        """Offer devices, of which one is chosen."""
        self.devices = devices
        self.menu.clear()
        group = QActionGroup(self.menu)
        for name, words in devices.choices:
            action = self.menu.addAction(words)
            action.setCheckable(True)
            action.setChecked(name == devices.chosen)
            group.addAction(action)
            action.triggered.connect(lambda _checked=False, name=name: self.device_chosen.emit(name))
        self.device.setToolTip(f"Device: {devices.title}")
        self.device.setAccessibleName(f"Device to play with: {devices.title}")

    def show_playing(self, playing: bool) -> None:
        """Offer to play unless a pilot is played."""
        self.play.setEnabled(not playing)
        self.device.setEnabled(not playing)

    def show_wide(self, wide: bool) -> None:
        """Show the full text of the button, or the short one."""
        self.play.show_action("play", PLAY if wide else PLAY_NARROW)

    def _show_menu(self) -> None:
        self.menu.popup(self.device.mapToGlobal(self.device.rect().bottomLeft()))

"""The devices: where their place, a look at the machine in a thread, and a diagnosis meet."""

import threading
from collections.abc import Callable, Sequence

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QApplication, QWidget

from study_app.app.workstation_controller import WorkstationController
from study_app.devices.descriptor import Backend
from study_app.devices.registry import backends, descriptor_of
from study_app.gui.application import open_here
from study_app.gui.devices.diagnosis_dialog import DiagnosisDialog
from study_app.gui.devices.view import DevicesPlace
from study_app.gui.theme.theme import Theme
from study_app.store.workstation import MachineSettings
from study_app.viewmodels.devices.bench import benches_shown
from study_app.viewmodels.devices.list_view import DeviceShown, device_named, devices_shown

PATIENCE_S = 5.0
HELD = (
    "This session uses the device, so some checks cannot run. For a full diagnosis, end the session first; you can "
    "resume it later."
)


class DevicesController(QObject):
    """Looks at the machine when it is asked, one look at a time, and shows what was found.

    ``looked`` comes with what was found of every device; ``troubled(title, sentence)`` where one could not look.
    """

    looked = Signal(object)
    troubled = Signal(str, str)
    _done = Signal(object)

    def __init__(self, workstation: WorkstationController, look: Callable[[], Sequence[Backend]] = backends) -> None:
        super().__init__()
        self._workstation, self.backends = workstation, look
        self.looking: threading.Thread | None = None
        self._ended = False
        self.shown: tuple[DeviceShown, ...] = ()
        self.place: DevicesPlace | None = None
        self.dialog: DiagnosisDialog | None = None
        self._done.connect(self._end, Qt.ConnectionType.QueuedConnection)
        workstation.changed.connect(self._show)

    @property
    def preferred(self) -> DeviceShown:
        """The device that sessions begin with, as it was found."""
        return device_named(self._workstation.settings.device, self.shown)

    def make_place(self) -> DevicesPlace:
        """Return the devices' place."""
        place = self.place = DevicesPlace()
        place.look_asked.connect(self.look)
        place.chosen.connect(lambda name: self._workstation.change({"device": name}))
        place.option_chosen.connect(lambda name, path: self._workstation.change({name: path}))
        place.diagnose_asked.connect(self.diagnose)
        place.report_asked.connect(open_here)
        place.left.connect(self.end_diagnosis)
        self._show()
        return place

    def look(self) -> None:
        """Look at the machine, in the background."""
        if self.looking is not None or self._ended:
            return
        if self.place is not None:
            self.place.show_looking(True)
        self.looking = threading.Thread(target=self._see, name="looking for devices", daemon=True)
        self.looking.start()

    def end(self, patience_s: float = PATIENCE_S) -> None:
        """Look no more, wait for a look that is under way, and show nothing of it: the windows go."""
        self._ended = True
        if self.looking is not None:
            self.looking.join(min(patience_s, PATIENCE_S))

    def diagnose(self, name: str) -> None:
        """Open the diagnosis of a device; a serial number that is preferred is taken along."""
        settings = self._workstation.settings
        asked = settings.device if settings.device.partition(":")[0] == name else name
        assert self.place is not None  # noqa: S101 - it has just asked
        self.end_diagnosis()
        self.dialog = diagnosis(self.place.window(), self.place.theme, asked, settings)
        self.dialog.finished.connect(self._forget_dialog)
        self.dialog.show()

    def end_diagnosis(self) -> None:
        """Close the diagnosis, which ends it."""
        if self.dialog is not None:
            self.dialog.reject()

    def _forget_dialog(self) -> None:
        self.dialog = None

    def _see(self) -> None:
        try:
            made: object = devices_shown(self.backends())
        except Exception as error:  # noqa: BLE001 - handed over: a thread has no caller to raise it to
            made = error
        self._done.emit(made)

    def _end(self, made: object) -> None:
        self.looking = None
        if self._ended:
            return
        if self.place is not None:
            self.place.show_looking(False)
        if isinstance(made, Exception):
            self.troubled.emit("This machine could not be examined", f"{made}.")
            return
        assert isinstance(made, tuple)  # noqa: S101 - what _see makes
        self.shown = made
        self._show()
        self.looked.emit(made)

    def _show(self) -> None:
        if self.place is not None:
            self.place.show_devices(self.shown, self._workstation.settings.device)
            self.place.show_benches(benches_shown(self._workstation.settings.benches))
            self.place.show_options(self._workstation.settings.device_options)


def diagnosis(
    parent: QWidget, theme: Theme, name: str, settings: MachineSettings, *, held: bool = False
) -> DiagnosisDialog:
    """Return the diagnosis of a device, begun; ``held`` where a session has it open."""
    options = descriptor_of(name).window_values(settings.device_options)
    made = DiagnosisDialog(parent, theme, name, options=options, note=HELD if held else "")
    made.finished.connect(made.deleteLater)
    if settings.sound:
        made.over.connect(lambda _well: QApplication.beep())
    return made

"""The settings of this machine and its devices: read, changed with undo, looked at in a thread."""

from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path
from typing import Any, Final

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QApplication, QWidget

from study_app.devices.descriptor import Backend
from study_app.devices.registry import backends, descriptor_of
from study_app.errors import StoreError
from study_app.gui.application import open_here
from study_app.gui.devices.diagnosis_dialog import DiagnosisDialog
from study_app.gui.devices.view import DevicesPlace
from study_app.gui.kit.devices import DeviceShown, benches_shown, device_named, devices_shown
from study_app.gui.kit.workstation import settings_here
from study_app.gui.settings.view import MachinePlace
from study_app.gui.theme.theme import Theme
from study_app.gui.widgets.background import Background
from study_app.store import workstation
from study_app.store.workstation import DisplayOffset, MachineSettings
from study_app.user_folder import settings_file
from study_app.workspace import workspace

CALLED: Final = {
    "screen": "participant's screen",
    "viewing_distance_mm": "viewing distance",
    "screen_width_mm": "screen width",
    "display_offset": "display offset",
    "device": "device",
    "firmware": "firmware",
    "camera": "camera",
    "workspace": "workspace",
    "theme": "theme",
    "sound": "sound",
    "photodiode": "photodiode square",
    "lsl_markers": "LSL markers",
    "lsl_samples": "LSL samples",
    "triggers": "trigger port",
}


class WorkstationController(QObject):
    """Holds the settings, keeps them at once, and takes the last change back.

    ``changed`` comes when something else is set; ``troubled(title, sentence)`` where they cannot be read or kept.
    """

    changed = Signal(object)
    troubled = Signal(str, str)

    def __init__(self) -> None:
        super().__init__()
        self.settings, self.trouble = settings_here()
        self._before: list[tuple[str, MachineSettings]] = []
        self.place: MachinePlace | None = None

    def make_place(self) -> MachinePlace:
        """Return the machine's place, which shows what is set from now on."""
        place = self.place = MachinePlace()
        place.changed.connect(self.change)
        place.offset_measured.connect(self.measured)
        place.undo_asked.connect(self.undo)
        self._show()
        return place

    def change(self, values: dict[str, Any]) -> None:
        """Set values by their names, and keep them."""
        made = MachineSettings.model_validate(_plain(self.settings) | values)
        if made == self.settings:
            self._show()
            return
        self._before.append((CALLED[next(iter(values))], self.settings))
        self._keep(made)

    def remember_operator(self, operator: str) -> None:
        """Offer these initials in the next session; this is not a setting, so undo ignores it."""
        if operator and operator != self.settings.operator:
            self._keep(self.settings.model_copy(update={"operator": operator}))

    def remember_protocol(self, protocol: Path) -> None:
        """Keep a protocol file among the recent ones; this is not a setting, so undo ignores it."""
        made = self.settings.with_recent(protocol)
        if made != self.settings:
            self._keep(made)

    def measured(self, mean_ms: float, spread_ms: float, how: str, screen: str) -> None:
        offset = {"mean_ms": mean_ms, "spread_ms": spread_ms, "how": how, "screen": screen}
        self.change({"display_offset": DisplayOffset.model_validate(offset | {"measured": date.today().isoformat()})})

    def undo(self) -> None:
        if self._before:
            kept = {"operator": self.settings.operator, "recent": self.settings.recent}
            self._keep(self._before.pop()[1].model_copy(update=kept))

    @property
    def undo_called(self) -> str:
        """What can be taken back; nothing where nothing can."""
        return self._before[-1][0] if self._before else ""

    def _keep(self, settings: MachineSettings) -> None:
        self.settings = settings
        try:
            workstation.save(settings)
        except StoreError as error:
            self.troubled.emit("This machine's settings could not be saved", f"{error}.")
        self._show()
        self.changed.emit(settings)

    def _show(self) -> None:
        if self.place is not None:
            self.place.show_settings(
                self.settings,
                folder=str(workspace().folder.absolute()),
                undo=self.undo_called,
                kept_in=str(settings_file()),
            )


def _plain(settings: MachineSettings) -> dict[str, Any]:
    return {name: getattr(settings, name) for name in MachineSettings.model_fields}


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

    def __init__(self, workstation: WorkstationController, look: Callable[[], Sequence[Backend]] = backends) -> None:
        super().__init__()
        self._workstation, self.backends = workstation, look
        self.looking = Background(self)
        self.looking.done.connect(self._show_found)
        self._ended = False
        self.shown: tuple[DeviceShown, ...] = ()
        self.place: DevicesPlace | None = None
        self.dialog: DiagnosisDialog | None = None
        workstation.changed.connect(self._show)

    @property
    def preferred(self) -> DeviceShown:
        """The device that sessions begin with, as it was found."""
        return device_named(self._workstation.settings.device, self.shown)

    def make_place(self) -> DevicesPlace:
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
        if self.looking.busy or self._ended:
            return
        if self.place is not None:
            self.place.show_looking(True)
        self.looking.run(self._look)

    def end(self, patience_s: float = PATIENCE_S) -> None:
        """Look no more, wait for a look that is under way, and show nothing of it: the windows go."""
        self._ended = True
        self.looking.wait(min(patience_s, PATIENCE_S))

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

    def _look(self) -> tuple[DeviceShown, ...] | Exception:
        try:
            return devices_shown(self.backends())
        except Exception as error:  # noqa: BLE001 - a bug of a driver is told as what it is of the machine
            return error

    def _show_found(self, found: tuple[DeviceShown, ...] | Exception) -> None:
        if self._ended:
            return
        if isinstance(found, Exception):
            self._show()
            self.troubled.emit("This machine could not be examined", f"{found}.")
            return
        self.shown = found
        self._show()
        self.looked.emit(found)

    def _show(self) -> None:
        if self.place is not None:
            self.place.show_looking(self.looking.busy)
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

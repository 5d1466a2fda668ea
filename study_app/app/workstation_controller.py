"""What is set for this machine: where its place, its file and the windows that follow it meet."""

from datetime import date
from pathlib import Path
from typing import Any, Final

from PySide6.QtCore import QObject, Signal

from study_app.app.workstation_settings import settings_here
from study_app.errors import StoreError
from study_app.gui.settings.view import MachinePlace
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
        """Set the display offset that was measured today on a screen."""
        offset = {"mean_ms": mean_ms, "spread_ms": spread_ms, "how": how, "screen": screen}
        self.change({"display_offset": DisplayOffset.model_validate(offset | {"measured": date.today().isoformat()})})

    def undo(self) -> None:
        """Take the last change back."""
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
    """Return the values by their names, the offset as it is."""
    return {name: getattr(settings, name) for name in MachineSettings.model_fields}

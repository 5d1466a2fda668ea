"""The check of this computer: where its window, a servo with the simulated hand and the devices' probes meet."""

from pathlib import Path
from random import Random

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QScreen
from PySide6.QtWidgets import QWidget

from study_app.errors import StudyError
from study_app.gui.preflight.window import ComputerWindow, computer_checks
from study_app.gui.theme.theme import Theme
from study_app.gui.widgets.background import Background
from study_app.session.preflight import Check, Screen

MEASURED_S = 2.0
STUDY = "demo"


class ComputerCheck(QObject):
    """Measures when its window asks, in the background, and shows what was found."""

    _compiled = Signal(float)

    def __init__(self, parent: QWidget, theme: Theme, results: Path, screen: QScreen) -> None:
        super().__init__(parent)
        self._results, self._screen = results, Screen(screen.refreshRate(), screen.devicePixelRatio())
        self.window = ComputerWindow(parent, theme)
        self._background = Background(self)
        self._background.done.connect(self._show)
        self._background.failed.connect(self._tell_bug)
        self._compiled.connect(self.window.show_compiled, Qt.ConnectionType.QueuedConnection)
        self.window.asked.connect(self.measure)
        self.window.finished.connect(self._close)
        self._closed = False

    def measure(self) -> None:
        """Measure, in a thread."""
        self.window.show_measuring()
        self._background.run(self._look)

    def _look(self) -> tuple[Check, ...] | StudyError:
        from study_app.devices.registry import backends  # noqa: PLC0415 - the compiler: only in this thread
        from study_app.devices.rig import open_rig, study_settings  # noqa: PLC0415
        from study_app.haptics.kernels.compiled import CACHE, following_compilation  # noqa: PLC0415
        from study_app.protocol.load import load  # noqa: PLC0415
        from study_app.session.preflight_measurements import measure  # noqa: PLC0415

        try:
            study = load(STUDY)
            with following_compilation(self._compiled.emit) as counter:
                rig = open_rig("scripted", study_settings(study, Random(1)))  # noqa: S311 - a simulated tremor
                try:
                    facts = measure(
                        rig.servo,
                        self._results,
                        device=rig.device.name,
                        screen=self._screen,
                        participant="P001",
                        recordings=True,
                        lasts_s=MEASURED_S,
                    )
                finally:
                    rig.stop()
            found = backends()
        except StudyError as error:
            return error
        return computer_checks(facts, study, found, cache=CACHE, compiled=counter.compiled)

    def _close(self) -> None:
        """Go away, once nothing is measured any more: the thread still speaks to this object."""
        self._closed = True
        if not self._background.busy:
            self.window.deleteLater()
            self.deleteLater()

    def _tell_bug(self, error: BaseException) -> None:
        self._show(StudyError(f"{type(error).__name__}: {error}; the terminal shows the details"))

    def _show(self, found: tuple[Check, ...] | StudyError) -> None:
        if self._closed:
            self._close()
        elif isinstance(found, StudyError):
            self.window.show_sentence(f"{found}.")
        else:
            self.window.show_checks(found)

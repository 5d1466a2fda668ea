"""The lab and the study designer, made at their first visit, and the liquids that go from one to the other."""

from __future__ import annotations

import gc
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from study_app.app.failures import Patience
from study_app.app.machine import WorkstationController
from study_app.gui.widgets.background import Background

if TYPE_CHECKING:
    from study_app.app.lab.controller import LabController
    from study_app.app.session.playing import Playing
    from study_app.designer.participant.feeling import LabLiquids
    from study_app.designer.place.controller import DesignerController
    from study_app.designer.place.view import DesignerPlace
    from study_app.gui.lab.view import LabPlace
    from study_app.gui.sessions.session_facts import SessionFacts
    from study_app.lab.ab_comparison import Setting, Side


class LabAndDesigner(QObject):
    """Makes both places for the main window, and does there what is asked for elsewhere.

    ``go_asked`` carries the name of a place to go to, which makes it; ``saved`` comes when a study or pilot was saved.

    Parameters
    ----------
    results
        Folder that holds the studies' folders; it need not exist.
    """

    go_asked = Signal(str)
    saved = Signal()

    def __init__(self, machine: WorkstationController, results: Path) -> None:
        super().__init__()
        self._machine, self._results = machine, results
        self.designer: DesignerController | None = None
        self.playing: Playing | None = None
        self.lab: LabController | None = None
        self._loading = Background(self)

    def preload(self) -> None:
        """Load the modules of both places in the background, so that the first visit seldom waits for them."""
        self._loading.run(load_modules)

    def make_lab(self) -> LabPlace:
        """Return the lab's place, with its controller."""
        self._loading.wait()  # two threads that load modules of one cycle may see them half loaded
        from study_app.app.lab.controller import LabController  # noqa: PLC0415 - pyqtgraph: only once it is needed
        from study_app.gui.lab.view import LabPlace  # noqa: PLC0415

        made = LabPlace()
        settings = self._machine.settings
        self.lab = LabController(made, device=settings.device, options=settings.device_options)
        made.put_back_asked.connect(self._put_back)
        return made

    def make_designer(self) -> DesignerPlace:
        """Return the study designer's place, with its controller."""
        self._loading.wait()
        from study_app.app.session.playing import Playing  # noqa: PLC0415 - only once they are needed
        from study_app.designer.place.controller import DesignerController  # noqa: PLC0415

        self.designer = DesignerController(self._results)
        self.playing = Playing(self.designer)
        self.designer.saving.saved.connect(self.saved)
        self.playing.kept.connect(self.saved)
        self.designer.feeling.asked.connect(self._feel)
        self.designer.editing.opened_other.connect(self._forget_study)
        self.designer.feeling.returned.connect(lambda: self.go_asked.emit("designer"))
        return self.designer.place

    def open_designer(self, source: str) -> None:
        self._go_to_designer(lambda designer: designer.open(source))

    def show_version(self, session: SessionFacts) -> None:
        """Go to the study designer, to what changed in a session's study since it was run."""
        self._go_to_designer(
            lambda designer: designer.open(session.study),
            lambda designer: designer.changes.compare_with_session(session.study, session.folder),
        )

    def begin_study(self, source: str = "", name: str = "") -> None:
        """Go to the study designer with what a new study can begin from; with a name begin it at once."""
        self._go_to_designer(lambda it: it.ask_for_new(source), lambda it: it.begin(source, name) if name else None)

    def _go_to_designer(self, *actions: Callable[[DesignerController], None]) -> None:
        self.go_asked.emit("designer")
        if self.designer is not None:  # else the window says why it could not be made
            for act in actions:
                act(self.designer)

    def _feel(self, liquids: LabLiquids) -> None:
        self.go_asked.emit("lab")
        if self.lab is not None:
            self.lab.feel_of_study(liquids.a, liquids.b, liquids.study)

    def _forget_study(self) -> None:
        """Let the lab offer no more to put its liquids back: another study is open in the designer."""
        if self.lab is not None:
            self.lab.study = ""

    def _put_back(self, side: Side, setting: Setting) -> None:
        """Put a liquid back into the study that is edited, and go there."""
        if self.designer is not None:
            self.designer.feeling.put_back(side, setting)

    def show_results(self, results: Path) -> None:
        self._results = results
        if self.designer is not None:
            self.designer.editing.results = results

    def end(self, patience: Patience) -> None:
        """End what plays, and let go of the lab's device."""
        if self.playing is not None:
            self.playing.end(patience)
        if self.lab is not None:
            self.lab.end(patience)

    def end_by_signal(self, number: int) -> None:
        if self.playing is not None:
            self.playing.end_by_signal(number)


def load_modules() -> None:
    """Load the modules of lab and designer, the compiler, and what the first page is computed from."""
    import study_app.app.lab.controller  # noqa: PLC0415
    import study_app.app.session.playing  # noqa: PLC0415
    import study_app.lab.live  # noqa: F401, PLC0415
    from study_app.gui.participant.tank.glass import brightness  # noqa: PLC0415
    from study_app.protocol.source.json_schema import schema  # noqa: PLC0415

    brightness()
    schema()
    gc.freeze()  # no collection need look through all that was loaded here

"""The lab and the study designer: loaded in the background, and liquids go from one to the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from study_app.app.preloading import preload_lab_and_designer
from study_app.app.session.termination import Patience
from study_app.app.workstation_controller import WorkstationController
from study_app.gui.widgets.background import Background

if TYPE_CHECKING:
    from study_app.app.designer.controller import DesignerController
    from study_app.app.designer.feeling import LabLiquids
    from study_app.app.lab.controller import LabController
    from study_app.app.lab.initial_settings import InitialSettings
    from study_app.gui.designer.view import DesignerPlace
    from study_app.gui.lab.view import LabPlace
    from study_app.lab.ab_comparison import Setting, Side
    from study_app.viewmodels.sessions import SessionFacts


class LabAndDesigner(QObject):
    """Prepares and makes both places for the main window, and keeps what was asked of a place until it is made.

    ``go_asked`` carries the name of a place to go to, ``prepared`` that of one whose modules are loaded,
    ``not_prepared`` the exception that loading raised; ``saved`` comes when a study or a pilot was saved.

    Parameters
    ----------
    results
        Folder that holds the studies' folders; it need not exist.
    """

    go_asked = Signal(str)
    prepared = Signal(str)
    not_prepared = Signal(object)
    saved = Signal()

    def __init__(self, machine: WorkstationController, results: Path) -> None:
        super().__init__()
        self._machine, self._results = machine, results
        self.designer: DesignerController | None = None
        self.lab: LabController | None = None
        self._lab_first: InitialSettings | None = None
        self._for_lab: LabLiquids | None = None
        self._for_designer: tuple[Callable[[DesignerController], None], ...] = ()
        self._preparing = Background(self)
        self._preparing.done.connect(self._loaded)
        self._preparing.failed.connect(self.not_prepared)

    def prepare_lab(self) -> Iterator[None] | None:
        """Load the lab in the background, from when home stands; return the steps to it once that is done."""
        if self._lab_first is None and not self._preparing.busy:
            self._preparing.run(preload_lab_and_designer)
        return None if self._lab_first is None else self._fill_lab()

    def prepare_designer(self) -> Iterator[None] | None:
        """Return the step to the designer; None while a thread loads what it needs: a click must not wait for that."""
        self.prepare_lab()
        return None if self._preparing.busy else self._fill_designer()

    def _loaded(self, first: InitialSettings) -> None:
        self._lab_first = first
        for name in ("lab", "designer"):
            self.prepared.emit(name)

    def make_lab(self) -> LabPlace:
        """Return the lab's place, with its controller."""
        from study_app.app.lab.controller import compose_lab  # noqa: PLC0415 - pyqtgraph: only once it is needed
        from study_app.gui.lab.view import LabPlace  # noqa: PLC0415

        made = LabPlace()
        settings = self._machine.settings
        self.lab = compose_lab(made, device=settings.device, options=settings.device_options, first=self._lab_first)
        made.put_back_asked.connect(self._put_back)
        self._open_liquids()
        return made

    def make_designer(self) -> DesignerPlace:
        """Return the study designer's place, with its controller."""
        from study_app.app.designer.controller import DesignerController  # noqa: PLC0415 - only once it is needed

        self.designer = DesignerController(self._results)
        self.designer.saving.saved.connect(self.saved)
        self.designer.playing.kept.connect(self.saved)
        self.designer.feeling.asked.connect(self._feel)
        self.designer.editing.opened_other.connect(self._forget_study)
        self.designer.feeling.returned.connect(lambda: self.go_asked.emit("designer"))
        return self.designer.place

    def _fill_lab(self) -> Iterator[None]:
        """Make the lab's form, then its styles: where it is first shown, it is only laid out and painted."""
        lab = self.lab
        assert lab is not None  # noqa: S101 - made with its place
        lab.place.show_view(lab.view())
        yield
        for part in lab.place.findChildren(QWidget):
            part.ensurePolished()
        yield

    def _fill_designer(self) -> Iterator[None]:
        self._act_in_designer()  # the window already shows what the place says
        yield

    def open_designer(self, source: str) -> None:
        """Go to the study designer with a study."""
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
        """Go to the study designer and act there once it is made: the window's thread does not wait for its modules."""
        self._for_designer = actions
        self._act_in_designer()
        self.go_asked.emit("designer")

    def _act_in_designer(self) -> None:
        """Do what waits for the designer, once that is made."""
        if self.designer is not None:
            actions, self._for_designer = self._for_designer, ()
            for act in actions:
                act(self.designer)

    def forget_wanted(self, name: str) -> None:
        """Forget what waits for a place that is not loaded yet where another place is asked for."""
        self._for_designer = self._for_designer if name == "designer" else ()
        self._for_lab = self._for_lab if name == "lab" else None

    def _feel(self, liquids: LabLiquids) -> None:
        """Go to the lab with liquids of the study that is edited."""
        self._for_lab = liquids
        self.go_asked.emit("lab")
        self._open_liquids()

    def _open_liquids(self) -> None:
        """Open what waits for the lab, once that is made."""
        if self.lab is not None and self._for_lab is not None:
            self.lab.feel_of_study(self._for_lab.a, self._for_lab.b, self._for_lab.study)
            self._for_lab = None

    def _forget_study(self) -> None:
        """Let the lab offer no more to put its liquids back: another study is open in the designer."""
        if self.lab is not None:
            self.lab.study = ""

    def _put_back(self, side: Side, setting: Setting) -> None:
        """Put a liquid back into the study that is edited, and go there."""
        if self.designer is not None:
            self.designer.feeling.put_back(side, setting)

    def show_results(self, results: Path) -> None:
        """Look for the runs of a study in another folder from now on."""
        self._results = results
        if self.designer is not None:
            self.designer.editing.results = results

    def end(self, patience: Patience) -> None:
        """End what plays, and let go of the lab's device."""
        if self.designer is not None:
            self.designer.playing.end(patience)
        if self.lab is not None:
            self.lab.end(patience)

    def end_by_signal(self, number: int) -> None:
        """End what plays because the program is being ended from outside."""
        if self.designer is not None:
            self.designer.playing.end_by_signal(number)

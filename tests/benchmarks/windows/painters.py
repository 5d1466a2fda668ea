"""Break each painter once, in a session in real windows, on the pages of the main window, or in a window of its own.

Run as ``python -m tests.benchmarks.windows.painters``: offscreen, with the emulated Falcon. They are all painting
methods of classes of `study_app` and of the plots that are called in a session or on a page; parts that appear on a
page only in rare states are shown alone. After an exception in one the force must be off where the session stopped, the
exception must be in the journal or told in the main window, and the session must be complete once it is resumed.
Prints a table and the faults, and names the painters that were not seen; the exit code is 1 if there are faults.
"""

import importlib
import pkgutil
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FunctionType
from typing import Any, Final

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QApplication, QGraphicsItem, QStyledItemDelegate, QWidget

import study_app.app.session.playing  # noqa: F401 - before `run_part` replaces the class that it derives from
from study_app import api
from study_app.analysis.worker_messages import FigureDrawn
from study_app.app import main_controller
from study_app.designer.header import NoticeCard, kept_notice
from study_app.designer.measures.cards import _Cell
from study_app.designer.new_study_page import _RecoveryBar, known_answers
from study_app.designer.problems import ProblemLine, ProblemRow
from study_app.gui.kit.dialogs import Question
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.results.figures import _FigureView
from study_app.gui.sessions.session_page import SessionPage
from study_app.gui.theme.themed import remove_widget
from study_app.gui.watch.window import _TimeLine
from study_app.gui.widgets.cards import MaskedPanel
from study_app.protocol.source.problems import Fault
from study_app.session.pages import TroublePage
from study_app.session.watch import read_watched
from study_app.store.files.folders import StudyFolder
from tests.benchmarks.windows.closings import (
    PAUSE,
    PHASES,
    STUDY,
    Case,
    Tell,
    every_20_ms,
    phase_of,
    run_part,
    start_when_asked,
)

BROKEN: Final = "no such colour"
PATIENCE_S: Final = 3.0
MOST_SESSIONS: Final = 3
PAINTED: Final = (*PHASES, PAUSE)
SHOWN_S: Final = 0.3
PART_PX: Final = (640, 200)
FIGURE: Final = b'<svg xmlns="http://www.w3.org/2000/svg" width="300pt" height="150pt"><circle r="9"/></svg>'
WINDOW_PX: Final = (1600, 1000)
SETTLED_TICKS: Final = 60


class Painting:
    """Record where each painting method of the program is first called, and let one of them fail once."""

    def __init__(self) -> None:
        self.breaks: set[str] = set()  # classes whose next call fails
        self.phase = "opening"
        self.phases: dict[str, set[str]] = defaultdict(set)  # by class, the phases of its calls
        self.names: set[str] = set()

    def install(self) -> None:
        """Count in all classes, before `guard_painting` guards them."""
        for package in map(importlib.import_module, ("study_app.gui", "study_app.designer")):
            for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
                importlib.import_module(module.name)
        kinds: list[type] = [QWidget, QGraphicsItem, QStyledItemDelegate]
        while kinds:
            kind = kinds.pop()
            kinds += kind.__subclasses__()
            for method in {"paintEvent", "paint"} & vars(kind).keys():
                if isinstance(whole := vars(kind)[method], FunctionType) and not hasattr(whole, "counts"):
                    name = f"{kind.__module__}.{kind.__qualname__}"
                    self.names.add(name)
                    setattr(kind, method, self._counting(name, method, whole))

    def _counting(self, name: str, method: str, whole: Callable[..., None]) -> Callable[..., None]:
        def painted(*arguments: Any) -> None:
            self.phases[name].add(self.phase)
            if name in self.breaks:
                self.breaks.remove(name)
                raise ValueError(f"{BROKEN} in {name}")
            whole(*arguments)

        painted.__code__ = painted.__code__.replace(co_name=method)  # as Qt calls it
        painted.counts = True  # type: ignore[attr-defined]
        return painted

    def break_next(self, name: str) -> None:
        self.breaks = {name}
        for widget in QApplication.allWidgets():
            if widget.isVisible():
                QWidget.update(widget)  # a view's own `update` needs an index


class PaintersCase(Case):
    """A session in which each painter fails once in its phase; a stopped session is left and resumed."""

    def __init__(self, folder: Path, painting: Painting, painters: dict[str, str]) -> None:
        super().__init__(folder, painters.values(), self._break_next)
        self._painting = painting
        self._painters: dict[str, list[str]] = defaultdict(list)
        self.stopped: list[str] = []  # painters after which the session stopped
        self._paused_s = 0.0  # when the session was first paused for its own sake
        for name, phase in sorted(painters.items()):
            self._painters[phase].append(name)

    def look(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        self._painting.phase = phase_of(participant.page) or self._painting.phase
        if self.next is None and isinstance(participant.page, TroublePage):
            self._leave(operator)  # a painter failed while the session was opened
            return True
        if self.next is None and phase_of(participant.page) == "questionnaire" and not self._paused_s:
            self._paused_s = time.perf_counter()
            self._painting.phase = PAUSE  # its page may be painted before it is looked at
            operator.ask("pause")
            return True
        is_shown = time.perf_counter() > self._paused_s + SHOWN_S
        if self.next is None and phase_of(participant.page) == PAUSE and not self._due[PAUSE] and not is_shown:
            return True  # until it is painted
        return super().look(participant, operator)

    def _leave(self, operator: OperatorWindow) -> None:
        self.check(not self.force_is_on, "force in trouble")
        for _ in range(2):
            operator.windowHandle().close()

    @property
    def left(self) -> dict[str, str]:
        """The painters whose phases were too short, with their phases."""
        return {name: phase for phase, names in self._painters.items() for name in names}

    def _break_next(self, _case: Case, _participant: ParticipantWindow, _operator: OperatorWindow) -> None:
        name = self._painters[self.phase].pop()
        self.phase = f"{self.phase}, {name}"
        self._painting.break_next(name)

        def observe(participant: ParticipantWindow, operator: OperatorWindow) -> bool:
            late = time.perf_counter() > self.acted_s + PATIENCE_S
            if name in self._painting.breaks and not late:
                return False  # it may be painted on the next page
            self.check(name not in self._painting.breaks, "was not painted again")
            self._painting.breaks.clear()
            self.next = None
            if isinstance(participant.page, TroublePage):
                self.stopped.append(name)
                self._leave(operator)
            (session,) = StudyFolder(self.results).sessions()
            is_noted = name in session.journal.read_text(encoding="utf-8")
            self.check(is_noted or late or self.phase.startswith("end"), "the journal does not name it")
            return True

        self.next = observe


def tour(study: Path, painting: Painting, faults: dict[str, list[str]]) -> None:
    """Visit the pages of the main window, and let each painter on them fail once."""
    before = set(painting.phases)

    def visit(controller: main_controller.MainController) -> None:
        steps = _tour_steps(controller, study, painting, before, faults)
        timer = QTimer(controller.window, interval=30)
        timer.timeout.connect(lambda: next(steps, None) or controller.window.close())
        timer.start()

    if code := main_controller.run_home_window(study.parent, then=visit):
        faults["the main window"] = [f"exit code {code}"]


def _views(controller: main_controller.MainController, study: Path) -> Iterator[str]:
    """Show page after page, and yield its name; the designer with every element and tab, a session and its trials."""
    controller.window.resize(*WINDOW_PX)
    for place in controller.window.rail.buttons:
        controller.window.go(place)
        yield place
    controller.open_designer(str(STUDY))
    yield "designer, study"
    assert controller.designer is not None
    designer = controller.designer
    for tab in ("file", "measures"):
        designer.place.show_tab(tab)
        yield f"designer, {tab}"
    for row in designer.place.outline.rows:
        designer.editing.select(row.path)
        yield f"designer, {row.path}"
    controller.begin_new_study()
    yield "new study"
    controller.show_study(study)
    view = controller.results_place
    assert view is not None
    while not view.view.sessions:  # they are read in another process
        yield "results, study"
    view.sessions.rows.opened.emit(view.view.sessions[0])
    yield "session"
    assert isinstance(view.dialog, SessionPage)
    view.dialog.watch.click()
    yield "watch again"
    controller.window.go("machine")
    controller._test_display()
    yield "display test"
    (session,) = StudyFolder(study).sessions()
    for part in rare_parts(session.path):
        part.setParent(controller.window, Qt.WindowType.Window)
        part.resize(*PART_PX)
        part.show()
        yield f"{type(part).__name__} alone"
        remove_widget(part)


def rare_parts(session: Path) -> Iterator[QWidget]:
    """Return parts that a page has only while a problem, a notice, a known answer, or a drawn figure is shown."""
    notice = NoticeCard(of_playing=False)
    notice.show_notice(kept_notice("a folder"))
    yield notice
    fault = Fault((), "is wrong", "correct it")
    problem = ProblemRow(
        fault=fault, element=(), name="Study", icon="info", message=fault.message, hint=fault.hint, line=1
    )
    yield ProblemLine(problem, (), narrow=False)
    yield _RecoveryBar(next(iter(known_answers().values())))
    yield _Cell(3, "three")
    yield _FigureView(FigureDrawn(name="figure", title="Figure", caption="", svg=FIGURE), {})
    yield MaskedPanel("Force", "It would reveal the liquid.")
    yield _TimeLine(read_watched(session, 1))


def _tour_steps(
    controller: main_controller.MainController,
    study: Path,
    painting: Painting,
    before: set[str],
    faults: dict[str, list[str]],
) -> Iterator[bool]:
    for painting.phase in _views(controller, study):
        for _ in range(SETTLED_TICKS):
            yield True
        for name in sorted(painting.phases.keys() - before - faults.keys()):
            painting.break_next(name)
            for _ in range(100):
                yield True
                if not painting.breaks:
                    break
            if painting.breaks:
                painting.breaks.clear()  # it was shown for a moment only
                continue
            has_bug = any(name in bug for bug in controller._bugs)
            faults[name] = [] if has_bug else [f"{painting.phase}: the exception in {name} is not told"]
            for box in controller.window.findChildren(Question):
                box.close()


def _rank(phase: str) -> int:
    """Return the order in which phases are preferred: the force is on in the trial."""
    return 0 if phase == "trial" else PAINTED.index(phase)


def run_painters(folder: Path, tell: Tell) -> None:
    painting = Painting()
    painting.install()
    with every_20_ms(start_when_asked):
        PaintersCase(folder / "dry", painting, {}).hold()
        painted_phases = {name: set(phases) for name, phases in painting.phases.items()}
        opening = {name for name, phases in painted_phases.items() if "opening" in phases}
        case = PaintersCase(folder / "opening", painting, {})
        painting.breaks = set(opening)
        case.hold()
        tell("broken while a session is opened", len(opening - painting.breaks), case.faults)
        painting.breaks.clear()
        due = {
            name: phase
            for name, phases in painted_phases.items()
            for phase in sorted(phases & set(PAINTED), key=_rank)[:1]
        }
        for number in range(MOST_SESSIONS):
            case = PaintersCase(folder / f"session-{number}", painting, due)
            case.hold()
            tell(f"broken in a session, which {len(case.stopped)} stopped", len(case.done), case.faults)
            if not (due := case.left):
                break
    api.unblind(folder / "dry" / "results", by="AK", reason="watching a trial again")
    toured: dict[str, list[str]] = {}
    tour(folder / "dry" / "results", painting, toured)
    tell(
        "broken on a page of the main window", len(toured), [message for wrong in toured.values() for message in wrong]
    )
    left = {name for name in painting.names - painted_phases.keys() - toured.keys() if name.startswith("study_app")}
    print(f"{len(left)} painters were not seen: {', '.join(sorted(left))}")


if __name__ == "__main__":
    sys.exit(0 if run_part(run_painters, asks=True) else 1)

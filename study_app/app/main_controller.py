"""The main window's stay: its places, one session at a time, and home again after it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEventLoop, QObject, QTimer
from PySide6.QtGui import QGuiApplication, QKeySequence, QShortcut

from study_app.app.failures import BY_SIGNAL_S, Patience, UncaughtExceptions, ended_from_outside
from study_app.app.lab_and_designer import LabAndDesigner
from study_app.app.machine import DevicesController, WorkstationController
from study_app.app.session.live_session import BUG, OPENING_PATIENCE_S, LiveSession
from study_app.app.session.timing import collecting_here
from study_app.errors import StoreError
from study_app.gui.application import application_here
from study_app.gui.display.screens import place
from study_app.gui.home.dialogs import WorkspaceDialog
from study_app.gui.home.main_window import MainWindow, bug_words
from study_app.gui.home.study_facts import DraftWords
from study_app.gui.home.view import HomePlace
from study_app.gui.kit.workstation import screen_number, theme_named
from study_app.gui.widgets.background import wait_for_jobs
from study_app.session.start import NewSession
from study_app.store.workstation import MachineSettings, create_workspace
from study_app.workspace import Workspace, chosen_workspace, offered_workspace, workspace

LOOK_AFTER_MS = 300  # the window stands by then
JOBS_PATIENCE_S = 5.0

if TYPE_CHECKING:
    from study_app.app.computer_check import ComputerCheck
    from study_app.app.results_controller import ResultsController
    from study_app.gui.help.view import HelpPlace
    from study_app.gui.results.view import ResultsPlace
    from study_app.gui.settings.view import MachinePlace


def home(results: Path | None = None, *, then: Callable[[MainController], None] = lambda _visit: None) -> int:
    """Open the home window on the results folder; return the exit code when it is closed.

    By default the folder is the workspace's. ``then`` is called once the window stands.

    Raises
    ------
    DisplayError
        A window cannot be opened here.
    """
    application = application_here()
    controller = MainController(results)
    uncaught = UncaughtExceptions(controller.show_bug)
    with collecting_here(), ended_from_outside(controller.end_by_signal), uncaught:
        controller.open()
        then(controller)
        controller.loop.exec()
    controller.end()
    application.processEvents()
    return controller.code


class MainController(QObject):
    """The home window's stay: one session at a time, and home again after it."""

    def __init__(self, results: Path | None = None) -> None:
        super().__init__()
        self.machine = WorkstationController()
        self.devices = DevicesController(self.machine)
        self._home_place: HomePlace | None = None
        self._follows_machine = results is None
        self.results = results if results is not None else workspace().results
        self.lab_and_designer = LabAndDesigner(self.machine, self.results)
        self.question: WorkspaceDialog | None = None
        self.check: ComputerCheck | None = None
        self.window = MainWindow(
            {
                "home": self._home,
                "designer": self.lab_and_designer.make_designer,
                "results": self._results,
                "lab": self.lab_and_designer.make_lab,
                "devices": self.devices.make_place,
                "machine": self._machine,
                "help": self._help,
            },
            theme=theme_named(self.machine.settings.theme),
        )
        self.loop = QEventLoop()
        self.code = 0
        self.live: LiveSession | None = None
        self.help: HelpPlace | None = None
        self._called_off: list[LiveSession] = []
        self._bugs: set[str] = set()
        self.results_controller: ResultsController | None = None
        self.lab_and_designer.go_asked.connect(self.window.go)
        self.lab_and_designer.saved.connect(self._show_saved)
        self.window.closed.connect(self._leave)
        self.window.theme_changed.connect(lambda theme: self.machine.change({"theme": theme.name}))
        self.machine.changed.connect(self._machine_changed)
        self.devices.looked.connect(lambda _shown: self._show_machine())
        QShortcut(QKeySequence(QKeySequence.StandardKey.HelpContents), self.window, self.show_help)
        for controller in (self.machine, self.devices):
            controller.troubled.connect(self.window.show_message)

    def open(self) -> None:
        """Show the window, no larger than the screen, and look at the machine once it stands."""
        place(self.window, self.window.screen(), corner=False)
        self.window.show()
        if self.machine.trouble:
            self.window.show_message("The default settings are used", f"{self.machine.trouble}.")
        elif self._follows_machine and chosen_workspace() is None:
            self._ask_for_workspace()
        QTimer.singleShot(LOOK_AFTER_MS, self.devices, self.devices.look)
        QTimer.singleShot(LOOK_AFTER_MS, self.lab_and_designer, self.lab_and_designer.preload)

    def show_bug(self, error: BaseException) -> bool:
        """Show an exception that no slot caught, once, unless a session shows it; return that it is printed, too."""
        bug, said = bug_words(error), error is self.window.not_opened
        if self.live is None and self.window.isVisible() and not said and bug not in self._bugs:
            self._bugs.add(bug)
            self.window.show_message("The last action failed", bug)
        return False

    def _ask_for_workspace(self) -> None:
        """Ask once which folder holds protocols and results; until it is answered the offered one is used."""
        asked = self.question = WorkspaceDialog(self.window, self.window.theme, offered_workspace().folder)
        asked.accepted.connect(lambda: self._choose_workspace(asked.folder))
        asked.finished.connect(asked.deleteLater)
        asked.open()

    def _choose_workspace(self, folder: Path) -> None:
        try:
            create_workspace(Workspace(folder.absolute()))
        except StoreError as error:
            self.window.show_message("This folder cannot be used as the workspace", f"{error}.")
            return
        self.machine.change({"workspace": str(folder.absolute())})
        self.check_computer()

    def check_computer(self) -> None:
        """Open the check of this computer, and measure."""
        from study_app.app.computer_check import ComputerCheck  # noqa: PLC0415 - only where it is asked for

        screens = QGuiApplication.screens()
        participants = screens[screen_number(self.machine.settings) - 1]
        self.check = ComputerCheck(self.window, self.window.theme, self.results, participants)
        self.check.window.open()
        self.check.measure()

    def _machine(self) -> MachinePlace:
        made = self.machine.make_place()
        made.check_asked.connect(self.check_computer)
        return made

    def _home(self) -> HomePlace:
        made = HomePlace(self.results, _draft_words)
        made.session_asked.connect(self._start)
        made.results_asked.connect(self._show_study)
        made.protocol_opened.connect(self.machine.remember_protocol)
        made.edit_asked.connect(self.lab_and_designer.open_designer)
        made.new_asked.connect(self.lab_and_designer.begin_study)
        made.device.display_asked.connect(self._test_display)
        made.show_machine(self.machine.settings, self.devices.preferred)
        self._home_place = made
        return made

    def _show_machine(self) -> None:
        """Show the settings and the state of the preferred device on the home page."""
        if self._home_place is not None:
            self._home_place.show_machine(self.machine.settings, self.devices.preferred)

    def _machine_changed(self, settings: MachineSettings) -> None:
        """Follow what is set for this machine, as far as nothing else was asked for by command."""
        self.window.show_theme(theme_named(settings.theme))
        here = workspace()
        if self._follows_machine and here.results != self.results and self._home_place is not None:
            self.results = here.results
            self._home_place.show_results(self.results)
            if self.results_controller is not None:
                self.results_controller.show_results(self.results)
            self.lab_and_designer.show_results(self.results)
        self._show_machine()

    def _test_display(self) -> None:
        """Open the display test; home has gone to the machine's place."""
        if self.machine.place is not None:
            self.machine.place.open_test()

    def _show_study(self, folder: Path) -> None:
        self.window.place("results")
        assert self.results_controller is not None  # noqa: S101 - made with its place
        self.results_controller.choose(folder)
        self.window.go("results")

    def _results(self) -> ResultsPlace:
        from study_app.app.results_controller import ResultsController  # noqa: PLC0415 - only once it is needed

        self.results_controller = ResultsController(self.results)
        self.results_controller.place.version_asked.connect(self.lab_and_designer.show_version)
        return self.results_controller.place

    def _help(self) -> HelpPlace:
        from study_app.gui.help.view import HelpPlace  # noqa: PLC0415 - only once it is needed

        self.help = HelpPlace()
        return self.help

    def show_help(self) -> None:
        """Go to the page of the documentation that is about the place one is at."""
        here = self.window.here
        self.window.place("help")
        assert self.help is not None  # noqa: S101 - made with its place
        self.help.open_from(here)
        self.window.go("help")

    def _show_saved(self) -> None:
        if self._home_place is not None:
            self._home_place.show_studies()

    def end(self) -> None:
        """Let go of what the places hold, and wait for what is under way in other threads: a device may be opening.

        After a signal the program waits for 2 s at most; a device that is still being opened then gets no force.
        """
        patience = Patience(BY_SIGNAL_S if self.code else OPENING_PATIENCE_S)
        if self._home_place is not None:
            self._home_place.end()
        self.lab_and_designer.end(patience)
        self.devices.end(patience.left_s)
        for live in self._called_off:
            live.wait(patience.left_s)
        wait_for_jobs(min(patience.left_s, JOBS_PATIENCE_S))

    def end_by_signal(self, number: int) -> None:
        self.code = 128 + number
        if self.live is not None:
            self.live.end_by_signal(number)
        self.lab_and_designer.end_by_signal(number)
        self.window.close()
        self.loop.quit()

    def _start(self, chosen: NewSession) -> None:
        if self.live is not None:
            return
        self.machine.remember_operator(chosen.operator)
        self.live = LiveSession(chosen, self.window.theme, asks=True)
        self.live.over.connect(self._return)
        self.window.rest()
        self.live.open()

    def _return(self) -> None:
        live, self.live = self.live, None
        if live is None:
            return
        self._called_off = [earlier for earlier in (*self._called_off, live) if earlier.opening]
        if self.code:
            return
        if live.theme is not self.window.theme:  # it was changed in the cockpit
            self.machine.change({"theme": live.theme.name})
        self.window.come_back()
        if live.error is not None:
            title = "The session did not finish" if live.began else "The session did not start"
            self.window.show_message(title, f"{live.error}.")
        elif live.code == BUG:
            self.window.show_message("A bug in the program stopped the session", "The terminal shows the details.")

    def _leave(self) -> None:
        if self.live is None:
            self.loop.quit()


def _draft_words() -> DraftWords:
    from study_app.designer.versions import draft_words  # noqa: PLC0415 - only where there is a draft

    return draft_words

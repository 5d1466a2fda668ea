"""The controller of the main window: its pages, the settings of this machine, one session at a time."""

from __future__ import annotations

import gc
from collections.abc import Callable
from datetime import date
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEventLoop, QObject, QTimer, Signal
from PySide6.QtGui import QGuiApplication, QKeySequence, QShortcut

from study_app.app.compilation import Compilation
from study_app.app.failures import (
    BUG,
    BY_SIGNAL_S,
    OPENING_PATIENCE_S,
    Patience,
    UncaughtExceptions,
    ending_on_signals,
    guard_painting,
)
from study_app.app.timing import collecting_in_this_thread
from study_app.devices.registry import descriptor_of
from study_app.errors import DeviceError, StoreError, StudyError
from study_app.gui.application import application_here
from study_app.gui.devices import DevicesPlace
from study_app.gui.display import place_window
from study_app.gui.home import DraftWords, HomePlace, MainWindow, WorkspaceDialog, bug_sentence
from study_app.gui.kit import add_commands, device_named, screen_number, settings_here, theme_named
from study_app.gui.settings.view import MachinePlace
from study_app.gui.widgets import Background, Place, wait_for_jobs
from study_app.protocol.source import protocol_file
from study_app.session.start import NewSession
from study_app.store import workstation
from study_app.store.versions import content_changes, recorded_contents
from study_app.store.workstation import DisplayOffset, MachineSettings, create_workspace
from study_app.user_folder import settings_file
from study_app.workspace import Workspace, chosen_workspace, offered_workspace, workspace

if TYPE_CHECKING:
    from study_app.app.lab_controller import LabController
    from study_app.app.session.live_session import LiveSession
    from study_app.app.session.playing import Playing
    from study_app.app.session.preflight_controller import ComputerCheck
    from study_app.designer.controller import DesignerController
    from study_app.designer.participant.playable import LabLiquids
    from study_app.designer.window import DesignerPlace
    from study_app.gui.help.view import HelpPlace
    from study_app.gui.lab import LabPlace
    from study_app.gui.results.view import ResultsPlace
    from study_app.gui.sessions.session_facts import SessionFacts
    from study_app.lab.ab_comparison import Setting, Side


class WorkstationController(QObject):
    """Holds the settings of this machine, stores changes at once, and can undo them.

    ``changed`` is emitted when a setting changes; ``troubled(title, sentence)`` if settings cannot be read or stored.
    """

    changed = Signal(object)
    troubled = Signal(str, str)

    def __init__(self) -> None:
        super().__init__()
        self.settings, self.trouble = settings_here()
        self._undo_stack: list[tuple[str, MachineSettings]] = []
        self.place: MachinePlace | None = None

    def make_place(self) -> MachinePlace:
        place = self.place = MachinePlace()
        place.changed.connect(self.change_settings)
        place.offset_measured.connect(self.store_display_offset)
        place.undo_asked.connect(self.undo)
        self._show_settings()
        return place

    def change_settings(self, values: dict[str, Any]) -> None:
        current = {name: getattr(self.settings, name) for name in MachineSettings.model_fields}
        settings = MachineSettings.model_validate(current | values)
        if settings == self.settings:
            self._show_settings()
            return
        changed = next(iter(values)).removesuffix("_mm").replace("_", " ").replace("lsl", "LSL")
        self._undo_stack.append((changed, self.settings))
        self._save_settings(settings)

    def remember_operator(self, operator: str) -> None:
        """Store the operator's initials as the default of the next session, without undo."""
        if operator and operator != self.settings.operator:
            self._save_settings(self.settings.model_copy(update={"operator": operator}))

    def remember_protocol(self, protocol: Path) -> None:
        """Store a protocol file among the recent ones, without undo."""
        settings = self.settings.with_recent(protocol)
        if settings != self.settings:
            self._save_settings(settings)

    def store_display_offset(self, mean_ms: float, spread_ms: float, how: str, screen: str) -> None:
        offset = {"mean_ms": mean_ms, "spread_ms": spread_ms, "how": how, "screen": screen}
        self.change_settings(
            {"display_offset": DisplayOffset.model_validate(offset | {"measured": date.today().isoformat()})}
        )

    def undo(self) -> None:
        if self._undo_stack:
            kept = {"operator": self.settings.operator, "recent": self.settings.recent}
            self._save_settings(self._undo_stack.pop()[1].model_copy(update=kept))

    @property
    def undo_name(self) -> str:
        """The name of the change that undo reverts, or ""."""
        return self._undo_stack[-1][0] if self._undo_stack else ""

    def _save_settings(self, settings: MachineSettings) -> None:
        self.settings = settings
        try:
            workstation.save_settings(settings)
        except StoreError as error:
            self.troubled.emit("This machine's settings could not be saved", f"{error}.")
        self._show_settings()
        self.changed.emit(settings)

    def _show_settings(self) -> None:
        if self.place is not None:
            self.place.show_settings(
                self.settings,
                folder=str(workspace().folder.absolute()),
                undo=self.undo_name,
                kept_in=str(settings_file()),
            )


def load_modules() -> None:
    """Import the modules of session, lab, designer and compiler, and compute what the first page of a session needs."""
    import study_app.app.lab_controller  # noqa: PLC0415
    import study_app.app.session.playing  # noqa: PLC0415
    import study_app.gui.watch.window  # noqa: PLC0415
    import study_app.lab.live  # noqa: F401, PLC0415
    from study_app.gui.participant.tank.glass import brightness  # noqa: PLC0415
    from study_app.protocol.file_format import schema  # noqa: PLC0415

    brightness()
    schema()
    gc.freeze()  # so that collections skip the loaded objects


LOOK_AFTER_MS = 300  # after this time, the window is painted
_JOBS_PATIENCE_S = 5.0


def run_home_window(
    results: Path | None = None, *, then: Callable[[MainController], None] = lambda _visit: None
) -> int:
    """Open the main window; return the exit code when it is closed.

    ``results`` is the results folder, by default that of the workspace. ``then`` is called once the window is open.

    Raises
    ------
    DisplayError
        No window can be opened here.
    """
    application = application_here()
    controller = MainController(results)
    uncaught = UncaughtExceptions(controller.show_bug)
    with collecting_in_this_thread(), ending_on_signals(controller.end_by_signal), uncaught:
        controller.open()
        controller.compile_when_loaded()
        then(controller)
        controller.loop.exec()
    controller.end()
    application.processEvents()
    return controller.code


def _with_guarded_painting(make: Callable[[], Place]) -> Callable[[], Place]:
    def guarded() -> Place:
        page = make()  # imports the page's classes
        guard_painting()
        return page

    return guarded


class MainController(QObject):
    """Controls the main window, which is hidden during a session and shown again afterwards."""

    def __init__(self, results: Path | None = None) -> None:
        super().__init__()
        self.machine = WorkstationController()
        self._follows_machine = results is None
        self.results = results if results is not None else workspace().results
        self.question: WorkspaceDialog | None = None
        self.check: ComputerCheck | None = None
        makers: dict[str, Callable[[], Place]] = {
            "home": self._make_home_place,
            "designer": self._make_designer_place,
            "results": partial(self._with_commands, self._make_results_place),
            "lab": partial(self._with_commands, self._make_lab_place),
            "devices": partial(self._with_commands, self._make_devices_place),
            "machine": partial(self._with_commands, self._make_machine_place),
            "help": partial(self._with_commands, self._make_help_place),
        }
        self.window = MainWindow(
            {name: _with_guarded_painting(make) for name, make in makers.items()},
            theme=theme_named(self.machine.settings.theme),
        )
        self.window.place("devices")  # the home page shows its results before its first visit
        self.loop = QEventLoop()
        self.code = 0
        self.live: LiveSession | None = None
        self.designer: DesignerController | None = None
        self.playing: Playing | None = None
        self.lab: LabController | None = None
        self._loading = Background(self)
        self.compilation = Compilation(self)
        self.help: HelpPlace | None = None
        self._called_off: list[LiveSession] = []
        self._bugs: set[str] = set()
        self.results_place: ResultsPlace | None = None
        self.window.closed.connect(lambda: self.loop.quit() if self.live is None else None)
        self.window.theme_changed.connect(lambda theme: self.machine.change_settings({"theme": theme.name}))
        self.machine.changed.connect(self._apply_settings)
        QShortcut(QKeySequence(QKeySequence.StandardKey.HelpContents), self.window, self.show_help)
        self.machine.troubled.connect(self.window.show_message)
        self.devices.troubled.connect(self.window.show_message)
        self._opened = QTimer(self, singleShot=True, interval=LOOK_AFTER_MS)
        self._opened.timeout.connect(self.devices.look_for_devices)
        self._opened.timeout.connect(self.preload)

    def open(self) -> None:
        """Show the window, no larger than the screen; then search for devices."""
        place_window(self.window, self.window.screen(), corner=False)
        self.window.show()
        if self.machine.trouble:
            self.window.show_message("The default settings are being used", f"{self.machine.trouble}.")
        elif self._follows_machine and chosen_workspace() is None:
            dialog = self.question = WorkspaceDialog(self.window, self.window.theme, offered_workspace().folder)
            dialog.accepted.connect(lambda: self._choose_workspace(dialog.folder))
            dialog.finished.connect(dialog.deleteLater)
            dialog.open()
        self._opened.start()

    def show_bug(self, error: BaseException) -> bool:
        """Show an unhandled exception once, unless a session is running; return False, so that it is also printed."""
        bug, is_shown = bug_sentence(error), error is self.window.not_opened
        if self.live is None and self.window.isVisible() and not is_shown and bug not in self._bugs:
            self._bugs.add(bug)
            self.window.show_message("The last action failed", bug)
        return False

    def _choose_workspace(self, folder: Path) -> None:
        try:
            create_workspace(Workspace(folder.absolute()))
        except StoreError as error:
            self.window.show_message("This folder cannot be used as the workspace", f"{error}.")
            return
        self.machine.change_settings({"workspace": str(folder.absolute())})
        self.check_computer()

    def check_computer(self) -> None:
        from study_app.app.session.preflight_controller import ComputerCheck  # noqa: PLC0415 - only on demand

        screens = QGuiApplication.screens()
        participants = screens[screen_number(self.machine.settings) - 1]
        self.check = ComputerCheck(self.window, self.window.theme, self.results, participants)
        self.check.window.open()
        self.check.measure()

    def _make_machine_place(self) -> MachinePlace:
        page = self.machine.make_place()
        page.check_asked.connect(self.check_computer)
        return page

    def preload(self) -> None:
        """Import the modules of session, lab and designer in the background, so that they open without delay."""
        self._loading.run(load_modules)

    def compile_when_loaded(self) -> None:
        """Compile the force model in the background, once the modules are loaded."""
        self._loading.done.connect(self.compilation.start)

    def _make_lab_place(self) -> LabPlace:
        self._loading.wait()  # two threads must not import the same modules
        from study_app.app.lab_controller import LabController  # noqa: PLC0415 - imports pyqtgraph, so only on demand
        from study_app.gui.lab import LabPlace  # noqa: PLC0415

        page = LabPlace()
        settings = self.machine.settings
        self.lab = LabController(page, device=settings.device, options=settings.device_options)
        page.put_back_asked.connect(self._put_liquid_back)
        page.asked.connect(self._prepare_lab_request)
        return page

    def _prepare_lab_request(self, request: str, _details: object) -> None:
        if request in {"enter", "device", "fade in"}:
            self.devices.end_diagnosis()  # the diagnosis would hold the device
        elif request == "diagnose" and self.lab is not None:
            self.devices.diagnose(self.lab.device)

    def _put_liquid_back(self, side: Side, setting: Setting) -> None:
        if self.designer is not None:
            self.designer.feeling.put_liquid_back(side, setting)

    def _make_designer_place(self) -> DesignerPlace:
        self._loading.wait()
        from study_app.app.session.playing import Playing  # noqa: PLC0415 - only on demand
        from study_app.designer.controller import DesignerController  # noqa: PLC0415

        self.designer = DesignerController(self.results)
        self.playing = Playing(self.designer)
        for saved in (self.designer.saving.saved, self.playing.kept):
            saved.connect(self._home_place.show_studies)
        self.designer.feeling.asked.connect(self._feel_liquids)
        self.designer.place.form.foot.glossary.clicked.connect(lambda: self.show_help("glossary"))
        self.designer.place.keys_asked.connect(lambda: self.show_help("designer-keys"))
        self.designer.editing.opened_other.connect(self._forget_study)
        self.designer.feeling.returned.connect(lambda: self.window.go("designer"))
        return self.designer.place

    def open_designer(self, source: str) -> None:
        self._go_to_designer(lambda designer: designer.open(source))

    def discard_draft(self, source: str) -> None:
        """Show a draft in the designer and discard it; the designer asks first if the study was never saved."""
        self._go_to_designer(
            lambda designer: designer.open(source), lambda designer: designer.saving.answer_banner("discard")
        )

    def show_version(self, session: SessionFacts) -> None:
        """Open the designer with the changes since a session; without the study's file, list those between sessions."""
        try:
            protocol_file(session.study)
        except StudyError:
            changes = content_changes(recorded_contents(session.folder.parents[2]))
            texts = [f"Version {after.name}: {'; '.join(sentences)}." for after, sentences in changes]
            self.window.show_message(
                f"{session.study}: changes between sessions",
                "\n".join(texts) or "All sessions were run with the same study file.",
            )
            return
        self._go_to_designer(
            lambda designer: designer.open(session.study),
            lambda designer: designer.changes.compare_with_session(session.study, session.folder),
        )

    def begin_new_study(self, source: str = "", name: str = "") -> None:
        """Open the designer's page for new studies, or with ``name`` create the study at once."""
        self._go_to_designer(
            lambda designer: designer.show_new_page(source),
            lambda designer: designer.begin_study(source, name) if name else None,
        )

    def _go_to_designer(self, *actions: Callable[[DesignerController], object]) -> None:
        self.window.go("designer")
        assert self.designer is not None  # noqa: S101 - otherwise the window has shown and raised the error
        for action in actions:
            action(self.designer)

    def _feel_liquids(self, liquids: LabLiquids) -> None:
        self.window.go("lab")
        assert self.lab is not None  # noqa: S101 - as above
        self.lab.feel_study_liquids(liquids.a, liquids.b, liquids.study)

    def _forget_study(self) -> None:
        """Stop offering to put changes in the lab back, because another study is open in the designer."""
        if self.lab is not None:
            self.lab.study = ""

    def _with_commands(self, make: Callable[[], Place]) -> Place:
        """Create a page, and add the keys for the home page and a new study."""
        page = make()
        begin_new = partial(self._go_to_designer, lambda designer: designer.place.begin_new())
        add_commands(page, {"home": partial(self.window.go, "home"), "new": begin_new})
        return page

    def _make_home_place(self) -> HomePlace:
        page = HomePlace(self.results, _draft_words)
        page.session_asked.connect(self._start_session)
        page.results_asked.connect(self.show_study)
        page.protocol_opened.connect(self.machine.remember_protocol)
        page.edit_asked.connect(self.open_designer)
        page.discard_asked.connect(self.discard_draft)
        page.new_asked.connect(self.begin_new_study)
        page.device.display.clicked.connect(self._test_display)
        self._home_place = page
        return page

    def _make_devices_place(self) -> DevicesPlace:
        self.devices = DevicesPlace(self.machine.settings)
        self.devices.changed.connect(self.machine.change_settings)
        self.devices.looked.connect(self._show_machine)
        self._show_machine()
        return self.devices

    def _show_machine(self) -> None:
        """Show the settings and the preferred device on the home page."""
        settings = self.machine.settings
        self._home_place.show_machine(settings, device_named(settings.device, self.devices.shown))

    def _apply_settings(self, settings: MachineSettings) -> None:
        """Apply changed settings of this machine, except a results folder that the command line overrides."""
        self.window.show_theme(theme_named(settings.theme))
        results = workspace().results
        if self._follows_machine and results != self.results:
            self.results = results
            self._home_place.show_results(self.results)
            if self.results_place is not None:
                self.results_place.show_results(self.results)
            if self.designer is not None:
                self.designer.editing.results = self.results
        self.devices.show_settings(settings)
        self._show_machine()

    def _test_display(self) -> None:
        """Open the display test on the machine page."""
        if self.machine.place is not None:
            self.machine.place.open_test()

    def show_study(self, folder: Path) -> None:
        """Go to the results of a study."""
        self.window.place("results")
        assert self.results_place is not None  # noqa: S101 - just made
        self.results_place.choose_study(folder)
        self.window.go("results")

    def _make_results_place(self) -> ResultsPlace:
        from study_app.gui.results.view import ResultsPlace  # noqa: PLC0415 - only on demand

        self.results_place = ResultsPlace(self.results)
        self.results_place.version_asked.connect(self.show_version)
        return self.results_place

    def _make_help_place(self) -> HelpPlace:
        from study_app.gui.help.view import HelpPlace  # noqa: PLC0415 - only on demand

        self.help = HelpPlace()
        return self.help

    def show_help(self, page: str = "") -> None:
        origin = self.window.here
        self.window.place("help")
        assert self.help is not None  # noqa: S101 - created with the page
        self.help.open_from(origin)
        if page:
            self.help.open_page(page)
        self.window.go("help")
        self.help.reader.setFocus()

    def end(self) -> None:
        """Release everything that the pages hold, and wait for jobs in other threads, such as opening a device.

        After a signal, wait for at most 2 s; a device that is still being opened does not exert force.
        """
        patience = Patience(BY_SIGNAL_S if self.code else OPENING_PATIENCE_S)
        self._opened.stop()  # since it would start a thread that outlives Python
        self.compilation.close()
        self._home_place.end()
        for part in (self.playing, self.lab):
            if part is not None:
                part.end(patience)
        self.devices.stop_looking(patience.left_s)
        for live in self._called_off:
            live.wait(patience.left_s)
        wait_for_jobs(min(patience.left_s, _JOBS_PATIENCE_S))

    def end_by_signal(self, number: int) -> None:
        self.code = 128 + number
        if self.live is not None:
            self.live.end_by_signal(number)
        if self.playing is not None:
            self.playing.end_by_signal(number)
        self.window.close()
        self.loop.quit()

    def _start_session(self, chosen: NewSession) -> None:
        if self.live is not None:
            return
        self._loading.wait()  # two threads must not import the same modules
        from study_app.app.session.live_session import LiveSession  # noqa: PLC0415 - only for sessions

        self.devices.end_diagnosis()  # the diagnosis would hold the device
        self.machine.remember_operator(chosen.operator)
        self.live = LiveSession(chosen, self.window.theme, asks=True, compilation=self.compilation)
        self.live.over.connect(self._return_from_session)
        self.window.hide_for_session()
        self.live.open()

    def _return_from_session(self) -> None:
        live, self.live = self.live, None
        if live is None:
            return
        self._called_off = [earlier for earlier in (*self._called_off, live) if earlier.is_opening]
        if self.code:
            return
        if live.theme is not self.window.theme:  # the theme may have been changed in the operator's window
            self.machine.change_settings({"theme": live.theme.name})
        if live.has_begun and self.results_place is not None:
            self.results_place.choose_study(live.chosen.results)
        self.window.return_from_session()
        if isinstance(live.error, DeviceError) and not live.has_begun:
            name = live.chosen.device
            is_diagnosable = descriptor_of(name).doctor is not None
            self.window.ask_about_device(
                "The session did not start",
                f"{live.error}.",
                partial(self._start_session, live.chosen),
                partial(self.devices.diagnose, name) if is_diagnosable else None,
            )
        elif live.error is not None:
            title = "The session did not finish" if live.has_begun else "The session did not start"
            self.window.show_message(title, f"{live.error}.")
        elif live.code == BUG:
            self.window.show_message("A bug in the program stopped the session", "The terminal shows the details.")


def _draft_words() -> DraftWords:
    from study_app.designer import version_rows  # noqa: PLC0415 - only for drafts

    return version_rows

"""Where device, servo, store, session and windows meet: the two ways to open the program.

However a session's windows go away (its end, Ctrl+C, a signal, a failure in here), the servo is stopped with zero force
and the journal is closed with a status. Nothing is created on the disk before device and servo are ready.
"""

from __future__ import annotations

import signal
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from study_app.errors import SessionError, StudyError
from study_app.gui.display import check_display, missing_library

try:
    from PySide6.QtCore import QEventLoop, QObject, Qt, QTimer, Signal
    from PySide6.QtGui import QGuiApplication
    from PySide6.QtWidgets import QApplication

    from study_app.gui.home import HomeWindow
    from study_app.gui.icons import logo
    from study_app.gui.new_session import SIMULATED_DEVICE, NewSession, draw_seed, study_results
    from study_app.gui.opening import OpeningWindow
    from study_app.gui.screens import choose_screens, describe_screen, place
    from study_app.gui.theme import LIGHT, Theme
except ImportError as missing:
    raise missing_library(missing) from missing

from study_app.devices import list_devices, open_device
from study_app.protocol.load import load, parse, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.schedule import build_schedule, stream
from study_app.store.description import check_study
from study_app.store.journal import SessionClock
from study_app.store.layout import StudyFolder, check_participant, check_unused
from study_app.store.session import SessionStore, begin

if TYPE_CHECKING:
    from study_app.devices.base import Device
    from study_app.gui.bridge import SessionBridge
    from study_app.haptics.servo import Servo

HEARTBEAT_MS = 100  # how long a signal may wait to be heard
CANCELLED = 130
BUG = 1


def home(results: Path | None = None) -> int:
    """Open the home window on the results folder (default ``results``); return the exit code when it is closed.

    Raises
    ------
    DisplayError
        A window cannot be opened here.
    """
    application = _application()
    visit = _Visit(HomeWindow(results if results is not None else Path("results")))
    with _signals(visit.end_by_signal):
        visit.window.show()
        visit.loop.exec()
    application.processEvents()
    return visit.code


def run(
    protocol: str,
    *,
    participant: str,
    session: int = 1,
    seed: int | None = None,
    device: str = "mouse",
    language: str | None = None,
    operator: str = "",
    windowed: bool = False,
    screen: int | None = None,
    results: Path | None = None,
) -> int:
    """Run a session without dialogs; return the exit code when its windows are closed.

    Parameters
    ----------
    protocol : file or name of a protocol
    participant, session, operator : who, for the how-manieth time, and who runs it
    seed : default: drawn, shown and recorded
    device, language : default: the mouse, the protocol's first language
    windowed, screen : where the participant's window opens; screens count from 1
    results : the study's folder; default ``results/<study>``

    Raises
    ------
    StudyError
        The session could not begin, and then nothing was created; or device or servo failed while it ran.
    """
    study = load(protocol)
    chosen = NewSession(
        source=protocol,
        participant=participant,
        session=session,
        seed=draw_seed() if seed is None else seed,
        operator=operator,
        language=study.study.languages[0] if language is None else language,
        device=device,
        windowed=windowed,
        screen=screen,
        results=study_results(Path("results"), study.study.name, device) if results is None else Path(results),
    )
    _check(chosen, study)
    _application()
    live = LiveSession(chosen, LIGHT)
    loop = QEventLoop()
    live.over.connect(loop.quit)
    with _signals(live.end_by_signal):
        QTimer.singleShot(0, live.open)
        loop.exec()
    if live.error is not None:
        raise live.error
    return live.code


@dataclass(frozen=True, slots=True)
class _Machine:
    """Device and servo, running at rest."""

    device: Device
    servo: Servo

    def stop(self) -> None:
        """Zero force, then let go of the device."""
        try:
            self.servo.stop()
        finally:
            self.device.close()


class LiveSession(QObject):
    """One session from the operator's choices to the closed journal.

    ``over`` comes once; then ``code`` is the exit code and ``error`` what could not be mended here, if anything.
    """

    over = Signal()
    _ready = Signal(object)

    def __init__(self, chosen: NewSession, theme: Theme) -> None:
        super().__init__()
        self.chosen = chosen
        self.theme = theme
        self.code = 0
        self.error: StudyError | None = None
        self.bridge: SessionBridge | None = None
        self.note: OpeningWindow | None = None
        self._machine: _Machine | None = None
        self._store: SessionStore | None = None
        self._closed = False
        self._working = False
        self._ready.connect(self._begin, Qt.ConnectionType.QueuedConnection)

    def open(self) -> None:
        """Show the note, and make device and servo ready beside it."""
        who = f"Participant {self.chosen.participant}  ·  session {self.chosen.session}  ·  seed {self.chosen.seed}"
        self.note = OpeningWindow(f"Preparing {Path(self.chosen.source).stem}", who, theme=self.theme)
        self.note.cancelled.connect(self._cancel)
        place(self.note, self.note.screen(), corner=False)
        self.note.show()
        self._working = True
        threading.Thread(target=self._make_ready, name="opening", daemon=True).start()

    def end_by_signal(self, number: int) -> None:
        """End because the program is being ended from outside."""
        self.code = 128 + number
        if self.bridge is not None:
            self.bridge.end_now(f"ended from outside ({signal.Signals(number).name})")
        else:
            self._close()

    def _make_ready(self) -> None:
        """Compile, open and start, in a thread of its own; whatever comes of it goes to ``_begin``."""
        try:
            made: object = _open_machine(self.chosen, load(self.chosen.source))
        except Exception as error:  # noqa: BLE001 - handed over, not swallowed: a thread has nobody to raise it to
            made = error
        self._ready.emit(made)

    def _begin(self, made: object) -> None:
        """Claim the session on the disk and open the two windows."""
        self._working = False
        if isinstance(made, _Machine):
            self._machine = made
        if self._closed:
            self._let_go()
            self.deleteLater()
            return
        try:
            self._open_windows(made)
        except StudyError as error:
            self.error = error
            self._close()
        except Exception:  # noqa: BLE001 - told to the terminal; what is open must be closed in order
            traceback.print_exc()
            self.code = BUG
            self._close()

    def _open_windows(self, made: object) -> None:
        """Go on with what the thread made ready, or raise what it met."""
        if not isinstance(made, _Machine):
            raise made if isinstance(made, Exception) else TypeError(made)
        from study_app.gui.session_windows import open_windows  # noqa: PLC0415 - pyqtgraph: only once it is needed

        device, servo = made.device, made.servo
        source = source_bytes(self.chosen.source)
        protocol = parse(source, self.chosen.source)
        schedule = build_schedule(protocol, self.chosen.participant, self.chosen.seed)
        shown_on, operated_on = choose_screens(self.chosen.screen)
        self._store = begin(
            self.chosen.results,
            protocol,
            source,
            self.chosen.participant,
            session=self.chosen.session,
            seed=self.chosen.seed,
            operator=self.chosen.operator,
            language=self.chosen.language,
            device=device.describe() | servo.describe(),
            screens={"participant": describe_screen(shown_on), "operator": describe_screen(operated_on)},
            simulated=self.chosen.device == SIMULATED_DEVICE,
            clock=SessionClock(servo.now_ns),
        )
        self.bridge = open_windows(self.chosen, protocol, schedule, self._store, device, servo, self.theme)
        self.bridge.done.connect(self._finished)
        self._close_note()
        self.bridge.start()

    def _finished(self) -> None:
        """Hear that the windows are gone; keep what broke, for whoever asked for the session."""
        assert self.bridge is not None  # noqa: S101 - it has just spoken
        self.theme = self.bridge.operator.theme
        trouble = self.bridge.trouble or self.bridge.parts.journal.progress.broke
        if trouble and isinstance(self.bridge.failure, StudyError | None):
            self.error = StudyError(f"the session was stopped: {trouble}; what was answered before is on the disk")
        elif trouble:
            self.code = BUG
        self._close()

    def _cancel(self) -> None:
        self.code = CANCELLED
        self._close()

    def _close(self) -> None:
        """Let go of everything, in the order of safety, and say that it is over, once."""
        if self._closed:
            return
        self._closed = True
        self._close_note()
        self._let_go()
        self.over.emit()
        if not self._working:
            self.deleteLater()

    def _close_note(self) -> None:
        note, self.note = self.note, None
        if note is not None:
            note.finish()
            note.deleteLater()

    def _let_go(self) -> None:
        machine, self._machine = self._machine, None
        store, self._store = self._store, None
        try:
            if machine is not None:
                machine.stop()
        finally:
            if store is not None:
                store.close()


class _Visit(QObject):
    """The home window's stay: one session at a time, and home again after it."""

    def __init__(self, window: HomeWindow) -> None:
        super().__init__()
        self.window = window
        self.loop = QEventLoop()
        self.code = 0
        self.live: LiveSession | None = None
        window.session_asked.connect(self._start)
        window.closed.connect(self._leave)

    def end_by_signal(self, number: int) -> None:
        """End because the program is being ended from outside."""
        self.code = 128 + number
        if self.live is not None:
            self.live.end_by_signal(number)
        self.window.close()
        self.loop.quit()

    def _start(self, chosen: NewSession) -> None:
        self.live = LiveSession(chosen, self.window.theme)
        self.live.over.connect(self._return)
        self.window.hide()
        self.live.open()

    def _return(self) -> None:
        live, self.live = self.live, None
        if self.code or live is None:
            return
        self.window.show()
        self.window.show_sessions()
        if live.error is not None:
            self.window.tell("The session did not go to its end", f"{live.error}.")
        elif live.code == BUG:
            self.window.tell("The session was stopped by a mistake in the program", "The terminal shows where.")

    def _leave(self) -> None:
        if self.live is None:
            self.loop.quit()


def _check(chosen: NewSession, study: Protocol) -> None:
    """Refuse what cannot begin before any window opens; nothing is touched."""
    if chosen.device not in list_devices():
        open_device(chosen.device)
    if chosen.language not in study.study.languages:
        known = ", ".join(study.study.languages)
        raise SessionError(
            f"language {chosen.language!r}: {study.study.name} is written in {known}; choose one of these"
        )
    folder = StudyFolder(chosen.results)
    check_participant(chosen.participant)
    check_study(folder, study.study.name)
    check_unused(folder, chosen.participant, chosen.session)


def _open_machine(chosen: NewSession, study: Protocol) -> _Machine:
    """Open the device and start the servo at rest; compiling takes a minute the first time."""
    from study_app.haptics.pack import elements_needed  # noqa: PLC0415 - the compiler: only once it is needed
    from study_app.haptics.servo import Servo  # noqa: PLC0415

    x, y, z = study.device.workspace_m
    options: dict[str, Any] = {"workspace_m": (x / 2, y / 2, z / 2), "force_limit_n": study.device.force_limit_n}
    if chosen.device == SIMULATED_DEVICE:
        options["random"] = stream(chosen.seed, f"run/{chosen.participant}/tremor")
    device = open_device(chosen.device, **options)
    try:
        elements = max(elements_needed(study.scene_for(condition)) for condition in study.conditions)
        servo = Servo(device, rate_hz=study.device.rate_hz, elements=elements)
        servo.start()
    except BaseException:
        device.close()
        raise
    return _Machine(device, servo)


def _application() -> QApplication:
    """Return the application, made on first use."""
    there = QApplication.instance()
    if isinstance(there, QApplication):
        there.setQuitOnLastWindowClosed(False)
        return there
    check_display()
    QGuiApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
    application = QApplication(["liquid-study"])
    application.setApplicationName("liquid-study")
    application.setStyle("Fusion")
    application.setWindowIcon(logo(32, LIGHT.accent, LIGHT.on_accent))
    application.setQuitOnLastWindowClosed(False)
    return application


@contextmanager
def _signals(end: Callable[[int], None]) -> Iterator[None]:
    """Let Ctrl+C and requests to terminate call ``end`` from the event loop, once."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []

    def hear(number: int, _frame: object) -> None:
        if not heard:
            heard.append(number)
            QTimer.singleShot(0, lambda: end(number))

    names = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    before = {number: signal.signal(number, hear) for number in numbers}
    heart = QTimer()
    heart.timeout.connect(lambda: None)  # Python hears signals only while it runs; Qt waits outside it
    heart.start(HEARTBEAT_MS)
    try:
        yield
    finally:
        heart.stop()
        for number, handler in before.items():
            signal.signal(number, handler)

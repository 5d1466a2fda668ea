"""The windows' thread, lent to those who time or soak the servo: painting as in a session, and a timer of Qt's own."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from typing import TypeVar

import numpy as np
from PySide6.QtCore import QCoreApplication, QEventLoop, QObject, Qt, QTimer, Signal

from study_app.app.session.garbage_collection import collecting_here
from study_app.devices.rig import open_rig, study_settings
from study_app.devices.simulated.hand_commands import hand_of
from study_app.evidence.computer import LoadName
from study_app.gui.application import application_here
from study_app.gui.display.screens import choose_screens, place
from study_app.gui.operator import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.protocol.load import load, load_scene
from study_app.protocol.trials.tasks import Explore
from study_app.protocol.wording.languages import words
from study_app.session.pages import TaskPage
from study_app.session.tasks import TaskView
from study_app.session.trial import TankView
from study_app.viewmodels.servo_health import ServoHealth

FRAME_MS, TRACE_MS, TILES_MS = 16, 33, 500
HEARTBEAT_MS = 100  # Python hears Ctrl+C only while it runs; Qt waits outside it
LONGEST_FRAME_TICKS = 100
PATIENCE_S = 0.2

T = TypeVar("T")


@dataclass(slots=True)
class _Firing:
    """A timer that was asked for: every so many milliseconds, so many times."""

    period_ms: int
    left: int
    fire: Callable[[], object]
    start_ns: int = 0
    error: BaseException | None = None
    done: threading.Event = field(default_factory=threading.Event)


class WindowsThread(QObject):
    """The calling thread and its event loop; with ``paints`` both windows of a session are open meanwhile.

    Raises
    ------
    DisplayError
        Windows are to be painted, and none can be opened here.
    """

    _asked = Signal(object)
    _over = Signal()

    def __init__(self, *, paints: bool) -> None:
        super().__init__()
        self._application = application_here() if paints else QCoreApplication.instance() or QCoreApplication([])
        self._painting = Painting() if paints else None
        self._qt_timer = QTimer(self)
        self._qt_timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._qt_timer.timeout.connect(self._fire)
        self._firing: _Firing | None = None
        self._working = False
        self._asked.connect(self._begin, Qt.ConnectionType.QueuedConnection)

    @property
    def frames(self) -> int:
        """How many frames of the tank were painted so far."""
        return self._painting.frames if self._painting is not None else 0

    def during(self, work: Callable[[], T]) -> T:
        """Run ``work`` in another thread while windows live in this one; return what it returns, or raise its error."""
        loop = QEventLoop()
        returned: list[T] = []
        raised: list[BaseException] = []

        def run() -> None:
            try:
                returned.append(work())
            except BaseException as error:  # noqa: BLE001 - handed over, not swallowed
                raised.append(error)
            finally:
                self._working = False
                self._over.emit()

        self._over.connect(loop.quit, Qt.ConnectionType.QueuedConnection)
        thread = threading.Thread(target=run, name="timing")
        heart = QTimer()
        heart.timeout.connect(lambda: None)
        heart.start(HEARTBEAT_MS)
        self._working = True
        with collecting_here():
            if self._painting is not None:
                self._painting.begin()
            thread.start()
            try:
                loop.exec()
            finally:
                thread.join()
                heart.stop()
                self._over.disconnect(loop.quit)
                if self._painting is not None:
                    self._painting.end()
        if raised:
            raise raised[0]
        return returned[0]

    def timer(self, period_ms: int, count: int, fire: Callable[[], object]) -> int:
        """Call ``fire`` from a precise timer of Qt; return when it was started [ns]. For ``work``, in its thread."""
        asked = _Firing(period_ms, count, fire)
        self._asked.emit(asked)
        while not asked.done.wait(PATIENCE_S):
            if not self._working:
                raise RuntimeError("call timer only from the work that the windows' thread runs")
        if asked.error is not None:
            raise asked.error
        return asked.start_ns

    def _begin(self, asked: _Firing) -> None:
        self._firing = asked
        asked.start_ns = time.monotonic_ns()
        self._qt_timer.start(asked.period_ms)

    def _fire(self) -> None:
        firing = self._firing
        if firing is None:
            return
        try:
            firing.fire()
        except Exception as error:  # noqa: BLE001 - handed over to whoever asked
            firing.error = error
        firing.left -= 1
        if firing.left <= 0 or firing.error is not None:
            self._qt_timer.stop()
            self._firing = None
            firing.done.set()


class Painting(QObject):
    """Both windows of a session, painting as in a trial: the ball 60 times a second, the hand's traces 30 times.

    What they show is a servo of their own in virtual time, so that they do the same whatever is timed with them.
    """

    def __init__(self) -> None:
        super().__init__()
        self.frames = 0
        settings = study_settings(load("rek2024"), Random(0))  # noqa: S311 - a hand trembles, it keeps no secrets
        self._rig = open_rig("scripted", settings, clock=VirtualClock())
        hand = hand_of(self._rig.device)
        assert hand is not None  # noqa: S101 - the scripted device has one
        t_s = np.arange(0, 3600, 0.02)
        hand.follow(t_s, np.column_stack((0.03 * np.sin(6 * t_s), 0.01 * np.cos(5 * t_s), 0.02 * np.cos(4 * t_s))))
        self._servo = self._rig.servo
        self._servo.load(load_scene("rek2024", "water"))
        self._reader = self._servo.telemetry.reader()
        self._servo.advance(1)
        self.health = ServoHealth(self._servo.rate_hz)
        self.participant, self.operator = self._windows()
        self.participant.painted.connect(self._painted)
        self._began_ns = 0
        self._timers = [
            self._timer(FRAME_MS, self._frame),
            self._timer(TRACE_MS, self._traces),
            self._timer(TILES_MS, self._tiles),
        ]

    def _windows(self) -> tuple[ParticipantWindow, OperatorWindow]:
        protocol = load("rek2024")
        shown_on, operated_on = choose_screens(None)
        operator = OperatorWindow(
            "timing",
            lateness_limit_s=protocol.limits.lateness_ms / 1000,
            reach_m=max(protocol.device.workspace_m) / 2,
            pointer=False,
        )
        participant = ParticipantWindow(words("en"), clock=time.monotonic, windowed=shown_on is operated_on)
        place(operator, operated_on, corner=shown_on is operated_on)
        task = Explore(kind="explore", min_s=0.0, max_s=3600.0, instruction="The servo is being timed.")
        self._page = TaskPage(1, "The servo is being timed.", task, protocol.device.workspace_m, 0.0034, None)
        return participant, operator

    def begin(self) -> None:
        """Open the windows and paint from now on."""
        self.operator.show()
        self.participant.open_on(choose_screens(None)[0])
        self.participant.show_page(self._page)
        self._began_ns = time.monotonic_ns()
        for timer in self._timers:
            timer.start()

    def end(self) -> None:
        """Close the windows; their objects end here, in their thread."""
        for timer in self._timers:
            timer.stop()
        self._rig.stop()
        self.participant.may_close = self.operator.may_close = True
        for window in (self.participant, self.operator):
            window.close()
            window.deleteLater()

    def _timer(self, interval_ms: int, slot: Callable[[], None]) -> QTimer:
        timer = QTimer(self)
        timer.setInterval(interval_ms)
        if interval_ms == FRAME_MS:
            timer.setTimerType(Qt.TimerType.PreciseTimer)
        timer.timeout.connect(slot)
        return timer

    def _frame(self) -> None:
        """Let the hand go on for as long as the last frame took, and draw where it is."""
        now_ns = self._servo.now_ns()
        behind = (time.monotonic_ns() - self._began_ns) // 1_000_000 - now_ns // 1_000_000
        self._servo.advance(int(min(max(behind, 1), LONGEST_FRAME_TICKS)))
        self.health.take(self._reader.read())
        position_m, shown_ns = self._servo.telemetry.position_at(self._servo.now_ns())
        self.health.hand(self._servo.now_ns() * 1e-9, position_m)
        task = TaskView(lit=None, reached=0, of=None, dwell=0.0, elapsed_s=shown_ns * 1e-9)
        self.participant.show_view(TankView(position_m, task, shown_ns))

    def _painted(self, _sample_ns: int) -> None:
        self.frames += 1
        self.health.frame(time.monotonic_ns())

    def _traces(self) -> None:
        self.operator.show_traces(self.health, self._servo.now_ns() * 1e-9)

    def _tiles(self) -> None:
        self.operator.show_lateness(self.health)


def lend(load_name: LoadName) -> WindowsThread:
    """Return this thread with its event loop, painting unless there is to be no load."""
    return WindowsThread(paints=load_name != "none")

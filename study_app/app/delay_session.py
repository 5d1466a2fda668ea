"""A session without a participant that measures visual delays, with real windows, servo, store and recordings.

It runs exactly as other sessions do: in its trials the scripted hand reaches for targets, and the measurements are read
from the session's recordings.
"""

import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from random import Random
from typing import Final, TypeVar

import numpy as np
from PySide6.QtCore import QCoreApplication, QEventLoop, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication

from study_app.app.failures import ending_on_signals
from study_app.app.session.bridge import (
    SessionBridge,
    connect_windows,
    make_operator_window,
    make_participant_window,
    show_windows,
)
from study_app.app.timing import collecting_in_this_thread
from study_app.devices.hand import hand_of
from study_app.devices.rig import open_rig, study_settings
from study_app.errors import SessionError, StudyError
from study_app.evidence.computer import LoadName, busy_cores
from study_app.evidence.computer import machine as machine_here
from study_app.evidence.timing import BESIDE, DELAYS_S, VIRTUAL_HZ, Delayed, Shown
from study_app.gui.application import application_here
from study_app.gui.display import WITHOUT_OPENGL, choose_screens, place_window
from study_app.gui.operator import OperatorWindow, ServoHealth
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.theme import LIGHT
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.protocol.load import load, load_scene, parse
from study_app.protocol.orders import Schedule, Trial, build_schedule
from study_app.protocol.trials import Explore
from study_app.protocol.wording import words
from study_app.session.pages import TaskPage
from study_app.session.resume import FIRST
from study_app.session.start import NewSession, open_store
from study_app.session.tasks import TankView, TaskView
from study_app.store.recordings import read_frames
from study_app.store.sessions import SessionStore

_SIZE_PX: Final = (1920, 1080)
_OPERATOR_PX: Final = (1600, 900)
LEAST_S, MOST_S = 0.5, 600.0

_STUDY: Final = """
format = 2
sequence = ["delays"]

[study]
name = "delays"
version = "1.0"
languages = ["en"]
resume = "trial"
blinding = "single"
title = "Delays"
description = "How well visual delays are kept."

[device]
rate_hz = 1000
force_limit_n = 8
workspace_mm = [100, 60, 60]

[scene]
scale = 10

[liquids.water]
density_kg_m3 = 1000
effects = ["drag", "wake"]

[liquids.water.wake]
length = 1700
scaling = 1700
exponent = 0.75
{conditions}
[tasks.reach]
kind = "reach"
targets_mm = [[-30, 0, 0], [30, 0, 0]]
radius_mm = 6
dwell_s = 0.25
duration_s = {seconds}
timeout_s = 3600
instruction = "Hold the ball in the lit ring until it closes."

[blocks.delays]
part = 1
title = "Delays"
setting_label = "Delay"
code_prefix = "D"
conditions = [{names}]
task = "reach"

[limits]
delay_error_ms = 25
"""


def study_of_delays(seconds: float) -> bytes:
    """Return a protocol with a trial of ``seconds`` for each delay."""
    names = [f"delay{1e3 * delay_s:.0f}" for delay_s in DELAYS_S]
    conditions = "".join(
        f'\n[conditions.{name}]\nliquid = "water"\ndelay_ms = {1e3 * delay_s:g}\n'
        for name, delay_s in zip(names, DELAYS_S, strict=True)
    )
    quoted_names = ", ".join(f'"{name}"' for name in names)
    return _STUDY.format(conditions=conditions, seconds=seconds, names=quoted_names).encode()


def measure_delays(
    seconds: float, load: LoadName, *, progress: Callable[[str], object] = lambda _line: None
) -> Delayed:
    """Measure each delay for ``seconds`` on virtual screens, and on the real one if there is one.

    Parameters
    ----------
    load : the load of a second run, after one with only the participant's window: "gui" is the operator's window,
        "gui+cpu" adds a busy process on every core, "none" means no second run

    Raises
    ------
    StudyError
        ``seconds`` is out of range, or the session failed.
    DisplayError
        No window can be opened here.
    """
    if not LEAST_S <= seconds <= MOST_S:
        raise StudyError(f"each delay must be shown for {LEAST_S:g} to {MOST_S:g} s, not {seconds:g}")
    application_here()
    rates: list[float | None] = [*VIRTUAL_HZ]
    if QGuiApplication.platformName() not in WITHOUT_OPENGL:
        rates.append(None)
    loads: tuple[LoadName, ...] = ("none",) if load == "none" else ("none", load)
    shown: list[Shown] = []
    with collecting_in_this_thread():
        for refresh_hz in rates:
            for background in loads:
                with (
                    tempfile.TemporaryDirectory() as folder,
                    busy_cores() if background == "gui+cpu" else nullcontext(),
                ):
                    shown.extend(_DelayRun(Path(folder), seconds, refresh_hz, background).run())
                progress(f"{shown[-1].screen}, {BESIDE[background]}")
    return Delayed(machine_here(), seconds, _SIZE_PX, tuple(shown))


class _DelayRun:
    """A session with all delays on a virtual screen of ``refresh_hz``, or on the real one if that is None."""

    def __init__(self, folder: Path, seconds: float, refresh_hz: float | None, load: LoadName) -> None:
        self._refresh_hz, self._load = refresh_hz, load
        self._source = study_of_delays(seconds)
        file = folder / "delays.toml"
        file.write_bytes(self._source)
        self._protocol = parse(self._source, str(file))
        self._chosen = NewSession(
            source=str(file),
            participant="P001",
            session=1,
            seed=1,
            operator="",
            language="en",
            device="scripted",
            windowed=refresh_hz is not None,
            screen=None,
            results=folder / "results",
        )
        self._ended = False

    def run(self) -> tuple[Shown, ...]:
        rig = open_rig(self._chosen.device, study_settings(self._protocol, self._chosen.tremor()))
        schedule = build_schedule(self._protocol, self._chosen.participant, self._chosen.seed)
        try:
            with open_store(self._chosen, self._protocol, self._source, rig, {}) as store:
                operator = make_operator_window(self._chosen, self._protocol, rig, LIGHT)
                screens = choose_screens(self._chosen.screen)
                participant = make_participant_window(
                    self._chosen,
                    store.clock.seconds,
                    shares_screen=screens[0] is screens[1],
                    photodiode=True,
                    in_step=self._refresh_hz is None,
                )
                plan = self._protocol, schedule, FIRST
                rate_hz = self._refresh_hz or screens[0].refreshRate()
                bridge = connect_windows(self._chosen, plan, store, rig, operator, participant, refresh_hz=rate_hz)
                for _ in show_windows(bridge, partial(choose_screens, self._chosen.screen)):
                    pass
                self._resize_windows(bridge)
                self._run_until_finished(bridge)
                paced = bridge.paced
        finally:
            rig.stop()
        if self._ended:
            raise KeyboardInterrupt
        if bridge.trouble:
            raise SessionError(f"the delay session failed: {bridge.trouble}")
        return self._read_delays(store, schedule, paced)

    def _resize_windows(self, bridge: SessionBridge) -> None:
        if self._refresh_hz is not None:
            bridge.participant.setGeometry(0, 0, *_SIZE_PX)
        bridge.operator.resize(*_OPERATOR_PX)
        if self._load == "none":
            bridge.operator.hide()

    def _run_until_finished(self, bridge: SessionBridge) -> None:
        loop = QEventLoop()
        bridge.done.connect(loop.quit)

        def end(_number: int) -> None:
            self._ended = True
            bridge.leave_without_asking()

        def follow(_state: object) -> None:
            if bridge.runner.finished:
                QTimer.singleShot(0, bridge.operator, lambda: bridge.operator.ask("close"))

        bridge.runner.on_change(follow)
        with ending_on_signals(end):
            QApplication.processEvents()  # show the windows before the first trial begins
            bridge.start()
            loop.exec()
        QApplication.processEvents()

    def _read_delays(self, store: SessionStore, schedule: Schedule, paced: str) -> tuple[Shown, ...]:
        refresh_hz = self._refresh_hz or choose_screens(None)[0].refreshRate()
        screen = f"{'virtual' if self._refresh_hz is not None else 'this screen'}, {refresh_hz:.4g} Hz"
        shown = []
        for trial in (step for step in schedule.steps if isinstance(step, Trial)):
            delay_s = self._protocol.delay_s(store.key.codes[trial.block][trial.code])
            path = store.folder.recordings / f"trial-{trial.number:03d}_frames.parquet"
            frames = read_frames(path, store.key.nonce)
            shown.append(
                Shown(screen, paced, self._load, refresh_hz, delay_s, frames["painted_ns"], frames["sample_ns"])
            )
        return tuple(shown)


FRAME_MS, TRACE_MS, TILES_MS = 16, 33, 500
_HEARTBEAT_MS = 100  # how often Python code runs, which lets Python handle Ctrl+C
_LONGEST_FRAME_TICKS = 100

_T = TypeVar("_T")


class WindowsThread(QObject):
    """The GUI thread and its event loop; with a load, both windows of a session are open meanwhile.

    Raises
    ------
    DisplayError
        No window can be opened here, although the load requires one.
    """

    _call_requested = Signal(object)

    def __init__(self, load: LoadName) -> None:
        super().__init__()
        paints = load != "none"
        self._application = application_here() if paints else QCoreApplication.instance() or QCoreApplication([])
        self._painting = _Painting() if paints else None
        self._call_requested.connect(self._call, Qt.ConnectionType.QueuedConnection)

    @property
    def frames(self) -> int:
        return self._painting.frames if self._painting is not None else 0

    def during(self, work: Callable[[], _T]) -> _T:
        """Run ``work`` in another thread while this one runs the event loop; return the result or raise the error."""
        loop, heartbeat = QEventLoop(), QTimer()
        heartbeat.timeout.connect(lambda: None)
        heartbeat.start(_HEARTBEAT_MS)
        with collecting_in_this_thread(), ThreadPoolExecutor(1, thread_name_prefix="timing") as thread:
            if self._painting is not None:
                self._painting.open_windows()
            future = thread.submit(work)
            future.add_done_callback(lambda _future: self._call_requested.emit(loop.quit))
            try:
                loop.exec()
            finally:
                wait((future,))
                heartbeat.stop()
                if self._painting is not None:
                    self._painting.close_windows()
        return future.result()

    def timer(self, period_ms: int, count: int, fire: Callable[[], object]) -> int:
        """Call ``fire`` ``count`` times from a precise Qt timer; return its start time [ns].

        It must be called from another thread, such as by the ``work`` of `during`.
        """
        started: Future[int] = Future()
        self._call_requested.emit(partial(self._start_timer, period_ms, count, fire, started))
        return started.result()

    def _call(self, function: Callable[[], object]) -> None:
        function()

    def _start_timer(self, period_ms: int, count: int, fire: Callable[[], object], started: Future[int]) -> None:
        timer, left, start_ns = QTimer(self, timerType=Qt.TimerType.PreciseTimer), count, time.perf_counter_ns()

        def tick() -> None:
            nonlocal left
            left -= 1
            try:
                fire()
            except Exception as error:  # noqa: BLE001 - passed on to the caller
                timer.stop()
                started.set_exception(error)
            else:
                if left <= 0:
                    timer.stop()
                    started.set_result(start_ns)

        timer.timeout.connect(tick)
        timer.start(period_ms)


class _Painting(QObject):
    """Both windows of a session, which paint as in a trial: the ball 60 times a second, the traces 30 times.

    They show a separate servo in virtual time, so that their work does not depend on the measured servo.
    """

    def __init__(self) -> None:
        super().__init__()
        self.frames = 0
        settings = study_settings(load("rek2024"), Random(0))  # noqa: S311 - a simulated tremor, not a secret
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
        self.participant, self.operator = self._make_windows()
        self.participant.painted.connect(self._count_frame)
        self._started_ns = 0
        self._timers = [
            self._make_timer(FRAME_MS, self._draw_frame),
            self._make_timer(TRACE_MS, lambda: self.operator.show_traces(self.health, self._servo.now_ns() * 1e-9)),
            self._make_timer(TILES_MS, lambda: self.operator.show_lateness(self.health)),
        ]

    def _make_windows(self) -> tuple[ParticipantWindow, OperatorWindow]:
        protocol = load("rek2024")
        participant_screen, operator_screen = choose_screens(None)
        operator = OperatorWindow(
            "timing",
            lateness_limit_s=protocol.limits.lateness_ms / 1000,
            reach_m=max(protocol.device.workspace_m) / 2,
            pointer=False,
        )
        participant = ParticipantWindow(
            words("en"), clock=time.perf_counter, windowed=participant_screen is operator_screen
        )
        place_window(operator, operator_screen, corner=participant_screen is operator_screen)
        task = Explore(kind="explore", min_s=0.0, max_s=3600.0, instruction="Measuring the timing of the servo.")
        self._page = TaskPage(
            trial=1,
            instruction="Measuring the timing of the servo.",
            task=task,
            workspace_m=protocol.device.workspace_m,
            body_radius_m=0.0034,
            progress=None,
        )
        return participant, operator

    def open_windows(self) -> None:
        self.operator.show()
        self.participant.open_on(choose_screens(None)[0])
        self.participant.show_page(self._page)
        self._started_ns = time.perf_counter_ns()
        for timer in self._timers:
            timer.start()

    def close_windows(self) -> None:
        """Close the windows, in the thread that created them."""
        for timer in self._timers:
            timer.stop()
        self._rig.stop()
        self.participant.may_close = self.operator.may_close = True
        for window in (self.participant, self.operator):
            window.close()
            window.deleteLater()

    def _make_timer(self, interval_ms: int, slot: Callable[[], None]) -> QTimer:
        timer = QTimer(self, interval=interval_ms)
        if interval_ms == FRAME_MS:
            timer.setTimerType(Qt.TimerType.PreciseTimer)
        timer.timeout.connect(slot)
        return timer

    def _draw_frame(self) -> None:
        """Advance the servo by the time since the last frame, and draw the hand."""
        now_ns = self._servo.now_ns()
        behind_ms = (time.perf_counter_ns() - self._started_ns) // 1_000_000 - now_ns // 1_000_000
        self._servo.advance(int(min(max(behind_ms, 1), _LONGEST_FRAME_TICKS)))
        self.health.add_samples(self._reader.read())
        position_m, shown_ns = self._servo.telemetry.position_at(self._servo.now_ns())
        self.health.add_hand_position(self._servo.now_ns() * 1e-9, position_m)
        task = TaskView(lit=None, reached=0, of=None, dwell=0.0, elapsed_s=shown_ns * 1e-9)
        self.participant.show_view(TankView(position_m, task, shown_ns))

    def _count_frame(self, _sample_ns: int) -> None:
        self.frames += 1
        self.health.add_frame(time.perf_counter_ns())

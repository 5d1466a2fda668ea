"""A session of delays, held to see how well they are kept: the real windows, servo, store and recordings, no person.

Nothing of a session is left out or done twice: trials reach for targets with the scripted hand, and what is reported is
read from the recordings and tables that a session leaves.
"""

import tempfile
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Final

from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication

from study_app.app.session.bridge import SessionBridge
from study_app.app.session.garbage_collection import collecting_here
from study_app.app.session.session_windows import connect_windows, make_cockpit, make_participant_window, show_windows
from study_app.app.session.termination import ended_from_outside
from study_app.devices.rig import open_rig, study_settings
from study_app.errors import SessionError, StudyError
from study_app.evidence.computer import LoadName, busy_cores
from study_app.evidence.computer import machine as machine_here
from study_app.evidence.timing.delays import BESIDE, DELAYS_S, VIRTUAL_HZ, Delayed, Shown
from study_app.gui.application import application_here
from study_app.gui.display.opengl import WITHOUT_OPENGL
from study_app.gui.display.screens import choose_screens
from study_app.gui.theme.theme import LIGHT
from study_app.protocol.load import parse
from study_app.protocol.orders.schedule import Schedule, Trial
from study_app.session.resume import FIRST
from study_app.session.start import NewSession, open_store
from study_app.store.recordings import read_frames
from study_app.store.sessions.open_session import SessionStore

SIZE_PX: Final = (1920, 1080)
OPERATOR_PX: Final = (1600, 900)
LEAST_S, MOST_S = 0.5, 600.0

_STUDY: Final = """
format = 1
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
    """Return a protocol with a trial of so many seconds for each delay, one after the other."""
    names = [f"delay{1e3 * delay_s:.0f}" for delay_s in DELAYS_S]
    conditions = "".join(
        f'\n[conditions.{name}]\nliquid = "water"\ndelay_ms = {1e3 * delay_s:g}\n'
        for name, delay_s in zip(names, DELAYS_S, strict=True)
    )
    listed = ", ".join(f'"{name}"' for name in names)
    return _STUDY.format(conditions=conditions, seconds=seconds, names=listed).encode()


def delays(seconds: float, load: LoadName, *, progress: Callable[[str], object] = lambda _line: None) -> Delayed:
    """Show each delay for ``seconds`` on virtual screens, and on the real one if there is one; return what came of it.

    Parameters
    ----------
    load : besides the participant's window alone the same again with "gui": the operator's window plotting, "gui+cpu":
        and a busy process on every core; "none": no more

    Raises
    ------
    StudyError
        Seconds out of range; or the session broke.
    DisplayError
        A window cannot be opened here.
    """
    if not LEAST_S <= seconds <= MOST_S:
        raise StudyError(f"each delay is shown for {LEAST_S:g} to {MOST_S:g} s, not {seconds:g}")
    application_here()
    rates: list[float | None] = [*VIRTUAL_HZ]
    if QGuiApplication.platformName() not in WITHOUT_OPENGL:
        rates.append(None)
    loads: tuple[LoadName, ...] = ("none",) if load == "none" else ("none", load)
    shown: list[Shown] = []
    with collecting_here():
        for refresh_hz in rates:
            for each in loads:
                with tempfile.TemporaryDirectory() as folder, busy_cores() if each == "gui+cpu" else nullcontext():
                    shown.extend(_Showing(Path(folder), seconds, refresh_hz, each).run())
                progress(f"{shown[-1].screen}, {BESIDE[each]}")
    return Delayed(machine_here(), seconds, SIZE_PX, tuple(shown))


class _Showing:
    """One session of all delays on one screen; without a rate on the real one."""

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
        """Run the session and return what was shown in it."""
        rig = open_rig(self._chosen.device, study_settings(self._protocol, self._chosen.tremor()))
        schedule = self._chosen.schedule(self._protocol)
        try:
            with open_store(self._chosen, self._protocol, self._source, rig, {}) as store:
                operator = make_cockpit(self._chosen, self._protocol, rig, LIGHT)
                screens = choose_screens(self._chosen.screen)
                participant = make_participant_window(
                    self._chosen,
                    store.clock.seconds,
                    shares_screen=screens[0] is screens[1],
                    in_step=self._refresh_hz is None,
                )
                plan = self._protocol, schedule, FIRST
                rate_hz = self._refresh_hz or screens[0].refreshRate()
                bridge = connect_windows(self._chosen, plan, store, rig, operator, participant, refresh_hz=rate_hz)
                for _ in show_windows(bridge, partial(choose_screens, self._chosen.screen)):
                    pass
                self._size(bridge)
                self._run(bridge)
                paced = bridge.paced
        finally:
            rig.stop()
        if self._ended:
            raise KeyboardInterrupt
        if bridge.trouble:
            raise SessionError(f"the session of delays broke: {bridge.trouble}")
        return self._read(store, schedule, paced)

    def _size(self, bridge: SessionBridge) -> None:
        if self._refresh_hz is not None:
            bridge.participant.setGeometry(0, 0, *SIZE_PX)
        bridge.operator.resize(*OPERATOR_PX)
        if self._load == "none":
            bridge.operator.hide()

    def _run(self, bridge: SessionBridge) -> None:
        """Let the session go from its first trial to its last."""
        loop = QEventLoop()
        bridge.done.connect(loop.quit)

        def end(_number: int) -> None:
            self._ended = True
            bridge.leave_now()

        def follow(_state: object) -> None:
            if bridge.runner.finished:
                QTimer.singleShot(0, bridge.operator, bridge.operator.close_asked.emit)

        bridge.runner.on_change(follow)
        with ended_from_outside(end):
            QApplication.processEvents()  # the windows stand before the first trial, as after a page
            bridge.start()
            loop.exec()
        QApplication.processEvents()

    def _read(self, store: SessionStore, schedule: Schedule, paced: str) -> tuple[Shown, ...]:
        """Return what the recordings say of every trial."""
        refresh_hz = self._refresh_hz or choose_screens(None)[0].refreshRate()
        screen = f"{'virtual' if self._refresh_hz is not None else 'this screen'}, {refresh_hz:.4g} Hz"
        shown = []
        for trial in (step for step in schedule.steps if isinstance(step, Trial)):
            delay_s = self._protocol.delay_s(store.key.codes[trial.block][trial.code])
            frames = read_frames(store.folder.recordings / f"trial-{trial.number:03d}_frames.parquet")
            shown.append(
                Shown(screen, paced, self._load, refresh_hz, delay_s, frames["painted_ns"], frames["sample_ns"])
            )
        return tuple(shown)

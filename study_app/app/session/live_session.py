"""One session, from the operator's choices to the closed journal.

However a session's windows close (its end, Ctrl+C, a signal, a failure), the servo is stopped with zero force and the
journal is closed. Only the operator's "End session" writes an end; every other session stays unfinished and can be
resumed. Nothing is created on the disk before device and servo are ready.
"""

from __future__ import annotations

import gc
import logging
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEventLoop, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QScreen
from PySide6.QtWidgets import QApplication, QWidget

from study_app.app.compilation import Compilation
from study_app.app.failures import BUG, BY_SIGNAL_S, CANCELLED, OPENING_PATIENCE_S, CrashTrace, ending_on_signals
from study_app.app.timing import collecting_in_this_thread, unfreeze_garbage
from study_app.devices import DEFAULT_DEVICE
from study_app.devices.registry import check_connected, descriptor_of
from study_app.devices.rig import Rig, open_rig, study_settings
from study_app.discovery import explain_error
from study_app.errors import SessionError, StoreError, StudyError
from study_app.gui.application import application_here
from study_app.gui.display import choose_screens, place_window
from study_app.gui.kit import described_screens, screen_number, settings_here, text_scale_on
from study_app.gui.startup_window import OpeningWindow
from study_app.gui.theme import LIGHT, Theme
from study_app.gui.widgets import Background
from study_app.protocol.load import load, parse
from study_app.session.preflight import preflight_checks, refusal_reasons
from study_app.session.resume import is_rehearsal
from study_app.session.start import (
    NewSession,
    Ready,
    check_choices,
    draw_seed,
    measure_rig,
    open_outlets,
    open_store,
    resumed_choices,
    study_results,
    unopened_videos,
)
from study_app.store import receipt
from study_app.store.files import locate_session
from study_app.store.journals import journal_events
from study_app.store.sessions import refuse_never_begun
from study_app.store.verification import write_proof
from study_app.store.versions import keep_content
from study_app.store.workstation import remember_protocol
from study_app.workspace import workspace

if TYPE_CHECKING:
    from study_app.app.session.bridge import SessionBridge
    from study_app.app.session.preflight_controller import Preflight
    from study_app.outlets.session_outlets import Outlets
    from study_app.store.sessions import SessionStore
    from study_app.video.sources import Videos


def load_windows() -> None:
    """Import the modules that the session's windows need, while the opening window is shown."""
    import study_app.app.session.bridge  # noqa: PLC0415
    import study_app.app.session.preflight_controller  # noqa: PLC0415
    import study_app.gui.devices  # noqa: PLC0415
    import study_app.store.receipt  # noqa: PLC0415
    import study_app.store.recordings  # noqa: PLC0415 - with pyarrow, which the recorder needs

    study_app.store.receipt.versions()


NOT_EXAMINED = ("There is nothing to diagnose", "Diagnostics are not available for this device.")


class LiveSession(QObject):
    """One session from the operator's choices to the closed journal.

    ``over`` is emitted once, at the end; then ``code`` is the exit code and ``error`` the error, if any. With ``asks``,
    the operator sees the pre-flight checks and decides whether to begin. The session waits for ``compilation``.
    """

    over = Signal()
    _said = Signal(str)
    _compiled = Signal(float)

    def __init__(
        self,
        chosen: NewSession,
        theme: Theme,
        progress: Callable[[str], object] | None = None,
        *,
        asks: bool = False,
        compilation: Compilation | None = None,
    ) -> None:
        super().__init__()
        self.chosen = chosen
        self._progress = progress
        self._asks = asks
        self._compilation = compilation
        self.preflight: Preflight | None = None
        self.theme = theme
        self.settings, self._settings_problem = settings_here()
        self.code = 0
        self.error: StudyError | None = None
        self.bridge: SessionBridge | None = None
        self.note: OpeningWindow | None = None
        self.rig: Rig | None = None
        self._outlets: Outlets | None = None
        self._videos: Videos | None = None
        self._store: SessionStore | None = None
        self._crash_trace: CrashTrace | None = None
        self._closed = False
        self._ending = threading.Event()
        self._steps: Iterator[None] | None = None
        self._windows: list[QWidget] = []  # until the bridge owns them
        self.patience_s = OPENING_PATIENCE_S
        self._opening = Background(self)
        self._opening.done.connect(self._show_preflight_or_windows)
        self._said.connect(self._report_progress, Qt.ConnectionType.QueuedConnection)
        self._compiled.connect(self._show_compiled, Qt.ConnectionType.QueuedConnection)

    def open(self) -> None:
        """Show the opening window, and prepare device and servo in the background."""
        self._run_step(self._show_note)

    def _show_note(self) -> None:
        if self._settings_problem and self._progress is not None:
            self._progress(self._settings_problem)
        self.note = OpeningWindow(f"Preparing {Path(self.chosen.source).stem}", self.chosen.who, theme=self.theme)
        self.note.cancelled.connect(self.cancel)
        place_window(self.note, self.note.screen(), corner=False)
        self.note.show()
        self._opening.run(self._prepare_rig)

    @property
    def has_begun(self) -> bool:
        return self.bridge is not None

    @property
    def is_opening(self) -> bool:
        """Whether device and servo are being prepared, even if the session was cancelled meanwhile."""
        return self._opening.busy

    def wait(self, patience_s: float = OPENING_PATIENCE_S) -> None:
        """Wait until the preparation has ended, since its results must be released in this thread."""
        if self._opening.busy:
            self._opening.wait(patience_s)
            QApplication.processEvents()

    def end_by_signal(self, number: int) -> None:
        """Leave the session unfinished, because a signal ends the program."""
        self.code, self.patience_s = 128 + number, BY_SIGNAL_S
        if self._closed:
            return
        if self.bridge is not None:
            self.bridge.leave_without_asking()
        else:
            self._close_everything()

    def _prepare_rig(self) -> Ready | Exception:
        """Compile, open, start and measure the device; return the parts, or the exception. Called in a thread."""
        rig: Rig | None = None
        outlets: Outlets | None = None
        videos: Videos | None = None
        try:
            load_windows()
            from study_app.haptics.kernels import following_compilation  # noqa: PLC0415 - imports the compiler

            study = self.chosen.read_protocol()
            check_choices(self.chosen, study)
            if not self.chosen.device_options:  # they may name a port that the probe does not search
                check_connected(self.chosen.device)
            settings = study_settings(study, self.chosen.tremor(), self.chosen.device_options)
            if self._compilation is not None:
                self._compilation.wait(self._compiled.emit, self._ending.is_set)
            with following_compilation(self._compiled.emit):
                rig = open_rig(self.chosen.device, settings, progress=self._said.emit, cancelled=lambda: self._closed)
                outlets = None if self.chosen.played else open_outlets(self.settings, rig.servo, study.study.blinding)
                videos = unopened_videos(self.chosen, study, self.settings.camera, rig)
                facts = measure_rig(rig, self.chosen, videos, sleep=self._ending.wait)
                ready = Ready(rig, facts, outlets=outlets, videos=videos)
            if not self._closed:
                gc.freeze()  # so that collections in the GUI thread skip the loaded objects
        except Exception as error:  # noqa: BLE001 - handed over: a thread has no caller to raise it to
            with suppress(Exception):  # the first error is the cause
                _close_all(rig, videos, outlets)
            return error
        return ready

    def _show_preflight_or_windows(self, outcome: object) -> None:
        """Show the pre-flight window, or open the windows of the session at once."""
        if isinstance(outcome, Ready):
            self.rig, self._outlets, self._videos = outcome.rig, outcome.outlets, outcome.videos
        if self._closed:
            self._close_rig()
            self.deleteLater()
            return
        if self._asks and isinstance(outcome, Ready):
            self._run_step(partial(self._show_preflight, outcome))
        else:
            self._open_windows(outcome)

    def _open_windows(self, ready: object) -> None:
        """Open the windows step by step, with other events handled between the steps."""
        if self._steps is None or not isinstance(ready, Ready):
            self._steps = self.open_windows(ready)
            self._run_step(self._run_next_step)

    def _run_next_step(self) -> None:
        """Run the next step of opening the windows, unless the session was closed meanwhile."""
        if not self._closed and self._steps is not None and next(self._steps, self) is None:
            QTimer.singleShot(
                1, self, lambda: self._run_step(self._run_next_step)
            )  # 0 ms might run it in the same iteration of the loop

    def _run_step(self, step: Callable[[], None]) -> None:
        """Run a step of the start-up; an error closes the session."""
        try:
            step()
        except Exception as raised:  # noqa: BLE001 - reported; open parts must be closed in order
            error = explain_error(raised)
            if isinstance(error, StudyError):
                self.error = error
            else:
                traceback.print_exc()
                self.code = BUG
            self._close_everything()

    def _show_preflight(self, ready: Ready) -> None:
        """Show the results of the checks to the operator, who may start the session."""
        from study_app.app.session.preflight_controller import Preflight  # noqa: PLC0415 - imports pyqtgraph

        study, who = self.chosen.read_protocol(), self.chosen.who
        preflight = Preflight(self.chosen, study, ready, lambda: self.chosen_screens()[0], who, self.theme)
        preflight.started.connect(self._open_windows)
        preflight.failed.connect(self._open_windows)
        preflight.cancelled.connect(self.cancel)
        self.preflight = preflight
        self._close_note()
        preflight.open()

    def open_windows(self, ready: object) -> Iterator[None]:
        """Open the windows with the prepared parts, or raise the error; each step up to a yield takes a few frames."""
        if not isinstance(ready, Ready):
            raise ready if isinstance(ready, Exception) else TypeError(ready)
        from study_app.app.session import bridge  # noqa: PLC0415 - imports pyqtgraph

        chosen, rig = self.chosen, ready.rig
        source = chosen.read_source()
        protocol = parse(source, chosen.source)
        participant_screen, operator_screen = self.chosen_screens()
        shares_screen, rate_hz = participant_screen is operator_screen, participant_screen.refreshRate()
        text_scale = text_scale_on(self.settings, participant_screen)
        results = preflight_checks(ready.facts_with(rate_hz, participant_screen.devicePixelRatio()), protocol)
        if self._progress is not None:
            for check in results:
                self._progress(str(check))
        if reason := refusal_reasons(results):
            raise SessionError(f"the session did not start: {reason}")
        screens = described_screens(self.settings, participant_screen, operator_screen)
        yield
        operator = bridge.make_operator_window(chosen, protocol, rig, self.theme)
        self._windows.append(operator)
        yield
        participant = bridge.make_participant_window(
            chosen,
            self._elapsed_s,
            shares_screen=shares_screen,
            text_scale=text_scale,
            photodiode=self.settings.photodiode,
        )
        self._windows.append(participant)
        yield  # the last before the bridge, which can close the session in order
        parts = ready.masking, ready.outlets, ready.videos
        store = self._store = open_store(chosen, protocol, source, rig, screens, *parts)
        if not chosen.played:
            with suppress(StoreError):  # the copy is only for comparisons in the designer
                keep_content(source)
        self._crash_trace = CrashTrace(store.folder.crash)
        store.append(journal_events.Preflight(checks=[check.entry for check in results]))
        plan = bridge.session_plan(chosen, protocol, store)
        self.bridge = bridge.connect_windows(
            chosen, plan, store, rig, operator, participant, refresh_hz=rate_hz, videos=ready.videos
        )
        self._windows.clear()
        self.bridge.done.connect(self._finish_session)
        self.bridge.diagnose_asked.connect(self.diagnose)
        yield
        self.bridge.start()  # before the windows are shown, since only a begun session accepts requests
        yield
        yield from bridge.show_windows(self.bridge, self.chosen_screens, played=chosen.played)
        self._close_note()
        self._close_preflight()

    def _elapsed_s(self) -> float:
        """Return the time since the session's origin [s]; 0 until it is on the disk."""
        return 0.0 if self._store is None else self._store.clock.seconds()

    def chosen_screens(self) -> tuple[QScreen, QScreen]:
        """Return the participant's and the operator's screen, as chosen or as set for this machine."""
        chosen = self.chosen.screen
        return choose_screens(chosen if chosen is not None else screen_number(self.settings))

    def diagnose(self) -> None:
        """Open the diagnosis of the device above the operator's window; the bridge has stopped the force."""
        from study_app.gui.devices import open_diagnosis  # noqa: PLC0415 - after the opening window is shown

        assert self.bridge is not None  # noqa: S101 - its window has asked
        name = self.chosen.device
        device = descriptor_of(name)
        if device.doctor is None:
            self.bridge.operator.show_message(*NOT_EXAMINED)
            return
        held = not device.simulated
        open_diagnosis(self.bridge.operator, self.bridge.operator.theme, name, self.settings, held=held).show()

    def _show_compiled(self, share: float) -> None:
        if self.note is not None:
            self.note.show_compiled(share)

    def _report_progress(self, line: str) -> None:
        if self.settings.sound:
            QApplication.beep()
        if self._progress is not None:
            self._progress(line)
        if self.note is not None:
            self.note.show_line(line)
        elif self.bridge is not None:
            self.bridge.show_device_line(line)

    def _finish_session(self) -> None:
        """Close the session after its windows, and store the error that ended it, if any."""
        assert self.bridge is not None  # noqa: S101 - the sender exists
        self.theme = self.bridge.operator.theme
        if (proof := self.bridge.parts.journal.fingerprint) and self._store is not None:
            report = self._progress or logging.getLogger(__name__).info
            report(f"session fingerprint (also in the study's fingerprints.txt): {proof}")
            write_proof(self._store.place.study_folder, report)
        if self._progress is not None and self._store is not None:
            status, folder = self.bridge.parts.journal.progress.ended, self._store.folder.path
            self._progress(f"session {status}: {folder}" if status else f"session not finished: {folder}")
        trouble = self.bridge.trouble or self.bridge.runner.stalled or self.bridge.runner.cause
        if trouble and isinstance(self.bridge.failure, StudyError | None):
            self.error = StudyError(f"the session was stopped: {trouble}; all answers so far are on disk")
        elif trouble:
            self.code = BUG
        self._close_everything()

    def cancel(self) -> None:
        """Cancel the session if it is not on the disk yet; a later one is ended in its windows."""
        if self._store is None:
            self.code = CANCELLED
            self._close_everything()

    def _close_everything(self) -> None:
        """Close all parts in a safe order, and emit ``over`` once."""
        if self._closed:
            return
        self._closed = True
        self._ending.set()
        if self.bridge is None:
            unfreeze_garbage()  # otherwise the bridge does this
        try:
            with ExitStack() as closing:
                closing.callback(self._close_rig)  # even if a window cannot be closed
                closing.callback(self._close_preflight)
                closing.callback(self._close_note)
                for window in self._windows:
                    window.deleteLater()
                self._steps = None
                if self.bridge is not None:
                    self.bridge.leave_without_asking()  # no window stays open without its session
        except StudyError as error:
            self.error = self.error or error  # the first error is the cause
        except Exception:  # noqa: BLE001 - printed, since ``over`` must be emitted
            traceback.print_exc()
            self.code = BUG
        self.over.emit()
        if not self._opening.busy:
            self.deleteLater()

    def _close_note(self) -> None:
        note, self.note = self.note, None
        if note is not None:
            note.finish()
            note.deleteLater()

    def _close_preflight(self) -> None:
        preflight, self.preflight = self.preflight, None
        if preflight is not None:
            preflight.close()

    def _close_rig(self) -> None:
        rig, self.rig = self.rig, None
        bridge = self.bridge
        if bridge is not None and not bridge.reconnecting.wait(
            self.patience_s
        ):  # a reconnection ends once the session is closed
            rig = None  # the thread keeps the rig, at zero force, until the program ends
        store, self._store = self._store, None
        outlets, self._outlets = self._outlets, None
        crash_trace, self._crash_trace = self._crash_trace, None
        videos, self._videos = self._videos, None
        _close_all(rig, videos, crash_trace, store, outlets)


def _close_all(rig: Rig | None, *parts: SessionStore | CrashTrace | Outlets | Videos | None) -> None:
    """Send zero force, then close the parts in order, even if one fails."""
    with ExitStack() as closing:
        for part in reversed(parts):
            if part is not None:
                closing.callback(part.close)
        if rig is not None:
            rig.stop()


def run(
    protocol: str,
    *,
    participant: str,
    session: int = 1,
    seed: int | None = None,
    device: str = DEFAULT_DEVICE,
    device_options: Mapping[str, str | Path] | None = None,
    language: str | None = None,
    operator: str = "",
    windowed: bool = False,
    screen: int | None = None,
    results: Path | None = None,
    pilot: bool = False,
    recordings: bool = True,
    row_of: str | None = None,
    group: str | None = None,
    progress: Callable[[str], object] | None = None,
) -> int:
    """Run a session without dialogs; return the exit code when its windows are closed.

    Parameters
    ----------
    protocol : file or name of a protocol
    participant, session, operator : the participant's ID, the session number, the operator's initials
    seed : by default drawn at random, shown and recorded
    device, language : by default the mouse, and the protocol's first language
    device_options : values of the device's options, by name
    windowed, screen : where the participant's window opens; screens count from 1
    results : the study's folder; by default ``results/<study>`` in the workspace, or ``results/<study>-pilot``
    pilot : whether this is a pilot, in a framed window, marked and stored apart from participants' data
    row_of : the replaced participant, whose order and position in the group the session uses
    group : the participant's pre-existing group; by default the one recorded in an earlier session
    recordings : whether every tick of the servo and every frame of a trial is recorded
    progress : called with the lines of the pre-flight checks, before the first page

    Raises
    ------
    StudyError
        The session could not begin, and nothing was created; or device or servo failed during the session.
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
        windowed=windowed or pilot,
        screen=screen,
        results=(
            study_results(workspace().results, study.study.name, device, pilot=pilot)
            if results is None
            else Path(results)
        ),
        pilot=pilot,
        recordings=recordings,
        device_options=device_options or {},
        row_of=row_of,
        group=group,
    )
    check_choices(chosen, study)
    if Path(protocol).is_file():
        with suppress(StoreError):  # a session works without it
            remember_protocol(Path(protocol))
    return run_session(chosen, progress)


def resume(
    session_folder: Path,
    *,
    protocol: str | None = None,
    device: str | None = None,
    device_options: Mapping[str, str | Path] | None = None,
    operator: str = "",
    windowed: bool = False,
    screen: int | None = None,
    progress: Callable[[str], object] | None = None,
) -> int:
    """Resume an interrupted session; return the exit code when its windows are closed.

    A rehearsed session continues as a rehearsal, without windows.

    Parameters
    ----------
    protocol : file or name of the protocol; by default searched for among the available ones
    device : by default the device with which the session began
    device_options, operator, windowed, screen, progress : as for ``run``

    Raises
    ------
    StudyError
        The session cannot be resumed (finished, changed protocol, open elsewhere), or device or servo failed.
    """
    folder = Path(session_folder)
    session = locate_session(folder)[1]
    refuse_never_begun(session)
    if is_rehearsal(receipt.read(session.receipt)):
        from study_app.session.simulated import rehearsal  # noqa: PLC0415 - imports the compiler

        rehearsal.resume_rehearsal(folder, protocol=protocol)
        return 0
    chosen = resumed_choices(
        folder,
        protocol=protocol,
        operator=operator,
        device=device,
        windowed=windowed,
        screen=screen,
        device_options=device_options,
    )
    check_choices(chosen, chosen.read_protocol())
    return run_session(chosen, progress)


def run_session(chosen: NewSession, progress: Callable[[str], object] | None) -> int:
    """Run a session in its windows; return the exit code when they are closed, or raise the session's error."""
    application_here()
    live = LiveSession(chosen, LIGHT, progress)
    loop = QEventLoop()
    live.over.connect(loop.quit)
    with collecting_in_this_thread(), ending_on_signals(live.end_by_signal):
        QTimer.singleShot(0, live.open)
        loop.exec()
        live.wait(live.patience_s)
    if live.error is not None:
        raise live.error
    return live.code

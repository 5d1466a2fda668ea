"""The connection of a session with its windows: frames poll the runner, signals become events, changes become views.

The tank is drawn first in each frame; other parts are drawn in the time until the next frame.

After any failure, zero force is sent first; then the failure is recorded and shown to the operator. The participant
sees only a calm page.
"""

from __future__ import annotations

import logging
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from inspect import unwrap
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtGui import QGuiApplication, QScreen
from PySide6.QtWidgets import QWidget

from study_app.app.awake import Awake
from study_app.app.failures import PAINTING, ThreadExceptions, UncaughtExceptions, guarded_session_slot
from study_app.app.timing import FrameBudget, ThreadPriority, freeze_garbage, unfreeze_garbage
from study_app.devices.hand import HandOrders, hand_of
from study_app.devices.registry import descriptor_of
from study_app.discovery import explain_error
from study_app.errors import DeviceError, DisplayError, ServoFault, StudyError, VideoError
from study_app.gui.display import Frames, has_graphics_card, place_window
from study_app.gui.operator import (
    Forces,
    OperatorView,
    OperatorWindow,
    ServoHealth,
    Session,
    Strip,
    stages,
    view_session,
)
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.widgets import Background
from study_app.program_log import DEVICE_FAILED
from study_app.protocol.model import Protocol
from study_app.protocol.orders import PageStep, Schedule, expected_duration_s, orders_of
from study_app.protocol.randomization import stream
from study_app.protocol.without_force import without_force
from study_app.protocol.wording import words
from study_app.session.pages import Page, TaskPage
from study_app.session.ports import JournalPort, Ports
from study_app.session.resume import FIRST, Start, begun_schedule, resume_at
from study_app.session.runner import Runner
from study_app.session.simulated.observers import Hand, hand_behaviour, rest_hand
from study_app.session.transitions.events import (
    Begin,
    Continue,
    EndRequested,
    Event,
    ForceStopped,
    Note,
    PauseRequested,
    Reconnected,
    RepeatRequested,
    ResumeRequested,
    WriteRetried,
    broken,
)
from study_app.store.blinded import open_events, session_protocol
from study_app.store.files import StudyFolder
from study_app.store.journals import journal_events
from study_app.store.journals.journal_events import start_of
from study_app.store.session_progress import Progress, progress_of

if TYPE_CHECKING:
    from study_app.devices.base import Device
    from study_app.devices.rig import Rig
    from study_app.gui.theme import Theme
    from study_app.haptics.model.ranges import Vector
    from study_app.haptics.runtime.servo import Servo
    from study_app.outlets.session_outlets import Outlets
    from study_app.session.start import NewSession
    from study_app.store.sessions import Recorder, SessionStore
    from study_app.video.sources import Videos

_TRACES_S = 0.030  # every second frame at 60 Hz, every fifth at 144 Hz
_TILES_S = 0.5
_END_SHOWN_MS = 5000
SCREEN_SETTLES_MS = 500  # a window manager may briefly put a window on another screen
_SCREEN_REMOVED = (
    "Both windows are on one screen",
    "The session is paused and cannot be resumed, because the participant's window would cover “Stop force”. "
    "Reconnect the second screen; the participant's window will then return to it.",
)
log = logging.getLogger(__name__)


class WatchedJournal:
    """A journal that forwards all calls to the store, and updates ``progress`` with each written line."""

    def __init__(self, store: JournalPort, progress: Progress, clock: Callable[[], float]) -> None:
        self.progress = progress
        self._store = store
        self._clock = clock

    def append(self, event: journal_events.Event, *, t_s: float | None = None, waits: bool = True) -> None:
        """Write an event to the journal. Raise StoreError, with nothing changed, if that fails."""
        self._store.append(event, t_s=t_s, waits=waits)
        self.progress.process_line(replace(event, t_s=self._clock() if t_s is None else t_s))

    @property
    def fingerprint(self) -> str:
        return self._store.fingerprint

    def check_flushed(self) -> None:
        """Raise StoreError if lines written without waiting could not be flushed."""
        self._store.check_flushed()

    def write_tables(self) -> None:
        self._store.write_tables()

    def finish(self, status: str, reason: str = "") -> None:
        """Close the session. Raise StoreError if the last table or line could not be written; the session has ended."""
        try:
            self._store.finish(status, reason)
        finally:
            proof = {"fingerprint": self._store.fingerprint}
            self.progress.process_line(
                journal_events.SessionEnded(status=status, reason=reason, t_s=self._clock(), others=proof)
            )


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts of a session, except its windows.

    ``session`` is the constant part of the operator's view. ``key`` maps blocks and codes to conditions or tracks, and
    ``secret`` is the sealed key's nonce; both are never shown. ``start`` is the point of resumption. ``aim_m`` returns
    the target of hand or pointer [m, hand frame]. ``point_to`` and ``press`` forward the mouse, and are None for other
    devices. ``hand_for`` creates the simulated hand for a page, and is None with a real hand. ``outlets`` send events
    to other programs; ``videos`` are those of the study, or None. ``reconnect`` reopens a failed device or video, with
    the servo at zero force; it may take minutes.
    """

    session: Session
    key: Mapping[str, Mapping[str, str]] = field(repr=False)
    language: str
    servo: Servo
    journal: WatchedJournal
    clock: Callable[[], float]
    aim_m: Callable[[], tuple[float, float, float]]
    recorder: Recorder | None = None
    outlets: Outlets | None = None
    start: Start = FIRST
    secret: bytes = field(default=b"", repr=False)
    point_to: Callable[[float, float, float], None] | None = None
    press: Callable[[int], None] | None = None
    hand_for: Callable[[Page], Hand | None] | None = None
    reconnect: Callable[[], dict[str, Any]] | None = None
    videos: Videos | None = None


class SessionBridge(QObject):
    """Runs one session in two windows.

    ``done`` is emitted once, when the session is over and its windows can be closed; ``diagnose_asked`` when the
    operator has requested a diagnosis of the device, with the force off and the session paused. ``forces`` is None in
    a double-blind study, in which no force is processed.

    Parameters
    ----------
    refresh_hz : frames per second of the participant's screen
    """

    done = Signal()
    diagnose_asked = Signal()

    def __init__(
        self, parts: Parts, participant: ParticipantWindow, operator: OperatorWindow, *, refresh_hz: float = 60.0
    ) -> None:
        super().__init__()
        self.parts = parts
        self.participant = participant
        self.operator = operator
        self.strip = participant.strip if isinstance(participant.strip, Strip) else None
        self._has_raised_operator = False
        study = parts.session.protocol
        self.health = ServoHealth(parts.servo.rate_hz, refresh_hz)
        self.forces = Forces(study.device.force_limit_n) if study.study.blinding == "single" else None
        self._samples = parts.servo.telemetry.reader()
        self._faulty, self._faults = False, 0
        self.trouble = ""
        self.failure: BaseException | None = None
        ports = Ports(parts.servo, parts.journal, self.present, parts.clock, parts.recorder)
        if parts.recorder is not None:
            ports = replace(ports, settled=parts.recorder.end_without_waiting)
        if parts.videos is not None:
            ports = replace(ports, video=parts.videos.source)
        self._leaves_at_end = False
        self.runner = Runner(
            parts.session.protocol, parts.session.schedule, parts.key, ports, parts.language, parts.start, parts.secret
        )
        self.reconnecting = Background(self, refusals=Exception)
        self._reconnection = ""  # the progress of the reconnection, or why it failed
        self._hand: Hand | None = None
        self._has_left = False
        self._stalled: str | None = None
        self._lost = False
        self.uncaught = UncaughtExceptions(self._handle_uncaught)
        self._thread_exceptions = ThreadExceptions(self)
        self._thread_exceptions.ended.connect(self._report_thread_failure)
        self.frames = Frames(refresh_hz, parent=self)
        self.frames.due.connect(self.draw_frame)
        self._thread_priority, self._awake = ThreadPriority(), Awake()
        self.budget = FrameBudget(
            ((self.show_tiles, _TILES_S), (self.show_traces, _TRACES_S), (self.show_forces, _TRACES_S))
        )
        self.runner.on_change(lambda _state: self._show_changes())
        self._connect()

    def _connect(self) -> None:
        operator, participant = self.operator, self.participant
        operator.asked.connect(self._handle_request)
        self.reconnecting.done.connect(self._show_reconnected)
        self.reconnecting.failed.connect(self._show_reconnection_error)
        operator.escape.ignore_window(participant)
        participant.event.connect(self._handle_page_event)
        participant.left.connect(operator.bring_forward)
        if self.strip is not None:
            self.strip.stop.pressed.connect(self._stop_force)
            self.strip.operator.clicked.connect(operator.bring_forward)
            operator.header.page.show()
        participant.painted.connect(self._record_painted_frame)
        participant.swapped.connect(self.frames.note_swap)
        if self.parts.point_to is not None:
            participant.pointer.connect(self._move_hand)
            participant.buttons.connect(self._press_buttons)

    @property
    def paced(self) -> str:
        return self.frames.pacing

    def present(self, page: Page) -> None:
        """Show a page to the participant; the runner calls this."""
        self.participant.show_page(page)
        self._hand = self.parts.hand_for(page) if self.parts.hand_for is not None else None
        tank, videos = self.participant.tank, self.parts.videos
        if tank is not None and videos is not None:
            videos.fit(*tank.video.size(tank.devicePixelRatioF()))
        if not isinstance(page, TaskPage):
            self.health.pause_frames()

    def start(self) -> None:
        self.uncaught.install()
        self._thread_exceptions.install()
        freeze_garbage()
        self._thread_priority.raise_priority()
        self._awake.begin()
        self.frames.start()
        self._begin_session()

    @guarded_session_slot
    def _begin_session(self) -> None:
        self._post_event(Begin(self._now()))
        self.show_tiles()

    def leave_without_asking(self) -> None:
        """Send zero force and close the windows without asking; the session can be resumed."""
        self.parts.servo.stop_force()
        if not self._has_left and not self.runner.finished:
            self._pause_trial()
        self._leave_session()

    def watch_screens(self) -> None:
        """Pause when a screen is removed and the participant's window covers the operator's, until one is added."""
        for window in (self.participant, self.operator):
            window.windowHandle().screenChanged.connect(
                lambda _screen: QTimer.singleShot(SCREEN_SETTLES_MS, self, self._check_screens)
            )
        QGuiApplication.instance().screenAdded.connect(self._return_to_screen)  # type: ignore[union-attr]

    @property
    def _covers_operator(self) -> bool:
        """Whether the participant's window covers the operator's, and with it the force stop."""
        participant, operator = self.participant, self.operator
        shared = participant.screen().name() == operator.screen().name()
        return (
            shared
            and self.strip is None
            and participant.isFullScreen()
            and not (self._has_left or self.runner.finished)
        )

    @guarded_session_slot
    def _check_screens(self) -> None:
        if self._covers_operator:
            self._post_event(PauseRequested(self._now(), "program"))
            self.operator.bring_forward()
            self.operator.show_message(*_SCREEN_REMOVED)

    @guarded_session_slot
    def _return_to_screen(self, screen: QScreen) -> None:
        """Move the participant's window to a screen that was added, if it covers the operator's."""
        if self._covers_operator:
            self.participant.showNormal()  # a full-screen window does not change its screen
            self.participant.open_on(screen)
            self.operator.bring_forward()

    def _refuses_resumption(self) -> bool:
        """Return whether the session cannot be resumed because one window covers the other; if so, report it."""
        if covers := self._covers_operator:
            self.operator.bring_forward()
            self.operator.show_message(*_SCREEN_REMOVED)
        return covers

    @guarded_session_slot
    def _pause_trial(self) -> None:
        """Pause the session, so that the journal records the current trial as interrupted."""
        self._post_event(PauseRequested(self._now(), "program"))

    def fail(self, error: BaseException) -> None:
        """Send zero force, then report the failure to the journal, if it still accepts lines, and to the operator."""
        self.parts.servo.stop_force()
        first = not self.trouble
        raised, error = error, explain_error(error)
        message = str(error) if isinstance(error, StudyError) else f"{type(error).__name__}: {error}"
        if not first:
            return
        self.trouble, self.failure = message, error
        log.error("the session failed: %s", message, exc_info=_unexpected_error(raised))
        traceback.clear_frames(raised.__traceback__)  # a painter that a frame keeps alive would block Qt's painting
        try:
            if not self.runner.finished:
                self.runner.post(broken(self._now(), error))
            self._show_view()
        except Exception as second:  # noqa: BLE001 - the force is off; the first failure is the one that counts
            log.error("and could not be recorded: %s", second)  # noqa: TRY400 - one line, the first has the trace

    def _handle_uncaught(self, error: BaseException) -> bool:
        """Handle an uncaught exception; return whether it only affected the painting of the operator's window."""
        frame = None if error.__traceback__ is None else error.__traceback__.tb_frame
        if frame is None or not isinstance(error, Exception) or frame.f_code.co_name not in PAINTING:
            is_operator_painting = False
        else:
            parts = (self.participant, *self.participant.findChildren(QWidget))  # also of plug-ins
            kinds = {kind for part in parts for kind in type(part).__mro__}
            methods = (unwrap(vars(kind)[name]) for kind in kinds for name in PAINTING if name in vars(kind))
            is_operator_painting = all(getattr(method, "__code__", None) is not frame.f_code for method in methods)
        (self.operator.report_failure if is_operator_painting else self.fail)(error)
        return is_operator_painting

    @guarded_session_slot
    def _report_thread_failure(self, description: str) -> None:
        """Record that a thread has ended with an exception, and tell the operator."""
        self.operator.show_message("Part of the program has stopped", f"{description}. All answers have been kept.")
        self.record_note(f"a program thread stopped unexpectedly: {description}")

    def _now(self) -> float:
        return self.parts.clock()

    def _post_event(self, event: Event) -> None:
        self.runner.post(event)

    def draw_frame(self) -> None:
        """Draw the tank, then the parts for which there is time before the next frame."""
        self._draw_tank()
        self.budget.run_due_tasks(self.frames.next_ns)

    @guarded_session_slot
    def _draw_tank(self) -> None:
        """Poll the runner, draw the tank with the trial's visual delay, and read the device."""
        self.runner.poll()
        view = self.runner.view(self.parts.servo.now_ns())
        if view is not None:
            self.participant.show_view(view)
        self._read_device()
        now_s = self._now()
        if view is not None and self._hand is not None and self._hand.act(now_s, view):
            self._post_event(Continue(now_s))

    def _read_device(self) -> None:
        self._count_faults()
        samples = self._samples.read()
        self.health.add_samples(samples)
        if self.forces is not None:
            self.forces.add_samples(samples)
        self.health.add_hand_position(self._now(), self.parts.aim_m())

    def _count_faults(self) -> None:
        faulty = self.parts.servo.fault is not None
        self._faults += faulty and not self._faulty
        self._faulty = faulty

    @guarded_session_slot
    def _record_painted_frame(self, sample_ns: int) -> None:
        """Record when a frame was painted, on the servo's clock."""
        painted_ns = self.parts.servo.now_ns()
        self.runner.frame_shown(painted_ns, sample_ns)
        self.health.add_frame(painted_ns)

    @guarded_session_slot
    def show_traces(self) -> None:
        self.operator.show_traces(self.health, self._now())

    @guarded_session_slot
    def show_forces(self) -> None:
        """Draw the newest forces, if the operator may see them."""
        if self.forces is not None:
            self.operator.show_forces(self.forces, self.parts.servo.now_ns())

    @guarded_session_slot
    def show_tiles(self) -> None:
        self.health.overruns = self.parts.servo.overruns
        self.operator.show_lateness(self.health)
        self._show_view()

    def _show_changes(self) -> None:
        """Show the new state of the session; at its end, raise the operator's window above the participant's."""
        if (stalled := self.runner.stalled) != self._stalled:
            self._stalled = stalled
            log.warning("the disk accepts data again" if stalled is None else f"the session waits: {stalled}")
        lost, was_lost = self.runner.state.lost_device, self._lost
        self._lost = lost
        if lost and not was_lost:
            log.info(DEVICE_FAILED, ServoFault(self.runner.cause))
        self._show_view()
        if self.runner.finished and self._leaves_at_end:
            QTimer.singleShot(0, self, self._leave_session)
        elif self.runner.finished and self.participant.isFullScreen():
            ended = self.parts.journal.progress.reached_end
            has_last_page = ended and isinstance(self.parts.session.schedule.steps[-1], PageStep)
            QTimer.singleShot(0 if has_last_page else _END_SHOWN_MS, self.operator, self.operator.bring_forward)

    def _show_view(self) -> None:
        view = self.view()
        self.operator.show_view(view)
        if self.strip is not None:
            self.strip.show_view(view)
            if view.state == "trouble" and not self._has_raised_operator:
                self.operator.bring_forward()
            self._has_raised_operator = view.state == "trouble"

    def view(self) -> OperatorView:
        parts, stalled = self.parts, self.runner.stalled
        self._count_faults()
        trouble = (parts.journal.progress.broke and self.runner.cause) or self.trouble
        view = view_session(
            parts.session,
            parts.journal.progress,
            self.health.vitals(),
            now_s=self._now(),
            force_on=parts.servo.force_is_on,
            trouble=trouble or parts.servo.fault or stalled or "",
            waits=stalled is not None and not trouble,
            device_ready=not self._faulty,
            faults=self._faults,
            rate_hz=parts.servo.rate_hz,
            forces=None if self.forces is None else self.forces.figures(),
            lost={loss.trial: loss.reason for loss in parts.recorder.lost} if parts.recorder is not None else {},
            dropped=parts.recorder.dropped if parts.recorder is not None else 0,
            outlets_lost=None if parts.outlets is None else parts.outlets.lost,
        )
        if parts.reconnect is None or not self.runner.state.lost_device:
            return view
        return replace(view, may_reconnect=True, reconnects=self.reconnecting.busy, reconnection=self._reconnection)

    @guarded_session_slot
    def _handle_page_event(self, event: Event) -> None:
        if isinstance(event, ForceStopped):
            self.parts.servo.stop_force()
        if not (isinstance(event, ResumeRequested) and self._refuses_resumption()):
            self._post_event(event)

    @guarded_session_slot
    def _handle_request(self, request: str, details: tuple[Any, ...]) -> None:
        """Carry out a request of the operator; zero force precedes whatever may fail or wait for the disk."""
        post = self._post_event
        match request:
            case "stop":
                self._stop_force()
            case "resume" if self._refuses_resumption():
                pass
            case "resume":
                post(ResumeRequested(self._now(), "operator"))
                if self.strip is not None:
                    self.participant.bring_forward()
            case "pause":
                post(PauseRequested(self._now(), "operator"))
            case "repeat":
                (reason,) = details
                post(RepeatRequested(self._now(), reason))
            case "note" | "mark":
                (text,) = details or ("",)
                post(Note(self._now(), request, text))
            case "end":
                status, reason = details
                post(EndRequested(self._now(), status, reason))
            case "diagnose":
                self._request_diagnosis()
            case "reconnect":
                self._reconnect()
            case "failed":
                message, error = details
                log.error("part of the operator's window stopped working: %s", message, exc_info=error)
                self.record_note(f"part of the operator's window stopped working: {message}")
            case "page":
                self.participant.bring_forward()
            case "close":
                self._close_window()

    @guarded_session_slot
    def _stop_force(self) -> None:
        self.parts.servo.stop_force()
        self._post_event(ForceStopped(self._now(), "operator"))

    def _request_diagnosis(self) -> None:
        """Send zero force, pause the session, and request a diagnosis of the device."""
        self.parts.servo.stop_force()
        try:
            if not self.runner.finished:
                self._post_event(ForceStopped(self._now(), "operator"))
        finally:
            self.diagnose_asked.emit()

    def _reconnect(self) -> None:
        """Reconnect the device in the background; the force stays off until the operator resumes."""
        if self.parts.reconnect is not None and self.runner.state.lost_device:
            if not self.reconnecting.busy:
                self._reconnection = "Connecting the device…"
                self.reconnecting.run(self.parts.reconnect)
            self._show_view()

    def record_note(self, text: str) -> None:
        """Write a note to the journal, unless the session has ended."""
        if not self.runner.finished:
            self._post_event(Note(self._now(), "note", text))

    def show_device_line(self, line: str) -> None:
        if self.reconnecting.busy:
            self._reconnection = line
            self._show_view()

    @guarded_session_slot
    def _show_reconnected(self, described: dict[str, Any]) -> None:
        self._reconnection = ""
        if isinstance(self.failure, DeviceError | ServoFault | VideoError):
            self.trouble, self.failure = "", None
        log.info("the device was reconnected")
        self._post_event(Reconnected(self._now(), described))

    @guarded_session_slot
    def _show_reconnection_error(self, error: Exception) -> None:
        why = str(error) if isinstance(error, StudyError) else f"{type(error).__name__}: {error}"
        self._reconnection = f"Not connected: {why}."
        log.warning("the device was not reconnected: %s", error, exc_info=_unexpected_error(error))
        self._show_view()

    @guarded_session_slot
    def _move_hand(self, x_m: float, y_m: float, z_m: float) -> None:
        if self.parts.point_to is not None:
            self.parts.point_to(x_m, y_m, z_m)

    @guarded_session_slot
    def _press_buttons(self, buttons: int) -> None:
        if self.parts.press is not None:
            self.parts.press(buttons)

    def _close_window(self) -> None:
        """Close the operator's window, or during the session send zero force and ask; the second time, leave it."""
        if self.runner.finished:
            if self.runner.stalled is not None:
                self._post_event(WriteRetried(self._now()))  # try once more to write the end of the session
            self._leave_session()
            return
        if self.runner.ending:  # leave as soon as the recordings are on the disk
            self._leaves_at_end = True
            self.operator.hide()
            return
        self.parts.servo.stop_force()
        if self.operator.question is not None:
            self.leave_without_asking()
            return
        self.operator.ask_to_end()
        self._post_event(ForceStopped(self._now(), "operator"))

    def _leave_session(self) -> None:
        if self._has_left:
            return
        self._has_left = True
        self.frames.stop()
        self._thread_priority.restore()
        self._awake.end()
        unfreeze_garbage()
        self.uncaught.remove()
        self._thread_exceptions.remove()
        self.participant.may_close = True
        self.participant.close()
        self.operator.may_close = True
        if self.operator.question is not None:
            self.operator.question.reject()
        self.operator.hide()
        self.done.emit()
        for part in (self.participant, self.operator, self):
            part.deleteLater()  # in this thread, since another might collect them


def _unexpected_error(error: BaseException) -> BaseException | None:
    """Return the error if the log needs its traceback, or None if its message suffices."""
    return None if isinstance(error, StudyError) else error


def make_operator_window(chosen: NewSession, protocol: Protocol, rig: Rig, theme: Theme) -> OperatorWindow:
    """Return the operator's window, not yet shown."""
    descriptor = descriptor_of(chosen.device)
    return OperatorWindow(
        protocol.study.name,
        lateness_limit_s=protocol.limits.lateness_ms / 1000,
        reach_m=max(rig.device.workspace_m),
        pointer=descriptor.pointer,
        felt=descriptor.kind != "seen",
        stop_button=descriptor.stop_button,
        force_limit_n=protocol.device.force_limit_n if protocol.study.blinding == "single" else None,
        theme=theme,
    )


def make_participant_window(
    chosen: NewSession,
    clock: Callable[[], float],
    *,
    shares_screen: bool,
    text_scale: float = 1.0,
    photodiode: bool,
    in_step: bool = True,
) -> ParticipantWindow:
    """Return the participant's window, not yet shown.

    ``clock`` returns the session's time [s], ``shares_screen`` tells whether the operator's window is on the same
    screen, ``text_scale`` is the minimum scale of text, ``photodiode`` adds a corner for a photodiode to the tank, and
    ``in_step`` permits drawing in step with the screen.
    """
    return ParticipantWindow(
        words(chosen.language),
        clock=clock,
        windowed=chosen.windowed,
        captures_pointer=descriptor_of(chosen.device).pointer,
        pilot=chosen.pilot,
        on_card=in_step and has_graphics_card(),
        text_scale=text_scale,
        photodiode=photodiode,
        strip=Strip(played=chosen.played) if shares_screen else None,
    )


def session_plan(chosen: NewSession, protocol: Protocol, store: SessionStore) -> tuple[Protocol, Schedule, Start]:
    """Return the protocol and schedule of a session on the disk, and the point where it begins or resumes."""
    protocol = store.as_recorded(protocol)
    protocol = session_protocol(StudyFolder(chosen.results), protocol, chosen.participant, chosen.session)
    schedule, start = begun_schedule(protocol, start_of(store.lines), store.key), FIRST
    if chosen.resumes is not None:
        start = resume_at(protocol, schedule, store.lines, store.key, exactly=chosen.played)
    if descriptor_of(chosen.device).kind == "seen":
        protocol = without_force(protocol)
    return protocol, schedule, start


def connect_windows(
    chosen: NewSession,
    plan: tuple[Protocol, Schedule, Start],
    store: SessionStore,
    rig: Rig,
    operator: OperatorWindow,
    participant: ParticipantWindow,
    *,
    refresh_hz: float,
    videos: Videos | None = None,
) -> SessionBridge:
    """Connect both windows to the session; the caller shows them and starts the bridge.

    ``plan`` is the result of `session_plan`, ``refresh_hz`` the frame rate. ``videos`` must be open.
    """
    clock, device, servo = store.clock.seconds, rig.device, rig.servo
    journal = WatchedJournal(store, progress_of(open_events(store.lines, store.key)), clock)
    descriptor = descriptor_of(chosen.device)
    protocol, schedule, start = plan
    hand = hand_of(device)
    parts = Parts(
        session=_session_facts(chosen, protocol, schedule, rig),
        key=store.key.codes,
        secret=store.key.nonce,
        language=chosen.language,
        servo=servo,
        journal=journal,
        clock=clock,
        recorder=store.recorder,
        outlets=store.outlets,
        start=start,
        reconnect=_make_reconnect(rig, videos),
        videos=videos,
        aim_m=_make_position_reader(hand, servo),
        point_to=getattr(device, "point_to", None) if descriptor.pointer else None,
        press=getattr(device, "press", None) if descriptor.pointer else None,
        hand_for=_make_hand_for_page(hand, chosen, clock) if hand is not None and descriptor.moves_by_itself else None,
    )
    return SessionBridge(parts, participant, operator, refresh_hz=refresh_hz or 60.0)


def show_windows(
    bridge: SessionBridge, screens: Callable[[], tuple[QScreen, QScreen]], *, played: bool = False
) -> Iterator[None]:
    """Show the windows on their screens, one after the other; for a ``played`` session, only the participant's.

    ``screens`` returns the participant's and the operator's screen; it is called in each step.

    Raises
    ------
    DisplayError
        A screen was removed, so that the participant's window would cover the force stop.
    """
    if not played:
        participant_screen, operator_screen = screens()
        place_window(bridge.operator, operator_screen, corner=participant_screen is operator_screen)
        bridge.operator.show()
        yield
    participant_screen, operator_screen = screens()
    if participant_screen is operator_screen and bridge.strip is None:
        raise DisplayError("a screen was disconnected while the session was opening; start the session again")
    bridge.participant.open_on(participant_screen)
    if not played:
        bridge.watch_screens()


def _make_reconnect(rig: Rig, videos: Videos | None) -> Callable[[], dict[str, Any]]:
    """Return a function that reopens what has failed: device and servo, or videos."""

    def reconnect() -> dict[str, Any]:
        if videos is None or rig.servo.fault is not None:
            rig.reconnect()
        if videos is not None:
            videos.reopen()
        return rig.described

    return reconnect


def _session_facts(chosen: NewSession, protocol: Protocol, schedule: Schedule, rig: Rig) -> Session:
    descriptor = descriptor_of(chosen.device)
    return Session(
        protocol=protocol,
        schedule=schedule,
        stages=stages(protocol, schedule),
        who=chosen.who,
        expected_s=expected_duration_s(protocol),
        answers_of=orders_of(protocol).answers,
        lateness_limit_s=protocol.limits.lateness_ms / 1000,
        device_name=descriptor.title,
        device_icon=descriptor.icon,
        device_rows=(
            ("Priority", str(rig.servo.describe()["priority"]).partition(" (")[0]),
            *_calibration_rows(rig.device),
        ),
    )


def _calibration_rows(device: Device) -> tuple[tuple[str, str], ...]:
    """Return the rows about the calibration of a device; none if it cannot be calibrated."""
    calibration = device.describe().get("calibration")
    if calibration is None:
        return ()
    return (("Calibration", f"of {calibration['measured']}" if isinstance(calibration, dict) else "none"),)


def _make_position_reader(hand: HandOrders | None, servo: Servo) -> Callable[[], Vector]:
    """Return a function for the hand's position or, since lag would reveal the liquid, a simulated hand's aim."""
    if hand is not None:
        return lambda: hand.aim_m

    def position_m() -> Vector:
        x, y, z = servo.telemetry.position_at(servo.now_ns())[0]
        return float(x), float(y), float(z)

    return position_m


def _make_hand_for_page(
    hand: HandOrders, chosen: NewSession, clock: Callable[[], float]
) -> Callable[[Page], Hand | None]:
    """Return a function that creates the simulated hand of a page; on pages without a task, the hand rests."""
    draw = stream(chosen.seed, f"run/{chosen.participant}/hand").random

    def hand_for_page(page: Page) -> Hand | None:
        if not isinstance(page, TaskPage):
            hand.rest()
        elif page.interval is None or not page.interval.resting:
            return hand_behaviour(page.task, hand, draw, clock())
        else:
            rest_hand(page.task, hand)
        return None

    return hand_for_page

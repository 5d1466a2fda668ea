"""The two windows of a session, made of its parts and connected by a bridge."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from study_app.app.session.bridge import SessionBridge
from study_app.app.session.operator import Parts, WatchedJournal
from study_app.devices.hand import HandOrders, hand_of
from study_app.devices.registry import descriptor_of
from study_app.errors import DisplayError
from study_app.gui.display.screens import has_card, place
from study_app.gui.operator.header import Strip
from study_app.gui.operator.operator_view import Session, stages
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.durations import expected_duration_s
from study_app.protocol.orders.schedule import Schedule, stream
from study_app.protocol.wording.languages import words
from study_app.protocol.wording.without_force import without_force
from study_app.session.pages import Page, TaskPage
from study_app.session.resume import FIRST, Start, resume_at
from study_app.session.simulated.observers import Hand, hand_for, rest
from study_app.store.blinded.allocation import session_protocol
from study_app.store.blinded.blinding import opened
from study_app.store.exclusions import exclude
from study_app.store.folders import StudyFolder
from study_app.store.progress import progress_of

if TYPE_CHECKING:
    from PySide6.QtGui import QScreen

    from study_app.devices.base import Device
    from study_app.devices.rig import Rig
    from study_app.gui.theme.theme import Theme
    from study_app.haptics.runtime.servo import Servo
    from study_app.session.start import NewSession
    from study_app.store.sessions.open_session import SessionStore
    from study_app.video.sources import Videos


def make_cockpit(chosen: NewSession, protocol: Protocol, rig: Rig, theme: Theme) -> OperatorWindow:
    """Return the operator's window, not shown yet."""
    described = descriptor_of(chosen.device)
    return OperatorWindow(
        protocol.study.name,
        lateness_limit_s=protocol.limits.lateness_ms / 1000,
        reach_m=max(rig.device.workspace_m),
        pointer=described.pointer,
        felt=described.kind != "seen",
        force_limit_n=protocol.device.force_limit_n if protocol.study.blinding == "single" else None,
        theme=theme,
    )


def make_participant_window(
    chosen: NewSession,
    clock: Callable[[], float],
    *,
    shares_screen: bool,
    text_scale: float = 1.0,
    photodiode: bool = True,
    in_step: bool = True,
) -> ParticipantWindow:
    """Return the participant's window, not shown yet.

    ``clock`` gives the session's time [s] once the session is on the disk; ``shares_screen`` is whether the operator's
    window is on the same screen, ``text_scale`` how much larger than designed the words must be at least,
    ``photodiode`` whether the tank has a corner for one, ``in_step`` whether it may be drawn in step with the screen.
    """
    return ParticipantWindow(
        words(chosen.language),
        clock=clock,
        windowed=chosen.windowed,
        captures_pointer=descriptor_of(chosen.device).pointer,
        pilot=chosen.pilot,
        on_card=in_step and has_card(),
        text_scale=text_scale,
        photodiode=photodiode,
        strip=Strip(played=chosen.played) if shares_screen else None,
    )


def planned(chosen: NewSession, protocol: Protocol, store: SessionStore) -> tuple[Protocol, Schedule, Start]:
    """Return what is run in a session that is on the disk, in what order, and where it begins or goes on."""
    protocol = store.as_recorded(protocol)
    protocol = session_protocol(StudyFolder(chosen.results), protocol, chosen.participant, chosen.session)
    schedule, start = chosen.schedule(protocol), FIRST
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
    """Connect the operator's and the participant's window, made before; they are to be shown, and the bridge started.

    ``plan`` is what is run, in what order, and where it begins; ``refresh_hz`` how many frames a second there are.
    ``videos`` are open.
    """
    clock, device, servo = store.clock.seconds, rig.device, rig.servo
    journal = WatchedJournal(store, progress_of(opened(store.lines, store.key)), clock)
    described = descriptor_of(chosen.device)
    protocol, schedule, start = plan
    hand = hand_of(device)
    parts = Parts(
        session=_facts(chosen, protocol, schedule, rig),
        key=store.key.codes,
        secret=store.key.nonce,
        language=chosen.language,
        servo=servo,
        journal=journal,
        clock=clock,
        recorder=store.recorder,
        outlets=store.outlets,
        start=start,
        exclude=_excluder(chosen),
        reconnect=_reconnecting(rig, videos),
        videos=videos,
        aim_m=_aim(hand, servo),
        point_to=getattr(device, "point_to", None) if described.pointer else None,
        press=getattr(device, "press", None) if described.pointer else None,
        hand_for=_hands(hand, chosen, clock) if hand is not None and described.moves_by_itself else None,
    )
    return SessionBridge(parts, participant, operator, refresh_hz=refresh_hz or 60.0)


def show_windows(
    bridge: SessionBridge, screens: Callable[[], tuple[QScreen, QScreen]], *, played: bool = False
) -> Iterator[None]:
    """Show both windows on their screens, one after the other; of a session that is played the participant's alone.

    ``screens`` returns the participant's and the operator's screen; it is called in each step.

    Raises
    ------
    DisplayError
        A screen was removed since the windows were made: the participant's would cover the force stop.
    """
    if not played:
        shown_on, operated_on = screens()
        place(bridge.operator, operated_on, corner=shown_on is operated_on)
        bridge.operator.show()
        yield
    shown_on, operated_on = screens()
    if shown_on is operated_on and bridge.strip is None:
        raise DisplayError("a screen was removed while the session opened; begin it again")
    bridge.participant.open_on(shown_on)
    if not played:
        bridge.watch_screens()


def _reconnecting(rig: Rig, videos: Videos | None) -> Callable[[], dict[str, Any]]:
    """Return what opens again what failed: device and servo, or videos and not a device that is well."""

    def reconnect() -> dict[str, Any]:
        if videos is None or rig.servo.fault is not None:
            rig.reconnect()
        if videos is not None:
            videos.reopen()
        return rig.described

    return reconnect


def _excluder(chosen: NewSession) -> Callable[[int | None, str], None]:
    """Return what leaves the session, or one of its trials, out of the analysis for a reason."""

    def leave_out(trial: int | None, reason: str) -> None:
        by = chosen.operator or "operator"
        exclude(chosen.results, chosen.participant, chosen.session, trial=trial, by=by, reason=reason)

    return leave_out


def _facts(chosen: NewSession, protocol: Protocol, schedule: Schedule, rig: Rig) -> Session:
    described = descriptor_of(chosen.device)
    return Session(
        protocol=protocol,
        schedule=schedule,
        stages=stages(protocol, schedule),
        who=chosen.who,
        expected_s=expected_duration_s(protocol),
        answers_of=orders_of(protocol).answers,
        lateness_limit_s=protocol.limits.lateness_ms / 1000,
        device_name=described.title,
        device_icon=described.icon,
        device_rows=(("Priority", str(rig.servo.describe()["priority"]).partition(" (")[0]), *_calibration(rig.device)),
    )


def _calibration(device: Device) -> tuple[tuple[str, str], ...]:
    """Return what the operator should know of a device that can be calibrated."""
    used = device.describe().get("calibration")
    if used is None:
        return ()
    return (("Calibration", f"of {used['measured']}" if isinstance(used, dict) else "none"),)


def _aim(hand: HandOrders | None, servo: Servo) -> Callable[[], tuple[float, float, float]]:
    """Return a function that tells where the hand is; for a simulated one its aim, since its lag reveals the liquid."""
    if hand is not None:
        return lambda: hand.aim_m

    def position_m() -> tuple[float, float, float]:
        x, y, z = servo.telemetry.position_at(servo.now_ns())[0]
        return float(x), float(y), float(z)

    return position_m


def _hands(hand: HandOrders, chosen: NewSession, clock: Callable[[], float]) -> Callable[[Page], Hand | None]:
    """Return what makes the simulated hand for a page; on a page without a task the hand rests."""
    draw = stream(chosen.seed, f"run/{chosen.participant}/hand").random

    def hand_on(page: Page) -> Hand | None:
        if not isinstance(page, TaskPage):
            hand.rest()
        elif page.interval is None or not page.interval.resting:
            return hand_for(page.task, hand, draw, clock())
        else:
            rest(page.task, hand)
        return None

    return hand_on

"""The parts of a session in windows, except the windows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from study_app.gui.operator.watch import WatchedJournal
from study_app.session.pages import Page
from study_app.session.resume import FIRST, Start
from study_app.video.sources import Videos
from study_app.viewmodels.operator import Session

if TYPE_CHECKING:
    from study_app.haptics.runtime.servo import Servo
    from study_app.outlets.session_outlets import Outlets
    from study_app.session.simulated.observers import Hand
    from study_app.store.recorder import Recorder


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts of a session, except its windows.

    ``session`` is what the operator sees of it throughout; ``key`` is block → code → condition or track
    and ``secret`` the sealed key's nonce, never shown; ``start``
    is where a resumed session goes on. ``exclude`` leaves a trial, or with None the session, out of the analysis for a
    reason. ``aim_m`` gives where hand or pointer mean to be [m, hand frame]; ``point_to`` and ``press`` pass the mouse
    on, None where the device is not the mouse; ``hand_for`` makes the simulated hand for a page, None with a real hand.
    ``outlets`` send its events to other programs; ``videos`` are those of the study, None where it shows none.
    ``reconnect`` opens a device or video that failed again, with the servo at zero force; it may take minutes.
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
    exclude: Callable[[int | None, str], None] | None = None
    point_to: Callable[[float, float, float], None] | None = None
    press: Callable[[int], None] | None = None
    hand_for: Callable[[Page], Hand | None] | None = None
    reconnect: Callable[[], dict[str, Any]] | None = None
    videos: Videos | None = None

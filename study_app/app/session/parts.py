"""What a session in windows is made of, but for its windows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from study_app.gui.operator.watch import WatchedJournal
from study_app.protocol.orders.schedule import Schedule
from study_app.session.pages import Page
from study_app.session.ports import RecorderPort, ServoPort
from study_app.session.resume import FIRST, Start
from study_app.session.trial import TankView
from study_app.viewmodels.operator import Session


class ServoPanel(ServoPort, Protocol):
    """What is asked of the servo here, beyond what the runner asks."""

    @property
    def force_is_on(self) -> bool: ...  # noqa: D102
    @property
    def overruns(self) -> int: ...  # noqa: D102


class LostRecording(Protocol):
    """A recording that could not be kept."""

    @property
    def trial(self) -> int: ...  # noqa: D102
    @property
    def reason(self) -> str: ...  # noqa: D102


class RecorderPanel(RecorderPort, Protocol):
    """What is asked of the recorder here, beyond what the runner asks."""

    @property
    def lost(self) -> Sequence[LostRecording]: ...  # noqa: D102
    @property
    def dropped(self) -> int: ...  # noqa: D102
    def settled(self) -> bool: ...  # noqa: D102


class Hand(Protocol):
    """A simulated hand: acts on what it sees, and tells whether it wants to go on."""

    def act(self, now_s: float, view: TankView) -> bool: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Parts:
    """What a session is made of, but for its windows.

    ``session`` is what the operator sees of it throughout; ``key`` is block → code → condition, never shown; ``start``
    is where a resumed session goes on. ``exclude`` leaves a trial, or with None the session, out of the analysis for a
    reason. ``aim_m`` gives where hand or pointer mean to be [m, hand frame]; ``point_to`` and ``press`` pass the mouse
    on, None where the device is not the mouse; ``hand_for`` makes the simulated hand for a page, None with a real hand.
    ``reconnect`` opens a device that failed again and starts the servo at zero force; it may take minutes.
    """

    session: Session
    schedule: Schedule
    key: Mapping[str, Mapping[str, str]] = field(repr=False)
    language: str
    servo: ServoPanel
    journal: WatchedJournal
    clock: Callable[[], float]
    aim_m: Callable[[], tuple[float, float, float]]
    recorder: RecorderPanel | None = None
    start: Start = FIRST
    exclude: Callable[[int | None, str], None] | None = None
    point_to: Callable[[float, float, float], None] | None = None
    press: Callable[[int], None] | None = None
    hand_for: Callable[[Page], Hand | None] | None = None
    reconnect: Callable[[], dict[str, Any]] | None = None

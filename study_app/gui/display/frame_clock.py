"""When to draw: once a refresh of the participant's screen, by its own word where it gives one, else by the clock.

A timer of whole milliseconds drifts through the refreshes of a 60 Hz screen (17 for 16.67 ms) and draws some of them
twice and others never; here every deadline is a multiple of the refresh from one origin. Where a surface tells when it
swapped, the origin is its last swap, and a frame is drawn shortly before the next.
"""

import time
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QObject, Qt, QTimer, Signal

LEAD_NS: Final = 5_000_000  # so long before a swap a frame is drawn: twice what the tank takes at 1080p
STALE_REFRESHES: Final = 8  # without a swap for so many refreshes the clock counts alone
NS_PER_S: Final = 1_000_000_000
LOCKED, BY_CLOCK = "locked to the screen's swaps", "by the clock"


class Frames(QObject):
    """Asks for a frame once a refresh of the screen: ``due`` comes when one is to be drawn."""

    due = Signal()

    def __init__(
        self, refresh_hz: float, *, now_ns: Callable[[], int] = time.perf_counter_ns, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self.period_ns = round(NS_PER_S / max(refresh_hz, 1.0))
        self._now_ns = now_ns
        self._next_ns = 0
        self._drawn_ns = -NS_PER_S
        self._swapped_ns: int | None = None
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._draw)

    @property
    def locked(self) -> bool:
        swapped_ns = self._swapped_ns
        return swapped_ns is not None and self._now_ns() - swapped_ns < STALE_REFRESHES * self.period_ns

    @property
    def paced(self) -> str:
        return LOCKED if self.locked else BY_CLOCK

    @property
    def next_ns(self) -> int:
        return self._next_ns

    def start(self) -> None:
        self._next_ns = self._now_ns() + self.period_ns
        self._arm()

    def stop(self) -> None:
        """Ask for no more."""
        self._timer.stop()

    def swapped(self) -> None:
        """Note that the surface has just swapped: from now on, a frame is drawn shortly before each swap."""
        self._swapped_ns = self._now_ns()
        aim_ns = self._swapped_ns - min(LEAD_NS, self.period_ns // 2)
        half_ns = self.period_ns // 2
        self._next_ns += (aim_ns - self._next_ns + half_ns) % self.period_ns - half_ns
        while self._next_ns < self._drawn_ns + half_ns:  # the refresh that was just drawn is not drawn twice
            self._next_ns += self.period_ns
        if self._timer.isActive():
            self._arm()

    def _draw(self) -> None:
        """Ask for a frame; the next is waited for already, so that a slow frame does not put it off."""
        now_ns = self._drawn_ns = self._now_ns()
        missed = max(0, (now_ns - self._next_ns) // self.period_ns)
        self._next_ns += (missed + 1) * self.period_ns
        self._arm()
        self.due.emit()

    def _arm(self) -> None:
        self._timer.start(max(0, round((self._next_ns - self._now_ns()) / 1e6)))

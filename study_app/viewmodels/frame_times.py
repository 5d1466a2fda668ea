"""When frames were painted, and what that comes to. No Qt here."""

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

LEAST_S: Final = 2.0
KEPT_S: Final = 10.0
LATE: Final = 1.5  # so many refreshes of the screen apart, at least one was missed


@dataclass(frozen=True, slots=True)
class FrameFigures:
    """Frames of the last ten seconds: ``rate_hz`` and ``p99_ms`` of the gaps between them, and how many were missed."""

    rate_hz: float
    median_ms: float
    p99_ms: float
    missed: int
    painted: int


class FrameTimes:
    """Takes the time of every frame.

    Parameters
    ----------
    refresh_hz
        How often the screen shows one, as the system says.
    least_s
        So long frames are taken before anything is said of them.
    """

    def __init__(self, refresh_hz: float, least_s: float = LEAST_S) -> None:
        self.refresh_hz = refresh_hz if refresh_hz > 0 else 60.0
        self._least_ns = round(1e9 * least_s)
        self._times: deque[int] = deque()

    def add(self, time_ns: int) -> None:
        """Take a frame's time [ns]; older than ten seconds are forgotten."""
        self._times.append(time_ns)
        while time_ns - self._times[0] > 1e9 * KEPT_S:
            self._times.popleft()

    def figures(self) -> FrameFigures | None:
        """Return what the frames come to; None until there are enough."""
        times = list(self._times)
        if len(times) < 3 or times[-1] - times[0] < self._least_ns:
            return None
        gaps_ms = sorted((late - early) / 1e6 for early, late in pairwise(times))
        refresh_ms = 1000 / self.refresh_hz
        median_ms = gaps_ms[len(gaps_ms) // 2]
        return FrameFigures(
            rate_hz=1e9 * (len(times) - 1) / (times[-1] - times[0]),
            median_ms=median_ms,
            p99_ms=gaps_ms[min(len(gaps_ms) - 1, int(0.99 * len(gaps_ms)))],
            missed=sum(round(gap / refresh_ms) - 1 for gap in gaps_ms if gap > LATE * refresh_ms),
            painted=len(times),
        )

"""The clock of a session: seconds since one origin."""

import time
from collections.abc import Callable
from datetime import datetime, timedelta


class SessionClock:
    """Seconds since one origin on a monotonic clock; the wall clock is read only once, so setting it has no effect.

    Parameters
    ----------
    now_ns : callable
        The monotonic clock [ns]: the servo's own, so that recordings and journal share an axis.
    origin_at : datetime, optional
        Wall time at the origin, with its zone; by default so that the present moment is now.
    shown_s : float
        Present time of the clock, more than 0 in a resumed session [s].
    """

    def __init__(
        self, now_ns: Callable[[], int] = time.monotonic_ns, origin_at: datetime | None = None, *, shown_s: float = 0.0
    ) -> None:
        self._now_ns = now_ns
        self.origin_ns = now_ns() - round(shown_s * 1e9)
        if origin_at is None:
            origin_at = datetime.now().astimezone() - timedelta(seconds=shown_s)
        self.origin_at = origin_at

    def seconds(self) -> float:
        """Return the seconds since the origin."""
        return (self._now_ns() - self.origin_ns) / 1e9

    def at(self, seconds: float) -> str:
        """Return the wall time of ``seconds`` as ISO 8601 with zone."""
        return (self.origin_at + timedelta(seconds=seconds)).isoformat(timespec="milliseconds")

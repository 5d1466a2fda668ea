"""The mapping of the servo's clock to that of the Lab Streaming Layer, measured at the start and while it runs."""

import time
from collections.abc import Callable
from typing import Final

EVERY_S: Final = 5.0
READINGS: Final = 8


class ClockMapping:
    """The offset between two clocks, as an interval that certainly contains it.

    A reading of the other clock between two of the servo's bounds the offset. Bounds of later readings are intersected
    with earlier ones; if the intersection is empty, the clocks have drifted and the newest bounds count. Use it from
    one thread.
    """

    def __init__(self, now_ns: Callable[[], int], other_s: Callable[[], float]) -> None:
        self._now_ns = now_ns
        self._other_s = other_s
        self._low_s, self._high_s = float("-inf"), float("inf")
        self._due_s = 0.0
        self.measure()

    def measure(self) -> None:
        """Measure the offset again."""
        for _ in range(READINGS):
            before_ns = self._now_ns()
            other_s = self._other_s()
            after_ns = self._now_ns()
            low_s, high_s = other_s - 1e-9 * after_ns, other_s - 1e-9 * before_ns
            if low_s > self._high_s or high_s < self._low_s:
                self._low_s, self._high_s = low_s, high_s
            else:
                self._low_s, self._high_s = max(low_s, self._low_s), min(high_s, self._high_s)
        self._due_s = time.monotonic() + EVERY_S

    def measure_if_due(self) -> None:
        """Measure it again if the last measurement is older than `EVERY_S`."""
        if time.monotonic() >= self._due_s:
            self.measure()

    @property
    def offset_s(self) -> float:
        """The other clock's time minus the servo's time [s]."""
        return 0.5 * (self._low_s + self._high_s)

    @property
    def uncertainty_s(self) -> float:
        """The greatest error of the offset [s]."""
        return 0.5 * (self._high_s - self._low_s)

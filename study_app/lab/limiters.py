"""Counts the ticks of the last 10 s in which each limiter acted."""

from collections import deque
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.haptics.model.layout import LIMITER_NORM, LIMITER_SLEW, LIMITERS

SPAN_NS: Final = 10_000_000_000
NOW_NS: Final = 150_000_000


@dataclass(frozen=True, slots=True)
class LimiterCount:
    """A limiter, the number of ticks in the last 10 s in which it acted, and whether it acts now."""

    name: str
    ticks: int
    acting: bool


class LimiterCounts:
    """Counts of the last 10 s, batch by batch."""

    def __init__(self) -> None:
        self._batches: deque[tuple[int, Any]] = deque()

    def add(self, samples: Any) -> None:
        """Count in samples of telemetry (recarray of ``SAMPLE``)."""
        if len(samples) == 0:
            return
        newest_ns = int(samples.time_ns[-1])
        self._batches.append((newest_ns, np.array([np.count_nonzero(samples.limiters & it.bit) for it in LIMITERS])))
        while self._batches[0][0] <= newest_ns - SPAN_NS:
            self._batches.popleft()

    def rows(self, force_limit_n: float, slew_n: float) -> tuple[LimiterCount, ...]:
        """Return every limiter, for these limits of the force and of its change per tick."""
        newest_ns = self._batches[-1][0] if self._batches else 0
        nothing = np.zeros(len(LIMITERS), np.int64)
        counts = sum((batch for _, batch in self._batches), nothing)
        acting = sum((batch for when, batch in self._batches if when > newest_ns - NOW_NS), nothing)
        limits = {LIMITER_SLEW: f", {slew_n:g} N per tick", LIMITER_NORM: f", {force_limit_n:g} N"}
        return tuple(
            LimiterCount(limiter.label + limits.get(limiter.bit, ""), int(ticks), bool(now))
            for limiter, ticks, now in zip(LIMITERS, counts, acting, strict=True)
        )

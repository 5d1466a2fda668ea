"""Counts the ticks of the last 10 s in which each limiter acted."""

from collections import deque
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.haptics.model.layout import (
    LIMITER_ENERGY,
    LIMITER_ESTIMATOR,
    LIMITER_FADE,
    LIMITER_GLITCH,
    LIMITER_NON_FINITE,
    LIMITER_NORM,
    LIMITER_SATURATED,
    LIMITER_SLEW,
    LIMITER_SLOPE,
    LIMITER_STALE,
    LIMITER_STOP,
)

SPAN_NS: Final = 10_000_000_000
NOW_NS: Final = 150_000_000

WORDS: Final = {
    LIMITER_SLEW: "Slew",
    LIMITER_FADE: "Fade",
    LIMITER_SLOPE: "Slope",
    LIMITER_NORM: "Force",
    LIMITER_ENERGY: "Passivity controller",
    LIMITER_STALE: "Stale sample",
    LIMITER_GLITCH: "Rejected sample",
    LIMITER_NON_FINITE: "Non-finite force",
    LIMITER_STOP: "Force stopped",
    LIMITER_ESTIMATOR: "Velocity filter",
    LIMITER_SATURATED: "Saturated motors",
}
"""The displayed name of each limiter in all windows, in the order of the lab's card."""


@dataclass(frozen=True, slots=True)
class Limiter:
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
        self._batches.append((newest_ns, np.array([np.count_nonzero(samples.limiters & bit) for bit in WORDS])))
        while self._batches[0][0] <= newest_ns - SPAN_NS:
            self._batches.popleft()

    def rows(self, force_limit_n: float, slew_n: float) -> tuple[Limiter, ...]:
        """Return every limiter, for these limits of the force and of its change per tick."""
        newest_ns = self._batches[-1][0] if self._batches else 0
        nothing = np.zeros(len(WORDS), np.int64)
        counts = sum((batch for _, batch in self._batches), nothing)
        acting = sum((batch for when, batch in self._batches if when > newest_ns - NOW_NS), nothing)
        limits = {LIMITER_SLEW: f", {slew_n:g} N per tick", LIMITER_NORM: f", {force_limit_n:g} N"}
        return tuple(
            Limiter(words + limits.get(bit, ""), int(ticks), bool(now))
            for (bit, words), ticks, now in zip(WORDS.items(), counts, acting, strict=True)
        )

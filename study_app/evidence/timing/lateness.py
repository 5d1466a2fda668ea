"""What the loops' lateness comes to: percentiles, ratios to the bare loop, and whether they are within limits."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from study_app.evidence.timing.loops import NAMES, Kind, Taken, Whole
from study_app.evidence.timing.machine_load import LoadName
from study_app.haptics.runtime.clocks.grants import Grant, Level

LATE_NS: Final = 1_000_000
PERCENTILES: Final = (50.0, 90.0, 99.0, 99.9)

MEDIAN_US: Final = 15.0
TAIL_RATIO: Final = 2.5
FEWER_LATE: Final = 5.0
BUSY_US: Final = 5.0


@dataclass(frozen=True, slots=True)
class Lane:
    """One loop in one priority class: its latenesses, and how long its ticks took (empty: nothing was to do) [ns]."""

    kind: Kind
    grant: Grant
    lateness_ns: Whole
    busy_ns: Whole
    overruns: int

    @property
    def name(self) -> str:
        """The loop in words."""
        return NAMES[self.kind]

    @property
    def ticks(self) -> int:
        """How many ticks were taken."""
        return len(self.lateness_ns)

    def late_us(self, percent: float) -> float:
        """Return a percentile of the lateness [µs]; 100 is the worst."""
        return float(np.percentile(self.lateness_ns, percent)) * 1e-3

    def busy_us(self, percent: float) -> float:
        """Return a percentile of how long a tick took [µs]."""
        return float(np.percentile(self.busy_ns, percent)) * 1e-3

    @property
    def late(self) -> int:
        """How many ticks began more than 1 ms late, or not at all: a deadline passed over is one of them."""
        return int((self.lateness_ns > LATE_NS).sum()) + self.overruns

    @property
    def late_share(self) -> float:
        """The share of deadlines that were missed by more than 1 ms."""
        return self.late / max(self.ticks + self.overruns, 1)


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit of the servo in a priority class, and what was found; ``said`` has both in words."""

    level: Level
    said: str
    held: bool

    def __str__(self) -> str:
        return f"{self.level}: {self.said}: {'met' if self.held else 'missed'}"


@dataclass(frozen=True, slots=True)
class Timed:
    """What one run found; ``lanes`` come by priority class, the best last, the servo first in each."""

    machine: str
    load: LoadName
    seconds: float
    spin_us: float
    spun_share: float
    frames_hz: float | None
    lanes: tuple[Lane, ...]
    notes: tuple[str, ...]

    @property
    def levels(self) -> tuple[Level, ...]:
        """The priority classes there are."""
        return tuple(dict.fromkeys(lane.grant.level for lane in self.lanes))

    def lane(self, kind: Kind, level: Level) -> Lane | None:
        """Return one of the lanes, if it was timed."""
        return next((lane for lane in self.lanes if (lane.kind, lane.grant.level) == (kind, level)), None)

    def ratio(self, lane: Lane, percent: float) -> float:
        """Return how many times as late as the bare loop of its class a lane is, at a percentile."""
        bare = self.lane("bare", lane.grant.level)
        return lane.late_us(percent) / max(bare.late_us(percent), 1e-3) if bare is not None else float("nan")

    def limits(self) -> tuple[Limit, ...]:
        """Return the limits and what was found, class by class."""
        return tuple(limit for level in self.levels for limit in self._of(level))

    def _of(self, level: Level) -> Sequence[Limit]:
        servo, bare, thread = (self.lane(kind, level) for kind in ("servo", "bare", "thread"))
        if servo is None or bare is None or thread is None:
            return ()
        above_us = servo.late_us(50) - bare.late_us(50)
        ratio = self.ratio(servo, 99)
        took_us = servo.busy_us(99)
        late = (
            f"{servo.late:,} ticks over 1 ms late, {_fewer(thread, servo)} than with a Python thread "
            f"(at least {FEWER_LATE:g} times fewer; the bare loop: {_fewer(thread, bare)})"
        )
        return tuple(
            Limit(level, said, held)
            for said, held in (
                (f"median {above_us:+.1f} µs against the bare loop (at most +{MEDIAN_US:g} µs)", above_us <= MEDIAN_US),
                (f"p99 {ratio:.2f} times the bare loop's (at most {TAIL_RATIO:g})", ratio <= TAIL_RATIO),
                (late, thread.late_share >= FEWER_LATE * servo.late_share),
                (f"a tick took {took_us:.1f} µs at p99 (at most {BUSY_US:g} µs)", took_us <= BUSY_US),
            )
        )


def _fewer(thread: Lane, other: Lane) -> str:
    """Return in words how many times fewer ticks over 1 ms late one lane has than a Python thread."""
    if other.late == 0:
        return f"{thread.late:,} fewer"
    return f"{thread.late_share / other.late_share:.1f} times fewer"


def lane(kind: Kind, grant: Grant, parts: Sequence[Taken]) -> Lane:
    """Return a lane of what its loop did in all its ticks."""
    return Lane(
        kind,
        grant,
        np.concatenate([part.lateness_ns for part in parts]),
        np.concatenate([part.busy_ns for part in parts]),
        sum(part.overruns for part in parts),
    )

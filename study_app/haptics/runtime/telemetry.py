"""Samples of every tick of the servo: a ring with one writer, and any number of readers that never block it.

The servo fills the slot after the newest sample, then advances the count of samples written. A reader copies, reads the
count again, and drops and counts samples that may have been overwritten meanwhile; so no lock is needed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from study_app.haptics.kernels.c_functions import fence
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.passivity import DELIVERY_STEPS_PER_N
from study_app.haptics.kernels.sample_validation import FAULT_NS
from study_app.haptics.model.layout import (
    BUTTON_STOP,
    LIMITER_GLITCH,
    LIMITER_NAMES,
    SAMPLE,
    STATUS_DEVICE_LOST,
    STATUS_OK,
    STATUS_STALE_FAULT,
    records,
)

HISTORY = 32_768  # samples kept: 32 s at 1 kHz, 10 MB


class Samples(np.recarray[Any, Any]):
    """Samples of the servo, (n,) of ``SAMPLE``, with their bits and codes as columns (n,)."""

    def limited_by(self, name: str) -> Any:
        """Return in which samples the limiter of this name acted."""
        return self.limiters >> LIMITER_NAMES.index(name) & 1 != 0

    @property
    def is_ok(self) -> Any:
        return self.status == STATUS_OK

    @property
    def is_stale(self) -> Any:
        return self.status == STATUS_STALE_FAULT

    @property
    def is_lost(self) -> Any:
        return self.status == STATUS_DEVICE_LOST

    @property
    def has_stop_button(self) -> Any:
        return self.buttons & BUTTON_STOP != 0

    @property
    def is_hung(self) -> Any:
        """Whether the tick took so long that zero force was sent after its own force."""
        return (self.busy_ns >= FAULT_NS) & self.is_ok

    @property
    def stopped_limit_n(self) -> Any:
        """The greatest force [N] that a stopped servo may state, infinite while it is not stopped.

        A hung sample keeps a command that rounds to the zero sent after it.
        """
        stopped_n = np.where(self.is_hung, 1.0 / DELIVERY_STEPS_PER_N, 0.0)
        return np.where(self.is_hung | self.limited_by("stop") | self.is_stale, stopped_n, math.inf)


class Telemetry:
    """The samples of one servo.

    Parameters
    ----------
    history : int
        Number of samples that are kept.
    """

    def __init__(self, history: int = HISTORY) -> None:
        self.ring = records(SAMPLE, history)
        self.ring.status = 0  # touches every page of memory now, so that the servo has no page fault
        self.written = np.zeros(1, np.int64)

    def reader(self) -> Reader:
        return Reader(self)

    def latest(self) -> Any | None:
        """Return a copy of the newest sample (one record of ``SAMPLE``), or None before the first."""
        written = int(self.written[0])
        if written == 0:
            return None
        newest = (written - 1) % self.ring.size
        return self.ring[newest : newest + 1].copy()[0]

    def position_at(self, time_ns: int) -> tuple[np.ndarray[Any, Any], int]:
        """Return the handle's position at a time [m, (3,), hand frame], and the time to which it belongs [ns].

        Between two samples the position is interpolated and the time is ``time_ns``; before the oldest and after the
        newest both are that sample's, without extrapolation. Samples with a position that is not finite or was rejected
        are skipped. Before the first sample: the origin, at 0.
        """
        position = np.zeros(3)
        moment = _position_at(self.ring, self.written, time_ns, position)
        return position, int(moment)


class Reader:
    """One reader's position in the ring; ``dropped`` counts the samples that were overwritten before it read them."""

    def __init__(self, telemetry: Telemetry) -> None:
        self._ring = telemetry.ring
        self._written = telemetry.written
        self._next = int(telemetry.written[0])
        self.dropped = 0

    def read(self) -> Any:
        """Return copies of all samples since the last read, oldest first (`Samples`, maybe empty)."""
        waiting = min(int(self._written[0]) - self._next, self._ring.size)
        out = records(SAMPLE, waiting).view(Samples)
        first, following = _copy(self._ring, self._written, self._next, out)
        kept = following - first
        self.dropped += first - self._next
        self._next = following
        return out if kept == waiting else out[:kept]


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """The timing of the servo: all zero with too few samples.

    ``rate_hz`` is the achieved rate, lateness that of the ticks, ``worst_gap_s`` the longest time between two readings
    of the device, ``overruns`` the number of skipped deadlines.
    """

    ticks: int
    rate_hz: float
    lateness_p99_s: float
    worst_gap_s: float
    overruns: int


def timing(samples: Any, rate_hz: float) -> Timing:
    """Return the timing of ``samples`` (recarray of ``SAMPLE``, in order, gaps allowed) at the nominal ``rate_hz``."""
    ticks = int(samples.size)
    if ticks == 0:
        return Timing(ticks=0, rate_hz=0.0, lateness_p99_s=0.0, worst_gap_s=0.0, overruns=0)
    p99_s = float(np.percentile(samples.lateness_ns, 99)) * 1e-9
    follows = np.diff(samples.tick) == 1
    gaps_s = np.diff(samples.time_ns)[follows] * 1e-9
    deadlines_s = np.diff(samples.time_ns - samples.lateness_ns)[follows] * 1e-9
    elapsed_s = float(gaps_s.sum())
    return Timing(
        ticks=ticks,
        rate_hz=gaps_s.size / elapsed_s if elapsed_s > 0.0 else 0.0,
        lateness_p99_s=p99_s,
        worst_gap_s=float(gaps_s.max(initial=0.0)),
        overruns=int(np.rint(deadlines_s * rate_hz - 1.0).sum()),
    )


@kernel
def _copy(ring: Any, written: Any, wanted: int, out: Any) -> tuple[int, int]:
    """Copy samples from number ``wanted`` on into ``out``; return the numbers of the first one kept and of the next.

    Sample i is valid until sample i + n begins, that is while fewer than i + n are written.
    """
    size = ring.shape[0]
    following = written[0]
    fence()
    first = max(wanted, following - size + 1)
    for i in range(first, following):
        if i - first < out.shape[0]:
            out[i - first] = ring[i % size]
    following = min(following, first + out.shape[0])
    fence()
    whole = min(max(first, written[0] - size + 1), following)
    for i in range(whole, following):
        out[i - whole] = out[i - first]
    return whole, following


@kernel
def _position_at(ring: Any, written: Any, time_ns: int, position: Any) -> Any:
    """Write the position at ``time_ns`` into ``position`` (3,); return the time to which it belongs [ns]."""
    size = ring.shape[0]
    end = written[0]
    fence()
    oldest = max(0, end - size + 1)
    low, high = oldest - 1, end  # the last sample not after time_ns is in [low, high)
    while high - low > 1:
        middle = (low + high) // 2
        if ring[middle % size].time_ns <= time_ns:
            low = middle
        else:
            high = middle
    before = low
    while before >= oldest and not _plausible(ring[before % size]):
        before -= 1
    after = high
    while after < end and not _plausible(ring[after % size]):
        after += 1
    if before < oldest and after >= end:
        return 0
    if before < oldest:
        return _place(ring[after % size], position)
    if after >= end:
        return _place(ring[before % size], position)
    early, late = ring[before % size], ring[after % size]
    share = (time_ns - early.time_ns) / (late.time_ns - early.time_ns)
    for axis in range(3):
        position[axis] = early.position_m[axis] + share * (late.position_m[axis] - early.position_m[axis])
    return time_ns


@kernel
def _place(sample: Any, position: Any) -> Any:
    for axis in range(3):
        position[axis] = sample.position_m[axis]
    return sample.time_ns


@kernel
def _plausible(sample: Any) -> bool:
    if sample.limiters & LIMITER_GLITCH != 0:
        return False
    position = sample.position_m
    return math.isfinite(position[0]) and math.isfinite(position[1]) and math.isfinite(position[2])

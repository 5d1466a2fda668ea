"""Every sample of a servo looked at once: what was promised of it, and what was counted on the way.

Promised: no force beyond the limit or not finite; none while it is stopped; between two forces sent at most
the slew limit, unless a force stop, a fault or the passivity controller let go at once; no reading that is not finite;
a deadline every period, but for those passed over; every tick in telemetry, or counted as dropped.
"""

import math
from typing import Any, Final

import numpy as np

from study_app.evidence.soak.faulty_device import GLITCH_M
from study_app.haptics.kernels import DELIVERY_STEPS_PER_N, FAULT_NS, kernel
from study_app.haptics.model.layout import (
    BUTTON_STOP,
    LIMITER_ENERGY,
    LIMITER_GLITCH,
    LIMITER_NAMES,
    LIMITER_STOP,
    SAMPLE,
    STATUS_DEVICE_LOST,
    STATUS_OK,
    STATUS_STALE_FAULT,
    records,
)

TOLERANCE_N: Final = 1e-9

_COUNTS = np.dtype(
    [
        ("limit_n", np.float64),  # of the force
        ("slew_n", np.float64),  # limit of its change per tick
        ("period_ns", np.int64),
        # where it is
        ("follows", np.int64),  # 1: the next sample comes a period after the last one, of the same run
        ("next_tick", np.int64),
        ("next_deadline_ns", np.int64),
        ("last_n", np.float64, (3,)),
        # counted
        ("samples", np.int64),
        ("missing", np.int64),  # ticks without a sample
        ("overruns", np.int64),
        ("limiters", np.int64, (len(LIMITER_NAMES),)),
        ("refused", np.int64),  # readings
        ("not_finite", np.int64),  # readings that are not a position
        ("displaced", np.int64),  # readings beyond the device's reach
        ("silent", np.int64),  # ticks without a new reading
        ("lost", np.int64),  # ticks in which the device was lost when it was read
        ("lost_at_write", np.int64),  # and when it was written to
        ("stale", np.int64),  # ticks that ended with a stale fault
        ("buttons", np.int64),  # readings with the stop button down
        ("long_ticks", np.int64),  # ticks that took a period or more
        ("most_n", np.float64),
        ("steepest_n", np.float64),  # greatest change between two forces, where a limit is promised
        ("release_step_n", np.float64),  # while a stop or a fault released the force
        ("energy_step_n", np.float64),  # while the passivity controller repaid a debt
        ("latest_s", np.float64),  # greatest lateness of a tick
        # violated guarantees: number, and the tick of the first
        ("accepted", np.int64),
        ("excess", np.int64),
        ("no_number", np.int64),
        ("steps", np.int64),
        ("unstopped", np.int64),
        ("drift_ns", np.int64),  # greatest difference between a deadline and its prediction
        ("first_tick", np.int64),  # first tick of any violated guarantee; -1: none
    ],
    align=True,
)


class Audit:
    """The counts over all samples so far.

    ``limit_n`` is the greatest permitted force [N], ``slew_n`` its greatest permitted change per tick [N], and
    ``reach_m`` the greatest distance of the device's handle from the centre [m].
    """

    def __init__(self, limit_n: float, slew_n: float, period_ns: int, reach_m: float) -> None:
        self._memory = records(_COUNTS, 1)
        self.counts = self._memory[0]
        self.counts.limit_n, self.counts.slew_n = limit_n, slew_n
        self.counts.period_ns, self.counts.first_tick = period_ns, -1
        self._displaced_m = (reach_m + GLITCH_M) / 2

    def take(self, samples: Any) -> None:
        """Check the next ``samples`` (recarray of ``SAMPLE``)."""
        check_samples(self.counts, samples, self._displaced_m)


def prepare() -> None:
    """Compile the checks, or load them from the cache."""
    check_samples(records(_COUNTS, 1)[0], records(SAMPLE, 0), 1.0)


@kernel
def check_samples(counts: Any, samples: Any, displaced_m: float) -> None:
    """Check and count each of ``samples``."""
    for i in range(samples.shape[0]):
        sample = samples[i]
        counts.samples += 1
        if sample.tick != counts.next_tick:
            counts.missing += sample.tick - counts.next_tick
            counts.follows = 0
        counts.next_tick = sample.tick + 1
        _look_at_reading(counts, sample, displaced_m)
        _look_at_force(counts, sample)
        _look_at_time(counts, sample)
        for bit in range(len(LIMITER_NAMES)):
            counts.limiters[bit] += (sample.limiters >> bit) & 1
        counts.follows = 1 if sample.status == STATUS_OK else 0
        for axis in range(3):
            counts.last_n[axis] = sample.device_force_n[axis]


@kernel
def _look_at_reading(counts: Any, sample: Any, displaced_m: float) -> None:
    if sample.status == STATUS_STALE_FAULT:
        counts.stale += 1
    if sample.fresh == 0:
        if sample.status == STATUS_DEVICE_LOST:
            counts.lost += 1
        else:
            counts.silent += 1
        return
    if sample.status == STATUS_DEVICE_LOST:
        counts.lost_at_write += 1
    farthest_m, a_place = 0.0, True
    for axis in range(3):
        a_place = a_place and math.isfinite(sample.position_m[axis])
        farthest_m = max(farthest_m, abs(sample.position_m[axis]))
    refused = sample.limiters & LIMITER_GLITCH != 0
    if refused:
        counts.refused += 1
    if not a_place:
        counts.not_finite += 1
        if not refused:
            counts.accepted += 1
            _break_promise(counts, sample)
    elif farthest_m > displaced_m:
        counts.displaced += 1
    if sample.buttons & BUTTON_STOP:
        counts.buttons += 1


@kernel
def _look_at_force(counts: Any, sample: Any) -> None:
    square, change = 0.0, 0.0
    for axis in range(3):
        f, before = sample.device_force_n[axis], counts.last_n[axis]
        square += f * f
        change += (f - before) * (f - before)
    size_n, change_n = math.sqrt(square), math.sqrt(change)
    if not math.isfinite(size_n):
        counts.no_number += 1
        _break_promise(counts, sample)
        return
    counts.most_n = max(counts.most_n, size_n)
    if size_n > counts.limit_n + TOLERANCE_N:
        counts.excess += 1
        _break_promise(counts, sample)
    hung = sample.busy_ns >= FAULT_NS and sample.status == STATUS_OK
    stopped = hung or sample.limiters & LIMITER_STOP != 0 or sample.status == STATUS_STALE_FAULT
    kept_n = (
        1.0 / DELIVERY_STEPS_PER_N if hung else 0.0
    )  # a sample keeps a command that rounds to the zero sent after it
    if stopped and size_n > kept_n:
        counts.unstopped += 1
        _break_promise(counts, sample)
    if counts.follows == 0:
        return
    if stopped or sample.status != STATUS_OK:
        counts.release_step_n = max(counts.release_step_n, change_n)
        return
    if sample.limiters & LIMITER_ENERGY != 0:
        counts.energy_step_n = max(counts.energy_step_n, change_n)
        return
    counts.steepest_n = max(counts.steepest_n, change_n)
    if change_n > counts.slew_n + TOLERANCE_N:
        counts.steps += 1
        _break_promise(counts, sample)


@kernel
def _look_at_time(counts: Any, sample: Any) -> None:
    """Compare a deadline with the one predicted from the previous deadline and the end of that tick."""
    deadline_ns = sample.time_ns - sample.lateness_ns
    counts.latest_s = max(counts.latest_s, sample.lateness_ns * 1e-9)
    if counts.follows != 0 and deadline_ns != counts.next_deadline_ns:
        counts.drift_ns = max(counts.drift_ns, abs(deadline_ns - counts.next_deadline_ns))
        _break_promise(counts, sample)
    counts.next_deadline_ns = deadline_ns + counts.period_ns
    late_ns = sample.time_ns + sample.busy_ns - counts.next_deadline_ns
    if sample.busy_ns >= counts.period_ns:
        counts.long_ticks += 1
    if late_ns > 0:
        missed = late_ns // counts.period_ns
        counts.overruns += missed
        counts.next_deadline_ns += missed * counts.period_ns


@kernel
def _break_promise(counts: Any, sample: Any) -> None:
    if counts.first_tick < 0:
        counts.first_tick = sample.tick

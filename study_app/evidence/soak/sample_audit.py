"""Audit of every sample of a servo: violations of its guarantees, and counts of events.

The guarantees are: every force is finite and within the limit, and zero while the force is stopped; successive forces
differ by at most the slew limit, unless a force stop, a fault or the passivity controller releases the force at once;
no reading that is not finite is accepted; every period has a deadline, except skipped ones; every tick is in telemetry
or counted as dropped.
"""

from typing import Any, Final

import numpy as np

from study_app.devices.faulty import GLITCH_M
from study_app.haptics.model.layout import LIMITER_NAMES, records

TOLERANCE_N: Final = 1e-9

_COUNTS = np.dtype(
    [
        ("limit_n", np.float64),  # of the force
        ("slew_n", np.float64),  # limit of its change per tick
        ("period_ns", np.int64),
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
        self._was_ok = False
        self._next_tick = self._next_deadline_ns = 0
        self._last_n = np.zeros(3)

    def check(self, samples: Any) -> None:
        """Check the next ``samples`` (`Samples`), each against the one before it."""
        if len(samples) == 0:
            return
        counts = self.counts
        missing = samples.tick - _previous_values(self._next_tick, samples.tick + 1)
        follows = (missing == 0) & _previous_values(self._was_ok, samples.is_ok)
        counts.samples += len(samples)
        counts.missing += missing.sum()
        counts.limiters += [np.count_nonzero(samples.limited_by(name)) for name in LIMITER_NAMES]
        violating = (
            self._check_readings(samples) | self._check_forces(samples, follows) | self._check_times(samples, follows)
        )
        if counts.first_tick < 0 and violating.any():
            counts.first_tick = samples.tick[np.argmax(violating)]
        self._was_ok, self._next_tick = bool(samples.is_ok[-1]), int(samples.tick[-1]) + 1

    def _check_readings(self, samples: Any) -> Any:
        """Count readings; return the samples (n,) with an invalid position that was accepted."""
        is_fresh, is_lost, rejected = samples.fresh != 0, samples.is_lost, samples.limited_by("glitch")
        is_position = np.isfinite(samples.position_m).all(axis=1)
        farthest_m = np.abs(samples.position_m).max(axis=1)
        accepted = is_fresh & ~is_position & ~rejected
        for name, happened in (
            ("stale", samples.is_stale),
            ("lost", ~is_fresh & is_lost),
            ("silent", ~is_fresh & ~is_lost),
            ("lost_at_write", is_fresh & is_lost),
            ("refused", is_fresh & rejected),
            ("not_finite", is_fresh & ~is_position),
            ("accepted", accepted),
            ("displaced", is_fresh & is_position & (farthest_m > self._displaced_m)),
            ("buttons", is_fresh & samples.has_stop_button),
        ):
            self.counts[name] += np.count_nonzero(happened)
        return accepted

    def _check_forces(self, samples: Any, follows: Any) -> Any:
        """Measure forces and their changes; return the samples (n,) whose force breaks a guarantee."""
        counts, force_n = self.counts, samples.device_force_n
        size_n = np.linalg.norm(force_n, axis=1)
        change_n = np.linalg.norm(force_n - _previous_values(self._last_n, force_n), axis=1)
        is_force, stopped_limit_n = np.isfinite(size_n), samples.stopped_limit_n
        compared = follows & is_force
        released = compared & (np.isfinite(stopped_limit_n) | ~samples.is_ok)
        repaying_debt = compared & ~released & samples.limited_by("energy")
        limited = compared & ~released & ~repaying_debt
        for name, values_n, measured in (
            ("most_n", size_n, is_force),
            ("release_step_n", change_n, released),
            ("energy_step_n", change_n, repaying_debt),
            ("steepest_n", change_n, limited),
        ):
            counts[name] = np.fmax.reduce(values_n[measured], initial=counts[name])
        violations = {
            "no_number": ~is_force,
            "excess": is_force & (size_n > counts.limit_n + TOLERANCE_N),
            "unstopped": is_force & (size_n > stopped_limit_n),
            "steps": limited & (change_n > counts.slew_n + TOLERANCE_N),
        }
        for name, violated in violations.items():
            counts[name] += np.count_nonzero(violated)
        self._last_n = force_n[-1].copy()
        return np.logical_or.reduce(list(violations.values()))

    def _check_times(self, samples: Any, follows: Any) -> Any:
        """Compare each deadline with the one predicted from the previous tick; return the samples (n,) that deviate."""
        counts, period_ns = self.counts, self.counts.period_ns
        deadline_ns = samples.time_ns - samples.lateness_ns
        late_ns = samples.time_ns + samples.busy_ns - (deadline_ns + period_ns)
        skipped = np.maximum(late_ns, 0) // period_ns
        following_ns = deadline_ns + period_ns * (1 + skipped)
        drift_ns = np.where(follows, np.abs(deadline_ns - _previous_values(self._next_deadline_ns, following_ns)), 0)
        counts.latest_s = max(counts.latest_s, samples.lateness_ns.max() * 1e-9)
        counts.drift_ns = max(counts.drift_ns, drift_ns.max())
        counts.long_ticks += np.count_nonzero(samples.busy_ns >= period_ns)
        counts.overruns += skipped.sum()
        self._next_deadline_ns = int(following_ns[-1])
        return drift_ns > 0


def _previous_values(last: Any, values: Any) -> Any:
    """Return for each of the ``values`` (n, …) the value before it; ``last`` precedes the first one."""
    return np.concatenate([[last], values[:-1]])

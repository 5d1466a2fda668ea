"""The delivered values of trials and intervals, and the limits of the study that they violate.

A session computes them at the end of each interval, the analysis from the recording of the same interval. Forces are
rounded as in recordings, so that both get the same result.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final, TypeAlias

import numpy as np

from study_app.haptics.model.layout import (
    FORCE_STEP_N,
    LIMITER_ENERGY,
    LIMITER_GLITCH,
    LIMITER_NORM,
    LIMITER_SATURATED,
    SAMPLE,
)
from study_app.number_text import counted
from study_app.protocol.model import Limits, Protocol
from study_app.protocol.presented import Presentation
from study_app.protocol.trials import DELAY, DELAYS, FORCE_DELAY, OF_CONDITION, AnyTask, Follow, Stimulated
from study_app.psychophysics.delivery import (
    Times,
    Vectors,
    damping,
    difference,
    interpolate_vectors,
    lag,
    motion,
    sent_share,
)

_FORCES: Final = ("device_force_n", "force_n")
"""The fields of the force sent to the hand and of the force of the model."""
_DAMPING: Final = "damping_nspm"
_SETTLED_S: Final = 0.2
"""Time after the fade-in at which the evaluation of a task without a lead-in begins [s]."""
_PERCEPTIBLE_N: Final = 0.05
"""RMS force below which no error is computed, because people do not feel it [N]."""
_FILTER_HALF_WIDTH_S: Final = 0.018
"""Half width of the motion filter for the error of a force [s]. A longer filter removes motion that the loop adds; a
shorter one keeps encoder noise."""
LONGEST_S: Final = 0.26
"""Longest lag of a force that the search covers: the longest delay and jitter plus a margin [s]."""
TOLERATED_TICKS: Final = 1
"""Additional device delay for which the passivity controller still ensures passivity [ticks]."""
_MAX_DELAY_TICKS: Final = 8
"""Longest device delay that the search covers [ticks]."""
_AVERAGE_S: Final = 0.03
_FILTER_PASSES: Final = 3
"""High-pass filter for motion that no hand can cause, above 24 Hz (-3 dB): the length of the moving average [s], and
the number of passes, each of which subtracts the average of the average. A single pass left so much of quick strokes
that one loop in 1,500 gave a false result."""
_NEAR_S: Final = 0.1
"""Time that is evaluated before and after each tick in which the passivity controller acted [s]."""
_MIN_ACTED_S: Final = 0.1
_MIN_BRAKED_J: Final = 1e-3
"""Minimum time in which the controller acted [s], and minimum energy [J], for a device to count as late. [choice]"""
JUDGED: Final = np.dtype(
    [(name, SAMPLE[name]) for name in ("time_ns", "position_m", "force_n", "device_force_n", "limiters")]
)
"""The fields of a sample from which the delivered level is computed."""
Broken: TypeAlias = tuple[str, float, float]
"""A measured column that violates a limit, its value and the limit, both in the limit's unit (ms or percent)."""
# Columns of a trial's row and the protocol's limit for each.
_LIMITED_COLUMNS = (
    ("lateness_p99_ms", "lateness_ms"),
    ("worst_gap_ms", "worst_gap_ms"),
    ("delay_error_p95_ms", "delay_error_ms"),
    ("first_frame_gap_ms", "frame_gap_ms"),
    ("worst_frame_gap_ms", "frame_gap_ms"),
    ("withheld_share", "withheld_percent"),
)
_TARGETS_REACHED = "targets_reached"  # limited by "targets_percent"; the only measure with a lower limit


def judged_fields(samples: Any) -> Any:
    """Return samples (n,) with the fields `JUDGED` only, a third of the size."""
    rows = np.empty(len(samples), JUDGED)
    for name in JUDGED.fields or ():
        rows[name] = samples[name]
    return rows


@dataclass(frozen=True, slots=True, repr=False, kw_only=True)
class Delivered:
    """The delivered values of an interval; names and meanings are those of the columns of ``intervals``.

    ``clipped`` tells whether the force limit or saturated motors clipped the evaluated force.
    """

    value_delivered: float | None
    force_share: float | None
    apparent_mass_kg: float | None
    pace_mps: float
    clipped: bool

    @property
    def columns(self) -> dict[str, float | None]:
        """The values that the interval's row records."""
        return {name: value for name, value in asdict(self).items() if name != "clipped"}


def delivered_values(
    protocol: Protocol, presented: Stimulated, task: AnyTask, samples: Any, *, adjusted: bool = False
) -> Delivered:
    """Return the delivered values of an interval.

    Parameters
    ----------
    protocol : Protocol
        The study.
    presented : Stimulated
        The requested contents of the interval.
    task : AnyTask
        The task that was done.
    samples : array of `JUDGED` (n,)
        The interval's samples, from the first to the last one of its task.
    adjusted : bool
        Whether the participant adjusted the varied number, so that no single value was delivered.
    """
    samples = _plausible_samples(samples)
    times_s = (samples["time_ns"] - samples["time_ns"][:1]) * 1e-9
    fade_s = protocol.scene.fade_s
    period_s, link = 1 / protocol.device.rate_hz, protocol.presented_condition(presented).link()
    faded_s = fade_s + link.delay_s + link.jitter_s
    from_s = max(task.lead_s, faded_s) if isinstance(task, Follow) else faded_s + _SETTLED_S
    movement = motion(times_s, samples["position_m"], period_s).after(from_s)
    first = int(np.searchsorted(times_s, from_s))
    sent_n, model_n = (np.rint(samples[name] / FORCE_STEP_N) * FORCE_STEP_N for name in _FORCES)
    lag_s = None
    if link.acts or presented.vary == FORCE_DELAY:
        lag_s = _force_lag_s(times_s, sent_n, model_n, from_s, period_s)
    lag_rows = max(round((lag_s or 0.0) / period_s), 0)
    end = len(samples) - lag_rows
    sent_n, model_n = sent_n[first + lag_rows :], model_n[first:end]
    evaluated = movement.after(from_s, times_s[end - 1]) if lag_rows and end > 0 else movement
    can_fit = len(evaluated.times_s) and not adjusted
    fitted = damping(interpolate_vectors(evaluated.times_s, times_s[first:end], sent_n), evaluated) if can_fit else None
    value = presented.value if presented.vary not in {None, DELAY} and not adjusted else None
    if _varies_damping(presented):
        value = None if fitted is None else fitted[0]
    if presented.vary == FORCE_DELAY and not adjusted:
        value = None if lag_s is None else 1000 * lag_s
    return Delivered(
        value_delivered=value,
        force_share=sent_share(sent_n, model_n),
        apparent_mass_kg=None if fitted is None else fitted[1],
        pace_mps=movement.rms_speed_mps,
        clipped=bool((samples["limiters"][first:] & (LIMITER_NORM | LIMITER_SATURATED)).any()),
    )


def delivered_error(
    samples: Any, rate_hz: float, fade_s: float, law_n: Callable[[Times, Vectors, Vectors], Vectors]
) -> float | None:
    """Return the RMS difference between the force sent and the force law, relative to the RMS of the law.

    The law is evaluated for the motion as filtered from past and future positions. Return None if the motion is too
    short, or if the law's force is imperceptible.

    Parameters
    ----------
    samples : array of `JUDGED` (n,)
        The samples of a trial or interval, from its first on.
    rate_hz : float
        Samples per second.
    fade_s : float
        Fade-in time of the force; the error is evaluated from `_SETTLED_S` later.
    law_n : callable
        Returns the law's forces (m, 3) [N] from times (m,) [s], positions and velocities (m, 3) of the hand [m, m/s].
    """
    samples = _plausible_samples(samples)
    times_s = (samples["time_ns"] - samples["time_ns"][:1]) * 1e-9
    movement = motion(times_s, samples["position_m"], 1 / rate_hz, _FILTER_HALF_WIDTH_S)
    evaluated = movement.times_s > fade_s + _SETTLED_S
    if not evaluated.any():
        return None
    rounded_n = np.rint(samples["device_force_n"] / FORCE_STEP_N) * FORCE_STEP_N
    position_m, sent_n = (
        interpolate_vectors(movement.times_s, times_s, values) for values in (samples["position_m"], rounded_n)
    )
    law_force_n = law_n(movement.times_s, position_m, movement.velocity_mps)[evaluated]
    error_n = sent_n[evaluated] - law_force_n
    error_n2, law_force_n2 = (
        float(np.mean(np.einsum("ij,ij->i", values, values))) for values in (error_n, law_force_n)
    )
    return round(math.sqrt(error_n2 / law_force_n2), 6) if law_force_n2 > _PERCEPTIBLE_N**2 else None


def late_device_ticks(samples: Any, rate_hz: float) -> int | None:
    """Return a lower bound on a device's delay [ticks] if it is two or more ticks longer than assumed, else None.

    A hand cannot cause motion above 24 Hz, so in this band the device's force either drives or brakes an oscillation.
    An oscillation persists only if the force does not brake it. If the force would brake it at the assumed delay plus
    one tick, the real delay is longer: at least the first one at which the force would not brake. Such an oscillation
    is visible only while the passivity controller acts.

    Parameters
    ----------
    samples : array (n,)
        The samples of a trial or interval, with ``delay_ticks`` and the fields of `JUDGED`.
    rate_hz : float
        Samples per second.
    """
    samples = _plausible_samples(samples)
    acted = samples["limiters"][1:] & LIMITER_ENERGY != 0
    if np.count_nonzero(acted) < _MIN_ACTED_S * rate_hz:
        return None
    margin = round(_NEAR_S * rate_hz)
    near = np.convolve(acted, np.ones(2 * margin + 1))[margin:-margin] >= 1
    steps_m = _high_pass(np.diff(samples["position_m"], axis=0), rate_hz) * near[:, np.newaxis]
    force_n = _high_pass(samples["device_force_n"][:-1], rate_hz)
    first = int(samples["delay_ticks"].max()) + TOLERATED_TICKS
    work_j = [
        float(np.sum(force_n[: len(force_n) - ticks] * steps_m[ticks:])) for ticks in range(first, _MAX_DELAY_TICKS + 1)
    ]
    if work_j[0] > -_MIN_BRAKED_J:
        return None
    return next((ticks for ticks, energy_j in enumerate(work_j, first) if energy_j >= 0), None)


def late_device_text(measured: Mapping[str, Any]) -> str:
    """Return a sentence if the measures of a trial contain the delay of a device that answered late, else ""."""
    ticks = measured.get("device_delay_ticks")
    if ticks is None:
        return ""
    assumed = counted(measured["loop_delay_ticks"], "tick")
    return f"the device answered after {ticks} ticks, but the servo assumes {assumed}"


def _high_pass(vectors: Vectors, rate_hz: float) -> Vectors:
    """Return vectors (n, 3) without their slow components (see `_FILTER_PASSES`)."""
    rows = max(round(_AVERAGE_S * rate_hz), 1)
    weights = np.convolve(np.full(rows, 1 / rows), np.full(rows, 1 / rows))
    for _ in range(_FILTER_PASSES):
        padded = np.pad(vectors, ((rows - 1, rows - 1), (0, 0)), "edge")
        vectors = vectors - np.array([np.convolve(axis, weights, "valid") for axis in padded.T]).T
    return vectors


def _force_lag_s(times_s: Times, sent_n: Vectors, model_n: Vectors, from_s: float, period_s: float) -> float | None:
    """Return the lag of the sent force behind the model's force from ``from_s`` on [s]; None without force."""
    max_rows = round(min(LONGEST_S, from_s) / period_s)
    grid_s = np.arange(from_s - max_rows * period_s, times_s[-1] if len(times_s) else 0.0, period_s)
    if len(grid_s) == 0:
        return None
    lag_rows = lag(
        interpolate_vectors(grid_s, times_s, sent_n), interpolate_vectors(grid_s, times_s, model_n), max_rows
    )
    return None if lag_rows is None else lag_rows * period_s


def _plausible_samples(samples: Any) -> Any:
    """Return the samples without rejected positions."""
    glitches = samples["limiters"] & LIMITER_GLITCH != 0
    return samples[~glitches] if glitches.any() else samples


def delay_error_ms(presented: Stimulated, summary: Mapping[str, Any]) -> float | None:
    """Return the error of an interval's varied delay [ms], from its measurements; None if unknown."""
    if presented.vary != FORCE_DELAY:
        mean_ms: float | None = summary.get("delay_error_mean_ms")
        return mean_ms
    value = summary.get("value_delivered")
    return None if value is None else value - presented.value


def _varies_damping(presented: Stimulated) -> bool:
    """Return whether the varied quantity is the damping of a linear law, which can be measured at the hand."""
    return (presented.vary or "").rpartition(".")[2] == _DAMPING


def broken_interval_limits(
    limits: Limits, presented: Stimulated, task: AnyTask, delivery: Delivered, *, adjusted: bool = False
) -> Iterator[str]:
    """Yield the key of each limit in the study's file that an interval violates.

    For an ``adjusted`` interval the sent proportion of the force is compared with 1, whichever quantity is varied.
    """
    max_error_percent = limits.level_error_percent
    if presented.vary is not None and presented.vary not in OF_CONDITION and max_error_percent is not None:
        is_fitted = _varies_damping(presented) and not adjusted
        measured = delivery.value_delivered if is_fitted else delivery.force_share
        requested = presented.value if is_fitted else 1.0
        # a hand at rest receives no force
        if abs((measured or 0.0) - requested) > abs(requested) * max_error_percent / 100:
            yield "level_error_percent"
    if presented.vary not in {None, DELAY} and max_error_percent is not None and delivery.clipped:
        yield "force_limit_n"
    if isinstance(task, Follow) and limits.pace_error_percent is not None:
        pace = task.rms_speed_mps
        if abs(delivery.pace_mps - pace) > pace * limits.pace_error_percent / 100:
            yield "pace_error_percent"


def broken_trial_limits(
    limits: Limits, due: Presentation, holds: Sequence[bool], errors_ms: Sequence[float | None], rate_hz: float
) -> Iterator[str]:
    """Yield the key of the violated limit if the delays of a trial's intervals do not differ as requested.

    Parameters
    ----------
    limits : Limits
        The limits of the study.
    due : Presentation
        The presentation of the trial.
    holds : sequence of bool
        Whether each interval presented the comparison.
    errors_ms : sequence of float or None
        The error of the visual or force delay in each interval [ms].
    rate_hz : float
        Ticks per second; a force delay may deviate by one more tick.
    """
    vary = due.intervals[0].vary
    if limits.level_error_ms is None or vary not in DELAYS or len(errors_ms) < len(holds):
        return
    deviation_ms = difference(errors_ms, holds)
    tick_ms = 1000 / rate_hz if vary == FORCE_DELAY else 0.0
    if deviation_ms is not None and abs(deviation_ms) > limits.level_error_ms + tick_ms:
        yield "level_error_ms"


def is_within_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> bool | None:
    """Return whether a trial's measured columns are within the protocol's limits; None without measurements.

    ``limits`` are those of the journal's first line, or ``Limits`` of a protocol as a mapping.
    """
    comparisons = _compared_limits(measured, limits)
    return not beyond_limits(measured, limits) if comparisons else None


def beyond_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> tuple[Broken, ...]:
    """Return name, value and limit of each measured column of a trial that violates its limit.

    Value and limit are in the limit's unit, ms or percent.
    """
    comparisons = _compared_limits(measured, limits)
    return tuple(
        comparison
        for comparison in comparisons
        if (
            comparison[1] < comparison[2]
            if comparison[0] == _TARGETS_REACHED
            else not abs(comparison[1]) <= comparison[2]
        )
    )


def broken_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> tuple[str, ...]:
    """Return the limits that a trial's or an interval's measured columns violate, by their keys in the protocol."""
    keys = dict(_LIMITED_COLUMNS) | {_TARGETS_REACHED: "targets_percent"}
    return tuple(dict.fromkeys(keys[measure] for measure, _, _ in beyond_limits(measured, limits)))


def _compared_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> list[Broken]:
    comparisons = [
        (measure, measured[measure] * (100 if limit.endswith("_percent") else 1), limits[limit])
        for measure, limit in _LIMITED_COLUMNS
        if measured.get(measure) is not None and limit in limits
    ]
    reached, targets = measured.get(_TARGETS_REACHED), measured.get("targets")
    if "targets_percent" in limits and reached is not None and targets:
        comparisons.append((_TARGETS_REACHED, 100 * reached / targets, limits["targets_percent"]))
    return comparisons

"""The delivered values of trials and intervals, and the limits of the study that they break.

The session asks at the end of each interval, the analysis of the recording of the same interval. Forces are taken as
recordings have them, so that both compute the same.
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
"""Time after the fade-in at which the evaluation of a task without a lead begins [s]."""
_FELT_N: Final = 0.05
"""RMS of a force below which no error is computed, since people do not feel it [N]."""
_TRUE_HALF_S: Final = 0.018
"""Half width of the filter of the motion on which a force's error is computed [s]. A longer one removes motion that the
loop adds; a shorter one keeps encoder noise."""
LONGEST_S: Final = 0.26
"""Longest lag of a force that is searched for: the longest delay with the longest jitter, plus a margin [s]."""
TOLERATED_TICKS: Final = 1
"""The passivity controller also holds if a device is this much later than assumed."""
_LONGEST_TICKS: Final = 8
"""Longest delay of a device that is searched for."""
_FAST_S: Final = 0.03
_FAST_PASSES: Final = 3
"""Length of a moving average [s], and how often what it takes, twice in a row, is removed: what remains, above 24 Hz
(-3 dB), no hand can drive. A single pass left enough of quick strokes for one false result in 1,500 loops."""
_NEAR_S: Final = 0.1
"""Time before and after a tick in which the passivity controller acted that is evaluated [s]."""
_ACTED_S: Final = 0.1
_BRAKED_J: Final = 1e-3
"""Least time in which the controller acted [s] and least energy [J] for a device to count as late. [choice]"""
JUDGED: Final = np.dtype(
    [(name, SAMPLE[name]) for name in ("time_ns", "position_m", "force_n", "device_force_n", "limiters")]
)
"""The fields of a sample from which the delivered level is computed."""
Broken: TypeAlias = tuple[str, float, float]
"""A measured column that breaks a limit, its value and the limit, both in the limit's unit: ms or percent."""
# Columns of a trial's row and the protocol's limit for each.
_JUDGED = (
    ("lateness_p99_ms", "lateness_ms"),
    ("worst_gap_ms", "worst_gap_ms"),
    ("delay_error_p95_ms", "delay_error_ms"),
    ("first_frame_gap_ms", "frame_gap_ms"),
    ("worst_frame_gap_ms", "frame_gap_ms"),
    ("withheld_share", "withheld_percent"),
)
_LEAST = "targets_reached"  # limited by "targets_percent"; the only measure with a lower limit


def judged_fields(samples: Any) -> Any:
    """Return the fields `JUDGED` of samples (n,), a third of their size."""
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
    moved = motion(times_s, samples["position_m"], period_s).after(from_s)
    first = int(np.searchsorted(times_s, from_s))
    sent_n, model_n = (np.rint(samples[name] / FORCE_STEP_N) * FORCE_STEP_N for name in _FORCES)
    lag_s = None
    if link.acts or presented.vary == FORCE_DELAY:
        lag_s = _lag_s(times_s, sent_n, model_n, from_s, period_s)
    late = max(round((lag_s or 0.0) / period_s), 0)
    kept = len(samples) - late
    sent_n, model_n = sent_n[first + late :], model_n[first:kept]
    prompt = moved.after(from_s, times_s[kept - 1]) if late and kept > 0 else moved
    judges = len(prompt.times_s) and not adjusted
    fitted = damping(interpolate_vectors(prompt.times_s, times_s[first:kept], sent_n), prompt) if judges else None
    value = presented.value if presented.vary not in {None, DELAY} and not adjusted else None
    if _varies_damping(presented):
        value = None if fitted is None else fitted[0]
    if presented.vary == FORCE_DELAY and not adjusted:
        value = None if lag_s is None else 1000 * lag_s
    return Delivered(
        value_delivered=value,
        force_share=sent_share(sent_n, model_n),
        apparent_mass_kg=None if fitted is None else fitted[1],
        pace_mps=moved.rms_speed_mps,
        clipped=bool((samples["limiters"][first:] & (LIMITER_NORM | LIMITER_SATURATED)).any()),
    )


def delivered_error(
    samples: Any, rate_hz: float, fade_s: float, law_n: Callable[[Times, Vectors, Vectors], Vectors]
) -> float | None:
    """Return the RMS difference between the force sent and the force law, relative to the RMS of the law.

    The law is evaluated for the motion itself, from past and future positions. None for a motion that is too short, or
    if the law gives no perceptible force.

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
    moved = motion(times_s, samples["position_m"], 1 / rate_hz, _TRUE_HALF_S)
    counted = moved.times_s > fade_s + _SETTLED_S
    if not counted.any():
        return None
    rounded_n = np.rint(samples["device_force_n"] / FORCE_STEP_N) * FORCE_STEP_N
    position_m, sent_n = (interpolate_vectors(moved.times_s, times_s, it) for it in (samples["position_m"], rounded_n))
    right_n = law_n(moved.times_s, position_m, moved.velocity_mps)[counted]
    off_n = sent_n[counted] - right_n
    off_n2, right_n2 = (float(np.mean(np.einsum("ij,ij->i", it, it))) for it in (off_n, right_n))
    return round(math.sqrt(off_n2 / right_n2), 6) if right_n2 > _FELT_N**2 else None


def late_device_ticks(samples: Any, rate_hz: float) -> int | None:
    """Return the least delay [ticks] of a device that answers two ticks or more later than assumed, else None.

    No hand drives motion above 24 Hz, so in this band the device's force drives it or brakes it. If the force would
    have braked an oscillation with the assumed delay, and with one tick more, it acts later still: at least with the
    first delay at which it would not have braked. That is visible only while the passivity controller acts.

    Parameters
    ----------
    samples : array (n,)
        The samples of a trial or interval, with ``delay_ticks`` and the fields of `JUDGED`.
    rate_hz : float
        Samples per second.
    """
    samples = _plausible_samples(samples)
    acted = samples["limiters"][1:] & LIMITER_ENERGY != 0
    if np.count_nonzero(acted) < _ACTED_S * rate_hz:
        return None
    aside = round(_NEAR_S * rate_hz)
    near = np.convolve(acted, np.ones(2 * aside + 1))[aside:-aside] >= 1
    steps_m = _fast_part(np.diff(samples["position_m"], axis=0), rate_hz) * near[:, np.newaxis]
    force_n = _fast_part(samples["device_force_n"][:-1], rate_hz)
    first = int(samples["delay_ticks"].max()) + TOLERATED_TICKS
    work_j = [
        float(np.sum(force_n[: len(force_n) - ticks] * steps_m[ticks:])) for ticks in range(first, _LONGEST_TICKS + 1)
    ]
    if work_j[0] > -_BRAKED_J:
        return None
    return next((ticks for ticks, energy_j in enumerate(work_j, first) if energy_j >= 0), None)


def late_device_text(measured: Mapping[str, Any]) -> str:
    """Return a sentence if the measures of a trial contain the delay of a device that answered late, else ""."""
    ticks = measured.get("device_delay_ticks")
    if ticks is None:
        return ""
    assumed = counted(measured["loop_delay_ticks"], "tick")
    return f"the device answered after {ticks} ticks, but the servo assumes {assumed}"


def _fast_part(vectors: Vectors, rate_hz: float) -> Vectors:
    """Return vectors (n, 3) without what is slow (`_FAST_S`)."""
    rows = max(round(_FAST_S * rate_hz), 1)
    weights = np.convolve(np.full(rows, 1 / rows), np.full(rows, 1 / rows))
    for _ in range(_FAST_PASSES):
        padded = np.pad(vectors, ((rows - 1, rows - 1), (0, 0)), "edge")
        vectors = vectors - np.array([np.convolve(axis, weights, "valid") for axis in padded.T]).T
    return vectors


def _lag_s(times_s: Times, sent_n: Vectors, model_n: Vectors, from_s: float, period_s: float) -> float | None:
    """Return the lag of the sent force [s], from a time on [s]; None without force."""
    most = round(min(LONGEST_S, from_s) / period_s)
    even_s = np.arange(from_s - most * period_s, times_s[-1] if len(times_s) else 0.0, period_s)
    if len(even_s) == 0:
        return None
    rows = lag(interpolate_vectors(even_s, times_s, sent_n), interpolate_vectors(even_s, times_s, model_n), most)
    return None if rows is None else rows * period_s


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

    For an ``adjusted`` interval the share of the force that was sent is judged for any varied number.
    """
    most = limits.level_error_percent
    if presented.vary is not None and presented.vary not in OF_CONDITION and most is not None:
        fitted = _varies_damping(presented) and not adjusted
        measured = delivery.value_delivered if fitted else delivery.force_share
        requested = presented.value if fitted else 1.0
        if abs((measured or 0.0) - requested) > abs(requested) * most / 100:  # a hand at rest receives no force
            yield "level_error_percent"
    if presented.vary not in {None, DELAY} and most is not None and delivery.clipped:
        yield "force_limit_n"
    if isinstance(task, Follow) and limits.pace_error_percent is not None:
        pace = task.rms_speed_mps
        if abs(delivery.pace_mps - pace) > pace * limits.pace_error_percent / 100:
            yield "pace_error_percent"


def broken_trial_limits(
    limits: Limits, due: Presentation, holds: Sequence[bool], errors_ms: Sequence[float | None], rate_hz: float
) -> Iterator[str]:
    """Yield the key of the limit that a trial violates if the delays of its intervals do not differ as requested.

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
    missed_ms = difference(errors_ms, holds)
    tick_ms = 1000 / rate_hz if vary == FORCE_DELAY else 0.0
    if missed_ms is not None and abs(missed_ms) > limits.level_error_ms + tick_ms:
        yield "level_error_ms"


def is_within_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> bool | None:
    """Return whether a trial's measured columns are within the protocol's limits; None without measurements.

    ``limits`` are those of the journal's first line, or ``Limits`` of a protocol as a mapping.
    """
    judged = _compared_limits(measured, limits)
    return not beyond_limits(measured, limits) if judged else None


def beyond_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> tuple[Broken, ...]:
    """Return name, value and limit of each measured column of a trial that violates its limit.

    Value and limit are in the limit's unit, ms or percent.
    """
    judged = _compared_limits(measured, limits)
    return tuple(
        comparison
        for comparison in judged
        if (comparison[1] < comparison[2] if comparison[0] == _LEAST else not abs(comparison[1]) <= comparison[2])
    )


def broken_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> tuple[str, ...]:
    """Return the limits that a trial's or an interval's measured columns violate, by their keys in the protocol."""
    keys = dict(_JUDGED) | {_LEAST: "targets_percent"}
    return tuple(dict.fromkeys(keys[measure] for measure, _, _ in beyond_limits(measured, limits)))


def _compared_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> list[Broken]:
    judged = [
        (measure, measured[measure] * (100 if limit.endswith("_percent") else 1), limits[limit])
        for measure, limit in _JUDGED
        if measured.get(measure) is not None and limit in limits
    ]
    reached, targets = measured.get(_LEAST), measured.get("targets")
    if "targets_percent" in limits and reached is not None and targets:
        judged.append((_LEAST, 100 * reached / targets, limits["targets_percent"]))
    return judged

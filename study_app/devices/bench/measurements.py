"""Analysis of the samples of a bench test: timing, noise, mass and friction, delay, gain of the force."""

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.haptics.model.ranges import Vector
from study_app.haptics.runtime.telemetry import timing

Floats = NDArray[np.float64]

GRAVITY_MPS2: Final = 9.80665
_SIGMA_S: Final = 4e-3
"""Width of the Gaussian that smooths positions and forces: its gain at 40 Hz is one half."""
_SLOW_MPS: Final = 1e-3
"""Speed at which the modelled friction reaches three quarters of its full value."""
_MAX_DELAY_S: Final = 8e-3
_ORDER: Final = 5
_COUNTING_MPS: Final = (0.02, 0.2)
"""Range of speeds at which positions reveal the size of an encoder count."""
_MIN_COUNTED: Final = 200
_MEDIAN_OF_NORMAL: Final = 0.6745  # median absolute value of a normal variable, in standard deviations
_STEP_S: Final = 0.1e-3
_COARSE_STEPS: Final = 10
_GAUSSIAN_REACH: Final = 5  # standard deviations of the Gaussian on either side


class Spread(NamedTuple):
    """Median, 99th percentile and maximum of values; NaN without values."""

    median: float
    most: float
    greatest: float


class Regularity(NamedTuple):
    """The loop's timing with the device: see `regularity`."""

    ticks: int
    lateness_ms: Spread
    busy_ms: Spread
    new_share: float
    longest_gap_ms: float
    delay_ticks: tuple[int, int]


class Noise(NamedTuple):
    """The noise of the position of a handle at rest: see `noise`."""

    position_um: tuple[float, float, float]
    peak_um: tuple[float, float, float]
    velocity_mmps: float
    drift_um: float


class Motion(NamedTuple):
    """The dynamics of an axis: mass [kg], damping [N·s/m], Coulomb friction [N], delay [ms], variance explained.

    ``count_um`` is the encoder count [µm] that explains the noise of its positions; NaN if the axis moved too little.
    """

    mass_kg: float
    damping_nspm: float
    friction_n: float
    delay_ms: float
    explained: float
    count_um: float = math.nan


class Gain(NamedTuple):
    """Force on a scale relative to the force sent: slope, offset [N], greatest residual [N], number of readings."""

    gain: float
    offset_n: float
    residual_n: float
    readings: int


def regularity(samples: Any, rate_hz: float) -> Regularity:
    """Return the loop's timing from samples (n,).

    It consists of the lateness and duration of a tick (median, 99 %, greatest) [ms], the fraction of ticks with a new
    position, the longest time between two new positions [ms], and the least and greatest delay [ticks].
    """
    new_ns = samples.time_ns[samples.fresh == 1]
    return Regularity(
        timing(samples, rate_hz).ticks,
        _spread(samples.lateness_ns * 1e-6),
        _spread(samples.busy_ns * 1e-6),
        float((samples.fresh == 1).mean()) if len(samples) else 0.0,
        float(np.diff(new_ns).max(initial=0) * 1e-6),
        (int(samples.delay_ticks.min(initial=99)), int(samples.delay_ticks.max(initial=0))),
    )


def _spread(values: Floats) -> Spread:
    if len(values) == 0:
        return Spread(median=math.nan, most=math.nan, greatest=math.nan)
    median, most = np.percentile(values, (50, 99)).tolist()
    return Spread(median=median, most=most, greatest=float(values.max()))


def noise(samples: Any) -> Noise:
    """Return the noise of a handle that rests without force, from samples (n,).

    It consists of the standard deviation and range of each axis about a straight line [µm], the RMS of the EWMA
    velocity (weight 0.1) over the three axes [mm/s], and the displacement from the first to the last position [µm].
    """
    t_s, position_m = _new_positions(samples)
    design = np.column_stack([np.ones_like(t_s), t_s - t_s.mean()])
    residual_m = position_m - design @ np.linalg.lstsq(design, position_m, rcond=None)[0]
    velocity_mps, average_mps = np.diff(position_m, axis=0) / np.diff(t_s)[:, None], np.zeros(3)
    smoothed = np.empty_like(velocity_mps)
    for k, newest_mps in enumerate(velocity_mps):
        average_mps = average_mps + 0.1 * (newest_mps - average_mps)
        smoothed[k] = average_mps
    size_mps = float(np.sqrt((smoothed[len(smoothed) // 10 :] ** 2).sum(axis=1).mean()))
    return Noise(
        _vector_of(1e6 * residual_m.std(axis=0)),
        _vector_of(1e6 * np.ptp(residual_m, axis=0)),
        1e3 * size_mps,
        1e6 * float(np.linalg.norm(position_m[-1] - position_m[0])),
    )


def motion_under_force(stretches: Sequence[Any], axis: int, rate_hz: float) -> Motion:
    """Fit F(t − d) = m a + b v + f sgn v + k x + c to the forces that were sent along an axis.

    Positions, forces and sgn v are smoothed by the same Gaussian, whose derivatives give v and a, so that smoothing
    biases no term. The delay d minimises the residual. The ``stretches`` are segments of samples without gaps and with
    different forces, which distinguishes friction from delay: the phase lag due to friction falls with the speed, that
    of a delay does not.
    """
    step_s = 1.0 / rate_hz
    prepared = [_prepare_segment(samples, axis, step_s) for samples in stretches]
    orthogonal, triangle = np.linalg.qr(np.concatenate([system.terms for system in prepared]))

    def force_n(delay_s: float) -> Floats:
        return np.concatenate([system.force_n(delay_s) for system in prepared])

    def residual_n2(delay_s: float) -> float:
        force = force_n(delay_s)
        return float(force @ force - np.sum((force @ orthogonal) ** 2)) / len(force)

    # Forces are smoothed over 4 ms (_SIGMA_S), so the residual has a single minimum within 1 ms of the coarse one.
    coarse_s = min(np.arange(0.0, _MAX_DELAY_S, _COARSE_STEPS * _STEP_S), key=residual_n2)
    fine_delays_s = coarse_s + np.arange(1 - _COARSE_STEPS, _COARSE_STEPS) * _STEP_S
    delay_s = float(min(fine_delays_s[fine_delays_s >= 0.0], key=residual_n2))
    mass_kg, damping_nspm, friction_n, *_ = np.linalg.solve(triangle, force_n(delay_s) @ orthogonal)
    unexplained_n2, variance = residual_n2(delay_s), float(force_n(delay_s).var())
    return Motion(
        mass_kg=float(mass_kg),
        damping_nspm=float(damping_nspm),
        friction_n=float(friction_n),
        delay_ms=1e3 * delay_s,
        explained=1.0 - unexplained_n2 / variance if variance > 0.0 else 0.0,
        count_um=count_um(stretches, axis),
    )


def count_um(stretches: Sequence[Any], axis: int) -> float:
    """Return the encoder count [µm] along an axis; NaN if it moved too little.

    Quantisation shifts a position by up to half a count, evenly distributed, which is count / √12 RMS. The differences
    of order `_ORDER` contain this noise and almost nothing of a motion below 25 Hz. Only positions at
    `_COUNTING_MPS` are used: slower motion repeats counts, and faster motion adds the timing uncertainty of samples.
    """
    noises_m: list[Floats] = []
    for samples in stretches:
        t_s, position_m = _new_positions(samples)
        if len(t_s) <= _ORDER:
            continue
        steps_s, x_m = np.diff(t_s), position_m[:, axis]
        speed_mps = np.abs(x_m[_ORDER:] - x_m[:-_ORDER]) / (t_s[_ORDER:] - t_s[:-_ORDER])
        longest_s = np.lib.stride_tricks.sliding_window_view(steps_s, _ORDER).max(axis=1)
        used = (speed_mps > _COUNTING_MPS[0]) & (speed_mps < _COUNTING_MPS[1]) & (longest_s < 1.5 * np.median(steps_s))
        noises_m.append(np.diff(x_m, _ORDER)[used])
    noise_m = np.concatenate(noises_m) if noises_m else np.empty(0)
    if len(noise_m) < _MIN_COUNTED:
        return math.nan
    spread_m = float(np.median(np.abs(noise_m))) / _MEDIAN_OF_NORMAL
    return 1e6 * math.sqrt(12.0 / math.comb(2 * _ORDER, _ORDER)) * spread_m


class _Prepared(NamedTuple):
    """A segment prepared for the fit: the smoothed terms, and the sent forces with the middle of their time."""

    terms: Floats
    sent_s: Floats
    sent_n: Floats
    grid_s: Floats
    bell: Floats

    def force_n(self, delay_s: float) -> Floats:
        """Return the smoothed force delayed by ``delay_s``."""
        force_n = np.convolve(np.interp(self.grid_s - delay_s, self.sent_s, self.sent_n), self.bell, "valid")
        reach = len(self.bell) // 2
        return force_n[reach : len(force_n) - reach]


def _prepare_segment(samples: Any, axis: int, step_s: float) -> _Prepared:
    t_s, position_m = _new_positions(samples)
    grid_s = np.arange(t_s[0], t_s[-1], step_s)
    x_m = np.interp(grid_s, t_s, position_m[:, axis])
    kernels = _gaussians(step_s)
    bell = kernels.bell
    smooth, v_mps, a_mps2 = (np.convolve(x_m - x_m.mean(), k, "valid") for k in (bell, kernels.first, kernels.second))
    friction = np.convolve(np.tanh(v_mps / _SLOW_MPS), bell, "valid")
    reach = len(bell) // 2
    valid = slice(reach, len(smooth) - reach)  # points at which friction is smoothed like the other terms
    terms = np.column_stack([a_mps2[valid], v_mps[valid], friction, smooth[valid], np.ones_like(friction)])
    sent_s = (samples.time_ns - samples.time_ns[0]) * 1e-9
    # A force acts from its write to the next one, so the middle of its time is half a tick later.
    return _Prepared(
        terms=terms, sent_s=sent_s + 0.5 * step_s, sent_n=samples.device_force_n[:, axis], grid_s=grid_s, bell=bell
    )


def gain_of(sent_n: Sequence[float], shown_g: Sequence[float]) -> Gain:
    """Return the straight line through a scale's readings [g] over two or more sent forces [N]."""
    applied_n, shown_n = np.asarray(sent_n, float), np.asarray(shown_g, float) * 1e-3 * GRAVITY_MPS2
    design = np.column_stack([applied_n, np.ones_like(applied_n)])
    (slope, offset_n), *_ = np.linalg.lstsq(design, shown_n, rcond=None)
    residual_n = shown_n - design @ (slope, offset_n)
    return Gain(
        gain=float(slope), offset_n=float(offset_n), residual_n=float(np.abs(residual_n).max()), readings=len(applied_n)
    )


def _new_positions(samples: Any) -> tuple[Floats, Floats]:
    """Return times [s] and positions (n, 3) [m] of the new samples that the servo accepted."""
    new = samples[(samples.fresh == 1) & (samples.limiters & LIMITER_GLITCH == 0)]
    return (new.time_ns - samples.time_ns[0]) * 1e-9, np.array(new.position_m)


class _Kernels(NamedTuple):
    """A Gaussian and its first and second derivative, for convolution."""

    bell: Floats
    first: Floats
    second: Floats


def _gaussians(step_s: float) -> _Kernels:
    """Return kernels that are exact for 1, t and t²."""
    reach = math.ceil(_GAUSSIAN_REACH * _SIGMA_S / step_s)
    t_s: Floats = step_s * np.arange(-reach, reach + 1, dtype=float)
    bell = np.exp(-0.5 * (t_s / _SIGMA_S) ** 2)
    bell /= bell.sum()
    first = -t_s * bell
    first /= -(first * t_s).sum()
    second = (t_s**2 - (bell * t_s**2).sum()) * bell
    second -= second.mean()
    second /= 0.5 * (second * t_s**2).sum()
    return _Kernels(bell=bell, first=first, second=second)


def _vector_of(values: Floats) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z

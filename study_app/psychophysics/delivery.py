"""The levels delivered to the hand in an interval, computed from its samples; used by sessions and the analysis.

Velocity and acceleration of the hand are computed from its positions by a cubic Savitzky-Golay filter (Savitzky & Golay
1964, Analytical Chemistry 36, 1627) over ±20 ms, independent of the servo's own velocity estimator. Samples are first
interpolated to equally spaced times, so that late ticks do not distort the result.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.float64]
Vectors = NDArray[np.float64]

_HALF_S: Final = 0.02
"""Half width of the filter [s]."""
EARLIER: Final = 5
"""The largest number of rows by which the sent force may precede the force of the model."""
_LEAST_SPEED_MPS: Final = 1e-4
"""The lowest speed of a hand at which damping is computed. [choice]"""


@dataclass(frozen=True, slots=True)
class Motion:
    """A motion at equally spaced times.

    Attributes
    ----------
    times_s : array (n,)
        Time of each row [s].
    velocity_mps, acceleration_mps2 : array (n, 3)
        Of the hand [m/s, m/s²].
    """

    times_s: NDArray[np.float64]
    velocity_mps: Vectors
    acceleration_mps2: Vectors

    @property
    def rms_speed_mps(self) -> float:
        """Root mean square of the speed [m/s]; 0 without rows."""
        rows = max(len(self.times_s), 1)
        return float(np.sqrt(np.einsum("ij,ij->", self.velocity_mps, self.velocity_mps) / rows))

    def after(self, from_s: float, to_s: float = math.inf) -> Motion:
        """Return the rows of the motion between two times [s]."""
        between = (self.times_s >= from_s) & (self.times_s <= to_s)
        return Motion(self.times_s[between], self.velocity_mps[between], self.acceleration_mps2[between])


def motion(times_s: NDArray[np.float64], position_m: Vectors, period_s: float, half_s: float = _HALF_S) -> Motion:
    """Return velocity and acceleration of a hand.

    Parameters
    ----------
    times_s : array (n,)
        Times of the positions, ascending [s].
    position_m : array (n, 3)
        Positions [m].
    period_s : float
        Nominal time between two of them [s].
    half_s : float
        Half width of the filter [s].

    Returns
    -------
    Motion
        Without ``half_s`` at both ends; empty if the motion is not longer than the filter.
    """
    half = max(2, round(half_s / period_s))
    count = 0 if len(times_s) == 0 else int((times_s[-1] - times_s[0]) / period_s * (1 + 1e-12)) + 1
    if count <= 2 * half:
        return Motion(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
    even_s = times_s[0] + period_s * np.arange(count)
    rates = [
        [np.convolve(axis, taps, "valid") for axis in interpolate_vectors(even_s, times_s, position_m).T]
        for taps in _taps(half)
    ]
    return Motion(even_s[half:-half], np.array(rates[0]).T / period_s, np.array(rates[1]).T / period_s**2)


def interpolate_vectors(target_s: NDArray[np.float64], times_s: NDArray[np.float64], vectors: Vectors) -> Vectors:
    """Return vectors (n, 3) interpolated linearly at other times: (m, 3)."""
    return np.array([np.interp(target_s, times_s, axis) for axis in vectors.T]).T


def damping(force_n: Vectors, moved: Motion) -> tuple[float, float] | None:
    """Return damping b [N·s/m] and apparent mass m [kg] of F = −b v − m a, by least squares over the three axes.

    Parameters
    ----------
    force_n : array (n, 3)
        The force sent to the hand [N], at the times of the motion.
    moved : Motion
        The motion of the hand.

    Returns
    -------
    tuple of float, or None
        None if the hand was at rest, or moved at constant velocity.
    """
    v, a = moved.velocity_mps, moved.acceleration_mps2
    vv, va, aa = (float(np.einsum("ij,ij->", first, second)) for first, second in ((v, v), (v, a), (a, a)))
    fv, fa = (-float(np.einsum("ij,ij->", force_n, vectors)) for vectors in (v, a))
    determinant = vv * aa - va * va
    if moved.rms_speed_mps < _LEAST_SPEED_MPS or determinant <= 1e-9 * vv * aa:
        return None
    return (fv * aa - fa * va) / determinant, (fa * vv - fv * va) / determinant


def sent_share(sent_n: Vectors, model_n: Vectors) -> float | None:
    """Return the proportion of the model force that was sent, Σ F_sent·F_model / Σ |F_model|²; None without force.

    Parameters
    ----------
    sent_n, model_n : array (n, 3)
        The force sent to the hand, and the sum of the effects before any limit [N].
    """
    model_square = float(np.einsum("ij,ij->", model_n, model_n))
    return float(np.einsum("ij,ij->", sent_n, model_n)) / model_square if model_square > 0 else None


def lag(sent_n: Vectors, model_n: Vectors, most: int) -> float | None:
    """Return the lag of the sent force behind the model force [rows], by least squares; None without force.

    For each lag in whole rows, F_sent = g F_model is fitted with the best gain g; a parabola through the smallest
    residual and its neighbours gives the fraction of a row.

    Parameters
    ----------
    sent_n, model_n : array (n, 3)
        The force sent to the hand, and the sum of the effects before any limit [N], at even times.
    most : int
        The longest lag searched; the sent force is compared from this row on.
    """
    compared = sent_n[most : len(sent_n) - EARLIER]
    if len(compared) == 0:
        return None
    products = sum(np.correlate(model_n[:, axis], compared[:, axis], "valid") for axis in range(3))
    squares = np.concatenate([[0.0], np.cumsum(np.einsum("ij,ij->i", model_n, model_n))])
    model_squares = squares[len(compared) :] - squares[: len(squares) - len(compared)]
    explained = np.where(
        (model_squares > 0) & (products > 0), products**2 / np.where(model_squares > 0, model_squares, 1.0), 0.0
    )
    best = int(np.argmax(explained))
    if explained[best] == 0.0:
        return None
    fraction = 0.0
    if 0 < best < len(explained) - 1:
        before, middle, after = explained[best - 1 : best + 2]
        curvature = before - 2 * middle + after
        fraction = 0.0 if curvature >= 0 else 0.5 * float(before - after) / float(curvature)
    return most - (best + fraction)


def difference(errors: Sequence[float | None], comparisons: Sequence[bool]) -> float | None:
    """Return the mean error of the comparisons minus that of the standards, in which common errors cancel.

    Parameters
    ----------
    errors : sequence of float or None
        The error of each interval, delivered minus requested; None if it was not measured.
    comparisons : sequence of bool
        Whether the interval presented the comparison.

    Returns
    -------
    float or None
        None unless both were presented and measured.
    """
    pairs = list(zip(errors, comparisons, strict=True))
    comparison_mean = _mean(error for error, compared in pairs if compared)
    standard_mean = _mean(error for error, compared in pairs if not compared)
    return None if comparison_mean is None or standard_mean is None else comparison_mean - standard_mean


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


@cache
def _taps(half: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the kernels over 2 half + 1 positions for slope and curvature of the fitted cubic, per sample."""
    places = np.arange(-half, half + 1) / half
    powers = np.linalg.pinv(np.vander(places, 4, increasing=True))
    return powers[1][::-1] / half, 2 * powers[2][::-1] / half**2

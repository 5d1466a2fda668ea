"""What is measured on the trace of a closed loop, compiled."""

import math
from typing import Any

import numpy as np

from study_app.haptics.kernels.compiled import kernel


@kernel
def lowest_balance(trace: Any) -> tuple[float, float, float]:
    """Return the lowest balance of hand and liquid [J], the strongest force [N] and the longest step [m].

    From tick to tick the hand does the work -f·Δp on the liquid, with the force that acts on the handle, buoyancy and
    weight aside, over its true step in the frame of the current. The balance begins at 0 and never exceeds what the
    liquid could give back.
    """
    balance_j = lowest_j = strongest_n = longest_m = 0.0
    for k in range(1, trace.shape[0]):
        work_j = squares_n2 = squares_m2 = 0.0
        before = trace[k - 1]
        for axis in range(3):
            sent = k - 1 - before.delay
            lift_n = trace[sent].lift_n[axis] if sent >= 0 else 0.0
            force_n = before.acting_n[axis] - lift_n
            step_m = trace[k].position_m[axis] - before.position_m[axis]
            step_m -= trace[k].drift_mps[axis] * (trace[k].t_s - before.t_s)
            work_j -= force_n * step_m
            squares_n2 += force_n * force_n
            squares_m2 += step_m * step_m
        balance_j = min(balance_j + work_j, trace[k].reserve_j)
        lowest_j = min(lowest_j, balance_j)
        strongest_n = max(strongest_n, math.sqrt(squares_n2))
        longest_m = max(longest_m, math.sqrt(squares_m2))
    return lowest_j, strongest_n, longest_m


@kernel
def given_out_j(trace: Any) -> float:
    """Return the most that the force that acts gave to the handle, beyond what it took from it before [J]."""
    energy_j = most_j = 0.0
    for k in range(1, trace.shape[0]):
        for axis in range(3):
            energy_j += trace[k - 1].acting_n[axis] * (trace[k].position_m[axis] - trace[k - 1].position_m[axis])
        most_j = max(most_j, energy_j)
    return most_j


@kernel
def smooth(trace: Any, spread_s: float, out_m: Any, out_n: Any) -> None:
    """Write motion and force without what is fast into ``out_m``, ``out_n`` (rows, 3): a Gaussian mean over time."""
    rows = trace.shape[0]
    first = 0
    for k in range(rows):
        while trace[k].t_s - trace[first].t_s > 3.5 * spread_s:
            first += 1
        total = 0.0
        out_m[k] = 0.0
        out_n[k] = 0.0
        j = first
        while j < rows and trace[j].t_s - trace[k].t_s <= 3.5 * spread_s:
            distance = (trace[j].t_s - trace[k].t_s) / spread_s
            weight = math.exp(-0.5 * distance * distance)
            total += weight
            for axis in range(3):
                out_m[k, axis] += weight * trace[j].position_m[axis]
                out_n[k, axis] += weight * trace[j].sent_n[axis]
            j += 1
        for axis in range(3):
            out_m[k, axis] /= total
            out_n[k, axis] /= total


def fast_part(vectors: Any, rate_hz: float, corner_hz: float, first: int, last: int, aside_s: float = 0.0) -> float:
    """Return the mean square root of vectors (rows, 3) above a frequency, over the rows from ``first`` to ``last``.

    The strongest ``aside_s`` of it are left aside.
    """
    squares = np.zeros(max(last - first, 1))
    _fast_squares(vectors, rate_hz, corner_hz, first, squares)
    aside = min(int(aside_s * rate_hz), len(squares) - 1)
    sums = np.concatenate([[0.0], np.cumsum(squares)])
    strongest = (sums[aside:] - sums[: len(sums) - aside]).max()
    return math.sqrt(max(sums[-1] - strongest, 0.0) / (len(squares) - aside))


@kernel
def _fast_squares(vectors: Any, rate_hz: float, corner_hz: float, first: int, out: Any) -> None:
    """Add the squares of what is above the corner to ``out``, from row ``first`` on.

    Butterworth of second order by the bilinear transform, begun at rest a while before.
    """
    w = math.tan(math.pi * corner_hz / rate_hz)
    gain = 1.0 / (1.0 + math.sqrt(2.0) * w + w * w)
    a1, a2 = 2.0 * (w * w - 1.0) * gain, (1.0 - math.sqrt(2.0) * w + w * w) * gain
    begin = max(0, first - int(0.05 * rate_hz))
    for axis in range(3):
        x1 = x2 = vectors[begin, axis]
        y1 = y2 = 0.0
        for k in range(begin, first + out.shape[0]):
            x = vectors[k, axis]
            y = gain * (x - 2.0 * x1 + x2) - a1 * y1 - a2 * y2
            x2, x1, y2, y1 = x1, x, y1, y
            if k >= first:
                out[k - first] += y * y

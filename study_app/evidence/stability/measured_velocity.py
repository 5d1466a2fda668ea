"""The velocity that a device measures itself, compiled: the handle's, filtered with a lag, with noise and counts."""

import math
from typing import Any, Final

import numpy as np

from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.tick_schedule import random
from study_app.haptics.kernels.vector import copy

NONE, AVERAGE, FIRST_ORDER, LATE = range(4)
"""Filters, as `stability_cases.FILTERS` names them; NONE: the device measures no velocity."""
_KEPT: Final = 16  # ticks: the longest mean is of 16

MEASURED = np.dtype(
    [
        ("filter", np.int64),
        ("lag", np.float64),  # mean [ticks]
        ("noise_mps", np.float64),  # from peak to peak
        ("count_mps", np.float64),  # the velocity is a whole number of them; 0: any
        ("ticks", np.int64),  # how many velocities it has taken in
        ("kept_mps", np.float64, (_KEPT, 3)),  # the last of them
        ("slow_mps", np.float64, (3,)),  # of the filter of first order
        ("seen_mps", np.float64, (3,)),  # as it is measured
    ],
    align=True,
)


@kernel
def measure_velocity(measured: Any, velocity_mps: Any, shown: int, pace: Any) -> None:
    """Take the handle's velocity of this tick in; where it is ``shown``, write what is measured into ``seen_mps``."""
    if measured.ticks == 0:  # it has always been that
        copy(velocity_mps, measured.slow_mps)
        for row in range(_KEPT):
            copy(velocity_mps, measured.kept_mps[row])
    copy(velocity_mps, measured.kept_mps[measured.ticks % _KEPT])
    for axis in range(3):
        if measured.filter == AVERAGE:
            value = _mean(measured, 0, round(2.0 * measured.lag), axis)
        elif measured.filter == FIRST_ORDER:
            measured.slow_mps[axis] += (velocity_mps[axis] - measured.slow_mps[axis]) / (1.0 + measured.lag)
            value = measured.slow_mps[axis]
        else:
            value = _mean(measured, math.floor(measured.lag), math.ceil(measured.lag), axis)
        if measured.noise_mps > 0.0:
            value += measured.noise_mps * (random(pace) - 0.5)
        if measured.count_mps > 0.0:
            value = math.floor(value / measured.count_mps + 0.5) * measured.count_mps
        if shown:
            measured.seen_mps[axis] = value
    measured.ticks += 1


@kernel
def _mean(measured: Any, newest: int, oldest: int, axis: int) -> float:
    """Return the mean of the velocities of so many ticks ago, before this tick is counted."""
    total = 0.0
    for back in range(newest, oldest + 1):
        total += measured.kept_mps[(measured.ticks - back) % _KEPT, axis]
    return float(total / (oldest - newest + 1))

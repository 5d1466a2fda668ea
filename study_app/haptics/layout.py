"""The memory that Python and compiled code share: shapes, units and meaning of every field, said here once.

Records are rows of ``np.recarray``: compiled they are plain structs, uncompiled (``NUMBA_DISABLE_JIT=1``) they still
have attributes. Positions and forces are float64; unless a name says otherwise, m, m/s, N, s.
"""

from __future__ import annotations

from typing import Any

import numpy as np

# Limiters that acted in a tick, as bits of Sample.limiters.
LIMITER_SLOPE = 1 << 0
LIMITER_NON_FINITE = 1 << 1
LIMITER_ENERGY = 1 << 2
LIMITER_NORM = 1 << 3
LIMITER_SLEW = 1 << 4
LIMITER_FADE = 1 << 5
LIMITER_STALE = 1 << 6
LIMITER_GLITCH = 1 << 7
LIMITER_STOP = 1 << 8

LIMITER_NAMES = ("slope", "non_finite", "energy", "norm", "slew", "fade", "stale", "glitch", "stop")

# Status of the servo, in Sample.status; the owner turns a fault into ServoFault.
STATUS_OK = 0
STATUS_STALE_FAULT = 1
STATUS_DEVICE_LOST = 2
STATUS_NON_FINITE = 3

SAMPLE = np.dtype(
    [
        ("tick", np.int64),  # counts turns of the servo since it started
        ("time_ns", np.int64),  # when the device was read, on the servo's monotonic clock
        ("lateness_ns", np.int64),  # how late the turn began after its deadline
        ("busy_ns", np.int64),  # how long the turn took, from reading to writing
        ("scene", np.int64),  # serial number of the scene in force; 0 is rest (no liquid, no force)
        ("position_m", np.float64, (3,)),  # device, hand frame
        ("velocity_mps", np.float64, (3,)),  # scene frame, after estimator and knee
        ("wake_mps", np.float64, (3,)),  # scene frame, as used by this tick's drag
        ("force_n", np.float64, (3,)),  # sum of the effects on the body, before slope limit and safety
        ("device_force_n", np.float64, (3,)),  # as sent, on the hand
        ("buttons", np.int64),  # bit set: button 1 is bit 0
        ("limiters", np.int64),  # LIMITER_* bits that acted
        ("fresh", np.int64),  # 1 where the device reported a new sample
        ("status", np.int64),  # STATUS_*
    ],
    align=True,
)

READING = np.dtype(
    [
        ("position_m", np.float64, (3,)),  # hand frame, after the driver's mapping
        ("buttons", np.int64),
    ],
    align=True,
)


def records(dtype: np.dtype[Any], count: int) -> Any:
    """Return ``count`` zeroed records of ``dtype`` as a contiguous ``np.recarray`` of shape (count,)."""
    return np.zeros(count, dtype).view(np.recarray)

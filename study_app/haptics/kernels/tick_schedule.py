"""The times of a simulated servo's ticks: with jitter and missed ticks, as on a busy computer."""

from __future__ import annotations

from typing import Any

import numpy as np

from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.layout import records

PACE = np.dtype(
    [
        ("period_s", np.float64),
        ("jitter_s", np.float64),  # greatest lateness of a tick
        ("missed", np.float64),  # share of missed ticks
        ("late_s", np.float64),  # lateness of the last tick
        ("random", np.uint64),
    ],
    align=True,
)


def new_schedule(period_s: float, *, jitter_s: float = 0.0, missed: float = 0.0, seed: int = 1) -> Any:
    """Return the record of a servo's schedule; ``jitter_s`` must be below the period, ``missed`` below 1."""
    pace = records(PACE, 1)
    pace.period_s = period_s
    pace.jitter_s = jitter_s
    pace.missed = missed
    pace.random = 0x9E3779B97F4A7C15 ^ seed
    return pace[0]


@kernel
def next_tick(pace: Any) -> float:
    """Return the time until the servo's next tick [s]: deadlines are regular, ticks are late or missed."""
    ticks = 1.0
    while pace.missed > 0.0 and random(pace) < pace.missed:
        ticks += 1.0
    before_s = pace.late_s
    pace.late_s = pace.jitter_s * random(pace)
    elapsed_s: float = ticks * pace.period_s + pace.late_s - before_s
    return elapsed_s


@kernel
def random(pace: Any) -> float:
    """Return the next number of a uniform sequence in [0, 1) (xorshift64, Marsaglia 2003)."""
    x = pace.random
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    pace.random = x
    return float(x >> np.uint64(11)) * 2.0**-53

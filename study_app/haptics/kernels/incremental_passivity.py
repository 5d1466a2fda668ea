"""The incremental passivity observer: whether the fast part of a force drives the fast part of the hand's motion.

A loop may oscillate during a slow motion without an energy debt: the slow motion supplies more energy than the
oscillation takes. So the fast part has a balance of its own. Force and velocity pass the same two high-pass filters of
20 Hz, above the frequencies of a hand and below those of an oscillating loop. The filtered signals give the work -f·v
Δt of the hand from one sample to the next::

    B ← min(B - f·v Δt, 0)

The force is taken one tick later than the assumed loop delay, as in the last balance of `passivity`: the observer stays
correct if the delay is one tick longer than assumed. A breaking wake and a reversal of the hand take some mJ, once: B
may fall to -2 mJ, and recovers at 5 mW. Beyond that `passivity.reduce_gain` lowers the gain.
"""

from __future__ import annotations

import math

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.vector import clear
from study_app.haptics.model.layout import Record

CORNER_RADPS = 2.0 * math.pi * 20.0
ALLOWANCE_J = 2e-3
FORGIVEN_W = 5e-3


@part
def begin_incremental(fast: Record) -> None:
    """Reset the balance to 0, at rest and without force."""
    for axis in range(3):
        fast.force_n[axis] = fast.force_once_n[axis] = fast.force_twice_n[axis] = 0.0
    clear(fast.velocity_mps)
    clear(fast.velocity_once_mps)
    clear(fast.velocity_twice_mps)
    fast.balance_j = 0.0


@part
def observe_incremental(fast: Record, axis: int, force_n: float, velocity_mps: float, interval_s: float) -> None:
    """Add the work along one axis, from the mean force and velocity since the last sample."""
    x = CORNER_RADPS * interval_s
    kept = 1.0 / (1.0 + x * (1.0 + 0.5 * x))
    once_n = kept * (fast.force_once_n[axis] + force_n - fast.force_n[axis])
    twice_n = kept * (fast.force_twice_n[axis] + once_n - fast.force_once_n[axis])
    once_mps = kept * (fast.velocity_once_mps[axis] + velocity_mps - fast.velocity_mps[axis])
    twice_mps = kept * (fast.velocity_twice_mps[axis] + once_mps - fast.velocity_once_mps[axis])
    fast.force_n[axis], fast.force_once_n[axis], fast.force_twice_n[axis] = force_n, once_n, twice_n
    fast.velocity_mps[axis], fast.velocity_once_mps[axis], fast.velocity_twice_mps[axis] = (
        velocity_mps,
        once_mps,
        twice_mps,
    )
    fast.balance_j -= twice_n * twice_mps * interval_s


@part
def close_incremental(fast: Record, interval_s: float) -> None:
    """Forgive a part of the debt; the balance is at most 0."""
    fast.balance_j = min(fast.balance_j + FORGIVEN_W * interval_s, 0.0)

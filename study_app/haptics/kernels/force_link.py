"""The force link: it delays, jitters or drops the force of the effects, as a study specifies.

It lies between the slope limits and the rest of the safety layer, which acts on the force actually sent: the passivity
observer uses the work of the delayed force, and a stop is not delayed. Jitter and loss are a hash of the link's seed
and the tick, so that a recording is recomputed exactly.

The passivity observer excludes buoyancy and weight because they are conservative; it uses those of the present tick,
since they are conservative only at the present place of the hand. The difference of a delayed buoyancy from the present
one counts like any other force.
"""

from __future__ import annotations

from typing import Any

from study_app.haptics.kernels.compiled import kernel, part
from study_app.haptics.kernels.vector import copy
from study_app.haptics.model.layout import Record

_MASK = 0xFFFFFFFF
_FACTOR = 0x45D9F3B
_PER_STEP = 2.0**-32


@kernel
def delay_force(link: Record, state: Record, forces_n: Any, force_n: Any) -> bool:
    """Replace ``force_n`` (3,) [N] by the force that arrives in this tick; return whether one has arrived so far.

    The force of tick n is due at n + delay + jitter; a force older than the last one sent is skipped. If a force is
    lost, the last one is held. Before the first one arrives the force is 0. ``forces_n`` (n, 3) stores the newest
    forces.
    """
    tick = state.ticks
    copy(force_n, forces_n[tick % forces_n.shape[0]])
    state.ticks = tick + 1
    if uniform(link.seed, 2 * tick) >= link.loss:
        jitter_ticks = int(uniform(link.seed, 2 * tick + 1) * (link.jitter_ticks + 1))
        arrived = tick - link.delay_ticks - jitter_ticks + 1
        if arrived > state.arrived:
            state.arrived = arrived
            copy(forces_n[(arrived - 1) % forces_n.shape[0]], state.force_n)
    copy(state.force_n, force_n)
    return bool(state.arrived > 0)


@part
def uniform(seed: int, number: int) -> float:
    """Return a number in [0, 1) determined by a seed and a number; both are taken modulo 2³²."""
    return _mixed(_mixed(number & _MASK) ^ (seed & _MASK)) * _PER_STEP


@part
def _mixed(value: int) -> int:
    """Return 32 bits as a hash of 32 bits (multiply and shift, the finaliser of MurmurHash)."""
    for _ in range(2):
        value = ((value >> 16) ^ value) * _FACTOR & _MASK
    return (value >> 16) ^ value

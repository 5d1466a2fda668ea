"""The force link: the force of the effects is sent late, unevenly, or not at all, as a study asks.

It stands between the slope limits and the rest of the safety layer, which acts on the force that is really sent: the
passivity observer enters the work of the delayed force, and a stop needs no buffer. Jitter and loss are a hash of the
link's seed and the tick, so that a recording is recomputed exactly.

Buoyancy and weight, which the passivity observer leaves out because they only lend energy, are those of the present
tick: they return what they were lent only where they belong to the place of the hand. What a delayed buoyancy differs
from that counts like any other force.
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
    """Put the force that arrives in this tick in the place of ``force_n`` (3,) [N]; return whether one has arrived yet.

    The force of tick n is due at n + delay + jitter; one that is older than the force sent before is passed over. Where
    a force is lost, the last one is held. Until the first one arrives there is none. ``forces_n`` (n, 3) keeps the
    newest forces.
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
    """Return a number in [0, 1) that a seed and a number determine; both count modulo 2³²."""
    return _mixed(_mixed(number & _MASK) ^ (seed & _MASK)) * _PER_STEP


@part
def _mixed(value: int) -> int:
    """Return 32 bits as a hash of 32 bits (multiply and shift, the finaliser of MurmurHash)."""
    for _ in range(2):
        value = ((value >> 16) ^ value) * _FACTOR & _MASK
    return (value >> 16) ^ value

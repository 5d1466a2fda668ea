"""The one handle model: a mass with friction, end stops and an encoder, drawn along by a hand.

::

    m dv/dt = F + K (r - x) + B (dr/dt - v) - b v - f_c v/|v|

F is the force of the servo, held between its writes; r is where the hand wants the handle, K and B how stiffly and how
well damped it insists; b and f_c are the device's viscous and Coulomb friction. Mouse, scripted hand and every emulated
device are this model with other numbers.

It is integrated in sub-steps of at most 50 us, each implicit in every force but F: with dv/dt and dx/dt = v taken at
the end of the step the velocity follows from one division, and Coulomb friction, the proximal step of |v|, shortens it
by at most its whole length. So no stiffness, damping or friction can make it unstable, and a handle at rest under less
than f_c stays exactly at rest.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from study_app.haptics.compiled import kernel
from study_app.haptics.layout import records

HANDLE = np.dtype(
    [
        ("mass_kg", np.float64),
        ("viscous_nspm", np.float64),  # b, of the device [N s/m]
        ("coulomb_n", np.float64),  # f_c, of the device
        ("stiffness_npm", np.float64),  # K, of the hand [N/m]
        ("damping_nspm", np.float64),  # B, of the hand [N s/m]
        ("quantum_m", np.float64),  # one encoder count; 0: none
        ("stop_m", np.float64, (3,)),  # half extents of the end stops
        ("position_m", np.float64, (3,)),
        ("velocity_mps", np.float64, (3,)),
        ("force_n", np.float64, (3,)),  # F, as last written by the servo
    ],
    align=True,
)

SUB_STEP_S = 50e-6


def new_handle(
    *,
    mass_kg: float,
    viscous_nspm: float = 0.0,
    coulomb_n: float = 0.0,
    stiffness_npm: float = 0.0,
    damping_nspm: float = 0.0,
    quantum_m: float = 0.0,
    stop_m: tuple[float, float, float] = (math.inf, math.inf, math.inf),
) -> Any:
    """Return the record of a handle at rest in the middle of its workspace."""
    handle = records(HANDLE, 1)
    handle.mass_kg = mass_kg
    handle.viscous_nspm = viscous_nspm
    handle.coulomb_n = coulomb_n
    handle.stiffness_npm = stiffness_npm
    handle.damping_nspm = damping_nspm
    handle.quantum_m = quantum_m
    handle.stop_m = stop_m
    return handle[0]


@kernel
def move(handle: Any, from_m: Any, to_m: Any, duration_s: float) -> None:
    """Let ``duration_s`` pass while the hand goes straight ``from_m`` to ``to_m`` (each (3,) [m])."""
    if duration_s <= 0.0:
        return
    steps = math.ceil(duration_s / SUB_STEP_S)
    step = duration_s / steps
    for k in range(steps):
        _sub_step(handle, from_m, to_m, duration_s, (k + 1.0) / steps, step)


@kernel
def _sub_step(handle: Any, from_m: Any, to_m: Any, duration_s: float, share: float, step: float) -> None:
    impedance = handle.mass_kg + step * (handle.viscous_nspm + handle.damping_nspm) + step * step * handle.stiffness_npm
    square = 0.0
    for i in range(3):
        hand_velocity = (to_m[i] - from_m[i]) / duration_s
        hand = from_m[i] + (to_m[i] - from_m[i]) * share
        pull = handle.stiffness_npm * (hand - handle.position_m[i]) + handle.damping_nspm * hand_velocity
        momentum = handle.mass_kg * handle.velocity_mps[i] + step * (handle.force_n[i] + pull)
        handle.velocity_mps[i] = momentum / impedance
        square += handle.velocity_mps[i] * handle.velocity_mps[i]
    speed = math.sqrt(square)
    lost = step * handle.coulomb_n / impedance
    kept = 0.0 if speed <= lost else 1.0 - lost / speed
    for i in range(3):
        handle.velocity_mps[i] *= kept
        handle.position_m[i] += step * handle.velocity_mps[i]
        if abs(handle.position_m[i]) > handle.stop_m[i]:
            handle.position_m[i] = math.copysign(handle.stop_m[i], handle.position_m[i])
            handle.velocity_mps[i] = 0.0


@kernel
def measure(handle: Any, position_m: Any) -> None:
    """Write into ``position_m`` (3,) [m] what the encoders say: the nearest whole count."""
    for i in range(3):
        position_m[i] = handle.position_m[i]
        if handle.quantum_m > 0.0:
            position_m[i] = math.floor(handle.position_m[i] / handle.quantum_m + 0.5) * handle.quantum_m

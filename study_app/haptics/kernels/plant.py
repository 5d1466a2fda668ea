"""The handle model: a mass with friction, end stops, encoder and delayed, quantised motors, moved by a hand.

::

    (m + m_hand) dv/dt = F + K (r - x) + B (dr/dt - v) - b v - f_c v/|v|

F is the force of the servo, held between its writes, after the device's own delay, limit and steps (`push`); r is the
hand's target position, K and B its stiffness and damping, m_hand its moving mass; b and f_c are the device's viscous
and Coulomb friction. A released handle has no hand terms. Mouse, scripted hand, the cases of ``validation.stability``
and every emulated device are this model with other parameters.

It is integrated in sub-steps of at most 50 us, each implicit in every force except F: with dv/dt and dx/dt = v taken at
the end of the step the velocity follows from one division, and Coulomb friction, the proximal step of |v|, shortens it
to 0 at most. So no stiffness, damping or friction can make it unstable, and a handle at rest under less than f_c stays
exactly at rest.

`new_schedule` gives the times of a simulated servo's ticks: with jitter and missed ticks, as on a busy computer.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.device_dynamics import MOST_DELAY
from study_app.haptics.model.layout import records

_PACE = np.dtype(
    [
        ("period_s", np.float64),
        ("jitter_s", np.float64),  # greatest lateness of a tick
        ("missed", np.float64),  # fraction of missed ticks
        ("late_s", np.float64),  # lateness of the last tick
        ("random", np.uint64),
    ],
    align=True,
)


def new_schedule(period_s: float, *, jitter_s: float = 0.0, missed: float = 0.0, seed: int = 1) -> Any:
    """Return the record of a servo's schedule; ``jitter_s`` must be below the period, ``missed`` below 1."""
    pace = records(_PACE, 1)
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


HANDLE = np.dtype(
    [
        ("mass_kg", np.float64),  # m, of the device
        ("held", np.int64),  # 1 in a hand, 0 released
        ("hand_kg", np.float64),  # m_hand
        ("viscous_nspm", np.float64),  # b, of the device [N s/m]
        ("coulomb_n", np.float64),  # f_c, of the device
        ("stiffness_npm", np.float64),  # K, of the hand [N/m]
        ("damping_nspm", np.float64),  # B, of the hand [N s/m]
        ("quantum_m", np.float64),  # one encoder count; 0: none
        ("motor_limit_n", np.float64),  # greatest force per axis
        ("motor_step_n", np.float64),  # resolution of the force; 0: continuous
        ("delay", np.int64),  # writes until a force acts, at most MOST_DELAY
        ("written", np.int64),  # number of writes
        ("waiting_n", np.float64, (MOST_DELAY + 1, 3)),  # the last forces written
        ("stop_m", np.float64, (3,)),  # half extents of the end stops
        ("position_m", np.float64, (3,)),
        ("velocity_mps", np.float64, (3,)),
        ("force_n", np.float64, (3,)),  # F that acts now
    ],
    align=True,
)

_SUB_STEP_S = 50e-6


def new_handle(
    *,
    mass_kg: float,
    viscous_nspm: float = 0.0,
    coulomb_n: float = 0.0,
    stiffness_npm: float = 0.0,
    damping_nspm: float = 0.0,
    quantum_m: float = 0.0,
    hand_kg: float = 0.0,
    motor_limit_n: float = math.inf,
    motor_step_n: float = 0.0,
    delay: int = 0,
    stop_m: tuple[float, float, float] = (math.inf, math.inf, math.inf),
) -> Any:
    """Return the record of a handle that is held, at rest in the middle of its workspace."""
    if not 0 <= delay <= MOST_DELAY:
        raise StudyError(f"a handle's delay must be from 0 to {MOST_DELAY} ticks, not {delay}")
    handle = records(HANDLE, 1)
    handle.held = 1
    handle.hand_kg = hand_kg
    handle.motor_limit_n = motor_limit_n
    handle.motor_step_n = motor_step_n
    handle.delay = delay
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
    """Integrate over ``duration_s`` while the hand moves straight from ``from_m`` to ``to_m`` (each (3,) [m])."""
    if duration_s <= 0.0:
        return
    steps = math.ceil(duration_s / _SUB_STEP_S)
    step = duration_s / steps
    for k in range(steps):
        _sub_step(handle, from_m, to_m, duration_s, (k + 1.0) / steps, step)


@kernel
def _sub_step(handle: Any, from_m: Any, to_m: Any, duration_s: float, share: float, step: float) -> None:
    mass, stiffness, damping = handle.mass_kg, 0.0, 0.0
    if handle.held:
        mass += handle.hand_kg
        stiffness, damping = handle.stiffness_npm, handle.damping_nspm
    impedance = mass + step * (handle.viscous_nspm + damping) + step * step * stiffness
    square = 0.0
    for i in range(3):
        hand_velocity = (to_m[i] - from_m[i]) / duration_s
        hand = from_m[i] + (to_m[i] - from_m[i]) * share
        pull = stiffness * (hand - handle.position_m[i]) + damping * hand_velocity
        momentum = mass * handle.velocity_mps[i] + step * (handle.force_n[i] + pull)
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
def push(handle: Any, x_n: float, y_n: float, z_n: float) -> None:
    """Store the force that the servo writes [N]; the one written ``delay`` writes ago acts from now on."""
    row = handle.written % (MOST_DELAY + 1)
    handle.waiting_n[row, 0] = _given(handle, x_n)
    handle.waiting_n[row, 1] = _given(handle, y_n)
    handle.waiting_n[row, 2] = _given(handle, z_n)
    due = (handle.written - handle.delay) % (MOST_DELAY + 1)
    for i in range(3):
        handle.force_n[i] = handle.waiting_n[due, i]
    handle.written += 1


@kernel
def _given(handle: Any, force_n: float) -> float:
    """Return the force that a motor exerts: within its limit, in whole steps."""
    given_n: float = min(max(force_n, -handle.motor_limit_n), handle.motor_limit_n)
    if handle.motor_step_n > 0.0:
        given_n = math.floor(given_n / handle.motor_step_n + 0.5) * handle.motor_step_n
    return given_n


@kernel
def release_handle(handle: Any) -> None:
    """Set the force to zero, including forces not yet acting."""
    for i in range(3):
        handle.force_n[i] = 0.0
        for row in range(MOST_DELAY + 1):
            handle.waiting_n[row, i] = 0.0


@kernel
def measure(handle: Any, position_m: Any) -> None:
    """Write the encoder readings into ``position_m`` (3,) [m]: the nearest whole count."""
    for i in range(3):
        position_m[i] = handle.position_m[i]
        if handle.quantum_m > 0.0:
            position_m[i] = math.floor(handle.position_m[i] / handle.quantum_m + 0.5) * handle.quantum_m

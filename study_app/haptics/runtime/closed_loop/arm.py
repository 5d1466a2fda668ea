"""A second plant of handle and hand: an arm that holds the handle through the tissue of its fingers.

::

    m_a dv_a/dt = K_a (r - x_a) + B_a (dr/dt - v_a) - f_t
    m_h dv_h/dt = F + f_t - b v_h - f_c v_h / sqrt(|v_h|² + v_s²),    f_t = K_t (x_a - x_h) + B_t (v_a - v_h)

x_a is the arm, which the muscles K_a, B_a pull along the intended path r; x_h the handle; f_t the force through the
tissue, 0 once the handle is let go; b and f_c the friction of the device, smoothed below v_s = 1 mm/s. The form is the
five-parameter model of Speich, Shao & Goldfarb (2005, Mechatronics 15:1127), which adds a spring and a damper for the
grip to the arm's mass, spring and damper. The arm is that of van Beek et al. (2015, Sci. Rep. 5:18004) or a heavier
one; stiffness and damping of the grip rise with its force (Hasser & Cutkosky 2002) and lie in the range of 50 to
1000 N/m and 2 to 30 N·s/m that is known of hands. [choice] It shares no code with the first plant,
``haptics.kernels.plant``: implicit midpoint rule (which conserves the energy of springs) in steps of at most 25 µs
instead of backward Euler in steps of 50 µs, smooth friction instead of a proximal step, and its own queue of forces.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.device_dynamics import MOST_DELAY
from study_app.haptics.model.layout import records

ARM = np.dtype(
    [
        ("used", np.int64),  # 1 where this plant moves the handle
        ("held", np.int64),  # 0: let go
        ("arm_kg", np.float64),
        ("arm_npm", np.float64),  # K_a
        ("arm_nspm", np.float64),  # B_a
        ("tissue_npm", np.float64),  # K_t
        ("tissue_nspm", np.float64),  # B_t
        ("handle_kg", np.float64),
        ("viscous_nspm", np.float64),  # b
        ("coulomb_n", np.float64),  # f_c
        ("motor_limit_n", np.float64),  # per axis
        ("motor_step_n", np.float64),  # per axis; 0: any force
        ("delay", np.int64),  # delay of a force in writes
        ("queue_n", np.float64, (MOST_DELAY + 1, 3)),  # forces written, newest first
        ("force_n", np.float64, (3,)),  # F, the force that acts
        ("arm_m", np.float64, (3,)),
        ("arm_mps", np.float64, (3,)),
        ("handle_m", np.float64, (3,)),
        ("handle_mps", np.float64, (3,)),
    ],
    align=True,
)

_LONGEST_STEP_S: Final = 25e-6
_SMOOTH_MPS: Final = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Arm:
    """Mass [kg], stiffness [N/m] and damping [N·s/m] of an arm, and of the tissue between arm and handle."""

    mass_kg: float
    stiffness_npm: float
    damping_nspm: float
    tissue_npm: float
    tissue_nspm: float


ARMS: Final[Mapping[str, Arm]] = {
    "light": Arm(mass_kg=0.554, stiffness_npm=135.0, damping_nspm=6.45, tissue_npm=100.0, tissue_nspm=2.0),
    "middle": Arm(mass_kg=0.554, stiffness_npm=135.0, damping_nspm=6.45, tissue_npm=400.0, tissue_nspm=5.0),
    "firm": Arm(mass_kg=1.5, stiffness_npm=500.0, damping_nspm=25.0, tissue_npm=1000.0, tissue_nspm=15.0),
}


def new_arm(arm: Arm, handle: Mapping[str, Any]) -> Any:
    """Return the record of an arm that holds a handle, both at rest in the centre of the workspace.

    ``handle`` has the handle's mass, friction, motors and delay, as for `new_handle`.
    """
    record = records(ARM, 1)[0]
    record.used = record.held = 1
    record.arm_kg, record.arm_npm, record.arm_nspm = arm.mass_kg, arm.stiffness_npm, arm.damping_nspm
    record.tissue_npm, record.tissue_nspm, record.handle_kg = arm.tissue_npm, arm.tissue_nspm, handle["mass_kg"]
    for name in ("viscous_nspm", "coulomb_n", "motor_limit_n", "motor_step_n", "delay"):
        record[name] = handle[name]
    return record


@kernel
def advance(arm: Any, from_m: Any, to_m: Any, duration_s: float) -> None:
    """Advance by ``duration_s`` while the intended position moves from ``from_m`` to ``to_m`` (each (3,) [m])."""
    if duration_s <= 0.0:
        return
    steps = math.ceil(duration_s / _LONGEST_STEP_S)
    for k in range(steps):
        _midpoint_step(arm, from_m, to_m, duration_s, (k + 0.5) / steps, duration_s / steps)


@kernel
def _midpoint_step(arm: Any, from_m: Any, to_m: Any, duration_s: float, share: float, step_s: float) -> None:
    """Solve both equations per axis for the mean velocities s_a, s_h of the step: x ← x + h s, v ← 2 s - v."""
    tissue_npm = tissue_nspm = speed_mps2 = 0.0
    if arm.held:
        tissue_npm, tissue_nspm = arm.tissue_npm, arm.tissue_nspm
    for i in range(3):
        speed_mps2 += arm.handle_mps[i] * arm.handle_mps[i]
    friction_nspm = arm.viscous_nspm + arm.coulomb_n / math.sqrt(speed_mps2 + _SMOOTH_MPS * _SMOOTH_MPS)
    half_s = 0.5 * step_s
    coupling = tissue_nspm + half_s * tissue_npm
    arm_impedance = arm.arm_kg / half_s + arm.arm_nspm + half_s * arm.arm_npm + coupling
    handle_impedance = arm.handle_kg / half_s + friction_nspm + coupling
    determinant = arm_impedance * handle_impedance - coupling * coupling
    for i in range(3):
        intended_m = from_m[i] + (to_m[i] - from_m[i]) * share
        intended_mps = (to_m[i] - from_m[i]) / duration_s
        stretch_n = tissue_npm * (arm.arm_m[i] - arm.handle_m[i])
        arm_n = arm.arm_kg * arm.arm_mps[i] / half_s - stretch_n
        arm_n += arm.arm_npm * (intended_m - arm.arm_m[i]) + arm.arm_nspm * intended_mps
        handle_n = arm.handle_kg * arm.handle_mps[i] / half_s + stretch_n + arm.force_n[i]
        arm_mean_mps = (handle_impedance * arm_n + coupling * handle_n) / determinant
        handle_mean_mps = (arm_impedance * handle_n + coupling * arm_n) / determinant
        arm.arm_m[i] += step_s * arm_mean_mps
        arm.handle_m[i] += step_s * handle_mean_mps
        arm.arm_mps[i] = 2.0 * arm_mean_mps - arm.arm_mps[i]
        arm.handle_mps[i] = 2.0 * handle_mean_mps - arm.handle_mps[i]


@kernel
def write_force(arm: Any, force_n: Any) -> None:
    """Accept the force (3,) [N] that the servo writes; the one written ``delay`` writes ago takes effect."""
    for i in range(3):
        for row in range(MOST_DELAY, 0, -1):
            arm.queue_n[row, i] = arm.queue_n[row - 1, i]
        given_n = min(max(force_n[i], -arm.motor_limit_n), arm.motor_limit_n)
        if arm.motor_step_n > 0.0:
            given_n = arm.motor_step_n * math.floor(given_n / arm.motor_step_n + 0.5)
        arm.queue_n[0, i] = given_n
        arm.force_n[i] = arm.queue_n[arm.delay, i]

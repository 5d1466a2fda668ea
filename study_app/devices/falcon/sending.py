"""Converts the servo's force to motor units, and these back to the force that the motors exert.

The servo limits the change of its force, except when its passivity controller reduces force or adds damping. So does
the driver: after packets that were not sent, or for a caller without such a limit, a force grows by at most the servo's
slew limit per tick; reductions, and forces that take energy from the moving grip, pass at once. The functions work on
the exchange's record (``exchange.FALCON``), in the Falcon's frame.
"""

import math
from typing import Any, Final

from study_app.devices.falcon.mechanics.kinematics import jacobian, motor_units, torques
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.passivity import SURE_MPS
from study_app.haptics.kernels.vector import dot, square, square_distance

MOST_WAITING_N: Final = 0.5
"""Greatest difference between a force and the motors' present force at which a delay measurement may omit it."""

SHORTEST_TICK_S: Final = 1e-3
LONGEST_TICK_S: Final = 4e-3
"""Time that limits the growth of a force in a tick, even if the tick is late."""


@kernel
def push(falcon: Any) -> None:
    """Turn ``force_n``, as much of it as passes the gate, into ``units`` for the motors.

    ``held_n`` is then the force of the motors until the next command, where the grip is now, and ``sent_n`` the force
    after it [N].
    """
    jacobian(falcon.mechanism, falcon.theta, falcon.position_m, falcon.rates)
    _motor_force(falcon, falcon.held_n)
    _choose_units(falcon)
    _motor_force(falcon, falcon.sent_n)


@kernel
def may_wait(falcon: Any) -> bool:
    """Return whether the motors may keep their force for a tick: it is close to the wanted one, and not 0."""
    near: bool = square_distance(falcon.sent_n, falcon.held_n) <= MOST_WAITING_N * MOST_WAITING_N
    return near and (square(falcon.sent_n) > 0.0 or square(falcon.held_n) == 0.0)


@kernel
def _motor_force(falcon: Any, force_n: Any) -> None:
    """Write the force of ``units`` at the grip into ``force_n`` (3,) [N]: ``F = J^T tau``; 0 if they are 0."""
    units = falcon.units
    for axis in range(3):
        force_n[axis] = 0.0
        for i in range(3):
            if units[i] != 0:
                force_n[axis] -= units[i] / falcon.mechanism.units_per_nm * falcon.rates[i, axis]


@kernel
def _choose_units(falcon: Any) -> None:
    for axis in range(3):
        falcon.force_n[axis] *= falcon.share
    none = square(falcon.force_n) == 0.0
    if none or falcon.homed == 0 or falcon.unguarded != 0:
        for i in range(3):
            falcon.units[i] = 0
        return
    limit_growth(falcon)
    torques(falcon.rates, falcon.force_n, falcon.torque_nm)
    falcon.shortened += motor_units(falcon.mechanism, falcon.torque_nm, falcon.units)


@kernel
def limit_growth(falcon: Any) -> None:
    """Limit the part of the force that is new and does not brake the grip to the servo's slew limit.

    New is the way from the nearest force that is a share (0 to 1) of the one held, so that a force that turns round
    falls at once and grows by steps. A grip slower than ``SURE_MPS`` may be a count of an encoder, and is not braked.
    """
    held_n, force_n, v_mps = falcon.held_n, falcon.force_n, falcon.velocity_mps
    kept = 0.0
    if square(held_n) > 0.0:
        kept = min(max(dot(force_n, held_n) / square(held_n), 0.0), 1.0)
    braking = 0.0  # [N s/m]
    if square(v_mps) > SURE_MPS * SURE_MPS:
        braking = min((dot(force_n, v_mps) - kept * dot(held_n, v_mps)) / square(v_mps), 0.0)
    square_n2 = 0.0
    for axis in range(3):
        square_n2 += (force_n[axis] - kept * held_n[axis] - braking * v_mps[axis]) ** 2
    asked_n2 = square(force_n)
    most_n = falcon.slew_n_per_s * min(max(falcon.tick_s, SHORTEST_TICK_S), LONGEST_TICK_S)
    if square_n2 > most_n * most_n:
        share = most_n / math.sqrt(square_n2)
        for axis in range(3):
            given_n = kept * held_n[axis] + braking * v_mps[axis]
            force_n[axis] = given_n + share * (force_n[axis] - given_n)
        shorter = math.sqrt(min(asked_n2 / max(square(force_n), asked_n2), 1.0))
        for axis in range(3):  # the force held may be longer, or what brakes may point elsewhere
            force_n[axis] *= shorter

"""The emulated Falcon's three arms: angles from a pose, and the force of torques at it.

The method deliberately differs from that of ``falcon.mechanics``, to reveal errors in either. A search finds the angle
of an arm at which its rod, as a vector, has the correct length. The force follows from virtual work, ``F . dp = sum
tau_i dtheta_i``, with the changes of the angles from small displacements of the grip.
"""

import math
from typing import Any

import numpy as np

from study_app.devices.falcon.mechanics import Geometry
from study_app.haptics.kernels import kernel, norm

ARMS = np.dtype(
    [
        ("arm_m", np.float64),
        ("rod_m", np.float64),
        ("ends_m", np.float64),
        ("base_m", np.float64),
        ("platform_m", np.float64),
        ("aside_m", np.float64),
        ("along", np.float64, (3, 3)),  # unit vectors: outward in the plane of each arm,
        ("across", np.float64, (3, 3)),  # and across it
        ("rad_per_count", np.float64),
        ("zero_rad", np.float64, (3,)),  # where each encoder counts 0
        ("units_per_nm", np.float64),  # motor units that make an arm torque of 1 N m; a positive unit pulls inward
        ("centre_m", np.float64),  # the hand's origin, in front of the base
        ("angle_rad", np.float64, (3,)),  # last result
        ("force_n", np.float64, (3,)),  # force of the motors on the grip, as last computed
    ],
    align=True,
)

_MAX_FORCE_N = 10.0
"""The greatest force of the motors at the grip [N]; above it, all three torques are reduced by a common factor.

Novint advertised more than 8.9 N (2 lbf). Full torque units give 9.8 to 10.2 N across the axis with the gain of Martin
& Hillier 2009, which agrees, but 24.8 N along it, which is not reported of any Falcon with its 30 W supply. What
saturates, each motor or their supply, and at how much, is not published: uncertain by 1 N across, by more along z.
"""
_MIN_LEVER_M = 0.012
"""Smallest change of the rod's length per arm rotation [m/rad]; below it, the arm is nearly stretched, at its stop. In
normal use a Falcon stays above twice this value."""

_STEP_M = 2e-5  # step of the differences: truncation error 1e-7 of a derivative, rounding error 1e-11
_STEP_RAD = 2e-4
_ENOUGH_RAD = 1e-14
_SLACK_M = 1e-9
_STOP_HALVINGS = 20
_SECANTS = 12
_HALVINGS = 60


def set_arms(arms: Any, geometry: Geometry, units_per_nm: float, arm_offset_rad: tuple[float, float, float]) -> None:
    """Set the dimensions of the arms of a Falcon whose encoders have these zero offsets [rad]."""
    arms.arm_m, arms.rod_m, arms.ends_m = geometry.arm_m, geometry.rod_m, geometry.ends_m
    arms.base_m, arms.platform_m, arms.aside_m = geometry.base_m, geometry.platform_m, geometry.aside_m
    arms.rad_per_count, arms.units_per_nm = geometry.rad_per_count, units_per_nm
    arms.zero_rad = [geometry.zero_rad + offset for offset in arm_offset_rad]
    arms.centre_m = geometry.centre_m
    arms.along = [(math.cos(phi), math.sin(phi), 0.0) for phi in geometry.azimuths_rad]
    arms.across = [(-math.sin(phi), math.cos(phi), 0.0) for phi in geometry.azimuths_rad]


@kernel
def find_angles(arms: Any, hand_m: Any) -> None:
    """Find the arms' angles for the grip at ``hand_m`` (3,) [m, hand frame]."""
    x, y, z = hand_m[0], hand_m[1], hand_m[2] + arms.centre_m
    for i in range(3):
        arms.angle_rad[i] = _find_angle(arms, i, x, y, z, arms.angle_rad[i])


@kernel
def stop(arms: Any, handle: Any) -> None:
    """Keep a ``plant.HANDLE`` within the arms' reach, short of their end stops, and set the arms' angles."""
    find_angles(arms, handle.position_m)
    if _is_reachable(arms, handle.position_m):
        return
    x, y, z = handle.position_m[0], handle.position_m[1], handle.position_m[2]
    low, high = 0.0, 1.0
    for _ in range(_STOP_HALVINGS):
        share = 0.5 * (low + high)
        _set_position(handle, share * x, share * y, share * z)
        find_angles(arms, handle.position_m)
        if _is_reachable(arms, handle.position_m):
            low = share
        else:
            high = share
    _set_position(handle, low * x, low * y, low * z)
    for i in range(3):
        handle.velocity_mps[i] = 0.0
    find_angles(arms, handle.position_m)


@kernel
def _set_position(handle: Any, x: float, y: float, z: float) -> None:
    handle.position_m[0], handle.position_m[1], handle.position_m[2] = x, y, z


@kernel
def _is_reachable(arms: Any, hand_m: Any) -> bool:
    """Return whether the arms' angles match the grip's position, and no arm is stretched."""
    x, y, z = hand_m[0], hand_m[1], hand_m[2] + arms.centre_m
    valid = 0
    for i in range(3):
        at = arms.angle_rad[i]
        if abs(_rod_excess_m(arms, i, at, x, y, z)) < _SLACK_M and -_excess_per_rad(arms, i, x, y, z) > _MIN_LEVER_M:
            valid += 1
    return valid == 3


@kernel
def _excess_per_rad(arms: Any, arm: int, x: float, y: float, z: float) -> float:
    """Return the change of the rod's excess length per rotation of ``arm`` [m/rad]."""
    at, turn = arms.angle_rad[arm], _STEP_RAD
    longer: float = _rod_excess_m(arms, arm, at + turn, x, y, z) - _rod_excess_m(arms, arm, at - turn, x, y, z)
    return longer / (2.0 * turn)


@kernel
def encoder_count(arms: Any, arm: int) -> int:
    """Return an arm's encoder count, relative to its zero, at the current angle."""
    count: int = math.floor((arms.angle_rad[arm] - arms.zero_rad[arm]) / arms.rad_per_count + 0.5)
    return count


@kernel
def find_force(arms: Any, torque: Any, hand_m: Any) -> None:
    """Set ``arms.force_n`` from motor torques (3,) [units], with the grip at ``hand_m`` of the last angles.

    A step of the grip changes the rod's length, which a rotation of the arm must compensate: that gives the arm's
    rotation per motion of the grip.
    """
    x, y, z = hand_m[0], hand_m[1], hand_m[2] + arms.centre_m
    d = _STEP_M
    arms.force_n[0], arms.force_n[1], arms.force_n[2] = 0.0, 0.0, 0.0
    for i in range(3):
        at = arms.angle_rad[i]
        excess_per_rad = _excess_per_rad(arms, i, x, y, z)
        if excess_per_rad == 0.0:
            continue
        arm_nm = -torque[i] / arms.units_per_nm
        factor = -arm_nm / (excess_per_rad * 2.0 * d)
        arms.force_n[0] += factor * (_rod_excess_m(arms, i, at, x + d, y, z) - _rod_excess_m(arms, i, at, x - d, y, z))
        arms.force_n[1] += factor * (_rod_excess_m(arms, i, at, x, y + d, z) - _rod_excess_m(arms, i, at, x, y - d, z))
        arms.force_n[2] += factor * (_rod_excess_m(arms, i, at, x, y, z + d) - _rod_excess_m(arms, i, at, x, y, z - d))


@kernel
def saturate(arms: Any) -> None:
    """Limit ``arms.force_n`` to the greatest force of the motors."""
    size_n = norm(arms.force_n)
    if size_n > _MAX_FORCE_N:
        for axis in range(3):
            arms.force_n[axis] *= _MAX_FORCE_N / size_n


@kernel
def _rod_excess_m(arms: Any, arm: int, angle: float, x: float, y: float, z: float) -> float:
    """Return the excess length of the rod of ``arm`` with the arm at ``angle`` and the grip at (x, y, z)."""
    ax, ay = arms.along[arm, 0], arms.along[arm, 1]
    cx, cy = arms.across[arm, 0], arms.across[arm, 1]
    arm_reach = arms.base_m + arms.arm_m * math.cos(angle)
    link_x = x + arms.platform_m * ax + arms.aside_m * cx - arm_reach * ax
    link_y = y + arms.platform_m * ay + arms.aside_m * cy - arm_reach * ay
    link_z = z - arms.arm_m * math.sin(angle)
    aside = link_x * cx + link_y * cy
    flat_x, flat_y = link_x - aside * cx, link_y - aside * cy
    flat = math.sqrt(flat_x * flat_x + flat_y * flat_y + link_z * link_z)
    scale = 1.0 - arms.ends_m / flat  # the end links lie in the arm's plane, in line with the rod's projection onto it
    rod_x, rod_y, rod_z = scale * flat_x + aside * cx, scale * flat_y + aside * cy, scale * link_z
    excess_m: float = math.sqrt(rod_x * rod_x + rod_y * rod_y + rod_z * rod_z) - arms.rod_m
    return excess_m


@kernel
def _find_angle(arms: Any, arm: int, x: float, y: float, z: float, start: float) -> float:
    """Return the angle of ``arm`` with its elbow outside, searched from ``start``.

    If the position is out of reach, the angle toward it is returned.
    """
    ax, ay = arms.along[arm, 0], arms.along[arm, 1]
    toward = math.atan2(z, x * ax + y * ay + arms.platform_m - arms.base_m)
    # The rod gets shorter as the arm turns toward the platform: there is a solution on either side of that angle, and
    # the one with the elbow outside is below it.
    before, at = start + 1e-4, start
    f_before, f_at = _rod_excess_m(arms, arm, before, x, y, z), _rod_excess_m(arms, arm, at, x, y, z)
    for _ in range(_SECANTS):
        if f_at == f_before:
            break
        step = f_at * (at - before) / (f_at - f_before)
        before, f_before = at, f_at
        at -= step
        f_at = _rod_excess_m(arms, arm, at, x, y, z)
        if abs(step) < _ENOUGH_RAD or f_at == 0.0:
            break
    if toward - math.pi < at < toward and abs(f_at) < 1e-13:
        return at
    low, high = toward - math.pi, toward
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _rod_excess_m(arms, arm, middle, x, y, z) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)

"""The emulated Falcon's three arms: angles from a pose, and the force of torques at it.

Its method differs from ``kinematics`` on purpose, to reveal errors in either. A search finds the angle of an arm at
which its rod, as a vector, has the correct length; the force follows from virtual receive_byte, ``F . dp = sum tau_i
dtheta_i``, with the changes of the angles from small displacements of the grip.
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
        ("along", np.float64, (3, 3)),  # unit vectors: out from the middle along each arm's plane
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

_MOST_FORCE_N = 10.0
"""The greatest force of the motors at the grip [N]; beyond it all three torques are reduced by one factor.

Novint advertised more than 8.9 N (2 lbf). Full torque units give 9.8 to 10.2 N across the axis with the gain of Martin
& Hillier 2009, which agrees, but 24.8 N along it, which is not reported of any Falcon with its 30 W supply. What
saturates, each motor or their supply, and at how much, is not published: uncertain by 1 N across, by more along z.
"""
_LEAST_LEVER_M = 0.012
"""Smallest change of the rod's length per arm rotation [m/rad]: below it the arm is nearly stretched, at its stop. All
that a Falcon is used for is twice as far from that."""

_STEP_M = 2e-5  # step of the differences: truncation error 1e-7 of a derivative, rounding error 1e-11
_STEP_RAD = 2e-4
_ENOUGH_RAD = 1e-14
_SLACK_M = 1e-9
_STOP_HALVINGS = 20
_SECANTS = 12
_HALVINGS = 60


def set_arms(arms: Any, geometry: Geometry, units_per_nm: float, arm_offset_rad: tuple[float, float, float]) -> None:
    """Return the arms of a Falcon whose encoders have these zero offsets [rad]."""
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
        arms.angle_rad[i] = _angle(arms, i, x, y, z, arms.angle_rad[i])


@kernel
def stop(arms: Any, handle: Any) -> None:
    """Keep a ``plant.HANDLE`` within the arms' reach, and set their angles; it stops before the arms' end stops."""
    find_angles(arms, handle.position_m)
    if _reached(arms, handle.position_m):
        return
    x, y, z = handle.position_m[0], handle.position_m[1], handle.position_m[2]
    low, high = 0.0, 1.0
    for _ in range(_STOP_HALVINGS):
        share = 0.5 * (low + high)
        _put(handle, share * x, share * y, share * z)
        find_angles(arms, handle.position_m)
        if _reached(arms, handle.position_m):
            low = share
        else:
            high = share
    _put(handle, low * x, low * y, low * z)
    for i in range(3):
        handle.velocity_mps[i] = 0.0
    find_angles(arms, handle.position_m)


@kernel
def _put(handle: Any, x: float, y: float, z: float) -> None:
    handle.position_m[0], handle.position_m[1], handle.position_m[2] = x, y, z


@kernel
def _reached(arms: Any, hand_m: Any) -> bool:
    """Return whether the arms' angles match the grip's position, and no arm is stretched."""
    x, y, z = hand_m[0], hand_m[1], hand_m[2] + arms.centre_m
    held = 0
    for i in range(3):
        at = arms.angle_rad[i]
        if abs(_stretch(arms, i, at, x, y, z)) < _SLACK_M and -_per_rad(arms, i, x, y, z) > _LEAST_LEVER_M:
            held += 1
    return held == 3


@kernel
def _per_rad(arms: Any, arm: int, x: float, y: float, z: float) -> float:
    """Return the change of the rod's excess length per rotation of ``arm`` [m/rad]."""
    at, turn = arms.angle_rad[arm], _STEP_RAD
    longer: float = _stretch(arms, arm, at + turn, x, y, z) - _stretch(arms, arm, at - turn, x, y, z)
    return longer / (2.0 * turn)


@kernel
def count(arms: Any, arm: int) -> int:
    """Return the encoder's count from its zero, for the last angle."""
    counted: int = math.floor((arms.angle_rad[arm] - arms.zero_rad[arm]) / arms.rad_per_count + 0.5)
    return counted


@kernel
def find_force(arms: Any, torque: Any, hand_m: Any) -> None:
    """Set ``arms.force_n`` from motor torques (3,) [units], with the grip at ``hand_m`` of the last angles.

    A step of the grip changes the rod's length, a rotation of the arm must compensate it: their ratio in radians per
    metre.
    """
    x, y, z = hand_m[0], hand_m[1], hand_m[2] + arms.centre_m
    d = _STEP_M
    arms.force_n[0], arms.force_n[1], arms.force_n[2] = 0.0, 0.0, 0.0
    for i in range(3):
        at = arms.angle_rad[i]
        per_rad = _per_rad(arms, i, x, y, z)
        if per_rad == 0.0:
            continue
        arm_nm = -torque[i] / arms.units_per_nm
        share = -arm_nm / (per_rad * 2.0 * d)
        arms.force_n[0] += share * (_stretch(arms, i, at, x + d, y, z) - _stretch(arms, i, at, x - d, y, z))
        arms.force_n[1] += share * (_stretch(arms, i, at, x, y + d, z) - _stretch(arms, i, at, x, y - d, z))
        arms.force_n[2] += share * (_stretch(arms, i, at, x, y, z + d) - _stretch(arms, i, at, x, y, z - d))


@kernel
def saturate(arms: Any) -> None:
    """Limit ``arms.force_n`` to the greatest force of the motors."""
    size_n = norm(arms.force_n)
    if size_n > _MOST_FORCE_N:
        for axis in range(3):
            arms.force_n[axis] *= _MOST_FORCE_N / size_n


@kernel
def _stretch(arms: Any, arm: int, angle: float, x: float, y: float, z: float) -> float:
    """Return the excess length of the rod of ``arm`` with the arm at ``angle`` and the grip at (x, y, z)."""
    ax, ay = arms.along[arm, 0], arms.along[arm, 1]
    cx, cy = arms.across[arm, 0], arms.across[arm, 1]
    out = arms.base_m + arms.arm_m * math.cos(angle)
    link_x = x + arms.platform_m * ax + arms.aside_m * cx - out * ax
    link_y = y + arms.platform_m * ay + arms.aside_m * cy - out * ay
    link_z = z - arms.arm_m * math.sin(angle)
    aside = link_x * cx + link_y * cy
    flat_x, flat_y = link_x - aside * cx, link_y - aside * cy
    flat = math.sqrt(flat_x * flat_x + flat_y * flat_y + link_z * link_z)
    kept = 1.0 - arms.ends_m / flat  # the end links lie in the arm's plane, in line with the rod's projection onto it
    rod_x, rod_y, rod_z = kept * flat_x + aside * cx, kept * flat_y + aside * cy, kept * link_z
    stretch: float = math.sqrt(rod_x * rod_x + rod_y * rod_y + rod_z * rod_z) - arms.rod_m
    return stretch


@kernel
def _angle(arms: Any, arm: int, x: float, y: float, z: float, near: float) -> float:
    """Return the angle of ``arm``, with its elbow outside; out of reach, the angle toward the position."""
    ax, ay = arms.along[arm, 0], arms.along[arm, 1]
    toward = math.atan2(z, x * ax + y * ay + arms.platform_m - arms.base_m)
    # The nearer the arm points to the platform the shorter the rod: one such angle on either side, outside is below.
    before, at = near + 1e-4, near
    f_before, f_at = _stretch(arms, arm, before, x, y, z), _stretch(arms, arm, at, x, y, z)
    for _ in range(_SECANTS):
        if f_at == f_before:
            break
        step = f_at * (at - before) / (f_at - f_before)
        before, f_before = at, f_at
        at -= step
        f_at = _stretch(arms, arm, at, x, y, z)
        if abs(step) < _ENOUGH_RAD or f_at == 0.0:
            break
    if toward - math.pi < at < toward and abs(f_at) < 1e-13:
        return at
    low, high = toward - math.pi, toward
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _stretch(arms, arm, middle, x, y, z) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)

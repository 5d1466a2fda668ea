"""The Falcon's mechanics: published dimensions, the grip's position from arm angles, and torques from a force.

Three published sets of dimensions disagree, so they are data, and the receipt names the one used. The Falcon's frame
has x to the right, y up, z toward the user, and its origin at the base [m]. Seen from the user, arms 1, 2 and 3 are at
the top, right and left. The hand frame is the same, moved so that its origin is ``centre_m`` in front of the base,
where the tank of the protocols (100 x 60 x 60 mm) is reached with equal margins in and out.

Sources: ``libnifalcon`` and ``zm-redux``: libnifalcon's geometry of 2019, and of its branch with the name ``zm-redux``;
``martin-hillier``: Martin & Hillier, "Characterisation of the Novint Falcon Haptic Device for Application as a Robot
Manipulator", ACRA 2009, quoted from another source.

For arm i at azimuth phi, with u, v, w as in `Geometry` and ``L = ends + sqrt(rod^2 - v^2)``::

    g_i(theta_i, p) = (u - a cos theta)^2 + (w - a sin theta)^2 - L^2 = 0

Inverse: ``theta = atan2(w, u) - arccos((u^2 + w^2 + a^2 - L^2) / (2 a sqrt(u^2 + w^2)))``, the branch with the elbow
outside. Forward: Newton's method on the three g for p, from the position before. Statics, by virtual work: with
``J = d theta / d p = -(dg/dp) / (dg/d theta)`` the arm torques tau that hold the force F obey ``J^T tau = F``. The
Jacobian was derived for this program, since the widely used one has a wrong column for z.
"""

import itertools
import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.devices.falcon.constants import COUNTS_PER_TURN, MOST_TORQUE
from study_app.errors import DeviceError
from study_app.haptics.kernels import kernel
from study_app.haptics.model.layout import records


@dataclass(frozen=True, slots=True, kw_only=True)
class Geometry:
    """Lengths [m] and angles [rad] of a delta mechanism after Stamper.

    With ``u = x cos(phi) + y sin(phi) - base_m + platform_m`` along arm ``phi``, ``v = -x sin(phi) + y cos(phi) +
    aside_m`` across it and ``w = z``, the arm at ``theta`` obeys
    ``(u - arm_m cos(theta))^2 + (w - arm_m sin(theta))^2 = (ends_m + sqrt(rod_m^2 - v^2))^2``.
    """

    name: str
    arm_m: float  # a: from an arm's axis to the parallelogram
    rod_m: float  # b: long side of the parallelogram
    ends_m: float  # d + e: its two end links, which stay in the arm's plane
    base_m: float  # r: from the centre of the base to an arm's axis
    platform_m: float  # c: from the centre of the platform to the end link
    aside_m: float  # f - s: offset between base and platform across an arm
    drum_ratio: float  # turns of a motor for one of its arm
    zero_rad: float  # theta where an encoder counts 0
    azimuths_rad: tuple[float, float, float] = (math.radians(105), math.radians(-15), math.radians(-135))
    centre_m: float = 0.127  # z of the hand's origin

    @property
    def rad_per_count(self) -> float:
        """Angle of an arm for one count of its encoder [rad]."""
        return 2 * math.pi / COUNTS_PER_TURN / self.drum_ratio


GEOMETRIES: Final = {
    geometry.name: geometry
    for geometry in (
        Geometry(
            name="libnifalcon",
            arm_m=0.060,
            rod_m=0.1025,
            ends_m=0.0225,
            base_m=0.0400,
            platform_m=0.01443,
            aside_m=-0.00191,
            drum_ratio=110 / 14.25,
            zero_rad=math.radians(35),
        ),
        Geometry(
            name="zm-redux",
            arm_m=0.060,
            rod_m=0.1025,
            ends_m=0.0225,
            base_m=0.03723,
            platform_m=0.0140,
            aside_m=0.00233,
            drum_ratio=110 / 14.25,
            zero_rad=math.radians(35),
        ),
        # Its lateral offsets have another sign convention; only their difference, about a millimetre, is used.
        Geometry(
            name="martin-hillier",
            arm_m=0.060,
            rod_m=0.1025,
            ends_m=0.0230,
            base_m=0.0366,
            platform_m=0.0157,
            aside_m=0.0010,
            drum_ratio=7.62,
            zero_rad=math.radians(35),
        ),
    )
}
DEFAULT_GEOMETRY: Final = "libnifalcon"

OUT_STROKE_M: Final = 0.170
"""The grip counts as pulled out beyond this z in the Falcon's frame; before that there is no force."""

SAFE_BOX_M: Final = ((-0.045, 0.045), (-0.045, 0.045), (0.085, 0.165))
"""Limits of x, y and z in the Falcon's frame within which the mechanism moves freely [m]."""

WORKSPACE_M: Final = (0.05, 0.03, 0.03)
"""Half extents about the hand's origin that every published geometry reaches, corners included [m]."""


def geometry_named(name: str) -> Geometry:
    """Return a published geometry.

    Raises
    ------
    DeviceError
        There is no geometry with this name.
    """
    if name not in GEOMETRIES:
        names = ", ".join(GEOMETRIES)
        raise DeviceError(f"{name!r} is not a known Falcon geometry; choose one of: {names}")
    return GEOMETRIES[name]


MECHANISM = np.dtype(
    [
        ("arm_m", np.float64),
        ("rod_m", np.float64),
        ("ends_m", np.float64),
        ("base_m", np.float64),  # base minus platform: only their difference matters
        ("aside_m", np.float64),
        ("cos", np.float64, (3,)),  # of the arms' azimuths
        ("sin", np.float64, (3,)),
        ("rad_per_count", np.float64),
        ("zero_rad", np.float64),  # an arm's theta where its encoder counts 0
        ("units_per_nm", np.float64),  # motor units for an arm torque of one newton metre
    ],
    align=True,
)

REACHED: Final = 0
OUTSIDE: Final = 1
"""The pose is out of reach, or a mirror image that the mechanism cannot take."""

START_M: Final = (0.0, 0.0, 0.12)
"""Start position from which `forward` finds every pose of the workspace."""

_MAX_STEPS = 30
_MIN_ROD_M = 1e-6  # projection of a rod across its arm
_CONVERGED_M = 1e-12  # length of the step at which Newton's method ends, with an error of the order of rounding


def new_mechanism(geometry: Geometry, units_per_nm: float, arm_offset_rad: float = 0.0) -> Any:
    """Return the record of a mechanism with these dimensions and the gain and offset of a calibration."""
    mechanism = records(MECHANISM, 1)[0]
    mechanism.arm_m, mechanism.rod_m, mechanism.ends_m = geometry.arm_m, geometry.rod_m, geometry.ends_m
    mechanism.base_m = geometry.base_m - geometry.platform_m
    mechanism.aside_m = geometry.aside_m
    mechanism.cos = [math.cos(azimuth) for azimuth in geometry.azimuths_rad]
    mechanism.sin = [math.sin(azimuth) for azimuth in geometry.azimuths_rad]
    mechanism.rad_per_count = geometry.rad_per_count
    mechanism.zero_rad = geometry.zero_rad + arm_offset_rad
    mechanism.units_per_nm = units_per_nm
    return mechanism


@kernel
def angles(mechanism: Any, counts: Any, theta: Any) -> None:
    """Write the angles of encoder ``counts`` (3,) into ``theta`` (3,) [rad]."""
    for i in range(3):
        theta[i] = counts[i] * mechanism.rad_per_count + mechanism.zero_rad


@kernel
def inverse(mechanism: Any, position_m: Any, theta: Any) -> int:
    """Write the angles for ``position_m`` (3,) [m] into ``theta`` (3,) [rad]; return ``REACHED`` or ``OUTSIDE``."""
    a = mechanism.arm_m
    w = position_m[2]
    for i in range(3):
        u, v = _distance_along(mechanism, i, position_m), _distance_across(mechanism, i, position_m)
        projection_m2 = mechanism.rod_m * mechanism.rod_m - v * v
        distance = math.sqrt(u * u + w * w)
        if not (projection_m2 > 0.0 and distance > 0.0):
            return OUTSIDE
        length = mechanism.ends_m + math.sqrt(projection_m2)
        cosine = (distance * distance + a * a - length * length) / (2.0 * a * distance)
        if not -1.0 < cosine < 1.0:
            return OUTSIDE
        theta[i] = math.atan2(w, u) - math.acos(cosine)
    return REACHED


@kernel
def forward(mechanism: Any, theta: Any, position_m: Any) -> int:
    """Set ``position_m`` (3,) [m] to the grip's position at angles ``theta`` (3,) [rad], starting from its value.

    Returns ``REACHED``, or ``OUTSIDE`` with the position unchanged.
    """
    for i in range(3):
        if not abs(theta[i]) < math.pi:
            return OUTSIDE
    x, y, z, status = _newton(mechanism, theta, position_m[0], position_m[1], position_m[2])
    if status != REACHED:
        x, y, z, status = _newton(mechanism, theta, START_M[0], START_M[1], START_M[2])
    if status == REACHED:
        position_m[0], position_m[1], position_m[2] = x, y, z
    return status


@kernel
def _newton(mechanism: Any, theta: Any, x: float, y: float, z: float) -> tuple[float, float, float, int]:
    a0, a1, a2 = math.cos(theta[0]), math.cos(theta[1]), math.cos(theta[2])
    b0, b1, b2 = math.sin(theta[0]), math.sin(theta[1]), math.sin(theta[2])
    for _ in range(_MAX_STEPS):
        p = (x, y, z)
        g0, x0, y0, z0, turn0 = _constraint(mechanism, 0, a0, b0, p)
        g1, x1, y1, z1, turn1 = _constraint(mechanism, 1, a1, b1, p)
        g2, x2, y2, z2, turn2 = _constraint(mechanism, 2, a2, b2, p)
        (c0x, c0y, c0z), (c1x, c1y, c1z) = _cross(x1, y1, z1, x2, y2, z2), _cross(x2, y2, z2, x0, y0, z0)
        c2x, c2y, c2z = _cross(x0, y0, z0, x1, y1, z1)
        determinant = x0 * c0x + y0 * c0y + z0 * c0z
        if determinant == 0.0:
            break
        dx = (g0 * c0x + g1 * c1x + g2 * c2x) / determinant
        dy = (g0 * c0y + g1 * c1y + g2 * c2y) / determinant
        dz = (g0 * c0z + g1 * c1z + g2 * c2z) / determinant
        x, y, z = x - dx, y - dy, z - dz
        step = abs(dx) + abs(dy) + abs(dz)
        if step < _CONVERGED_M:
            is_elbow_outside = turn0 < 0.0 and turn1 < 0.0 and turn2 < 0.0
            return x, y, z, REACHED if is_elbow_outside else OUTSIDE
        if not step < 1.0:  # far away or NaN: the pose is out of reach
            break
    return x, y, z, OUTSIDE


@kernel
def jacobian(mechanism: Any, theta: Any, position_m: Any, rates: Any) -> None:
    """Write the rotation of arm i (row) per motion of the grip along x, y, z (column) into ``rates`` (3, 3) [rad/m]."""
    p = (position_m[0], position_m[1], position_m[2])
    for i in range(3):
        _g, along_x, along_y, along_z, along_angle = _constraint(
            mechanism, i, math.cos(theta[i]), math.sin(theta[i]), p
        )
        rates[i, 0] = -along_x / along_angle
        rates[i, 1] = -along_y / along_angle
        rates[i, 2] = -along_z / along_angle


def count_at(mechanism: Any, z_m: float) -> float:
    """Return the longest motion of the grip within one encoder count, on the axis at ``z_m`` [m]."""
    theta, rates, position_m = np.zeros(3), np.zeros((3, 3)), np.array([0.0, 0.0, z_m])
    inverse(mechanism, position_m, theta)
    jacobian(mechanism, theta, position_m, rates)
    return float(np.linalg.norm(np.linalg.inv(rates), 2) * mechanism.rad_per_count)


def rounding_n(mechanism: Any) -> float:
    """Return the greatest force error by rounding to motor units at the corners of the safe box within reach [N]."""
    theta, rates, errors_n = np.zeros(3), np.zeros((3, 3)), []
    for corner_m in itertools.product(*SAFE_BOX_M):
        if inverse(mechanism, np.array(corner_m), theta) == REACHED:
            jacobian(mechanism, theta, np.array(corner_m), rates)
            errors_n.append(rounding_at(mechanism, rates))
    return max(errors_n)


@kernel
def rounding_at(mechanism: Any, rates: Any) -> float:
    """Return the greatest force error by rounding in the pose of ``rates`` [N]: half a motor unit per arm."""
    error_n = 0.0
    for i in range(3):
        square = rates[i, 0] * rates[i, 0] + rates[i, 1] * rates[i, 1] + rates[i, 2] * rates[i, 2]
        error_n += 0.5 / mechanism.units_per_nm * math.sqrt(square)
    return error_n


@kernel
def torques(rates: Any, force_n: Any, torque_nm: Any) -> None:
    """Write the arm torques for ``force_n`` (3,) [N] into ``torque_nm`` (3,) [N m]: ``J^T tau = F``.

    They are 0 at a singular pose, which the mechanism's stops prevent.
    """
    r0, r1, r2 = rates[0], rates[1], rates[2]
    x, y, z = force_n[0], force_n[1], force_n[2]
    c0 = _cross(r1[0], r1[1], r1[2], r2[0], r2[1], r2[2])
    c1 = _cross(r2[0], r2[1], r2[2], r0[0], r0[1], r0[2])
    c2 = _cross(r0[0], r0[1], r0[2], r1[0], r1[1], r1[2])
    determinant = r0[0] * c0[0] + r0[1] * c0[1] + r0[2] * c0[2]
    if determinant == 0.0:
        x, y, z, determinant = 0.0, 0.0, 0.0, 1.0
    torque_nm[0] = (x * c0[0] + y * c0[1] + z * c0[2]) / determinant
    torque_nm[1] = (x * c1[0] + y * c1[1] + z * c1[2]) / determinant
    torque_nm[2] = (x * c2[0] + y * c2[1] + z * c2[2]) / determinant


@kernel
def motor_units(mechanism: Any, torque_nm: Any, units: Any) -> int:
    """Write the motor commands into ``units`` (3,); return 1 if they exceed the motors' range, else 0.

    Commands that are too large are reduced by a common factor, so that the force keeps its direction. Torques that are
    not finite give zero.
    """
    greatest = 0.0
    for i in range(3):
        greatest = max(greatest, abs(torque_nm[i] * mechanism.units_per_nm))
        if not math.isfinite(torque_nm[i] * mechanism.units_per_nm):
            greatest = math.inf
    if not math.isfinite(greatest):
        for i in range(3):
            units[i] = 0
        return 1
    factor = 1.0 if greatest <= MOST_TORQUE else MOST_TORQUE / greatest
    for i in range(3):
        command = -mechanism.units_per_nm * torque_nm[i] * factor
        units[i] = int(min(max(math.floor(command + 0.5), -MOST_TORQUE), MOST_TORQUE))
    return 0 if factor == 1.0 else 1


@kernel
def _distance_along(mechanism: Any, arm: int, p: Any) -> Any:
    return p[0] * mechanism.cos[arm] + p[1] * mechanism.sin[arm] - mechanism.base_m


@kernel
def _distance_across(mechanism: Any, arm: int, p: Any) -> Any:
    return p[1] * mechanism.cos[arm] - p[0] * mechanism.sin[arm] + mechanism.aside_m


@kernel
def _constraint(mechanism: Any, arm: int, cos: float, sin: float, p: Any) -> Any:
    """Return g of an arm whose angle has this cosine and sine, its slopes along x, y, z and along the angle.

    If the lateral offset exceeds the rod, the pose is impossible, and the slope along the angle is 0, as in no real
    pose.
    """
    u, v, w = _distance_along(mechanism, arm, p), _distance_across(mechanism, arm, p), p[2]
    a = mechanism.arm_m
    square = mechanism.rod_m * mechanism.rod_m - v * v
    rod = math.sqrt(max(square, _MIN_ROD_M * _MIN_ROD_M))
    along_angle = 2.0 * a * (u * sin - w * cos) if square > 0.0 else 0.0
    length = mechanism.ends_m + rod
    du, dw = u - a * cos, w - a * sin
    along_u, along_v, along_w = 2.0 * du, 2.0 * length * v / rod, 2.0 * dw
    along_x = along_u * mechanism.cos[arm] - along_v * mechanism.sin[arm]
    along_y = along_u * mechanism.sin[arm] + along_v * mechanism.cos[arm]
    return du * du + dw * dw - length * length, along_x, along_y, along_w, along_angle


@kernel
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx

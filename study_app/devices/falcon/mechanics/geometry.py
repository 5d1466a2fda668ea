"""The Falcon's measures, as published: three sets that disagree, so they are data and the receipt names the one used.

Frame of the Falcon: x right, y up, z toward the user, origin at the base [m]. Arms 1, 2, 3 are at the top, right and
left, seen from the user. The frame of the hand is the same, moved so that its origin is ``centre_m`` in front of the
base: there the tank of the protocols (100 x 60 x 60 mm) is reached with equal margin in and out.

Sources: ``libnifalcon`` and ``zm-redux``: libnifalcon's geometry of 2019 and of its branch of that name;
``martin-hillier``: Martin & Hillier, "Characterisation of the Novint Falcon Haptic Device for Application as a Robot
Manipulator", ACRA 2009, at second hand. Loads no compiler.
"""

import math
from dataclasses import dataclass
from typing import Final

from study_app.devices.falcon.wire.constants import COUNTS_PER_TURN
from study_app.errors import DeviceError


@dataclass(frozen=True, slots=True)
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
    aside_m: float  # f - s: how far base and platform are off each other across an arm
    drum_ratio: float  # turns of a motor for one of its arm
    zero_rad: float  # theta where an encoder counts 0
    azimuths_rad: tuple[float, float, float] = (math.radians(105), math.radians(-15), math.radians(-135))
    centre_m: float = 0.127  # z of the hand's origin

    @property
    def rad_per_count(self) -> float:
        """Angle of an arm for one count of its encoder [rad]."""
        return 2 * math.pi / COUNTS_PER_TURN / self.drum_ratio


GEOMETRIES: Final = {
    known.name: known
    for known in (
        Geometry(
            "libnifalcon",
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
            "zm-redux",
            arm_m=0.060,
            rod_m=0.1025,
            ends_m=0.0225,
            base_m=0.03723,
            platform_m=0.0140,
            aside_m=0.00233,
            drum_ratio=110 / 14.25,
            zero_rad=math.radians(35),
        ),
        # Its lateral offsets have a sign convention of their own; their difference is about a millimetre.
        Geometry(
            "martin-hillier",
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
"""The grip counts as pulled out beyond this z in the Falcon's frame: no force before that."""

SAFE_BOX_M: Final = ((-0.045, 0.045), (-0.045, 0.045), (0.085, 0.165))
"""Where the mechanism moves freely, in the Falcon's frame: lowest and highest x, y, z."""

WORKSPACE_M: Final = (0.05, 0.03, 0.03)
"""Half extents of what it reaches about the hand's origin in every published geometry, corners included."""


def geometry_named(name: str) -> Geometry:
    """Return a published geometry.

    Raises
    ------
    DeviceError
        Nobody published one of this name.
    """
    if name not in GEOMETRIES:
        known = ", ".join(GEOMETRIES)
        raise DeviceError(f"geometry {name!r} of the Falcon is not known; choose one of: {known}")
    return GEOMETRIES[name]

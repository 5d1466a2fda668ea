"""The fastest stroke that a task calls for, and the share of a scene's force that safety withholds in it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from study_app.protocol.tasks import Explore, Reach

if TYPE_CHECKING:
    from study_app.haptics.dynamics import Dynamics
    from study_app.haptics.scene import Scene

SHAKE_HZ: Final = 5.0
SHAKE_M: Final = 0.03
"""As quick and as wide as free shaking of a light handle commonly is. [choice]"""
REACH_S: Final = 0.3
"""From target to target, as fast as aimed reaches are. [choice]"""
LASTS_S: Final = 2.0


class Stroke(NamedTuple):
    """A straight stroke to and fro: x = A cos 2πft in the hand frame."""

    frequency_hz: float
    amplitude_m: float

    @property
    def speed_mps(self) -> float:
        """The greatest speed [m/s]."""
        return 2.0 * math.pi * self.frequency_hz * self.amplitude_m


def fastest_stroke(task: Explore | Reach, workspace_m: tuple[float, float, float]) -> Stroke:
    """Return the fastest stroke of a task in a tank of these extents [m, hand frame]."""
    if isinstance(task, Explore):
        return Stroke(SHAKE_HZ, min(SHAKE_M, workspace_m[0] / 2))
    following = (*task.targets_m[1:], task.targets_m[0])
    way_m = max(math.dist(*pair) for pair in zip(task.targets_m, following, strict=True))
    return Stroke(0.5 / REACH_S, way_m / 2)


def withheld_share(scene: Scene, stroke: Stroke, dynamics: Dynamics) -> float:
    """Return Σ|F_a - F_b| / Σ|F_a| along a stroke that is imposed on the position, from rest; 0 without a force.

    The stroke is centred on the device's origin, and the loop is that of a device of these ``dynamics``.
    F_a is the force after slope limit and norm clamp, F_b what passivity controller and slew limit leave of it.
    """
    from study_app.haptics.motion import Motion  # noqa: PLC0415 - the compiler: only where it is computed
    from study_app.haptics.offline import samples_along  # noqa: PLC0415

    t_s = np.arange(round(LASTS_S * scene.rate_hz)) / scene.rate_hz
    along_m = scene.scale * stroke.amplitude_m * np.cos(2.0 * math.pi * stroke.frequency_hz * t_s)
    still = np.zeros_like(t_s)
    position_m = np.add(scene.origin_m, np.column_stack((along_m, still, still)))
    samples = samples_along(scene, Motion(t_s, position_m), dynamics)
    permitted_n = float(samples["permitted_n"].sum())
    return float(samples["withheld_n"].sum()) / permitted_n if permitted_n > 0.0 else 0.0

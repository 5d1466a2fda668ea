"""The share of a scene's force that safety withholds in a stroke, such as the fastest of a task."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from study_app.haptics.model.device_dynamics import Dynamics
    from study_app.haptics.model.scene import Scene
    from study_app.protocol.trials.tasks.stroke import Stroke

LASTS_S: Final = 2.0


def withheld_share(scene: Scene, stroke: Stroke, dynamics: Dynamics) -> float:
    """Return Σ|F_a - F_b| / Σ|F_a| along a stroke that is imposed on the position, from rest; 0 without a force.

    The stroke is centred on the device's origin, and the loop is that of a device of these ``dynamics``.
    F_a is the force after slope limit and norm clamp, F_b what passivity controller and slew limit leave of it.
    """
    from study_app.haptics.model.motion import Motion  # noqa: PLC0415 - the compiler: only where it is computed
    from study_app.haptics.runtime.offline import samples_along  # noqa: PLC0415

    t_s = np.arange(round(LASTS_S * scene.rate_hz)) / scene.rate_hz
    along_m = scene.scale * stroke.amplitude_m * np.cos(2.0 * math.pi * stroke.frequency_hz * t_s)
    still = np.zeros_like(t_s)
    position_m = np.add(scene.origin_m, np.column_stack((along_m, still, still)))
    samples = samples_along(scene, Motion(t_s, position_m), dynamics)
    permitted_n = float(samples["permitted_n"].sum())
    return float(samples["withheld_n"].sum()) / permitted_n if permitted_n > 0.0 else 0.0

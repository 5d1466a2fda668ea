"""Non-Newtonian drag, directly from its equations: ``haptics.kernels.effects.non_newtonian`` must equal it.

The steady force is that of ``haptics.model.laws.rheology``; the states are integrated here in many steps per tick, and
share no code with the kernel.
"""

import math
from typing import Any, Final

import numpy as np

from study_app.haptics.kernels.compiled import workings
from study_app.haptics.model.effects.non_newtonian import STIFFNESS_NPM
from study_app.haptics.model.laws import rheology
from study_app.haptics.model.laws.rheology import Maxwell
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene

STEPS: Final = 50
"""Of the elastic state, in a tick."""


def non_newtonian_n(scene: Scene, w_mps: Floats, interval_s: Floats, *, slack_m: float = 0.0) -> Floats:
    """Return the force (n, 3) [N] in the scene's first liquid, at rest and everywhere.

    Parameters
    ----------
    scene : Scene
        Its first liquid has a flow curve.
    w_mps : (n, 3) array
        Velocities [m/s, scene].
    interval_s : (n,) array
        Times since the tick before [s].
    slack_m : float
        Motion within it relaxes no elastic stress [m, scene]: two encoder counts in the servo.
    """
    liquid, diameter_m = scene.liquids[0], scene.body.diameter_m
    law = liquid.non_newtonian
    speeds_mps = np.linalg.norm(w_mps, axis=1)
    if isinstance(law, Maxwell):
        met_mps = _relaxed(w_mps, interval_s, law.relaxation_time_s)
        held, speeds_mps = np.zeros_like(w_mps), np.linalg.norm(met_mps, axis=1)
    else:
        met_mps, held = w_mps, np.zeros_like(w_mps)
        if (yield_n := rheology.yield_n(law, diameter_m)) > 0:
            per_m = STIFFNESS_NPM / scene.scale / yield_n
            held = _strains(w_mps, interval_s, per_m, slack_m)
    parts_n = [rheology.even_n(law, liquid.density_kg_m3, diameter_m, float(speed)) for speed in speeds_mps]
    held_n, viscous_n = np.array(parts_n).T
    directions = met_mps / np.maximum(speeds_mps, math.ulp(0.0))[:, np.newaxis]
    force_n: Floats = -(held_n[:, np.newaxis] * held + viscous_n[:, np.newaxis] * directions)
    return force_n


def _relaxed(w_mps: Floats, interval_s: Floats, relaxation_s: float) -> Floats:
    """Return v of v' = (w − v)/λ, (n, 3) [m/s], exactly for a velocity that is constant in each tick."""
    v = np.zeros_like(w_mps)
    for k, w in enumerate(w_mps):
        before = v[k - 1] if k else np.zeros(3)
        v[k] = w + (before - w) * math.exp(-interval_s[k] / relaxation_s)
    return v


@workings
def _strains(w_mps: Any, interval_s: Any, per_m: float, slack_m: float) -> Any:
    """Return s/s_y (n, 3) of ds = dp − |dp| s/s_y, with |dp| counted beyond the slack."""
    strains = np.zeros(w_mps.shape)
    strain, ahead_m = np.zeros(3), np.zeros(3)
    for k in range(len(w_mps)):
        step_m = w_mps[k] * (interval_s[k] / STEPS)
        for _ in range(STEPS):
            ahead_m += step_m
            distance_m = math.sqrt(np.sum(ahead_m**2))
            slipped_m = max(distance_m - slack_m, 0.0)
            if slipped_m > 0.0:
                ahead_m *= slack_m / distance_m
            strain += (step_m - slipped_m * strain) * per_m
            strain /= max(math.sqrt(np.sum(strain**2)), 1.0)
        strains[k] = strain
    return strains

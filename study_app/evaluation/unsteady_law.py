"""Unsteady drag by the letter of its law: plain numpy, what ``haptics.kernels.effects.unsteady_drag`` must equal.

Written from the law's equations, with exact exponentials for every step, and with the acceleration given. It shares no
code and no constants with the kernel.
"""

from __future__ import annotations

import math

import numpy as np

from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene

RATES_PER_S = np.array([0.0212334, 0.257773, 1.39978, 7.11516, 36.0112, 182.242, 927.902])
WEIGHTS_RPS = np.array([0.33973, 0.52101, 1.09144, 2.44114, 5.48942, 12.3529, 28.26937])


def over_stokes(reynolds: float) -> float:
    """Return φ, the steady drag as a multiple of Stokes' drag."""
    if reynolds == 0:
        return 1.0
    oseen = 3 / 16 * reynolds / (1 + 0.450 * math.sqrt(reynolds))
    return 1 + oseen + 0.486 / 24 * reynolds / (1 + math.pow(4040 / reynolds, 0.70))


def unsteady_n(scene: Scene, w_mps: Floats, acceleration_mps2: Floats, interval_s: Floats) -> Floats:
    """Return the force (n, 3) [N] in the scene's first liquid, at rest and everywhere.

    Parameters
    ----------
    scene : Scene
        Its first liquid has a viscosity.
    w_mps : Floats
        Velocities (n, 3) [m/s, scene]; the body begins as if it had always moved at the first.
    acceleration_mps2 : Floats
        Their derivatives (n, 3) [m/s²].
    interval_s : Floats
        Times (n,) since the tick before [s].
    """
    liquid, diameter_m = scene.liquids[0], scene.body.diameter_m
    density_kg_m3, viscosity_pa_s = liquid.density_kg_m3, liquid.viscosity_pa_s or math.nan
    nu_m2ps = viscosity_pa_s / density_kg_m3
    stokes_nspm = 3 * math.pi * viscosity_pa_s * diameter_m

    def reynolds(velocity_mps: Floats) -> float:
        return float(np.linalg.norm(velocity_mps)) * diameter_m / nu_m2ps

    z = np.array(w_mps[0])
    y = (over_stokes(reynolds(z)) - 1) * z
    m = np.zeros((len(RATES_PER_S), 3))
    force_n = np.empty_like(w_mps)
    for k, (w, dw, dt) in enumerate(zip(w_mps, acceleration_mps2, interval_s, strict=True)):
        u_mps = math.hypot(*w, *z)
        overtaking = float(np.clip(1 - (w @ z) / (z @ z), 0, 1)) if z.any() else 0.0
        re_u = u_mps * diameter_m / nu_m2ps
        e = w - 2.8 * re_u / (re_u + 13) * overtaking * z
        y = y - np.expm1(-1.2 * u_mps / diameter_m * dt) * (over_stokes(reynolds(e)) * e - w - y)
        z = z - np.expm1(-4.5 * u_mps / diameter_m * dt) * (w - z)
        decay_per_s = RATES_PER_S + 0.38 * u_mps / diameter_m
        gained_s = -np.expm1(-decay_per_s * dt) / decay_per_s
        m = np.exp(-decay_per_s * dt)[:, np.newaxis] * m + np.outer(gained_s, dw)
        remembered = WEIGHTS_RPS @ m + (2 * math.sqrt(dt) - WEIGHTS_RPS @ gained_s) * dw
        h = diameter_m / (2 * math.sqrt(math.pi * nu_m2ps)) * remembered
        force_n[k] = -stokes_nspm * (w + y + h) - 0.5 * density_kg_m3 * scene.body.volume_m3 * dw
    return force_n

"""Unsteady drag, implemented directly from its equations: ``haptics.kernels.effects.unsteady_drag`` must equal it.

Written from the law's equations, with exact exponentials for every step, and with the acceleration and the constants
given. It shares no code and no constants with the kernel.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from study_app.haptics.kernels.compiled import workings
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene

RATES_PER_S: Final = np.array([0.0212334, 0.257773, 1.39978, 7.11516, 36.0112, 182.242, 927.902])
WEIGHTS_RPS: Final = np.array([0.33973, 0.52101, 1.09144, 2.44114, 5.48942, 12.3529, 28.26937])


class Constants(NamedTuple):
    """The constants that ``liquid-study cfd --refit`` fits to the fluid solver: c_m, c_y, c_z, c_s, β and R₀."""

    c_m: float
    c_y: float
    c_z: float
    c_s: float
    beta: float
    r_0: float


CONSTANTS: Final = Constants(c_m=0.268, c_y=0.756, c_z=3.15, c_s=0.972, beta=2.96, r_0=11.0)


@workings
def over_stokes(reynolds: float) -> float:
    """Return φ, the steady drag as a multiple of Stokes drag."""
    if reynolds == 0:
        return 1.0
    oseen = 3 / 16 * reynolds / (1 + 0.450 * math.sqrt(reynolds))
    return 1 + oseen + 0.486 / 24 * reynolds / (1 + math.pow(4040 / reynolds, 0.70))


def unsteady_n(
    scene: Scene, w_mps: Floats, acceleration_mps2: Floats, interval_s: Floats, constants: Constants = CONSTANTS
) -> Floats:
    """Return the force (n, 3) [N] in the scene's first liquid, at rest and everywhere.

    Parameters
    ----------
    scene : Scene
        Its first liquid has a viscosity.
    w_mps : Floats
        Velocities (n, 3) [m/s, scene]; the body begins as if it had always moved at the first.
    acceleration_mps2 : Floats
        Their derivatives (n, 3) [m/s²].
    """
    liquid, diameter_m = scene.liquids[0], scene.body.diameter_m
    density_kg_m3, viscosity_pa_s = liquid.density_kg_m3, liquid.viscosity_pa_s or math.nan
    stokes_nspm = 3 * math.pi * viscosity_pa_s * diameter_m
    beyond_w = late_mps(w_mps, acceleration_mps2, interval_s, diameter_m, viscosity_pa_s / density_kg_m3, constants)
    added_kg = 0.5 * density_kg_m3 * scene.body.volume_m3
    return -stokes_nspm * (w_mps + beyond_w) - added_kg * acceleration_mps2


@workings
def late_mps(
    w_mps: Floats, acceleration_mps2: Floats, interval_s: Floats, diameter_m: float, nu_m2ps: float, of: Constants
) -> Floats:
    """Return y + h (n, d) [m/s]: the excess drag and the history over Stokes drag per speed, in d dimensions."""
    found = np.empty_like(w_mps)
    z, s = w_mps[0].copy(), w_mps[0].copy()
    y = (over_stokes(math.sqrt((z**2).sum()) * diameter_m / nu_m2ps) - 1) * z
    m = np.zeros((len(RATES_PER_S), len(z)))
    for k in range(len(w_mps)):
        w, dw, dt = w_mps[k], acceleration_mps2[k], interval_s[k]
        z2, s2 = (z**2).sum(), (s**2).sum()
        u_mps = math.sqrt((w**2).sum() + z2)
        overtaking = min(max(1 - (w * z).sum() / z2, 0.0), 1.0) if z2 > 0 else 0.0
        back = min(max(-(w * s).sum() / s2, 0.0), 1.0) if s2 > 0 else 0.0
        re_u = u_mps * diameter_m / nu_m2ps
        e = w - re_u / (re_u + of.r_0) * (of.beta * overtaking * z + back * s)
        phi = over_stokes(math.sqrt((e**2).sum()) * diameter_m / nu_m2ps)
        y = y - math.expm1(-of.c_y * u_mps / diameter_m * dt) * (phi * e - w - y)
        z = z - math.expm1(-of.c_z * u_mps / diameter_m * dt) * (w - z)
        s = s - math.expm1(-of.c_s * u_mps / diameter_m * dt) * (w - s)
        remembered = 2 * math.sqrt(dt) * dw
        for i in range(len(RATES_PER_S)):
            decay_per_s = RATES_PER_S[i] + of.c_m * u_mps / diameter_m
            gained_s = -math.expm1(-decay_per_s * dt) / decay_per_s
            m[i] = math.exp(-decay_per_s * dt) * m[i] + gained_s * dw
            remembered = remembered + WEIGHTS_RPS[i] * (m[i] - gained_s * dw)
        found[k] = y + diameter_m / (2 * math.sqrt(math.pi * nu_m2ps)) * remembered
    return found

"""Liquids with unsteady drag, motions in them, and measures of their symmetry, energy and tick length."""

import numpy as np

from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import UNBENT, liquid, moving, scene, vectors

FLUIDS = {
    "water": (998.2, 1.0016e-3),
    "olive oil": (913, 0.084),
    "gear oil": (890, 0.35),
    "glycerin": (1261, 1.41),
    "honey": (1420, 10),
    "tar": (1150, 100),
}
ADDED_M3 = 0.5 * np.pi / 6 * 0.068**3


def tank(name, **fields):
    """Return a scene of one liquid with unsteady drag, at scale 1."""
    density_kg_m3, viscosity_pa_s = FLUIDS[name]
    medium = liquid(density_kg_m3, viscosity_pa_s=viscosity_pa_s, effects=("unsteady_drag",))
    return scene(medium.model_copy(update=fields), knee=UNBENT, scale=1.0)


def force(scene_given, velocity_mps, interval_s=1e-3):
    """Return the force (n, 3) along velocities (n, 3)."""
    scene_given = scene_given.model_copy(update={"rate_hz": 1 / float(np.median(interval_s))})
    return vectors(simulate(scene_given, moving(velocity_mps, interval_s)), "force")


def random_motion(seed, ticks=3000, rest=300):
    """Return velocities (n, 3) of strokes, circles and stops that begin at rest, up to about 0.6 m/s."""
    random = np.random.default_rng(seed)
    t_s = np.arange(ticks) / 1000
    waves = [
        random.normal(size=3)[:, None] * np.sin(2 * np.pi * hertz * t_s + random.uniform(0, 6.3, 3)[:, None]) / hertz
        for hertz in random.uniform(0.3, 6, 5)
    ]
    steps = np.repeat(random.integers(0, 2, ticks // rest + 1), rest)[:ticks].astype(float)
    smooth = np.convolve(np.concatenate([np.zeros(100), steps]), np.hanning(101) / np.hanning(101).sum())[1 : ticks + 1]
    smooth[:2] = 0.0
    return 0.3 * random.uniform(0.05, 1) * (sum(waves) * smooth).T


def highest_gain(name, seeds):
    """Return the greatest net work on the hand since rest over ½ m_a v²."""
    highest = 0.0
    for seed in seeds:
        velocity = random_motion(seed)
        mean = (velocity + np.concatenate([np.zeros((1, 3)), velocity[:-1]])) / 2
        work_j = np.cumsum((force(tank(name), velocity) * mean).sum(axis=1) * 1e-3)
        top = (velocity**2).sum(axis=1).max()
        highest = max(highest, work_j.max() / (0.5 * FLUIDS[name][0] * ADDED_M3 * top)) if top > 0 else highest
    return highest

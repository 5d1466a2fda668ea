"""Scenes, motions and forces that tests of identification share."""

import csv
import math

import numpy as np

from study_app.haptics.model import motion as paths
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Body, Liquid, Scene
from study_app.haptics.runtime.offline import simulate

TANK = Scene(
    liquids=(Liquid(id="tank", density_kg_m3=1000, effects=("drag", "wake"), wake=Wake(length=300, scaling=400)),),
    body=Body(drag_coefficient=0.42),
)
OIL = Scene(
    liquids=(
        Liquid(
            id="oil",
            density_kg_m3=1261,
            viscosity_pa_s=1.41,
            effects=("drag", "added_mass", "history"),
            drag=Drag(law="haider-levenspiel"),
        ),
    )
)
BALL = Scene(liquids=(Liquid(id="tank", density_kg_m3=1000),))
REVERSE = paths.programmed_motion("reverse", revolutions=0.8, against_s=0.7, rest_s=0.8)
REACH = paths.programmed_motion("reach", reaches=2, reach_s=0.6, dwell_s=0.3)
SEED = 20240607


def force_of(scene, motion):
    """Return the force (n, 3) along a motion."""
    table = simulate(scene, motion)
    return np.column_stack([table.fx_n, table.fy_n, table.fz_n])


def noisy_force(scene, motion, deviation_n, *, following=0.0, seed=SEED):
    """Return the force (n, 3) with horizontal sensor noise of a given correlation between rows."""
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((len(motion.t_s), 3))
    for k in range(1, len(noise) if following else 0):
        noise[k] = following * noise[k - 1] + math.sqrt(1 - following**2) * noise[k]
    return force_of(scene, motion) + deviation_n * noise * [1, 0, 1]


def some_rows(motion, force_n, rows):
    """Return some rows of a measurement."""
    return Motion(motion.t_s[rows], motion.position_m[rows], velocity_mps=motion.velocity_mps[rows]), force_n[rows]


def write_csv(path, motion, force_n, *, velocities=True, comment=""):
    columns = {
        "fx_n": force_n[:, 0],
        "fy_n": force_n[:, 1],
        "fz_n": force_n[:, 2],
        "t_s": motion.t_s,
        **dict(zip(("x_m", "y_m", "z_m"), motion.position_m.T, strict=True)),
        **(dict(zip(("vx_mps", "vy_mps", "vz_mps"), motion.velocity_mps.T, strict=True)) if velocities else {}),
        "sensor": ["a"] * len(motion.t_s),
    }
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write(comment)
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return path

"""A scene with one effect for each in the registry, as the lab makes it, and a hand's motion through it."""

import sys
from typing import Any

import numpy as np

from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.estimators import ESTIMATORS, Given
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Body, Cylinder, Liquid, MotionBox, Scene
from study_app.haptics.runtime.offline import simulate
from study_app.lab.parameters import with_parameter
from tests.haptics.scenes import UNBENT, vectors

NAMES = [effect.name for effect in EFFECTS]
ESTIMATOR_NAMES = [kind.name for kind in ESTIMATORS if kind.of_device]
SPEED_MPS, ACCELERATION_MPS2 = 0.35, 1.7
BASIN = Liquid(
    id="basin",
    density_kg_m3=1260.0,
    viscosity_pa_s=1.4,
    effects=(),
    region=Cylinder(centre_m=(0.0, -0.5, 0.0), radius_m=0.5, height_m=1.0),
)
EMPTY = Scene(
    scale=1.0,
    knee=UNBENT,
    body=Body(density_kg_m3=800),
    motion=MotionBox(speed_mps=SPEED_MPS, acceleration_mps2=ACCELERATION_MPS2, depth_m=(-0.05, 0.25)),
    liquids=(BASIN,),
)


def in_lab(name: str) -> Scene:
    """Return the scene after the effect is switched on in the lab."""
    return with_parameter(EMPTY, f"effects.{name}", "on")


def with_given_velocity(scene: Scene) -> Scene:
    """Return the scene with velocities as the motion gives them."""
    return scene.model_copy(update={"velocity": Given()})


def wandering(ticks: int = 1500, rate_hz: float = 1000.0) -> Motion:
    """Return a smooth motion that begins at rest, dives through the surface at y = 0 and stays in the basin."""
    t_s = np.arange(ticks) / rate_hz
    turns = np.outer(t_s, [4.0, 5.0, 3.0])
    swell, growth = 1 - np.exp(-((2 * t_s) ** 2)), 8 * t_s * np.exp(-((2 * t_s) ** 2))
    reach_m = np.array([0.05, 0.06, 0.04])
    place = reach_m * np.sin(turns) * swell[:, None] - [0.0, 0.02, 0.0]
    velocity = reach_m * ([4.0, 5.0, 3.0] * np.cos(turns) * swell[:, None] + np.sin(turns) * growth[:, None])
    return Motion(t_s, place, velocity_mps=velocity)


def force_n(scene: Scene, motion: Motion) -> Any:
    """Return the force of the effects (n, 3) [N]."""
    return vectors(simulate(scene, motion), "force")


def all_forces(ticks: int) -> Any:
    """Return what is computed with each effect and with each estimator, (effects + estimators, ticks, 3)."""
    motion = wandering(ticks)
    places = Motion(motion.t_s, motion.position_m)
    estimated = [
        vectors(simulate(with_parameter(EMPTY, "velocity.kind", it), places), "velocity") for it in ESTIMATOR_NAMES
    ]
    return np.array([*(force_n(with_given_velocity(in_lab(name)), motion) for name in NAMES), *estimated])


if __name__ == "__main__":
    np.save(sys.argv[1], all_forces(60))

"""Scenes of the accuracy tests, and the mark of those that measure compiled code."""

import pytest

from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Liquid, MotionBox, Scene
from tests.haptics.scenes import COMPILED

compiled = pytest.mark.skipif(not COMPILED, reason="measures compiled code")

HONEY = Liquid(id="honey", density_kg_m3=1420, viscosity_pa_s=10, effects="auto")
REAL = Scene(scale=3, liquids=(HONEY,), motion=MotionBox(speed_mps=0.6, acceleration_mps2=6))
WATER = Liquid(
    id="water", density_kg_m3=1000, effects=("drag", "wake"), wake=Wake(length=1000, scaling=1000, exponent=0.75)
)
TANK = Scene(scale=10, liquids=(WATER,))


def first_seconds(motion, seconds):
    rows = motion.t_s < seconds
    return Motion(motion.t_s[rows], motion.position_m[rows], velocity_mps=motion.velocity_mps[rows])

"""Motions of a hand with exact velocities, for measuring models along."""

import math
from typing import Final

import numpy as np

from study_app.haptics.model.motion import Floats, Motion
from study_app.lab.identify.measured_force import vectors_x

RADIUS_M: Final = 0.03
TURNS: Final = 1.5
STIRRING_S: Final = 3.0
REST_S: Final = 1.0
STRETCHES: Final = 3


def stir(scale: float, rate_hz: float) -> Motion:
    """Return a stirring hand: 1.5 circles of 30 mm in 3 s, a rest, the same backward, a rest, and forward again.

    Each segment has minimum jerk (Flash & Hogan 1985) with a small vertical motion: up to 0.18 m/s at the hand. In the
    scene, it is ``scale`` times as large.
    """
    each_s = STIRRING_S + REST_S
    t_s = np.arange(round(STRETCHES * each_s * rate_hz) + 1) / rate_hz
    stretch = np.minimum(np.floor(t_s / each_s + 1e-9), STRETCHES - 1)
    phase = np.clip((t_s - stretch * each_s) / STIRRING_S, 0.0, 1.0)
    forth = np.where(stretch % 2 == 0, 1.0, -1.0)
    angle = 2 * math.pi * TURNS * (phase**3 * (10 - 15 * phase + 6 * phase**2) * forth + (forth < 0))
    angular_per_s = 2 * math.pi * TURNS * forth * 30 * phase**2 * (1 - phase) ** 2 / STIRRING_S
    radius_m = scale * RADIUS_M
    position_m = radius_m * np.column_stack([np.cos(angle), 0.1 * np.cos(2 * angle), np.sin(angle)])
    along = radius_m * np.column_stack([-np.sin(angle), -0.2 * np.sin(2 * angle), np.cos(angle)])
    return Motion(t_s, position_m, along * angular_per_s[:, np.newaxis])


def stroke(speed_mps: float, rate_per_s: float, cycles: int, rate_hz: float) -> Motion:
    """Return back-and-forth strokes along x, v = speed · sin ωt with ω = ``rate_per_s``."""
    t_s = np.arange(round(cycles * 2 * math.pi / rate_per_s * rate_hz) + 1) / rate_hz
    way_m = speed_mps / rate_per_s * (1 - np.cos(rate_per_s * t_s))
    return along_x(t_s, way_m, speed_mps * np.sin(rate_per_s * t_s))


def with_velocity(motion: Motion) -> Motion:
    """Return the motion with its velocities; without any, with those of central differences."""
    if motion.velocity_mps is not None or len(motion.t_s) < 2:
        return motion
    return Motion(motion.t_s, motion.position_m, np.gradient(motion.position_m, motion.t_s, axis=0))


def along_x(t_s: Floats, way_m: Floats, velocity_mps: Floats) -> Motion:
    """Return a motion along x."""
    return Motion(t_s, vectors_x(way_m), vectors_x(velocity_mps))


COUNT_M: Final = 38e-6
"""One count of the Falcon's encoders, at the hand [m]."""

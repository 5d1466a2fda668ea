"""Programmed paths for a hand: the motions of the figures (``haptics.model.motion``), scaled to the workspace."""

from typing import Any, Final

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.motion import RADIUS_M, Motion, programmed_motion
from study_app.haptics.model.scene import Scene

_Vector = tuple[float, float, float]

TITLES: Final = {
    "circle": "Three circles, then a stop",
    "reverse": "Circles, then a reversal",
    "line": "Straight line",
    "stop": "Straight line, then a stop",
    "zigzag": "Turns of 90°",
    "reach": "Back-and-forth reaches",
}
REACHED: Final = 0.85  # maximum proportion of the workspace that a path fills
_APPROACH_MPS: Final = 0.08
_SHORTEST_APPROACH_S: Final = 0.5
_REST_S: Final = 2.0
_LEGS: Final = 5
_RATE_HZ: Final = 1000.0
_LEG_SLOPE: Final = 0.7071  # cosine and sine of a leg's angle of 45° to the path


def programmed_path(name: str, scene: Scene, half_m: _Vector) -> Motion:
    """Return a path in the hand frame, centred in a workspace with these half extents [m].

    Its speed in the scene is that of the figures, 1 m/s; its size is that of the figures, or smaller if needed to fit.

    Raises
    ------
    StudyError
        There is no path with this name.
    """
    if name not in TITLES:
        raise StudyError(f"unknown path {name!r}: the known paths are {', '.join(TITLES)}")
    x_m, _, z_m = (REACHED * scene.scale * half for half in half_m)
    radius_m = min(RADIUS_M, x_m, z_m)
    options: dict[str, dict[str, float]] = {
        "circle": {"radius_m": radius_m, "rest_s": _REST_S},
        "reverse": {"radius_m": radius_m, "rest_s": _REST_S},
        "line": {"moving_s": 2 * x_m},
        "stop": {"moving_s": 2 * x_m, "rest_s": _REST_S},
        "zigzag": {"leg_s": min(2 * x_m / (_LEGS * _LEG_SLOPE), 2 * z_m / _LEG_SLOPE), "legs": _LEGS},
        "reach": {"distance_m": min(0.6, 2 * x_m)},
    }
    motion = programmed_motion(name, rate_hz=_RATE_HZ, **options[name])
    path_m = motion.position_m
    if name == "zigzag":  # from left to right instead of away, since a workspace is widest there
        path_m = path_m[:, [2, 1, 0]] * [-1.0, 1.0, 1.0]
    centred_m = path_m - (path_m.max(axis=0) + path_m.min(axis=0)) / 2
    return Motion(motion.t_s, centred_m / scene.scale)


def lead_to_path(motion: Motion, from_m: Any) -> Motion:
    """Return the motion with a smooth path before it, which leads from ``from_m`` (3,) to its first position."""
    distance_m = motion.position_m[0] - np.asarray(from_m, np.float64)
    approach_s = max(float(np.linalg.norm(distance_m)) / _APPROACH_MPS, _SHORTEST_APPROACH_S)
    t_s = np.arange(round(approach_s * _RATE_HZ)) / _RATE_HZ
    proportion = (t_s / approach_s)[:, np.newaxis]
    smooth = proportion**3 * (10 - 15 * proportion + 6 * proportion**2)  # minimum jerk: at rest at both ends
    position_m = np.concatenate([from_m + smooth * distance_m, motion.position_m])
    return Motion(np.concatenate([t_s, motion.t_s + len(t_s) / _RATE_HZ]), position_m)

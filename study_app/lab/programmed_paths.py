"""Programmed paths for a hand: those of the figures (``haptics.model.motion``), scaled to the workspace."""

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
REACHED: Final = 0.85  # share of the workspace that a path may fill
_APPROACH_MPS: Final = 0.08
_SHORTEST_APPROACH_S: Final = 0.5
_REST_S: Final = 2.0
_LEGS: Final = 5
_RATE_HZ: Final = 1000.0
_HALF_TURN: Final = 0.7071  # angle of a leg to either side of the path


def programmed_path(name: str, scene: Scene, half_m: _Vector) -> Motion:
    """Return a path in the hand frame, about the centre of a workspace of these half extents [m].

    Its speed is that of the figures in the scene, 1 m/s; its size is theirs, reduced to fit.

    Raises
    ------
    StudyError
        There is no path with this name.
    """
    if name not in TITLES:
        raise StudyError(f"unknown path {name!r}: the known paths are {', '.join(TITLES)}")
    x_m, _, z_m = (REACHED * scene.scale * half for half in half_m)
    radius_m = min(RADIUS_M, x_m, z_m)
    sized: dict[str, dict[str, float]] = {
        "circle": {"radius_m": radius_m, "rest_s": _REST_S},
        "reverse": {"radius_m": radius_m, "rest_s": _REST_S},
        "line": {"moving_s": 2 * x_m},
        "stop": {"moving_s": 2 * x_m, "rest_s": _REST_S},
        "zigzag": {"leg_s": min(2 * x_m / (_LEGS * _HALF_TURN), 2 * z_m / _HALF_TURN), "legs": _LEGS},
        "reach": {"distance_m": min(0.6, 2 * x_m)},
    }
    course = programmed_motion(name, rate_hz=_RATE_HZ, **sized[name])
    way_m = course.position_m
    if name == "zigzag":  # from left to right instead of away, since a workspace is widest there
        way_m = way_m[:, [2, 1, 0]] * [-1.0, 1.0, 1.0]
    places_m = way_m - (way_m.max(axis=0) + way_m.min(axis=0)) / 2
    return Motion(course.t_s, places_m / scene.scale)


def lead_to_path(motion: Motion, from_m: Any) -> Motion:
    """Return a motion that starts at the hand, (3,) [m], with a smooth path to the motion's first position."""
    way_m = motion.position_m[0] - np.asarray(from_m, np.float64)
    lasts_s = max(float(np.linalg.norm(way_m)) / _APPROACH_MPS, _SHORTEST_APPROACH_S)
    t_s = np.arange(round(lasts_s * _RATE_HZ)) / _RATE_HZ
    share = (t_s / lasts_s)[:, np.newaxis]
    eased = share**3 * (10 - 15 * share + 6 * share**2)
    places_m = np.concatenate([from_m + eased * way_m, motion.position_m])
    return Motion(np.concatenate([t_s, motion.t_s + len(t_s) / _RATE_HZ]), places_m)

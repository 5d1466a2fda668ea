"""Programmed motions for figures, tests and `simulate`: exact places with their ideal velocities.

All are horizontal (y = 0), in the scene frame, start at full speed, and are sampled at ``rate_hz``. At a stop the body
is at its final place and the velocity is exactly zero from that tick on.
"""

import difflib
import math
from collections.abc import Callable

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.motion import Floats, Motion

SPEED_MPS = 1.0
RADIUS_M = 0.265  # three circles at 1 m/s take 5 s: 5000 elements at 1 kHz, the tail of the thesis' figures


def path(name: str, *, rate_hz: float = 1000.0, **parameters: float) -> Motion:
    """Return the programmed motion called ``name``, one of `NAMES`; ``parameters`` are those of its function.

    Raises
    ------
    StudyError
        No such motion.
    """
    if name not in _PATHS:
        near = difflib.get_close_matches(name, NAMES, n=1)
        meant = f"did you mean {near[0]!r}? " if near else ""
        raise StudyError(f"unknown path {name!r}: {meant}there are {', '.join(NAMES)}")
    return _PATHS[name](rate_hz, **parameters)


def circle(
    rate_hz: float,
    *,
    speed_mps: float = SPEED_MPS,
    radius_m: float = RADIUS_M,
    revolutions: float = 3.0,
    rest_s: float = 6.0,
) -> Motion:
    """Three circles, then a stop (Rek 2024, Figs 3 and 4)."""
    moving_s = revolutions * 2 * math.pi * radius_m / speed_mps
    t_s = _times(moving_s + rest_s, rate_hz)
    return _on_circle(t_s, np.minimum(t_s, moving_s) * speed_mps, (t_s < moving_s) * speed_mps, radius_m)


def reverse(
    rate_hz: float,
    *,
    speed_mps: float = SPEED_MPS,
    radius_m: float = RADIUS_M,
    revolutions: float = 3.0,
    against_s: float = 2.0,
    rest_s: float = 6.0,
) -> Motion:
    """Three circles, then 2 s back against the flow, then a stop (Rek 2024, Fig. 5)."""
    turn_s = revolutions * 2 * math.pi * radius_m / speed_mps
    t_s = _times(turn_s + against_s + rest_s, rate_hz)
    forth, back = np.minimum(t_s, turn_s), np.clip(t_s - turn_s, 0.0, against_s)
    sign = np.where(t_s < turn_s, 1.0, np.where(t_s < turn_s + against_s, -1.0, 0.0))
    return _on_circle(t_s, (forth - back) * speed_mps, sign * speed_mps, radius_m)


def line(rate_hz: float, *, speed_mps: float = SPEED_MPS, moving_s: float = 6.0) -> Motion:
    """Straight along x, without a stop (Rek 2024, Figs 7 and 8)."""
    t_s = _times(moving_s, rate_hz)
    return _horizontal(t_s, x=t_s * speed_mps, vx=np.full_like(t_s, speed_mps))


def stop(rate_hz: float, *, speed_mps: float = SPEED_MPS, moving_s: float = 3.0, rest_s: float = 6.0) -> Motion:
    """Straight along x, then a stop."""
    t_s = _times(moving_s + rest_s, rate_hz)
    return _horizontal(t_s, x=np.minimum(t_s, moving_s) * speed_mps, vx=(t_s < moving_s) * speed_mps)


def zigzag(rate_hz: float, *, speed_mps: float = SPEED_MPS, leg_s: float = 0.5, legs: float = 12) -> Motion:
    """Toward −z in legs that alternate by 90°, 45° to either side (Rek 2024, Fig. 6)."""
    t_s = _times(leg_s * legs, rate_hz)
    leg = _count(t_s, leg_s, legs)
    side = np.where(leg % 2 == 0, 1.0, -1.0)
    along = speed_mps * math.sqrt(0.5)
    across = np.where(side > 0, t_s - leg * leg_s, (leg + 1) * leg_s - t_s)
    return _horizontal(t_s, x=along * across, z=-along * t_s, vx=along * side, vz=np.full_like(t_s, -along))


def reach(
    rate_hz: float, *, distance_m: float = 0.6, reach_s: float = 0.8, dwell_s: float = 0.5, reaches: float = 6
) -> Motion:
    """Minimum-jerk back-and-forth reaches along x, with a rest at each end (Flash & Hogan 1985)."""
    t_s = _times((reach_s + dwell_s) * reaches, rate_hz)
    count = _count(t_s, reach_s + dwell_s, reaches)
    phase = np.clip((t_s - count * (reach_s + dwell_s)) / reach_s, 0.0, 1.0)
    way = phase**3 * (10 - 15 * phase + 6 * phase**2)
    pace = 30 * phase**2 * (1 - phase) ** 2 / reach_s
    forth = count % 2 == 0
    return _horizontal(t_s, x=distance_m * np.where(forth, way, 1 - way), vx=distance_m * np.where(forth, pace, -pace))


_PATHS: dict[str, Callable[..., Motion]] = {
    "circle": circle,
    "line": line,
    "stop": stop,
    "zigzag": zigzag,
    "reverse": reverse,
    "reach": reach,
}
NAMES = tuple(_PATHS)


def _times(duration_s: float, rate_hz: float) -> Floats:
    return np.arange(round(duration_s * rate_hz) + 1) / rate_hz


def _count(t_s: Floats, each_s: float, most: float) -> Floats:
    """Return the number of completed intervals of ``each_s``, at most one less than their total."""
    over: Floats = np.floor(t_s / each_s + 1e-9)
    return np.minimum(over, most - 1)


def _on_circle(t_s: Floats, arc_m: Floats, speed_mps: Floats, radius_m: float) -> Motion:
    """Return the motion around the vertical axis that has covered ``arc_m`` at each time."""
    cosine, sine = np.cos(arc_m / radius_m), np.sin(arc_m / radius_m)
    return _horizontal(t_s, x=radius_m * cosine, z=radius_m * sine, vx=-speed_mps * sine, vz=speed_mps * cosine)


def _horizontal(t_s: Floats, *, x: Floats, vx: Floats, z: Floats | None = None, vz: Floats | None = None) -> Motion:
    rest = np.zeros_like(t_s)
    position_m = np.column_stack([x, rest, rest if z is None else z])
    velocity_mps = np.column_stack([vx, rest, rest if vz is None else vz])
    return Motion(t_s, position_m, velocity_mps)

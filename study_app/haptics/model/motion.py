"""Motions and their results as tables, which are read strictly and written exactly and atomically.

Programmed paths are those of the figures.
"""

import difflib
import math
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.errors import Problem, ProtocolError, StudyError
from study_app.text_tables import SHOWN, Line, decimal_sign_of, decoded, number_in, split, wrong_length

Floats: TypeAlias = NDArray[np.floating[Any]]

PLACES = ("t_s", "x_m", "y_m", "z_m")
VELOCITIES = ("vx_mps", "vy_mps", "vz_mps")
_MOST_PROBLEMS = 20

_HEADER = "t_s,x_m,y_m,z_m, one row per tick"


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A motion of the body in the scene frame.

    ``t_s`` (n,) increases; ``position_m`` is (n, 3); ``velocity_mps`` (n, 3) where the velocity is known, else None.

    Raises
    ------
    StudyError
        Shapes differ, numbers are not finite, or times do not increase.
    """

    t_s: Floats
    position_m: Floats
    _: KW_ONLY
    velocity_mps: Floats | None = None

    def __post_init__(self) -> None:
        n = len(self.t_s)
        vectors = [self.position_m] if self.velocity_mps is None else [self.position_m, self.velocity_mps]
        if n == 0 or self.t_s.shape != (n,) or any(vector.shape != (n, 3) for vector in vectors):
            shapes = ", ".join(str(values.shape) for values in (self.t_s, *vectors))
            raise StudyError(
                "a motion must contain times of shape (n,), positions of shape (n, 3) and optionally velocities of "
                f"shape (n, 3), not {shapes}"
            )
        if not all(np.isfinite(values).all() for values in (self.t_s, *vectors)):
            raise StudyError("a motion must contain only finite numbers")
        if not (np.diff(self.t_s) > 0).all():
            raise StudyError(f"time must increase, but does not at row {int(np.argmin(np.diff(self.t_s) > 0)) + 2}")


def read_motion(path: Path) -> Motion:
    """Read ``t_s,x_m,y_m,z_m`` and, if present, ``vx_mps,vy_mps,vz_mps`` (scene frame) from a CSV file.

    Raises
    ------
    ProtocolError
        Lists every bad row by number (1 is the first after the header) and line.
    StudyError
        The file cannot be read.
    """
    try:
        refuse_device(path)
        table = split(decoded(path.read_bytes()), PLACES + VELOCITIES)
    except OSError as error:
        raise StudyError(
            f"cannot read the motion file {path}: {error.strerror}; specify a CSV file with {_HEADER}"
        ) from error
    except ValueError as error:
        raise StudyError(f"cannot read the motion file {path}: {error}; specify a CSV file with {_HEADER}") from error
    header = table.names
    if header not in {PLACES, PLACES + VELOCITIES}:
        permitted = f"the first line must be {','.join(PLACES)}, optionally followed by {','.join(VELOCITIES)}"
        columns = ",".join(header)[:SHOWN] or "nothing"
        raise ProtocolError(str(path), (Problem("header", f"is {columns}; {permitted}", line=1),))
    if not table.lines:
        raise ProtocolError(str(path), (Problem("rows", "there are none", hint="specify at least one"),))
    rows = _numbers(path, table.lines, len(header))
    return Motion(rows[:, 0], rows[:, 1:4], velocity_mps=rows[:, 4:] if len(header) > len(PLACES) else None)


def refuse_device(path: Path) -> None:
    """Refuse to read a device such as ``/dev/zero``, whose data may not end.

    Raises
    ------
    StudyError
        The file is a device.
    OSError
        The system cannot determine its type.
    """
    if path.is_char_device():
        raise StudyError(f"cannot read {path}: it is a device, so reading may never end; specify a CSV file")


def _numbers(path: Path, lines: tuple[Line, ...], columns: int) -> Floats:
    """Return all rows as numbers, or raise an error that lists rows with other text, few fields or decreasing times."""
    problems = []
    rows: list[list[float]] = []
    complete = [line for line in lines if not wrong_length(line.fields, columns)]
    try:
        sign = decimal_sign_of(complete, range(columns))
    except ValueError as error:
        raise StudyError(f"{path}, {error}") from error
    for number, (line, fields) in enumerate(lines, start=1):
        values = [number_in(field, sign) for field in fields[:columns]]
        if wrong := wrong_length(fields, columns):
            problems.append(Problem(f"row {number}", wrong, line=line))
        elif None in values:
            bad = fields[values.index(None)]
            problems.append(Problem(f"row {number}", f"{bad[:SHOWN]!r} is not a finite number", line=line))
        else:
            rows.append([value for value in values if value is not None])
            if len(rows) > 1 and rows[-1][0] <= rows[-2][0]:
                before, now = rows[-2][0], rows[-1][0]
                message = f"t_s must increase, but {now!r} follows {before!r}"
                problems.append(Problem(f"row {number}", message, line=line))
    if len(problems) > _MOST_PROBLEMS:
        more = len(problems) - _MOST_PROBLEMS
        problems = [*problems[:_MOST_PROBLEMS], Problem("rows", f"and {more} more errors like these")]
    if problems:
        raise ProtocolError(str(path), tuple(problems))
    return np.array(rows)


_SPEED_MPS = 1.0
RADIUS_M = 0.265  # three circles at 1 m/s take 5 s: 5000 elements at 1 kHz, the tail of the thesis' figures


def programmed_motion(name: str, *, rate_hz: float = 1000.0, **parameters: float) -> Motion:
    """Return the programmed motion called ``name``, one of `NAMES`; ``parameters`` are those of its function.

    Raises
    ------
    StudyError
        There is no motion with this name.
    """
    if name not in _PATHS:
        near = difflib.get_close_matches(name, NAMES, n=1)
        meant = f"did you mean {near[0]!r}? " if near else ""
        raise StudyError(f"unknown path {name!r}: {meant}the known paths are {', '.join(NAMES)}")
    return _PATHS[name](rate_hz, **parameters)


def circle(
    rate_hz: float,
    *,
    speed_mps: float = _SPEED_MPS,
    radius_m: float = RADIUS_M,
    revolutions: float = 3.0,
    rest_s: float = 6.0,
) -> Motion:
    """Return three circles, then a stop (Rek 2024, Figs 3 and 4)."""
    moving_s = revolutions * 2 * math.pi * radius_m / speed_mps
    t_s = _times(moving_s + rest_s, rate_hz)
    return _circular_motion(t_s, np.minimum(t_s, moving_s) * speed_mps, (t_s < moving_s) * speed_mps, radius_m)


def reverse(
    rate_hz: float,
    *,
    speed_mps: float = _SPEED_MPS,
    radius_m: float = RADIUS_M,
    revolutions: float = 3.0,
    against_s: float = 2.0,
    rest_s: float = 6.0,
) -> Motion:
    """Return three circles, then 2 s back against the flow, then a stop (Rek 2024, Fig. 5)."""
    turn_s = revolutions * 2 * math.pi * radius_m / speed_mps
    t_s = _times(turn_s + against_s + rest_s, rate_hz)
    forth, back = np.minimum(t_s, turn_s), np.clip(t_s - turn_s, 0.0, against_s)
    sign = np.where(t_s < turn_s, 1.0, np.where(t_s < turn_s + against_s, -1.0, 0.0))
    return _circular_motion(t_s, (forth - back) * speed_mps, sign * speed_mps, radius_m)


def line(rate_hz: float, *, speed_mps: float = _SPEED_MPS, moving_s: float = 6.0) -> Motion:
    """Return a straight motion along x without a stop (Rek 2024, Figs 7 and 8)."""
    t_s = _times(moving_s, rate_hz)
    return _horizontal(t_s, x=t_s * speed_mps, vx=np.full_like(t_s, speed_mps))


def stop(rate_hz: float, *, speed_mps: float = _SPEED_MPS, moving_s: float = 3.0, rest_s: float = 6.0) -> Motion:
    """Return a straight motion along x, then a stop."""
    t_s = _times(moving_s + rest_s, rate_hz)
    return _horizontal(t_s, x=np.minimum(t_s, moving_s) * speed_mps, vx=(t_s < moving_s) * speed_mps)


def zigzag(rate_hz: float, *, speed_mps: float = _SPEED_MPS, leg_s: float = 0.5, legs: float = 12) -> Motion:
    """Return a motion towards −z in straight legs at ±45°, with 90° turns (Rek 2024, Fig. 6)."""
    t_s = _times(leg_s * legs, rate_hz)
    leg = _count(t_s, leg_s, legs)
    side = np.where(leg % 2 == 0, 1.0, -1.0)
    along = speed_mps * math.sqrt(0.5)
    across = np.where(side > 0, t_s - leg * leg_s, (leg + 1) * leg_s - t_s)
    return _horizontal(t_s, x=along * across, z=-along * t_s, vx=along * side, vz=np.full_like(t_s, -along))


def reach(
    rate_hz: float, *, distance_m: float = 0.6, reach_s: float = 0.8, dwell_s: float = 0.5, reaches: float = 6
) -> Motion:
    """Return minimum-jerk back-and-forth reaches along x, with a rest at each end (Flash & Hogan 1985)."""
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


def _circular_motion(t_s: Floats, arc_m: Floats, speed_mps: Floats, radius_m: float) -> Motion:
    """Return the motion around the vertical axis that has covered ``arc_m`` at each time."""
    cosine, sine = np.cos(arc_m / radius_m), np.sin(arc_m / radius_m)
    return _horizontal(t_s, x=radius_m * cosine, z=radius_m * sine, vx=-speed_mps * sine, vz=speed_mps * cosine)


def _horizontal(t_s: Floats, *, x: Floats, vx: Floats, z: Floats | None = None, vz: Floats | None = None) -> Motion:
    rest = np.zeros_like(t_s)
    position_m = np.column_stack([x, rest, rest if z is None else z])
    velocity_mps = np.column_stack([vx, rest, rest if vz is None else vz])
    return Motion(t_s, position_m, velocity_mps=velocity_mps)

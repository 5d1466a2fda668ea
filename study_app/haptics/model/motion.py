"""Motions and their results as tables, which are read strictly and written exactly and atomically."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.errors import Problem, ProtocolError, StudyError

Floats: TypeAlias = NDArray[np.floating[Any]]

PLACES = ("t_s", "x_m", "y_m", "z_m")
VELOCITIES = ("vx_mps", "vy_mps", "vz_mps")
MOST_PROBLEMS = 20
SHOWN = 200  # characters of a bad value shown in messages

HEADER = "t_s,x_m,y_m,z_m, one row per tick"


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A motion of the body in the scene frame.

    ``t_s`` (n,) increases; ``position_m`` is (n, 3); ``velocity_mps`` (n, 3) where the velocity is known, else None.

    Raises
    ------
    StudyError
        Other shapes, numbers that are not finite, or times that do not increase.
    """

    t_s: Floats
    position_m: Floats
    velocity_mps: Floats | None = None

    def __post_init__(self) -> None:
        n = len(self.t_s)
        vectors = [self.position_m] if self.velocity_mps is None else [self.position_m, self.velocity_mps]
        if n == 0 or self.t_s.shape != (n,) or any(vector.shape != (n, 3) for vector in vectors):
            shapes = ", ".join(str(values.shape) for values in (self.t_s, *vectors))
            raise StudyError(f"a motion is times (n,), positions (n, 3) and perhaps velocities (n, 3), not {shapes}")
        if not all(np.isfinite(values).all() for values in (self.t_s, *vectors)):
            raise StudyError("a motion contains only finite numbers")
        if not (np.diff(self.t_s) > 0).all():
            raise StudyError(f"time must increase, but does not at row {int(np.argmin(np.diff(self.t_s) > 0)) + 2}")


def read(path: Path) -> Motion:
    """Read ``t_s,x_m,y_m,z_m`` and perhaps ``vx_mps,vy_mps,vz_mps`` (scene frame) from a CSV file.

    Raises
    ------
    ProtocolError
        Lists every bad row by number (1 is the first after the header) and line.
    StudyError
        The file cannot be read.
    """
    try:
        refuse_device(path)
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = list(csv.reader(file, strict=True))
    except OSError as error:
        raise StudyError(f"cannot read the motion {path}: {error.strerror}; name a CSV file of {HEADER}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise StudyError(f"cannot read the motion {path}: it is not a CSV text; name a CSV file of {HEADER}") from error
    while lines and not lines[-1]:
        lines.pop()
    header = tuple(lines[0]) if lines else ()
    if header not in {PLACES, PLACES + VELOCITIES}:
        permitted = f"the first line must be {','.join(PLACES)}, or that and {','.join(VELOCITIES)}"
        found = ",".join(header)[:SHOWN] or "nothing"
        raise ProtocolError(str(path), (Problem("header", f"is {found}; {permitted}", line=1),))
    if len(lines) == 1:
        raise ProtocolError(str(path), (Problem("rows", "there are none", hint="give at least one"),))
    rows = _numbers(path, lines[1:], len(header))
    return Motion(rows[:, 0], rows[:, 1:4], rows[:, 4:] if len(header) > len(PLACES) else None)


def refuse_device(path: Path) -> None:
    """Refuse to read a device such as ``/dev/zero``, whose data may not end.

    Raises
    ------
    StudyError
        It is one.
    OSError
        The system cannot say what it is.
    """
    if path.is_char_device():
        raise StudyError(f"cannot read {path}: it is a device, which may have no end; name a CSV file")


def _numbers(path: Path, lines: list[list[str]], columns: int) -> Floats:
    """Return all rows as numbers, or raise an error that lists rows with other text, few fields or decreasing times."""
    problems = []
    rows: list[list[float]] = []
    for number, fields in enumerate(lines, start=1):
        values = [_number(field) for field in fields]
        if len(fields) != columns:
            problems.append(Problem(f"row {number}", f"has {len(fields)} fields, not {columns}", line=number + 1))
        elif None in values:
            bad = fields[values.index(None)]
            problems.append(Problem(f"row {number}", f"{bad[:SHOWN]!r} is not a finite number", line=number + 1))
        else:
            rows.append([value for value in values if value is not None])
            if len(rows) > 1 and rows[-1][0] <= rows[-2][0]:
                before, now = rows[-2][0], rows[-1][0]
                message = f"t_s must increase, but {now!r} follows {before!r}"
                problems.append(Problem(f"row {number}", message, line=number + 1))
    if len(problems) > MOST_PROBLEMS:
        more = len(problems) - MOST_PROBLEMS
        problems = [*problems[:MOST_PROBLEMS], Problem("rows", f"{more} more such errors")]
    if problems:
        raise ProtocolError(str(path), tuple(problems))
    return np.array(rows)


def _number(field: str) -> float | None:
    """Return the finite number a field holds, or None."""
    if "_" in field:
        return None
    try:
        value = float(field)
    except ValueError:
        return None
    return value if math.isfinite(value) else None

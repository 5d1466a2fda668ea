"""Reads a measured motion and force, or a flow curve, from a file, and prepares the motion for `simulate`."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.signal import savgol_filter

from study_app.errors import StudyError
from study_app.haptics.model.motion import PLACES, VELOCITIES, Floats, Motion, refuse_device
from study_app.text_tables import decoded, rows_of, split

_FORCES: Final = ("fx_n", "fy_n", "fz_n")
_ALONG_A_LINE: Final = ("t_s", "velocity_mps", "force_n")
FLOW_CURVE: Final = ("shear_rate_per_s", "shear_stress_pa")
_COLUMNS: Final = (PLACES + _FORCES, _ALONG_A_LINE, FLOW_CURVE)
_MAX_GAP_S: Final = 0.05
_SMOOTHED_S: Final = 0.025
_HEADER: Final = (
    f"{','.join(PLACES + _FORCES)}, with {','.join(VELOCITIES)} if they are known, or {','.join(_ALONG_A_LINE)} "
    f"for a motion along one line, or {','.join(FLOW_CURVE)} from a rheometer"
)


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredForce:
    """A motion of n rows in the scene frame, and the measured force (n, 3) [N] of the liquid on the body."""

    motion: Motion
    force_n: Floats

    def __post_init__(self) -> None:
        if self.force_n.shape != (len(self.motion.t_s), 3) or not np.isfinite(self.force_n).all():
            raise StudyError(f"a measured force must be finite and have the shape (n, 3), not {self.force_n.shape}")


@dataclass(frozen=True, slots=True, eq=False)
class FlowCurve:
    """Shear rates (n,) [1/s] and stresses (n,) [Pa] in steady shear, as measured by a rheometer."""

    rate_per_s: Floats
    stress_pa: Floats

    def __post_init__(self) -> None:
        for name, values in zip(FLOW_CURVE, (self.rate_per_s, self.stress_pa), strict=True):
            if values.min() <= 0:
                row = int(values.argmin()) + 1
                raise StudyError(f"row {row} has {name} {values.min():g}: it must be above 0; remove the row")

    def ordered(self) -> "FlowCurve":
        """Return the same rows sorted by shear rate, then by stress."""
        order = np.lexsort((self.stress_pa, self.rate_per_s))
        return FlowCurve(self.rate_per_s[order], self.stress_pa[order])

    def branches(self) -> "Branches | None":
        """Return two branches, each sorted by shear rate; None if the curve does not have two.

        If most rates were measured repeatedly, the branches are the smallest and the largest stresses at these rates.
        Otherwise they are the rows with rising and with falling rates, if the rates change direction exactly once.
        """
        rates, counts = np.unique(self.rate_per_s, return_counts=True)
        repeated = rates[counts > 1]
        if len(repeated) > len(rates) / 2:
            stresses = [self.stress_pa[self.rate_per_s == rate] for rate in repeated]
            smallest, largest = (np.array([end(values) for values in stresses]) for end in (np.min, np.max))
            description = "the largest and smallest stresses at repeated shear rates"
            return Branches(description=description, first=(repeated, largest), second=(repeated, smallest))
        turns = np.flatnonzero(np.diff(np.sign(np.diff(self.rate_per_s))))
        if len(turns) != 1:
            return None
        before, after = self._sort_by_rate(slice(turns[0] + 2)), self._sort_by_rate(slice(turns[0] + 1, None))
        return Branches(description="the stresses at rising and falling shear rates", first=before, second=after)

    def _sort_by_rate(self, rows: slice) -> tuple[Floats, Floats]:
        order = np.argsort(self.rate_per_s[rows])
        return self.rate_per_s[rows][order], self.stress_pa[rows][order]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Branches:
    """Two branches of a flow curve: increasing shear rates, and their stresses; ``description`` names both branches."""

    description: str
    first: tuple[Floats, Floats]
    second: tuple[Floats, Floats]


def read_measurement(path: Path) -> MeasuredForce | FlowCurve:
    """Read a table (`text_tables`) with the columns of `_HEADER` in any order; other columns are ignored.

    Lines that begin with # are ignored. A motion that is given by its velocity along a line is along x; its positions
    are integrated.

    Raises
    ------
    StudyError
        The file cannot be read or is invalid; the message is one line with the first error.
    """
    try:
        refuse_device(path)
        table = split(decoded(path.read_bytes()), {name for names in _COLUMNS for name in names}, comment="#")
    except OSError as error:
        raise StudyError(f"cannot read {path}: {error.strerror}; specify a CSV file with {_HEADER}") from error
    except ValueError as error:
        raise StudyError(f"cannot read {path}: {error}; specify a CSV file with {_HEADER}") from error
    names = max(_COLUMNS, key=lambda names: len({*names} & {*table.names}) / len(names))
    if names == PLACES + _FORCES and {*VELOCITIES} <= {*table.names}:
        names += VELOCITIES
    if missing := [name for name in names if name not in table.names]:
        columns = f"the column{'s' * (len(missing) > 1)} {', '.join(missing)}"
        raise StudyError(f"{path} does not have {columns}: the first line must contain {_HEADER}")
    if repeated := [name for name in names if table.names.count(name) > 1]:
        raise StudyError(f"{path} has two columns named {repeated[0]}: remove one of them")
    if not table.lines:
        raise StudyError(f"{path} has a header but no rows: add one row for each sample")
    try:
        rows = rows_of(table, [table.names.index(name) for name in names])
    except ValueError as error:
        raise StudyError(f"{path}, {error}") from error
    try:
        return _parse_measurement(np.array(rows), names)
    except StudyError as error:
        raise StudyError(f"{path}: {error}") from error


def _parse_measurement(rows: Floats, names: tuple[str, ...]) -> MeasuredForce | FlowCurve:
    if names == FLOW_CURVE:
        return FlowCurve(rows[:, 0], rows[:, 1])
    if names == _ALONG_A_LINE:
        return along_a_line(rows[:, 0], rows[:, 1], rows[:, 2])
    velocity_mps = rows[:, 7:] if len(names) > len(PLACES + _FORCES) else None
    return MeasuredForce(Motion(rows[:, 0], rows[:, 1:4], velocity_mps=velocity_mps), rows[:, 4:7])


def vectors_x(values: Floats) -> Floats:
    """Return vectors (n, 3) along x."""
    zero = np.zeros_like(values)
    return np.column_stack([values, zero, zero])


def along_a_line(t_s: Floats, velocity_mps: Floats, force_n: Floats) -> MeasuredForce:
    """Return a motion along x from its velocities (n,), and the force (n,) along x."""
    path_m = np.concatenate([[0.0], np.cumsum((velocity_mps[1:] + velocity_mps[:-1]) / 2 * np.diff(t_s))])
    return MeasuredForce(Motion(t_s, vectors_x(path_m), velocity_mps=vectors_x(velocity_mps)), vectors_x(force_n))


def with_centred_velocity(motion: Motion) -> Motion:
    """Return the motion with velocities (n, 3), the slopes of parabolas fitted to the positions within ±12.5 ms.

    These velocities have no lag, since a measured force depends on the motion itself and not on a device's filter. A
    motion with velocities is returned unchanged. [choice] 25 ms is a tenth of the period of the fastest strokes, 4 Hz.

    Raises
    ------
    StudyError
        There are too few rows, or they are too far apart.
    """
    if motion.velocity_mps is not None:
        return motion
    step_s = float(np.median(np.diff(motion.t_s))) if len(motion.t_s) > 1 else _MAX_GAP_S
    even = at_rate(motion, 1 / step_s)
    rows = 2 * max(math.floor(_SMOOTHED_S / 2 / step_s), 1) + 1
    if len(even.t_s) < rows:
        raise StudyError(
            f"{len(motion.t_s)} rows are too few to estimate velocities: record at least {_SMOOTHED_S:g} s of motion"
        )
    slopes = savgol_filter(even.position_m, rows, 2, deriv=1, delta=step_s, axis=0)
    velocity_mps = np.column_stack([np.interp(motion.t_s, even.t_s, column) for column in slopes.T])
    return Motion(motion.t_s, motion.position_m, velocity_mps=velocity_mps)


def at_rate(motion: Motion, rate_hz: float) -> Motion:
    """Return the motion with a row for every tick; unchanged if its steps differ from a tick by less than half.

    Other measurements are interpolated by cubic splines: linear interpolation would delay the acceleration by half of
    a measured step.

    Raises
    ------
    StudyError
        Two rows are too far apart to interpolate between them.
    """
    step_s = np.diff(motion.t_s)
    if len(step_s) == 0:
        raise StudyError("one row is not enough: record at least 20 rows per second")
    if step_s.max() > _MAX_GAP_S:
        row, gap_s = int(step_s.argmax()) + 2, float(step_s.max())
        raise StudyError(f"row {row} is {gap_s:.3g} s after the previous row; at most {_MAX_GAP_S:g} s is permitted")
    tick_s = 1 / rate_hz
    if abs(step_s.mean() / tick_s - 1) < 0.01 and (np.abs(step_s / tick_s - 1) < 0.5).all():
        return motion
    ticks = math.floor((motion.t_s[-1] - motion.t_s[0]) * rate_hz + 1e-6)
    t_s = motion.t_s[0] + np.arange(ticks + 1) * tick_s
    if motion.velocity_mps is None:
        return Motion(t_s, CubicSpline(motion.t_s, motion.position_m)(t_s))
    position = CubicHermiteSpline(motion.t_s, motion.position_m, motion.velocity_mps)
    return Motion(t_s, position(t_s), velocity_mps=CubicSpline(motion.t_s, motion.velocity_mps)(t_s))

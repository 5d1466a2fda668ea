"""The constants of unsteady drag by least squares over solved motions, and the errors of motions left out of the fit.

The equations of the law are fitted along motions whose speed and acceleration are known exactly, so that the constants
do not include the delay of a tick or of a velocity estimator.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from study_app.errors import StudyError
from study_app.evidence.cfd.fits import MODELS, evaluate_fit
from study_app.evidence.cfd.stored_flows import LEFT_OUT, LEFT_OUT_FILE
from study_app.evidence.cfd.stored_flows import Table as SolvedTable
from study_app.evidence.reference_model import CONSTANTS, Constants, late_mps
from study_app.evidence.table import Evidence, Table
from study_app.haptics.model.motion import Floats

STEP: Final = 0.005
"""Interval between the rows that are compared [D/U]."""
_INITIAL_CONSTANTS: Final = Constants(c_m=0.5, c_y=1.0, c_z=2.0, c_s=1.0, beta=1.0, r_0=5.0)
"""Initial values of the search: orders of magnitude."""


@dataclass(frozen=True, eq=False, kw_only=True)
class _MotionError:
    """Relative RMS error and relative greatest error of one motion.

    ``fitted`` is with the constants fitted to all motions (None for a motion that is held out), ``left_out`` with those
    fitted to all motions except the ``others``, and ``program`` with the program's own constants in its tick at 1 kHz.
    Each is (RMS, greatest).
    """

    table: SolvedTable
    others: Constants
    fitted: tuple[float, float] | None
    left_out: tuple[float, float]
    program: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Refit:
    """The constants fitted to all motions, and the errors of each motion."""

    constants: Constants
    errors: tuple[_MotionError, ...]


class _SolvedMotion:
    """One solved motion at even times, in the units of its liquid."""

    def __init__(self, table: SolvedTable) -> None:
        case = table.case
        t = np.arange(0.0, case.profile.end, STEP)
        self._case = case
        self._w_mps = case.profile.speed(t)[:, np.newaxis] * case.speed_mps
        self._dw_mps2 = case.profile.acceleration(t)[:, np.newaxis] * (case.speed_mps / case.unit_s)
        self._interval_s = np.full(len(t), STEP * case.unit_s)
        t_s, _, force_n = table.columns.values()
        self._force_n = np.interp(t * case.unit_s, t_s, force_n)
        stokes_nspm = 3 * math.pi * case.viscosity_pa_s * case.diameter_m
        added_kg = case.density_kg_m3 * math.pi / 12 * case.diameter_m**3
        self._stokes_nspm = stokes_nspm
        self._prompt_n = -stokes_nspm * self._w_mps[:, 0] - added_kg * self._dw_mps2[:, 0]

    def residuals(self, constants: Constants) -> Floats:
        """Return the scaled errors (n,), whose sum of squares is the square of the relative RMS error."""
        residuals: Floats = self._error_n(constants) / np.linalg.norm(self._force_n)
        return residuals

    def errors(self, constants: Constants) -> tuple[float, float]:
        """Return the RMS and the greatest error, relative to the RMS and the greatest force."""
        error_n = self._error_n(constants)
        proportion = float(np.linalg.norm(error_n) / np.linalg.norm(self._force_n))
        return proportion, float(np.abs(error_n).max() / np.abs(self._force_n).max())

    def _error_n(self, constants: Constants) -> Floats:
        case = self._case
        nu_m2ps = case.viscosity_pa_s / case.density_kg_m3
        late = late_mps(self._w_mps, self._dw_mps2, self._interval_s, case.diameter_m, nu_m2ps, constants)
        error_n: Floats = self._prompt_n - self._stokes_nspm * late[:, 0] - self._force_n
        return error_n


def refit_law(
    tables: Sequence[SolvedTable],
    held_out: Sequence[SolvedTable] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Refit:
    """Return the constants fitted to all tables with equal weight, and the error of each table when it is left out.

    The errors of the tables that are ``held_out`` come last.

    Raises
    ------
    StudyError
        There are fewer than two tables, or a search does not end.
    """
    if len(tables) < 2:
        raise StudyError(f"{len(tables)} solved motion(s): leave-one-out fitting needs at least two")
    solved = [_SolvedMotion(table) for table in tables]
    progress(f"fitting the constants to {len(tables)} motions ...")
    constants = fit_constants(tables)
    errors = []
    for table, left_out in zip(tables, solved, strict=True):
        progress(f"... without {table.case.liquid_id}, {table.notes['title']} ...")
        others = _fit_constants([motion for motion in solved if motion is not left_out], constants)
        errors.append(
            _MotionError(
                table=table,
                others=others,
                fitted=left_out.errors(constants),
                left_out=left_out.errors(others),
                program=_tick_errors(table),
            )
        )
    errors += [
        _MotionError(
            table=table,
            others=constants,
            fitted=None,
            left_out=_SolvedMotion(table).errors(constants),
            program=_tick_errors(table),
        )
        for table in held_out
    ]
    return Refit(constants, tuple(errors))


def _tick_errors(table: SolvedTable) -> tuple[float, float]:
    """Return the errors of the program's tick."""
    (program,) = [model for model in MODELS if model.effects == ("unsteady_drag",)]
    fitted = evaluate_fit(program, table, {})
    return fitted.share, fitted.worst_n / float(np.abs(table.columns["force_n"]).max())


def fit_constants(tables: Sequence[SolvedTable]) -> Constants:
    """Return the constants fitted to all tables with equal weight."""
    return _fit_constants([_SolvedMotion(table) for table in tables], _INITIAL_CONSTANTS)


def _fit_constants(solved: Sequence[_SolvedMotion], begin: Constants) -> Constants:
    """Return the best-fitting constants; the search uses their logarithms, so that they stay positive."""

    def residuals(logs: Floats) -> Floats:
        constants = Constants._make(np.exp(logs).tolist())
        return np.concatenate([motion.residuals(constants) for motion in solved])

    solution = least_squares(residuals, np.log(begin), diff_step=1e-4, xtol=1e-6, ftol=1e-9)
    if not solution.success:
        raise StudyError(f"the fit of the constants failed: {solution.message}")
    return Constants._make(np.exp(solution.x).tolist())


def law_fit_evidence(found: Refit) -> Evidence:
    """Return constants and errors as Markdown, and the constants fitted without each motion as CSV."""
    values = zip(Constants._fields, found.constants, CONSTANTS, strict=True)
    constants = [(name, f"{fitted:.3g}", f"{own:g}") for name, fitted, own in values]
    motions = []
    for it in sorted(found.errors, key=lambda error: error.table.case.reynolds):
        errors = (it.fitted, it.left_out, it.program)
        proportions = ["held out" if error is None else f"{error[0]:.1%} ({error[1]:.1%})" for error in errors]
        case = it.table.case
        motions.append((case.title, case.liquid_id, f"{case.reynolds:.3g}", *proportions))
    headings = ("motion", "liquid", "Re", "fitted to all", "left out of the fit", "program, 1 kHz")
    text = (
        f"{Table(('constant', 'fitted', 'in the program'), constants, left=1).markdown()}\n\n"
        "RMS error as a proportion of the RMS force (largest error as a proportion of the largest force)\n\n"
        f"{Table(headings, motions, left=2).markdown()}\n"
    )
    rows = [[it.table.case.name, *(f"{value:.6g}" for value in it.others)] for it in found.errors if it.fitted]
    return Evidence(text, {LEFT_OUT_FILE: Table(LEFT_OUT, rows).csv(), "refit.md": text})

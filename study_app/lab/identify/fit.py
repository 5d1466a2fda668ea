"""Fits of a liquid's parameters by least squares, to a measured motion and force or to a rheometer's flow curve.

For a force, the sum of (measured − simulated force)² over rows and axes is minimised; the simulation uses the tick of
the servo. For a flow curve, it is the sum of (fitted/measured stress − 1)², since curves span decades and a rheometer's
error is relative to the stress. Values stay in the ranges that the scene's models permit (``search``); ``estimates``
computes confidence intervals and warnings.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.laws import stress_pa
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Scene
from study_app.lab.identify.estimates import Estimates, estimate
from study_app.lab.identify.measured_force import FlowCurve, MeasuredForce, vectors_x
from study_app.lab.identify.parameters import Parameter, find_parameters
from study_app.lab.identify.search import ForceProblem, Problem, solve

_MAX_AUTOCORRELATION: Final = 0.1
_POOR_SHARE: Final = 0.5  # residual relative to the force above which the opposite sign is tried
_CLEARLY_BETTER: Final = 0.9
_DRIVING_CORRELATION: Final = 0.1  # noise of 10,000 rows correlates with velocity by 0.01
_MIN_EXPLAINED: Final = 0.25
_MAX_HAND_MPS: Final = 10.0
"""The fastest motion of a hand. [choice] Throws reach 10 m/s."""
_MAX_FORCE_N: Final = 1000.0
"""The largest force that a hand can exert. [choice]"""
_CHANCE_DEVIATIONS: Final = 5.0
"""Residuals count as correlated if their correlation exceeds this many standard deviations of that of noise."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Fit(Estimates):
    """The result of a fit to a force.

    ``measured_n``, ``fitted_n`` and ``residual_n`` (measured − fitted) have the shape (n, 3), at the measured times;
    ``axes`` are those in which a force is not zero.
    """

    motion: Motion
    measured_n: Floats
    fitted_n: Floats
    axes: tuple[int, ...]

    @property
    def residual_n(self) -> Floats:
        residual_n: Floats = self.measured_n - self.fitted_n
        return residual_n

    @property
    def rms_n(self) -> float:
        """The RMS length of the residual vector [N]."""
        return _rms(self.residual_n)

    @property
    def share(self) -> float:
        """``rms_n`` relative to the RMS of the measured force."""
        return self.rms_n / _rms(self.measured_n)

    @property
    def explained(self) -> float:
        """The proportion of the measured force's mean square that the fitted law explains, at least 0."""
        return max(1 - self.share**2, 0.0)

    def summary(self) -> str:
        lasted_s = self.motion.t_s[-1] - self.motion.t_s[0]
        residual = f"residual {self.rms_n:.3g} N RMS, {100 * self.share:.1f} % of the force"
        law = f"the law explains {100 * self.explained:.1f} % of the mean squared force"
        return f"{len(self.motion.t_s)} rows over {lasted_s:.3g} s; {residual}; {law}"


def fit(scene: Scene, liquid_id: str, names: Sequence[str], motion: Motion, force_n: Floats) -> Fit:
    """Return the values of the parameters ``names`` for which `simulate` is closest to a measured force.

    ``force_n`` is the liquid's force on the body, (n, 3) or along x (n,), at the times of the motion, whose rate may
    differ from the scene's. Velocities of the motion are used if it has them, else those of the scene's estimator. The
    search begins at the scene's values; ``effects = "auto"`` selects the effects for these values.

    Raises
    ------
    StudyError
        There is no such liquid or parameter, or there are too few measurements.
    """
    measured = MeasuredForce(motion, vectors_x(force_n) if force_n.ndim == 1 else force_n)
    scene = resolve(scene)
    problem = ForceProblem(scene, liquid_id, find_parameters(scene, liquid_id, names), measured)
    z, fields = estimate(problem, liquid_id, names, float(np.linalg.norm(measured.force_n)))
    fitted_n = problem.force_n(z)
    residual_n = (measured.force_n - fitted_n)[:, problem.axes]
    fields["warnings"] += (
        *_quantity_warnings(measured, problem.axes, scene.scale),
        *_sign_warnings(problem, _rms(residual_n)),
        *_residual_warnings(residual_n, fields["autocorrelation"], measured.force_n),
    )
    return Fit(**fields, motion=motion, measured_n=measured.force_n, fitted_n=fitted_n, axes=problem.axes)


def _quantity_warnings(measured: MeasuredForce, axes: Sequence[int], scale: float) -> Iterator[str]:
    """Yield warnings if the measured values cannot be the force of a liquid at rest on this body.

    Apart from a constant part, such a force takes energy from the body and depends on its velocity and acceleration.
    """
    t_s, force_n = measured.motion.t_s, measured.force_n
    velocity_mps = measured.motion.velocity_mps
    if velocity_mps is None:
        velocity_mps = np.gradient(measured.motion.position_m, t_s, axis=0)
    speed_mps = float(np.linalg.norm(velocity_mps, axis=1).max()) / scale
    if speed_mps > _MAX_HAND_MPS:
        yield (
            f"the body moves at up to {speed_mps:.3g} m/s, faster than a hand can move it: specify positions in metres "
            "and times in seconds"
        )
    largest_n = float(np.linalg.norm(force_n, axis=1).max())
    if largest_n > _MAX_FORCE_N:
        yield f"the largest force is {largest_n:.3g} N, more than a hand can exert: specify forces in newtons"
    varying_n = force_n - force_n.mean(axis=0)
    size = np.linalg.norm(varying_n) * np.linalg.norm(velocity_mps)
    along = float(np.sum(varying_n * velocity_mps)) / size if size else 0.0
    if along > _DRIVING_CORRELATION:
        yield (
            f"the measured forces accelerate the body (their correlation with its velocity is {along:.2f}), but a "
            "liquid at rest slows it down: specify the liquid's force on the body, not the body's force on the liquid"
        )
    residual_n2 = 0.0
    for axis in axes:
        v_mps = velocity_mps[:, axis]
        law = np.column_stack([v_mps, np.abs(v_mps) * v_mps, np.gradient(v_mps, t_s), np.ones_like(v_mps)])
        residual_n2 += float(np.sum((force_n[:, axis] - law @ np.linalg.lstsq(law, force_n[:, axis])[0]) ** 2))
    explained = 1 - residual_n2 / float(np.sum(force_n**2))
    if explained < _MIN_EXPLAINED:
        yield (
            f"velocity and acceleration explain only {100 * explained:.0f} % of the measured values: they may not be "
            "the force on this body, or their times may not match the motion"
        )


def _sign_warnings(problem: ForceProblem, rms_n: float) -> Iterator[str]:
    """Yield a warning if the fit to the force is poor, and clearly better with the opposite sign of the force."""
    measured = problem.measured
    size_n = _rms(measured.force_n)
    if rms_n < _POOR_SHARE * size_n:
        return
    mirrored = problem.with_force(-measured.force_n)
    z, _ = solve(mirrored)
    reversed_n = _rms(measured.force_n + mirrored.force_n(z))
    if reversed_n < _CLEARLY_BETTER * rms_n:
        yield (
            f"with the opposite sign of the force, the residual would be {100 * reversed_n / size_n:.0f} % of the "
            f"force instead of {100 * rms_n / size_n:.0f} %: check the sign of the force columns"
        )


def _residual_warnings(residual_n: Floats, rho: float, force_n: Floats) -> Iterator[str]:
    """Yield a warning if residuals are correlated, which indicates a model error, since noise is uncorrelated."""
    if rho > max(_MAX_AUTOCORRELATION, _CHANCE_DEVIATIONS / math.sqrt(residual_n.size)):
        proportion = _rms(residual_n) / _rms(force_n)
        yield (
            f"the residuals ({100 * proportion:.1f} % of the force) are autocorrelated (lag-1 correlation {rho:.3f}): "
            "the model is incomplete, the sensor filters the force, or velocities computed from positions blur sharp "
            "turns; the intervals have been widened to allow for this, but they are valid only if the model is valid"
        )


def _rms(vectors_n: Floats) -> float:
    return math.sqrt(float(np.mean(np.sum(vectors_n**2, axis=1))))


CURVE_TABLE: Final = "non_newtonian"
_MIN_BRANCH_ROWS: Final = 6
_MIN_GAP_RATIO: Final = 5.0
"""Minimum ratio of the gap between branches to its noise. [choice] See `test_noise_makes_no_branches`."""
_MIN_GAP: Final = 0.01


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CurveFit(Estimates):
    """The result of a fit to a flow curve: ``fitted_pa`` (n,) at the measured shear rates."""

    curve: FlowCurve
    fitted_pa: Floats

    @property
    def share(self) -> float:
        """The RMS of the residuals, each relative to the measured stress."""
        return float(np.sqrt(np.mean((self.fitted_pa / self.curve.stress_pa - 1) ** 2)))

    def summary(self) -> str:
        rates = self.curve.rate_per_s
        measured = f"{len(rates)} shear rates from {rates.min():.3g} to {rates.max():.3g} per s"
        return f"{measured}; residual {100 * self.share:.1f} % of the stress (RMS)"


def fit_curve(scene: Scene, liquid_id: str, names: Sequence[str], curve: FlowCurve) -> CurveFit:
    """Return the values of the parameters ``names`` for which a flow curve is closest to a measured one.

    Raises
    ------
    StudyError
        There is no such liquid or flow-curve parameter, or there are too few measurements.
    """
    scene = resolve(scene)
    parameters = find_parameters(scene, liquid_id, names)
    for parameter in parameters:
        if parameter.table != CURVE_TABLE:
            raise StudyError(
                f"{parameter.name} does not affect a flow curve: fit parameters from the table {CURVE_TABLE}"
            )
    if len(curve.rate_per_s) <= len(parameters):
        raise StudyError(f"{len(curve.rate_per_s)} shear rates are too few for {len(parameters)} parameters")
    ordered = curve.ordered()
    problem = _CurveProblem(scene, liquid_id, parameters, ordered)
    z, fields = estimate(problem, liquid_id, names, float(np.sqrt(len(curve.rate_per_s))))
    fields["warnings"] += tuple(_branch_warnings(curve))
    return CurveFit(**fields, curve=ordered, fitted_pa=problem.stress_pa(z))


def _branch_warnings(curve: FlowCurve) -> Iterator[str]:
    """Yield a warning if two branches of a flow curve differ by more than noise.

    The noise is estimated from the second differences, along the shear rate, of the gap between the branches.
    """
    if (branches := curve.branches()) is None:
        return
    (rate_per_s, stress_pa), (other_per_s, other_pa) = branches.first, branches.second
    common = (rate_per_s >= other_per_s[0]) & (rate_per_s <= other_per_s[-1])
    log_rate = np.log(rate_per_s[common])
    gap = np.log(stress_pa[common]) - np.interp(log_rate, np.log(other_per_s), np.log(other_pa))
    if len(gap) < _MIN_BRANCH_ROWS:
        return
    noise = math.sqrt(float(np.mean(np.diff(gap, 2) ** 2)) / 6)
    size = math.sqrt(float(np.mean(gap**2)))
    if size > _MIN_GAP_RATIO * noise and size > _MIN_GAP:
        yield (
            f"{branches.description} differ by {100 * math.expm1(size):.0f} % of the stress, which is more than noise "
            "can explain (thixotropy or hysteresis); the fit lies between them, and its intervals do not cover "
            "both: fit only one branch"
        )


class _CurveProblem(Problem):
    alike = 0.995  # those of a yield stress and a consistency over four decades, each known within 5 %, have 0.987
    compared = "stress at these shear rates"
    varied = "these shear rates"
    more = "measure a wider range of shear rates"

    def __init__(self, scene: Scene, liquid_id: str, parameters: tuple[Parameter, ...], curve: FlowCurve) -> None:
        super().__init__(scene, liquid_id, parameters)
        self._curve = curve
        self._table = next(liquid for liquid in scene.liquids if liquid.id == liquid_id).non_newtonian

    def _products(self, residual: Floats) -> float:
        """Return the sum of the products of residuals at successive shear rates.

        Rows with equal shear rates have no order; the sum is the average over all their orders.
        """
        _, rate_index, counts = np.unique(self._curve.rate_per_s, return_inverse=True, return_counts=True)
        sums, squares = np.bincount(rate_index, residual.ravel()), np.bincount(rate_index, residual.ravel() ** 2)
        means = sums / counts
        return float(np.sum((sums**2 - squares) / counts) + np.sum(means[1:] * means[:-1]))

    def stress_pa(self, z: Floats) -> Floats:
        """Return the stress (n,) [Pa] at the measured shear rates."""
        changes: dict[str, Any] = {
            parameter.field: value for parameter, value in zip(self.parameters, self.values(z), strict=True)
        }
        table = self._table.model_copy(update=changes)
        return np.array([stress_pa(table, rate) for rate in self._curve.rate_per_s.tolist()])

    def misfit(self, z: Floats) -> Floats:
        """Return fitted/measured stress − 1, (n,)."""
        misfit: Floats = self.stress_pa(z) / self._curve.stress_pa - 1
        return misfit

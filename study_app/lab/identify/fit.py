"""Parameters of a liquid from measured motion and force: least squares through the servo's own tick.

The sum over rows and axes of (measured − simulated force)² is minimised within the ranges that the scene's models
permit (``search``); ``estimates`` computes confidence intervals and warnings.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from study_app.haptics.model.gate import resolve
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Scene
from study_app.lab.identify.estimates import Estimates, estimate, following
from study_app.lab.identify.measured_force import Measured, vectors_x
from study_app.lab.identify.parameters import find
from study_app.lab.identify.search import ForceProblem

FOLLOWING: Final = 0.1
CHANCE: Final = 5.0
"""Residuals count as correlated above this correlation, and above this many standard deviations of noise."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Fit(Estimates):
    """The result of a fit to a force.

    At the measured times ``measured_n``, ``fitted_n`` and ``residual_n`` (n, 3), measured − fitted; ``axes`` are those
    in use.
    """

    motion: Motion
    measured_n: Floats
    fitted_n: Floats
    axes: tuple[int, ...]

    @property
    def residual_n(self) -> Floats:
        """Measured − fitted force, (n, 3) [N]."""
        residual_n: Floats = self.measured_n - self.fitted_n
        return residual_n

    @property
    def rms_n(self) -> float:
        """The residual vector's root mean square length [N]."""
        return _rms(self.residual_n)

    @property
    def share(self) -> float:
        """``rms_n`` over the same of the measured force."""
        return self.rms_n / _rms(self.measured_n)

    def summary(self) -> str:
        """Return the amount of data, and the residual of the fit."""
        lasted_s = self.motion.t_s[-1] - self.motion.t_s[0]
        left = f"residual {self.rms_n:.3g} N RMS, {100 * self.share:.1f} % of the force"
        return f"{len(self.motion.t_s)} rows over {lasted_s:.3g} s; {left}"


def fit(scene: Scene, liquid_id: str, names: Sequence[str], motion: Motion, force_n: Floats) -> Fit:
    """Return the values of the parameters ``names`` with which `simulate` comes closest to a measured force.

    ``force_n`` is the liquid's on the body, (n, 3) or along x (n,), at the times of the motion, which may have another
    rate than the scene. Velocities of the motion are used if given, else those of the scene's estimator. The search
    begins at the scene's values; with ``effects = "auto"``, with the effects chosen for these.

    Raises
    ------
    StudyError
        No such liquid or parameter, or too little was measured.
    """
    measured = Measured(motion, vectors_x(force_n) if force_n.ndim == 1 else force_n)
    scene = resolve(scene)
    problem = ForceProblem(scene, liquid_id, find(scene, liquid_id, names), measured)
    z, fields = estimate(problem, liquid_id, names, float(np.linalg.norm(measured.force_n)))
    fitted_n = problem.force_n(z)
    fields["warnings"] += tuple(_of_the_residuals((measured.force_n - fitted_n)[:, problem.axes], measured.force_n))
    return Fit(**fields, motion=motion, measured_n=measured.force_n, fitted_n=fitted_n, axes=problem.axes)


def _of_the_residuals(residual_n: Floats, force_n: Floats) -> Iterator[str]:
    """Yield warnings of correlated residuals, which speak against the model: noise is uncorrelated."""
    rho = following(residual_n)
    if rho > max(FOLLOWING, CHANCE / math.sqrt(residual_n.size)):
        share = _rms(residual_n) / _rms(force_n)
        yield (
            f"residuals, {100 * share:.1f} % of the force, are autocorrelated (correlation {rho:.3f} from row to row): "
            "the model misses something, the sensor filters, or velocities from positions blur sharp turns; the "
            "intervals are widened for this, and are valid only if the model is"
        )


def _rms(vectors_n: Floats) -> float:
    return math.sqrt(float(np.mean(np.sum(vectors_n**2, axis=1))))

"""Parameters of a non-Newtonian liquid from a rheometer's flow curve: shear stress over shear rate.

The sum of (fitted/measured stress − 1)² is minimised, since flow curves span decades and a rheometer's error is
relative to the stress. The curve is `study_app.haptics.model.laws.stress_pa`, that of steady shear.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.laws import stress_pa
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene
from study_app.lab.identify.estimates import Estimates, estimate
from study_app.lab.identify.measured_force import FlowCurve
from study_app.lab.identify.parameters import Parameter, find
from study_app.lab.identify.search import Problem

TABLE: Final = "non_newtonian"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CurveFit(Estimates):
    """The result of a fit to a flow curve: ``fitted_pa`` (n,) at the measured shear rates."""

    curve: FlowCurve
    fitted_pa: Floats

    @property
    def share(self) -> float:
        """The root mean square of the residuals, each as a share of the measured stress."""
        return float(np.sqrt(np.mean((self.fitted_pa / self.curve.stress_pa - 1) ** 2)))

    def summary(self) -> str:
        """Return the amount of data, and the residual of the fit."""
        rates = self.curve.rate_per_s
        said = f"{len(rates)} shear rates from {rates.min():.3g} to {rates.max():.3g} per s"
        return f"{said}; residual {100 * self.share:.1f} % of the stress, RMS"


def fit_curve(scene: Scene, liquid_id: str, names: Sequence[str], curve: FlowCurve) -> CurveFit:
    """Return the values of the parameters ``names`` with which a liquid's flow curve comes closest to a measured one.

    Raises
    ------
    StudyError
        No such liquid or parameter, none of a flow curve, or too little was measured.
    """
    scene = resolve(scene)
    parameters = find(scene, liquid_id, names)
    for it in parameters:
        if it.table != TABLE:
            raise StudyError(f"{it.name} does not change a flow curve: fit parameters of the table {TABLE}")
    if len(curve.rate_per_s) <= len(parameters):
        raise StudyError(f"{len(curve.rate_per_s)} shear rates are too few for {len(parameters)} parameters")
    problem = _CurveProblem(scene, liquid_id, parameters, curve)
    z, fields = estimate(problem, liquid_id, names, float(np.sqrt(len(curve.rate_per_s))))
    return CurveFit(**fields, curve=curve, fitted_pa=problem.stress_pa(z))


class _CurveProblem(Problem):
    alike = 0.995  # those of a yield stress and a consistency over four decades, each known within 5 %, have 0.987
    compared = "stress at these shear rates"
    varied = "these shear rates"
    more = "measure a wider range of them"

    def __init__(self, scene: Scene, liquid_id: str, parameters: tuple[Parameter, ...], curve: FlowCurve) -> None:
        super().__init__(scene, liquid_id, parameters)
        self._curve = curve
        self._table = next(liquid for liquid in scene.liquids if liquid.id == liquid_id).non_newtonian

    def stress_pa(self, z: Floats) -> Floats:
        """Return the stress (n,) [Pa] at the measured shear rates."""
        changes: dict[str, Any] = {it.field: value for it, value in zip(self.parameters, self.values(z), strict=True)}
        table = self._table.model_copy(update=changes)
        return np.array([stress_pa(table, rate) for rate in self._curve.rate_per_s.tolist()])

    def misfit(self, z: Floats) -> Floats:
        """Return fitted/measured stress − 1, (n,)."""
        misfit: Floats = self.stress_pa(z) / self._curve.stress_pa - 1
        return misfit

"""The result of a least-squares fit: values, confidence intervals, correlations, warnings.

Intervals are those of linear regression at the solution, from Student's t. Residuals are correlated, so n of them
count as n (1 − ρ)/(1 + ρ) independent ones, where ρ is the correlation of successive residuals (Bayley & Hammersley
1946, J. R. Stat. Soc. Suppl. 8:184, for a first-order process).
"""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene
from study_app.lab.identify.parameters import NO_LESS_THAN, Parameter
from study_app.lab.identify.search import Problem, coordinate, solve, u_range

CONFIDENCE: Final = 0.95
_VAGUE_RATIO: Final = 2.0
_NO_EFFECT: Final = 1e-9
_SINGULAR: Final = 1e-9
_NEARLY_ZERO: Final = 1e-9


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Estimates:
    """The fitted parameters of a liquid, by their requested names.

    ``values`` and their 95 % ``intervals`` are within the permitted range. ``correlation`` (p, p) is that of the
    estimates, nan for a parameter without effect; ``autocorrelation`` is the correlation of successive residuals.
    ``distinguishable`` is whether every parameter has an effect, and no two have the same effect. ``scene`` contains
    the values, with its effects named explicitly.
    """

    scene: Scene
    liquid_id: str
    parameters: tuple[Parameter, ...]
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    autocorrelation: float
    correlation: Floats
    distinguishable: bool
    warnings: tuple[str, ...]

    def row(self, parameter: Parameter) -> tuple[str, str]:
        """Return a parameter's value and interval as texts with five digits; integers have all digits."""
        value, (lower, upper) = self.values[parameter.name], self.intervals[parameter.name]
        whole_range = lower <= max(parameter.least, 1e-12) * (1 + 1e-9) and upper >= parameter.most
        interval = "not determined" if whole_range else f"{lower:.5g} … {upper:.5g}"
        return (f"{value}" if parameter.whole else f"{value:.5g}"), interval

    def summary(self) -> str:
        raise NotImplementedError


def estimate(problem: Problem, liquid_id: str, names: Sequence[str], size: float) -> tuple[Floats, dict[str, Any]]:
    """Return the least-squares solution z, and the fields of `Estimates` there.

    ``size`` is the norm of all measurements, in the units of the misfit.
    """
    z, converged = solve(problem)
    residual, slopes = -problem.misfit(z).reshape(-1, problem.columns), problem.slopes_of_u(z)
    has_effect = _affects_measurement(problem.u(z), slopes, problem, size)
    half_widths, correlation = _interval_spread(slopes, has_effect, residual, problem.autocorrelation(residual))
    values, pairs = problem.values(z), _indistinguishable_pairs(correlation, problem.alike)
    intervals = [
        _limited_interval(parameter, u, half_width)
        for parameter, u, half_width in zip(problem.parameters, problem.u(z), half_widths, strict=True)
    ]
    warnings = (
        *(["the search stopped before it converged: choose closer initial values with --set"] if not converged else []),
        *_parameter_warnings(problem, z, has_effect, half_widths, {k for pair in pairs for k in pair}),
        *_pair_warnings(problem, names, pairs, correlation),
    )
    return z, {
        "scene": problem.scene(z),
        "liquid_id": liquid_id,
        "parameters": problem.parameters,
        "values": {
            parameter.name: round(value) if parameter.whole else value
            for parameter, value in zip(problem.parameters, values, strict=True)
        },
        "intervals": dict(zip(names, intervals, strict=True)),
        "autocorrelation": problem.autocorrelation(residual),
        "correlation": correlation,
        "distinguishable": bool(has_effect.all()) and not pairs,
        "warnings": warnings,
    }


def _affects_measurement(u: Floats, slopes: Floats, problem: Problem, size: float) -> NDArray[np.bool_]:
    """Return which parameters affect the measured quantity, (p,)."""
    spans = [
        max(abs(value), 0.01) if coordinate(parameter).relative else 1.0
        for parameter, value in zip(problem.parameters, u, strict=True)
    ]
    strengths: Floats = np.linalg.norm(slopes, axis=0) * spans
    return strengths > _NO_EFFECT * size


def _interval_spread(
    slopes: Floats, has_effect: NDArray[np.bool_], residual: Floats, autocorrelation: float
) -> tuple[Floats, Floats]:
    """Return the half widths (p,) of the intervals in u, and the correlation (p, p) of the estimates."""
    count = len(has_effect)
    half_widths, correlation = np.full(count, math.inf), np.full((count, count), math.nan)
    if not has_effect.any():
        return half_widths, correlation
    lengths = np.linalg.norm(slopes[:, has_effect], axis=0)
    _, singular_values, rows = np.linalg.svd(slopes[:, has_effect] / lengths, full_matrices=False)
    covariance = (rows.T / np.maximum(singular_values, _SINGULAR * singular_values[0]) ** 2) @ rows
    deviations = np.sqrt(np.diag(covariance))
    correlation[np.ix_(has_effect, has_effect)] = covariance / np.outer(deviations, deviations)
    rho = max(autocorrelation, 0.0)
    independent = max(residual.size * (1 - rho) / (1 + rho), has_effect.sum() + 1.0)
    degrees_of_freedom = independent - float(has_effect.sum())
    variance = (
        float(np.sum(residual**2)) / degrees_of_freedom * independent / residual.size
    )  # of an independent residual
    widening = math.sqrt(residual.size / independent)
    half_widths[has_effect] = (
        student.ppf((1 + CONFIDENCE) / 2, degrees_of_freedom) * math.sqrt(variance) * widening * deviations / lengths
    )
    return half_widths, correlation


def _limited_interval(parameter: Parameter, u: float, half_width: float) -> tuple[float, float]:
    """Return the interval of a parameter's value, limited to its permitted range."""
    minimum, maximum = u_range(parameter)
    ends = [coordinate(parameter).to_value(end) for end in (max(u - half_width, minimum), min(u + half_width, maximum))]
    lower, upper = sorted(min(max(end, parameter.least), parameter.most) for end in ends)
    return float(lower), float(upper)


def _indistinguishable_pairs(correlation: Floats, limit: float) -> list[tuple[int, int]]:
    """Return the index pairs of parameters that cannot be distinguished."""
    count = len(correlation)
    return [(j, k) for k in range(count) for j in range(k) if abs(correlation[j, k]) > limit]


def _pair_warnings(
    problem: Problem, names: Sequence[str], pairs: Sequence[tuple[int, int]], correlation: Floats
) -> Iterator[str]:
    """Yield a warning for every pair of parameters that cannot be distinguished."""
    for j, k in pairs:
        alike = f"(correlation {correlation[j, k]:.3f})".replace("-", "−")
        yield (
            f"{names[j]} and {names[k]} cannot be distinguished by {problem.varied} {alike}, because each can "
            f"compensate for the other: fit only one of them, or {problem.more}"
        )


def _parameter_warnings(
    problem: Problem, z: Floats, has_effect: NDArray[np.bool_], half_widths: Floats, in_pair: Collection[int]
) -> Iterator[str]:
    """Yield warnings about single parameters that are unreliable; those ``in_pair`` already have a warning."""
    values = problem.values(z)
    for k, parameter in enumerate(problem.parameters):
        tolerance = 1e-6 * max(1.0, abs(z[k]))
        if not has_effect[k]:
            yield (
                f"{parameter.name} does not affect the {problem.compared}, so its initial value {parameter.value:g} "
                "was kept"
            )
        elif z[k] - problem.least[k] < tolerance or problem.most[k] - z[k] < tolerance:
            edge = f"{_edge_text(values[k])}{_edge_reason(problem, k, z)}"
            yield (
                f"{parameter.name} reached the end of its range, {edge}: the best value may lie beyond it, "
                "and the intervals do not take this limit into account"
            )
        elif k not in in_pair and half_widths[k] > (
            abs(problem.u(z)[k]) / _VAGUE_RATIO if coordinate(parameter).relative else math.log(_VAGUE_RATIO)
        ):
            yield f"{parameter.name} is poorly determined by {problem.varied}: check its interval"


def _edge_text(value: float) -> str:
    """Return an end of a range; the search ends just above a limit of 0."""
    return "0" if 0 < value < _NEARLY_ZERO else f"{value:.6g}"


def _edge_reason(problem: Problem, k: int, z: Floats) -> str:
    """Return the reason for the end of a range if it is not that of the model, else ""."""
    parameter = problem.parameters[k]
    if parameter.field in NO_LESS_THAN and z[k] - problem.least[k] < problem.most[k] - z[k]:
        return f" (it cannot be less than {NO_LESS_THAN[parameter.field]})"
    if parameter.whole and z[k] > problem.least[k]:
        return " (limited by the scaling or by the duration of the measurement)"
    return ""

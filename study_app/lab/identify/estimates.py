"""The result of a least-squares fit: values, confidence intervals, correlations, warnings.

Intervals are those of linear regression at the solution, by Student's t. Residuals are correlated, so n of them count
as n (1 − ρ)/(1 + ρ) independent ones, with ρ their correlation from one row to the next (Bayley & Hammersley 1946, J.
R. Stat. Soc. Suppl. 8:184, for a first-order process).
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
_VAGUE: Final = 2.0
_NO_EFFECT: Final = 1e-9
_SINGULAR: Final = 1e-9


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Estimates:
    """The fitted parameters of a liquid, by their requested names.

    ``values`` with their 95 % ``intervals``, within the permitted range. ``correlation`` (p, p) is that of the
    estimates, nan for a parameter without effect, ``following`` that of residuals between successive rows.
    ``distinguishable`` tells whether every parameter has an effect, and no two have the same. ``scene`` contains the
    values, with its effects named explicitly.
    """

    scene: Scene
    liquid_id: str
    parameters: tuple[Parameter, ...]
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    following: float
    correlation: Floats
    distinguishable: bool
    warnings: tuple[str, ...]

    def row(self, it: Parameter) -> tuple[str, str]:
        """Return a parameter's value and interval as texts with five digits; integers are written in full."""
        value, (lower, upper) = self.values[it.name], self.intervals[it.name]
        anything = lower <= max(it.least, 1e-12) * (1 + 1e-9) and upper >= it.most
        return (f"{value}" if it.whole else f"{value:.5g}"), "anything" if anything else f"{lower:.5g} … {upper:.5g}"

    def summary(self) -> str:
        raise NotImplementedError


def estimate(problem: Problem, liquid_id: str, names: Sequence[str], size: float) -> tuple[Floats, dict[str, Any]]:
    """Return the least-squares solution z, and the fields of `Estimates` there.

    ``size`` is the length of the vector of measurements, in the units of the misfit.
    """
    z, ended = solve(problem)
    residual, slopes = -problem.misfit(z).reshape(-1, problem.columns), problem.slopes_of_u(z)
    acts = _affects_measurement(problem.u(z), slopes, problem, size)
    half, correlation = _interval_spread(slopes, acts, residual, problem.following(residual))
    values, pairs = problem.values(z), _indistinguishable_pairs(correlation, problem.alike)
    intervals = [_interval_of(it, u, by) for it, u, by in zip(problem.parameters, problem.u(z), half, strict=True)]
    warnings = (
        *(["the search stopped before it converged: choose closer initial values with --set"] if not ended else []),
        *_parameter_warnings(problem, z, acts, half, {k for pair in pairs for k in pair}),
        *_pair_warnings(problem, names, pairs, correlation),
    )
    return z, {
        "scene": problem.scene(z),
        "liquid_id": liquid_id,
        "parameters": problem.parameters,
        "values": {
            it.name: round(value) if it.whole else value for it, value in zip(problem.parameters, values, strict=True)
        },
        "intervals": dict(zip(names, intervals, strict=True)),
        "following": problem.following(residual),
        "correlation": correlation,
        "distinguishable": bool(acts.all()) and not pairs,
        "warnings": warnings,
    }


def _affects_measurement(u: Floats, slopes: Floats, problem: Problem, size: float) -> NDArray[np.bool_]:
    """Return which parameters affect the measured quantity, (p,)."""
    spans = [
        1.0 if coordinate(it).relative is False else max(abs(at), 0.01)
        for it, at in zip(problem.parameters, u, strict=True)
    ]
    strengths: Floats = np.linalg.norm(slopes, axis=0) * spans
    return strengths > _NO_EFFECT * size


def _interval_spread(
    slopes: Floats, acts: NDArray[np.bool_], residual: Floats, following: float
) -> tuple[Floats, Floats]:
    """Return the half widths (p,) of the intervals in u, and the correlation (p, p) of the estimates."""
    count = len(acts)
    half, correlation = np.full(count, math.inf), np.full((count, count), math.nan)
    if not acts.any():
        return half, correlation
    lengths = np.linalg.norm(slopes[:, acts], axis=0)
    _, sizes, rows = np.linalg.svd(slopes[:, acts] / lengths, full_matrices=False)
    covariance = (rows.T / np.maximum(sizes, _SINGULAR * sizes[0]) ** 2) @ rows
    deviations = np.sqrt(np.diag(covariance))
    correlation[np.ix_(acts, acts)] = covariance / np.outer(deviations, deviations)
    rho = max(following, 0.0)
    independent = max(residual.size * (1 - rho) / (1 + rho), acts.sum() + 1.0)
    freedom = independent - float(acts.sum())
    one_square = float(np.sum(residual**2)) / freedom * independent / residual.size  # of one independent residual
    widening = math.sqrt(residual.size / independent)
    half[acts] = student.ppf((1 + CONFIDENCE) / 2, freedom) * math.sqrt(one_square) * widening * deviations / lengths
    return half, correlation


def _interval_of(it: Parameter, u: float, half: float) -> tuple[float, float]:
    """Return the interval of a parameter's value within its permitted range."""
    least, most = u_range(it)
    ends = [coordinate(it).to_value(end) for end in (max(u - half, least), min(u + half, most))]
    lower, upper = sorted(min(max(end, it.least), it.most) for end in ends)
    return float(lower), float(upper)


def _indistinguishable_pairs(correlation: Floats, limit: float) -> list[tuple[int, int]]:
    """Return the index pairs of parameters that cannot be distinguished."""
    count = len(correlation)
    return [(j, k) for k in range(count) for j in range(k) if abs(correlation[j, k]) > limit]


def _pair_warnings(
    problem: Problem, names: Sequence[str], pairs: Sequence[tuple[int, int]], correlation: Floats
) -> Iterator[str]:
    """Yield a sentence for every two parameters that cannot be distinguished."""
    for j, k in pairs:
        alike = f"(correlation {correlation[j, k]:.3f})".replace("-", "−")
        yield (
            f"{names[j]} and {names[k]} cannot be distinguished by {problem.varied} {alike}, because each can "
            f"compensate for the other: fit only one of them, or {problem.more}"
        )


def _parameter_warnings(
    problem: Problem, z: Floats, acts: NDArray[np.bool_], half: Floats, paired: Collection[int]
) -> Iterator[str]:
    """Yield warnings about unreliable single parameters."""
    values = problem.values(z)
    for k, it in enumerate(problem.parameters):
        near = 1e-6 * max(1.0, abs(z[k]))
        if not acts[k]:
            yield f"{it.name} does not affect the {problem.compared}, so its initial value {it.value:g} was kept"
        elif z[k] - problem.least[k] < near or problem.most[k] - z[k] < near:
            yield (
                f"{it.name} reached the end of its range, {values[k]:.6g}{_edge_reason(problem, k, z)}: the best value "
                "may lie beyond it, and the intervals do not take this limit into account"
            )
        elif k not in paired and half[k] > (
            math.log(_VAGUE) if coordinate(it).relative is False else abs(problem.u(z)[k]) / _VAGUE
        ):
            yield f"{it.name} is poorly determined by {problem.varied}: check its interval"


def _edge_reason(problem: Problem, k: int, z: Floats) -> str:
    """Return the reason why a range ends, if not by the model itself, or ""."""
    it = problem.parameters[k]
    if it.field in NO_LESS_THAN and z[k] - problem.least[k] < problem.most[k] - z[k]:
        return f" (it cannot be less than {NO_LESS_THAN[it.field]})"
    if it.whole and z[k] > problem.least[k]:
        return " (limited by the scaling or by the duration of the measurement)"
    return ""

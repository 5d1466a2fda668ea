"""Parameters of a liquid from measured motion and force: least squares through the servo's own tick.

The sum over rows and axes of (measured − simulated force)² is made least within the ranges that the scene's models
permit (``search``). Intervals are those of linear regression at the solution, by Student's t. Residuals follow one
another, so as many of n count as independent as n (1 − ρ)/(1 + ρ), with ρ their correlation from one row to the next
(Bayley & Hammersley 1946, J. R. Stat. Soc. Suppl. 8:184, for a first-order process).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from study_app.evaluation.identify.measured_force import Measured, along_x
from study_app.evaluation.identify.parameters import Parameter, find
from study_app.evaluation.identify.search import Problem, coordinate, solve, u_range
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Scene

CONFIDENCE: Final = 0.95
ALIKE: Final = 0.95
"""Correlation of two estimates from which their parameters count as not distinguishable."""
FOLLOWING: Final = 0.1
CHANCE: Final = 5.0
"""Residuals count as following one another from this correlation on, and this many deviations from what noise has."""
VAGUE: Final = 2.0
_NO_EFFECT: Final = 1e-9
_SINGULAR: Final = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What a fit found; parameters by the names they were asked for.

    ``values`` and ``intervals`` (95 %, within what is permitted); at the measured times ``measured_n``, ``fitted_n``
    and ``residual_n`` (n, 3), measured − fitted; ``axes`` are those that count. ``correlation`` (p, p) is that of the
    estimates, nan where a parameter does nothing, ``following`` that of residuals from row to row. ``told_apart`` is
    whether every parameter acts, and no two of them alike. ``scene`` has the values in it, and its effects named.
    """

    scene: Scene
    liquid_id: str
    parameters: tuple[Parameter, ...]
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    motion: Motion
    measured_n: Floats
    fitted_n: Floats
    axes: tuple[int, ...]
    following: float
    correlation: Floats
    told_apart: bool
    warnings: tuple[str, ...]

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

    def row(self, it: Parameter) -> tuple[str, str]:
        """Return a parameter's value and interval in words, to five digits; whole numbers as they are."""
        value, (lower, upper) = self.values[it.name], self.intervals[it.name]
        anything = lower <= max(it.least, 1e-12) * (1 + 1e-9) and upper >= it.most
        return (f"{value}" if it.whole else f"{value:.5g}"), "anything" if anything else f"{lower:.5g} … {upper:.5g}"

    def summary(self) -> str:
        """Return how much was measured, and how near the fit comes."""
        lasted_s = self.motion.t_s[-1] - self.motion.t_s[0]
        left = f"residual {self.rms_n:.3g} N RMS, {100 * self.share:.1f} % of the force"
        return f"{len(self.motion.t_s)} rows over {lasted_s:.3g} s; {left}"


def fit(scene: Scene, liquid_id: str, names: Sequence[str], motion: Motion, force_n: Floats) -> Fit:
    """Return the values of the parameters ``names`` with which `simulate` comes closest to a measured force.

    ``force_n`` is the liquid's on the body, (n, 3) or along x (n,), at the times of the motion, which may have another
    rate than the scene. A motion with velocities is followed with them, one without through the scene's estimator. The
    search begins at the scene's values; where it says ``effects = "auto"``, with the effects chosen for those.

    Raises
    ------
    StudyError
        No such liquid or parameter, or too little was measured.
    """
    measured = Measured(motion, along_x(force_n) if force_n.ndim == 1 else force_n)
    scene = resolve(scene)
    problem = Problem(scene, liquid_id, find(scene, liquid_id, names), measured)
    z, ended = solve(problem)
    fitted_n = problem.force_n(z)
    residual_n = (measured.force_n - fitted_n)[:, problem.axes]
    slopes = problem.slopes_of_u(z)
    acts = _acts(problem.u(z), slopes, problem)
    half, correlation = _spread(slopes, acts, residual_n)
    values, pairs = problem.values(z), _alike(correlation)
    intervals = [_ends(it, u, by) for it, u, by in zip(problem.parameters, problem.u(z), half, strict=True)]
    return Fit(
        scene=problem.scene(z),
        liquid_id=liquid_id,
        parameters=problem.parameters,
        values={
            it.name: round(value) if it.whole else value for it, value in zip(problem.parameters, values, strict=True)
        },
        intervals=dict(zip(names, intervals, strict=True)),
        motion=motion,
        measured_n=measured.force_n,
        fitted_n=fitted_n,
        axes=problem.axes,
        following=_following(residual_n),
        correlation=correlation,
        told_apart=bool(acts.all()) and not pairs,
        warnings=(
            *(["the search stopped before it converged: choose closer initial values with --set"] if not ended else []),
            *_of_the_parameters(problem, z, acts, half, {k for pair in pairs for k in pair}),
            *_of_pairs(names, pairs, correlation),
            *_of_the_residuals(residual_n, measured.force_n),
        ),
    )


def _acts(u: Floats, slopes: Floats, problem: Problem) -> NDArray[np.bool_]:
    """Return which parameters change the force at all, (p,)."""
    spans = [1.0 if coordinate(it).relative is False else max(abs(at), 0.01) for it, at in _beside(problem, u)]
    strengths: Floats = np.linalg.norm(slopes, axis=0) * spans
    return strengths > _NO_EFFECT * np.linalg.norm(problem.measured.force_n)


def _beside(problem: Problem, u: Floats) -> Iterator[tuple[Parameter, float]]:
    yield from zip(problem.parameters, u.tolist(), strict=True)


def _spread(slopes: Floats, acts: NDArray[np.bool_], residual_n: Floats) -> tuple[Floats, Floats]:
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
    rho = max(_following(residual_n), 0.0)
    independent = max(residual_n.size * (1 - rho) / (1 + rho), acts.sum() + 1.0)
    freedom = independent - float(acts.sum())
    one_n2 = float(np.sum(residual_n**2)) / freedom * independent / residual_n.size  # of one independent residual
    widening = math.sqrt(residual_n.size / independent)
    half[acts] = student.ppf((1 + CONFIDENCE) / 2, freedom) * math.sqrt(one_n2) * widening * deviations / lengths
    return half, correlation


def _following(residual_n: Floats) -> float:
    """Return the correlation of residuals (n, k) from one row to the next, of all axes together."""
    whole = float(np.sum(residual_n**2))
    if whole == 0.0:
        return 0.0
    return min(float(np.sum(residual_n[1:] * residual_n[:-1])) / whole, 1 - 1 / len(residual_n))


def _ends(it: Parameter, u: float, half: float) -> tuple[float, float]:
    """Return the interval of a parameter's value, within what is permitted."""
    least, most = u_range(it)
    ends = [coordinate(it).to_value(end) for end in (max(u - half, least), min(u + half, most))]
    lower, upper = sorted(min(max(end, it.least), it.most) for end in ends)
    return float(lower), float(upper)


def _alike(correlation: Floats) -> list[tuple[int, int]]:
    """Return every two parameters that cannot be distinguished."""
    count = len(correlation)
    return [(j, k) for k in range(count) for j in range(k) if abs(correlation[j, k]) > ALIKE]


def _of_pairs(names: Sequence[str], pairs: Sequence[tuple[int, int]], correlation: Floats) -> Iterator[str]:
    """Yield a sentence for every two parameters that cannot be distinguished."""
    for j, k in pairs:
        alike = f"(correlation {correlation[j, k]:.3f})".replace("-", "−")
        yield (
            f"{names[j]} and {names[k]} cannot be distinguished by this motion {alike}: each can compensate the "
            "other; fit one of them, or measure more kinds of motion"
        )


def _of_the_parameters(
    problem: Problem, z: Floats, acts: NDArray[np.bool_], half: Floats, paired: Collection[int]
) -> Iterator[str]:
    """Yield what is not to be relied on in single parameters."""
    values = problem.values(z)
    for k, it in enumerate(problem.parameters):
        near = 1e-6 * max(1.0, abs(z[k]))
        if not acts[k]:
            yield f"{it.name} does not change the force along this motion: {it.value:g} is its initial value"
        elif z[k] - problem.least[k] < near or problem.most[k] - z[k] < near:
            yield (
                f"{it.name} ended at the edge of its range, {values[k]:.6g}{_edge(problem, k, z)}: the best value "
                "may lie beyond, and the intervals ignore the edge"
            )
        elif k not in paired and half[k] > (
            math.log(VAGUE) if coordinate(it).relative is False else abs(problem.u(z)[k]) / VAGUE
        ):
            yield f"{it.name} is hardly determined by this motion: see its interval"


def _edge(problem: Problem, k: int, z: Floats) -> str:
    """Return why the range ends there, where the model alone does not say it."""
    it = problem.parameters[k]
    if it.field == "scaling" and z[k] - problem.least[k] < problem.most[k] - z[k]:
        return " (no less than the length)"
    if it.whole and z[k] > problem.least[k]:
        return " (no more than the scaling, nor than what was measured lasts)"
    return ""


def _of_the_residuals(residual_n: Floats, force_n: Floats) -> Iterator[str]:
    """Yield what the residuals say against the model: noise does not remember."""
    rho = _following(residual_n)
    if rho > max(FOLLOWING, CHANCE / math.sqrt(residual_n.size)):
        share = _rms(residual_n) / _rms(force_n)
        yield (
            f"residuals, {100 * share:.1f} % of the force, are autocorrelated (correlation {rho:.3f} from row to row): "
            "the model misses something, the sensor filters, or velocities from positions blur sharp turns; the "
            "intervals are widened for this, and are valid only if the model is"
        )


def _rms(vectors_n: Floats) -> float:
    return math.sqrt(float(np.mean(np.sum(vectors_n**2, axis=1))))

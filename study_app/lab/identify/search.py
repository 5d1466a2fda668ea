"""The search for a liquid's parameters, of which the force along a measured motion is a function.

The search varies the logarithm of positive parameters, and the rate of a wake's decay. If one of two parameters must
not be less than the other (`NO_LESS_THAN`), it varies the lesser one and their ratio, which is at least 1. A length is
a number of elements, so the force is only defined at integer lengths and is interpolated between them. The search
begins at several lengths; then the length is rounded and the other parameters are fitted again.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from study_app.errors import StudyError
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.offline import simulate
from study_app.lab.identify.measured_force import MeasuredForce, at_rate
from study_app.lab.identify.parameters import NO_LESS_THAN, Parameter, replace_values

_LEAST_POSITIVE: Final = 1e-12
_HIGHEST_EXPONENT: Final = 700.0
_SHORTEST_LENGTH: Final = 5
_STARTS: Final = 6
_NEARBY_FACTORS: Final = (0.5, 0.7, 1.4, 2.0)
_ROUNDS: Final = 4
_MIN_IMPROVEMENT: Final = 1e-4
_TRIAL_STEPS: Final = 4  # steps from each start before the best one continues
_MAX_STEPS: Final = 100
_RELATIVE_STEP: Final = 1e-4
_LENGTH_STEP: Final = 1e-2
_ROUNDING: Final = 1e-12  # rounding tolerance of exp(log(N)), so that S = N is kept


class Coordinate(NamedTuple):
    """The search variable u of a parameter, a monotonic function of its value; ``step`` is used for derivatives."""

    to_u: Callable[[float], float]
    to_value: Callable[[float], float]
    step: float
    relative: bool  # whether the step is a fraction of u


_LINEAR: Final = Coordinate(lambda value: value, lambda u: u, _RELATIVE_STEP, relative=True)
_LOGARITHM: Final = Coordinate(
    math.log, lambda u: math.exp(u) if u < _HIGHEST_EXPONENT else math.inf, _RELATIVE_STEP, relative=False
)
_COUNT: Final = _LOGARITHM._replace(step=_LENGTH_STEP)
_RATE: Final = Coordinate(
    lambda value: -1e3 * math.log(value), lambda u: math.exp(-1e-3 * u), _RELATIVE_STEP, relative=True
)


def coordinate(parameter: Parameter) -> Coordinate:
    """Return the search variable of a parameter."""
    if parameter.whole:
        return _COUNT
    if parameter.field == "decay":
        return _RATE  # 1/s
    return _LOGARITHM if parameter.least > 0 or (parameter.least == 0 and parameter.above) else _LINEAR


def u_range(parameter: Parameter) -> tuple[float, float]:
    """Return the minimum and the maximum of u that the parameter's model permits."""
    kind = coordinate(parameter)
    if kind is _RATE:
        return 0.0, 1e3
    if kind is _LINEAR:
        return parameter.least, parameter.most
    return kind.to_u(max(parameter.least, _LEAST_POSITIVE)), kind.to_u(parameter.most)


class Problem:
    """A scene, the parameters to be fitted, and the measurements.

    z (p,) are the search variables: u, or for the greater of two parameters in `NO_LESS_THAN` the logarithm of their
    ratio. ``least`` and ``most`` (p,) are the range of z, ``start`` is z for the scene's values, limited to it.
    ``compared``, ``varied`` and ``more`` are phrases for warnings; ``alike`` is the correlation of two estimates above
    which their parameters count as indistinguishable.
    """

    alike: ClassVar[float]
    compared: ClassVar[str]
    varied: ClassVar[str]
    more: ClassVar[str]

    def __init__(self, scene: Scene, liquid_id: str, parameters: tuple[Parameter, ...]) -> None:
        self.parameters = parameters
        self._scene, self._liquid_id = scene, liquid_id
        self._coordinates = tuple(coordinate(parameter) for parameter in parameters)
        self.length = next((k for k, parameter in enumerate(parameters) if parameter.whole), None)
        indices = {(parameter.table, parameter.field): k for k, parameter in enumerate(parameters)}
        lesser = {
            k: indices.get((parameter.table, NO_LESS_THAN.get(parameter.field, "")))
            for k, parameter in enumerate(parameters)
        }
        self.lesser = {greater: k for greater, k in lesser.items() if k is not None}
        self.scaling = next((greater for greater, k in self.lesser.items() if k == self.length), None)
        self.least, self.most = (np.array(ends) for ends in zip(*map(self._range, parameters), strict=True))
        self.start = np.clip(self._to_z([parameter.value for parameter in parameters]), self.least, self.most)

    @property
    def columns(self) -> int:
        """The number of values per measured row."""
        return 1

    def misfit(self, z: Floats) -> Floats:
        """Return predicted − measured values, (m,), row by row."""
        raise NotImplementedError

    def autocorrelation(self, residual: Floats) -> float:
        """Return the correlation of successive residuals (n, k), over all columns."""
        squares = float(np.sum(residual**2))
        return min(self._products(residual) / squares, 1 - 1 / len(residual)) if squares else 0.0

    def _products(self, residual: Floats) -> float:
        """Return the sum of the products of successive residuals."""
        return float(np.sum(residual[1:] * residual[:-1]))

    def values(self, z: Floats) -> list[float]:
        """Return the parameters' values, limited to their ranges; a length is not rounded."""
        values = [kind.to_value(float(u)) for kind, u in zip(self._coordinates, self.u(z), strict=True)]
        values = [round(value) if abs(value - round(value)) < _ROUNDING * abs(value) else value for value in values]
        return [
            min(max(value, parameter.least), parameter.most)
            for value, parameter in zip(values, self.parameters, strict=True)
        ]

    def u(self, z: Floats) -> Floats:
        """Return u (p,)."""
        u = np.array(z, float)
        for k, lesser in self.lesser.items():
            u[k] += u[lesser]
        return u

    def slopes(self, z: Floats) -> Floats:
        """Return the derivative of the misfit by z, (m, p), by central differences, one-sided at the range's ends."""
        columns = []
        for k, kind in enumerate(self._coordinates):
            step = kind.step * (max(abs(z[k]), 0.01) if kind.relative else 1.0)
            lower, upper = np.array(z, float), np.array(z, float)
            lower[k] = max(z[k] - step, self.least[k])
            upper[k] = min(z[k] + step, self.most[k])
            columns.append((self.misfit(upper) - self.misfit(lower)) / (upper[k] - lower[k]))
        return np.column_stack(columns)

    def slopes_of_u(self, z: Floats) -> Floats:
        """Return the derivative of the misfit by u, (m, p)."""
        slopes = self.slopes(z)
        for k, lesser in self.lesser.items():
            slopes[:, lesser] -= slopes[:, k]
        return slopes

    def with_whole_length(self, z: Floats) -> Floats:
        """Return z with an integer length; the scaling is kept."""
        if self.length is None:
            return z
        values = self.values(z)
        values[self.length] = max(1, min(round(values[self.length]), self._longest(values, self.length)))
        return self._to_z(values)

    def with_length(self, z: Floats, k: int, u: float) -> Floats:
        """Return z with another length; the scaling is kept, or raised to the length if it is smaller."""
        u = min(max(u, self.least[k]), self.most[k])
        changed = np.array(z, float)
        if self.scaling is not None:
            changed[self.scaling] = max(z[self.scaling] + z[k] - u, 0.0)
        changed[k] = u
        return changed

    def scene(self, z: Floats) -> Scene:
        return replace_values(self._scene, self._liquid_id, self.parameters, self.values(z))

    def _longest(self, values: Sequence[float], k: int) -> float:
        """Return the maximum integer length that the scaling permits."""
        scaling = math.inf if self.scaling is None else values[self.scaling]
        return math.floor(min(self.parameters[k].most, scaling) * (1 + 1e-12))

    def _range(self, parameter: Parameter) -> tuple[float, float]:
        minimum, maximum = u_range(parameter)
        return (0.0 if self.parameters.index(parameter) in self.lesser else minimum), maximum

    def _to_z(self, values: Sequence[float]) -> Floats:
        z = np.array([kind.to_u(value) for kind, value in zip(self._coordinates, values, strict=True)])
        for k, lesser in self.lesser.items():
            z[k] = max(z[k] - z[lesser], 0.0)
        return z


class ForceProblem(Problem):
    """The force along a measured motion.

    ``axes`` are the axes in which the measured or the predicted force is not zero.
    """

    alike = 0.95
    compared = "force along this motion"
    varied = "this motion"
    more = "measure more kinds of motion"

    def __init__(
        self, scene: Scene, liquid_id: str, parameters: tuple[Parameter, ...], measured: MeasuredForce
    ) -> None:
        self.measured = measured
        self._motion = at_rate(measured.motion, scene.rate_hz)
        self._spacing = max(1, math.ceil(1000 / scene.rate_hz))
        super().__init__(scene, liquid_id, parameters)
        if not measured.force_n.any():
            raise StudyError("the measured force is always zero: there is nothing to fit")
        simulated_n = self.force_n(self.start)
        self.axes = tuple(axis for axis in range(3) if measured.force_n[:, axis].any() or simulated_n[:, axis].any())
        if len(measured.force_n) * len(self.axes) <= len(parameters):
            raise StudyError(f"{len(measured.force_n)} rows are too few for {len(parameters)} parameters")

    def with_force(self, force_n: Floats) -> "ForceProblem":
        """Return the same problem with another force (n, 3) along the motion."""
        return ForceProblem(self._scene, self._liquid_id, self.parameters, MeasuredForce(self.measured.motion, force_n))

    @property
    def columns(self) -> int:
        return len(self.axes)

    def force_n(self, z: Floats) -> Floats:
        """Return the force (n, 3) at the measured times, interpolated between integer lengths."""
        values = self.values(z)
        if self.length is None:
            return self._simulate_force(values)
        below, above, proportion = self._neighbours(values, self.length)
        force_n = self._simulate_force(below)
        return force_n if proportion == 0 else (1 - proportion) * force_n + proportion * self._simulate_force(above)

    def misfit(self, z: Floats) -> Floats:
        misfit: Floats = (self.force_n(z) - self.measured.force_n)[:, self.axes].ravel()
        return misfit

    def _simulate_force(self, values: Sequence[float]) -> Floats:
        table = simulate(replace_values(self._scene, self._liquid_id, self.parameters, values), self._motion)
        columns = (table.fx_n, table.fy_n, table.fz_n)
        if self._motion is self.measured.motion:
            return np.column_stack(columns)
        return np.column_stack([np.interp(self.measured.motion.t_s, self._motion.t_s, column) for column in columns])

    def _neighbours(self, values: list[float], k: int) -> tuple[list[float], list[float], float]:
        """Return the values with the next lengths below and above, and the length's position between them (0 to 1)."""
        longest = self._longest(values, k)
        below = min(max(1.0, math.floor(values[k] / self._spacing + 1e-9) * self._spacing), longest)
        above = min(below + self._spacing, longest)
        proportion = (values[k] - below) / (above - below) if above > below else 0.0
        proportion = min(proportion, 1.0) if proportion > 1e-9 else 0.0
        return [*values[:k], below, *values[k + 1 :]], [*values[:k], above, *values[k + 1 :]], proportion

    def _range(self, parameter: Parameter) -> tuple[float, float]:
        """Return the minimum and the maximum of z; a length is limited by the measured duration."""
        if parameter.whole:
            lasted_s = self._motion.t_s[-1] - self._motion.t_s[0]
            most = math.floor(min(parameter.most, math.ceil(1000 * lasted_s)))
            return 0.0, max(math.log(max(most, 1)), _LENGTH_STEP)
        return super()._range(parameter)


def solve(problem: Problem) -> tuple[Floats, bool]:
    """Return the least-squares solution z with an integer length, and whether the search converged."""
    everything = np.ones(len(problem.start), bool)
    best = _search(
        problem, problem.start if problem.length is None else _find_start(problem, problem.length), everything
    )
    z = problem.with_whole_length(best.x)
    others = np.array([k != problem.length for k in range(len(z))])
    if problem.length is not None and others.any():
        z = _search(problem, z, others).x
    return z, best.status > 0


def _find_start(problem: Problem, k: int) -> Floats:
    """Return a z near the solution, by short searches at lengths over the whole range, then near the best one."""
    shortest = min(math.log(_SHORTEST_LENGTH), problem.most[k])
    lengths = np.linspace(shortest, problem.most[k], _STARTS)
    best = _best_result(
        problem, [problem.start, *(problem.with_length(problem.start, k, length) for length in lengths)]
    )
    for _ in range(_ROUNDS):
        near = _best_result(
            problem, [problem.with_length(best.x, k, best.x[k] + math.log(factor)) for factor in _NEARBY_FACTORS]
        )
        if near.cost >= best.cost * (1 - _MIN_IMPROVEMENT):
            break
        best = near
    start: Floats = best.x
    return start


def _best_result(problem: Problem, starts: Sequence[Floats]) -> Any:
    """Return the best result after a few steps from each start."""
    everything = np.ones(len(problem.start), bool)
    return min(
        (_search(problem, start, everything, _TRIAL_STEPS) for start in starts), key=lambda result: float(result.cost)
    )


def _search(problem: Problem, start: Floats, free: NDArray[np.bool_], max_steps: int = _MAX_STEPS) -> Any:
    """Return scipy's result; its ``x`` is the complete z, including the values that are not ``free``."""

    def complete(part: Floats) -> Floats:
        z = np.array(start, float)
        z[free] = part
        return z

    solution = least_squares(
        lambda part: problem.misfit(complete(part)),
        np.clip(start, problem.least, problem.most)[free],
        jac=lambda part: problem.slopes(complete(part))[:, free],
        bounds=(problem.least[free], problem.most[free]),
        x_scale="jac",
        ftol=1e-10,
        xtol=1e-8,
        gtol=1e-14,
        max_nfev=max_steps,
    )
    solution.x = complete(solution.x)
    return solution

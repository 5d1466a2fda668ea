"""The force of a scene's liquid by its parameters, their fits to measured rows, and what a motion identifies.

With the constant law of drag the force is C_d·g + h: g depends on the wake, h is that of effects without drag. The wake
does not depend on C_d, so one run along a motion serves every C_d.

The drag coefficient alone is fitted by recursive least squares with forgetting. With y = measured − h the sums Σ w g²,
Σ w g·y, Σ w y² and those of neighbouring rows are stored, each multiplied by exp(−Δt/τ) per row: the estimate Σ w g·y /
Σ w g² is that of all rows, weighted by their age (the information form; Ljung 1999, System Identification, §11.2), and
residuals at the present estimate follow from the same sums.

A wake: drag coefficient, length and scaling, by Gauss–Newton over the newest rows with weights by age.

The drag coefficient enters linearly and is solved for at every step (variable projection; Golub & Pereyra 1973); length
N and scaling S are searched by their logarithms, initially from the best point of a grid. The liquid is at rest before
the first row of a stream; if older rows were dropped, the first N ticks of the others only fill the wake and do not
count.

Whether a motion identifies parameters is read from the eigenvalues of the information matrix of their logarithms.

With J (n, p) the derivatives of the force by the logarithms of the parameters, w the weights of forgetting, σ² the
variance of the residuals and ρ their correlation from row to row,

    I = (1 − ρ)/(1 + ρ) · Jᵀ W J / σ² .

Its inverse is the covariance of the logarithms (Cramér–Rao; the factor of ρ is that of Bayley & Hammersley 1946 for a
first-order process). A motion identifies the parameters if the smallest eigenvalue of I is at least `NEEDED`: in every
direction of the parameters the half width of the 95 % interval is then 5 % or less.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from study_app.errors import StudyError
from study_app.haptics.model.effect import TAIL_RATE_HZ
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.scene import Given, Scene
from study_app.haptics.runtime.offline import ModelAlong
from study_app.lab.estimation.sources import Floats, Rows

DRAG: Final = "drag_coefficient"
LENGTH: Final = "length"
SCALING: Final = "scaling"
WAKE: Final = (LENGTH, SCALING)
NAMES: Final = (DRAG, *WAKE)
PLACES: Final = {DRAG: "body.drag_coefficient", LENGTH: "wake.length", SCALING: "wake.scaling"}
"""Their names in the lab (``lab.parameters``)."""
_DRAG_ALONE: Final = {"drag", "wake", "local_wake", "current", "surface"}
"""Effects that exert no force themselves, and drag."""


def prepare() -> None:
    """Compile the model, or load it from the cache."""
    nowhere = np.zeros((1, 3))
    ModelAlong(Scene(), given=True).follow(np.zeros(1), nowhere, nowhere)


def refusal(scene: Scene, names: tuple[str, ...]) -> str:
    """Return why parameters of a scene cannot be estimated, "" if they can."""
    if len(scene.liquids) != 1:
        return f"a force is estimated of one liquid at a time, not of {len(scene.liquids)}: choose one of them"
    liquid = resolve(scene).liquids[0]
    if "drag" not in liquid.effects:
        return "the liquid has no effect drag: the drag coefficient does not change its force"
    if liquid.drag.law != "constant":
        return f'the drag law "{liquid.drag.law}" does not use the drag coefficient: choose the law "constant"'
    if set(names) & set(WAKE) and "wake" not in liquid.effects:
        return "the liquid has no effect wake: estimate the drag coefficient alone"
    return ""


class LiquidModel:
    """The liquid of a scene with one, along a motion given in pieces.

    A `StudyError` is raised where its force does not depend on the drag coefficient.
    """

    def __init__(self, scene: Scene, rate_hz: float) -> None:
        scene = resolve(scene)
        if why := refusal(scene, (DRAG,)):
            raise StudyError(why)
        self._runs = [
            ModelAlong(_with_drag(scene, drag_coefficient, rate_hz), given=True)
            for drag_coefficient in ((1.0,) if set(scene.liquids[0].effects) <= _DRAG_ALONE else (1.0, 2.0))
        ]

    def follow(self, rows: Rows) -> tuple[Floats, Floats]:
        """Return g and h (n, 3) [N] along the next rows."""
        forces_n = [run.follow(rows.t_s, rows.position_m, rows.velocity_mps).force_n for run in self._runs]
        if len(forces_n) == 1:
            return np.asarray(forces_n[0]), np.zeros((len(rows), 3))
        g_n: Floats = forces_n[1] - forces_n[0]
        return g_n, forces_n[0] - g_n


def with_wake(scene: Scene, length: int, scaling: float) -> Scene:
    """Return the scene with another length and scaling of its wake."""
    (liquid,) = scene.liquids
    wake = Wake(**(liquid.wake.model_dump() | {"length": length, "scaling": max(scaling, float(length))}))
    return scene.model_copy(update={"liquids": (liquid.model_copy(update={"wake": wake}),)})


def values_of(scene: Scene) -> dict[str, float]:
    """Return the values of `NAMES` that the scene has."""
    wake = resolve(scene).liquids[0].wake
    found = {DRAG: scene.body.drag_coefficient}
    return found if wake is None else found | {LENGTH: float(wake.length), SCALING: wake.scaling}


def _with_drag(scene: Scene, drag_coefficient: float, rate_hz: float) -> Scene:
    body = scene.body.model_copy(update={"drag_coefficient": drag_coefficient})
    return scene.model_copy(update={"body": body, "rate_hz": rate_hz, "velocity": Given()})


Z: Final = 1.959964
"""Half width of the 95 % interval of a normal distribution, in standard deviations."""
PERCENT: Final = 5.0
NEEDED: Final = (100 * Z / PERCENT) ** 2
LEAST_DEVIATION_N: Final = 1e-6
"""Least variance of residuals, for streams without noise."""
_LOADING: Final = 0.1


class Information(NamedTuple):
    """``smallest`` eigenvalue of the matrix, half widths (p,) of the intervals, and which parameters are vague.

    ``half`` are of the logarithms; ``vague`` (p,) are true for parameters in directions below `NEEDED`.
    """

    smallest: float
    half: Floats
    vague: tuple[bool, ...]

    @property
    def identified(self) -> bool:
        """Whether the motion identifies all of them."""
        return self.smallest >= NEEDED


def information(normal: Floats, variance_n2: float, following: float) -> Information:
    """Return the information of a motion from Jᵀ W J (p, p) [N²], σ² [N²], and ρ, counted from 0 to 0.999."""
    rho = min(max(following, 0.0), 0.999)
    matrix = normal * ((1 - rho) / (1 + rho) / max(variance_n2, LEAST_DEVIATION_N**2))
    sizes, directions = np.linalg.eigh(matrix)
    known = np.maximum(sizes, 1e-300)
    half = Z * np.sqrt(np.sum(directions**2 / known, axis=1))
    weak = directions[:, sizes < NEEDED]
    vague = tuple(bool(row.any()) for row in weak**2 > _LOADING)
    return Information(max(float(sizes[0]), 0.0), half, vague)


def interval(value: float, half: float) -> tuple[float, float]:
    """Return the 95 % interval of a value from the half width of its logarithm."""
    half = min(half, 50.0)
    return float(value * math.exp(-half)), float(value * math.exp(half))


_SUMS: Final = 6
_GG, _GY, _YY, _GG1, _GY1, _YY1 = range(_SUMS)


class RecursiveDrag:
    """Estimates the drag coefficient from all rows so far; a row of the age ``memory_s`` counts by 1/e."""

    def __init__(self, memory_s: float) -> None:
        self._memory_s = memory_s
        self._sums: Floats = np.zeros((_SUMS, 3))
        self._t_s = math.nan
        self._last: tuple[Floats, Floats] | None = None
        self.rows = 0.0

    def take(self, t_s: Floats, g_n: Floats, y_n: Floats, usable: NDArray[np.bool_]) -> None:
        """Add rows: times (n,) [s], force by C_d = 1 and measured force less that of other effects (n, 3) [N]."""
        if len(t_s) == 0:
            return
        if not math.isnan(self._t_s):
            kept = math.exp(-(float(t_s[-1]) - self._t_s) / self._memory_s)
            self._sums *= kept
            self.rows *= kept
        weights = np.exp((t_s - t_s[-1]) / self._memory_s) * usable
        before_g, before_y = self._last if self._last is not None else (np.zeros(3), np.zeros(3))
        earlier_g, earlier_y = np.vstack([before_g, g_n[:-1]]), np.vstack([before_y, y_n[:-1]])
        in_row = weights * np.concatenate([[self._last is not None], usable[:-1]])
        self._sums += [
            weights @ (g_n * g_n),
            weights @ (g_n * y_n),
            weights @ (y_n * y_n),
            in_row @ (g_n * earlier_g),
            in_row @ (g_n * earlier_y + earlier_g * y_n),
            in_row @ (y_n * earlier_y),
        ]
        self.rows += float(weights.sum())
        self._t_s = float(t_s[-1])
        self._last = (g_n[-1], y_n[-1]) if usable[-1] else None

    @property
    def value(self) -> float:
        """C_d; NaN without motion."""
        size = float(self._sums[_GG].sum())
        return float(self._sums[_GY].sum()) / size if size > 0 else math.nan

    @property
    def normal_n2(self) -> float:
        """Σ w g² [N²]."""
        return float(self._sums[_GG].sum())

    @property
    def residual(self) -> tuple[float, float]:
        """Variance [N²] of the residuals of the axes that count, and their correlation from row to row."""
        value = self.value
        counts = self._sums[_YY] + self._sums[_GG] > 0
        squares = float((self._sums[_YY] - 2 * value * self._sums[_GY] + value**2 * self._sums[_GG]).sum())
        following = float((self._sums[_YY1] - value * self._sums[_GY1] + value**2 * self._sums[_GG1]).sum())
        seen = self.rows * int(counts.sum())
        if seen <= 0 or squares <= 0:
            return 0.0, 0.0
        return squares / seen, following / squares

    @property
    def force_rms_n(self) -> float:
        """The root mean square of the measured force [N], less that of other effects."""
        return math.sqrt(float(self._sums[_YY].sum()) / self.rows) if self.rows > 0 else 0.0


LONGEST: Final = 7_500
"""Longest wake that the stored rows can identify [ticks]."""
GRID: Final = (0.5, 0.71, 1.0, 1.41, 2.0)
"""Initial lengths of a search, and initial scalings for each, in multiples of the scene's."""
_STEPS: Final = 8
_HALVINGS: Final = 4
_MOST_STEP: Final = 0.4
_ENDS: Final = 1e-3
_LENGTH_STEP: Final = 0.02
_SCALING_STEP: Final = 0.01
_EDGE: Final = 0.9
"""A length beyond this share of the measurement may in fact be longer."""
_DAMPING: Final = 1e-6
"""Least relative eigenvalue of the normal matrix: other directions are not changed."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class WakeFit:
    """The result of a search: values by name, the information of the motion about them, and the residual force.

    ``following`` is the correlation of residuals from row to row; ``edge`` tells whether the wake may be longer than
    the measurement: no element has left it yet.
    """

    values: dict[str, float]
    information: Information
    following: float
    rms_n: float
    force_rms_n: float
    edge: bool = False


@dataclass(slots=True, eq=False, kw_only=True)
class _At:
    """The force at N and S: ``g_n`` by C_d = 1, what was measured of it (rows, 3), C_d and the cost there."""

    length: int
    scaling: float
    g_n: Floats
    y_n: Floats
    drag: float
    cost: float


class WakeSearch:
    """A search over rows for the parameters ``names``, the drag coefficient among them; the scene has the others.

    ``from_rest`` is whether the first row is the start of the stream; a row of the age ``memory_s`` counts by 1/e.
    """

    def __init__(
        self, scene: Scene, names: Sequence[str], rows: Rows, rate_hz: float, *, from_rest: bool, memory_s: float
    ) -> None:
        self._scene, self._names, self._rows, self._rate_hz = scene, tuple(names), rows, rate_hz
        self._from_rest = from_rest
        self._weights: Floats = np.exp((rows.t_s - rows.t_s[-1]) / memory_s) * rows.usable
        self._axes = np.flatnonzero(rows.force_n.any(axis=0))

    def run(self, length: int, scaling: float, *, anew: bool) -> WakeFit | None:
        """Return the best values, starting from these, None without motion; ``anew`` searches the grid first."""
        grid = GRID if anew else (1.0,)
        starts = {self._bounded(length * n, scaling * s) for n, s in itertools.product(grid, grid)}
        at = min((self._at(*start) for start in starts), key=lambda it: it.cost)
        if not math.isfinite(at.drag):
            return None
        slopes = self._slopes(at)
        for _ in range(_STEPS):
            found, ended = self._stepped(at, slopes)
            if found is None:
                break
            at, slopes = found, self._slopes(found)
            if ended:
                break
        return self._fit(at, slopes)

    def _stepped(self, at: _At, slopes: Floats) -> tuple[_At | None, bool]:
        """Return the result of a Gauss–Newton step, None if none is better, and whether the step is small."""
        weights = self._counting(at.length)
        residual_n = self._flat(at.y_n - at.drag * at.g_n)
        normal = np.einsum("ni,n,nj->ij", slopes, weights, slopes)
        sizes, directions = np.linalg.eigh(normal)
        inverse = np.where(sizes > _DAMPING * sizes[-1], 1 / np.maximum(sizes, 1e-300), 0.0)
        step = directions @ (inverse * (directions.T @ np.einsum("ni,n->i", slopes, weights * residual_n)))
        by_name = dict(zip(self._names, np.clip(step, -_MOST_STEP, _MOST_STEP), strict=True))
        for _ in range(_HALVINGS):
            length = at.length * math.exp(by_name.get(LENGTH, 0.0))
            scaling = at.scaling * math.exp(by_name.get(SCALING, 0.0))
            there = self._bounded(length, scaling)
            if there == (at.length, at.scaling):
                return None, True
            found = self._at(*there)
            if found.cost < at.cost:
                return found, max(abs(it) for it in by_name.values()) < _ENDS
            by_name = {name: it / 2 for name, it in by_name.items()}
        return None, True

    def _bounded(self, length: float, scaling: float) -> tuple[int, float]:
        """Return a permitted length and scaling: N ≤ S, with fixed parameters unchanged."""
        wake = self._scene.liquids[0].wake
        assert wake is not None  # noqa: S101 - refused before
        length = length if LENGTH in self._names else wake.length
        scaling = scaling if SCALING in self._names else wake.scaling
        most = min(LONGEST, self._most_ticks())
        if SCALING not in self._names:
            most = min(most, math.floor(scaling))
        whole = max(1, min(round(length), most)) if LENGTH in self._names else wake.length
        return whole, max(scaling, float(whole))

    def _most_ticks(self) -> int:
        """Return the length that leaves half of the rows to compare."""
        lasted_s = float(self._rows.t_s[-1] - self._rows.t_s[0])
        return max(2, int(lasted_s * TAIL_RATE_HZ / (1 if self._from_rest else 2)))

    def _at(self, length: int, scaling: float) -> _At:
        model = LiquidModel(with_wake(self._scene, length, scaling), self._rate_hz)
        g_n, h_n = model.follow(self._rows)
        y_n = self._rows.force_n - h_n
        weights, g, y = self._counting(length), self._flat(g_n), self._flat(y_n)
        size = _dot(weights, g, g)
        drag = _dot(weights, g, y) / size if size > 0 else math.nan
        left = y - drag * g if size > 0 else y
        share = max(float(weights.sum()), 1e-12)  # longer wakes leave fewer rows
        return _At(length=length, scaling=scaling, g_n=g_n, y_n=y_n, drag=drag, cost=_dot(weights, left, left) / share)

    def _slopes(self, at: _At) -> Floats:
        """Return the derivatives (m, p) of the force by the logarithms of the parameters [N]."""
        columns = []
        for name in self._names:
            if name == DRAG:
                columns.append(at.drag * self._flat(at.g_n))
                continue
            if name == LENGTH:
                shorter = at.length - max(1, round(_LENGTH_STEP * at.length))
                there = (max(shorter, 1), at.scaling)
                way = math.log(there[0] / at.length) if at.length > 1 else 1.0
            else:
                there, way = (at.length, at.scaling * (1 + _SCALING_STEP)), math.log1p(_SCALING_STEP)
            other = self._at(*there)
            columns.append(at.drag * self._flat(other.g_n - at.g_n) / way)
        return np.column_stack(columns)

    def _fit(self, at: _At, slopes: Floats) -> WakeFit:
        weights = self._counting(at.length)
        residual = self._flat(at.y_n - at.drag * at.g_n)
        share = max(float(weights.sum()), 1e-12)
        squares = _dot(weights, residual, residual)
        rows = residual.reshape(len(self._rows), -1)
        each = weights.reshape(rows.shape)
        follow = float(np.sum(np.minimum(each[1:], each[:-1]) * rows[1:] * rows[:-1]))
        normal = np.einsum("ni,n,nj->ij", slopes, weights, slopes)
        following = follow / squares if squares > 0 else 0.0
        found = information(normal, squares / share, following)
        values = {DRAG: at.drag, LENGTH: float(at.length), SCALING: at.scaling}
        measured = self._flat(at.y_n)
        axes = max(rows.shape[1], 1)
        return WakeFit(
            values={name: values[name] for name in self._names},
            information=found,
            following=following,
            rms_n=math.sqrt(squares / share * axes),
            force_rms_n=math.sqrt(_dot(weights, measured, measured) / share * axes),
            edge=LENGTH in self._names and at.length > _EDGE * min(LONGEST, self._most_ticks()),
        )

    def _counting(self, length: int) -> Floats:
        """Return the weight of each residual, (m,)."""
        weights = self._weights
        if not self._from_rest:
            weights = weights.copy()
            filling = math.ceil(length * self._rate_hz / TAIL_RATE_HZ)
            weights[:filling] = 0.0
        return np.repeat(weights, len(self._axes))

    def _flat(self, vectors_n: Floats) -> Floats:
        """Return the components in use of (rows, 3) as (m,)."""
        return np.ascontiguousarray(vectors_n[:, self._axes]).ravel()


def _dot(weights: Floats, one: Floats, other: Floats) -> float:
    """Return Σ w a b, in one thread: a linear algebra library would use several even for small sums."""
    return float(np.einsum("n,n,n->", weights, one, other))

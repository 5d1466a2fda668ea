"""Drag coefficient, length and scaling of a wake, by Gauss–Newton over the newest rows with weights by age.

The drag coefficient enters linearly and is solved for at every step (variable projection; Golub & Pereyra 1973); length
N and scaling S are searched by their logarithms, initially from the best point of a grid. The liquid is at rest before
the first row of a stream; if older rows were dropped, the first N ticks of the others only fill the wake and do not
count.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from study_app.haptics.model.effect import TAIL_RATE_HZ
from study_app.haptics.model.scene import Scene
from study_app.lab.estimation.information import Information, information
from study_app.lab.estimation.liquid_model import DRAG, LENGTH, SCALING, LiquidModel, with_wake
from study_app.lab.estimation.rows import Floats, Rows

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


@dataclass(frozen=True, slots=True, eq=False)
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


@dataclass(slots=True, eq=False)
class _At:
    """The force at N and S: ``g_n`` by C_d = 1, what was measured of it (rows, 3), C_d and the cost there."""

    length: int
    scaling: float
    g_n: Floats
    y_n: Floats
    drag: float
    cost: float


class WakeSearch:
    """A search over rows for the parameters ``names`` of a scene.

    Parameters
    ----------
    scene : Scene
        With one liquid; it has the fixed parameters.
    names : sequence of str
        Of ``liquid_model.NAMES``, the drag coefficient among them.
    from_rest : bool
        Whether the first row is the start of the stream.
    memory_s : float
        A row of this age counts by 1/e.
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
        return _At(length, scaling, g_n, y_n, drag, _dot(weights, left, left) / share)

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
            {name: values[name] for name in self._names},
            found,
            following,
            math.sqrt(squares / share * axes),
            math.sqrt(_dot(weights, measured, measured) / share * axes),
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

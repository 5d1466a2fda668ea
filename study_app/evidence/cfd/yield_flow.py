"""Steady creeping flow of Herschel–Bulkley liquids around a ball: the fluid solver's drag compared with the law's.

In units of the ball's diameter D, its speed U and the stress K (U/D)^n, the viscosity is

    η = g^(n−1) + Bi/g,   g² = γ̇² + ε²,   γ̇² = 2 e:e,   Bi = τ_y/(K (U/D)^n),

with the rate of strain e and a small ε, which makes unyielded liquid very viscous instead of rigid. Each flow is found
by Newton's method, starting from the flow with a larger ε. The table contains the drag divided by 3πD² K (U/D)^n, the
drag of a Newtonian liquid with the viscosity K (U/D)^(n−1). The liquid is unbounded: it moves only near the ball.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Final

import numpy as np

from study_app.errors import StudyError
from study_app.evidence.cfd.flow import ORDER, Flow, Grid, import_ngsolve
from study_app.evidence.cfd.solver import provenance_notes
from study_app.evidence.cfd.stored_flows import file_bytes, package, read_table
from study_app.evidence.table import Evidence, Table
from study_app.haptics.model.laws import HerschelBulkley, creeping_n
from study_app.haptics.model.motion import Floats
from study_app.store.files import make_folder, write_file

COMMAND: Final = "liquid-study cfd --materials --solve"
FILE: Final = "herschel_bulkley.csv"
_COMPARISON_FILE: Final = "materials.md"
COLUMNS: Final = ("flow_index", "bingham", "drag", "drag_coarse", "drag_smooth")
"""``drag_coarse`` is the drag on a coarser grid, ``drag_smooth`` that with an ε 3.3 times as large."""
INDICES: Final = (0.3, 0.5, 0.7, 1.0)
BINGHAM: Final = (0.1, 1.0, 10.0, 30.0)
GRID: Final = Grid(ahead=15, behind=25, aside=15, ball=0.08, near=0.3, far=4)
COARSE: Final = Grid(ahead=15, behind=25, aside=15, ball=0.15, near=0.6, far=4)
SMOOTHING: Final = (0.03, 0.005, 0.001, 0.0003)
"""Successive values of ε/√(1 + Bi); the scaling allows for the faster shear next to the ball at larger Bi."""
PERMITTED: Final = 0.04
"""Greatest error of the law."""
_MAX_ITERATIONS: Final = 80
_TOLERANCE: Final = 1e-7
_MIN_DAMPING: Final = 0.05


class YieldFlow(Flow):
    """Creeping flow of a Herschel–Bulkley liquid around the ball."""

    def drags(self, flow_index: float, bingham: Sequence[float]) -> Iterator[tuple[float, float]]:
        """Yield the drag at increasing Bingham numbers, with the smallest and the second smallest ε."""
        ng = self._ng
        flow, residual = ng.GridFunction(self._space), self._zeros()
        flow.vec.data = self._stream
        yield_stress, smoothing = ng.Parameter(0.0), ng.Parameter(1.0)
        (u, w, _), r = self._trial, ng.y
        du, dw = ng.grad(u), ng.grad(w)
        squared = 2 * (du[0] ** 2 + dw[1] ** 2 + (w / r) ** 2) + (du[1] + dw[0]) ** 2 + smoothing * smoothing
        viscosity = ng.exp((flow_index - 1) / 2 * ng.log(squared)) + yield_stress / ng.sqrt(squared)
        form = ng.BilinearForm(self._space)
        form += self._integral(self._stokes(viscosity))
        for value in bingham:
            yield_stress.Set(value)
            forces = []
            for small in SMOOTHING:
                smoothing.Set(small * math.sqrt(1 + value))
                if not self._solve(form, flow):
                    raise StudyError(f"no steady flow was found at n = {flow_index:g}, Bi = {value:g}")
                form.Apply(flow.vec, residual)
                forces.append(-2 * math.pi * ng.InnerProduct(residual, self._ball_indicator) / (3 * math.pi))
            yield forces[-1], forces[-2]

    def _solve(self, form: Any, flow: Any) -> bool:
        """Solve by a damped Newton method; return whether it converged."""
        ng = self._ng
        free, residual, step, before, free_residual = ng.Projector(self._free, True), *(self._zeros() for _ in range(4))

        def misfit() -> float:
            form.Apply(flow.vec, residual)
            free_residual.data = free * residual
            return float(free_residual.Norm())

        residual_size = misfit()
        for _ in range(_MAX_ITERATIONS):
            form.AssembleLinearization(flow.vec)
            step.data = form.mat.Inverse(self._free, inverse="umfpack") * residual
            before.data = flow.vec
            damping = 1.0
            while True:
                flow.vec.data = before - damping * step
                new_residual = misfit()
                if new_residual < (1 - 0.1 * damping) * residual_size or damping < _MIN_DAMPING:
                    break
                damping /= 2
            residual_size = new_residual
            if step.Norm() < _TOLERANCE * flow.vec.Norm():
                return True
        return False


def solve_materials(to: Path, executor: Executor, progress: Callable[[str], None]) -> Path:
    """Solve the Herschel–Bulkley liquids with an executor; return the table written into the folder ``to``.

    Raises
    ------
    StudyError
        NGSolve is not installed, no steady flow was found, or the file cannot be written.
    """
    import_ngsolve()
    make_folder(to, waits=False)
    rows: list[tuple[float, ...]] = []
    for index, solved in zip(INDICES, executor.map(_solve_flow, INDICES), strict=True):
        rows += solved
        progress(f"n {index:g}: drag {', '.join(f'{row[2]:.4f}' for row in solved)}")
    notes = {
        "title": "drag on a sphere in creeping flow of Herschel–Bulkley liquids, divided by 3πD² K (U/D)^n",
        **provenance_notes(COMMAND),
        "method": f"axisymmetric, order {ORDER}, ε/√(1 + Bi) {SMOOTHING[-1]:g} and {SMOOTHING[-2]:g}: {GRID}; {COARSE}",
    }
    write_file(to / FILE, file_bytes(notes, dict(zip(COLUMNS, np.array(rows).T, strict=True))))
    return to / FILE


def _solve_flow(flow_index: float) -> list[tuple[float, ...]]:
    fine, coarse = YieldFlow(GRID).drags(flow_index, BINGHAM), YieldFlow(COARSE).drags(flow_index, BINGHAM)
    return [
        (flow_index, bingham, drag, coarse_drag, smooth)
        for bingham, (drag, smooth), (coarse_drag, _) in zip(BINGHAM, fine, coarse, strict=True)
    ]


def stored_materials(folder: Traversable | None = None) -> dict[str, Floats]:
    """Return the columns of the stored table; it raises the errors of `stored_flows.read_table`."""
    return read_table((folder or package()) / FILE, COLUMNS).columns


def errors(columns: dict[str, Floats]) -> Floats:
    """Return the law's error (n,) relative to the solver's drag."""
    liquids = [
        HerschelBulkley(yield_stress_pa=bingham, consistency_pa_sn=1.0, flow_index=index)
        for index, bingham in zip(columns["flow_index"].tolist(), columns["bingham"].tolist(), strict=True)
    ]
    drags = np.array([sum(creeping_n(liquid, 1.0, 1.0)) / (3 * math.pi) for liquid in liquids])
    relative_errors: Floats = drags / columns["drag"] - 1
    return relative_errors


def yield_flow_evidence(columns: dict[str, Floats]) -> Evidence:
    """Return the comparison as a table."""
    error = errors(columns)
    grid, smooth = (float(np.abs(columns[name] / columns["drag"] - 1).max()) for name in COLUMNS[3:])
    rows = [[f"{bingham:g}"] for bingham in BINGHAM]
    for row, bingham in zip(rows, BINGHAM, strict=True):
        matches = columns["bingham"] == bingham
        pairs = zip(columns["drag"][matches], error[matches], strict=True)
        row += [f"{drag:.3f} ({100 * relative_error:+.1f} %)" for drag, relative_error in pairs]
    table = Table(("Bi", *(f"n {index:g}" for index in INDICES)), rows)
    text = (
        "Drag on a sphere in creeping flow of Herschel–Bulkley liquids, computed by the solver and divided by "
        "3πD² K (U/D)^n; the error of the law is in brackets.\n\n"
        f"{table.markdown()}\n\n"
        f"The error of the law is at most {np.abs(error).max():.1%} (permitted: {PERMITTED:.0%}). Edges twice as long "
        f"change the drag by at most {grid:.2%}; an ε 3.3 times as large changes it by at most {smooth:.2%}.\n"
    )
    return Evidence(text, {_COMPARISON_FILE: text})

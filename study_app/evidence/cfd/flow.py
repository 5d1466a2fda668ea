"""Axisymmetric flow around a ball at rest in a wide stream, by finite elements (NGSolve, the extra ``cfd``).

The units are the ball's diameter, the stream's speed and the liquid's density. The momentum equation and the condition
of incompressibility, weighted by the distance r from the axis,

    ∂u/∂t + (u·∇)u = dU/dt e_x − ∇p + ∇·2νε(u),   ∇·u = 0,   ν = 1/Re,

are solved with Taylor–Hood elements of order 3 on curved triangles. The stream U(t) is prescribed on the borders ahead
and aside, and the outflow behind is free. The term dU/dt replaces the pressure that a frame moving with the ball would
add, so that forces are those of the resting frame. The drag is the residual of the momentum equation at the ball
(Babuška & Miller 1984), which is more accurate than an integral of stresses. Time steps use backward differences of
order 2 and convection extrapolated with order 2, so that one matrix serves all steps of equal size.
"""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.motion import Floats

ORDER: Final = 3
_MAX_ITERATIONS: Final = 20
_TOLERANCE: Final = 1e-8
_EDGE_TOLERANCE: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Extent of the mesh ahead of, behind and beside the ball, and its edge lengths, in diameters.

    ``ball`` is the longest edge on the ball, ``near`` the longest within two diameters of it and five behind it. Edges
    are four times as long in the wake and ``far`` in the rest of the liquid. A ``symmetric`` grid, for a ball that
    moves back and forth, extends as far ahead of the ball as behind it.
    """

    ahead: float
    behind: float
    aside: float
    ball: float
    near: float
    far: float
    symmetric: bool = False


def import_ngsolve() -> Any:
    """Import NGSolve, with linear algebra limited to one thread.

    With matrices this small, more threads make it ten times slower on busy cores.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        import ngsolve  # noqa: PLC0415 - an extra of 350 MB
    except ImportError as error:
        raise StudyError(
            "the fluid solver NGSolve is not installed: pip install ngsolve (350 MB), or use the stored tables"
        ) from error
    return ngsolve


class Flow:
    """The liquid around the ball on one grid; ``unknowns`` is the number of degrees of freedom."""

    def __init__(self, grid: Grid) -> None:
        self._ng = ng = import_ngsolve()
        self.grid = grid
        self._mesh = mesh = _mesh(grid)
        walls = "ball|ahead|aside"
        along, across = (ng.H1(mesh, order=ORDER, dirichlet=it) for it in (walls, f"{walls}|axis"))
        self._space = along * across * ng.H1(mesh, order=ORDER - 1)
        self._free = self._space.FreeDofs()
        self.unknowns = int(self._space.ndof)
        self._trial, self._test = self._space.TnT()
        self._ball_indicator = self._indicator_of("ball")
        self._stream = self._indicator_of("ahead|aside")

    def steady(self, reynolds: Sequence[float]) -> list[float]:
        """Return C_d at increasing Reynolds numbers, each by Newton's method starting from the previous solution."""
        ng = self._ng
        flow, residual, step = ng.GridFunction(self._space), self._zeros(), self._zeros()
        flow.vec.data = self._stream
        forces = []
        for value in reynolds:
            form = ng.BilinearForm(self._space)
            form += self._integral(self._stokes(1 / value) + self._convection(*self._trial[:2]))
            for _ in range(_MAX_ITERATIONS):
                form.Apply(flow.vec, residual)
                form.AssembleLinearization(flow.vec)
                step.data = form.mat.Inverse(self._free, inverse="umfpack") * residual
                flow.vec.data -= step
                if step.Norm() < _TOLERANCE * flow.vec.Norm():
                    break
            else:
                raise StudyError(f"no steady flow was found at Re = {value:g}: approach it in smaller steps")
            form.Apply(flow.vec, residual)
            forces.append(-2 * math.pi * ng.InnerProduct(residual, self._ball_indicator) / (math.pi / 8))
        return forces

    def unsteady(
        self, reynolds: float, times: Floats, speed: Callable[[float], float], *, convection: bool = True
    ) -> Floats:
        """Return the force along the stream at ``times`` (n,) [ρU²D²], for a stream at rest until the first time.

        Without ``convection`` the flow is creeping.
        """
        ng = self._ng
        stokes, mass = (ng.BilinearForm(self._space) for _ in range(2))
        stokes += self._integral(self._stokes(1 / reynolds))
        mass += self._integral(self._inertia())
        push, carried = ng.LinearForm(self._space), ng.LinearForm(self._space)
        flow = ng.GridFunction(self._space)
        push += self._integral(ng.y * self._test[0])
        carried += self._integral(self._convection(*flow.components[:2]))
        for form in (stokes, mass, push):
            form.Assemble()
        matrices: dict[float, tuple[Any, Any]] = {}
        load, rest, change, before, previous, carried_before, carried_previous = (self._zeros() for _ in range(7))
        drag, times_list = np.zeros(len(times)), times.tolist()  # NGSolve accepts no numpy numbers
        for k in range(1, len(times)):
            step = times_list[k] - times_list[k - 1]
            growth = step / (times_list[k - 1] - times_list[k - 2]) if k > 1 else 1.0
            now, last, first = (1 + 2 * growth) / (1 + growth), 1 + growth, growth**2 / (1 + growth)
            weight = round(now / step, 9)
            if weight not in matrices:
                matrices[weight] = self._with_inverse(stokes, mass, weight)
            matrix, inverse = matrices[weight]
            speeds = [speed(times_list[max(k - back, 0)]) for back in range(3)]
            change.data = first / step * before - last / step * previous
            load.data = (
                weight * speeds[0] - last / step * speeds[1] + first / step * speeds[2]
            ) * push.vec - mass.mat * change
            rest.data = load - (1 + growth) * carried_previous + growth * carried_before
            flow.vec.data = speeds[0] * self._stream
            rest.data -= matrix * flow.vec
            flow.vec.data += inverse * rest
            load.data -= matrix * flow.vec
            if convection:
                carried.Assemble()
                carried_before.data, carried_previous.data = carried_previous, carried.vec
                load.data -= carried.vec
            before.data, previous.data = previous, flow.vec
            drag[k] = 2 * math.pi * ng.InnerProduct(load, self._ball_indicator)
            if not math.isfinite(drag[k]):
                raise StudyError(
                    f"the solution diverged at t = {times_list[k]:g} D/U: use steps shorter than {step:g} D/U"
                )
        return drag

    def _with_inverse(self, stokes: Any, mass: Any, weight: float) -> tuple[Any, Any]:
        """Return the matrix of a time step, and its inverse."""
        matrix = stokes.mat.CreateMatrix()
        matrix.AsVector().data = stokes.mat.AsVector() + weight * mass.mat.AsVector()
        return matrix, matrix.Inverse(self._free, inverse="umfpack")

    def _zeros(self) -> Any:
        vector = self._ng.BaseVector(self.unknowns)
        vector[:] = 0.0
        return vector

    def _indicator_of(self, border: str) -> Any:
        """Return the velocity vector that is 1 along the stream on one boundary and 0 at all other nodes."""
        flow, vector = self._ng.GridFunction(self._space), self._zeros()
        flow.components[0].Set(1, definedon=self._mesh.Boundaries(border))
        vector.data = flow.vec
        return vector

    def _integral(self, integrand: Any) -> Any:
        return integrand * self._ng.dx(bonus_intorder=2)

    def _inertia(self) -> Any:
        (u, w, _), (v, z, _) = self._trial, self._test
        return self._ng.y * (u * v + w * z)

    def _convection(self, u: Any, w: Any) -> Any:
        grad, (v, z, _) = self._ng.grad, self._test
        return self._ng.y * ((u * grad(u)[0] + w * grad(u)[1]) * v + (u * grad(w)[0] + w * grad(w)[1]) * z)

    def _stokes(self, viscosity: float) -> Any:
        """Return the terms of viscosity, pressure and incompressibility."""
        (u, w, p), (v, z, q), r = self._trial, self._test, self._ng.y
        du, dw, dv, dz = (self._ng.grad(component) for component in (u, w, v, z))
        strain = 2 * du[0] * dv[0] + 2 * dw[1] * dz[1] + (du[1] + dw[0]) * (dv[1] + dz[0])
        around = 2 * w * z / r
        return viscosity * (r * strain + around) - p * (r * (dv[0] + dz[1]) + z) - q * (r * (du[0] + dw[1]) + w)


def _mesh(grid: Grid) -> Any:
    """Return a mesh of curved triangles for the half plane above the axis, with named edges."""
    from netgen.occ import Glue, OCCGeometry, WorkPlane  # noqa: PLC0415 - comes with NGSolve

    def box(ahead: float, long: float, high: float) -> Any:
        return WorkPlane().MoveTo(-ahead, 0).Rectangle(long, high).Face() - ball

    ball = WorkPlane().Circle(0, 0, 0.5).Face()
    near, wake = (box(5, 10, 2), box(20, 40, 4)) if grid.symmetric else (box(2, 7, 2), box(4, 24, 4))
    wake -= near
    far = box(grid.ahead, grid.ahead + grid.behind, grid.aside) - near - wake
    for part, max_edge in ((near, grid.near), (wake, 4 * grid.near), (far, grid.far)):
        part.faces.maxh = max_edge
    domain = Glue([near, wake, far])
    for edge in domain.edges:
        edge.name = _border_name(grid, edge)
        if edge.name == "ball":
            edge.maxh = grid.ball
    mesh = import_ngsolve().Mesh(OCCGeometry(domain, dim=2).GenerateMesh(maxh=grid.far, grading=0.25))
    mesh.Curve(ORDER)
    return mesh


def _border_name(grid: Grid, edge: Any) -> str:
    x, r = edge.center[0], edge.center[1]
    if r < _EDGE_TOLERANCE:
        return "axis"
    if (
        math.hypot(edge.start[0], edge.start[1]) < 0.5 + _EDGE_TOLERANCE
        and math.hypot(edge.end[0], edge.end[1]) < 0.5 + _EDGE_TOLERANCE
    ):
        return "ball"
    if abs(x + grid.ahead) < _EDGE_TOLERANCE:
        return "ahead"
    if abs(x - grid.behind) < _EDGE_TOLERANCE:
        return "behind"
    return "aside" if abs(r - grid.aside) < _EDGE_TOLERANCE else "between"

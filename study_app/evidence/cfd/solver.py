"""Solve, check and store every case, which takes about 20 minutes on one core and requires the extra ``cfd``.

Every motion is solved three times: normally, on a coarser grid with steps twice as long, and without convection, where
the exact force is known. A solution is not stored if one of the two differences exceeds `PERMITTED`.
"""

import time
from collections.abc import Callable
from concurrent.futures import Executor
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np

from study_app.errors import StudyError
from study_app.evidence.cfd.flow import ORDER, Flow, Grid, import_ngsolve
from study_app.evidence.cfd.solved_cases import HELD_OUT, TRAINING, Case, cases, cases_of
from study_app.evidence.cfd.stored_flows import (
    HELD_OUT_FOLDER,
    MOTION,
    STEADY,
    STEADY_FILE,
    TRAINING_FOLDER,
    file_bytes,
    notes_of,
)
from study_app.evidence.computer import machine
from study_app.haptics.model.motion import Floats
from study_app.store.files import make_folder, write_file

COMMAND: Final = "liquid-study cfd --solve"
GRID: Final = Grid(ahead=40, behind=80, aside=40, ball=0.1, near=0.4, far=8)
COARSE: Final = Grid(ahead=40, behind=80, aside=40, ball=0.14, near=0.6, far=10)
_SYMMETRIC: Final = Grid(ahead=40, behind=40, aside=40, ball=0.1, near=0.4, far=8, symmetric=True)
_SYMMETRIC_COARSE: Final = Grid(ahead=40, behind=40, aside=40, ball=0.14, near=0.6, far=10, symmetric=True)
_WIDE: Final = Grid(ahead=80, behind=160, aside=80, ball=0.07, near=0.25, far=16)
_WIDE_COARSE: Final = Grid(ahead=80, behind=160, aside=80, ball=0.1, near=0.4, far=16)
_STEP: Final = 0.005
FAST_REYNOLDS: Final = 50.0
"""Reynolds number above which steps are halved, because the solution on the coarse grid would diverge."""
_REYNOLDS: Final = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)

PERMITTED: Final = 0.02
"""Greatest difference from the coarse and from the exact linear solution, as a proportion of the greatest force."""


def solve(to: Path, executor: Executor, progress: Callable[[str], None]) -> tuple[Path, ...]:
    """Solve all cases and steady drag with an executor, write the tables into the folder ``to``, and return the files.

    Raises
    ------
    StudyError
        NGSolve is not installed, a solution is not accurate enough, or a file cannot be written.
    """
    import_ngsolve()
    tables = {
        folder / f"{case.name}.csv": executor.submit(_solve_case, case, *grids)
        for group_cases, folder, grids in (
            (cases(), to, (GRID, COARSE)),
            (cases_of(TRAINING), to / TRAINING_FOLDER, (_SYMMETRIC, _SYMMETRIC_COARSE)),
            (cases_of(HELD_OUT), to / HELD_OUT_FOLDER, (_SYMMETRIC, _SYMMETRIC_COARSE)),
        )
        for case in group_cases
    }
    tables[to / STEADY_FILE] = executor.submit(steady_table)
    for number, (path, table) in enumerate(tables.items(), start=1):
        progress(f"{path.name}, {number} of {len(tables)} ...")
        make_folder(path.parent, waits=False)
        write_file(path, table.result())
    return tuple(tables)


def _solve_case(case: Case, grid: Grid, coarse: Grid) -> bytes:
    step = _STEP if case.reynolds <= FAST_REYNOLDS else _STEP / 2
    return motion_table(case, flow_of(grid), flow_of(coarse), step)


@cache
def flow_of(grid: Grid) -> Flow:
    """Return the flow on a grid; each worker builds the mesh once."""
    return Flow(grid)


def motion_table(case: Case, flow: Flow, coarse: Flow, step: float = _STEP) -> bytes:
    """Return the file content of one case, with a row every `_STEP` or ``step``, whichever is longer."""
    profile = case.profile
    times, coarse_times = profile.solution_times(step), profile.solution_times(2 * step)

    def speed(t: float) -> float:
        return float(profile.speed(np.array([t]))[0])

    began_s = time.process_time()
    drag = flow.unsteady(case.reynolds, times, speed)
    computing_s = time.process_time() - began_s
    linear = flow.unsteady(case.reynolds, times, speed, convection=False)
    exact = profile.linear_drags(times, case.reynolds)
    grid_error = np.interp(times, coarse_times, coarse.unsteady(case.reynolds, coarse_times, speed)) - drag
    checks = {
        "from_coarse": _check(case, "the coarse solution", grid_error, drag, times),
        "from_exact": _check(case, "the exact force without convection", linear - exact, exact, times),
    }
    steps = f"{step:g}, {2 * step:g}, {4 * step:g} D/U, increasing with the time after each start and stop"
    notes = {
        "title": case.title,
        **notes_of(case),
        "motion": profile.description,
        "reynolds": f"{case.reynolds:.6g}",
        **provenance_notes(),
        "method": f"axisymmetric, order {ORDER}, {flow.unknowns} unknowns, {flow.grid}, steps {steps}",
        "from_coarse": f"{checks['from_coarse']} ({coarse.unknowns} unknowns, steps twice as long)",
        "from_exact": f"{checks['from_exact']} (convection off; Stokes, added mass and Basset)",
        "computing": "single-threaded processor time per second of motion",
        "computing_s_per_s": f"{computing_s / (profile.end * case.unit_s):.3g}",
    }
    columns = (times * case.unit_s, case.speed_mps * profile.speed(times), 0.0 - drag * case.unit_n)
    every = max(1, round(_STEP / step))
    return file_bytes(notes, dict(zip(MOTION, (column[::every] for column in columns), strict=True)))


def steady_table() -> bytes:
    """Return the file content of steady drag."""
    solved = [Flow(grid) for grid in (_WIDE, _WIDE_COARSE, GRID)]
    columns = [flow.steady(_REYNOLDS) for flow in solved]
    method = "; ".join(
        f"{flow.unknowns} unknowns, {grid}" for flow, grid in zip(solved, (_WIDE, _WIDE_COARSE, GRID), strict=True)
    )
    notes = {
        "title": "steady drag of a sphere",
        **provenance_notes(),
        "method": f"axisymmetric, order {ORDER}: {method}",
    }
    return file_bytes(notes, dict(zip(STEADY, (_REYNOLDS, *columns), strict=True)))


def _check(case: Case, other: str, difference: Floats, force: Floats, times: Floats) -> str:
    """Return the greatest differences relative to the greatest force, during acceleration and otherwise."""
    size = np.abs(difference) / np.abs(force).max()
    ramps = case.profile.near_steps(times)
    worst = float(size.max())
    if not worst <= PERMITTED:
        raise StudyError(
            f"{case.liquid_id}, {case.title}, differs from {other} by {worst:.1%} of the largest force, which is more "
            f"than the permitted {PERMITTED:.0%}: nothing was stored"
        )
    return (
        f"at most {size[ramps].max():.2%} of the largest force near speed changes, {size[~ramps].max():.3%} elsewhere"
    )


def provenance_notes(command: str = COMMAND) -> dict[str, str]:
    """Return the notes that say which command and versions produced a table."""
    return {
        "command": command,
        "machine": machine(),
        "solver": ", ".join(f"{name} {version(name)}" for name in ("ngsolve", "netgen-mesher")),
    }

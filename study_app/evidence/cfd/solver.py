"""Solves, checks and stores every case: about 20 minutes of one core's time, with the extra ``cfd``.

Every motion is solved three times: as it is; on a coarser grid with steps twice as long; and without convection, where
the exact force is known. A solution that misses one of the two by more than is permitted is not stored.
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
from study_app.evidence.cfd.flow import ORDER, Flow, Grid, library
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
_BOTH_WAYS: Final = Grid(ahead=40, behind=40, aside=40, ball=0.1, near=0.4, far=8, symmetric=True)
_BOTH_WAYS_COARSE: Final = Grid(ahead=40, behind=40, aside=40, ball=0.14, near=0.6, far=10, symmetric=True)
_WIDE: Final = Grid(ahead=80, behind=160, aside=80, ball=0.07, near=0.25, far=16)
_WIDE_COARSE: Final = Grid(ahead=80, behind=160, aside=80, ball=0.1, near=0.4, far=16)
_STEP: Final = 0.005
FAST_REYNOLDS: Final = 50.0
"""Above this Reynolds number, steps are halved: otherwise the solution on the coarse grid would diverge."""
_REYNOLDS: Final = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)

PERMITTED: Final = 0.02
"""Greatest difference, as a share of the greatest force: from the coarse solution, and from the exact linear one."""


def solve(to: Path, executor: Executor, progress: Callable[[str], None]) -> tuple[Path, ...]:
    """Solve all cases and steady drag with an executor, write the tables into the folder ``to``, and return the files.

    Raises
    ------
    StudyError
        NGSolve is not installed, a solution is not accurate enough, or a file cannot be written.
    """
    library()
    solved = {
        folder / f"{case.name}.csv": executor.submit(_solve_case, case, *grids)
        for some, folder, grids in (
            (cases(), to, (GRID, COARSE)),
            (cases_of(TRAINING), to / TRAINING_FOLDER, (_BOTH_WAYS, _BOTH_WAYS_COARSE)),
            (cases_of(HELD_OUT), to / HELD_OUT_FOLDER, (_BOTH_WAYS, _BOTH_WAYS_COARSE)),
        )
        for case in some
    }
    solved[to / STEADY_FILE] = executor.submit(steady_table)
    for number, (path, table) in enumerate(solved.items(), start=1):
        progress(f"{path.name}, {number} of {len(solved)} ...")
        make_folder(path.parent, waits=False)
        write_file(path, table.result())
    return tuple(solved)


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
    times, rough = profile.moments(step), profile.moments(2 * step)

    def speed(t: float) -> float:
        return float(profile.speed(np.array([t]))[0])

    began_s = time.process_time()
    drag = flow.unsteady(case.reynolds, times, speed)
    took_s = time.process_time() - began_s
    linear = flow.unsteady(case.reynolds, times, speed, convection=False)
    exact = profile.linear_drags(times, case.reynolds)
    by_grid = np.interp(times, rough, coarse.unsteady(case.reynolds, rough, speed)) - drag
    checks = {
        "from_coarse": _check(case, "the coarse solution", by_grid, drag, times),
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
        "computing_s_per_s": f"{took_s / (profile.end * case.unit_s):.3g}",
    }
    columns = (times * case.unit_s, case.speed_mps * profile.speed(times), 0.0 - drag * case.unit_n)
    every = max(1, round(_STEP / step))
    return file_bytes(notes, dict(zip(MOTION, (it[::every] for it in columns), strict=True)))


def steady_table() -> bytes:
    """Return the file content of steady drag."""
    solved = [Flow(it) for it in (_WIDE, _WIDE_COARSE, GRID)]
    columns = [flow.steady(_REYNOLDS) for flow in solved]
    method = "; ".join(
        f"{flow.unknowns} unknowns, {it}" for flow, it in zip(solved, (_WIDE, _WIDE_COARSE, GRID), strict=True)
    )
    notes = {
        "title": "steady drag of a sphere",
        **provenance_notes(),
        "method": f"axisymmetric, order {ORDER}: {method}",
    }
    return file_bytes(notes, dict(zip(STEADY, (_REYNOLDS, *columns), strict=True)))


def _check(case: Case, what: str, difference: Floats, force: Floats, times: Floats) -> str:
    """Return the greatest differences relative to the greatest force, during acceleration and otherwise."""
    size = np.abs(difference) / np.abs(force).max()
    ramps = case.profile.near_steps(times)
    worst = float(size.max())
    if not worst <= PERMITTED:
        raise StudyError(
            f"{case.liquid_id}, {case.title}, differs from {what} by {worst:.1%} of the largest force, which is more "
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

"""Cases of the fluid solver without it: worker processes import them by name."""

from typing import Any

from study_app.evidence.cfd.solved_cases import Case
from study_app.evidence.cfd.stored_flows import MOTION, file_bytes


def linear_table(case: Case, grid: Any, coarse: Any) -> bytes:
    """Return a table of the exact force without convection, at some times."""
    times = case.profile.solution_times(0.5)
    columns = (times * case.unit_s, case.profile.speed(times), case.profile.linear_drags(times, case.reynolds))
    return file_bytes({"grids": f"{grid} {coarse}"}, dict(zip(MOTION, columns, strict=True)))


def steady() -> bytes:
    """Return a replacement of the table of steady drag."""
    return b"steady"

"""The targets of a task in the tank."""

from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import Row, row_at
from study_app.designer.form.row_facts import RowFacts
from study_app.protocol.source.document import Path

Point: TypeAlias = tuple[float, float, float]
TANK_MM: Final = (100.0, 60.0, 60.0)


@dataclass(frozen=True, slots=True)
class TargetsInTank:
    """Targets in the hand frame [mm].

    Attributes
    ----------
    size_mm : tuple of float
        Full size of the tank in x (right), y (up) and z (toward the participant).
    radius_mm : float
        Radius of a target.
    points : tuple
        Centre of each target; None where the file holds no point.
    """

    size_mm: Point
    radius_mm: float
    points: tuple[Point | None, ...]

    def within(self, point: Point) -> Point:
        """Return the nearest point, in whole millimetres, at which a target is inside the tank."""
        x, y, z = (_clamped(at, size / 2 - self.radius_mm) for at, size in zip(point, self.size_mm, strict=True))
        return x, y, z


def _clamped(at: float, most: float) -> float:
    most = max(0.0, most)
    return min(max(float(round(at)), -most), most)


def targets_in_tank(study: Study, row: Row) -> TargetsInTank:
    """Return the targets of a row with the tank that they are in."""
    size = _point(_value(study, ("device", "workspace_mm"))) or TANK_MM
    radius = _value(study, (*row.path[:-1], "radius_mm"))
    points = row.value if isinstance(row.value, tuple) else ()
    radius_mm = float(radius) if isinstance(radius, int | float) and radius > 0 else 1.0
    return TargetsInTank(size, radius_mm, tuple(map(_point, points)))


def _value(study: Study, path: Path) -> Any:
    row = row_at(study.document, path)
    return None if row is None else row.default if row.value is None else row.value


def _point(value: Any) -> Point | None:
    if not isinstance(value, tuple | list) or len(value) != 3:
        return None
    if not all(isinstance(part, int | float) and not isinstance(part, bool) for part in value):
        return None
    x, y, z = map(float, value)
    return x, y, z


FACTS: Final = RowFacts((("Reach", "targets_mm"),), targets_in_tank)

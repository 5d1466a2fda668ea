"""The contrast of a condition with the control."""

from __future__ import annotations

from dataclasses import dataclass

from study_app.analysis.statistics.equivalence.tost import Equivalence
from study_app.analysis.statistics.equivalence.tost import Verdict as Nearness
from study_app.analysis.tables.planned_analysis import Direction


@dataclass(frozen=True, slots=True)
class ContrastWithControl:
    """One delay compared with the shortest in one statement.

    ``found`` holds the verdict; ``p_adjusted`` is p of a difference, corrected over the ``members`` comparisons of
    the block; ``expected`` the direction that was stated before the study, None where none was.
    """

    item: str
    delay_ms: float
    control_ms: float
    found: Equivalence
    p_adjusted: float | None
    members: int
    expected: Direction | None = None

    @property
    def verdict(self) -> Nearness:
        """What may be said: "equivalent" where every test shows it, "different" by the corrected p."""
        return self.found.verdict

    @property
    def as_expected(self) -> bool:
        """Whether answers went where they were expected to, or nothing was expected."""
        away = self.found.effect or 0.0
        return self.expected is None or (away > 0) == (self.expected == "increasing")

"""The lowest delay that differs from the control."""

from __future__ import annotations

from dataclasses import dataclass

from study_app.analysis.statistics.trend import StepDown


@dataclass(frozen=True, slots=True)
class Lowest:
    """The lowest delay at which a trend shows in one statement, stepping down.

    The error rate of ``steps`` holds within the statement; that of ``over_all_ms``, the lowest delay whose steps all
    have p ≤ alpha / ``members``, over all statements of the family.
    """

    item: str
    steps: StepDown
    members: int = 1

    @property
    def over_all_ms(self) -> float | None:
        """The lowest delay that shows with the error rate held over all statements; None without any."""
        lowest = None
        for step in self.steps.steps:
            if step.page.p is None or step.page.p > self.steps.alpha / self.members:
                break
            lowest = step.longest_ms
        return lowest

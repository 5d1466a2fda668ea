"""The test of one item of a questionnaire."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from study_app.analysis.statistics.outcome import Outcome

Verdict: TypeAlias = Literal["shown", "suggested", "not shown", "out of reach", "not tested"]
"""What may be said: ``shown`` (primary), ``suggested`` (exploratory), ``not shown``, ``out of reach`` of so few
participants however they had answered, or ``not tested``. None of them says that there is nothing."""


@dataclass(frozen=True, slots=True)
class Tested:
    """A test of one statement within its family of ``members``, with p adjusted by ``correction``."""

    item: str
    outcome: Outcome
    family: str
    members: int
    correction: str
    p_adjusted: float | None
    primary: bool
    verdict: Verdict

"""Forced choice of two to four intervals (2IFC, 3IFC, 4IFC): one holds the comparison, the others the standard."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Literal

from study_app.protocol.trials.design import (
    ORDINALS,
    Arrangement,
    Attention,
    Counted,
    Design,
    one_differs,
    to_arrangements,
)

if TYPE_CHECKING:
    from study_app.psychophysics.detection import Sensitivity

NUMBERS = {2: "two", 3: "three", 4: "four"}


class ForcedChoice(Design):
    """The answer is the interval that held the comparison.

    Green & Swets 1966, Signal Detection Theory and Psychophysics: an observer at chance is correct in 1/m.
    """

    kind: Literal["2ifc", "3ifc", "4ifc"] = "2ifc"
    asks_for_more: ClassVar[bool] = True

    @property
    def wording(self) -> str:
        """The same question whatever the number of intervals."""
        return "forced_choice"

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return f"{NUMBERS[int(self.kind[0])]}-interval forced choice"

    @property
    def answers(self) -> tuple[str, ...]:
        """The intervals, by their place in time."""
        return ORDINALS[: int(self.kind[0])]

    @property
    def arrangements(self) -> tuple[Arrangement, ...]:
        """The comparison in each interval once."""
        return one_differs(int(self.kind[0]), among=True)

    @property
    def guess_rate(self) -> float:
        """1/m for m intervals."""
        return 1 / self.intervals

    def correct(self, arrangement: int) -> str:
        """Return the interval of the comparison."""
        return self.answers[self.arrangements[arrangement].index(True)]

    def sensitivity(self, answers: Counted, *, roving: bool) -> Sensitivity | None:
        """Return d′ of the intervals, and of two intervals the criterion: above 0 the second is preferred."""
        from study_app.psychophysics.detection import from_correct, two_intervals  # noqa: PLC0415 - loads numpy

        if self.kind != "2ifc":
            return from_correct(self.kind, *self.correct_of(answers))
        return two_intervals(*to_arrangements(answers, {0}, "first"), *to_arrangements(answers, {1}, "first"))

    def simulated(self, taken: Sequence[float], mean: float, attention: Attention) -> str:
        """Return the strongest interval, or the weakest."""
        return self.answers[taken.index(min(taken) if attention.smallest else max(taken))]

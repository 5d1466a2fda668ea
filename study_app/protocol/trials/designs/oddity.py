"""Oddity (triangle test): three intervals, of which one differs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from study_app.protocol.trials.design import ORDINALS, Arrangement, Attention, Counted, Design, one_differs

if TYPE_CHECKING:
    from study_app.psychophysics.detection import Sensitivity


class Oddity(Design):
    """Which one differed? The odd one is the comparison or the standard (Frijters 1979, J. Math. Psychol. 20)."""

    kind: Literal["oddity"] = "oddity"

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return "oddity (triangle test)"

    @property
    def answers(self) -> tuple[str, ...]:
        """The intervals, by their place in time."""
        return ORDINALS[:3]

    @property
    def arrangements(self) -> tuple[Arrangement, ...]:
        """The comparison alone in each interval, then the standard alone in each."""
        return one_differs(3, among=True) + one_differs(3, among=False)

    @property
    def guess_rate(self) -> float:
        """1/3."""
        return 1 / 3

    def correct(self, arrangement: int) -> str:
        """Return the odd interval."""
        presented = self.arrangements[arrangement]
        odd = presented.count(True) == 1
        return self.answers[presented.index(odd)]

    def sensitivity(self, answers: Counted, *, roving: bool) -> Sensitivity | None:
        """Return d′ of the triangle test."""
        from study_app.psychophysics.detection import from_correct  # noqa: PLC0415 - loads numpy

        return from_correct(self.kind, *self.correct_of(answers))

    def simulated(self, taken: Sequence[float], mean: float, attention: Attention) -> str:
        """Return the interval that is farthest from the mean of the others."""
        total = sum(taken)
        away = [abs(one - (total - one) / (len(taken) - 1)) for one in taken]
        return self.answers[away.index(max(away))]

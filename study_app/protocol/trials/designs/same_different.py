"""Same–different: two intervals with the same or with different stimuli."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from study_app.protocol.trials.design import Arrangement, Attention, Design


class SameDifferent(Design):
    """Were the two the same? (Macmillan & Creelman 2005, Detection Theory, chapter 9)."""

    kind: Literal["samedifferent"] = "samedifferent"
    adaptive: ClassVar[bool] = False

    @property
    def answers(self) -> tuple[str, ...]:
        """Same, different."""
        return ("same", "different")

    @property
    def arrangements(self) -> tuple[Arrangement, ...]:
        """S S, C C, S C, C S."""
        return ((False, False), (True, True), (False, True), (True, False))

    @property
    def guess_rate(self) -> None:
        """Free: it depends on the observer's criterion."""
        return

    def correct(self, arrangement: int) -> str:
        """Return whether the two were the same."""
        first, second = self.arrangements[arrangement]
        return "same" if first == second else "different"

    def simulated(self, taken: Sequence[float], mean: float, attention: Attention) -> str:
        """Return "different" where a difference is noticed."""
        first, second = taken
        return "different" if attention.distinct(first - second, (first + second) / 2) else "same"

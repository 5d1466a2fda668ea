"""ABX: standard and comparison in either order, then one of them again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from study_app.protocol.trials.design import Arrangement, Attention, Counted, Design

if TYPE_CHECKING:
    from study_app.psychophysics.detection import Sensitivity


class Abx(Design):
    """Which of the first two was repeated as the third? (Munson & Gardner 1950, J. Acoust. Soc. Am. 22, 675)."""

    kind: Literal["abx"] = "abx"

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return "ABX"

    @property
    def answers(self) -> tuple[str, ...]:
        """Like the first, like the second."""
        return ("like_first", "like_second")

    @property
    def arrangements(self) -> tuple[Arrangement, ...]:
        """S C S, S C C, C S C, C S S."""
        return ((False, True, False), (False, True, True), (True, False, True), (True, False, False))

    @property
    def guess_rate(self) -> float:
        """1/2."""
        return 0.5

    def correct(self, arrangement: int) -> str:
        """Return which of the first two was repeated."""
        first, _, third = self.arrangements[arrangement]
        return self.answers[0] if first == third else self.answers[1]

    def sensitivity(self, answers: Counted, *, roving: bool) -> Sensitivity | None:
        """Return d′ under the differencing model where standards rove, else under independent observations."""
        from study_app.psychophysics.detection import abx  # noqa: PLC0415 - loads numpy

        return abx(*self.correct_of(answers), "differencing" if roving else "independent")

    def proportion_correct(self, d_prime: float, *, roving: bool) -> float:
        """Return P(correct) under the model of `sensitivity`."""
        from study_app.psychophysics.detection import proportion_correct  # noqa: PLC0415 - loads numpy

        return proportion_correct(f"{self.kind} {'differencing' if roving else 'independent'}", d_prime)

    def simulated(self, taken: Sequence[float], mean: float, attention: Attention) -> str:
        """Return which of the first two is closer to the third."""
        first, second, third = taken
        return self.answers[0] if abs(third - first) < abs(third - second) else self.answers[1]

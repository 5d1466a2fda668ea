"""Same–different: two intervals with the same or with different stimuli."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Literal

from study_app.protocol.trials.design import Arrangement, Attention, Counted, Design, to_arrangements

if TYPE_CHECKING:
    from study_app.psychophysics.detection import Sensitivity


class SameDifferent(Design):
    """Were the two the same? (Macmillan & Creelman 2005, Detection Theory, chapter 9)."""

    kind: Literal["samedifferent"] = "samedifferent"
    adaptive: ClassVar[bool] = False

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return "same–different"

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

    def sensitivity(self, answers: Counted, *, roving: bool) -> Sensitivity | None:
        """Return d′ and k under the differencing model where standards rove, else d′ of independent observations."""
        from study_app.psychophysics.detection import same_different  # noqa: PLC0415 - loads numpy

        return same_different(
            *to_arrangements(answers, {2, 3}, "different"),
            *to_arrangements(answers, {0, 1}, "different"),
            "differencing" if roving else "independent",
        )

    def proportion_correct(self, d_prime: float, *, roving: bool) -> float:
        """Return P(correct) under the model of `sensitivity`."""
        from study_app.psychophysics.detection import proportion_correct  # noqa: PLC0415 - loads numpy

        return proportion_correct(f"{self.kind} {'differencing' if roving else 'independent'}", d_prime)

    def simulated(self, taken: Sequence[float], mean: float, attention: Attention) -> str:
        """Return "different" where a difference is noticed."""
        first, second = taken
        return "different" if attention.distinct(first - second, (first + second) / 2) else "same"

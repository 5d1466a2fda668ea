"""Yes–no: one interval, the comparison or, in a share of slots, the standard (noise)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.trials.design import Arrangement, Attention, Counted, Design, to_arrangements

if TYPE_CHECKING:
    from study_app.psychophysics.detection import Sensitivity


class YesNo(Design):
    """Was it there? (Green & Swets 1966): the answer "yes" to a comparison is a hit, to a standard a false alarm."""

    kind: Literal["yesno"] = "yesno"
    noise_share: Annotated[float, within(0.05, 0.5, "fewer say nothing of false alarms; half is balanced")] = Field(
        default=0.3, description="Share of trials that present the standard."
    )

    has_noise: ClassVar[bool] = True
    success_name: ClassVar[str] = "yes"

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return "yes–no"

    @property
    def answers(self) -> tuple[str, ...]:
        """Yes, no."""
        return ("yes", "no")

    @property
    def arrangements(self) -> tuple[Arrangement, ...]:
        """C, S."""
        return ((True,), (False,))

    @property
    def guess_rate(self) -> None:
        """Free: the noise trials determine it."""
        return

    def noise(self, comparisons: int) -> int:
        """Return how many slots present the standard, so that they are a share of all."""
        return round(comparisons * self.noise_share / (1 - self.noise_share))

    def correct(self, arrangement: int) -> str:
        """Return yes for the comparison, no for the standard."""
        return self.answers[arrangement]

    def success(self, arrangement: int, answer: str) -> bool:
        """Return whether the answer was yes, whatever was presented."""
        return answer == "yes"

    def sensitivity(self, answers: Counted, *, roving: bool) -> Sensitivity | None:
        """Return d′ and the criterion: above 0 the observer says yes less often than no."""
        from study_app.psychophysics.detection import yes_no  # noqa: PLC0415 - loads numpy

        return yes_no(*to_arrangements(answers, {0}, "yes"), *to_arrangements(answers, {1}, "yes"))

    def simulated(self, taken: Sequence[float], mean: float, attention: Attention) -> str:
        """Return "yes" above the mean of the intervals so far."""
        return "yes" if taken[0] > mean else "no"

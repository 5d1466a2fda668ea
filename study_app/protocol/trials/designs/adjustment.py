"""Adjustment: the participant sets the varied number, by steps, while it is presented."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from study_app.protocol.trials.design import Arrangement, JudgementDesign, Reply


class Adjusted(JudgementDesign):
    """The standard, then an interval that the participant adjusts to it (Gescheider 1997, Psychophysics, ch. 3)."""

    kind: Literal["adjustment"] = "adjustment"
    standard: bool = Field(
        default=True, description="Whether an interval presents the standard before the one that is adjusted."
    )
    reply: ClassVar[Reply] = "setting"

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return "the method of adjustment"

    @property
    def wording(self) -> str:
        """The name of its question among the program's own words."""
        return self.kind if self.standard else "adjustment_alone"

    @property
    def arrangements(self) -> tuple[Arrangement, ...]:
        """The standard and the interval that is adjusted, or the latter alone."""
        return ((False, True),) if self.standard else ((True,),)

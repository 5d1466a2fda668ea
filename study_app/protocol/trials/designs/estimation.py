"""Magnitude estimation: one interval, answered with any number above 0."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from study_app.protocol.trials.design import JudgementDesign, Modulus, Reply


class Estimation(JudgementDesign):
    """How strong was it, as a number? (Stevens 1957, Psychological Review 64, 153)."""

    kind: Literal["estimation"] = "estimation"
    modulus: Modulus | None = Field(default=None, description="The first trial's level and number; default: free.")
    reply: ClassVar[Reply] = "number"

    @property
    def first(self) -> Modulus | None:
        """The modulus."""
        return self.modulus

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return "magnitude estimation"

"""Rating: one interval, judged on a scale."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from study_app.protocol.texts import Id
from study_app.protocol.trials.design import JudgementDesign, Reply


class Rated(JudgementDesign):
    """How much was it? One point of a scale for each level."""

    kind: Literal["rating"] = "rating"
    scale: Id = Field(description="The scale of the answer.")
    reply: ClassVar[Reply] = "rating"

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return "ratings"

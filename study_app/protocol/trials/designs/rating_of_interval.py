"""Rating: one interval, judged on a scale."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from study_app.protocol.texts import Id
from study_app.protocol.trials.design import Arrangement, Design, Reply


class Rated(Design):
    """How much was it? One point of a scale for each level."""

    kind: Literal["rating"] = "rating"
    scale: Id = Field(description="The scale of the answer.")
    reply: ClassVar[Reply] = "rating"
    has_standard: ClassVar[bool] = False
    has_correct_answer: ClassVar[bool] = False
    adaptive: ClassVar[bool] = False

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return "ratings"

    @property
    def answers(self) -> tuple[str, ...]:
        """None: the reply is a point of the scale."""
        return ()

    @property
    def arrangements(self) -> tuple[Arrangement, ...]:
        """The comparison alone."""
        return ((True,),)

    @property
    def guess_rate(self) -> None:
        """No answer is correct."""
        return

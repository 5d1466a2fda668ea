"""Free motion in the tank."""

from typing import ClassVar, Final, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.protocol.table import Table
from study_app.protocol.texts import Localised
from study_app.protocol.trials.tasks.stroke import Point, Seconds, Stroke

SHAKE_HZ: Final = 5.0
SHAKE_M: Final = 0.03
"""As quick and as wide as free shaking of a light handle commonly is. [choice]"""


class Explore(Table):
    """Free motion in the tank, for ``min_s`` to ``max_s``; after ``min_s`` the participant may continue."""

    kind: Literal["explore"]
    min_s: float = Field(ge=0, le=3600, description="Least time before the participant may go on [s].")
    max_s: Seconds = Field(description="Time after which the task ends by itself [s].")
    instruction: Localised = Field(description="One sentence shown under the tank.")

    activity: ClassVar[str] = "free exploration"
    lead_s: ClassVar[float] = 0.0
    start_m: ClassVar[Point | None] = None

    @property
    def summary(self) -> str:
        """What is done, for those who read the study."""
        return f"explore for {self.min_s:g} to {self.max_s:g} s"

    @property
    def expected_s(self) -> float:
        """About how long it takes [s]."""
        return (self.min_s + self.max_s) / 2

    def fastest_stroke(self, workspace_m: Point) -> Stroke:
        """Return the fastest stroke that is likely, in a tank of these extents [m, hand frame]."""
        return Stroke(SHAKE_HZ, min(SHAKE_M, workspace_m[0] / 2))

    @property
    def limit_s(self) -> float:
        """When the task ends by itself [s]."""
        return self.max_s

    @model_validator(mode="after")
    def _least_before_most(self) -> Self:
        if self.min_s > self.max_s:
            raise PydanticCustomError(
                "order",
                "min_s = {low} is more than max_s = {high}",
                {"low": f"{self.min_s:g}", "high": f"{self.max_s:g}", "place": "min_s"},
            )
        return self

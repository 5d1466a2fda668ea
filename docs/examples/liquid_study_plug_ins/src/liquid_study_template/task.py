"""A task: follow a target that moves around a circle at an even speed."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.source.table import Localised
from study_app.protocol.trials.tasks import Point, Stroke, Task


class Circle(Task):
    """Follow a target around a circle, at an even speed."""

    kind: Literal["liquid-study-template:circle"] = "liquid-study-template:circle"
    circle_mm: Annotated[
        float, within(2, 100, "the tank is at most 1000 mm wide, and smaller circles are lost in tremor")
    ] = Field(default=15, description="Radius of the circle [mm].")
    turns: int = Field(default=3, ge=1, le=1000, description="Number of turns.")
    turn_s: Annotated[float, within(0.5, 60, "no hand goes around faster")] = Field(
        default=2, description="Time for a turn [s]."
    )
    instruction: Localised = Field(description="One sentence shown under the tank.")

    activity: ClassVar[str] = "following a circle"
    hand: ClassVar[str] = "study_app.session.simulated.observers:Follower"  # it does the task in rehearsals
    radius_m: ClassVar[float] = 0.006  # of the target
    start_m = property(lambda self: self.target_m(0.0))
    limit_s = property(lambda self: self.turns * self.turn_s)

    def target_m(self, t_s: float) -> Point:
        """Return where the target is, hand frame [m]."""
        angle = 2 * math.pi * t_s / self.turn_s
        return self.circle_mm / 1000 * math.cos(angle), self.circle_mm / 1000 * math.sin(angle), 0.0

    def fastest_stroke(self, workspace_m: Point) -> Stroke:
        """Return the fastest stroke: force limits are checked at its speed."""
        return Stroke(1 / self.turn_s, self.circle_mm / 1000)

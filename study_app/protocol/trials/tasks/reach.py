"""Targets that light up one after the other."""

import math
from itertools import pairwise
from typing import Annotated, ClassVar, Final, Literal, Self, TypeAlias

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.haptics.model.ranges import within
from study_app.protocol.table import Table
from study_app.protocol.texts import Localised
from study_app.protocol.trials.tasks.stroke import Point, Radius, Seconds, Stroke

Millimetres: TypeAlias = Annotated[float, within(-500, 500, "the tank reaches to 500 mm on either side at most")]

REACH_S: Final = 0.3
"""From target to target, as fast as aimed reaches are. [choice]"""
MOVE_S: Final = 1.5
"""How long people take from one target to the next, for the expected duration. [choice]"""


class Reach(Table):
    """Targets light up one after the other, repeatedly; the ball must stay in the lit target for ``dwell_s``.

    The task is complete after ``count`` targets or after ``duration_s``, whichever of the two the protocol gives; it
    ends without being complete at ``timeout_s``. Points are in the hand frame.
    """

    ONE_OF: ClassVar[tuple[tuple[str, str], ...]] = (("count", "duration_s"),)

    kind: Literal["reach"]
    targets_mm: tuple[tuple[Millimetres, Millimetres, Millimetres], ...] = Field(
        min_length=2, max_length=100, description="Centres of the targets, hand frame [mm]."
    )
    radius_mm: Radius = Field(description="Radius of a target [mm].")
    dwell_s: float = Field(ge=0, le=10, description="How long the ball must stay in the lit target [s].")
    count: int | None = Field(default=None, ge=1, le=1000, description="Targets to reach; or give duration_s.")
    duration_s: Seconds | None = Field(default=None, description="Length of the task [s]; or give count.")
    timeout_s: Seconds = Field(default=120, description="Time after which the task ends in any case [s].")
    instruction: Localised = Field(description="One sentence shown under the tank.")

    activity: ClassVar[str] = "reaching targets"
    lead_s: ClassVar[float] = 0.0
    start_m: ClassVar[Point | None] = None

    @property
    def summary(self) -> str:
        """What is done, for those who read the study."""
        end = f"until {self.count} are reached" if self.count is not None else f"for {self.duration_s:g} s"
        return (
            f"reach for {len(self.targets_mm)} targets of {self.radius_mm:g} mm in turn, {self.dwell_s:g} s in each, "
            f"{end}, at most {self.timeout_s:g} s"
        )

    @property
    def expected_s(self) -> float:
        """About how long it takes [s]."""
        if self.count is not None:
            return min(self.timeout_s, self.count * (self.dwell_s + MOVE_S))
        return self.duration_s or 0.0

    def fastest_stroke(self, _workspace_m: Point) -> Stroke:
        """Return the stroke between the two neighbours that are farthest apart."""
        following = (*self.targets_m[1:], self.targets_m[0])
        way_m = max(math.dist(*pair) for pair in zip(self.targets_m, following, strict=True))
        return Stroke(0.5 / REACH_S, way_m / 2)

    @property
    def targets_m(self) -> tuple[Point, ...]:
        """Centres of the targets, hand frame [m]."""
        return tuple((x / 1000, y / 1000, z / 1000) for x, y, z in self.targets_mm)

    @property
    def limit_s(self) -> float:
        """When the task ends by itself [s]."""
        return self.timeout_s if self.duration_s is None else self.duration_s

    @property
    def radius_m(self) -> float:
        """Radius of a target [m]."""
        return self.radius_mm / 1000

    @model_validator(mode="after")
    def _ends_before_its_timeout(self) -> Self:
        if self.duration_s is not None and self.duration_s > self.timeout_s:
            raise PydanticCustomError(
                "order",
                "duration_s = {duration} is longer than timeout_s = {timeout}",
                {"duration": f"{self.duration_s:g}", "timeout": f"{self.timeout_s:g}", "place": "duration_s"},
            )
        return self

    @model_validator(mode="after")
    def _time_for_every_target(self) -> Self:
        limit, targets = self.duration_s or self.timeout_s, self.count or 1
        if targets * self.dwell_s >= limit:
            raise PydanticCustomError(
                "order",
                "dwell_s = {dwell} in {targets} takes as long as the {limit} s that the task lasts at most: shorten it",
                {
                    "dwell": f"{self.dwell_s:g}",
                    "targets": "a target" if targets == 1 else f"each of {targets} targets",
                    "limit": f"{limit:g}",
                    "place": "dwell_s",
                },
            )
        return self

    @model_validator(mode="after")
    def _targets_apart(self) -> Self:
        for index, (one, other) in enumerate(pairwise((*self.targets_mm, self.targets_mm[0])), start=1):
            distance = math.dist(one, other)
            if distance <= 2 * self.radius_mm:
                raise PydanticCustomError(
                    "overlap",
                    "target {index} and the next are {distance} mm apart and overlap at radius_mm = {radius}",
                    {
                        "index": index,
                        "distance": f"{distance:g}",
                        "radius": f"{self.radius_mm:g}",
                        "place": "targets_mm",
                    },
                )
        return self

"""What the participant does with the ball in one trial: explore freely, or reach for targets."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.protocol.table import Table
from study_app.protocol.texts import Localised

Point: TypeAlias = tuple[float, float, float]


class Explore(Table):
    """Free motion in the tank: at least ``min_s``, at most ``max_s``; between the two the participant may go on."""

    kind: Literal["explore"]
    min_s: float = Field(ge=0, le=3600, description="Least time before the participant may go on [s].")
    max_s: float = Field(gt=0, le=3600, description="Time after which the questionnaire comes by itself [s].")
    instruction: Localised = Field(description="One sentence shown under the tank.")

    @model_validator(mode="after")
    def _least_before_most(self) -> Self:
        if self.min_s > self.max_s:
            raise PydanticCustomError(
                "order",
                "min_s = {low} is more than max_s = {high}",
                {"low": f"{self.min_s:g}", "high": f"{self.max_s:g}", "place": "min_s"},
            )
        return self


class Reach(Table):
    """Targets lit one after the other, round and round: hold the ball in the lit one for ``dwell_s``.

    The task is complete after ``count`` targets or after ``duration_s``, whichever of the two the protocol gives; it
    ends without being complete at ``timeout_s``. Points are in the hand frame.
    """

    kind: Literal["reach"]
    targets_mm: tuple[Point, ...] = Field(min_length=2, description="Centres of the targets, hand frame [mm].")
    radius_mm: float = Field(gt=0, le=100, description="Radius of a target [mm].")
    dwell_s: float = Field(ge=0, le=10, description="How long the ball must stay in the lit target [s].")
    count: int | None = Field(default=None, ge=1, le=1000, description="Targets to reach; or give duration_s.")
    duration_s: float | None = Field(default=None, gt=0, le=3600, description="Length of the task [s]; or give count.")
    timeout_s: float = Field(default=120, gt=0, le=3600, description="End of the task at the latest [s].")
    instruction: Localised = Field(description="One sentence shown under the tank.")

    @property
    def targets_m(self) -> tuple[Point, ...]:
        """Centres of the targets, hand frame [m]."""
        return tuple((x / 1000, y / 1000, z / 1000) for x, y, z in self.targets_mm)

    @property
    def radius_m(self) -> float:
        """Radius of a target [m]."""
        return self.radius_mm / 1000

    @model_validator(mode="after")
    def _ends_in_one_way(self) -> Self:
        if (self.count is None) == (self.duration_s is None):
            raise PydanticCustomError("one_of", "give either count or duration_s, one of the two", {"place": "count"})
        if self.duration_s is not None and self.duration_s > self.timeout_s:
            raise PydanticCustomError(
                "order",
                "duration_s = {duration} is longer than timeout_s = {timeout}",
                {"duration": f"{self.duration_s:g}", "timeout": f"{self.timeout_s:g}", "place": "duration_s"},
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


Task: TypeAlias = Annotated[Explore | Reach, Field(discriminator="kind")]

"""What the participant does with the ball in one trial: explore freely, or reach for targets."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Final, Literal, NamedTuple, Self, TypeAlias

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.haptics.model.ranges import within
from study_app.protocol.table import Table
from study_app.protocol.texts import Localised

Millimetres: TypeAlias = Annotated[float, within(-500, 500, "the tank reaches to 500 mm on either side at most")]
Seconds: TypeAlias = Annotated[float, within(0.1, 3600, "a hand moves within 0.1 s, no trial takes an hour")]
Point: TypeAlias = tuple[float, float, float]

SHAKE_HZ: Final = 5.0
SHAKE_M: Final = 0.03
"""As quick and as wide as free shaking of a light handle commonly is. [choice]"""
REACH_S: Final = 0.3
"""From target to target, as fast as aimed reaches are. [choice]"""


class Stroke(NamedTuple):
    """A straight stroke to and fro: x = A cos 2πft in the hand frame."""

    frequency_hz: float
    amplitude_m: float

    @property
    def speed_mps(self) -> float:
        """The greatest speed [m/s]."""
        return 2.0 * math.pi * self.frequency_hz * self.amplitude_m

    @property
    def acceleration_mps2(self) -> float:
        """The greatest acceleration [m/s²]."""
        return 2.0 * math.pi * self.frequency_hz * self.speed_mps


class Explore(Table):
    """Free motion in the tank: at least ``min_s``, at most ``max_s``; between the two the participant may go on."""

    kind: Literal["explore"]
    min_s: float = Field(ge=0, le=3600, description="Least time before the participant may go on [s].")
    max_s: Seconds = Field(description="Time after which the questionnaire comes by itself [s].")
    instruction: Localised = Field(description="One sentence shown under the tank.")

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


class Reach(Table):
    """Targets lit one after the other, round and round: hold the ball in the lit one for ``dwell_s``.

    The task is complete after ``count`` targets or after ``duration_s``, whichever of the two the protocol gives; it
    ends without being complete at ``timeout_s``. Points are in the hand frame.
    """

    kind: Literal["reach"]
    targets_mm: tuple[tuple[Millimetres, Millimetres, Millimetres], ...] = Field(
        min_length=2, max_length=100, description="Centres of the targets, hand frame [mm]."
    )
    radius_mm: Annotated[float, within(0.5, 100, "a hand at rest trembles by a few tenths of a millimetre")] = Field(
        description="Radius of a target [mm]."
    )
    dwell_s: float = Field(ge=0, le=10, description="How long the ball must stay in the lit target [s].")
    count: int | None = Field(default=None, ge=1, le=1000, description="Targets to reach; or give duration_s.")
    duration_s: Seconds | None = Field(default=None, description="Length of the task [s]; or give count.")
    timeout_s: Seconds = Field(default=120, description="End of the task at the latest [s].")
    instruction: Localised = Field(description="One sentence shown under the tank.")

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


Task: TypeAlias = Annotated[Explore | Reach, Field(discriminator="kind")]


def fastest_stroke(task: Task, workspace_m: tuple[float, float, float]) -> Stroke:
    """Return the fastest stroke that a task calls for, in a tank of these extents [m, hand frame]."""
    if isinstance(task, Explore):
        return Stroke(SHAKE_HZ, min(SHAKE_M, workspace_m[0] / 2))
    following = (*task.targets_m[1:], task.targets_m[0])
    way_m = max(math.dist(*pair) for pair in zip(task.targets_m, following, strict=True))
    return Stroke(0.5 / REACH_S, way_m / 2)

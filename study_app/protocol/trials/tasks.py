"""Tasks of a trial: movements of the hand with their duration and greatest speed."""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import reduce
from itertools import pairwise
from operator import or_
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Literal, NamedTuple, Self, TypeAlias

from pydantic import ConfigDict, Field, model_validator

from study_app.discovery import Registry, Returns, are_numbers, instance_of, number_between
from study_app.errors import PlugInError
from study_app.haptics.model.ranges import within
from study_app.protocol.source.table import Localised, OfKinds, Table, invalid

Seconds: TypeAlias = Annotated[
    float, within(0.1, 3600, ("a hand movement takes at least 0.1 s, and a trial takes less than an hour"))
]
Radius: TypeAlias = Annotated[float, within(0.5, 100, "even a resting hand trembles by a few tenths of a millimetre")]
Point: TypeAlias = tuple[float, float, float]


class Stroke(NamedTuple):
    """A straight back-and-forth stroke: x = A cos 2πft in the hand frame."""

    frequency_hz: float
    amplitude_m: float

    @property
    def speed_mps(self) -> float:
        return 2.0 * math.pi * self.frequency_hz * self.amplitude_m

    @property
    def acceleration_mps2(self) -> float:
        return 2.0 * math.pi * self.frequency_hz * self.speed_mps


_SHAKE_HZ: Final = 5.0
_SHAKE_M: Final = 0.03
"""Frequency and amplitude of freely shaking a light handle. [choice]"""


class Task(Table):
    """The hand's task in an interval, with the properties that each kind defines.

    A kind is a subclass whose ``kind`` is a ``Literal``, in `TASK_KINDS`, with a key ``instruction``. ``activity`` and
    ``summary`` are texts for readers of the study. ``tracker`` and ``hand`` name the class that follows the task
    through the samples of a trial and the one that performs it with a simulated hand, ``module:Class``.
    """

    if TYPE_CHECKING:
        kind: str
        instruction: Localised | None

    activity: ClassVar[str] = "doing the task"
    tracker: ClassVar[str] = "study_app.session.tasks:TimedTracker"
    hand: ClassVar[str] = "study_app.session.simulated.observers:Explorer"
    start_m: ClassVar[Point | None] = None
    """The position of the ball at which an interval may begin [m, hand frame]; None: any."""
    targets_m: ClassVar[tuple[Point, ...]] = ()
    """The stationary targets [m, hand frame]."""
    radius_m: ClassVar[float] = 0.0
    """The radius of the targets [m]."""
    wanted: ClassVar[int | None] = None
    """The number of targets that complete the task; None: it is completed by time."""
    least_s: ClassVar[float | None] = None
    """The time after which the participant may continue [s]; None: the task ends by itself."""
    judged_from_s: ClassVar[float] = 0.0
    """The time at the start that is not evaluated [s]."""

    @property
    def summary(self) -> str:
        return f"{self.activity} for {self.limit_s:g} s"

    @property
    @abstractmethod
    def limit_s(self) -> float:
        """The time after which the task ends by itself [s]."""

    @property
    def expected_s(self) -> float:
        """The expected duration [s]."""
        return self.limit_s

    @property
    def shortest_s(self) -> float:
        """The shortest duration [s]."""
        return self.limit_s if self.least_s is None else self.least_s

    @property
    def paced(self) -> bool:
        """Whether the hand follows a moving target."""
        return self.target_m(0.0) is not None

    def target_m(self, t_s: float) -> Point | None:
        """Return the moving target's position ``t_s`` after the task began [m, hand frame]; None if no target moves."""
        return None

    def fastest_stroke(self, workspace_m: Point) -> Stroke:
        """Return the fastest likely stroke in a tank of these extents [m, hand frame]."""
        return Stroke(_SHAKE_HZ, min(_SHAKE_M, workspace_m[0] / 2))

    def lasting(self, most_s: float) -> Self:
        """Return the task ended only by time: after ``most_s`` or the first whole target period from then [s]."""
        return self


class Explore(Task):
    """Free exploration of the tank for ``min_s`` to ``max_s``; after ``min_s`` the participant may continue."""

    kind: Literal["explore"]
    min_s: float = Field(ge=0, le=3600, description="Minimum time before the participant may continue [s].")
    max_s: Seconds = Field(description="Time after which the task ends automatically [s].")
    instruction: Localised = Field(description="Sentence shown under the tank.")

    activity: ClassVar[str] = "free exploration"
    least_s = property(lambda self: self.min_s)

    @property
    def summary(self) -> str:
        return f"explore for {self.min_s:g} to {self.max_s:g} s"

    @property
    def expected_s(self) -> float:
        return (self.min_s + self.max_s) / 2

    @property
    def limit_s(self) -> float:
        return self.max_s

    def lasting(self, most_s: float) -> Self:
        return self.model_copy(update={"min_s": most_s, "max_s": most_s})

    @model_validator(mode="after")
    def _check_durations(self) -> Self:
        if self.min_s > self.max_s:
            raise invalid(f"min_s = {self.min_s:g} is more than max_s = {self.max_s:g}", "min_s")
        return self


class Follow(Task):
    """A target that moves as A r(t) sin 2πft along an axis, with a raised-cosine ramp r over lead_s.

    The task ends after the lead-in and ``cycles`` whole periods; only the periods after the lead-in are evaluated.
    """

    kind: Literal["follow"]
    axis: Literal["x"] = Field(default="x", description="Axis of the hand frame along which the target moves.")
    amplitude_mm: Annotated[
        float, within(1, 250, "the tank is at most 1000 mm wide, and smaller amplitudes are lost in tremor")
    ] = Field(default=20, description="Distance from the middle to either end in the hand frame [mm].")
    frequency_hz: Annotated[
        float, within(0.05, 5, "a hand cannot follow a faster motion, and a slower motion is barely noticeable")
    ] = Field(default=1, description="Frequency of the target's motion [Hz].")
    cycles: int = Field(default=3, ge=1, le=1000, description="Number of periods evaluated after the lead-in.")
    radius_mm: Radius = Field(default=6, description="Target radius [mm].")
    lead_s: Annotated[float, within(0.1, 10, "a hand needs 0.2 s to react; the lead-in is not evaluated")] = Field(
        default=1, description="Time over which the amplitude increases before the evaluated periods [s]."
    )
    instruction: Localised | None = Field(
        default=None, description="Sentence shown under the tank; default: the program's own text."
    )

    activity: ClassVar[str] = "following a target"
    hand: ClassVar[str] = "study_app.session.simulated.observers:Follower"
    start_m = property(lambda self: self.target_m(0.0))
    radius_m = property(lambda self: self.radius_mm / 1000)
    judged_from_s = property(lambda self: self.lead_s)

    @property
    def summary(self) -> str:
        swings = f"{self.cycles} swing" if self.cycles == 1 else f"{self.cycles} swings"
        return (
            f"follow a target with a radius of {self.radius_mm:g} mm that oscillates by ±{self.amplitude_mm:g} mm at "
            f"{self.frequency_hz:g} Hz: {swings} after a lead-in of {self.lead_s:g} s"
        )

    @property
    def limit_s(self) -> float:
        return self.lead_s + self.cycles / self.frequency_hz

    @property
    def amplitude_m(self) -> float:
        return self.amplitude_mm / 1000

    @property
    def rms_speed_mps(self) -> float:
        """Root mean square of the target's speed over the evaluated part, A 2πf / √2 [m/s]."""
        return 2 * math.pi * self.frequency_hz * self.amplitude_m / math.sqrt(2)

    def fastest_stroke(self, workspace_m: Point) -> Stroke:
        return Stroke(self.frequency_hz, self.amplitude_m)

    def lasting(self, most_s: float) -> Self:
        swings = math.ceil((most_s - self.lead_s) * self.frequency_hz)
        return self.model_copy(update={"cycles": max(swings, self.cycles)})

    def target_m(self, t_s: float) -> Point:
        """Return the target's position ``t_s`` after the task began [m, hand frame]; the centre for a negative time."""
        ramp = 1.0 if t_s >= self.lead_s else (1 - math.cos(math.pi * max(t_s, 0.0) / self.lead_s)) / 2
        return self.amplitude_m * ramp * math.sin(2 * math.pi * self.frequency_hz * t_s), 0.0, 0.0


_Millimetres: TypeAlias = Annotated[float, within(-500, 500, "the tank extends at most 500 mm to either side")]

_REACH_S: Final = 0.3
"""The duration of a fast aimed movement from target to target. [choice]"""
_MOVE_S: Final = 1.5
"""The time from one target to the next for the expected duration. [choice]"""
_SHORTEST_MOVE_S: Final = 1.0
"""The shortest time from one target to the next. [choice]"""


class Reach(Task):
    """Targets are highlighted in turn, repeatedly; the ball must stay in the highlighted target for ``dwell_s``.

    The task is complete after ``count`` targets or after ``duration_s``, whichever the protocol specifies; at
    ``timeout_s`` it ends incomplete. Points are in the hand frame.
    """

    ONE_OF: ClassVar[tuple[tuple[str, str], ...]] = (("count", "duration_s"),)

    kind: Literal["reach"]
    targets_mm: tuple[tuple[_Millimetres, _Millimetres, _Millimetres], ...] = Field(
        min_length=2, max_length=100, description="Target centres in the hand frame [mm]."
    )
    radius_mm: Radius = Field(description="Radius of each target [mm].")
    dwell_s: float = Field(ge=0, le=10, description="How long the ball must stay in the highlighted target [s].")
    count: int | None = Field(
        default=None, ge=1, le=1000, description=("Number of targets to reach; alternatively, specify duration_s.")
    )
    duration_s: Seconds | None = Field(
        default=None, description="Duration of the task [s]; alternatively, specify count."
    )
    timeout_s: Seconds = Field(default=120, description="Maximum duration of the task [s].")
    instruction: Localised = Field(description="Sentence shown under the tank.")

    activity: ClassVar[str] = "reaching targets"
    tracker: ClassVar[str] = "study_app.session.tasks:ReachTracker"
    hand: ClassVar[str] = "study_app.session.simulated.observers:Reacher"
    targets_m = property(lambda self: tuple((x / 1000, y / 1000, z / 1000) for x, y, z in self.targets_mm))
    radius_m = property(lambda self: self.radius_mm / 1000)
    wanted = property(lambda self: self.count)

    @property
    def summary(self) -> str:
        until_count = f"until {self.count} are reached (at most {self.timeout_s:g} s)"
        end = until_count if self.count is not None else f"for {self.duration_s:g} s"
        return (
            f"reach for {len(self.targets_mm)} targets with a radius of {self.radius_mm:g} mm in turn, "
            f"staying {self.dwell_s:g} s in each, {end}"
        )

    @property
    def expected_s(self) -> float:
        if self.count is not None:
            return min(self.timeout_s, self.count * (self.dwell_s + _MOVE_S))
        return self.duration_s or 0.0

    @property
    def shortest_s(self) -> float:
        return self.duration_s or (self.count or 0) * (self.dwell_s + _SHORTEST_MOVE_S)

    def fastest_stroke(self, workspace_m: Point) -> Stroke:
        """Return the stroke between the two most distant neighbouring targets."""
        next_targets = (*self.targets_m[1:], self.targets_m[0])
        longest_m = max(math.dist(*pair) for pair in zip(self.targets_m, next_targets, strict=True))
        return Stroke(0.5 / _REACH_S, longest_m / 2)

    @property
    def limit_s(self) -> float:
        return self.timeout_s if self.duration_s is None else self.duration_s

    def lasting(self, most_s: float) -> Self:
        return self.model_copy(update={"count": None, "duration_s": most_s, "timeout_s": most_s})

    @model_validator(mode="after")
    def _check_timeout(self) -> Self:
        if self.duration_s is not None and self.duration_s > self.timeout_s:
            raise invalid(
                f"duration_s = {self.duration_s:g} is longer than timeout_s = {self.timeout_s:g}", "duration_s"
            )
        return self

    @model_validator(mode="after")
    def _check_dwell_time(self) -> Self:
        limit, targets = self.duration_s or self.timeout_s, self.count or 1
        if targets * self.dwell_s >= limit:
            subject = "a target" if targets == 1 else f"each of {targets} targets"
            duration_text = f"takes at least as long as the whole task ({limit:g} s)"
            raise invalid(f"dwell_s = {self.dwell_s:g} in {subject} {duration_text}: shorten it", "dwell_s")
        return self

    @model_validator(mode="after")
    def _check_target_distances(self) -> Self:
        for index, (target, next_target) in enumerate(pairwise((*self.targets_mm, self.targets_mm[0])), start=1):
            distance = math.dist(target, next_target)
            if distance <= 2 * self.radius_mm:
                distance_text = f"target {index} and the next one are {distance:g} mm apart"
                raise invalid(f"{distance_text} and overlap, because radius_mm is {self.radius_mm:g}", "targets_mm")
        return self


class _RecordedTask(Task):
    """A task of a plug-in that is not installed, from a receipt."""

    model_config = ConfigDict(extra="allow")

    kind: str

    @property
    def limit_s(self) -> float:
        raise PlugInError(": ".join(TASK_KINDS.missing(self.kind)))


_IS_DURATION: Final = number_between(0, 3600)
_IS_POINT: Final = Returns(
    "three coordinates [m] or None", lambda value: value is None or (are_numbers(value) and len(value) == 3)
)
_RETURNS: Final = {
    "limit_s": number_between(0.1, 3600),
    **dict.fromkeys(("expected_s", "shortest_s"), _IS_DURATION),
    "least_s": Returns(f"{_IS_DURATION.permitted} or None", lambda value: value is None or _IS_DURATION.holds(value)),
    **dict.fromkeys(("target_m", "start_m"), _IS_POINT),
    "fastest_stroke": Returns("a Stroke of numbers", lambda value: isinstance(value, Stroke) and are_numbers(value)),
    "summary": instance_of(str),
}
TASK_KINDS: Final = Registry[type[Task]](
    "task", {"explore": Explore, "reach": Reach, "follow": Follow}, Task, "kind", _RETURNS
)
"""The kinds of tasks by ID."""

if TYPE_CHECKING:
    AnyTask: TypeAlias = Task
else:
    AnyTask = Annotated[
        reduce(or_, TASK_KINDS.own.values()), Field(discriminator="kind"), OfKinds(TASK_KINDS, Task, _RecordedTask)
    ]

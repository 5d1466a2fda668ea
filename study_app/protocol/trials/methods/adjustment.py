"""The method of adjustment: from which levels the participant starts, and how far a step goes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final, Literal

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.streams import Draw
from study_app.protocol.trials.method import Heard, Method, TrackSetting
from study_app.protocol.trials.stimuli import Stimulus

STEPS: Final = 40
"""Steps from the smallest level to the largest, by default."""
START_SHARE: Final = 0.125
"""A setting starts within this share of the span from an end: the same number of steps is not right every time."""
_ROUNDING: Final = 1e-9


class Adjustment(Method):
    """Settings start alternately near the smallest and near the largest level; which is first is drawn."""

    kind: Literal["adjustment"] = "adjustment"
    adaptive: ClassVar[bool] = False
    adjusts: ClassVar[bool] = True
    repetitions: Annotated[int, Field(ge=1, le=1000)] = Field(
        default=10, description="How many settings each track has."
    )
    step_size: Annotated[float, within(1e-6, 1e6, "a step is at least 1e-6 and at most 1e6")] | None = Field(
        default=None, description="A step: a factor on log spacing, else a difference; default: a 40th of the span."
    )
    most_s: Annotated[float, within(2, 600, "a hand needs 2 s to feel a change, and tires within minutes")] = Field(
        default=60, description="Longest time for a setting [s]."
    )

    def asked(self, stimulus: Stimulus) -> tuple[float, ...]:
        """Return the ends: every level between them can be set."""
        return stimulus.levels

    def presentations(self, stimulus: Stimulus) -> int:
        """Return the settings of one track."""
        return self.repetitions

    def rounds(self, stimulus: Stimulus) -> int:
        """Return the settings: each has a source of its own."""
        return self.repetitions

    def level(self, track: TrackSetting, number: int, heard: Sequence[Heard], draws: Sequence[Draw]) -> float:
        """Return the level at which setting ``number`` starts: earlier settings change nothing."""
        low, high = track.stimulus.domain
        first_at_low = draws[0]() < 0.5
        away = START_SHARE * (high - low) * draws[number]()
        return track.stimulus.level_of(low + away if first_at_low is (number % 2 == 0) else high - away)

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        """Yield that a step leads nowhere, or beyond all levels."""
        low, high = stimulus.domain
        if stimulus.spacing == "log" and self.step_size is not None and self.step_size <= 1:
            yield "step_size", f"is {self.step_size:g}; on log spacing a step is a factor above 1", "such as 1.05"
        elif self.step(stimulus) > (high - low) / 2:
            most = stimulus.level_of((high - low) / 4)
            yield "step_size", f"is {self.step_size:g}: more than half the range of levels", f"such as {most:.3g}"

    def warnings(self) -> Iterator[tuple[str, str]]:
        """Yield that the settings cannot start equally often at both ends."""
        if self.repetitions % 2:
            message = f"{self.repetitions} settings cannot start equally often at both ends: choose an even number"
            yield "repetitions", message

    def adjusting(self, stimulus: Stimulus, standard: float | None, start: float) -> Adjusting:
        """Return a setting that starts at a level."""
        low, high = (stimulus.comparison(standard, level) for level in stimulus.levels)
        step = self.step(stimulus)
        return Adjusting(stimulus, standard, start, step if high > low else -step)

    def step(self, stimulus: Stimulus) -> float:
        """Return how far a step goes, in u."""
        low, high = stimulus.domain
        return (high - low) / STEPS if self.step_size is None else stimulus.coordinate(self.step_size)


@dataclass(frozen=True, slots=True, repr=False)
class Adjusting:
    """One setting: from which level it starts, and what its steps lead to; never printed, since it reveals the level.

    A place is a number of steps from the start, above 0 towards more of the varied number. Places end with the levels.

    Attributes
    ----------
    stimulus : Stimulus
        What is varied.
    standard : float or None
        The standard, in the unit of the varied number.
    start : float
        The starting level.
    step : float
        What a step adds to u; below 0 where more of the number is a smaller level.
    """

    stimulus: Stimulus
    standard: float | None
    start: float
    step: float

    def moved(self, place: int, steps: int) -> int:
        """Return the place that steps lead to: beyond the first place at an end there is none."""
        ends = [(end - self.stimulus.coordinate(self.start)) / self.step for end in self.stimulus.domain]
        least, most = math.floor(min(ends) + _ROUNDING), math.ceil(max(ends) - _ROUNDING)
        return min(max(place + steps, least), most)

    def level(self, place: int) -> float:
        """Return the level at a place."""
        if place == 0:
            return self.start
        low, high = self.stimulus.levels
        return min(max(self.stimulus.level_of(self.stimulus.coordinate(self.start) + place * self.step), low), high)

    def comparison(self, place: int) -> float:
        """Return the varied number at a place, in its unit."""
        return self.stimulus.comparison(self.standard, self.level(place))

    def reached(self, steps: Iterable[int]) -> int:
        """Return the place that a setting reached by these steps, in their order."""
        place = 0
        for one in steps:
            place = self.moved(place, one)
        return place

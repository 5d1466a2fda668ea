"""A method: ascending limits (Fechner 1860): each series goes up from the smallest level to the first success."""

from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from study_app.protocol.randomization.streams import Draw
from study_app.protocol.trials.methods import Method, TrackSetting, TrialResult
from study_app.protocol.trials.stimuli import Stimulus


class Limits(Method):
    """Each series goes up from the smallest level until the first success."""

    kind: Literal["liquid-study-template:limits"] = "liquid-study-template:limits"
    levels: int = Field(default=8, ge=3, le=40, description="Number of levels of a series.")
    series: int = Field(default=4, ge=1, le=100, description="Number of series at most.")

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return f"the ascending method of limits ({self.levels} levels)"

    def presentations(self, stimulus: Stimulus) -> int:
        """Return how many comparisons one track presents at most."""
        return self.levels * self.series

    def levels_of(self, stimulus: Stimulus) -> tuple[float, ...]:
        """Return all levels, the smallest first."""
        return stimulus.spaced(self.levels)

    def level(self, track: TrackSetting, number: int, heard: Sequence[TrialResult], draws: Sequence[Draw]) -> float:
        """Return the level of a comparison: the next one, or the smallest after a success or the largest level."""
        levels, place = self.levels_of(track.stimulus), 0
        for one in heard:
            place = place if one.noise else 0 if one.success else (place + 1) % len(levels)
        return levels[place]

    def ended(self, track: TrackSetting, heard: Sequence[TrialResult]) -> bool:
        """Return whether every series has had its success."""
        return sum(bool(one.success) and not one.noise for one in heard) >= self.series

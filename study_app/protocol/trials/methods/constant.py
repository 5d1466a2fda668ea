"""The method of constant stimuli: fixed levels, each presented equally often."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from study_app.protocol.streams import Draw, shuffle
from study_app.protocol.trials.method import Heard, Method, TrackSetting
from study_app.protocol.trials.stimuli import CONSTANT_LEVELS, LEVELS_MOST, Stimulus

if TYPE_CHECKING:
    from numpy.random import Generator

    from study_app.psychophysics.families import Floats
    from study_app.psychophysics.simulated_tracks import Answers, Observers

Count = Annotated[int, Field(ge=1, le=LEVELS_MOST)]
Listed = Annotated[tuple[float, ...], Field(min_length=1, max_length=LEVELS_MOST)]


class Constant(Method):
    """Every round presents every level once, in a random order of its own."""

    kind: Literal["constant"] = "constant"
    adaptive: ClassVar[bool] = False
    levels: Count | Listed = Field(
        default=CONSTANT_LEVELS, description="The levels, or how many, evenly spaced over the stimulus' range."
    )
    repetitions: Annotated[int, Field(ge=1, le=1000)] = Field(
        default=20, description="How often each level is presented."
    )

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return "the method of constant stimuli"

    def asked(self, stimulus: Stimulus) -> tuple[float, ...]:
        """Return the levels that are presented, in the order written."""
        return stimulus.spaced(self.levels) if isinstance(self.levels, int) else self.levels

    def presentations(self, stimulus: Stimulus) -> int:
        """Return levels × repetitions."""
        return len(self.asked(stimulus)) * self.repetitions

    def rounds(self, stimulus: Stimulus) -> int:
        """Return the repetitions."""
        return self.repetitions

    def level(self, track: TrackSetting, number: int, heard: Sequence[Heard], draws: Sequence[Draw]) -> float:
        """Return the level of comparison ``number``: answers change nothing."""
        levels = self.asked(track.stimulus)
        return shuffle(levels, draws[number // len(levels)])[number % len(levels)]

    def simulated(self, track: TrackSetting, observers: Observers, random: Generator, noise: Floats | None) -> Answers:
        """Return the answers of simulated observers to every level, equally often."""
        from study_app.psychophysics.simulated_tracks import constant_tracks  # noqa: PLC0415 - loads numpy

        levels = [track.stimulus.coordinate(level) for level in self.asked(track.stimulus)]
        draws = random.random((len(observers.thresholds), len(levels) * self.repetitions))
        return constant_tracks(levels, self.repetitions, observers, draws)

"""What methods share whose next level depends on the answers: trials, first levels, and the answers that count."""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import Annotated

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.number_text import counted
from study_app.protocol.streams import Draw
from study_app.protocol.trials.method import Heard, Method, TrackSetting
from study_app.protocol.trials.stimuli import Stimulus

Count = Annotated[int, within(1, 1000, "no participant answers more in one track")]


class Adaptive(Method):
    """A method that chooses each level from the answers to the levels before."""

    trials: Count = Field(
        default=60, description="How many trials each standard has at most, divided among its tracks."
    )
    begin: Annotated[tuple[float, ...], Field(max_length=4)] | float | None = Field(
        default=None, description="The first level, or that of each track."
    )

    def presentations(self, stimulus: Stimulus) -> int:
        """Return the trials of one track."""
        return self.trials // self.tracks

    def asked(self, stimulus: Stimulus) -> tuple[float, ...]:
        """Return the grid of the stimulus."""
        return stimulus.grid

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        """Yield what is wrong with the number of trials and with the first levels."""
        if self.trials % self.tracks:
            message = f"{self.trials} trials cannot be divided among {self.tracks} tracks"
            yield "trials", message, f"a multiple of {self.tracks}"
        least, most = stimulus.levels
        begin = self.begin if isinstance(self.begin, tuple) else () if self.begin is None else (self.begin,)
        hint = f"one for each track, {least:g} to {most:g}"
        if isinstance(self.begin, tuple) and len(begin) != self.tracks:
            yield "begin", f"{counted(len(begin), 'level')} for {counted(self.tracks, 'track')}", hint
        for level in begin:
            if not least <= level <= most:
                yield "begin", f"{level:g} is not within levels", hint

    def first(self, track: int) -> float | None:
        """Return the first level of a track (from 1) as it is written; None: the method's own."""
        return self.begin[track - 1] if isinstance(self.begin, tuple) else self.begin

    def level(self, track: TrackSetting, number: int, heard: Sequence[Heard], draws: Sequence[Draw]) -> float:
        """Return the level of comparison ``number``: that after the answers so far."""
        return self.after(track, heard)

    @abstractmethod
    def after(self, track: TrackSetting, heard: Sequence[Heard]) -> float:
        """Return the level after these answers."""

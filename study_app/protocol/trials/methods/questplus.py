"""QUEST+: each level is the one after whose answer the least uncertainty is expected (Watson 2017; Prins 2013)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.table import Table
from study_app.protocol.trials.adaptive import Adaptive, Count
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.method import Heard, TrackSetting
from study_app.protocol.trials.psychometric import LAPSES, Assumed, Family, assumed_for, ratio_in_u, running_grid
from study_app.protocol.trials.stimuli import Stimulus

if TYPE_CHECKING:
    from numpy.random import Generator

    from study_app.psychophysics.families import Floats
    from study_app.psychophysics.questplus import Search
    from study_app.psychophysics.simulated_tracks import Answers, Observers

Positive = Annotated[float, within(1e-6, 1e6, "a function is neither a step nor flat")]
Lapse = Annotated[float, Field(ge=0, lt=0.5)]


class Precision(Table):
    """When a track ends early: once the threshold's 95 % interval is narrow enough."""

    ratio: Annotated[float, Field(gt=1, le=1e12)] = Field(description="Its upper end over its lower end, at most.")
    after: Count = Field(default=30, description="After how many answers at the earliest.")


class QuestPlus(Adaptive):
    """The level after whose answer the least uncertainty about the threshold is expected."""

    kind: Literal["questplus"] = "questplus"
    learn: Literal["threshold", "all"] = Field(
        default="threshold",
        description="threshold: the entropy of the threshold is minimised; all: that of all parameters.",
    )
    family: Family | None = Field(
        default=None,
        description="weibull: a Weibull function, the default for distances; normal: a cumulative normal, the default "
        "otherwise; logistic: a logistic function.",
    )
    widths: tuple[Positive, Positive] | None = Field(
        default=None, description="Smallest and largest width, from 5 to 95 % [decades, or units of the level]."
    )
    width_prior: tuple[Positive, Annotated[float, Field(gt=1, le=1e6)]] | None = Field(
        default=None, description="Median and factor of the width's log-normal prior."
    )
    lapses: Annotated[tuple[Lapse, ...], Field(min_length=1, max_length=10)] = Field(
        default=LAPSES, description="Lapse rates that are considered."
    )
    stop: Precision | None = Field(default=None, description="When a track ends early; left out: never.")

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        """Yield what is wrong with its keys, too."""
        yield from super().faults(stimulus)
        if self.widths is not None and not self.widths[0] < self.widths[1]:
            low, high = self.widths
            yield "widths", f"{low:g} and {high:g}: the first width must be the smaller", ""
        if self.family == "weibull" and stimulus.spacing == "linear":
            yield "family", '"weibull" is a function of the logarithm of a level', 'spacing = "log", or "normal"'

    @property
    def paper_name(self) -> str:
        """What a paper calls it, with its source."""
        what, prins = ("the threshold", "; Prins 2013") if self.learn == "threshold" else ("all parameters", "")
        return f"QUEST+, which minimises the expected entropy of {what} (Watson 2017{prins})"

    def target(self, guess: float | None, success: str) -> str | None:
        """Return the percentage of the threshold."""
        return None if guess is None else f"threshold at {50 * (1 + guess):.3g} % {success}"

    def ended(self, track: TrackSetting, heard: Sequence[Heard]) -> bool:
        """Return whether the threshold's interval is narrow enough."""
        if self.stop is None or sum(not one.noise for one in heard) < self.stop.after:
            return False
        search, counts = self._search(track), self._counts(track, heard)
        return ratio_in_u(track.stimulus, *search.interval(*counts)) <= self.stop.ratio

    def after(self, track: TrackSetting, heard: Sequence[Heard]) -> float:
        """Return the level after these answers: their order does not matter."""
        levels = _levels(track)
        if all(one.noise for one in heard) and (first := self.first(track.number)) is not None:
            return levels[_nearest(_coordinates(track), track.stimulus.coordinate(first))]
        return levels[self._search(track).next(*self._counts(track, heard))]

    def simulated(self, track: TrackSetting, observers: Observers, random: Generator, noise: Floats | None) -> Answers:
        """Return the tracks of simulated observers; a track ends early only where levels have logarithms."""
        from study_app.psychophysics.simulated_tracks import search_tracks  # noqa: PLC0415 - loads numpy

        draws = random.random((len(observers.thresholds), self.presentations(track.stimulus)))
        first, log = self.first(track.number), track.stimulus.spacing == "log"
        begin = None if first is None else _nearest(_coordinates(track), track.stimulus.coordinate(first))
        stop = None if self.stop is None or not log else (math.log10(self.stop.ratio), self.stop.after)
        return search_tracks(self._search(track), observers, draws, begin, noise, stop)

    def assumed(self, stimulus: Stimulus, design: Design) -> Assumed:
        """Return the family and the prior on the width that its keys state, else the defaults."""
        default = assumed_for(stimulus, design)
        return Assumed(
            self.family or default.family, self.widths or default.widths, self.width_prior or default.width_prior
        )

    def _search(self, track: TrackSetting) -> Search:
        from study_app.psychophysics.questplus import search_of  # noqa: PLC0415 - loads numpy

        stimulus, design = track.stimulus, track.design
        grid = running_grid(stimulus, design, self.assumed(stimulus, design), self.lapses)
        return search_of(grid, _coordinates(track), self.learn, design.has_noise)

    def _counts(self, track: TrackSetting, heard: Sequence[Heard]) -> tuple[list[int], list[int]]:
        """Return successes and failures at each level."""
        coordinates = _coordinates(track)
        counts = ([0] * len(coordinates), [0] * len(coordinates))
        for (level, success), number in Counter((one.level, bool(one.success)) for one in heard).items():
            counts[0 if success else 1][_nearest(coordinates, track.stimulus.coordinate(level))] += number
        return counts


def _levels(track: TrackSetting) -> tuple[float, ...]:
    """Return the levels of a track's trials, ascending: the grid, after 0 where there are noise trials."""
    return (0.0, *track.stimulus.grid) if track.design.has_noise else track.stimulus.grid


def _coordinates(track: TrackSetting) -> tuple[float, ...]:
    return tuple(track.stimulus.coordinate(level) for level in _levels(track))


def _nearest(coordinates: Sequence[float], u: float) -> int:
    """Return the index of the coordinate that is nearest to ``u``; of two the lower."""
    if u == coordinates[0]:
        return 0  # also −∞, that of noise trials
    return min(range(len(coordinates)), key=lambda index: abs(coordinates[index] - u))

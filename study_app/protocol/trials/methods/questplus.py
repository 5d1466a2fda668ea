"""QUEST+: each level is the one after whose answer the least uncertainty is expected (Watson 2017; Prins 2013)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from pydantic import Field

from study_app.protocol.table import Table
from study_app.protocol.trials.adaptive import Adaptive
from study_app.protocol.trials.design import Design
from study_app.protocol.trials.method import Heard, TrackSetting
from study_app.protocol.trials.psychometric import (
    LAPSES,
    Family,
    family_of,
    ratio_in_u,
    running_grid,
    width_prior_of,
    widths_of,
)
from study_app.protocol.trials.stimuli import Stimulus

Positive = Annotated[float, Field(gt=0)]
Lapse = Annotated[float, Field(ge=0, lt=0.5)]


class Precision(Table):
    """When a track ends early: once the threshold's 95 % interval is narrow enough."""

    ratio: Annotated[float, Field(gt=1)] = Field(description="Its upper end over its lower end, at most.")
    after: Annotated[int, Field(ge=1)] = Field(default=30, description="After how many answers at the earliest.")


class QuestPlus(Adaptive):
    """The level after whose answer the least uncertainty about the threshold is expected."""

    kind: Literal["questplus"] = "questplus"
    learn: Literal["threshold", "all"] = Field(
        default="threshold", description="Whose entropy is minimised: the threshold's, or that of all parameters."
    )
    family: Family | None = Field(
        default=None, description='The psychometric function; default: "weibull" for distances, else "normal".'
    )
    widths: tuple[Positive, Positive] | None = Field(
        default=None, description="Smallest and largest width, from 5 to 95 % [decades, or units of the level]."
    )
    width_prior: tuple[Positive, Annotated[float, Field(gt=1)]] | None = Field(
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

    def target(self, design: Design) -> str | None:
        """Return the percentage of the threshold."""
        guess = design.guess_rate
        return None if guess is None else f"threshold at {50 * (1 + guess):.3g} % {design.success_name}"

    def after(self, track: TrackSetting, heard: Sequence[Heard]) -> float | None:
        """Return the level after these answers: their order does not matter."""
        from study_app.psychophysics.questplus import search_of  # noqa: PLC0415 - loads numpy

        stimulus = track.stimulus
        noise = track.design.noise(1000) > 0
        levels = (0.0, *stimulus.grid) if noise else stimulus.grid
        coordinates = tuple(stimulus.coordinate(level) for level in levels)
        presented = [one for one in heard if not noise or one.level > 0]
        if not presented and (first := self.first(track.number)) is not None:
            return levels[_nearest(coordinates, stimulus.coordinate(first))]
        grid = running_grid(
            stimulus,
            track.design,
            self.family or family_of(stimulus, track.design),
            self.widths or widths_of(stimulus),
            self.width_prior or width_prior_of(stimulus),
            self.lapses,
        )
        search = search_of(grid, coordinates, self.learn, noise)
        counts = ([0] * len(levels), [0] * len(levels))
        for one in heard:
            at = 0 if noise and one.level == 0 else _nearest(coordinates, stimulus.coordinate(one.level))
            counts[0 if one.success else 1][at] += 1
        if self.stop is not None and len(presented) >= self.stop.after:
            low, high = search.interval(*counts)
            if ratio_in_u(stimulus, low, high) <= self.stop.ratio:
                return None
        return levels[search.next(*counts)]


def _nearest(coordinates: Sequence[float], u: float) -> int:
    """Return the index of the coordinate that is nearest to ``u``; of two the lower."""
    return min(range(len(coordinates)), key=lambda index: abs(coordinates[index] - u))

"""Weighted up–down: the level falls after successes in a row and rises after each failure (García-Pérez 1998)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.table import Table
from study_app.protocol.trials.adaptive import Adaptive, Count
from study_app.protocol.trials.method import Answer, Heard, TrackSetting
from study_app.protocol.trials.stimuli import Stimulus
from study_app.psychophysics.updown import RATIOS, Staircase, converges_to

if TYPE_CHECKING:
    from numpy.random import Generator

    from study_app.psychophysics.families import Floats
    from study_app.psychophysics.simulated_tracks import Answers, Observers


class Reversals(Table):
    """When a track ends early: after so many changes of direction."""

    reversals: Count = Field(description="How many reversals, at least.")
    after: Count = Field(default=1, description="After how many answers at the earliest.")


class UpDown(Adaptive):
    """A step down after successes in a row, a step up after each failure."""

    kind: Literal["updown"] = "updown"
    rule: Literal["1down1up", "2down1up", "3down1up", "4down1up"] = Field(
        default="2down1up",
        description="1down1up: a step down after each success; 2down1up: after 2 successes in a row; 3down1up: after "
        "3; 4down1up: after 4.",
    )
    step_up: Annotated[float, within(1e-6, 1e6, "a step is at least 1e-6 and at most 1e6")] | None = Field(
        default=None,
        description="Step after a failure: a factor on log spacing, else a difference; default: a tenth of the span.",
    )
    ratio: Annotated[float, Field(gt=0, le=10)] | None = Field(
        default=None, description="Step down over step up; default: that of García-Pérez for the rule."
    )
    average: Annotated[int, Field(ge=2, le=100)] = Field(
        default=8, description="How many of the last reversals are averaged at most."
    )
    stop: Reversals | None = Field(default=None, description="When a track ends early; left out: never.")

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        """Yield what is wrong with its keys, too."""
        yield from super().faults(stimulus)
        if stimulus.spacing == "log" and self.step_up is not None and self.step_up <= 1:
            yield "step_up", f"is {self.step_up:g}; on log spacing a step is a factor above 1", "such as 1.4"

    def warnings(self) -> Iterator[tuple[str, str]]:
        """Yield that a ratio converges for small steps alone, and that one track can be predicted."""
        if self.ratio is not None and self.ratio != self._published_ratio:
            reached, published = (
                100 * converges_to(int(self.rule[0]), ratio) for ratio in (self.ratio, self._published_ratio)
            )
            yield (
                "ratio",
                f"{self.rule} with ratio {self.ratio:g} converges to {reached:.1f} % for small steps alone: "
                f"omit ratio: {published:.1f} % for any step",
            )
        if self.tracks == 1:
            yield "tracks", "participants can predict a single up–down track: choose tracks = 2"

    def target(self, guess: float | None, success: str) -> str | None:
        """Return the percentage to which it converges."""
        return f"converges to {self.target_percent:.1f} % {success}"

    @property
    def paper_name(self) -> str:
        """What a paper calls it, with its source."""
        return (
            f"weighted up–down tracks ({self.rule}, steps down {self._ratio:.4g} of those up; García-Pérez 1998), "
            f"which converge to {self.target_percent:.1f} %"
        )

    @property
    def target_percent(self) -> float:
        """The percentage to which the rule converges."""
        return 100 * converges_to(int(self.rule[0]), self._ratio)

    @property
    def _ratio(self) -> float:
        return self._published_ratio if self.ratio is None else self.ratio

    @property
    def _published_ratio(self) -> float:
        return RATIOS[int(self.rule[0])]

    def ended(self, track: TrackSetting, heard: Sequence[Heard]) -> bool:
        """Return whether there are as many reversals as asked for."""
        if self.stop is None:
            return False
        answers = _answers(track, heard)
        reversals = self.staircase(track.stimulus, track.number).reversals(answers)
        return len(answers) >= self.stop.after and len(reversals) >= self.stop.reversals

    def after(self, track: TrackSetting, heard: Sequence[Heard]) -> float:
        """Return the level after these answers: a step from the last one, or that one again."""
        low, high = track.stimulus.levels
        u = self.staircase(track.stimulus, track.number).next(_answers(track, heard))
        return min(max(track.stimulus.level_of(u), low), high)

    def simulated(self, track: TrackSetting, observers: Observers, random: Generator, noise: Floats | None) -> Answers:
        """Return the tracks of simulated observers."""
        from study_app.psychophysics.simulated_tracks import staircase_tracks  # noqa: PLC0415 - loads numpy

        draws = random.random((len(observers.thresholds), self.presentations(track.stimulus)))
        stop = None if self.stop is None else (self.stop.reversals, self.stop.after)
        return staircase_tracks(self.staircase(track.stimulus, track.number), observers, draws, stop)

    def reversals(self, track: TrackSetting, answers: Sequence[Answer]) -> tuple[int, ...]:
        """Return the places of the answers at which the direction changed."""
        return tuple(self.staircase(track.stimulus, track.number).reversals_at(_in_u(track.stimulus, answers)))

    def reversal_mean(self, track: TrackSetting, answers: Sequence[Answer]) -> float | None:
        """Return the level of the mean of the last reversals; None where there are too few."""
        staircase = self.staircase(track.stimulus, track.number)
        mean = staircase.mean_of_reversals(_in_u(track.stimulus, answers), self.average)
        return None if mean is None else track.stimulus.level_of(mean)

    def staircase(self, stimulus: Stimulus, track: int) -> Staircase:
        """Return the rule for a stimulus, in the coordinate u; ``track`` counts from 1."""
        low, high = stimulus.domain
        first = self.first(track)
        return Staircase(
            down_after=int(self.rule[0]),
            step_up=(high - low) / 10 if self.step_up is None else stimulus.coordinate(self.step_up),
            ratio=self._ratio,
            low=low,
            high=high,
            begin=high if first is None else stimulus.coordinate(first),
        )


def _answers(track: TrackSetting, heard: Sequence[Heard]) -> list[Answer]:
    """Return the answers to comparisons, with their levels in u: noise trials move no track."""
    return _in_u(track.stimulus, [(one.level, bool(one.success)) for one in heard if not one.noise])


def _in_u(stimulus: Stimulus, answers: Sequence[Answer]) -> list[Answer]:
    return [(stimulus.coordinate(level), success) for level, success in answers]

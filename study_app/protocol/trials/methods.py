"""Methods: the number of trials in a track, and the level of each trial.

`Method` is the base class of all kinds, which are in `METHOD_KINDS`.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import count
from numbers import Integral
from operator import or_
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Literal, TypeAlias

import numpy as np
from numpy.random import Generator
from pydantic import ConfigDict, Field

from study_app.discovery import Registry, Returns, are_numbers, instance_of, number_between
from study_app.errors import PlugInError
from study_app.haptics.model.ranges import within
from study_app.number_text import counted
from study_app.protocol.randomization.streams import Draw, shuffle
from study_app.protocol.source.table import OfKinds, Table
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.stimuli import CONSTANT_LEVELS, LAPSES, MAX_LEVELS, Assumed, Stimulus
from study_app.psychophysics.adaptive import (
    RATIOS,
    Answers,
    Choice,
    Observers,
    Search,
    Staircase,
    constant_tracks,
    converges_to,
    search_tracks,
    staircase_tracks,
)
from study_app.psychophysics.families import Family, Floats
from study_app.psychophysics.grid import fit

TrackOrder: TypeAlias = Literal["interleaved", "blocked"]
TrackRule: TypeAlias = Literal["Tracks", "First level", "Steps", "Stopping rule"]
_RULE_PHRASES: Final[Mapping[TrackRule, str]] = {
    "Tracks": "in {}",
    "First level": "starting at {}",
    "Steps": "with steps {}",
    "Stopping rule": "each ending {}",
}
"""How a sentence states each rule."""
Answer: TypeAlias = tuple[float, bool]
"""The level of a comparison, and whether the answer was a success."""


@dataclass(frozen=True, slots=True)
class TrackSetting:
    """The block setting for which a method chooses levels; ``number`` counts the tracks of its standard from 1."""

    stimulus: Stimulus
    design: Design
    number: int


@dataclass(frozen=True, slots=True, repr=False, kw_only=True)
class TrialResult:
    """The last attempt at a trial, with a confirmed answer; not printable, because it reveals a level.

    ``success`` is whether the answer was correct, for yes–no whether it was yes, "comparison chosen" if no answer is
    correct, and None if the answer enters no psychometric function; ``correct`` is None if no answer is. The answer to
    a ``catch`` trial does not affect the levels; a ``noise`` trial presented only the standard.
    """

    trial: int
    code: str
    level: float
    success: bool | None
    correct: bool | None
    catch: bool = False
    noise: bool = False


class Method(Table):
    """The rule for choosing the levels of a track: the common keys, and the functions that each kind defines.

    A kind is a subclass whose ``kind`` is a ``Literal`` with a default, in `METHOD_KINDS`.
    """

    if TYPE_CHECKING:
        kind: str

    order: TrackOrder = Field(
        default="interleaved",
        description="Order of the tracks. interleaved: each round contains one trial of each track, in random order; "
        "blocked: each track is completed before the next one starts.",
    )

    tracks: Annotated[int, Field(ge=1, le=4)] = Field(default=1, description="Number of tracks for each standard.")

    adaptive: ClassVar[bool] = True
    """Whether answers determine the next level."""
    adjusts: ClassVar[bool] = False
    """Whether its levels are the starts of adjustments, which need the design "adjustment"."""
    target_percent: ClassVar[float | None] = None
    """The percentage of successes to which its reversals converge; None without steps."""

    @property
    def setting_s(self) -> float:
        """The expected time to set a level, in addition to the task [s]; 0 without settings."""
        return 0.0

    @property
    def can_end_early(self) -> bool:
        """Whether a track may have fewer comparisons than `presentations`."""
        return type(self).ended is not Method.ended

    def track_rules(self, stimulus: Stimulus) -> dict[TrackRule, str]:
        """Return the rules of adaptive tracks as text, such as their first levels; empty without such rules."""
        return {}

    def track_phrase(self, stimulus: Stimulus) -> str:
        """Return the rules of adaptive tracks as a participial phrase; "" without such rules."""
        return ", ".join(_RULE_PHRASES[rule].format(text) for rule, text in self.track_rules(stimulus).items())

    @property
    def paper_name(self) -> str:
        """Its name in publications, with the source."""
        return self.kind

    @abstractmethod
    def presentations(self, stimulus: Stimulus) -> int:
        """Return the maximum number of comparisons in one track."""

    @abstractmethod
    def levels_of(self, stimulus: Stimulus) -> tuple[float, ...]:
        """Return levels that include the smallest and the largest possible one."""

    @abstractmethod
    def level(self, track: TrackSetting, number: int, heard: Sequence[TrialResult], draws: Sequence[Draw]) -> float:
        """Return the level of a track's comparison ``number`` (from 0); the track has not ended.

        ``heard`` are the track's earlier answers in the order of presentation, ``draws`` secret uniform numbers in
        [0, 1), one source per round of levels.
        """

    def assumed(self, stimulus: Stimulus, design: Design) -> Assumed:
        """Return the assumed psychometric function of its answers."""
        return stimulus.assumed(design)

    def ended(self, track: TrackSetting, heard: Sequence[TrialResult]) -> bool:
        """Return whether a track ends early after these answers."""
        return False

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        """Yield the faults of the method for a stimulus: key, message and hint."""
        return iter(())

    def warnings(self) -> Iterator[tuple[str, str]]:
        """Yield valid settings that may be mistakes: key and sentence."""
        return iter(())

    def target(self, guess: float | None, success: str) -> str | None:
        """Return the targeted proportion of successes as text, such as "correct"; None without a target.

        ``guess`` is the proportion of successes by guessing, 0 if no answer is correct; None: a free parameter.
        """
        return None

    def reversals(self, track: TrackSetting, answers: Sequence[Answer]) -> tuple[int, ...]:
        """Return the indices (from 0) of answers at which a track's direction changed; empty without steps."""
        return ()

    def reversal_mean(self, track: TrackSetting, answers: Sequence[Answer]) -> float | None:
        """Return the classical estimate of a track as a level; None if there is none."""
        return None

    def simulated(self, track: TrackSetting, observers: Observers, random: Generator, noise: Floats | None) -> Answers:
        """Return the answers of simulated observers to one track each; its levels depend on the answers.

        ``noise`` (tracks, noise trials) are the uniform numbers for the answers to noise trials. Levels are requested
        one by one as in a session; kinds that can compute all tracks at once override this and are much faster.
        """
        stimulus = track.stimulus
        draws = random.random((len(observers.thresholds), self.presentations(stimulus)))
        seeds = [random.integers(2**32, size=max(1, self.rounds(stimulus))) for _ in draws]

        def choose_levels() -> Choice:
            heard: list[list[TrialResult]] = [[] for _ in draws]
            levels, running = np.zeros(len(draws)), np.ones(len(draws), bool)
            for number in count():
                for observer in np.flatnonzero(running):
                    running[observer] = not self.ended(track, heard[observer])
                    sources = [np.random.default_rng(seed).random for seed in seeds[observer]]
                    levels[observer] = self.level(track, number, heard[observer], sources)
                successes = yield np.array([stimulus.coordinate(level) for level in levels]), running
                for track_results, level, success in zip(heard, levels.tolist(), successes.tolist(), strict=True):
                    track_results.append(
                        TrialResult(trial=number, code="", level=level, success=success, correct=success)
                    )

        return observers.answers(draws, choose_levels())

    def rounds(self, stimulus: Stimulus) -> int:
        """Return the number of rounds of drawn levels in a track."""
        return 0


Trials = Annotated[int, within(1, 1000, "no participant can complete more trials in one track", of_most=True)]


class _Adaptive(Method):
    """A method that chooses each level from the previous answers."""

    trials: Trials = Field(default=60, description="Maximum number of trials per standard, divided among the tracks.")
    begin: Annotated[tuple[float, ...], Field(max_length=4)] | float | None = Field(
        default=None, description="The first level, or a list with the first level of each track."
    )

    def presentations(self, stimulus: Stimulus) -> int:
        return self.trials // self.tracks

    def levels_of(self, stimulus: Stimulus) -> tuple[float, ...]:
        return stimulus.grid

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        if self.trials % self.tracks:
            message = f"{self.trials} trials cannot be divided among {self.tracks} tracks"
            yield "trials", message, f"choose a multiple of {self.tracks}"
        minimum, maximum = stimulus.levels
        first_levels = self.first_levels(stimulus)
        hint = f"specify one level per track, from {minimum:g} to {maximum:g}"
        if isinstance(self.begin, tuple) and len(first_levels) != self.tracks:
            yield "begin", f"{counted(len(first_levels), 'level')} for {counted(self.tracks, 'track')}", hint
        for level in first_levels:
            if not minimum <= level <= maximum:
                yield "begin", f"{level:g} is outside the stimulus's levels", hint

    @property
    def can_end_early(self) -> bool:
        return self.stopping_rule != ""

    @property
    def stopping_rule(self) -> str:
        """When a track ends early, as text such as "after 10 reversals"; "" if it never does."""
        return ""

    def track_rules(self, stimulus: Stimulus) -> dict[TrackRule, str]:
        number = "one track" if self.tracks == 1 else f"{self.tracks} {self.order} tracks"
        at_most, each = "at most " * self.can_end_early, " per standard" * (len(stimulus.standards) > 1)
        rules: dict[TrackRule, str] = {
            "Tracks": f"{number} of {at_most}{counted(self.presentations(stimulus), 'comparison')}{each}"
        }
        if first_levels := self.first_levels(stimulus):
            unit = "" if stimulus.level_kind == "weber" else f" {stimulus.unit}".rstrip()
            *others, last = (f"{level:g}{unit}" for level in first_levels)
            rules["First level"] = f"{', '.join(others)} and {last}" if others else last
        if steps := self.steps_text(stimulus):
            rules["Steps"] = steps
        if rule := self.stopping_rule:
            rules["Stopping rule"] = rule
        return rules

    def steps_text(self, stimulus: Stimulus) -> str:
        """Return the sizes of the steps up and down; "" without steps of fixed sizes."""
        return ""

    def first_levels(self, stimulus: Stimulus) -> tuple[float, ...]:
        """Return the first level of each track, or one level if it is the same; empty if it is computed."""
        return self.begin if isinstance(self.begin, tuple) else () if self.begin is None else (self.begin,)

    def warnings(self) -> Iterator[tuple[str, str]]:
        presentations = self.trials // self.tracks
        for key, fewest in self._fewest_answers_to_stop():
            if fewest >= presentations:
                yield (
                    f"stop.{key}",
                    f"a track has at most {counted(presentations, 'comparison')} and needs at least {fewest} to end "
                    "early, so this rule has no effect; choose a smaller number, or more trials",
                )
                return

    def _fewest_answers_to_stop(self) -> Iterator[tuple[str, int]]:
        """Yield, for each key of the stopping rule, the smallest number of answers that can satisfy it."""
        return iter(())

    def first(self, track: int) -> float | None:
        """Return the stated first level of a track (from 1); None for the method's own one."""
        return self.begin[track - 1] if isinstance(self.begin, tuple) else self.begin

    def level(self, track: TrackSetting, number: int, heard: Sequence[TrialResult], draws: Sequence[Draw]) -> float:
        return self.after(track, heard)

    @abstractmethod
    def after(self, track: TrackSetting, heard: Sequence[TrialResult]) -> float:
        """Return the level that follows these answers."""


_LOG_STEP: Final = "with logarithmic spacing a step must be a factor greater than 1"
_DEFAULT_STEPS: Final = 40
"""Default number of steps from the smallest level to the largest."""
_START_SHARE: Final = 0.125
"""Greatest distance of a start from an end, as a proportion of the range; a fixed start would permit counting steps."""
_ROUNDING: Final = 1e-9


class Adjustment(Method):
    """Settings start alternately near the smallest and the largest level; which comes first is random."""

    kind: Literal["adjustment"] = "adjustment"
    adaptive: ClassVar[bool] = False
    adjusts: ClassVar[bool] = True
    repetitions: Annotated[int, Field(ge=1, le=1000)] = Field(
        default=10, description="Number of adjustments in each track."
    )
    step_size: Annotated[float, within(1e-6, 1e6, "a track needs steps of a usable size")] | None = Field(
        default=None,
        description=(
            "Step size: a factor if levels are spaced logarithmically, otherwise a difference; "
            "default: one fortieth of the range."
        ),
    )
    most_s: Annotated[float, within(2, 600, "a hand needs 2 s to feel a change and tires within minutes")] = Field(
        default=60, description="Maximum time for each setting [s]."
    )

    @property
    def setting_s(self) -> float:
        return self.most_s / 2

    def levels_of(self, stimulus: Stimulus) -> tuple[float, ...]:
        return stimulus.levels

    def presentations(self, stimulus: Stimulus) -> int:
        return self.repetitions

    def rounds(self, stimulus: Stimulus) -> int:
        return self.repetitions

    def level(self, track: TrackSetting, number: int, heard: Sequence[TrialResult], draws: Sequence[Draw]) -> float:
        """Return the start level of adjustment ``number``, which does not depend on earlier ones."""
        low, high = track.stimulus.domain
        first_at_low = draws[0]() < 0.5
        offset = _START_SHARE * (high - low) * draws[number]()
        return track.stimulus.level_of(low + offset if first_at_low is (number % 2 == 0) else high - offset)

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        low, high = stimulus.domain
        if stimulus.spacing == "log" and self.step_size is not None and self.step_size <= 1:
            yield "step_size", f"is {self.step_size:g}, but {_LOG_STEP}", "choose a factor such as 1.05"
        elif self.step(stimulus) > (high - low) / 2:
            most = stimulus.level_of((high - low) / 4)
            message = f"is {self.step_size:g}, which is more than half the range of levels"
            yield "step_size", message, f"choose a smaller step, such as {most:.3g}"

    def warnings(self) -> Iterator[tuple[str, str]]:
        if self.repetitions % 2:
            message = f"{self.repetitions} settings cannot start equally often at each end: choose an even number"
            yield "repetitions", message

    def adjusting(self, stimulus: Stimulus, standard: float | None, start: float) -> Adjusting:
        low, high = (stimulus.comparison(standard, level) for level in stimulus.levels)
        step = self.step(stimulus)
        return Adjusting(stimulus=stimulus, standard=standard, start=start, step=step if high > low else -step)

    def step(self, stimulus: Stimulus) -> float:
        """Return the size of a step in u."""
        low, high = stimulus.domain
        return (high - low) / _DEFAULT_STEPS if self.step_size is None else stimulus.coordinate(self.step_size)


@dataclass(frozen=True, slots=True, repr=False, kw_only=True)
class Adjusting:
    """One adjustment: its start level and step; never printed, since it reveals the level.

    A place is a number of steps from the ``start``, positive towards larger values of the varied number, and is limited
    by the range of levels. ``step`` is the change of u per step, negative if a larger value is a smaller level.
    """

    stimulus: Stimulus
    standard: float | None
    start: float
    step: float

    def moved(self, place: int, steps: int) -> int:
        """Return the place after a number of steps, at most an end of the range."""
        ends = [(end - self.stimulus.coordinate(self.start)) / self.step for end in self.stimulus.domain]
        minimum, maximum = math.floor(min(ends) + _ROUNDING), math.ceil(max(ends) - _ROUNDING)
        return min(max(place + steps, minimum), maximum)

    def level(self, place: int) -> float:
        if place == 0:
            return self.start
        low, high = self.stimulus.levels
        return min(max(self.stimulus.level_of(self.stimulus.coordinate(self.start) + place * self.step), low), high)

    def comparison(self, place: int) -> float:
        return self.stimulus.comparison(self.standard, self.level(place))

    def place_after(self, steps: Iterable[int]) -> int:
        """Return the place after consecutive steps from the start."""
        place = 0
        for step in steps:
            place = self.moved(place, step)
        return place


_Count = Annotated[int, Field(ge=1, le=MAX_LEVELS)]
_Listed = Annotated[tuple[float, ...], Field(min_length=1, max_length=MAX_LEVELS)]


class Constant(Method):
    """Every round presents every level once, in a new random order."""

    kind: Literal["constant"] = "constant"
    paper_name: ClassVar = "the method of constant stimuli"
    adaptive: ClassVar[bool] = False
    levels: _Count | _Listed = Field(
        default=CONSTANT_LEVELS,
        description="A list of levels, or the number of levels to be spaced evenly over the stimulus's range.",
    )
    repetitions: Annotated[int, Field(ge=1, le=1000)] = Field(
        default=20, description="Number of times each level is presented."
    )

    def levels_of(self, stimulus: Stimulus) -> tuple[float, ...]:
        return stimulus.spaced(self.levels) if isinstance(self.levels, int) else self.levels

    def presentations(self, stimulus: Stimulus) -> int:
        return len(self.levels_of(stimulus)) * self.repetitions

    def rounds(self, stimulus: Stimulus) -> int:
        return self.repetitions

    def level(self, track: TrackSetting, number: int, heard: Sequence[TrialResult], draws: Sequence[Draw]) -> float:
        levels = self.levels_of(track.stimulus)
        return shuffle(levels, draws[number // len(levels)])[number % len(levels)]

    def simulated(self, track: TrackSetting, observers: Observers, random: Generator, noise: Floats | None) -> Answers:
        levels = [track.stimulus.coordinate(level) for level in self.levels_of(track.stimulus)]
        draws = random.random((len(observers.thresholds), len(levels) * self.repetitions))
        return constant_tracks(levels, self.repetitions, observers, draws)


_Positive = Annotated[float, within(1e-6, 1e6, "a psychometric function is neither a step nor a flat line")]
_Lapse = Annotated[float, Field(ge=0, lt=0.5)]


class Precision(Table):
    """When a track ends early: once the threshold's 95 % interval is narrow enough."""

    ratio: Annotated[float, Field(gt=1, le=1e12)] = Field(
        description="Maximum ratio of the upper end of the threshold's 95 % interval to its lower end."
    )
    after: Trials = Field(default=30, description="Minimum number of answers.")


class QuestPlus(_Adaptive):
    """The level at which an answer is expected to reduce the uncertainty about the threshold most."""

    kind: Literal["questplus"] = "questplus"
    learn: Literal["threshold", "all"] = Field(
        default="threshold",
        description="What is minimised. threshold: the entropy of the threshold; all: the entropy of all parameters.",
    )
    family: Family | None = Field(
        default=None,
        description="Shape of the psychometric function. weibull: Weibull function (the default for distances); "
        "normal: cumulative normal (the default otherwise); logistic: logistic function.",
    )
    widths: tuple[_Positive, _Positive] | None = Field(
        default=None,
        description="Smallest and largest width of the function, measured from 5 to 95 % [decades, or "
        "units of the level].",
    )
    width_prior: tuple[_Positive, Annotated[float, Field(gt=1, le=1e6)]] | None = Field(
        default=None, description="Median and spread factor of the width's log-normal prior."
    )
    lapses: Annotated[tuple[_Lapse, ...], Field(min_length=1, max_length=10)] = Field(
        default=LAPSES, description="Candidate values of the lapse rate."
    )
    stop: Precision | None = Field(default=None, description="When a track ends early; default: never.")

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        yield from super().faults(stimulus)
        if self.widths is not None and not self.widths[0] < self.widths[1]:
            low, high = self.widths
            yield "widths", f"{low:g} is not less than {high:g}: the first width must be the smaller one", ""
        if self.family == "weibull" and stimulus.spacing == "linear":
            yield "family", '"weibull" is a function of the logarithm of the level', 'spacing = "log", or "normal"'

    @property
    def paper_name(self) -> str:
        parameters, source = ("the threshold", "; Prins 2013") if self.learn == "threshold" else ("all parameters", "")
        return f"QUEST+, which minimises the expected entropy of {parameters} (Watson 2017{source})"

    @property
    def stopping_rule(self) -> str:
        if self.stop is None:
            return ""
        return (
            f"after at least {counted(self.stop.after, 'answer')}, once the upper end of the threshold's 95 % interval "
            f"is at most {self.stop.ratio:g} times the lower end"
        )

    def _fewest_answers_to_stop(self) -> Iterator[tuple[str, int]]:
        if self.stop is not None:
            yield "after", self.stop.after

    def target(self, guess: float | None, success: str) -> str | None:
        return None if guess is None else f"threshold at {50 * (1 + guess):.3g} % {success}"

    def ended(self, track: TrackSetting, heard: Sequence[TrialResult]) -> bool:
        if self.stop is None or sum(not result.noise for result in heard) < self.stop.after:
            return False
        search = self._search(track)
        interval = fit(search.levels, *_success_counts(track.stimulus, search.levels, heard), search.grid).interval
        return track.stimulus.ratio(*interval) <= self.stop.ratio

    def after(self, track: TrackSetting, heard: Sequence[TrialResult]) -> float:
        """Return the level that follows these answers, whose order does not matter."""
        levels = _track_levels(track)
        if all(result.noise for result in heard) and (first := self.first(track.number)) is not None:
            return levels[_nearest(_track_coordinates(track), track.stimulus.coordinate(first))]
        search = self._search(track)
        return levels[search.next(*_success_counts(track.stimulus, search.levels, heard))]

    def simulated(self, track: TrackSetting, observers: Observers, random: Generator, noise: Floats | None) -> Answers:
        """Return the answers of simulated observers; a track ends early only if levels are spaced logarithmically."""
        draws = random.random((len(observers.thresholds), self.presentations(track.stimulus)))
        first, log = self.first(track.number), track.stimulus.spacing == "log"
        begin = None if first is None else _nearest(_track_coordinates(track), track.stimulus.coordinate(first))
        stop = None if self.stop is None or not log else (math.log10(self.stop.ratio), self.stop.after)
        return search_tracks(self._search(track), observers, draws, begin, noise, stop)

    def assumed(self, stimulus: Stimulus, design: Design) -> Assumed:
        """Return the stated assumptions, and the defaults for others."""
        default = stimulus.assumed(design)
        return Assumed(
            self.family or default.family, self.widths or default.widths, self.width_prior or default.width_prior
        )

    def _search(self, track: TrackSetting) -> Search:
        stimulus, design = track.stimulus, track.design
        grid = stimulus.running_grid(design, self.assumed(stimulus, design), self.lapses)
        return Search(grid, _track_coordinates(track), self.learn, design.has_noise)


def _success_counts(
    stimulus: Stimulus, coordinates: Sequence[float], heard: Sequence[TrialResult]
) -> tuple[list[int], list[int]]:
    """Return the numbers of successes and of failures at each level, given by its coordinate."""
    counts = ([0] * len(coordinates), [0] * len(coordinates))
    for (level, success), number in Counter((answer.level, bool(answer.success)) for answer in heard).items():
        counts[0 if success else 1][_nearest(coordinates, stimulus.coordinate(level))] += number
    return counts


def _track_levels(track: TrackSetting) -> tuple[float, ...]:
    """Return the possible levels of a track in ascending order: the grid, preceded by 0 if there are noise trials."""
    return (0.0, *track.stimulus.grid) if track.design.has_noise else track.stimulus.grid


def _track_coordinates(track: TrackSetting) -> tuple[float, ...]:
    return tuple(track.stimulus.coordinate(level) for level in _track_levels(track))


def _nearest(coordinates: Sequence[float], u: float) -> int:
    """Return the index of the coordinate nearest to ``u``, in a tie that of the lower one."""
    upper = bisect_left(coordinates, u)
    if upper in (0, len(coordinates)):
        return min(upper, len(coordinates) - 1)  # with noise trials, the first coordinate is −∞
    return upper - (u - coordinates[upper - 1] <= coordinates[upper] - u)


class Reversals(Table):
    """When a track ends early: after a number of reversals."""

    reversals: Trials = Field(description="Minimum number of reversals.")
    after: Trials = Field(default=1, description="Minimum number of answers.")


class UpDown(_Adaptive):
    """One step down after a set number of consecutive successes, one step up after each failure."""

    kind: Literal["updown"] = "updown"
    rule: Literal["1down1up", "2down1up", "3down1up", "4down1up"] = Field(
        default="2down1up",
        description=(
            "1down1up: one step down after each correct answer; 2down1up, 3down1up, 4down1up: one step down "
            "after 2, 3 or 4 consecutive correct answers."
        ),
    )
    step_up: Annotated[float, within(1e-6, 1e6, "a track needs steps of a usable size")] | None = Field(
        default=None,
        description=(
            "Step after an incorrect answer: a factor if levels are spaced logarithmically, otherwise a "
            "difference; default: one tenth of the range."
        ),
    )
    ratio: Annotated[float, Field(gt=0, le=10)] | None = Field(
        default=None, description="Ratio of the step down to the step up; default: García-Pérez's value for the rule."
    )
    average: Annotated[int, Field(ge=2, le=100)] = Field(
        default=8, description="Maximum number of final reversals to average."
    )
    stop: Reversals | None = Field(default=None, description="When a track ends early; default: never.")

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        yield from super().faults(stimulus)
        if stimulus.spacing == "log" and self.step_up is not None and self.step_up <= 1:
            yield "step_up", f"is {self.step_up:g}, but {_LOG_STEP}", "choose a factor such as 1.4"

    @property
    def stopping_rule(self) -> str:
        if self.stop is None:
            return ""
        at_least = "" if self.stop.after == 1 else f" and at least {counted(self.stop.after, 'answer')}"
        return f"after {counted(self.stop.reversals, 'reversal')}{at_least}"

    def first_levels(self, stimulus: Stimulus) -> tuple[float, ...]:
        return super().first_levels(stimulus) or (stimulus.levels[1],)

    def steps_text(self, stimulus: Stimulus) -> str:
        staircase = self.staircase(stimulus, 1)
        up, down = staircase.step_up, staircase.ratio * staircase.step_up
        if stimulus.spacing == "log":
            return f"up by a factor of {10**up:.3g} and down by a factor of {10**down:.3g}"
        unit = "" if stimulus.level_kind == "weber" else f" {stimulus.unit}".rstrip()
        return f"up by {up:.3g}{unit} and down by {down:.3g}{unit}"

    def _fewest_answers_to_stop(self) -> Iterator[tuple[str, int]]:
        if self.stop is not None:
            yield "after", self.stop.after
            pairs, single = divmod(self.stop.reversals + 1, 2)  # moves alternate: one failure, then a row of successes
            yield "reversals", pairs * (int(self.rule[0]) + 1) + single

    def warnings(self) -> Iterator[tuple[str, str]]:
        yield from super().warnings()
        successes = int(self.rule[0])
        if self.ratio is not None and self.ratio != RATIOS[successes]:
            own_percent, published_percent = (
                100 * converges_to(successes, ratio) for ratio in (self.ratio, RATIOS[successes])
            )
            yield (
                "ratio",
                f"{self.rule} with ratio {self.ratio:g} converges to {own_percent:.1f} % only if steps are small; "
                f"ratio = {RATIOS[successes]:g} converges to {published_percent:.1f} % with steps of any size",
            )
        if self.tracks == 1:
            yield "tracks", "participants can predict the levels of a single up–down track: choose tracks = 2"

    def target(self, guess: float | None, success: str) -> str | None:
        return f"converges to {self.target_percent:.1f} % {success}"

    @property
    def paper_name(self) -> str:
        return (
            f"weighted up–down tracks ({self.rule}, steps down {self._ratio:.4g} times the steps up; García-Pérez "
            f"1998) that converge to {self.target_percent:.1f} %"
        )

    target_percent = property(lambda self: 100 * converges_to(int(self.rule[0]), self._ratio))
    _ratio = property(lambda self: RATIOS[int(self.rule[0])] if self.ratio is None else self.ratio)

    def ended(self, track: TrackSetting, heard: Sequence[TrialResult]) -> bool:
        if self.stop is None:
            return False
        answers = _answers(track, heard)
        reversals = self.staircase(track.stimulus, track.number).reversals(answers)
        return len(answers) >= self.stop.after and len(reversals) >= self.stop.reversals

    def after(self, track: TrackSetting, heard: Sequence[TrialResult]) -> float:
        """Return the level that follows these answers: one step from the last level, or the same level."""
        low, high = track.stimulus.levels
        u = self.staircase(track.stimulus, track.number).next(_answers(track, heard))
        return min(max(track.stimulus.level_of(u), low), high)

    def simulated(self, track: TrackSetting, observers: Observers, random: Generator, noise: Floats | None) -> Answers:
        draws = random.random((len(observers.thresholds), self.presentations(track.stimulus)))
        stop = None if self.stop is None else (self.stop.reversals, self.stop.after)
        return staircase_tracks(self.staircase(track.stimulus, track.number), observers, draws, stop)

    def reversals(self, track: TrackSetting, answers: Sequence[Answer]) -> tuple[int, ...]:
        return tuple(
            self.staircase(track.stimulus, track.number).reversals_at(_with_coordinates(track.stimulus, answers))
        )

    def reversal_mean(self, track: TrackSetting, answers: Sequence[Answer]) -> float | None:
        """Return the level of the mean of the last reversals; None if there are too few."""
        staircase = self.staircase(track.stimulus, track.number)
        mean = staircase.mean_of_reversals(_with_coordinates(track.stimulus, answers), self.average)
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


def _answers(track: TrackSetting, heard: Sequence[TrialResult]) -> list[Answer]:
    """Return the answers with levels in u, without those to noise trials, which do not affect a track."""
    return _with_coordinates(
        track.stimulus, [(result.level, bool(result.success)) for result in heard if not result.noise]
    )


def _with_coordinates(stimulus: Stimulus, answers: Sequence[Answer]) -> list[Answer]:
    return [(stimulus.coordinate(level), success) for level, success in answers]


class _RecordedMethod(Method):
    """A method of a plug-in that is not installed, from a key: its levels were presented and are not computed."""

    model_config = ConfigDict(extra="allow")

    kind: str

    def presentations(self, stimulus: Stimulus) -> int:
        raise PlugInError(": ".join(METHOD_KINDS.missing(self.kind)))

    def levels_of(self, stimulus: Stimulus) -> tuple[float, ...]:
        return stimulus.levels

    def level(self, track: TrackSetting, number: int, heard: Sequence[TrialResult], draws: Sequence[Draw]) -> float:
        return float(self.presentations(track.stimulus))


_MAX_PRESENTATIONS: Final = 10_000
"""Greatest number of comparisons in a track of a plug-in."""
METHOD_KINDS: Final = Registry[type[Method]](
    "method",
    {"adjustment": Adjustment, "constant": Constant, "questplus": QuestPlus, "updown": UpDown},
    Method,
    "kind",
    {
        "presentations": Returns(
            f"a whole number from 1 to {_MAX_PRESENTATIONS:,}",
            lambda value: isinstance(value, Integral) and 1 <= int(value) <= _MAX_PRESENTATIONS,
        ),
        "levels_of": Returns("at least one number", lambda values: are_numbers(values) and len(values) > 0),
        "level": number_between(-1e12, 1e12),
        "ended": Returns("True or False", lambda value: value in (True, False)),
        "paper_name": instance_of(str),
    },
)

if TYPE_CHECKING:
    AnyMethod: TypeAlias = Method
else:
    AnyMethod = Annotated[
        reduce(or_, METHOD_KINDS.own.values()),
        Field(discriminator="kind"),
        OfKinds(METHOD_KINDS, Method, _RecordedMethod),
    ]


def default_method(kind: str) -> Method:
    """Return the method of a kind with all its defaults; raise KeyError for an unknown kind."""
    return METHOD_KINDS[kind].model_validate({"kind": kind})

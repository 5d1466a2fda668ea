"""Stimuli: the varied number of a condition, its levels, and assumptions about the psychometric function.

The prior is flat in the threshold, log-normal in the width, and a list of values for the lapse rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar, Final, Literal, Self, TypeAlias, TypeVar

from pydantic import Field, model_validator
from pydantic.json_schema import SkipJsonSchema

from study_app.haptics.model.ranges import later, within
from study_app.haptics.model.scene import ForceLink
from study_app.protocol.quantities import quantity, quantity_text
from study_app.protocol.source.table import Id, Table, invalid
from study_app.protocol.trials.designs import Design
from study_app.psychophysics.families import Family, Floats
from study_app.psychophysics.grid import FREE_GUESSES, DecadeKind, Grid, Values, evenly, geometric, lapse_prior

_Level = TypeVar("_Level", float, Floats)
"""A level or value, or an array of them."""
_LevelKind: TypeAlias = Literal["weber", "difference", "value"]

DELAY: Final = "delay_ms"
FORCE_DELAY: Final = "force_delay_ms"
DELAYS: Final = (DELAY, FORCE_DELAY)
MOST_DELAY_MS: Final = 1000
OF_LINK: Final = {
    FORCE_DELAY: ForceLink.MOST_DELAY_MS,
    "force_jitter_ms": ForceLink.MOST_JITTER_MS,
    "force_loss": ForceLink.MOST_LOSS,
}
OF_CONDITION: Final = {DELAY: MOST_DELAY_MS, **OF_LINK}
"""The numbers that can be varied and belong to the condition, not to its liquid, with their maxima."""
CONSTANT_LEVELS: Final = 7
MAX_LEVELS: Final = 201


class Condition(Table):
    """A named combination of a liquid (or several with regions), what the tank shows, and delays."""

    ONE_OF: ClassVar[tuple[tuple[str, str], ...]] = (("liquid", "liquids"),)

    liquid: Id | None = Field(default=None, description="The liquid; alternatively, specify liquids.")
    liquids: tuple[Id, ...] = Field(
        default=(), description=("Several liquids; where they overlap, the one listed last applies.")
    )
    delay_ms: Annotated[
        float, within(0, MOST_DELAY_MS, "a picture that is more than 1 s late does not act as feedback", of_most=True)
    ] = Field(default=0, description="Delay of everything drawn in the tank [ms].")
    label: Id | None = Field(
        default=None, description="The item in analysis.names that names this condition correctly; default: none."
    )
    ball: Literal["shown", "hidden"] = later(
        default="shown",
        description="shown: the ball is always drawn; hidden: it is drawn only during the task's lead-in.",
    )
    force_delay_ms: Annotated[
        float, within(0, ForceLink.MOST_DELAY_MS, "with a longer delay, the force pushes the hand", of_most=True)
    ] = later(default=0, description="Force delay [ms]; the picture is not delayed.")
    force_jitter_ms: Annotated[
        float, within(0, ForceLink.MOST_JITTER_MS, "jitter in networks is smaller", of_most=True)
    ] = later(default=0, description="Maximum additional force delay, drawn at random at every tick [ms].")
    force_loss: Annotated[
        float,
        within(0, ForceLink.MOST_LOSS, "with higher losses, most forces would repeat the previous one", of_most=True),
    ] = later(default=0, description="Proportion of ticks at which the force is lost and the previous force is held.")
    view: str = later(
        default="tank",
        pattern=r"^(tank|camera|[^\x00]+\.[0-9A-Za-z]+)$",
        description="tank: the drawn tank; camera: the live image from this computer's camera; or the path of a "
        "video file, relative to this file.",
    )
    overlay: Literal["shown", "hidden"] = later(
        default="shown",
        description="shown: the ball and the targets are drawn over a video; hidden: the video is shown without them.",
    )
    footage_sha256: SkipJsonSchema[str | None] = later()
    """The SHA-256 of the video file; ``load`` fills it in."""

    @property
    def liquid_ids(self) -> tuple[str, ...]:
        return self.liquids if self.liquid is None else (self.liquid,)

    @property
    def shows_video(self) -> bool:
        """Whether a video, live or from a file, replaces the drawn tank."""
        return self.view != "tank"

    @property
    def seen(self) -> tuple[str, str]:
        """The view, and whether ball and targets are drawn over it."""
        return self.view, self.overlay

    def link(self, seed: int = 0) -> ForceLink:
        """Return the link between force model and hand; ``seed`` is for jitter and loss."""
        return ForceLink(
            delay_s=self.force_delay_ms / 1000, jitter_s=self.force_jitter_ms / 1000, loss=self.force_loss, seed=seed
        )


@lru_cache(maxsize=64)  # every trial needs them; with the cache of `_running_grid`, a trial takes a third less time
def _spaced_levels(low: float, high: float, log: bool, count: int) -> tuple[float, ...]:
    if count == 1:
        return (high,)
    proportions = [number / (count - 1) for number in range(count)]
    if not log:
        return tuple(low + (high - low) * proportion for proportion in proportions)
    inner = (math.exp(math.log(low) + math.log(high / low) * proportion) for proportion in proportions[1:-1])
    return (low, *inner, high)


LEVEL_RULES: Final = 2
"""Version of the rules for choosing levels, as stated in receipts. Since 2, all widths are equally likely."""
_RUNNING_THRESHOLDS: Final = 41
_RUNNING_WIDTHS: Final = 9
_WIDTHS: Final = (0.5, 4.0)
"""The smallest and the largest width while levels are chosen [decades]."""
_ANALYSIS_WIDTHS: Final = (0.15, 5.6)
"""The same for the analysis; people's functions are 0.2 to 2 decades wide."""
LINEAR_WIDTH: Final = 1.4
"""Width of an observer whose d′ is proportional to the level [decades]."""
WIDTH_PRIOR: Final = (0.5, 2.0)
"""Median and factor of people's widths [decades]. The median is the slope of 3.5 that QUEST assumes.

(Watson & Pelli 1983, Percept. Psychophys. 33, 113–120.) Of three medians, it fits published answers on discrimination
best, as confirmed for plaid and checkerboard (``tests/benchmarks/analysis/people.py``).
"""
LAPSES: Final = (0.0, 0.02, 0.04)
_LAPSE_PRIOR: Final = (0.4, 0.4, 0.2)
ANALYSIS_LAPSES: Final = (0.0, 0.01, 0.02, 0.03, 0.045, 0.065, 0.09, 0.12, 0.16)
SESSION_SD: Final = 0.049
"""Standard deviation of a person's threshold between sessions [decades]; interval [0.034, 0.077].

Estimated from six observers of Jäkel & Wichmann 2006 (J. Vision 6:13) between series of 400 trials
(``tests/benchmarks/analysis/people.py --spread``). A point of subjective equality is assumed to vary by
the same proportion of the just-noticeable difference. [choice]
"""
_MARGIN_DECADES: Final = 0.4
_MARGIN_SPANS: Final = 0.25
"""Thresholds are estimated up to this far beyond the levels: in decades if spaced logarithmically, else in spans."""


@dataclass(frozen=True, slots=True)
class Assumed:
    """The assumptions about the psychometric function of a block.

    ``widths`` are the smallest and the largest width while levels are chosen, ``width_prior`` is the median and the
    factor of the log-normal prior in the analysis, both in u.
    """

    family: Family
    widths: tuple[float, float]
    width_prior: tuple[float, float]


@lru_cache(maxsize=64)
def _running_grid(
    family: Family, domain: tuple[float, float], widths: tuple[float, float], lapses: Values, guesses: Values | None
) -> Grid:
    return Grid(
        family=family,
        thresholds=evenly(*domain, _RUNNING_THRESHOLDS),
        widths=geometric(*widths, _RUNNING_WIDTHS),
        width_prior=None,
        lapses=lapses,
        lapse_prior=_LAPSE_PRIOR if lapses == LAPSES else (1.0 / len(lapses),) * len(lapses),
        guesses=guesses,
    )


class Stimulus(Table):
    """A parameter to vary, its standards, and the range of its levels L.

    The comparison with a standard s is s(1 ± L) if the level kind is ``weber``, s ± L if it is ``difference``, and L
    itself if it is ``value``. Levels are evenly spaced in u = log10 L or in u = L.
    """

    condition: Id | None = Field(
        default=None, description="The condition to vary; default: the study's only condition."
    )
    vary: str = Field(
        max_length=60, description=f"The parameter to vary, named as in simulate --set, or {', '.join(OF_CONDITION)}."
    )
    level: _LevelKind | None = Field(
        default=None,
        description="What a level means. weber: (comparison − standard)/standard (the default); difference: "
        "comparison − standard (the default for times, …_ms); value: the comparison itself.",
    )
    standards: tuple[float, ...] = Field(
        default=(), max_length=8, description="The standard stimuli; default: the parameter's current value."
    )
    levels: tuple[float, float] = Field(description="The smallest and the largest level.")
    spacing: Literal["log", "linear"] = Field(
        default="log", description="Spacing of the levels in between. log: equal ratios; linear: equal steps."
    )
    steps: Annotated[int, Field(ge=2, le=MAX_LEVELS)] = Field(default=31, description="Number of levels.")
    direction: Literal["up", "down"] = Field(
        default="up", description="up: comparisons are above the standard; down: below it."
    )

    @property
    def quantity(self) -> str:
        """The name of the varied quantity within a sentence; raises KeyError if there is none."""
        return quantity_text(self.vary)

    @property
    def unit(self) -> str:
        """The unit of the varied quantity; raises KeyError if there is none."""
        return quantity(self.vary).unit

    @property
    def level_kind(self) -> _LevelKind:
        return self.level or ("difference" if self.vary.endswith("_ms") else "weber")

    def comparison(self, standard: float | None, level: _Level) -> _Level:
        """Return the comparison at a level, in the varied number's unit.

        Level 0 is the standard itself; ``standard`` is None if the level is the value itself.
        """
        if standard is None or self.level_kind == "value":
            return level
        distance = standard * level if self.level_kind == "weber" else level
        return standard + distance if self.direction == "up" else standard - distance

    def level_between(self, standard: float | None, comparison: _Level) -> _Level:
        """Return the level of a comparison, the inverse of `comparison`."""
        if standard is None or self.level_kind == "value":
            return comparison
        distance = comparison - standard if self.direction == "up" else standard - comparison
        return distance / standard if self.level_kind == "weber" else distance

    def coordinate(self, level: float) -> float:
        """Return u of a level: its log10 (−∞ for 0) if levels are spaced logarithmically, else the level itself."""
        if self.spacing == "linear":
            return level
        return math.log10(level) if level > 0 else -math.inf

    def level_of(self, u: float) -> float:
        return 10.0**u if self.spacing == "log" else u

    @property
    def domain(self) -> tuple[float, float]:
        return self.coordinate(self.levels[0]), self.coordinate(self.levels[1])

    def spaced(self, count: int) -> tuple[float, ...]:
        """Return ``count`` levels, evenly spaced over the range, smallest first."""
        return _spaced_levels(*self.levels, self.spacing == "log", count)

    @property
    def grid(self) -> tuple[float, ...]:
        return self.spaced(self.steps)

    def ratio(self, low: float, high: float) -> float:
        """Return the ratio of two levels given in u; infinite if the lower is not above zero."""
        low_level = self.level_of(low)
        return self.level_of(high) / low_level if low_level > 0 else math.inf

    @property
    def _is_relative(self) -> bool:
        """Whether levels are relative to a standard."""
        return self.level_kind != "value"

    def rises(self, design: Design) -> bool:
        """Return whether the proportion of successes increases with the level, so that there is a threshold.

        It does not if levels are values and the question is for the odd or the repeated interval, because differences
        are noticed both above and below the standard.
        """
        return design.adaptive and (self._is_relative or not design.has_standard or design.asks_for_more)

    def has_pse(self, design: Design) -> bool:
        """Return whether the threshold is a point of subjective equality (PSE): the level chosen in half of the trials.

        The levels are values above and below a standard, and the question is which one is stronger.
        """
        return not self._is_relative and design.has_standard and self.rises(design)

    def threshold_term(self, design: Design) -> str:
        """Return the term for the estimated level."""
        return "point of subjective equality" if self.has_pse(design) else "threshold"

    def decade_kind(self, design: Design) -> DecadeKind:
        """Return what a change of the threshold by a decade is in u."""
        if self.has_pse(design):
            return "jnd"
        return "constant" if self.spacing == "log" else "threshold"

    def assumed(self, design: Design) -> Assumed:
        """Return the default assumptions about the psychometric function."""
        low, high = self.domain
        log, span = self.spacing == "log", high - low
        # Weibull, since a distance of zero must give chance performance
        starts_at_chance = self._is_relative and log and design.guess_rate is not None
        return Assumed(
            family="weibull" if starts_at_chance else "normal",
            widths=_WIDTHS if log else (span / 8, 2 * span),
            width_prior=WIDTH_PRIOR if log and self._is_relative else (span / 2, 2.0),
        )

    def guesses(self, design: Design) -> tuple[float, ...] | None:
        """Return the guess rates of a design; None if no answer is correct, so that guesses are lapses."""
        if design.has_standard and not self._is_relative:
            return None
        return FREE_GUESSES if design.guess_rate is None else (design.guess_rate,)

    def running_grid(self, design: Design, assumed: Assumed, lapses: tuple[float, ...]) -> Grid:
        """Return the grid for choosing levels during a session.

        All widths are equally likely, so that levels stay at the threshold whatever the width of a person's function;
        with levels above the threshold, its estimate would depend on the prior.
        """
        return _running_grid(assumed.family, self.domain, assumed.widths, lapses, self.guesses(design))

    def analysis_grid(self, design: Design, assumed: Assumed, sessions: float = 1) -> Grid:
        """Return the grid for estimating thresholds: finer, and extended beyond both ends of the levels.

        The thresholds of the ``sessions`` vary about the person's threshold, which is estimated, by `SESSION_SD`.
        """
        low, high = self.domain
        log = self.spacing == "log"
        margin = _MARGIN_DECADES if log else _MARGIN_SPANS * (high - low)
        narrowest, widest = assumed.widths
        low_width, high_width = _ANALYSIS_WIDTHS if log else (0.3 * narrowest, 1.4 * widest)
        return Grid(
            family=assumed.family,
            thresholds=evenly(low - margin, high + margin, 97),
            widths=geometric(min(low_width, 0.7 * narrowest), max(high_width, 1.4 * widest), 17),
            width_prior=assumed.width_prior,
            lapses=ANALYSIS_LAPSES,
            lapse_prior=lapse_prior(ANALYSIS_LAPSES),
            guesses=self.guesses(design),
            session_sd=SESSION_SD / math.sqrt(sessions),
            decade=self.decade_kind(design),
        )

    @model_validator(mode="after")
    def _check_levels(self) -> Self:
        low, high = self.levels
        if not low < high:
            raise invalid(f"{low:g} is not less than {high:g}: the first level must be the smaller one", "levels")
        if self.spacing == "log" and low <= 0:
            raise invalid(
                f"{low:g} cannot be spaced logarithmically, because it is not above 0",
                "levels",
                'spacing = "linear", or a level above 0',
            )
        if low < 0 and self.level_kind != "value":
            raise invalid(f"{low:g} is below 0", "levels", 'direction = "down" for comparisons below the standard')
        return self

    @model_validator(mode="after")
    def _check_standards(self) -> Self:
        if self.level_kind == "weber" and any(standard == 0 for standard in self.standards):
            raise invalid("the Weber fraction is not defined for a standard of 0", "level", 'level = "difference"')
        if len(set(self.standards)) < len(self.standards):
            raise invalid("the same standard is listed twice", "standards")
        return self


@dataclass(frozen=True, slots=True, repr=False)
class Stimulated:
    """The content of one interval: a condition with its varied number, not printable because it reveals the level.

    ``vary`` is None if the condition is presented unchanged; ``value`` is in the unit at the end of that name.
    """

    condition: str
    vary: str | None = None
    value: float = 0.0

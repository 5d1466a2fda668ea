"""The levels of a block: in words, along an axis, and as limits clip them."""

import math
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from study_app.gui.theme.theme import Theme
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.presented.presented_levels import Clipping, Level, LevelLimits, clipping, level_limits, levels
from study_app.protocol.quantities import quantity
from study_app.protocol.tracks import design_of, stimulus_of, success_name
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.stimuli import Stimulus

Limit: TypeAlias = Literal["norm", "slope"]
Ticks: TypeAlias = tuple[tuple[float, str], ...]
LIMIT_NAMES: Final[dict[Limit, str]] = {"norm": "force limit", "slope": "slope limit"}
_AS_ASKED: Final = "The simulation uses the requested levels"
_MOST_TICKS: Final = 7
_BY_DECADE: Final = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0), tuple(range(1, 10)))
_STEPS: Final = (1, 2, 2.5, 5, 10)


@dataclass(frozen=True, slots=True)
class LevelWords:
    """How the levels of a stimulus are written: Weber fractions in percent, all others in their unit."""

    stimulus: Stimulus
    design: Design

    @property
    def factor(self) -> float:
        return 100.0 if self.stimulus.level_kind == "weber" else 1.0

    @property
    def unit(self) -> str:
        return "%" if self.stimulus.level_kind == "weber" else self.value_unit

    @property
    def value_unit(self) -> str:
        try:
            return quantity(self.stimulus.vary).unit
        except KeyError:
            return ""

    @property
    def name(self) -> str:
        """The name of the estimate: just noticeable difference, threshold of a value, or detection threshold."""
        detected = self.design.has_noise or self.stimulus.standards == (0.0,)
        return "threshold" if detected or self.stimulus.level_kind == "value" else "JND"

    @property
    def kind(self) -> str:
        return {"weber": "Weber fraction", "difference": "difference", "value": "value"}[self.stimulus.level_kind]

    @property
    def success(self) -> str:
        return success_name(self.design, self.stimulus)

    def number(self, level: float, digits: int = 3) -> str:
        return rounded(level * self.factor, digits)

    def words(self, level: float, digits: int = 3) -> str:
        return f"{self.number(level, digits)} {self.unit}".rstrip()

    def at(self, level: float) -> float:
        """Return the axis position of a level: its coordinate, the smallest one for levels without a logarithm."""
        low, _ = self.stimulus.domain
        return max(self.stimulus.coordinate(level), low - 1.0)

    def ticks(self, most: int = _MOST_TICKS) -> Ticks:
        """Return round levels between the ends with their axis positions."""
        low, high = (self.factor * level for level in self.stimulus.levels)
        values = log_ticks(low, high, most) if self.stimulus.spacing == "log" else even_ticks(low, high, most)
        return tuple((self.stimulus.coordinate(value / self.factor), rounded(value)) for value in values)


@dataclass(frozen=True, slots=True)
class LevelBlock:
    """A block with a stimulus: what its levels are, how limits clip them, and whether their forces are known."""

    protocol: Protocol
    block: Block
    words: LevelWords
    levels: tuple[Level, ...]
    limits: LevelLimits | None
    clipping: Clipping | None
    forces: bool = True

    @property
    def standard(self) -> float | None:
        """The shown standard: the highest, whose forces are the strongest."""
        return max((level.standard for level in self.levels if level.standard is not None), default=None)

    @property
    def shown(self) -> tuple[Level, ...]:
        """The levels of the shown standard."""
        return tuple(level for level in self.levels if level.standard == self.standard)

    @property
    def clipped_from(self) -> tuple[float, Limit] | None:
        """The axis position from which a limit clips the force, with the limit; None if no level is beyond it."""
        level = math.inf if self.clipping is None else self.clipping.highest(self.words.stimulus)
        if self.limits is None or not math.isfinite(level):
            return None
        return self.words.at(level), "norm" if self.limits.force == self.limits.lowest else "slope"

    def can_measure(self, threshold: float) -> bool:
        """Return whether a threshold is below the highest unclipped level."""
        paced = self.clipping is not None and self.clipping.paced
        return not paced or self.clipping is None or threshold < self.clipping.highest(self.words.stimulus)

    @property
    def as_asked(self) -> str:
        """A sentence that clipped levels are simulated as requested; "" if none is clipped or as presented."""
        simulated = self.clipping is not None and self.clipping.paced
        return "" if simulated or all(level.clipped_by is None for level in self.shown) else _AS_ASKED

    @property
    def clipped_words(self) -> str:
        """A sentence on the clipped levels and their simulation; "" if none is clipped."""
        if self.clipping is None:
            return self.as_asked
        highest = self.clipping.highest(self.words.stimulus)
        named = self.clipping.named and f"{self.clipping.named} {self.words.value_unit}".rstrip()
        which = f"Levels above {self.words.words(highest)}{named and f' of standard{named}'} are"
        if self.clipping.clips_standard:
            which = f"The standard{named} is"
        if self.clipping.paced:
            return f"{which} clipped: the simulation uses the clipped levels"
        return f"{which} clipped in fast motions; such trials are repeated. {_AS_ASKED}"


def level_block(protocol: Protocol, block: Block, *, forces: bool = True) -> LevelBlock | None:
    """Return a block's levels; None if it varies nothing. Without ``forces`` its limits are unknown."""
    if block.stimulus is None or block.design is None:
        return None
    presented = levels(protocol, block.id)
    wording = LevelWords(stimulus_of(protocol, block), design_of(protocol, block))
    if not forces:
        return LevelBlock(protocol, block, wording, presented, None, None, forces)
    limits = level_limits(protocol, block)
    return LevelBlock(protocol, block, wording, presented, limits, clipping(protocol, block, limits), forces)


def limit_colour(theme: Theme, limit: Limit) -> str:
    """Return the colour of a limit, the same on the axis of the levels and in every plot."""
    return theme.bad if limit == "slope" else theme.warn


def rounded(value: float, digits: int = 3) -> str:
    """Return a number with at most so many digits, without an exponent."""
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "–"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:.{places}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def log_ticks(low: float, high: float, most: int = _MOST_TICKS) -> tuple[float, ...]:
    """Return round numbers in an interval above 0, by decades, at most so many."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    best: tuple[float, ...] = ()
    for steps in _BY_DECADE:
        numbers = [step * 10.0**decade for decade in decades for step in steps]
        inside = tuple(number for number in numbers if low * (1 - 1e-9) <= number <= high * (1 + 1e-9))
        if len(best) < len(inside) <= most:
            best = inside
    return best if len(best) > 1 else (low, high)


def even_ticks(low: float, high: float, most: int = _MOST_TICKS) -> tuple[float, ...]:
    """Return round numbers in an interval, evenly spaced, at most so many."""
    if high <= low:
        return (low,)
    power = 10.0 ** math.floor(math.log10((high - low) / most))
    step = next(
        power * factor
        for factor in (*_STEPS, 20)
        if math.floor(high / (power * factor)) - math.ceil(low / (power * factor)) < most
    )
    first = math.ceil(low / step - 1e-9)
    return tuple(number * step for number in range(first, math.floor(high / step + 1e-9) + 1))

"""Levels of a stimulus in words, their places along an axis, and its ticks."""

import math
from dataclasses import dataclass
from typing import Final

from study_app.designer.measures.number_cards import Ticks
from study_app.protocol.quantities import quantity
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.stimuli import Stimulus
from study_app.protocol.trials.tracks import success_name

MOST_TICKS: Final = 7
_BY_DECADE: Final = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0), tuple(range(1, 10)))
_STEPS: Final = (1, 2, 2.5, 5, 10)


@dataclass(frozen=True, slots=True)
class LevelWords:
    """How the levels of a stimulus are written: Weber fractions in percent, all others in their unit."""

    stimulus: Stimulus
    design: Design

    @property
    def factor(self) -> float:
        """What a level is multiplied by."""
        return 100.0 if self.stimulus.level_kind == "weber" else 1.0

    @property
    def unit(self) -> str:
        """The unit of a level."""
        return "%" if self.stimulus.level_kind == "weber" else self.value_unit

    @property
    def value_unit(self) -> str:
        """The unit of the varied number."""
        try:
            return quantity(self.stimulus.vary).unit
        except KeyError:
            return ""

    @property
    def name(self) -> str:
        """What is estimated: the just noticeable difference, or a threshold of a value, or of what is there at all."""
        detected = self.design.has_noise or self.stimulus.standards == (0.0,)
        return "threshold" if detected or self.stimulus.level_kind == "value" else "JND"

    @property
    def kind(self) -> str:
        """What a level is."""
        return {"weber": "Weber fraction", "difference": "difference", "value": "value"}[self.stimulus.level_kind]

    @property
    def success(self) -> str:
        """What a share of answers is of."""
        return success_name(self.design, self.stimulus)

    def number(self, level: float, digits: int = 3) -> str:
        """Return a level without its unit."""
        return rounded(level * self.factor, digits)

    def words(self, level: float, digits: int = 3) -> str:
        """Return a level with its unit."""
        return f"{self.number(level, digits)} {self.unit}".rstrip()

    def at(self, level: float) -> float:
        """Return the place of a level: its coordinate, the least one for levels without a logarithm."""
        low, _ = self.stimulus.domain
        return max(self.stimulus.coordinate(level), low - 1.0)

    def ticks(self, most: int = MOST_TICKS) -> Ticks:
        """Return round levels between the ends, at their places."""
        low, high = (self.factor * level for level in self.stimulus.levels)
        values = log_ticks(low, high, most) if self.stimulus.spacing == "log" else even_ticks(low, high, most)
        return tuple((self.stimulus.coordinate(value / self.factor), rounded(value)) for value in values)


def rounded(value: float, digits: int = 3) -> str:
    """Return a number with so many digits at most, without an exponent."""
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "–"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:.{places}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def log_ticks(low: float, high: float, most: int = MOST_TICKS) -> tuple[float, ...]:
    """Return round numbers in an interval above 0, by decades, at most so many."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    best: tuple[float, ...] = ()
    for steps in _BY_DECADE:
        found = [step * 10.0**decade for decade in decades for step in steps]
        inside = tuple(one for one in found if low * (1 - 1e-9) <= one <= high * (1 + 1e-9))
        if len(best) < len(inside) <= most:
            best = inside
    return best if len(best) > 1 else (low, high)


def even_ticks(low: float, high: float, most: int = MOST_TICKS) -> tuple[float, ...]:
    """Return round numbers in an interval, evenly spaced, at most so many."""
    if high <= low:
        return (low,)
    power = 10.0 ** math.floor(math.log10((high - low) / most))
    step = next(
        power * one for one in (*_STEPS, 20) if math.floor(high / (power * one)) - math.ceil(low / (power * one)) < most
    )
    first = math.ceil(low / step - 1e-9)
    return tuple(number * step for number in range(first, math.floor(high / step + 1e-9) + 1))

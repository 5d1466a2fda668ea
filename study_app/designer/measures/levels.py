"""The levels of a block as text and on an axis, and the block that uses an element."""

import math
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from study_app.gui.theme import Theme
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.source import Path
from study_app.protocol.trials import Stimulus

Limit: TypeAlias = Literal["norm", "slope"]
Ticks: TypeAlias = tuple[tuple[float, str], ...]
LIMIT_NAMES: Final[dict[Limit, str]] = {"norm": "force limit", "slope": "slope limit"}
_BY_DECADE: Final = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0), tuple(range(1, 10)))
_STEPS: Final = (1, 2, 2.5, 5, 10)


@dataclass(frozen=True, slots=True)
class LevelFormat:
    """The text format of a stimulus' levels: Weber fractions in percent, others in their unit."""

    stimulus: Stimulus

    @property
    def factor(self) -> float:
        return 100.0 if self.stimulus.level_kind == "weber" else 1.0

    @property
    def unit(self) -> str:
        return "%" if self.stimulus.level_kind == "weber" else self.value_unit

    @property
    def value_unit(self) -> str:
        try:
            return self.stimulus.unit
        except KeyError:
            return ""

    @property
    def kind(self) -> str:
        return {"weber": "Weber fraction", "difference": "difference", "value": "value"}[self.stimulus.level_kind]

    def number(self, level: float, digits: int = 3) -> str:
        return rounded(level * self.factor, digits)

    def text(self, level: float, digits: int = 3) -> str:
        return f"{self.number(level, digits)} {self.unit}".rstrip()


_BLOCK_KEYS: Final = {"stimuli": "stimulus", "methods": "method", "designs": "design",
                      "questionnaires": "questionnaire", "tasks": "task"}  # fmt: skip


def block_of(protocol: Protocol | None, path: Path) -> Block | None:
    """Return the selected block, or the first one, preferably main, that uses the selected element."""
    if protocol is None or len(path) < 2:
        return None
    if (key := _BLOCK_KEYS.get(str(path[0]))) is None:
        return protocol.blocks.get(str(path[1])) if path[0] == "blocks" else None
    users = [user for user in protocol.blocks_in_order if getattr(user, key) == path[1]]
    return next((user for user in users if user.phase == "main"), next(iter(users), None))


def limit_colour(theme: Theme, limit: Limit) -> str:
    """Return the colour of a limit, which is the same on the axis of levels and in every plot."""
    return theme.bad if limit == "slope" else theme.warn


def rounded(value: float, digits: int = 3) -> str:
    """Return a number as text with at most ``digits`` significant digits, without an exponent."""
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "–"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:.{places}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def log_ticks(low: float, high: float, most: int) -> tuple[float, ...]:
    """Return at most ``most`` round numbers, spaced by decades, in an interval above 0."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    best: tuple[float, ...] = ()
    for steps in _BY_DECADE:
        numbers = [step * 10.0**decade for decade in decades for step in steps]
        inside = tuple(number for number in numbers if low * (1 - 1e-9) <= number <= high * (1 + 1e-9))
        if len(best) < len(inside) <= most:
            best = inside
    return best if len(best) > 1 else (low, high)


def even_ticks(low: float, high: float, most: int) -> tuple[float, ...]:
    """Return at most ``most`` round numbers, evenly spaced, in an interval."""
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

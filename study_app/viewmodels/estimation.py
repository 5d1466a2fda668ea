"""What the lab shows of an estimation from measured force, as values."""

from dataclasses import dataclass
from typing import Final, TypeAlias

Choices: TypeAlias = tuple[tuple[str, str], ...]

OFF: Final = "off"
FILE: Final = "file"
DRAG: Final = "drag"
WAKE: Final = "wake"
SOURCES: Final[Choices] = (
    (OFF, "No measured force"),
    ("other", "Simulated sensor, other setting"),
    ("device", "Force of the device"),
    (FILE, "Growing CSV file …"),
)
LSL: Final[Choices] = (("lsl", "LSL stream"),)
PARAMETERS: Final[Choices] = ((DRAG, "Drag coefficient"), (WAKE, "Drag coefficient and wake"))


@dataclass(frozen=True, slots=True)
class EstimateRow:
    """A parameter with its estimated value and 95 % interval, written out."""

    name: str
    value: str
    interval: str


@dataclass(frozen=True, slots=True)
class EstimateShown:
    """An estimation: where the force comes from, which parameters, what was found, and what may be done with it.

    ``message`` says why nothing is found or applied, or how much of the force is left. ``sound`` is whether the motion
    identifies the values; only then ``may_apply`` can be true. ``follows`` is whether values are applied continuously.
    """

    sources: Choices = SOURCES
    source: str = OFF
    parameters: str = DRAG
    rows: tuple[EstimateRow, ...] = ()
    message: str = ""
    sound: bool = False
    may_apply: bool = False
    may_follow: bool = False
    follows: bool = False


NO_ESTIMATE: Final = EstimateShown()

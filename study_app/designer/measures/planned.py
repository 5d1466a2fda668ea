"""What simulated observers and studies of a block find: what the worker of the tab Measures answers."""

from dataclasses import dataclass
from typing import Final

from study_app.designer.measures.observers import Measurable, Observed

ENOUGH: Final = 0.8
"""Participants are enough where so many simulated studies are as precise as planned."""


@dataclass(frozen=True, slots=True)
class GroupPrecision:
    """How many simulated studies know the group's mean threshold as precisely as planned.

    ``precision`` is half the group's 95 % interval that is wanted, as a share of the mean. With ``trials`` of each
    standard ``share`` of the studies reach it, with ``more_trials``, a third more, ``more_share``. ``enough`` is how
    many participants are enough, None if more than ``most``.
    """

    participants: int
    studies: int
    precision: float
    trials: int
    share: float
    more_trials: int
    more_share: float
    most: int
    enough: int | None


@dataclass(frozen=True, slots=True)
class Finding:
    """A statement of a block, and the smallest difference that 80 % of studies show [points]; None: none simulated."""

    item: str
    detectable: float | None


@dataclass(frozen=True, slots=True)
class Detectable:
    """The smallest differences that simulated studies of a block show, of each statement that the answer model knows.

    The smallest difference comes first; the scale has so many ``points``.
    """

    participants: int
    studies: int
    points: int
    findings: tuple[Finding, ...]


@dataclass(frozen=True, slots=True)
class Simulated:
    """What was simulated of an element, each part None until it was answered for the first time.

    ``waiting`` is said of numbers that are of an earlier study while others are simulated, ``failed`` why they cannot
    be; both are "" otherwise. ``warnings`` are those of ``check`` that take simulated observers.
    """

    observed: Observed | None = None
    measurable: Measurable | None = None
    group: GroupPrecision | None = None
    detectable: Detectable | None = None
    warnings: tuple[str, ...] = ()
    waiting: str = ""
    failed: str = ""

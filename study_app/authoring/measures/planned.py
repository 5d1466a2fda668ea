"""What simulated studies of so many participants find: values that the worker of slow numbers answers with."""

from dataclasses import dataclass
from typing import Final

ENOUGH: Final = 0.8
"""Participants are enough where so many simulated studies are as precise as planned."""


@dataclass(frozen=True, slots=True)
class GroupPrecision:
    """How many simulated studies know the group's mean threshold as precisely as planned.

    Attributes
    ----------
    participants, studies : int
        Of each study, and how many studies there were.
    precision : float
        Half the group's 95 % interval that is wanted, as a share of the mean.
    trials, more_trials : int
        Of each standard, as planned and a third more.
    share, more_share : float
        Of the studies within the precision, with as many trials.
    most : int
        Up to so many participants it was looked for how many are enough.
    enough : int or None
        How many participants are enough; None: more than ``most``.
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
    """The smallest differences that simulated studies of a block show.

    Attributes
    ----------
    participants, studies : int
        Of each study, and how many studies there were.
    points : int
        Of the scale.
    findings : tuple of Finding
        Each statement that the answer model knows, the smallest difference first.
    """

    participants: int
    studies: int
    points: int
    findings: tuple[Finding, ...]

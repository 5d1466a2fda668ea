"""What was found in a block of levels: times to answer and, once the key is open, the answers at each level."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from study_app.analysis.results.question_answers import GroupAnswers

Summary: TypeAlias = Literal["share", "mean", "geometric mean"]


@dataclass(frozen=True, slots=True)
class LevelAnswers:
    """The answers at one level, of one participant or, where ``participant`` is None, of all.

    A block that compares conditions has ``comparison`` in place of ``standard`` and ``level``. ``n`` answers of
    ``participants`` are summarised in ``value``, ``count`` of them are what a share counts. ``low`` and ``high`` are
    the ends of the 95 % interval: of a participant's share by Clopper and Pearson, otherwise by Student's t, over the
    answers of one participant, or over the participants' values.
    """

    participant: str | None
    standard: float | None
    level: float | None
    comparison: float | str | None
    n: int
    participants: int
    count: int | None
    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class ThresholdFound:
    """A participant's threshold at one standard or, where ``participant`` is None, the group's.

    ``threshold`` with the ends of its 95 % interval and ``flat_width`` (the threshold under a flat prior on the width)
    are levels. ``width`` reaches from 5 to 95 % of the function's rise, in decades on log spacing.
    ``beyond`` says that the threshold lies above or below the levels presented; ``reversal_mean`` is the up–down
    track's classical estimate. Of the group only ``n`` (participants), threshold and interval are known.
    """

    participant: str | None
    standard: float | None
    n: int
    threshold: float
    low: float | None
    high: float | None
    width: float | None = None
    lapse: float | None = None
    guess: float | None = None
    flat_width: float | None = None
    beyond: str | None = None
    reversal_mean: float | None = None


@dataclass(frozen=True, slots=True)
class LevelsFound:
    """A block of levels.

    ``summary`` says how the answers at a level are summarised, ``counts`` what a share is of ("correct"); ``vary`` is
    the varied number, ``quantity`` its name in words, ``unit`` its unit, ``level_kind`` what a level is (weber,
    difference, value), all None where conditions are compared; ``family`` is the psychometric function of the
    thresholds; ``adaptive``: answers chose the levels; ``guess_rate`` is the share at chance, ``bounds`` are the ends
    of a scale. Without the key only ``times`` are known.
    """

    block: str
    title: str
    design: str
    revealed: bool
    times: tuple[GroupAnswers, ...]
    summary: Summary
    counts: str
    vary: str | None = None
    quantity: str | None = None
    unit: str | None = None
    level_kind: str | None = None
    spacing: str = "linear"
    guess_rate: float | None = None
    bounds: tuple[float, float] | None = None
    answers: tuple[LevelAnswers, ...] = ()
    thresholds: tuple[ThresholdFound, ...] = ()
    family: str | None = None
    adaptive: bool = False

    @property
    def of_group(self) -> tuple[LevelAnswers, ...]:
        """The answers of all participants together, in order of standard and level."""
        return tuple(one for one in self.answers if one.participant is None)

    @property
    def own_thresholds(self) -> tuple[ThresholdFound, ...]:
        """The participants' thresholds."""
        return tuple(one for one in self.thresholds if one.participant is not None)

    @property
    def people(self) -> tuple[str, ...]:
        """The participants who answered."""
        return tuple(sorted({one.participant for one in self.answers if one.participant is not None}))

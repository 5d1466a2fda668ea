"""Weighted up–down staircases: the level falls after successes in a row and rises after each failure.

The ratio of the steps is that of García-Pérez 1998, at which a rule converges to the same percentage whatever the
observer's spread; equal steps converge to percentages that depend on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

Answer: TypeAlias = tuple[float, bool]
"""The level presented, in the coordinate u, and whether it was a success; in the order of presentation."""

RATIOS: Final = {1: 0.2845, 2: 0.5488, 3: 0.7393, 4: 0.8415}
"""Ratio of the step down to the step up, by the number of successes in a row before a step down."""
DROPPED: Final = 2
"""Number of first reversals left out, which depend on the start of the track."""


@dataclass(frozen=True, slots=True)
class Staircase:
    """A rule.

    Attributes
    ----------
    down_after : int
        Number of successes in a row before a step down.
    step_up : float
        Step after a failure, in the coordinate u.
    ratio : float
        Step down over step up.
    low, high : float
        The domain, in the coordinate u.
    begin : float
        The first level.
    """

    down_after: int
    step_up: float
    ratio: float
    low: float
    high: float
    begin: float

    @property
    def converges_to(self) -> float:
        """The probability of success at which the expected change is zero."""
        return converges_to(self.down_after, self.ratio)

    def next(self, answers: Sequence[Answer]) -> float:
        """Return the next level: a step from the last one presented, or the same again."""
        if not answers:
            return self.begin
        last = answers[-1][0]
        return min(max(last + self._moves(answers)[-1], self.low), self.high)

    def reversals_at(self, answers: Sequence[Answer]) -> list[int]:
        """Return the indices of the trials at which the direction changed."""
        found, before = [], 0.0
        for place, move in enumerate(self._moves(answers)):
            if move * before < 0.0:
                found.append(place)
            before = move or before
        return found

    def reversals(self, answers: Sequence[Answer]) -> list[float]:
        """Return the levels of the trials at which the direction changed."""
        return [answers[place][0] for place in self.reversals_at(answers)]

    def mean_of_reversals(self, answers: Sequence[Answer], average: int) -> float | None:
        """Return the mean of the last even number of reversals, up to ``average``; None if there are too few.

        The first two and those at an end of the domain are excluded.
        """
        kept = [level for level in self.reversals(answers)[DROPPED:] if self.low < level < self.high]
        count = min(len(kept), average) // 2 * 2
        return sum(kept[-count:]) / count if count else None

    def _moves(self, answers: Sequence[Answer]) -> list[float]:
        """Return the step that each answer causes; 0 while successes in a row are too few."""
        moves, successes = [], 0
        for _, success in answers:
            successes = successes + 1 if success else 0
            if not success:
                moves.append(self.step_up)
            elif successes == self.down_after:
                moves.append(-self.ratio * self.step_up)
                successes = 0
            else:
                moves.append(0.0)
        return moves


def converges_to(down_after: int, ratio: float) -> float:
    """Return the probability of success to which a rule converges: (1 + ratio)^(−1/down_after)."""
    return float((1.0 + ratio) ** (-1.0 / down_after))

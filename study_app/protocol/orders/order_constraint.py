"""A constraint on the order of trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Constraint:
    """At most ``max_repeats`` of a kind in a row, at least ``min_distance`` from one to the next; None: any."""

    max_repeats: int | None = None
    min_distance: int | None = None

    def holds(self, order: Sequence[object]) -> bool:
        """Return whether an order keeps it."""
        nearest = shortest_distance(order)
        near = nearest is not None and nearest < (self.min_distance or 1)
        return not near and (self.max_repeats is None or longest_run(order) <= self.max_repeats)

    def impossible(self, codes: int, repetitions: int) -> tuple[str, str] | None:
        """Return which key no order of ``codes`` codes, each ``repetitions`` times, can keep, and what it could."""
        if repetitions == 1:
            return None
        if self.min_distance is not None and self.min_distance > codes:
            possible = "one condition only 1" if codes == 1 else f"{codes} conditions only 1 to {codes}"
            return "min_distance", f"is {self.min_distance}, but with {possible} is possible"
        if self.max_repeats is not None and codes == 1 and self.max_repeats < repetitions:
            possible = f"one condition {repetitions} times only {repetitions} or more"
            return "max_repeats", f"is {self.max_repeats}, but with {possible} is possible"
        return None


def longest_run(order: Sequence[object]) -> int:
    """Return how many of a kind come in a row at most."""
    longest = run = 0
    for index, code in enumerate(order):
        run = run + 1 if index and code == order[index - 1] else 1
        longest = max(longest, run)
    return longest


def shortest_distance(order: Sequence[object]) -> int | None:
    """Return the least number of trials from one of a kind to the next; None if all are different."""
    latest: dict[object, int] = {}
    distances = []
    for index, code in enumerate(order):
        if code in latest:
            distances.append(index - latest[code])
        latest[code] = index
    return min(distances, default=None)

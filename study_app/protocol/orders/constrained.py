"""Random orders in which a code does not come too often in a row, or too soon again.

All trials of a block are shuffled together: n codes, each r times. With ``max_repeats`` m a code comes at most m times
in a row. With ``min_distance`` d two of its presentations are at least d trials apart: 2 is never twice in a row, 3
leaves two others in between.

**What is possible.** Round and round in one order of the codes, distances are n and runs are 1. If d > n, two of the
first n + 1 trials are alike and too near. So with r > 1 and n > 1, every m ≥ 1 and every d ≤ n is possible, and no
larger d. With a single code only m ≥ r and d = 1 are.

**How an order is drawn.** From left to right, among the codes that may come now without making the rest impossible. The
last k·d trials hold each code at most k times, so Σ min(left, k) ≥ k·d must stay true for every k; with m, j of a code
need j ≤ m·(others left + 1). A search through every state of small blocks (a test) finds no dead end. The chance of an
order drawn in this way is known, and not the same for all. So ``PROPOSALS`` are drawn and go through Metropolis' rule
for independent proposals, which tends to all possible orders being equally likely; all arithmetic in it is exact. The
chain starts with the codes round and round, so there is an order after that many steps for any draw. In small
blocks the exact chances are within 10⁻⁴ of uniform in total variation (a test); of a single proposal, within 0.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import TypeAlias, TypeVar

from study_app.protocol.orders.order_constraint import Constraint
from study_app.protocol.streams import Draw, shuffle

T = TypeVar("T")

Proposal: TypeAlias = tuple[tuple[int, ...], Fraction]

PROPOSALS = 32
_STEEPEST = 6


def arrange(codes: Sequence[T], repetitions: int, constraint: Constraint, draw: Draw) -> tuple[T, ...]:
    """Return every code ``repetitions`` times in a random order that keeps a constraint.

    ``draw`` gives uniform numbers in [0, 1); at most (len(codes) · repetitions + 1) · ``PROPOSALS`` + len(codes) of
    them are drawn.

    Raises
    ------
    ValueError
        No order keeps the constraint.
    """
    if (impossible := constraint.impossible(len(codes), repetitions)) is not None:
        raise ValueError(" ".join(impossible))
    chosen, weight = shuffle(range(len(codes)), draw) * repetitions, Fraction(0)
    for _ in range(PROPOSALS):
        proposal = propose(len(codes), repetitions, constraint, draw)
        if proposal is not None and Fraction(draw()) * weight < proposal[1]:
            chosen, weight = proposal
    return tuple(codes[code] for code in chosen)


def propose(codes: int, repetitions: int, constraint: Constraint, draw: Draw) -> Proposal | None:
    """Draw an order from left to right, and return it with one over its chance; None in a dead end."""
    apart = max(constraint.min_distance or 1, 2 if constraint.max_repeats == 1 else 1)
    left = Remaining(codes, repetitions, apart, constraint.max_repeats or codes * repetitions)
    steepness = _steepness(codes, repetitions, apart)
    masses = chosen_weights = 1
    for _ in range(codes * repetitions):
        weights = [(code, left.count[code] ** steepness) for code in left.may_come()]
        mass = sum(weight for _, weight in weights)
        if not mass:
            return None
        place = int(draw() * mass)
        for code, weight in weights:
            place -= weight
            if place < 0:
                left.take(code)
                chosen_weights *= weight
                break
        masses *= mass
    return tuple(left.taken), Fraction(masses, chosen_weights)


def _steepness(codes: int, repetitions: int, apart: int) -> int:
    """Return the power of what is left that weighs the codes; any is right, a good one needs few proposals.

    The nearer the distance to the number of codes, the less may one code get ahead of another. In the long run the
    ratio of the variances of a code's gaps, free to constrained, is n (n − 1) / ((n − d) (n − d + 1)); half way between
    1 and that does best in blocks of usual length **[measured]**.
    """
    room = (codes - apart) * (codes - apart + 1)
    if room <= 0:
        return 1
    return min((2 * room + codes * (codes - 1)) // (2 * room), 1 + repetitions // 2, _STEEPEST)


class Remaining:
    """What is left to come, and what of it may come next: ``apart`` trials after its like, ``run`` in a row."""

    def __init__(self, codes: int, repetitions: int, apart: int, run: int) -> None:
        self.count = [repetitions] * codes
        self.taken: list[int] = []
        self._total = codes * repetitions
        self._apart = apart
        self._run = run
        self._in_a_row = 0
        # Σ min(left, k) − k · apart for k = 0, 1, …: how many more the last k · apart trials could hold.
        self._slack = [k * (codes - apart) for k in range(repetitions + 1)]

    def may_come(self) -> list[int]:
        """Return the codes that may come next without making the rest impossible."""
        if self._apart > 1:
            recent = self.taken[-(self._apart - 1) :]
            least = self._tight() + 1
            return [code for code, left in enumerate(self.count) if left >= least and code not in recent]
        spent = self.taken[-1:] if self._in_a_row >= self._run else []
        urgent = [code for code, left in enumerate(self.count) if left > self._run * (self._total - left)]
        return [code for code in urgent or range(len(self.count)) if self.count[code] and code not in spent]

    def take(self, code: int) -> None:
        """Let a code come."""
        self._in_a_row = self._in_a_row + 1 if self.taken[-1:] == [code] else 1
        for k in range(self.count[code], len(self._slack)):
            self._slack[k] -= 1
        self.count[code] -= 1
        self.taken.append(code)
        self._total -= 1

    def _tight(self) -> int:
        """Return the largest k whose last k · apart trials need all that is left of every code with up to k."""
        most = min(len(self._slack) - 1, (self._total - 1) // self._apart)
        return next((k for k in range(most, 0, -1) if self._slack[k] <= 0), 0)

"""Orders of the codes of a block: rows of a square, and random orders within a constraint.

**Squares.** A Williams design (Williams 1949, Australian Journal of Scientific Research A 2, 149) of n codes is the
sequence 0, 1, n − 1, 2, n − 2, … with each of 0 … n − 1 added modulo n; for odd n also with every row reversed. Over
all its rows, n or 2n, each code has each position equally often and follows every other code equally often. A cyclic
Latin square is 0, 1, …, n − 1 with each shift; it balances only positions.

**Repetitions** continue in the same square. Where one row ends and the next begins, the new row is chosen by the
distance of its first code from the last code shown: 1, 2, …, n − 1, and again from 1 (backwards in a reversed square).
So no code follows itself, each repetition is as balanced as the first, and after the numbers of repetitions for which
`has_even_borders` is true, the borders between them are balanced, too.

**Rows** are assigned by enrolment: the last number in the participant's ID (P007 is number 7). Numbers 1 … rows are the
first round, the same number of next ones the second; each round assigns all rows in a new order. That order comes from
a stream of the *study*, not of the session, because sessions have different seeds and would not fill a round. So a
session's row depends only on the study's name, the block's name and the ID. It is predictable, which does no harm:
rows are rows of codes, and the meaning of a code is sealed. For an ID without a number, the row is drawn from the ID
itself, which is balanced only on average. A replacement can be given the replaced participant's rows. In a study with
groups, the number is the participant's position in the group, so that orders are balanced within each group.

**Constrained orders.** All trials of a block are shuffled together: n codes, each r times. With ``max_repeats`` m, a
code occurs at most m times in a row. With ``min_distance`` d, two of its presentations are at least d trials apart: 2
means never twice in a row, 3 means at least two other trials in between.

**Possible constraints.** If one order of the codes is repeated, distances are n and runs are 1. If d > n, two of the
first n + 1 trials are equal and too close. So with r > 1 and n > 1, every m ≥ 1 and every d ≤ n is possible, and no
larger d. With a single code, only m ≥ r and d = 1 are possible.

**How an order is drawn.** From left to right, among the codes that can come next without making the rest impossible.
The last k·d trials contain each code at most k times, so Σ min(left, k) ≥ k·d must remain true for every k; with m, j
remaining presentations of a code need j ≤ m·(others left + 1). A search through every state of small blocks (a test)
finds no dead end. The probability of an order drawn in this way is known, but not the same for all orders. So
``PROPOSALS`` orders are drawn and pass Metropolis' rule for independent proposals, which converges to all possible
orders being equally likely; its arithmetic is exact. The chain starts with one repeated order of the codes, so that
there is an order after all its steps for any draw. In small blocks, the exact probabilities are within 10⁻⁴ of uniform
in total variation (a test); those of a single proposal are within 0.3.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, TypeAlias, TypeVar

from study_app.number_text import counted
from study_app.protocol.randomization.streams import Draw, shuffle, study_stream


@dataclass(frozen=True, slots=True)
class Constraint:
    """At most ``max_repeats`` equal codes in a row, at least ``min_distance`` trials apart; None: unconstrained."""

    max_repeats: int | None = None
    min_distance: int | None = None

    def permits(self, order: Sequence[object]) -> bool:
        """Return whether an order satisfies the constraint."""
        nearest = shortest_distance(order)
        is_too_near = nearest is not None and nearest < (self.min_distance or 1)
        return not is_too_near and (self.max_repeats is None or longest_run(order) <= self.max_repeats)

    def impossible_key(self, codes: int, repetitions: int) -> tuple[str, str] | None:
        """Return the key that makes every order impossible and a phrase with possible values, or None."""
        if repetitions == 1:
            return None
        if self.min_distance is not None and self.min_distance > codes:
            permitted = f"it must be at most {codes} with {counted(codes, 'condition')}"
            return "min_distance", f"is {self.min_distance}, but {permitted}"
        if self.max_repeats is not None and codes == 1 and self.max_repeats < repetitions:
            permitted = f"it must be at least {repetitions} if the only condition is presented {repetitions} times"
            return "max_repeats", f"is {self.max_repeats}, but {permitted}"
        return None


def longest_run(order: Sequence[object]) -> int:
    """Return the length of the longest run of equal codes."""
    longest = run = 0
    for index, code in enumerate(order):
        run = run + 1 if index and code == order[index - 1] else 1
        longest = max(longest, run)
    return longest


def shortest_distance(order: Sequence[object]) -> int | None:
    """Return the shortest distance between two equal codes [trials]; None if all differ."""
    latest: dict[object, int] = {}
    distances = []
    for index, code in enumerate(order):
        if code in latest:
            distances.append(index - latest[code])
        latest[code] = index
    return min(distances, default=None)


Square: TypeAlias = Literal["williams", "latin"]


def row_count(square: Square, codes: int) -> int:
    """Return the number of rows of a square, which is the number of participants in a complete round."""
    return 2 * codes if square == "williams" and codes % 2 and codes > 1 else codes


def row(square: Square, codes: int, number: int, repetitions: int = 1) -> tuple[int, ...]:
    """Return row ``number`` (from 0): codes as numbers from 0, each once per repetition."""
    if codes == 1:
        return (0,) * repetitions
    reversed_square, shift = divmod(number, codes)
    base = tuple(range(codes))
    if square == "williams":  # 0, 1, n − 1, 2, n − 2, …: the n − 1 differences between neighbours are all different
        base = tuple((step + 1) // 2 if step % 2 else -(step // 2) % codes for step in base)
    if reversed_square:
        base = base[::-1]
    codes_shown = tuple((code + shift) % codes for code in base)
    for border in range(repetitions - 1):
        distance = 1 + border % (codes - 1)
        first = codes_shown[-1] + (-distance if reversed_square else distance)
        codes_shown += tuple((code - base[0] + first) % codes for code in base)
    return codes_shown


def has_even_borders(codes: int, repetitions: int) -> bool:
    """Return whether a Williams design's carry-over is balanced across the borders of its repetitions, too."""
    period = (codes - 1) // 2 if codes % 2 else codes - 1
    return codes == 1 or (repetitions - 1) % period == 0


def enrolment_number(participant: str) -> int | None:
    """Return the last number in a participant's id; None if there is none."""
    numbers = re.findall(r"[0-9]+", participant)
    return int(numbers[-1]) if numbers else None


def assigned_row(study: str, block: str, rows: int, participant: str, place: int | None = None) -> int:
    """Return the row (from 0) of a participant in a block of a study.

    ``place`` is the number that assigns the row (from 1); None: the number in the participant's ID.
    """
    number = enrolment_number(participant) if place is None else place
    if number is None:
        return int(study_stream(study, f"row/{block}/{participant}").random() * rows)
    rounds, place = divmod(number - 1, rows)
    return shuffle(range(rows), study_stream(study, f"rows/{block}/{rounds}").random)[place]


_T = TypeVar("_T")

_Proposal: TypeAlias = tuple[tuple[int, ...], Fraction]

PROPOSALS = 32
_STEEPEST = 6


def draw_order(codes: Sequence[_T], repetitions: int, constraint: Constraint, draw: Draw) -> tuple[_T, ...]:
    """Return every code ``repetitions`` times in a random order that satisfies a constraint.

    ``draw`` returns uniform numbers in [0, 1); at most (len(codes) · repetitions + 1) · ``PROPOSALS`` + len(codes) of
    them are drawn. Raises ValueError if no order satisfies the constraint.
    """
    if (impossible := constraint.impossible_key(len(codes), repetitions)) is not None:
        raise ValueError(" ".join(impossible))
    chosen, weight = shuffle(range(len(codes)), draw) * repetitions, Fraction(0)
    for _ in range(PROPOSALS):
        proposal = propose_order(len(codes), repetitions, constraint, draw)
        if proposal is not None and Fraction(draw()) * weight < proposal[1]:
            chosen, weight = proposal
    return tuple(codes[code] for code in chosen)


def propose_order(codes: int, repetitions: int, constraint: Constraint, draw: Draw) -> _Proposal | None:
    """Draw an order from left to right; return it with its inverse probability, or None in a dead end."""
    apart = max(constraint.min_distance or 1, 2 if constraint.max_repeats == 1 else 1)
    remaining = _Remaining(codes, repetitions, apart, constraint.max_repeats or codes * repetitions)
    steepness = _steepness(codes, repetitions, apart)
    masses = chosen_weights = 1
    for _ in range(codes * repetitions):
        weights = [(code, remaining.count[code] ** steepness) for code in remaining.possible_codes()]
        mass = sum(weight for _, weight in weights)
        if not mass:
            return None
        place = int(draw() * mass)
        for code, weight in weights:
            place -= weight
            if place < 0:
                remaining.use_code(code)
                chosen_weights *= weight
                break
        masses *= mass
    return tuple(remaining.taken), Fraction(masses, chosen_weights)


def _steepness(codes: int, repetitions: int, apart: int) -> int:
    """Return the exponent of the weights of remaining codes; any is correct, but a good one needs fewer proposals.

    The closer the distance is to the number of codes, the less the counts of codes can differ. In the long run, the
    ratio of the variances of a code's gaps without and with the constraint is n (n − 1) / ((n − d) (n − d + 1)). The
    mean of this ratio and 1 works best in blocks of usual length **[measured]**.
    """
    room = (codes - apart) * (codes - apart + 1)
    if room <= 0:
        return 1
    return min((2 * room + codes * (codes - 1)) // (2 * room), 1 + repetitions // 2, _STEEPEST)


class _Remaining:
    """The remaining codes: equal ones are at least ``apart`` trials apart, and at most ``run`` in a row."""

    def __init__(self, codes: int, repetitions: int, apart: int, run: int) -> None:
        self.count = [repetitions] * codes
        self.taken: list[int] = []
        self._total = codes * repetitions
        self._apart = apart
        self._run = run
        self._in_a_row = 0
        # Σ min(left, k) − k · apart for k = 0, 1, …: how many further codes fit into the last k · apart trials
        self._slack = [k * (codes - apart) for k in range(repetitions + 1)]

    def possible_codes(self) -> list[int]:
        """Return the codes that can come next without a dead end."""
        if self._apart > 1:
            recent = self.taken[-(self._apart - 1) :]
            # from the largest k whose last k · apart trials need all codes of which at most k are left
            largest_k = min(len(self._slack) - 1, (self._total - 1) // self._apart)
            least_left = next((k for k in range(largest_k, 0, -1) if self._slack[k] <= 0), 0) + 1
            return [code for code, left in enumerate(self.count) if left >= least_left and code not in recent]
        exhausted = self.taken[-1:] if self._in_a_row >= self._run else []
        urgent = [code for code, left in enumerate(self.count) if left > self._run * (self._total - left)]
        return [code for code in urgent or range(len(self.count)) if self.count[code] and code not in exhausted]

    def use_code(self, code: int) -> None:
        """Use a code as the next one."""
        self._in_a_row = self._in_a_row + 1 if self.taken[-1:] == [code] else 1
        for k in range(self.count[code], len(self._slack)):
            self._slack[k] -= 1
        self.count[code] -= 1
        self.taken.append(code)
        self._total -= 1

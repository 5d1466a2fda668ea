"""The balance of the orders of many participants, computed before recruitment: positions and first-order carry-over.

``liquid-study design`` prints it.

Codes are counted, not conditions: the condition of a code is drawn once per study, which does not affect the balance.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count, pairwise
from typing import TypeAlias

from study_app.errors import StudyError
from study_app.number_text import counted
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import CodeOrder, Orders, orders_of
from study_app.protocol.orders.durations import variants
from study_app.protocol.orders.schedule import blocks_in_order, codes_of
from study_app.protocol.participants.groups import next_group
from study_app.protocol.randomization.sequences import (
    enrolment_number,
    has_even_borders,
    longest_run,
    row_count,
    shortest_distance,
)
from study_app.protocol.randomization.streams import draw_secret, group_of, stream

_Table: TypeAlias = tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Evenness:
    """Counts over the orders of one set of codes.

    ``positions`` has the number of times that each code (column) is at each position (row), ``follows`` the number of
    times that it directly follows each code (row), regardless of breaks and repetitions. ``shortest_distance`` is None
    if each code occurs only once.
    """

    codes: tuple[str, ...]
    orders: int
    positions: _Table
    follows: _Table
    longest_run: int
    shortest_distance: int | None

    @property
    def positions_even(self) -> bool:
        """Whether each code has each position equally often."""
        return len({count for line in self.positions for count in line}) <= 1

    @property
    def after_another(self) -> tuple[int, ...]:
        """The number of times that each code follows every other code."""
        return tuple(
            count for row, counts in enumerate(self.follows) for column, count in enumerate(counts) if row != column
        )

    @property
    def follows_even(self) -> bool:
        """Whether each code follows every other code equally often."""
        return len({*self.after_another}) <= 1

    @property
    def balanced(self) -> bool:
        """Whether positions and carry-over are both even."""
        return self.positions_even and self.follows_even


@dataclass(frozen=True, slots=True)
class BlockBalance:
    """A block's evenness and order settings; ``unnumbered`` are the participants whose ID has no number."""

    id: str
    title: str
    order: CodeOrder
    repetitions: int
    evenness: Evenness
    unnumbered: tuple[str, ...]

    @property
    def rows(self) -> int | None:
        """The number of participants in a full round of its square; None without a square."""
        return row_count(self.order, len(self.evenness.codes)) if self.order in ("williams", "latin") else None


@dataclass(frozen=True, slots=True)
class Balance:
    """The balance of blocks with more than one code in session order; ``session`` names the session if they differ."""

    study: str
    session: str
    participants: int
    seed: int
    blocks: tuple[BlockBalance, ...]


def numbered_participants(count: int, first: str = "P001") -> tuple[str, ...]:
    """Return ``count`` consecutive participant IDs from ``first``; StudyError if it does not end in a number."""
    match = re.fullmatch(r"([A-Za-z0-9]*?)([0-9]+)", first)
    if match is None:
        raise StudyError(
            f"{first!r} cannot be the first participant: specify an ID of letters and digits that ends in a number, "
            "such as P061"
        )
    return tuple(f"{match[1]}{int(match[2]) + offset:0{len(match[2])}d}" for offset in range(count))


def evenness(codes: Sequence[str], orders: Iterable[Sequence[str]]) -> Evenness:
    """Return the counts of positions and successions in ``orders`` of ``codes``, all of the same length."""
    index_of = {code: index for index, code in enumerate(codes)}
    sequences = [[index_of[code] for code in order] for order in orders]
    positions = [[0] * len(index_of) for _ in range(max(map(len, sequences), default=0))]
    follows = [[0] * len(index_of) for _ in index_of]
    for order in sequences:
        for position, code in enumerate(order):
            positions[position][code] += 1
        for first, then in pairwise(order):
            follows[first][then] += 1
    return Evenness(
        codes=tuple(codes),
        orders=len(sequences),
        positions=tuple(map(tuple, positions)),
        follows=tuple(map(tuple, follows)),
        longest_run=max(map(longest_run, sequences), default=0),
        shortest_distance=min(
            (distance for distance in map(shortest_distance, sequences) if distance is not None), default=None
        ),
    )


def balance(
    protocol: Protocol, participants: Sequence[str], seed: int, session: str = "", *, in_group: bool = False
) -> Balance:
    """Return how balanced the orders of ``participants`` (IDs) are for ``seed``.

    In a real study each session has its own seed; orders from a square do not depend on the seed. With ``in_group`` the
    participants are those of one group, and their numbers within the group assign the rows of squares.

    Raises StudyError without participants.
    """
    if not participants:
        raise StudyError("a design needs at least one participant")
    orders = orders_of(protocol)
    numbers = [
        number if in_group else enrolment_number(participant)
        for number, participant in enumerate(participants, start=1)
    ]
    unnumbered = tuple(participant for participant, number in zip(participants, numbers, strict=True) if number is None)
    numbered = [*zip(participants, numbers, strict=True)]
    blocks = []
    for block in orders.blocks:
        if len(block.codes) > 1:
            title = protocol.text(protocol.blocks[block.id].title, protocol.study.languages[0])
            code_orders = [codes_of(orders.study, block, participant, seed, number) for participant, number in numbered]
            block_evenness = evenness(block.codes, code_orders)
            blocks.append(BlockBalance(block.id, title, block.order, block.repetitions, block_evenness, unnumbered))
    if orders.block_order != "fixed" and sum(block.phase == "main" for block in orders.blocks) > 1:
        order: CodeOrder = "williams" if orders.block_order == "balanced" else "shuffled"
        evenness_of_blocks = _block_evenness(orders, numbered, seed)
        blocks.append(BlockBalance("", "The main blocks", order, 1, evenness_of_blocks, unnumbered))
    return Balance(orders.study, session, len(participants), seed, tuple(blocks))


def balances(protocol: Protocol, participants: Sequence[str], seed: int) -> Iterator[Balance]:
    """Yield the balance of each kind of session over the participants of its group (StudyError without any).

    Participants are assigned to groups as in a rehearsal with this seed; empty groups are omitted.
    """
    members: dict[str | None, list[str]] = {group: [] for group in protocol.groups or (None,)}
    secret = draw_secret(stream(seed, "blinding").random)
    for entry, participant in enumerate(participants, start=1):
        group = None
        if protocol.randomises:
            group = group_of(protocol.shares, secret, entry)
        elif protocol.groups:
            group = next_group(protocol.shares, {name: len(members[name]) for name in protocol.groups})
        members[group].append(participant)
    for variant in variants(protocol):
        if members[variant.group] or variant.group is None:
            yield balance(
                variant.protocol, members[variant.group], seed, variant.name, in_group=variant.group is not None
            )


def block_balance(protocol: Protocol, block_id: str, count: int) -> BlockBalance | None:
    """Return the balance of a block for ``count`` participants of a rehearsal; None if it has only one code."""
    session_balances = balances(protocol, numbered_participants(count), 1)
    return next((block for session in session_balances for block in session.blocks if block.id == block_id), None)


def planned_participants(protocol: Protocol, group: str | None) -> int | None:
    """Return the planned participants of a group (None: of the study), rounded down; None if undecided."""
    planned = None if protocol.analysis is None else protocol.analysis.participants
    if planned is None or group is None:
        return planned
    return planned * protocol.shares[group] // sum(protocol.shares.values())


def block_orders_by_group(protocol: Protocol) -> dict[str, str]:
    """Return the order of the main blocks by group; a single entry "" if groups do not differ or do not exist."""
    orders_by_group = {
        variant.group or "": block_order_text(
            variant.protocol, planned_participants(protocol, variant.group), in_group=variant.group is not None
        )
        for variant in variants(protocol)
        if len(variant.protocol.main_blocks) > 1
    }
    return {"": next(iter(orders_by_group.values()))} if len({*orders_by_group.values()}) == 1 else orders_by_group


def block_order_text(protocol: Protocol, planned: int | None, *, in_group: bool = False) -> str:
    """Return the order of a session's main blocks and its balance for ``planned`` participants, as text.

    ``protocol`` is that of the session; with ``in_group`` the planned participants are those of one group.
    """
    orders = orders_of(protocol)
    blocks = sum(block.phase == "main" for block in orders.blocks)
    if orders.block_order == "fixed":
        return "fixed: the same order for all participants"
    if orders.block_order == "random":
        per_group = (
            ""
            if planned is None
            else f" (each block in each position for {planned / blocks:.3g} of {planned} participants)"
        )
        return f"random: a new order is drawn for each session, so the order is balanced only on average{per_group}"
    order_evenness = _block_evenness(orders, [("", place) for place in range(1, planned + 1)], 1) if planned else None
    rows = row_count("williams", blocks)
    assigned_by, per_group = (
        ("position in the group", " per group") if in_group else ("number in the participant's ID", "")
    )
    text = f"balanced: {rows} orders, assigned by the {assigned_by}"
    if planned is None or order_evenness is None:
        return f"{text}; balanced for any multiple of {rows} participants{per_group}"
    counts = [count for line in order_evenness.positions for count in line]
    frequency = _times_text(counts[0]) if order_evenness.positions_even else _range_text(counts)
    balanced = planned + -planned % rows
    advice = "" if order_evenness.balanced else f"; the order would be balanced with {balanced} participants{per_group}"
    return f"{text}; with {planned} participants{per_group}, each block occurs in each position {frequency}{advice}"


def _block_evenness(orders: Orders, numbered: Iterable[tuple[str, int | None]], seed: int) -> Evenness:
    """Return the evenness of the main blocks' orders.

    ``numbered`` are participant IDs, each with the number that assigns its row.
    """
    names = [block.id for block in orders.blocks if block.phase == "main"]
    block_orders = (blocks_in_order(orders, participant, seed, row_number) for participant, row_number in numbered)
    return evenness(names, ([names[number] for number in order] for order in block_orders))


def describe_balance(result: Balance) -> str:
    """Return the tables of every block, with their interpretation, as text."""
    people = "1 participant" if result.participants == 1 else f"{result.participants} participants"
    session = f", {result.session}" if result.session else ""
    head = f"{result.study}{session}: orders for {people}, each with seed {result.seed}"
    if not result.blocks:
        return f"{head}\n\nAll blocks have only one code, so there is nothing to balance."
    return "\n\n".join((head, *("\n".join(_block_lines(block)) for block in result.blocks)))


def _block_lines(block: BlockBalance) -> Iterator[str]:
    counts = block.evenness
    times = "" if block.repetitions == 1 else f", each {block.repetitions} times"
    if block.id:
        yield f"{block.title} (block {block.id}): {len(counts.codes)} codes{times}, order {block.order}"
    else:
        yield f"{block.title}: {'balanced' if block.order == 'williams' else 'random'}"
    yield ""
    yield from _count_lines("position", range(1, len(counts.positions) + 1), counts.codes, counts.positions)
    yield ""
    yield from _count_lines("after", counts.codes, counts.codes, counts.follows)
    yield ""
    yield from (f"  {sentence}" for sentence in (*_verdict_lines(counts), *_advice(block)))


def _count_lines(corner: str, names: Sequence[object], codes: Sequence[str], counts: _Table) -> Iterator[str]:
    """Yield a table of counts with a row for each name and a column for each code."""
    width = max(len(str(cell)) for cell in (*codes, *(count for line in counts for count in line)))
    first = len("position")
    yield f"  {corner:<{first}}  {'  '.join(f'{code:>{width}}' for code in codes)}"
    for name, line in zip(names, counts, strict=True):
        yield f"  {name!s:<{first}}  {'  '.join(f'{count:>{width}}' for count in line)}"


def _verdict_lines(counts: Evenness) -> Iterator[str]:
    cells = [count for line in counts.positions for count in line]
    if counts.positions_even:
        yield f"Positions are balanced: each code occurs in each position {_times_text(cells[0])}."
    else:
        yield f"Positions are not balanced: each code occurs in each position {_range_text(cells)}."
    carry_over = counts.after_another
    if counts.follows_even:
        yield f"Carry-over is balanced: each code follows every other code {_times_text(carry_over[0])}."
    else:
        yield f"Carry-over is not balanced: each code follows every other code {_range_text(carry_over)}."
    if counts.shortest_distance is not None:
        shortest = f"the minimum distance between repeats is {counts.shortest_distance}"
        yield f"The longest run of one condition is {counted(counts.longest_run, 'presentation')}; {shortest}."


def _advice(block: BlockBalance) -> Iterator[str]:
    """Yield the properties of the order, and possible improvements."""
    codes, repetitions = len(block.evenness.codes), block.repetitions
    match block.order:
        case "fixed":
            yield "All participants have the same order, so the effects of condition and position cannot be separated."
        case "shuffled" | "constrained":
            yield (
                "A new order is drawn for each session, so the orders are balanced only on average. Each seed produces "
                "different tables."
            )
            if repetitions == 1:
                rows = row_count("williams", codes)
                yield f'order = "williams" would be exactly balanced with any multiple of {rows} participants.'
        case "williams" | "latin" as square:
            yield from _round_lines(block, row_count(square, codes))
            if square == "williams" and not has_even_borders(codes, repetitions):
                enough = next(number for number in count(repetitions) if has_even_borders(codes, number))
                yield (
                    f"Carry-over cannot be balanced with this number of repetitions, but it can be with {enough} "
                    "repetitions."
                )
            if square == "latin" and codes > 2:
                yield 'A Latin square balances only positions; order = "williams" also balances carry-over.'


def _round_lines(block: BlockBalance, rows: int) -> Iterator[str]:
    """Yield whether the participants complete rounds of rows, and the number that would."""
    codes, people = len(block.evenness.codes), block.evenness.orders
    if block.unnumbered:
        yield (
            f"These IDs do not contain a number: {', '.join(block.unnumbered)}. Their rows are drawn at random, so "
            "the orders are balanced only on average."
        )
    elif people % rows == 0 and block.evenness.positions_even:
        rounds = people // rows
        yield (
            f"{people} participants fill {'one full round' if rounds == 1 else f'{rounds} full rounds'} of the {rows} "
            "rows of orders."
        )
    elif people % rows == 0:
        yield (
            f"A full round consists of the numbers 1 to {rows}, {rows + 1} to {2 * rows} and so on, but some of "
            "these numbers are missing from the IDs."
        )
    else:
        enough = people + -people % rows
        result = f"each code would occur in each position {_times_text(enough // codes)}"
        if block.order == "williams" and has_even_borders(codes, block.repetitions):
            follows = enough * (codes * block.repetitions - 1) // (codes * (codes - 1))
            result += f" and follow every other code {_times_text(follows)}"
        yield f"A full round consists of {rows} participants. With {enough} participants, {result}."


def _times_text(number: int) -> str:
    return {1: "once", 2: "twice"}.get(number, f"{number} times")


def _range_text(counts: Sequence[int]) -> str:
    return f"{min(counts)} to {max(counts)} times, {sum(counts) / len(counts):.3g} on average"

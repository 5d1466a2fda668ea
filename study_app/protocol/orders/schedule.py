"""What comes when: protocol, participant and seed give the session's steps, the same on every machine.

Orders are orders of codes; what a code stands for is drawn once per study by :func:`draw_key` and sealed. So a schedule
gives nothing away.

==============  ========================================================================================================
order           the codes of a block
==============  ========================================================================================================
fixed           as written, again in each repetition
shuffled        in a random order, another in each repetition; from stream "order/PARTICIPANT/BLOCK/REPETITION"
constrained     all trials in one random order within max_repeats and min_distance (see `sequences`); from stream
                "order/PARTICIPANT/BLOCK"
interleaved     of a block with a design: every round presents each track once, in a random order of its own, from
                stream "order/PARTICIPANT/BLOCK/ROUND"
blocked         of a block with a design: one track after another, in random order, from stream
                "order/PARTICIPANT/BLOCK"
williams latin  a row of a square, assigned by the number in the participant's id or the place in the group, not by the
                seed (`sequences`)
==============  ========================================================================================================

Main blocks take each other's places in a row of a square if their order is balanced, and in an order from stream
"blocks/PARTICIPANT" if it is random.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

from study_app.protocol.blocks import Phase
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import BlockOrder, FormOrder, Orders, block_codes, orders_of
from study_app.protocol.orders.tracks import tracks_of
from study_app.protocol.randomization.sequences import Constraint, assigned_row, draw_order, row, row_count
from study_app.protocol.randomization.streams import Draw, shuffle, stream

__all__ = [
    "FormStep",
    "PageStep",
    "Schedule",
    "Trial",
    "block_codes",
    "build_schedule",
    "codes_of",
    "draw_key",
    "shuffle",
    "stream",
]

_Key: TypeAlias = dict[str, dict[str, str]]


@dataclass(frozen=True, slots=True)
class PageStep:
    """A page to read."""

    page_id: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One presentation and its answers.

    ``number`` counts from 1 over the session, ``index`` from 1 within the block of ``of`` trials; ``items`` are item
    ids in the order shown.
    """

    number: int
    block: str
    phase: Phase
    part: int | None
    index: int
    of: int
    code: str
    items: tuple[str, ...]

    def label(self, protocol: Protocol, language: str) -> str:
        """Return the neutral name of the trial: "Liquid setting 1", or only "Practice" in a block with one trial."""
        name = protocol.text(protocol.blocks[self.block].setting_label, language)
        return name if self.phase != "main" and self.of == 1 else f"{name} {self.index}"


@dataclass(frozen=True, slots=True)
class FormStep:
    """A questionnaire outside blocks; ``items`` are item ids in the order shown.

    ``after`` is the preceding block, None before the first; ``time`` counts its occurrences in the session from 1.
    """

    form: str
    items: tuple[str, ...]
    after: str | None = None
    time: int = 1


Step: TypeAlias = PageStep | FormStep | Trial


@dataclass(frozen=True)
class Schedule:
    """The steps of one participant's session, in order."""

    participant: str
    seed: int
    steps: tuple[Step, ...]

    @cached_property  # each trial of a track needs them
    def trials(self) -> tuple[Trial, ...]:
        """The trials alone, in order."""
        return tuple(step for step in self.steps if isinstance(step, Trial))


def build_schedule(protocol: Protocol | Orders, participant: str, seed: int, place: int | None = None) -> Schedule:
    """Return the session of ``participant``: a pure function of its arguments.

    ``place`` is the number that assigns rows of squares (from 1); None: the number in the participant's id.
    """
    orders = orders_of(protocol) if isinstance(protocol, Protocol) else protocol
    steps: list[Step] = []
    number, after, times = 1, None, Counter[str]()
    for step in _steps_in_order(orders, participant, seed, place):
        if isinstance(step, str):
            steps.append(PageStep(step))
            continue
        if isinstance(step, FormOrder):
            times[step.id] += 1
            again = "" if times[step.id] == 1 else f"/{times[step.id]}"
            items = _shuffle_questions(step, seed, f"{participant}/form/{step.id}{again}")
            steps.append(FormStep(step.id, items, after, times[step.id]))
            continue
        after = step.id
        codes = codes_of(orders.study, step, participant, seed, place)
        for index, code in enumerate(codes, start=1):
            items = _shuffle_questions(step, seed, f"{participant}/{step.id}/{index}")
            steps.append(
                Trial(
                    number=number,
                    block=step.id,
                    phase=step.phase,
                    part=step.part,
                    index=index,
                    of=step.trials,
                    code=code,
                    items=items,
                )
            )
            number += 1
            if step.break_page and step.break_every and index < step.trials and index % step.break_every == 0:
                steps.append(PageStep(step.break_page))
    return Schedule(participant, seed, tuple(steps))


def _steps_in_order(
    orders: Orders, participant: str, seed: int, place: int | None
) -> tuple[str | BlockOrder | FormOrder, ...]:
    """Return the steps with the main blocks in the participant's order; part numbers stay at their positions."""
    places = [at for at, step in enumerate(orders.steps) if isinstance(step, BlockOrder) and step.phase == "main"]
    steps = list(orders.steps)
    for at, number in zip(places, blocks_in_order(orders, participant, seed, place), strict=True):
        target, block = orders.steps[at], orders.steps[places[number]]
        if isinstance(target, BlockOrder) and isinstance(block, BlockOrder):
            steps[at] = replace(block, part=target.part)
    return tuple(steps)


def blocks_in_order(orders: Orders, participant: str, seed: int, place: int | None = None) -> tuple[int, ...]:
    """Return the numbers (from 0, in file order) of a session's main blocks in the order of ``participant``."""
    count = sum(block.phase == "main" for block in orders.blocks)
    if orders.block_order == "random":
        return shuffle(range(count), stream(seed, f"blocks/{participant}").random)
    if orders.block_order == "fixed" or count < 2:
        return tuple(range(count))
    taken = assigned_row(orders.study, "block order", row_count("williams", count), participant, place)
    return row("williams", count, taken)


def codes_of(study: str, block: BlockOrder, participant: str, seed: int, place: int | None = None) -> tuple[str, ...]:
    """Return the codes of a block's trials in the order of ``participant``."""
    codes, times = block.codes, block.repetitions
    match block.order:
        case "fixed":
            return codes * times
        case "shuffled":
            streams = [stream(seed, f"order/{participant}/{block.id}/{number}") for number in range(1, times + 1)]
            return tuple(code for drawn in streams for code in shuffle(codes, drawn.random))
        case "constrained":
            constraint = Constraint(block.max_repeats, block.min_distance)
            return draw_order(codes, times, constraint, stream(seed, f"order/{participant}/{block.id}").random)
        case "interleaved":
            rounds = range(1, max(block.slots) + 1)
            left = [tuple(code for code, slots in zip(codes, block.slots, strict=True) if slots >= n) for n in rounds]
            drawn = [stream(seed, f"order/{participant}/{block.id}/{number}").random for number in rounds]
            return tuple(code for some, draw in zip(left, drawn, strict=True) for code in shuffle(some, draw))
        case "blocked":
            tracks = shuffle(
                zip(codes, block.slots, strict=True), stream(seed, f"order/{participant}/{block.id}").random
            )
            return tuple(code for code, slots in tracks for _ in range(slots))
        case "williams" | "latin" as square:
            taken = assigned_row(study, block.id, row_count(square, len(codes)), participant, place)
            return tuple(codes[number] for number in row(square, len(codes), taken, times))


def _shuffle_questions(step: BlockOrder | FormOrder, seed: int, name: str) -> tuple[str, ...]:
    """Return the ids of the questions in the order of presentation."""
    return step.items if step.item_order == "fixed" else shuffle(step.items, stream(seed, f"items/{name}").random)


def draw_key(protocol: Protocol, draw: Draw) -> _Key:
    """Return block → code → condition or track, drawn with ``draw`` (uniform numbers in [0, 1)).

    A block in fixed order keeps it as the protocol requires, so that its codes follow the written order of its
    conditions and readers of the protocol can identify them.
    """
    key: _Key = {}
    for block in protocol.blocks_in_order:
        if block.design is not None:
            presented = shuffle((track.name for track in tracks_of(protocol, block)), draw)
        else:
            presented = block.conditions if block.order == "fixed" else shuffle(block.conditions, draw)
        key[block.id] = dict(zip(block_codes(protocol, block), presented, strict=True))
    return key


_TOLD = ("block", "phase", "part", "index", "of", "code")


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedTrial:
    """One recorded attempt at a trial; ``items`` in the order shown, None if nothing was answered.

    ``may_hide`` tells whether answers may have hidden some of the items, which are then not recorded.
    """

    number: int
    block: str
    phase: str
    part: int | None
    index: int
    of: int
    code: str
    items: tuple[str, ...] | None = None
    may_hide: bool = False


def reproduce(
    protocol: Protocol,
    seed: int,
    participant: str,
    recorded: Iterable[RecordedTrial | int],
    *,
    complete: bool,
    place: int | None = None,
) -> tuple[str, ...]:
    """Return the differences between the recorded trials and those that follow from protocol, seed and participant.

    ``protocol`` is that of the session; ``recorded`` are the attempts in chronological order. A ``complete`` session
    was run to its end, so no trial may be missing. ``place`` is that of `build_schedule`.
    """
    planned = {trial.number: trial for trial in build_schedule(protocol, participant, seed, place).trials}
    attempts = tuple(recorded)
    run = [trial for trial in attempts if isinstance(trial, RecordedTrial)]
    differences = [sentence for trial in run for sentence in _trial_differences(planned.get(trial.number), trial)]
    numbers = [trial if isinstance(trial, int) else trial.number for trial in attempts]
    differences += _progress_differences(numbers, planned, complete=complete, blocks=protocol.study.resume == "block")
    return tuple(dict.fromkeys(differences))


def _trial_differences(planned: Trial | None, run: RecordedTrial) -> Iterator[str]:
    """Yield the differences between a recorded trial and the planned one with its number."""
    if planned is None:
        yield f"trial {run.number} was recorded, but the seed does not produce this trial"
        return
    for name in _TOLD:
        ours, theirs = getattr(planned, name), getattr(run, name)
        if ours != theirs:
            said, given = ("none" if value is None else value for value in (theirs, ours))
            yield f"trial {run.number}: the recorded {name} is {said}, but the seed gives {given}"
    if run.items is None:
        return
    expected = tuple(item for item in planned.items if item in run.items) if run.may_hide else planned.items
    if run.items != expected:
        said, given = (", ".join(items) or "none" for items in (run.items, planned.items))
        yield f"trial {run.number}: the recorded items are {said}, but the seed gives {given}"


def _progress_differences(
    numbers: list[int], planned: dict[int, Trial], *, complete: bool, blocks: bool
) -> Iterator[str]:
    """Yield errors in the order of trials and attempts.

    With ``blocks`` a resumed session repeats the interrupted block from its first trial.
    """
    before = 0
    first = {trial.block: number for number, trial in reversed(planned.items())}
    for number in numbers:
        due = {before, before + 1}
        again = {first[planned[number].block] for number in due & planned.keys()} if blocks else set()
        if number not in due | again:
            after = f"after trial {before}" if before else "first"
            yield f"trial {number} was presented {after}, but trial {before + 1} was due"
        before = number
    last = len(planned)
    if complete and before < last:
        missing = f"trial {last} was" if before + 1 == last else f"trials {before + 1} to {last} were"
        yield f"{missing} not recorded, although the session is complete"

"""The schedule: protocol, participant and seed determine the steps of a session, which are the same on every machine.

Orders are orders of codes; what a code stands for is drawn once per study by :func:`draw_key` and sealed. So a schedule
does not reveal conditions.

==============  ========================================================================================================
order           the codes of a block
==============  ========================================================================================================
fixed           as written, repeated in each repetition
shuffled        in a new random order in each repetition; from stream "order/PARTICIPANT/BLOCK/REPETITION"
constrained     all trials in one random order within max_repeats and min_distance (see `sequences`); from stream
                "order/PARTICIPANT/BLOCK"
interleaved     in a block with a design: every round presents each track once, in a new random order; from stream
                "order/PARTICIPANT/BLOCK/ROUND"
blocked         in a block with a design: one track after another, in random order; from stream
                "order/PARTICIPANT/BLOCK"
williams latin  a row of a square, assigned by the number in the participant's ID or by the position in the group, not
                by the seed (`sequences`)
==============  ========================================================================================================

Main blocks are permuted by a row of a square if their order is balanced, and by stream "blocks/PARTICIPANT" if it is
random.
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

    @cached_property  # used for each trial of a track
    def trials(self) -> tuple[Trial, ...]:
        """The trials in order."""
        return tuple(step for step in self.steps if isinstance(step, Trial))


def build_schedule(protocol: Protocol | Orders, participant: str, seed: int, place: int | None = None) -> Schedule:
    """Return the schedule of ``participant``; it depends only on the arguments.

    ``place`` is the number that assigns rows of squares (from 1); None for the number in the participant's ID.
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
            suffix = "" if times[step.id] == 1 else f"/{times[step.id]}"
            items = _shuffle_questions(step, seed, f"{participant}/form/{step.id}{suffix}")
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
    """Return the steps with the main blocks in the participant's order; part numbers keep their positions."""
    positions = [
        position for position, step in enumerate(orders.steps) if isinstance(step, BlockOrder) and step.phase == "main"
    ]
    steps = list(orders.steps)
    for position, number in zip(positions, blocks_in_order(orders, participant, seed, place), strict=True):
        target, block = orders.steps[position], orders.steps[positions[number]]
        if isinstance(target, BlockOrder) and isinstance(block, BlockOrder):
            steps[position] = replace(block, part=target.part)
    return tuple(steps)


def blocks_in_order(orders: Orders, participant: str, seed: int, place: int | None = None) -> tuple[int, ...]:
    """Return the numbers (from 0, in file order) of a session's main blocks in the order of ``participant``."""
    count = sum(block.phase == "main" for block in orders.blocks)
    if orders.block_order == "random":
        return shuffle(range(count), stream(seed, f"blocks/{participant}").random)
    if orders.block_order == "fixed" or count < 2:
        return tuple(range(count))
    row_number = assigned_row(orders.study, "block order", row_count("williams", count), participant, place)
    return row("williams", count, row_number)


def codes_of(study: str, block: BlockOrder, participant: str, seed: int, place: int | None = None) -> tuple[str, ...]:
    """Return the codes of a block's trials in the order of ``participant``."""
    codes, repetitions = block.codes, block.repetitions
    match block.order:
        case "fixed":
            return codes * repetitions
        case "shuffled":
            streams = [stream(seed, f"order/{participant}/{block.id}/{number}") for number in range(1, repetitions + 1)]
            return tuple(code for draws in streams for code in shuffle(codes, draws.random))
        case "constrained":
            constraint = Constraint(block.max_repeats, block.min_distance)
            return draw_order(codes, repetitions, constraint, stream(seed, f"order/{participant}/{block.id}").random)
        case "interleaved":
            rounds = range(1, max(block.slots) + 1)
            codes_by_round = [
                tuple(code for code, slots in zip(codes, block.slots, strict=True) if slots >= n) for n in rounds
            ]
            draws = [stream(seed, f"order/{participant}/{block.id}/{number}").random for number in rounds]
            return tuple(
                code
                for round_codes, draw in zip(codes_by_round, draws, strict=True)
                for code in shuffle(round_codes, draw)
            )
        case "blocked":
            tracks = shuffle(
                zip(codes, block.slots, strict=True), stream(seed, f"order/{participant}/{block.id}").random
            )
            return tuple(code for code, slots in tracks for _ in range(slots))
        case "williams" | "latin" as square:
            row_number = assigned_row(study, block.id, row_count(square, len(codes)), participant, place)
            return tuple(codes[number] for number in row(square, len(codes), row_number, repetitions))


def _shuffle_questions(step: BlockOrder | FormOrder, seed: int, name: str) -> tuple[str, ...]:
    """Return the IDs of the questions in the order of presentation."""
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


_COMPARED_FIELDS = ("block", "phase", "part", "index", "of", "code")


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedTrial:
    """One recorded attempt at a trial; ``items`` are in the order shown, None if nothing was answered.

    ``may_hide`` means that some items may have been hidden because of other answers, and are then not recorded.
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
    recorded_trials = [trial for trial in attempts if isinstance(trial, RecordedTrial)]
    differences = [
        sentence for trial in recorded_trials for sentence in _trial_differences(planned.get(trial.number), trial)
    ]
    numbers = [trial if isinstance(trial, int) else trial.number for trial in attempts]
    differences += _progress_differences(numbers, planned, complete=complete, blocks=protocol.study.resume == "block")
    return tuple(dict.fromkeys(differences))


def _trial_differences(planned: Trial | None, recorded: RecordedTrial) -> Iterator[str]:
    """Yield the differences between a recorded trial and the planned one with its number."""
    if planned is None:
        yield f"trial {recorded.number} was recorded, but the seed does not produce this trial"
        return
    for name in _COMPARED_FIELDS:
        expected_value, recorded_value = getattr(planned, name), getattr(recorded, name)
        if expected_value != recorded_value:
            recorded_text, expected_text = (
                "none" if value is None else value for value in (recorded_value, expected_value)
            )
            yield f"trial {recorded.number}: the recorded {name} is {recorded_text}, but the seed gives {expected_text}"
    if recorded.items is None:
        return
    expected = tuple(item for item in planned.items if item in recorded.items) if recorded.may_hide else planned.items
    if recorded.items != expected:
        recorded_text, expected_text = (", ".join(items) or "none" for items in (recorded.items, planned.items))
        yield f"trial {recorded.number}: the recorded items are {recorded_text}, but the seed gives {expected_text}"


def _progress_differences(
    numbers: list[int], planned: dict[int, Trial], *, complete: bool, blocks: bool
) -> Iterator[str]:
    """Yield errors in the order of trials and attempts.

    With ``blocks`` a resumed session repeats the interrupted block from its first trial.
    """
    previous = 0
    first = {trial.block: number for number, trial in reversed(planned.items())}
    for number in numbers:
        due_numbers = {previous, previous + 1}
        repeated = {first[planned[number].block] for number in due_numbers & planned.keys()} if blocks else set()
        if number not in due_numbers | repeated:
            position = f"after trial {previous}" if previous else "first"
            yield f"trial {number} was presented {position}, but trial {previous + 1} was due"
        previous = number
    last = len(planned)
    if complete and previous < last:
        missing = f"trial {last} was" if previous + 1 == last else f"trials {previous + 1} to {last} were"
        yield f"{missing} not recorded, although the session is complete"

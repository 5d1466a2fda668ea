"""What comes when: protocol, participant and seed give the session's steps, the same on every machine.

Every choice comes from a named stream, a ``random.Random`` seeded by SHA-256 of (seed, name), of which only
``.random()`` is used (the one method Python promises never to change) under our own Fisher–Yates. One name, one
purpose: a draw more in one stream moves no other.

Orders are orders of codes; what a code stands for is drawn once per study by :func:`draw_key` and sealed. So a schedule
gives nothing away.
"""

from __future__ import annotations

import hashlib
import random
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias, TypeVar

from study_app.protocol.model import Block, Protocol

T = TypeVar("T")

Key: TypeAlias = dict[str, dict[str, str]]


def stream(seed: int, name: str) -> random.Random:
    """Return the random stream of that name under that seed; use only its ``.random()``."""
    digest = hashlib.sha256(f"{seed}\n{name}".encode()).digest()
    return random.Random(int.from_bytes(digest, "big"))  # noqa: S311 - reproducible, not secret


def shuffle(items: Iterable[T], draw: Callable[[], float]) -> tuple[T, ...]:
    """Return ``items`` in random order (Fisher–Yates, Durstenfeld's form), with len(items) − 1 calls of ``draw``.

    ``draw`` gives uniform numbers in [0, 1), as ``stream(…).random`` does.
    """
    order = list(items)
    for last in range(len(order) - 1, 0, -1):
        chosen = int(draw() * (last + 1))
        order[last], order[chosen] = order[chosen], order[last]
    return tuple(order)


@dataclass(frozen=True, slots=True)
class PageStep:
    """A page to read."""

    page_id: str


@dataclass(frozen=True, slots=True)
class Trial:
    """One presentation and its answers.

    ``number`` counts from 1 over the session, ``index`` from 1 within the block of ``of`` trials; ``items`` are item
    ids in the order shown.
    """

    number: int
    block: str
    phase: Literal["main", "practice", "baseline"]
    part: int | None
    index: int
    of: int
    code: str
    items: tuple[str, ...]

    def label(self, protocol: Protocol, language: str) -> str:
        """Return the neutral name of the trial: "Liquid setting 1", or just "Practice" where a block has one trial."""
        name = protocol.text(protocol.blocks[self.block].setting_label, language)
        return name if self.phase != "main" and self.of == 1 else f"{name} {self.index}"


Step: TypeAlias = PageStep | Trial


@dataclass(frozen=True, slots=True)
class Schedule:
    """The steps of one participant's session, in order."""

    participant: str
    seed: int
    steps: tuple[Step, ...]

    @property
    def trials(self) -> tuple[Trial, ...]:
        """The trials alone, in order."""
        return tuple(step for step in self.steps if isinstance(step, Trial))


def block_codes(block: Block) -> tuple[str, ...]:
    """Return the codes of a block's conditions: L1, L2, … in a main block, the phase's name elsewhere."""
    if block.code_prefix is None:
        return (block.phase,)
    return tuple(f"{block.code_prefix}{number}" for number in range(1, len(block.conditions) + 1))


def build_schedule(protocol: Protocol, participant: str, seed: int) -> Schedule:
    """Return the session of ``participant``: a pure function of its arguments."""
    steps: list[Step] = []
    number = 0
    for step in protocol.sequence:
        if step in protocol.pages:
            steps.append(PageStep(step))
            continue
        trials = _trials(protocol, protocol.blocks[step], participant, seed, first=number + 1)
        number += len(trials)
        steps.extend(trials)
    return Schedule(participant, seed, tuple(steps))


def _trials(protocol: Protocol, block: Block, participant: str, seed: int, first: int) -> list[Trial]:
    codes = [
        code for repetition in range(1, block.repetitions + 1) for code in _order(block, participant, seed, repetition)
    ]
    return [
        Trial(
            number=first + index - 1,
            block=block.id,
            phase=block.phase,
            part=block.part,
            index=index,
            of=len(codes),
            code=code,
            items=_items(protocol, block, participant, seed, index),
        )
        for index, code in enumerate(codes, start=1)
    ]


def _order(block: Block, participant: str, seed: int, repetition: int) -> tuple[str, ...]:
    codes = block_codes(block)
    if block.order == "fixed":
        return codes
    return shuffle(codes, stream(seed, f"order/{participant}/{block.id}/{repetition}").random)


def _items(protocol: Protocol, block: Block, participant: str, seed: int, index: int) -> tuple[str, ...]:
    questionnaire = protocol.questionnaire_of(block.id)
    if questionnaire is None:
        return ()
    items = tuple(item.id for item in questionnaire.items)
    if questionnaire.item_order == "fixed":
        return items
    return shuffle(items, stream(seed, f"items/{participant}/{block.id}/{index}").random)


def draw_key(protocol: Protocol, draw: Callable[[], float]) -> Key:
    """Return block → code → condition, drawn with ``draw`` (uniform numbers in [0, 1)).

    A block in fixed order keeps its order, as the protocol asks, so its codes name its conditions in the order written:
    whoever reads the protocol can tell them.
    """
    key: Key = {}
    for block in protocol.blocks_in_order:
        conditions = block.conditions if block.order == "fixed" else shuffle(block.conditions, draw)
        key[block.id] = dict(zip(block_codes(block), conditions, strict=True))
    return key

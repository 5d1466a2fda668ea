"""Exactly what scheduling needs to know of a study: no conditions, no texts, no tasks.

It comes from a protocol, or from the protocol without its conditions that a session's receipt holds; both give the same
value, so that an order can be made again without opening the key.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from study_app.errors import StudyError
from study_app.protocol.blocks import Block, Order, Phase
from study_app.protocol.model import Protocol
from study_app.protocol.order_constraint import Constraint


@dataclass(frozen=True, slots=True)
class BlockOrder:
    """A block as scheduling sees it: its codes, how they are ordered, and the ids of what is asked."""

    id: str
    phase: Phase
    part: int | None
    codes: tuple[str, ...]
    order: Order
    max_repeats: int | None
    min_distance: int | None
    repetitions: int
    break_every: int | None
    break_page: str | None
    items: tuple[str, ...]
    item_order: Literal["fixed", "shuffled"]

    @property
    def trials(self) -> int:
        """How many trials a participant does."""
        return len(self.codes) * self.repetitions

    def break_after(self, index: int) -> bool:
        """Return whether a break follows trial ``index`` (from 1)."""
        return self.break_every is not None and index < self.trials and index % self.break_every == 0


@dataclass(frozen=True, slots=True)
class Orders:
    """A study as scheduling sees it: page ids and blocks in the order of the session."""

    study: str
    steps: tuple[str | BlockOrder, ...]

    @property
    def blocks(self) -> tuple[BlockOrder, ...]:
        """The blocks alone, in order."""
        return tuple(step for step in self.steps if isinstance(step, BlockOrder))


def block_codes(block: Block) -> tuple[str, ...]:
    """Return the codes of a block's conditions: L1, L2, … in a main block, the phase's name elsewhere."""
    if block.code_prefix is None:
        return (block.phase,)
    return tuple(f"{block.code_prefix}{number}" for number in range(1, len(block.conditions) + 1))


def orders_of(protocol: Protocol) -> Orders:
    """Return what scheduling needs of a protocol."""
    blocks = {name: _of_block(protocol, block) for name, block in protocol.blocks.items()}
    return Orders(protocol.study.name, tuple(blocks.get(step, step) for step in protocol.sequence))


def _of_block(protocol: Protocol, block: Block) -> BlockOrder:
    questionnaire = protocol.questionnaire_of(block.id)
    return BlockOrder(
        id=block.id,
        phase=block.phase,
        part=block.part,
        codes=block_codes(block),
        order=block.order,
        max_repeats=block.max_repeats,
        min_distance=block.min_distance,
        repetitions=block.repetitions,
        break_every=block.break_every,
        break_page=block.break_page,
        items=() if questionnaire is None else tuple(item.id for item in questionnaire.items),
        item_order="fixed" if questionnaire is None else questionnaire.item_order,
    )


class _Kept(BaseModel):
    """The base of what is read from a receipt, which holds more than is asked for here."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class _KeptBlock(_Kept):
    phase: Phase
    part: int | None
    codes: tuple[str, ...] = Field(min_length=1)
    order: Order
    repetitions: int = Field(ge=1)
    questionnaire: str | None
    max_repeats: int | None = Field(default=None, ge=1)
    min_distance: int | None = Field(default=None, ge=1)
    break_every: int | None = Field(default=None, ge=1)
    break_page: str | None = None


class _KeptItem(_Kept):
    id: str


class _KeptQuestionnaire(_Kept):
    items: tuple[_KeptItem, ...]
    item_order: Literal["fixed", "shuffled"]


class _KeptStudy(_Kept):
    name: str


class _KeptProtocol(_Kept):
    study: _KeptStudy
    sequence: tuple[str, ...]
    blocks: dict[str, _KeptBlock]
    questionnaires: dict[str, _KeptQuestionnaire]


def orders_of_receipt(protocol: Mapping[str, Any]) -> Orders:
    """Return what scheduling needs of the protocol in a receipt: without conditions, blocks with their codes.

    Raises
    ------
    StudyError
        It does not tell the orders: it was changed, or is of a version that this one does not know.
    """
    try:
        kept = _KeptProtocol.model_validate(protocol)
        blocks = {name: _of_kept(kept, name, block) for name, block in kept.blocks.items()}
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise _untold(".".join(str(step) for step in first["loc"]), first["msg"]) from error
    except KeyError as error:
        raise _untold("questionnaires", f"there is no {error}") from error
    for block in blocks.values():
        if block.order != "constrained":
            continue
        constraint = Constraint(block.max_repeats, block.min_distance)
        if (impossible := constraint.impossible(len(block.codes), block.repetitions)) is not None:
            key, sentence = impossible
            raise _untold(f"blocks.{block.id}.{key}", sentence)
    return Orders(kept.study.name, tuple(blocks.get(step, step) for step in kept.sequence))


def _of_kept(protocol: _KeptProtocol, name: str, block: _KeptBlock) -> BlockOrder:
    questionnaire = None if block.questionnaire is None else protocol.questionnaires[block.questionnaire]
    return BlockOrder(
        id=name,
        phase=block.phase,
        part=block.part,
        codes=block.codes,
        order=block.order,
        max_repeats=block.max_repeats,
        min_distance=block.min_distance,
        repetitions=block.repetitions,
        break_every=block.break_every,
        break_page=block.break_page,
        items=() if questionnaire is None else tuple(item.id for item in questionnaire.items),
        item_order="fixed" if questionnaire is None else questionnaire.item_order,
    )


def _untold(place: str, what: str) -> StudyError:
    return StudyError(
        f"the receipt's protocol does not tell the orders ({place}: {what}): it was changed, or written by another "
        "version of the program; restore it from a copy"
    )

"""The part of a study that scheduling needs, without conditions, texts and tasks."""

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from study_app.protocol.blocks import Block, Order, OrderOfBlocks, Phase
from study_app.protocol.model import Protocol, Questionnaire
from study_app.protocol.orders.tracks import tracks_of
from study_app.protocol.trials.methods import TrackOrder

CodeOrder: TypeAlias = Literal[Order, TrackOrder]
"""The order rule of a block's codes, which stand for conditions or for the tracks of a design."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockOrder:
    """The part of a block that scheduling needs: its codes, their order rule, and the ids of its questions.

    ``slots`` is the track length of each code; empty in a block without a design.
    """

    id: str
    phase: Phase
    part: int | None
    codes: tuple[str, ...]
    order: CodeOrder
    repetitions: int
    max_repeats: int | None = None
    min_distance: int | None = None
    break_every: int | None = None
    break_page: str | None = None
    items: tuple[str, ...] = ()
    item_order: Literal["fixed", "shuffled"] = "fixed"
    slots: tuple[int, ...] = ()

    @property
    def trials(self) -> int:
        """The maximum number of trials."""
        return sum(self.slots) if self.slots else len(self.codes) * self.repetitions

    @property
    def breaks(self) -> int:
        """The number of breaks between its trials."""
        return 0 if self.break_every is None else (self.trials - 1) // self.break_every


@dataclass(frozen=True, slots=True)
class FormOrder:
    """The part of a form that scheduling needs: the ids of its questions."""

    id: str
    items: tuple[str, ...]
    item_order: Literal["fixed", "shuffled"]


@dataclass(frozen=True, slots=True)
class Orders:
    """The part of a study that scheduling needs: page ids, blocks and forms in session order.

    ``block_order`` is the rule by which the main blocks are permuted.
    """

    study: str
    steps: tuple[str | BlockOrder | FormOrder, ...]
    block_order: OrderOfBlocks = "fixed"

    @property
    def blocks(self) -> tuple[BlockOrder, ...]:
        """The blocks in session order."""
        return tuple(step for step in self.steps if isinstance(step, BlockOrder))

    @property
    def answers(self) -> int:
        """The maximum number of analysed answers in a complete session: those in main trials and forms."""
        forms = (step for step in self.steps if isinstance(step, FormOrder))
        main = (block.trials * len(block.items) for block in self.blocks if block.phase == "main")
        return sum(main) + sum(len(form.items) for form in forms)


def block_codes(protocol: Protocol, block: Block) -> tuple[str, ...]:
    """Return the codes of a block's conditions or tracks: L1, L2, … in a main block, otherwise the phase's name."""
    count = len(block.conditions) if block.design is None else len(tracks_of(protocol, block))
    if block.code_prefix is None and count == 1:
        return (block.phase,)
    return tuple(f"{block.code_prefix or block.phase}{number}" for number in range(1, count + 1))


def orders_of(protocol: Protocol) -> Orders:
    """Return the part of a protocol that scheduling needs."""
    steps: dict[str, BlockOrder | FormOrder] = {
        name: FormOrder(name, **_question_fields(form)) for name, form in protocol.forms.items()
    }
    steps |= {name: order_of(protocol, block) for name, block in protocol.blocks.items()}
    ordered_steps = tuple(steps.get(step, step) for step in protocol.steps)
    return Orders(protocol.study.name, ordered_steps, protocol.study.block_order)


def order_of(protocol: Protocol, block: Block) -> BlockOrder:
    """Return the part of a block that scheduling needs."""
    order: CodeOrder = block.order
    slots: tuple[int, ...] = ()
    if block.design is not None:
        order = "interleaved" if block.stimulus is None else protocol.method_of(block).order
        slots = tuple(track.slots for track in tracks_of(protocol, block))
    keys = ("phase", "part", "max_repeats", "min_distance", "repetitions", "break_every", "break_page")
    block_fields = {key: getattr(block, key) for key in keys}
    questions = protocol.questionnaire_of(block.id)
    codes, fields = block_codes(protocol, block), block_fields | _question_fields(questions)
    return BlockOrder(id=block.id, codes=codes, order=order, slots=slots, **fields)


def _question_fields(questions: Questionnaire | None) -> dict[str, Any]:
    """Return the fields of `BlockOrder` and `FormOrder` on questions: their IDs and their order rule."""
    if questions is None:
        return {"items": (), "item_order": "fixed"}
    return {"items": tuple(item.id for item in questions.items), "item_order": questions.item_order}

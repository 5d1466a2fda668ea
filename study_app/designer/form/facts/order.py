"""The order of a block's conditions: with how many participants it is balanced."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import Row
from study_app.designer.form.row_facts import RowFacts
from study_app.gui.theme.theme import Tone
from study_app.protocol.orders.sequences import borders_even, row_count
from study_app.protocol.source.document import value_at

ROUNDS: Final = 3
SQUARES: Final[Mapping[Any, Literal["williams", "latin"]]] = {"williams": "williams", "latin": "latin"}


@dataclass(frozen=True, slots=True)
class OrderBalance:
    """Tone, icon and words of the chip of the order, and a sentence that explains it."""

    tone: Tone
    icon: str
    words: str
    sentence: str


def order_balance(study: Study, row: Row) -> OrderBalance | None:
    """Return how balanced the order of a block is; None where it has one condition, or another method orders it."""
    block = value_at(study.document, row.path[:-1])
    conditions = block.get("conditions") if isinstance(block, Mapping) else None
    if not isinstance(conditions, tuple) or len(conditions) < 2 or "design" in block:
        return None
    order, codes = row.default if row.value is None else row.value, len(conditions)
    if order == "fixed":
        return OrderBalance(
            "neutral", "ring", "same for all", "Effects of condition and of position cannot be separated."
        )
    if not isinstance(order, str) or order not in SQUARES:
        return OrderBalance(
            "neutral",
            "ring",
            "balanced on average",
            "Drawn anew in every session: positions are balanced on average only.",
        )
    square, repetitions = SQUARES[order], block.get("repetitions", 1)
    rows = row_count(square, codes)
    numbers = ", ".join(str(rows * number) for number in range(1, ROUNDS + 1))
    carries = square == "williams" and isinstance(repetitions, int) and borders_even(codes, max(1, repetitions))
    if carries or codes == 2:
        return OrderBalance(
            "ok",
            "check",
            f"balanced at {numbers} …",
            f"Positions and carry-over are balanced at every multiple of {rows} participants.",
        )
    return OrderBalance(
        "warn",
        "warning",
        f"in part at {numbers} …",
        f"Only positions are balanced, at every multiple of {rows} participants.",
    )


FACTS: Final = RowFacts((("Block", "order"),), order_balance)

"""Balance of a block's orders over some participants, and with how many it is even."""

from dataclasses import dataclass
from typing import Final

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.balance import Evenness, balances, numbered
from study_app.protocol.orders.sequences import row_count

SEED: Final = 1
"""Of orders that are drawn; those of a square do not depend on it."""


@dataclass(frozen=True, slots=True)
class Balanced:
    """How even a block's orders are.

    A round of its square takes so many participants (``rows``), None where it has none; ``session`` says whose orders,
    where sessions differ.
    """

    order: str
    evenness: Evenness
    rows: int | None
    session: str = ""

    @property
    def last_even(self) -> int:
        """The number of participants of the last full round; 0 where there is none."""
        return 0 if self.rows is None else self.evenness.orders - self.evenness.orders % self.rows

    @property
    def next_even(self) -> int | None:
        """The next number of participants that fills a round; None without a square."""
        people = self.evenness.orders
        return None if self.rows is None else people + -people % self.rows


def balance_of(protocol: Protocol, block: Block, participants: int) -> Balanced | None:
    """Return how even the orders of a block are; None where it has one code."""
    for judged in balances(protocol, numbered(participants), SEED):
        for one in judged.blocks:
            if one.id == block.id:
                codes = len(one.evenness.codes)
                rows = row_count(one.order, codes) if one.order in ("williams", "latin") else None
                return Balanced(one.order, one.evenness, rows, judged.session)
    return None

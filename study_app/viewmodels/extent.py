"""How much a session asks of a participant; where sessions differ, from the least to the most. No Qt here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from study_app.protocol.describe import spread
from study_app.protocol.groups.own_protocol import variants
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.durations import expected_duration_s


@dataclass(frozen=True, slots=True)
class Extent:
    """Parts, settings, answers and expected duration [s] of each kind of session of a study.

    ``setting`` is the word for what a trial presents: a "setting", or a "trial" where blocks have designs.
    """

    parts: tuple[int, ...]
    settings: tuple[int, ...]
    setting: str
    answers: tuple[int, ...]
    expected_s: tuple[float, ...]

    @property
    def minutes(self) -> str:
        """The expected duration in whole minutes."""
        return f"{spread([max(1, round(expected_s / 60)) for expected_s in self.expected_s])} min"


def extent_of(protocol: Protocol) -> Extent:
    """Return how much the sessions of a study ask; of one session where its own protocol is given."""
    sessions = [one.protocol for one in variants(protocol)]
    orders = [orders_of(one) for one in sessions]
    return Extent(
        parts=tuple(one.parts for one in sessions),
        settings=tuple(sum(block.trials for block in one.blocks if block.phase == "main") for one in orders),
        setting="setting" if all(block.design is None for block in protocol.blocks.values()) else "trial",
        answers=tuple(one.answers for one in orders),
        expected_s=tuple(expected_duration_s(one) for one in sessions),
    )


def counted_each(numbers: Sequence[int], word: str) -> str:
    """Return "1 part", "2 parts", or "1 to 2 parts" where sessions differ."""
    return f"{spread(numbers)} {word}" if set(numbers) == {1} else f"{spread(numbers)} {word}s"

"""How much a session asks of a participant; where sessions differ, from the least to the most. No Qt here."""

from collections.abc import Sequence
from dataclasses import dataclass

from study_app.protocol.describe import spread
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.durations import expected_duration_s, variants
from study_app.viewmodels.number_words import duration_range


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
    def duration(self) -> str:
        """The expected duration, from that of the shortest kind of session to that of the longest."""
        return duration_range(min(self.expected_s), max(self.expected_s))


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
